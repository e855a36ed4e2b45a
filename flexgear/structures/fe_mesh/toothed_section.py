"""Transverse section of a gear with its rim as quadrilaterals, z-periodic and mirror-symmetric.

One sector (tip at the top, rim at the bottom), repeated z times::

        tip                     A   the tooth's block (``tooth_block``): rows along involute and
       +---+                        root, down to the base section, the patch "root" of the tooth
       | A |                    B   below the tooth, base section to the rim's other edge: outside
      /     \\                       on a ring, inside on an external gear
     +-------+----+             C   below the root land, between neighbouring teeth: one column
     |   B   | C  |                 without nodes of its own
     +-------+----+
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.tooth import ToothGeometry
from flexgear.structures.fe_mesh.tooth_block import (
    counter_clockwise,
    even_columns,
    graded,
    quads_of,
    tooth_block,
    tooth_profile,
)

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class SectionDivisions:
    """Number of elements: across the tooth, along involute and root, from base section to edge."""

    tooth: int
    flank: int
    fillet: int
    rim: int

    @property
    def around(self) -> int:
        """Columns of one tooth sector."""
        return self.tooth + 1


@dataclass(frozen=True)
class ToothedSection:
    """Quadrilaterals in the transverse plane; walls along z over edges have outward normals.

    radius, angle: (n,) m, rad; quads: (m, 4) counter-clockwise; tooth_lines: "flank" (-θ side),
    "backflank" (+θ side), "root" (base section) -> (z, k, 2) node ids; rim: (k, 2) the rim's edge;
    holes: (n_b, k, 2) or empty.
    """

    radius: Array
    angle: Array
    quads: Ints
    tooth_lines: dict[str, Ints]
    rim: Ints
    holes: Ints = field(default_factory=lambda: np.zeros((0, 0, 2), dtype=np.int64))

    @property
    def points(self) -> Array:
        """(n, 2) m."""
        return np.column_stack([self.radius * np.cos(self.angle), self.radius * np.sin(self.angle)])


def toothed_section(
    tooth: ToothGeometry, rim_radius: float, divisions: SectionDivisions, growth: float = 1.0
) -> ToothedSection:
    """Structured section between the teeth's tips and a circle of nodes equally spaced.

    growth: ratio of successive radial element sizes away from the base section.
    """
    block = _sector(tooth, rim_radius, divisions, growth)
    (rows, columns), teeth = block.shape[:2], np.arange(tooth.teeth)
    radius = np.hypot(block[..., 0], block[..., 1])
    radius[-1] = rim_radius
    angle = np.arctan2(block[..., 1], block[..., 0])
    node = np.arange(tooth.teeth * rows * columns).reshape(-1, rows, columns)
    base = divisions.flank + divisions.fillet
    land = np.stack([node[:, base:, -1], np.roll(node, -1, axis=0)[:, base:, 0]], axis=2)
    quads = np.concatenate([quads_of(node), quads_of(land)])

    def lines(nodes: Ints) -> Ints:
        """Edges (z, k, 2) between neighbours in z rows of k + 1 nodes."""
        ends = [nodes[:, :-1], nodes[:, 1:]]
        return np.stack(ends if tooth.internal else ends[::-1], axis=2)

    flank = slice(divisions.flank + 1)
    following = np.concatenate([node[:, -1], np.roll(node[:, -1, :1], -1, axis=0)], axis=1)
    section = ToothedSection(
        np.tile(radius.ravel(), tooth.teeth),
        (angle.ravel() + tooth.pitch_angle * teeth[:, None]).ravel(),
        quads,
        {
            "flank": lines(node[:, flank, 0]),
            "backflank": lines(node[:, flank, -1])[..., ::-1],
            "root": lines(node[:, base]),
        },
        lines(following).reshape(-1, 2),
    )
    return replace(section, quads=counter_clockwise(section.points, quads))


def _sector(tooth: ToothGeometry, rim_radius: float, div: SectionDivisions, growth: float) -> Array:
    """Points (rows + rim + 1, tooth + 1, 2) m of the tooth on the x axis, from tip to root, and of
    the rim below it."""
    profile = tooth_profile(tooth, div.flank, div.fillet)
    block = tooth_block(profile, even_columns(len(profile.points), div.tooth + 1))
    half = tooth.pitch_angle * div.tooth / div.around / 2.0 * even_columns(1, div.tooth + 1)[0]
    foot = rim_radius * np.column_stack([np.cos(half), np.sin(half)])
    down = graded(div.rim, growth)[1:, None, None]
    return np.concatenate([block, block[-1] + down * (foot - block[-1])])
