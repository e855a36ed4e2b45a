"""The whole carrier from its half sectors: mirrored, turned to every pin, joined."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.kinematics import rotation

if TYPE_CHECKING:
    from flexgear.structures.fe_mesh.carrier import CarrierMeshParameters

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def complete(
    p: CarrierMeshParameters, halves: list[FeMesh], patches: list[dict[str, Ints]]
) -> FeMesh:
    """Every pin with the half sector of the gap that follows it and the mirror image of that of
    the gap before; nodes that two of them share have one number.

    Plain half sectors are numbered before mirrored ones, which share their nodes in the plane of
    the pin and in the middle of the web.
    """
    kinds, order, which = p.half_gaps
    tolerance = 1e-7 * p.plate_diameter
    planes = [_planes(half.points, phi, tolerance) for half, phi in zip(halves, kinds, strict=True)]
    count, before = p.planets, np.roll(which, 1)
    starts = np.cumsum([0, *(len(halves[k].points) for k in which)])
    plain = [starts[i] + np.arange(len(halves[k].points)) for i, k in enumerate(which)]
    mirrored, total, places = [], int(starts[-1]), []
    for i, k in enumerate(which):
        places.append(planes[k].points @ rotation(p.angles[order[i]]).T)
    for i, k in enumerate(before):
        half = planes[k]
        ids = np.full(len(half.points), -1, dtype=np.int64)
        ids[half.web] = plain[i - 1][half.web]
        ahead = planes[which[i]]
        _, same = cKDTree(ahead.points[ahead.pin]).query(half.points[half.pin])
        ids[half.pin] = plain[i][ahead.pin[same]]
        new = np.flatnonzero(ids < 0)
        ids[new] = total + np.arange(len(new))
        total += len(new)
        places.append((half.points[new] * [1.0, -1.0, 1.0]) @ rotation(p.angles[order[i]]).T)
        mirrored.append(ids)
    everything = np.concatenate(places)

    def sector(i: int, rows: list[Ints]) -> Ints:
        """Rows of the two half sectors at a pin; mirrored ones keep right-handed order."""
        turned = rows[before[i]].copy()
        turned[:, [0, 1]] = rows[before[i]][:, [1, 0]]
        return np.concatenate([plain[i][rows[which[i]]], mirrored[i][turned]])

    cells = np.concatenate([sector(i, [half.cells for half in halves]) for i in range(count)])
    facets = {
        name: np.concatenate([sector(i, [part[name] for part in patches]) for i in range(count)])
        for name in ("drive", "bearing_drive", "bearing_far")
    }
    pins = {int(order[i]): sector(i, [part["pin"] for part in patches]) for i in range(count)}
    facets |= {f"pin_{pin + 1}": pins[pin] for pin in range(count)}
    if p.drive_side == "+z":
        everything[:, 2] *= -1.0
        cells = cells[:, [1, 0, 2, 3]]
        facets = {name: rows[:, ::-1] for name, rows in facets.items()}
    return FeMesh(everything, cells, "tet", facets)


@dataclass(frozen=True, eq=False)
class _Planes:
    """Vertices (n, 3) of a half sector, exact on its two planes, and which of them lie there."""

    points: Array
    pin: Ints
    web: Ints


def _planes(points: Array, phi: float, tolerance: float) -> _Planes:
    """The half sector 0 <= θ <= φ with its vertices on θ = 0 and θ = φ moved there exactly."""
    points = points.copy()
    normal = np.array([-sin(phi), cos(phi), 0.0])
    pin = np.flatnonzero(np.abs(points[:, 1]) < tolerance)
    web = np.flatnonzero(np.abs(points @ normal) < tolerance)
    points[pin, 1] = 0.0
    radius = np.hypot(points[web, 0], points[web, 1])
    points[web, :2] = radius[:, None] * np.array([cos(phi), sin(phi)])
    return _Planes(points, pin, web)
