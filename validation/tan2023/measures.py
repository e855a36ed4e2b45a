"""Figures taken out of the runs: tooth passages, humps of a tooth node, star, negative loads."""

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.model.names import MemberName, NodeName
from flexgear.results.stage_part import displacement_of, pairs_of, stiffness_split
from flexgear.results.time_figures import radial_harmonics, star_angle

MICRO = 1e6
RPM = 30 / math.pi


@dataclass(frozen=True)
class Passage:
    """Load of one tooth pair through its contact against the stiffness split (eq. 23).

    peak, split: N; ratio = peak/split; lead: carrier angle by which the load peaks before the
    split, over the angle of contact; centroid_lead: the same of the curves' centroids.
    """

    peak: float
    split: float
    lead: float
    centroid_lead: float

    @property
    def ratio(self) -> float:
        return self.peak / self.split


def passages(data: xr.Dataset, gear_mesh: str) -> list[Passage]:
    """Every tooth pair of planet 1 whose whole contact is in the data."""
    load, stiffness, tooth = (
        pairs_of(data, gear_mesh, "drive", 1)[name].to_numpy()[:, 0]
        for name in ("load", "stiffness", "tooth")
    )
    split, angle = stiffness_split(load, stiffness), data["stage_angle"].to_numpy()
    parts = []
    for number in np.unique(tooth[tooth > 0]):
        on_tooth = tooth == number
        rows = np.flatnonzero(on_tooth.any(axis=1))
        for piece in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            if piece[0] == 0 or piece[-1] == len(angle) - 1:
                continue
            f = np.where(on_tooth, load, 0.0).sum(axis=1)[piece]
            s = np.where(on_tooth, split, 0.0).sum(axis=1)[piece]
            at, span = angle[piece], angle[piece[-1]] - angle[piece[0]]
            parts.append(
                Passage(
                    peak=float(f.max()),
                    split=float(s.max()),
                    lead=float((at[s.argmax()] - at[f.argmax()]) / span),
                    centroid_lead=float((s @ at / s.sum() - f @ at / f.sum()) / span),
                )
            )
    return parts


def mean_passage(data: xr.Dataset, gear_mesh: str) -> Passage:
    """Average over the tooth pairs of planet 1."""
    all_of = passages(data, gear_mesh)
    return Passage(
        *(
            float(np.mean([getattr(p, name) for p in all_of]))
            for name in ("peak", "split", "lead", "centroid_lead")
        )
    )


def tooth_node(data: xr.Dataset, tooth: int = 1) -> Array:
    """Displacement (t, 3) of a ring tooth node, global axes, m."""
    return np.asarray(data["tooth_displacement"].isel(tooth=tooth - 1), dtype=float)


def peaks(data: xr.Dataset) -> Array:
    """Largest absolute displacement (3,) of tooth node 1, µm."""
    return np.asarray(np.abs(tooth_node(data)).max(axis=0) * MICRO)


@dataclass(frozen=True)
class Humps:
    """Slow part of tooth node 1 over a revolution, gear-mesh ripple filtered out.

    angle (3, N): carrier angles (rad) at which |x|, |y|, |z| are largest within each planet
    spacing, in the order in which planets pass; spacing (N,): steps of the y humps; ripple (3,):
    amplitude of the ripple left out, over that of the humps.
    """

    angle: Array
    spacing: Array
    ripple: Array


def humps(data: xr.Dataset, planets: int, teeth: int) -> Humps:
    """Fourier series in the carrier angle: orders below half the gear-mesh order are the humps."""
    angle = data["stage_angle"].to_numpy()
    grid = angle[0] + 2 * math.pi * np.arange(16384) / 16384
    grid = grid[grid <= angle[-1]] if angle[-1] - angle[0] < 2 * math.pi * (1 - 1e-3) else grid
    values = np.stack([np.interp(grid, angle, u) for u in tooth_node(data).T])
    spectrum = np.fft.rfft(values, axis=-1)
    limit = teeth // 2
    slow_part = spectrum.copy()
    slow_part[:, limit:] = 0
    slow = np.fft.irfft(slow_part, n=len(grid), axis=-1)
    fast = values - slow
    spacing = 2 * math.pi / planets
    sign = np.sign(slow[np.arange(3), np.abs(slow).argmax(axis=-1)])
    angles = np.zeros((3, planets))
    start = grid[int((sign[1] * slow[1]).argmax())]
    for a in range(3):
        height = sign[a] * slow[a]
        for p in range(planets):
            # look within half a spacing of where the y humps stand
            distance = np.mod(grid - start - p * spacing + math.pi, 2 * math.pi) - math.pi
            near = np.flatnonzero(np.abs(distance) <= 0.5 * spacing)
            best = near[height[near].argmax()]
            angles[a, p] = start + p * spacing + distance[best]
    steps = np.diff(np.append(angles[1], angles[1][0] + 2 * math.pi))
    return Humps(angles, steps, np.ptp(fast, axis=-1) / np.ptp(slow, axis=-1))


def star(data: xr.Dataset) -> tuple[Array, Array]:
    """Radial harmonics (p, orders) in µm and how far the star's angle is off the carrier's, rad.

    The offset of the first position is that of the star itself and is taken off.
    """
    c = radial_harmonics(data["tooth_displacement"].to_numpy())
    off = star_angle(c, 5) - data["stage_angle"].to_numpy()
    return np.abs(c) * MICRO, np.angle(np.exp(5j * (off - off[0]))) / 5


def drive_rotation(data: xr.Dataset) -> Array:
    """Wind-up (t,) of the carrier's drive node, rad."""
    return np.asarray(data["carrier_displacement"].sel(carrier_node="stage.drive").isel(dof=5))


def pins(data: xr.Dataset) -> xr.DataArray:
    """Displacement (t, N, dof) of the carrier at its pins, carrier axes."""
    names = [MemberName.parse(str(n)).part for n in data["carrier_node"].to_numpy()]
    return data["carrier_displacement"].isel(
        carrier_node=[NodeName.parse(n).kind == "pin" for n in names]
    )


def tangential_shift(data: xr.Dataset, center_distance: float) -> Array:
    """Tangential shift (t, N) of the planets against the carrier's drive flange, m."""
    y = displacement_of(data, "planet").isel(dof=1).to_numpy()
    return np.asarray(y - center_distance * drive_rotation(data)[:, None])


def lowest_over_peak(data: xr.Dataset) -> float:
    """Lowest pair load of ring and sun meshes over the largest before the drop."""
    before = data.isel(time=slice(0, 200))
    rated = max(float(pairs_of(before, g, "drive")["load"].max()) for g in ("ring", "sun"))
    return min(float(pairs_of(data, g, "drive")["load"].min()) for g in ("ring", "sun")) / rated


def decay_time(time: Array, speed: Array, final: float) -> float:
    """Time constant of speed -> final, by a straight line through log|speed − final|, s."""
    rest = np.abs(speed - final)
    use = (rest < 0.6 * rest[0]) & (rest > 0.06 * rest[0])
    return float(-1 / np.polyfit(time[use], np.log(rest[use]), 1)[0])
