"""Bolt holes in the ring's section: quadrilaterals only, whatever the numbers of teeth and bolts.

The rim is a structured grid with whole columns to every tooth. Teeth and bolts share no factor, so
each bolt takes the block of columns nearest to its axis; the block's inside is replaced by rings
of quadrilaterals between the block's border and the hole's true circle (an O-grid)::

    +--+--+--+--+          The hole lies exactly on its axis; the block is off by half a column
    |  \\ | |  / |          at most. Border and hole carry the same number of nodes, and the spokes
    +---(   )---+          are straight lines through the bolt's axis.
    |  / | |  \\ |
    +--+--+--+--+
"""

from __future__ import annotations

from itertools import pairwise
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.toothed_section import ToothedSection

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


def with_bolt_holes(
    inner: ToothedSection,
    outer_radius: float,
    bolt_angles: Array,
    bolt_circle_radius: float,
    hole_radius: float,
    rows: tuple[int, int, int],
    where: str = "case",
) -> ToothedSection:
    """Continue a toothed section outward through the bolt holes to the outer radius.

    inner: its outer circle becomes the inner border of the blocks; bolt_angles (n_b,) rad;
    rows: (block, outside the block, O-grid rings).
    """
    block_rows, outer_rows, rings = rows
    start = _ordered(inner)
    columns = len(start)
    low = float(inner.radius[start[0]])
    high = min(2.0 * bolt_circle_radius - low, outer_radius)
    if high > outer_radius - 0.3 * hole_radius:
        high, outer_rows = outer_radius, 0
    radii = np.concatenate(
        [
            np.linspace(low, high, block_rows + 1)[1:],
            np.linspace(high, outer_radius, outer_rows + 1)[1:],
        ]
    )
    n = len(inner.radius)
    angles = inner.angle[start]
    radius = np.concatenate([inner.radius, np.repeat(radii, columns)])
    angle = np.concatenate([inner.angle, np.tile(angles, len(radii))])
    node = np.vstack([start, n + np.arange(len(radii) * columns).reshape(-1, columns)])
    ahead = np.roll(node, -1, axis=1)
    grid = np.stack([node[:-1], node[1:], ahead[1:], ahead[:-1]], axis=2)  # (row, column, 4)

    column = 2.0 * pi / columns * bolt_circle_radius
    # wide enough for a hole that is half a column off the block's middle
    across = max(round((high - low) / column), ceil(1.0 + 2.6 * hole_radius / column))
    first = _first_columns(bolt_angles - angles[0], columns, across, where)
    solid = np.ones((len(radii), columns), dtype=bool)
    new_xy, new_quads, holes, total = [], [], [], len(radius)
    xy = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    for k, at in enumerate(first):
        inside = (at + np.arange(across)) % columns
        solid[:block_rows, inside] = False
        cols = (at + np.arange(across + 1)) % columns
        block = node[: block_rows + 1, cols]
        border = np.concatenate(  # counter-clockwise from the inner far corner
            [block[0, ::-1][:-1], block[:-1, 0], block[-1, :-1], block[::-1, -1][:-1]]
        )
        centre = bolt_circle_radius * np.array([np.cos(bolt_angles[k]), np.sin(bolt_angles[k])])
        grid_xy, layers = _o_grid(xy[border], border, centre, hole_radius, rings, total)
        new_xy.append(grid_xy)
        total += len(grid_xy)
        new_quads += [
            np.column_stack([outside, np.roll(outside, -1), np.roll(within, -1), within])
            for outside, within in pairwise(layers)
        ]
        # the wall's outward normal points to the bolt's axis: clockwise round the hole
        holes.append(np.column_stack([np.roll(layers[-1], -1), layers[-1]]))
    added = np.concatenate(new_xy)
    radius = np.concatenate([radius, np.hypot(added[:, 0], added[:, 1])])
    angle = np.concatenate([angle, np.arctan2(added[:, 1], added[:, 0])])
    quads = np.concatenate([inner.quads, grid[solid], *new_quads])
    used, quads = np.unique(quads, return_inverse=True)
    number = np.full(len(radius), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    return ToothedSection(
        radius[used],
        angle[used],
        quads.reshape(-1, 4),
        {name: number[ids] for name, ids in inner.tooth_lines.items()},
        number[np.column_stack([node[-1], ahead[-1]])],
        number[np.stack(holes)],
    )


def _first_columns(angles: Array, columns: int, across: int, where: str) -> Ints:
    """First column (n_b,) of the block round each bolt; angles (n_b,) rad, from column 0 on."""
    first = np.round(angles / (2.0 * pi / columns) - across / 2.0).astype(np.int64)
    spacing = np.diff(np.sort(first % columns), append=np.min(first % columns) + columns)
    if len(angles) > 1 and spacing.min() < across:
        raise InputError(
            where,
            "stage.ring.fe.bolts.number",
            "the bolt holes are too close to each other for the FE mesh",
            "use fewer or thinner bolts, or stage.ring.fe.bolts.holes = false",
        )
    return first


def _o_grid(
    around: Array, border: Ints, centre: Array, radius: float, rings: int, first: int
) -> tuple[Array, list[Ints]]:
    """Places (rings b, 2) of new nodes from a block's border to a hole, and the numbers (b,) of all
    rings of nodes from the border inward; new ones count from ``first``.

    around: places (b, 2) of the border's nodes; centre, radius: of the hole, m.
    """
    spoke = around - centre
    on_hole = centre + radius * spoke / np.linalg.norm(spoke, axis=1)[:, None]
    shares = np.arange(1, rings + 1) / rings
    places = [(1.0 - t) * around + t * on_hole for t in shares]
    numbers = first + np.arange(rings * len(border)).reshape(rings, -1)
    return np.concatenate(places), [border, *numbers]


def _ordered(section: ToothedSection) -> Ints:
    """Nodes of the section's outer circle, counter-clockwise."""
    follows = dict(section.rim.tolist())
    at = first = int(section.rim[0, 0])
    nodes = []
    while True:
        nodes.append(at)
        at = follows[at]
        if at == first:
            return np.array(nodes, dtype=np.int64)
