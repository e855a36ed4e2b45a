"""The block of quadrilaterals of one tooth, from its tip circle to its base section.

Frame of ``gears.tooth``: the tooth on the x axis. Rows follow the profile from the tip (row 0) over
the involute and the root that the tool leaves to the base section, which runs from root to root
just above the middle of the spaces beside the tooth and bows one tip radius of the tool into the
rim (that opens its corners). With the profile (x, y) of the +θ side and places −1 ≤ a ≤ 1 across,

    P(row, a) = (x + (1 − s²) [√(r_a² − a² y_0²) − x_0] + s² d b(a),  a y),

s: share of the profile's length from the tip, d: depth of the bow at a = 0, b(a) = t + t² − t³ with
t = 1 − |a|. Nodes of the profile lie on it exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.tooth import ToothGeometry

Array = NDArray[np.float64]

_LAND = 0.2  # least width between neighbouring base sections, in tip radii of the tool


def base_section_angle(tooth: ToothGeometry) -> float:
    """Half angle of a tooth's base section, rad: to the root circle, and never wholly up to the
    next tooth's."""
    land = _LAND * tooth.tool.tip_radius / tooth.root_radius
    return min(tooth.root.end_angle, (tooth.pitch_angle - land) / 2.0)


def base_section_depth(tooth: ToothGeometry) -> float:
    """How far the base section bows below the root circle at the tooth's middle, m."""
    return tooth.tool.tip_radius


@dataclass(frozen=True)
class ToothProfile:
    """The +θ side of a tooth from its tip to its base section: ``points`` (rows + 1, 2) m, the
    first of them at roll lengths ``roll`` (flank + 1,) m of the involute."""

    tooth: ToothGeometry
    points: Array
    roll: Array


def tooth_profile(tooth: ToothGeometry, flank: int, root: int) -> ToothProfile:
    """So many elements along the involute, of equal length, and along the root."""
    tip, form = tooth.roll_length(tooth.tip_radius), tooth.roll_length(tooth.form_radius)
    # arc length along an involute is ρ²/(2 r_b)
    roll = np.sqrt(np.linspace(tip**2, form**2, flank + 1))
    radius = np.hypot(tooth.base_radius, roll)
    half = tooth.half_angle(radius)
    upper = radius[:, None] * np.column_stack([np.cos(half), np.sin(half)])
    lower = tooth.root.points(root, base_section_angle(tooth))
    return ToothProfile(tooth, np.concatenate([upper, lower[1:]]), roll)


def tooth_block(profile: ToothProfile, across: Array) -> Array:
    """Nodes (rows + 1, columns, 2) m at places ``across`` (rows + 1, columns) from −1 to 1."""
    tooth, (x, y) = profile.tooth, profile.points.T
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    share = (arc[:, None] / arc[-1]) ** 2
    at_tip = np.sqrt(tooth.tip_radius**2 - (across * y[0]) ** 2) - x[0]
    depth = tooth.root_radius - tooth.outward * base_section_depth(tooth) - x[-1]
    t = 1.0 - np.abs(across)
    bow = (1.0 - share) * at_tip + share * depth * (t + t**2 - t**3)
    return np.stack([x[:, None] + bow, y[:, None] * across], axis=2)


def even_columns(rows: int, columns: int) -> Array:
    """Places across (rows, columns) at equal steps, symmetric to the last digit."""
    places = np.linspace(-1.0, 1.0, columns)
    return np.tile(0.5 * (places - places[::-1]), (rows, 1))


def graded(rows: int, growth: float) -> Array:
    """Shares (rows + 1,) from 0 to 1 of steps that grow by a ratio."""
    steps = growth ** np.arange(rows)
    return np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def quads_of(grid: NDArray[np.int64]) -> NDArray[np.int64]:
    """Quadrilaterals (…, 4) of a grid of node numbers (…, rows, columns)."""
    corners = (grid[..., :-1, :-1], grid[..., 1:, :-1], grid[..., 1:, 1:], grid[..., :-1, 1:])
    return np.stack(corners, axis=-1).reshape(-1, 4)


def counter_clockwise(points: Array, quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Quadrilaterals (m, 4) over points (n, 2), turned round where they run clockwise."""
    at = points[quads]
    d1, d2 = at[:, 2] - at[:, 0], at[:, 3] - at[:, 1]
    clockwise = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0] < 0.0
    return np.where(clockwise[:, None], quads[:, ::-1], quads)
