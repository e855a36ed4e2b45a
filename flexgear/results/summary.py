"""``summary.json``: the figures of a run, for programs.

`steady_summary` and `torque_step_summary` take figures out of datasets; `build_summary` puts the
pieces together and refuses a summary that is incomplete or holds anything but finite numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, cast

import numpy as np
import xarray as xr

from flexgear.files.plain import plain
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.model.units import RPM
from flexgear.results.contact_share import pairs_in_contact
from flexgear.results.flanks import carrying_pairs, flank_histories, GEARS
from flexgear.results.harmonics import radial_harmonics
from flexgear.results.pieces import ranges_of
from flexgear.results.sinks import TIME, Ranges
from flexgear.results.stage_part import (
    halves,
    of_kind,
    ring_force_spread,
    ring_sharing,
    stage_part,
)
from flexgear.results.group_sharing import sharing_figures
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.summary_keys import VERSION, lacking

ORDERS = 21  # radial harmonics 0 … 20
CENTRAL = ("sun", "carrier", "ring", "pinion", "gear")
MICRO = 1e6

LOWEST = 12  # modes that a summary lists
UNMOVED = 1e-9  # of the largest distance of any body, rounding


def steady_summary(
    runs: Mapping[str, xr.Dataset], rated_equilibrium: xr.Dataset, stage: str
) -> dict[str, Any]:
    """Figures of steady running of one flexible stage.

    runs: over one revolution, by variant, that of the case as it is first; rated_equilibrium:
    equilibria at rated torque whose first position gives the radial harmonics.
    """
    ranges = ranges_of(next(iter(runs.values())), lambda x: _steady_histories(x, stage))
    static = stage_part(rated_equilibrium.isel(position=slice(1)), stage)
    least, mean, largest = ranges.least, ranges.mean, ranges.largest
    node = np.fmax(-least["tooth_node"].to_numpy(), largest["tooth_node"].to_numpy())
    shares = mean["pairs_in_contact"].mean("planet").to_numpy()
    harmonics = np.abs(radial_harmonics(static["tooth_displacement"].to_numpy()[0]))
    return {
        "carrier_speed_rpm_mean": float(mean["stage_speed"]) * RPM,
        # over whole tooth passages, as the run is over the revolution
        "ring_mesh_force_n_mean": float(mean["ring_mesh_force"]),
        "ring_pairs_in_contact": {str(n): float(s) for n, s in enumerate(shares) if s},
        "tooth_displacement_peak_um": {
            a: float(v) * MICRO for a, v in zip("xyz", node, strict=True)
        },
        "radial_harmonics_um": [float(v) * MICRO for v in harmonics[:ORDERS]],
        "load_sharing": {name: sharing_summary(data, stage) for name, data in runs.items()},
    }


def rim_stress_summary(equilibria: xr.Dataset, stage: str) -> dict[str, dict[str, float]]:
    """``rim_stress_mpa``: least and largest stress along the circumference on the outer surface of a
    ring, over all teeth and positions, and how far it ranges at one place as planets pass: at the
    place where it ranges farthest, and on average over the places. Empty without FE mesh."""
    if "rim_stress" not in equilibria:
        return {}
    stress = equilibria["rim_stress"].to_numpy()[:, equilibria["tooth_stage"].to_numpy() == stage]
    if not np.isfinite(stress).all():
        return {}
    ranges = stress.max(axis=0) - stress.min(axis=0)
    figures = {"min": stress.min(), "max": stress.max(), "range_max": ranges.max()}
    figures["range_mean"] = ranges.mean()
    return {"rim_stress_mpa": {name: float(value) / 1e6 for name, value in figures.items()}}


def _steady_histories(whole: xr.Dataset, stage: str) -> xr.Dataset:
    """What of steady running the summary looks at."""
    data = stage_part(whole, stage)
    tooth = carrying_pairs(data, "ring")["tooth"]
    forces = of_kind(stage_part(whole, stage, ""), "ring")["gear_mesh_force"]
    return data[["stage_speed"]].assign(
        ring_mesh_force=forces.mean("gear_mesh", dtype=float),
        tooth_node=data["tooth_displacement"].isel(tooth=0, drop=True),
        pairs_in_contact=pairs_in_contact(tooth > 0),
    )


HISTORIES = (  # variables of a run that those of a stage come from
    "stage_speed", "gear_mesh_force", "rated_gear_mesh_force", "load_sharing", "pair_load",
    "pair_tooth",
)  # fmt: skip


def stage_histories(data: xr.Dataset) -> xr.Dataset:
    """What of a transient the command line gives the range of."""
    histories = data[["stage_speed"]].assign(
        ring_force=of_kind(data, "ring")["gear_mesh_force"],
        load_sharing=ring_sharing(data),
        planet_force_spread=ring_force_spread(data),
    )
    for gear in GEARS:
        flanks = flank_histories(data, gear)
        histories = histories.assign({f"{gear}_{name}": flanks[name] for name in map(str, flanks)})
    return histories


def sharing_summary(data: xr.Dataset, stage: str) -> dict[str, float | None]:
    """Mean and largest load sharing factor at a stage's ring where it is defined, None where
    nowhere; of a double-helical one the mean is that of the half where it is largest."""

    def of_ring(piece: xr.Dataset) -> xr.Dataset:
        return of_kind(stage_part(piece[["load_sharing"]], stage, ""), "ring")

    if TIME in data.dims:
        ranges = ranges_of(data, of_ring)
        mean, largest = ranges.mean["load_sharing"].max(), ranges.largest["load_sharing"].max()
    else:
        sharing = of_ring(data)["load_sharing"]
        mean, largest = sharing.mean("position").max(), sharing.max()
    return {"mean": _number(mean), "max": _number(largest)}


def _number(value: xr.DataArray) -> float | None:
    return float(value) if np.isfinite(value) else None


def torque_step_summary(data: xr.Dataset, stage: str) -> dict[str, float | None]:
    """Figures of one torque drop of a flexible stage, of both halves of a double-helical one:
    slowest speed, lowest tooth load, load sharing, spread.

    The lowest tooth load is that of all pairs at work on the flank that carries (negative with
    linear contact only); slots without a pair do not count.
    """

    data = data[[name for name in HISTORIES if name in data]]

    def of_half(half: str) -> Ranges:
        return ranges_of(data, lambda piece: stage_histories(stage_part(piece, stage, half)))

    parts = [of_half(half) for half in halves(data, stage)]
    lowest = [
        load
        for part in parts
        for gear in GEARS
        if np.isfinite(load := float(part.least[f"{gear}_load"].min()))
    ]
    if not lowest:
        raise FlexgearError("no tooth pair was in contact during the torque step")
    return {
        "carrier_speed_rpm_min": float(parts[0].least["stage_speed"]) * RPM,
        "tooth_load_n_min": min(lowest),
        "load_sharing_max": sharing_summary(data, stage)["max"],
        "planet_force_spread_max": max(float(p.largest["planet_force_spread"]) for p in parts),
    }


def drop_summary(data: xr.Dataset) -> dict[str, Any]:
    """Figures of one torque drop of any case: slowest speeds of members of given speed, least and
    largest gear-mesh forces of every group, largest load sharing."""
    ranges = ranges_of(data, lambda x: x[["input_speed", "gear_mesh_force", "load_sharing"]])
    forces = (part["gear_mesh_force"] for part in (ranges.least, ranges.mean, ranges.largest))
    slowest, shared = ranges.least["input_speed"], ranges.largest["load_sharing"]
    return {
        "speed_rpm_min": {
            str(m): float(w) * RPM
            for m, w in zip(slowest["input_coordinate"].to_numpy(), slowest.to_numpy(), strict=True)
        },
        "gear_mesh_force": force_ranges(*forces),
        "load_sharing": {str(g): _number(shared.sel(group=g)) for g in shared["group"].to_numpy()},
    }


def build_summary(**pieces: Any) -> dict[str, Any]:
    """The summary from its pieces (keywords are keys of ``summary_keys``), in plain types.

    Further keys are kept; what has no number is None. Raises FlexgearError naming every missing key and every value that is
    not finite.
    """
    summary = plain({"schema_version": VERSION, **pieces})
    faults = [f"{key} is missing" for key in lacking(summary)]
    for stage, figures in summary.get("steady", {}).items():
        harmonics = figures.get("radial_harmonics_um", [])
        if len(harmonics) != ORDERS:
            key = f"steady.{stage}.radial_harmonics_um"
            faults.append(f"{key} has {len(harmonics)} orders, not {ORDERS}")
    faults += [f"{key} is not a finite number" for key in not_finite(summary)]
    if faults:
        raise FlexgearError("the summary is incomplete: " + "; ".join(faults))
    return summary


def finite(figures: Mapping[str, float]) -> dict[str, float | None]:
    """Figures with None where one is infinite, which a summary cannot hold."""
    return {name: value if math.isfinite(value) else None for name, value in figures.items()}


def not_finite(value: Any, at: str = "") -> Iterator[str]:
    """Dotted names of numbers that are infinite or not a number."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from not_finite(inner, f"{at}.{key}".lstrip("."))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from not_finite(inner, f"{at}[{i}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield at


def modes_summary(data: xr.Dataset) -> dict[str, Any]:
    """Lowest modes, repeated ones once, and how many of each type there are."""
    lowest: list[dict[str, Any]] = []
    for k in range(data.sizes["mode"]):
        f, kind = float(data["frequency"][k]), str(data["type"][k].item())
        same = bool(lowest) and lowest[-1]["type"] == kind
        if same and abs(f - lowest[-1]["frequency_hz"]) <= 1e-6 * f:
            continue
        times = int(data["multiplicity"][k])
        lowest.append({"frequency_hz": f, "type": kind, "multiplicity": times})
        if len(lowest) == LOWEST:
            break
    kinds = [str(k) for k in data["type"].to_numpy()]
    return {"lowest": lowest, "types": {k: kinds.count(k) for k in dict.fromkeys(kinds)}}


def sharing_summary_of(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Coefficients of every group of gear meshes that shares a load, by group and definition."""
    if "group" not in data.dims:
        return {}
    return {str(g): sharing_figures(data, str(g)) for g in data["group"].to_numpy()}


def displacement_summary(data: xr.Dataset) -> dict[str, float]:
    """Largest distance from the axis of every central member over the samples, µm."""
    far = axis_distance(data)
    return distance_summary(far.max([d for d in far.dims if d != "body"]))


def axis_distance(data: xr.Dataset) -> xr.DataArray:
    """Distance of all bodies from the axis, m."""
    motion = data["body_displacement"]
    ux, uy = (motion.sel(dof=dof, drop=True) for dof in ("ux", "uy"))
    return cast(xr.DataArray, np.hypot(ux, uy))


def distance_summary(largest: xr.DataArray) -> dict[str, float]:
    """Largest distances from the axis of central members, µm, of those (body,) of all bodies, m."""
    far = central_distance(largest, largest)
    sizes = zip(far["body"].to_numpy(), far.to_numpy(), strict=True)
    return {str(n): float(v) * MICRO for n, v in sizes}


def central_distance(far: xr.DataArray, largest: xr.DataArray) -> xr.DataArray:
    """Of distances from the axis (…, body) those of central members, none where the largest (body,)
    is rounding beside that of other bodies."""
    names = [str(n) for n in far["body"].to_numpy()]
    central = [n for n in names if BodyName.parse(n).part in CENTRAL]
    return far.where(largest > UNMOVED * largest.max(), 0.0).sel(body=central)


def force_ranges(
    least: xr.DataArray, mean: xr.DataArray, largest: xr.DataArray
) -> dict[str, Mapping[str, float]]:
    """Least, mean and largest force of every group, of those (gear_mesh,) of gear meshes, N."""
    return {
        group: {
            "min_n": float(least.to_numpy()[at].min()),
            "mean_n": float(mean.to_numpy()[at].mean()),
            "max_n": float(largest.to_numpy()[at].max()),
        }
        for group, at in groups_in(least).items()
    }
