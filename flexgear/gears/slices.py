"""Slices of a contact line: where they are, what stiffness and what gap each has.

The line of a pair at the path coordinate s (at z = 0) goes from z₁(s) to z₂(s), the part of the
face where s + t z lies on the path. It is cut into K slices of equal width that move with its ends,
so that none enters or leaves within the face and the transmission error has no ripple of K times
a line. Slice j at its middle z_j holds k_j = k'(ξ_j) (z₂ − z₁)/K, scaled so that together they
hold k(s), and moved so that their centre of stiffness is z_c(s), which ``stiffness`` integrates
exactly: what is left of the midpoint rule is of second order in 1/K, in ρ and along the line.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.stiffness import Law

Array = NDArray[np.float64]
Gap = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Slices:
    """Slices of the pairs of a gear mesh over its path coordinate s (S,), m; K slices.

    z, stiffness, gap, width: (S, K) m, N/m, m, m; radius: (S,) radius of gyration ρ of the
    stiffness about its centre, m. gap: along the 3D normal, positive where material is missing.
    """

    s: Array
    z: Array
    stiffness: Array
    gap: Array
    width: Array
    radius: Array

    @property
    def count(self) -> int:
        """K."""
        return int(self.z.shape[1])


def cut(
    law: Law, s: Array, path: tuple[float, float], slope: float, half_face: float,
    whole: tuple[Array, Array], count: int, gap: Gap | None = None,
) -> Slices:  # fmt: skip
    """Slices at path coordinates s (S,); whole: k(s) N/m and z_c(s) m of the whole line; gap: of
    both flanks at (path coordinate, z), any shape."""
    low, high = line_ends(s, path, slope, half_face)
    width = (high - low) / count
    z = low[:, None] + width[:, None] * (np.arange(count) + 0.5)
    place = s[:, None] + slope * z
    share = np.clip((place - path[0]) / (path[1] - path[0]), 0.0, 1.0)
    raw = law(share) * width[:, None]
    k, centre = whole
    total = raw.sum(axis=1)
    held = (k > 0) & (total > 0)
    stiffness = raw * np.divide(k, total, out=np.zeros_like(k), where=held)[:, None]
    middle = np.divide((stiffness * z).sum(axis=1), k, out=np.zeros_like(k), where=held)
    z = z + np.where(held, centre - middle, 0.0)[:, None]
    spread = (stiffness * (z - centre[:, None]) ** 2).sum(axis=1)
    radius = np.sqrt(np.divide(spread, k, out=np.zeros_like(k), where=held))
    return Slices(
        s=s,
        z=z,
        stiffness=stiffness,
        gap=np.zeros_like(z) if gap is None else gap(s[:, None] + slope * z, z),
        width=np.repeat(width[:, None], count, axis=1),
        radius=np.where(radius > 1e-9 * half_face, radius, 0.0),  # of one slice it is rounding
    )


def line_ends(
    s: Array, path: tuple[float, float], slope: float, half_face: float
) -> tuple[Array, Array]:
    """z₁ and z₂ (S,) of contact lines, m; equal where a line has left the path."""
    if abs(slope) * half_face < 1e-9 * (path[1] - path[0]):  # spur: whole face at one place
        on = (s >= path[0]) & (s <= path[1])
        return np.where(on, -half_face, 0.0), np.where(on, half_face, 0.0)
    ends = np.sort((np.array(path)[:, None] - s) / slope, axis=0)
    low, high = np.clip(ends, -half_face, half_face)
    return low, high
