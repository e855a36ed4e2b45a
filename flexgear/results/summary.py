"""``summary.json``: the figures of a run, for programs.

`steady_summary` and `torque_step_summary` take figures out of datasets; `build_summary` puts the
pieces together and refuses a summary that is incomplete or holds anything but finite numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.results.contact_share import pairs_in_contact
from flexgear.results.flanks import carrying_pairs, flank_histories, GEARS
from flexgear.results.harmonics import radial_harmonics
from flexgear.results.pieces import ranges_of
from flexgear.results.sinks import TIME

ORDERS = 21  # radial harmonics 0 … 20
RPM = 60 / (2 * math.pi)
MICRO = 1e6

_REDUCTION = (
    "interface_dofs",
    "fixed_interface_modes",
    "static_error",
    "frequency_error",
    "frequency_limit_hz",
)
_STEP = (
    "carrier_speed_rpm_min",
    "tooth_load_n_min",
    "load_sharing_max",
    "planet_force_spread_max",
)
REQUIRED: dict[str, Any] = {
    "case": None,
    "version": None,
    "content_hash": None,
    "fe": {"ring": ("dofs",), "carrier": ("dofs",)},
    "reduction": {"ring": _REDUCTION, "carrier": _REDUCTION},
    "second_reduction": {"*": ("kept_modes", "modes_limit_hz", "modes_estimate")},
    "kinematics": (
        "carrier_speed_rpm",
        "sun_speed_rpm",
        "gear_mesh_frequency_hz",
        "contact_ratio_ring",
        "contact_ratio_sun",
        "expected_ring_mesh_force_n",
    ),
    "steady": {
        "carrier_speed_rpm_mean": None,
        "ring_mesh_force_n_mean": None,
        "ring_pairs_in_contact": None,
        "tooth_displacement_peak_um": ("x", "y", "z"),
        "radial_harmonics_um": None,
        "load_sharing": {"*": ("mean", "max")},
    },
    "torque_steps": {"*": {"*": _STEP}},
    "energy_residual": None,
    "warnings": None,
    "timing_s": None,
    "realtime_factor": None,
}


def steady_summary(
    flexible: xr.Dataset,
    rated_equilibrium: xr.Dataset,
    load_sharing: Mapping[str, xr.Dataset],
) -> dict[str, Any]:
    """Figures of steady running.

    flexible: the run over one revolution; rated_equilibrium: equilibria at rated torque whose
    first position gives the radial harmonics; load_sharing: steady runs by variant.
    """
    found = ranges_of(flexible, _steady_histories)
    least, mean, largest = found.least, found.mean, found.largest
    node = np.fmax(-least["tooth_node"].to_numpy(), largest["tooth_node"].to_numpy())
    shares = mean["pairs_in_contact"].mean("planet").to_numpy()
    harmonics = np.abs(radial_harmonics(rated_equilibrium["tooth_displacement"].to_numpy()[0]))
    return {
        "carrier_speed_rpm_mean": float(mean["carrier_speed"]) * RPM,
        # over whole tooth passages, as the run is over the revolution
        "ring_mesh_force_n_mean": float(mean["ring_gear_mesh_force"].mean()),
        "ring_pairs_in_contact": {str(n): float(s) for n, s in enumerate(shares) if s},
        "tooth_displacement_peak_um": {
            a: float(v) * MICRO for a, v in zip("xyz", node, strict=True)
        },
        "radial_harmonics_um": [float(v) * MICRO for v in harmonics[:ORDERS]],
        "load_sharing": {name: sharing_summary(data) for name, data in load_sharing.items()},
    }


def _steady_histories(data: xr.Dataset) -> xr.Dataset:
    """What of steady running the summary looks at."""
    tooth = carrying_pairs(data, "ring")["tooth"]
    return data[["carrier_speed", "ring_gear_mesh_force"]].assign(
        tooth_node=data["tooth_displacement"].isel(tooth=0, drop=True),
        pairs_in_contact=pairs_in_contact(tooth > 0),
    )


def stage_histories(data: xr.Dataset) -> xr.Dataset:
    """What of a transient the command line gives the range of."""
    names = ["carrier_speed", "ring_gear_mesh_force", "load_sharing", "planet_force_spread"]
    found = data[names]
    for gear in GEARS:
        flanks = flank_histories(data, gear)
        found = found.assign({f"{gear}_{name}": flanks[name] for name in map(str, flanks)})
    return found


def sharing_summary(data: xr.Dataset) -> dict[str, float | None]:
    """Mean and largest load sharing factor of a run where it is defined, None where nowhere."""
    if TIME in data.dims:
        found = ranges_of(data, lambda piece: piece[["load_sharing"]])
        mean, largest = found.mean["load_sharing"], found.largest["load_sharing"]
    else:
        mean, largest = data["load_sharing"].mean(), data["load_sharing"].max()
    return {"mean": _number(mean), "max": _number(largest)}


def _number(value: xr.DataArray) -> float | None:
    return float(value) if np.isfinite(value) else None


def torque_step_summary(data: xr.Dataset) -> dict[str, float | None]:
    """Figures of one torque drop: slowest speed, lowest tooth load, load sharing, spread.

    The lowest tooth load is that of all pairs at work on the flank that carries (negative with
    linear contact only); slots without a pair do not count.
    """
    found = ranges_of(data, stage_histories)
    lowest = [f for gear in GEARS if np.isfinite(f := float(found.least[f"{gear}_load"].min()))]
    if not lowest:
        raise FlexgearError("no tooth pair was in contact during the torque step")
    return {
        "carrier_speed_rpm_min": float(found.least["carrier_speed"]) * RPM,
        "tooth_load_n_min": min(lowest),
        "load_sharing_max": _number(found.largest["load_sharing"]),
        "planet_force_spread_max": float(found.largest["planet_force_spread"]),
    }


def build_summary(**pieces: Any) -> dict[str, Any]:
    """The summary from its pieces (keywords are the keys of ``REQUIRED``), in plain types.

    Further keys are kept. Raises FlexgearError naming every missing key and every value that is
    not finite.
    """
    summary = plain(pieces)
    faults = [f"{key} is missing" for key in missing(summary, REQUIRED)]
    harmonics = summary.get("steady", {}).get("radial_harmonics_um")
    if isinstance(harmonics, Sequence) and len(harmonics) != ORDERS:
        faults.append(f"steady.radial_harmonics_um has {len(harmonics)} orders, not {ORDERS}")
    faults += [f"{key} is not a finite number" for key in not_finite(summary)]
    if faults:
        raise FlexgearError("the summary is incomplete: " + "; ".join(faults))
    return summary


def finite(figures: Mapping[str, float]) -> dict[str, float | None]:
    """Figures with None where one is infinite, which a summary cannot hold."""
    return {name: value if math.isfinite(value) else None for name, value in figures.items()}


def plain(value: Any) -> Any:
    """Mappings, lists, text and Python numbers only, from numpy and xarray values."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, xr.DataArray):
        value = value.to_numpy()
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise FlexgearError(f"a summary cannot hold a {type(value).__name__}")


def missing(found: Any, wanted: Any, at: str = "") -> Iterator[str]:
    """Dotted names in ``wanted`` that ``found`` lacks; "*" stands for any names."""
    if wanted is None:
        return
    if not isinstance(found, Mapping):
        yield at
        return
    names = wanted if isinstance(wanted, Mapping) else dict.fromkeys(wanted)
    for name, inner in names.items():
        if name == "*":
            for key, value in found.items():
                yield from missing(value, inner, f"{at}.{key}")
        elif name not in found:
            yield f"{at}.{name}".lstrip(".")
        else:
            yield from missing(found[name], inner, f"{at}.{name}".lstrip("."))


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
