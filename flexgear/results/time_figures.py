"""Figures of transients: steady running, torque drops, distances from the axis.

They are computed from ranges (``Ranges``), the smallest, mean and largest values over time, since
transients are processed in pieces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.analysis.kernels.energy import LEFT_OVER
from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.names import BodyName
from flexgear.model.units import RPM
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.quantities import ALWAYS, WITH_SECTION, Figure, number, values
from flexgear.results.sinks import TIME, Ranges, ranges_of
from flexgear.results.stage_part import (
    GEARS,
    carrying_pairs,
    flank_histories,
    halves,
    has_pairs,
    of_kind,
    pairs_in_contact,
    ring_force_spread,
    ring_sharing,
    stage_part,
)

ORDERS = 21  # radial harmonics 0 … 20
CENTRAL = ("sun", "carrier", "ring", "pinion", "gear")
MICRO = 1e6
DISTANCE_ROUNDING = 1e-7  # of the largest distance of any body; films leave 3e-8
HISTORIES = (  # variables of a run that ``stage_histories`` needs
    "stage_speed", "gear_mesh_force", "rated_gear_mesh_force", "load_sharing", "pair_load",
    "pair_tooth",
)  # fmt: skip


def axis_distance(data: xr.Dataset) -> xr.DataArray:
    """Distance of all bodies from the axis, m."""
    motion = data["body_displacement"]
    ux, uy = (motion.sel(dof=dof, drop=True) for dof in ("ux", "uy"))
    return cast(xr.DataArray, np.hypot(ux, uy))


def central_distance(distances: xr.DataArray, largest: xr.DataArray) -> xr.DataArray:
    """Distances from the axis (…, body) of the central members, zero for members whose largest
    distance (body,) is rounding."""
    names = [str(n) for n in distances["body"].to_numpy()]
    central = [n for n in names if BodyName.parse(n).part in CENTRAL]
    return distances.where(largest > DISTANCE_ROUNDING * largest.max(), 0.0).sel(body=central)


def distance_summary(largest: xr.DataArray) -> dict[str, float]:
    """Largest distances of central members from the axis, µm, from those (body,) of all bodies,
    m."""
    return _by_label(central_distance(largest, largest), MICRO)


def displacement_summary(data: xr.Dataset) -> dict[str, float]:
    """Largest distance of each central member from the axis over the samples, µm."""
    distances = axis_distance(data)
    return distance_summary(distances.max([d for d in distances.dims if d != "body"]))


def force_ranges(ranges: Ranges) -> dict[str, Mapping[str, float]]:
    """Smallest, mean and largest force of each group of gear meshes, N."""
    least, mean, largest = (
        part["gear_mesh_force"] for part in (ranges.least, ranges.mean, ranges.largest)
    )
    return {
        group: {
            "min_n": float(least.to_numpy()[at].min()),
            "mean_n": float(mean.to_numpy()[at].mean()),
            "max_n": float(largest.to_numpy()[at].max()),
        }
        for group, at in groups_in(least).items()
    }


FORCES = (  # of ranges in the window of a transient
    Figure("gear_mesh_force.<group>.min_n", "N", "least force of a gear mesh",
           of=force_ranges, label="{name}, least"),
    Figure("gear_mesh_force.<group>.mean_n", "N", "mean", label="{name}, mean"),
    Figure("gear_mesh_force.<group>.max_n", "N", "largest", label="{name}, largest"),
)  # fmt: skip
DISTANCES = (
    Figure("displacement_um_max.<member>", "µm",
           "largest distance of a central member from the axis", ALWAYS,
           lambda ranges: distance_summary(ranges.largest["axis_distance"]), "{name}"),
)  # fmt: skip
TRANSIENT = (*FORCES, *DISTANCES)


def stage_histories(whole: xr.Dataset, stage: str, half: str = "left") -> xr.Dataset:
    """Histories of a flexible stage, or of one half, whose ranges are printed; without loads of
    pairs where waves of stiffness stand for them."""
    data = stage_part(whole, stage, half)
    histories = data[["stage_speed"]].assign(
        ring_force=of_kind(data, "ring")["gear_mesh_force"],
        load_sharing=ring_sharing(data),
        planet_force_spread=ring_force_spread(data),
    )
    for gear in GEARS if has_pairs(data) else ():
        flanks = flank_histories(data, gear)
        histories = histories.assign({f"{gear}_{name}": flanks[name] for name in map(str, flanks)})
    return histories


def sharing_summary(data: xr.Dataset, stage: str) -> dict[str, float | None]:
    """Mean and largest load sharing factor at a stage's ring, None if it is undefined; for a
    double-helical stage the larger values of both halves."""

    def of_ring(piece: xr.Dataset) -> xr.Dataset:
        return of_kind(stage_part(piece[["load_sharing"]], stage, ""), "ring")

    if TIME in data.dims:
        ranges = ranges_of(data, of_ring)
        mean, largest = ranges.mean["load_sharing"].max(), ranges.largest["load_sharing"].max()
    else:
        sharing = of_ring(data)["load_sharing"]
        mean, largest = sharing.mean("position").max(), sharing.max()
    return {"mean": number(mean), "max": number(largest)}


def slowest(ranges: Ranges, name: str) -> xr.DataArray:
    """Slowest speed in the sense of the first one; of the other sign if the sense changes."""
    return ranges.least[name].where(ranges.first[name] >= 0.0, ranges.largest[name])


DROP = (  # of ranges from the drop on
    Figure("speed_rpm_min.<member>", "1/min", "slowest speed of members with given speed", ALWAYS,
           lambda ranges: _by_label(slowest(ranges, "input_speed"), RPM), "slowest speed, {name}"),
    Figure("load_sharing.<group>", "1", "largest momentary load sharing factor", ALWAYS,
           lambda ranges: _by_label(ranges.largest["load_sharing"]),
           "largest load sharing factor, {name}"),
    Figure("gear_mesh_force.<group>.min_n", "N", "least force of a gear mesh", of=force_ranges),
    Figure("gear_mesh_force.<group>.mean_n", "N", "mean"),
    Figure("gear_mesh_force.<group>.max_n", "N", "largest", ALWAYS, label="largest force, {name}"),
)  # fmt: skip


def drop_summary(data: xr.Dataset) -> dict[str, Any]:
    """Figures (``DROP``) of one torque drop."""
    names = ["input_speed", "gear_mesh_force", "load_sharing"]
    return values(DROP, ranges_of(data, lambda piece: piece[names]))


@dataclass(frozen=True)
class StageDrop:
    """A torque drop of a stage with an FE ring, with both halves of a double-helical stage."""

    data: xr.Dataset
    stage: str

    @cached_property
    def parts(self) -> list[Ranges]:
        """Ranges of ``stage_histories`` by half."""
        data = self.data[[name for name in HISTORIES if name in self.data]]

        def of_half(half: str) -> Ranges:
            return ranges_of(data, lambda piece: stage_histories(piece.load(), self.stage, half))

        return [of_half(half) for half in halves(data, self.stage)]

    def lowest_load(self) -> float | None:
        """Lowest load of the pairs on the loaded flank, N (negative only with linear contact); None
        where waves of stiffness stand for pairs."""
        if not has_pairs(self.data):
            return None
        loads = [float(part.least[f"{gear}_load"].min()) for part in self.parts for gear in GEARS]
        lowest = [load for load in loads if np.isfinite(load)]
        if not lowest:
            raise FlexgearError("no tooth pair was in contact during the torque step")
        return min(lowest)


STAGE_DROP = (
    Figure("carrier_speed_rpm_min", "1/min", "slowest speed of the pins against the ring",
           of=lambda drop: float(slowest(drop.parts[0], "stage_speed")) * RPM),
    Figure("tooth_load_n_min", "N", "smallest load of a pair on the loaded flank",
           of=StageDrop.lowest_load, label="lowest load of a tooth pair"),
    Figure("planet_force_spread_max", "1", "largest (max F − min F) / rated mean F at the ring",
           of=lambda drop: max(float(p.largest["planet_force_spread"]) for p in drop.parts)),
)  # fmt: skip


def harmonics(shape: ArrayLike) -> NDArray[np.complex128]:
    """Fourier coefficients c_n (..., z//2 + 1) of values (..., z) at equally spaced angles from 0.

    f(φ) = Re Σ c_n e^(−i n φ); c_0 and, for even z, the highest coefficient are not doubled.
    """
    v = np.asarray(shape, dtype=float)
    z = v.shape[-1]
    c = np.conj(np.fft.rfft(v, axis=-1)) * (2 / z)
    c[..., 0] /= 2
    if z % 2 == 0:
        c[..., -1] /= 2
    return np.asarray(c)


def radial(displacement: ArrayLike) -> Array:
    """Radial part u_x cos φ + u_y sin φ (..., z) of tooth-node displacements (..., z, 2 or 3) in
    fixed axes, the first tooth at angle 0; InputError for another shape."""
    u = np.asarray(displacement, dtype=float)
    if u.ndim < 2 or u.shape[-1] not in (2, 3):
        remedy = "give (..., teeth, 2 or 3), as tooth_displacement of a dataset"
        raise InputError("--displacement", str(u.shape), "is not the shape of tooth nodes", remedy)
    phi = 2 * np.pi * np.arange(u.shape[-2]) / u.shape[-2]
    return np.asarray(u[..., 0] * np.cos(phi) + u[..., 1] * np.sin(phi))


def radial_harmonics(displacement: ArrayLike) -> NDArray[np.complex128]:
    """``harmonics``, m, of the ``radial`` part of tooth-node displacements (..., z, 2 or 3)."""
    return harmonics(radial(displacement))


def star_angle(coefficients: NDArray[np.complex128], order: int) -> Array:
    """Angle arg(c_order)/order (...,) of a crest of an order, rad, in [0, 2π/order)."""
    period = 2 * np.pi / order
    return np.asarray(np.mod(np.angle(coefficients[..., order]) / order, period))


@dataclass(frozen=True)
class SteadyRun:
    """A stage with an FE ring in steady running.

    runs: transients over one revolution by variant, first that of the case; star: equilibria at
    rated torque, the first of which gives the ring's shape.
    """

    stage: str
    runs: Mapping[str, xr.Dataset]
    star: xr.Dataset

    @cached_property
    def ranges(self) -> Ranges:
        """Ranges of the variant of the case."""
        return ranges_of(next(iter(self.runs.values())), self._histories)

    def _histories(self, whole: xr.Dataset) -> xr.Dataset:
        data = stage_part(whole, self.stage)
        node = data["tooth_displacement"].isel(tooth=0, drop=True)
        histories = data[["stage_speed"]].assign(tooth_node=node)
        if has_pairs(data):
            teeth = carrying_pairs(data, "ring", parts=("load", "tooth"))["tooth"]
            histories["pairs_in_contact"] = pairs_in_contact(teeth > 0)
        return histories

    def pairs(self) -> dict[str, float]:
        """Share of time with 0, 1, 2 … tooth pairs in contact, by number of pairs; empty without
        pairs."""
        if "pairs_in_contact" not in self.ranges.mean:
            return {}
        shares = self.ranges.mean["pairs_in_contact"].mean("planet").to_numpy()
        return {str(n): float(s) for n, s in enumerate(shares) if s}

    def peak(self) -> dict[str, float]:
        """Largest displacement of ring tooth 1 by axis, µm."""
        ends = self.ranges.least["tooth_node"], self.ranges.largest["tooth_node"]
        node = np.fmax(-ends[0].to_numpy(), ends[1].to_numpy())
        return {a: float(v) * MICRO for a, v in zip("xyz", node, strict=True)}

    def harmonics(self) -> list[float]:
        """Amplitudes of the radial shape of the ring by order, µm."""
        first = stage_part(self.star.isel(position=slice(1)), self.stage)["tooth_displacement"]
        sizes = np.abs(radial_harmonics(first.to_numpy()[0]))
        return [float(v) * MICRO for v in sizes[:ORDERS]]

    def sharing(self) -> dict[str, dict[str, float | None]]:
        """Mean and largest load sharing factor at the ring, by variant."""
        return {name: sharing_summary(data, self.stage) for name, data in self.runs.items()}


STEADY = (
    Figure("carrier_speed_rpm_mean", "1/min", "mean speed of the pins to the ring", WITH_SECTION,
           lambda run: float(run.ranges.mean["stage_speed"]) * RPM),
    Figure("ring_pairs_in_contact.<number>", "1", "share of time with so many pairs in contact",
           WITH_SECTION, SteadyRun.pairs),
    Figure("tooth_displacement_peak_um.<axis>", "µm", "largest displacement of ring tooth 1",
           WITH_SECTION, SteadyRun.peak, "along {name}"),
    Figure("radial_harmonics_um", "µm", "amplitudes 0 … 20, of few teeth 0 … z/2, of the ring's "
           "shape in the first equilibrium without errors", WITH_SECTION, SteadyRun.harmonics),
    Figure("load_sharing.<variant>.mean", "1", "mean load sharing factor at the ring",
           WITH_SECTION, SteadyRun.sharing),
    Figure("load_sharing.<variant>.max", "1", "largest", WITH_SECTION),
)  # fmt: skip


def rim_stress(equilibria: xr.Dataset, stage: str) -> dict[str, float]:
    """Hoop stress on the outer surface of a ring, MPa: "min" and "max" over teeth and positions,
    largest and mean range over the positions, "range_max", "range_mean"; empty without FE mesh."""
    if "rim_stress" not in equilibria:
        return {}
    stress = stage_part(equilibria[["rim_stress"]], stage, "")["rim_stress"].to_numpy()
    if not np.isfinite(stress).all():
        return {}
    ranges = stress.max(axis=0) - stress.min(axis=0)
    sizes = {"min": stress.min(), "max": stress.max(), "range_max": ranges.max()}
    sizes["range_mean"] = ranges.mean()
    return {name: float(value) / 1e6 for name, value in sizes.items()}


RIM = (  # of ``rim_stress``
    Figure("rim_stress_mpa.min", "MPa", "smallest hoop stress on the outer surface of the ring, "
           "at any tooth in equilibria over a revolution", of=dict, label="least"),
    Figure("rim_stress_mpa.max", "MPa", "largest of these stresses", label="largest"),
    Figure("rim_stress_mpa.range_max", "MPa", "largest range of this stress at one point",
           label="range at one point as planets pass, largest"),
    Figure("rim_stress_mpa.range_mean", "MPa", "mean of the ranges over all points",
           label="range at one point as planets pass, mean"),
)  # fmt: skip


def _by_label(sizes: xr.DataArray, by: float = 1.0) -> dict[str, Any]:
    """Values (n,) by the labels of their axis, None for NaN."""
    pairs = zip(sizes[sizes.dims[0]].to_numpy(), sizes.to_numpy(), strict=True)
    return {str(n): float(v) * by if np.isfinite(v) else None for n, v in pairs}


def energy_balance(data: xr.Dataset) -> xr.Dataset:
    """ "left", stored energy less work done on the train, and "elastic", energy of structure and
    tooth pairs, J, over the samples of a dataset with energy_*."""
    missing = [n for e in LEFT_OVER if (n := f"energy_{e}") not in data]
    if missing:
        raise FlexgearError(f"no energy balance without {', '.join(missing)}")
    left = sum((sign * data[f"energy_{n}"] for n, sign in LEFT_OVER.items()), xr.DataArray(0.0))
    elastic = data["energy_elastic"] + data["energy_pair_elastic"]
    return xr.Dataset({"left": left, "elastic": elastic})


def largest_residual(ranges: Ranges) -> float:
    """Largest energy that the balance does not account for since the start, over the peak elastic
    energy; ranges: of ``energy_balance``."""
    first = float(ranges.first["left"])
    largest = max(float(ranges.largest["left"]) - first, first - float(ranges.least["left"]))
    peak = float(ranges.largest["elastic"])
    if peak <= 0:
        raise FlexgearError("no energy balance: the run has no elastic energy")
    return largest / peak
