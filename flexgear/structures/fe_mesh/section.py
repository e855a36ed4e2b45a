r"""Transverse sections of gears as quadrilaterals: teeth, rim, bolt holes.

Tooth, from its tip circle to its base section, in the frame of ``gears.tooth``: on the x axis. Rows
follow the profile from the tip (row 0) over the involute and the root that the tool cuts to the
base section. This connects the roots on both sides, which it meets near the middle of the spaces,
and is curved one tip radius of the tool into the rim, which widens the angles of its corners. With
the profile (x, y) of the +θ side and places −1 ≤ a ≤ 1 across,

    P(row, a) = (x + (1 − s²) [√(r_a² − a² y_0²) − x_0] + s² d b(a),  a y),

s: arc length of the profile from the tip over the whole, d: depth of the base section at a = 0,
b(a) = t + t² − t³ with t = 1 − |a|. Nodes of the profile are exactly on it.

Gear: one mirror-symmetric sector (tip at the top), repeated z times::

        tip                     A   the tooth's block (``tooth_block``): rows along involute and
       +---+                        root, down to the base section, the patch "root" of the tooth
       | A |                    B   below the tooth, base section to the rim's other edge: outside
      /     \                       on a ring, inside on an external gear
     +-------+----+             C   below the root land, between neighbouring teeth: one column of
     |   B   | C  |                 cells on the nodes of both
     +-------+----+

Bolt holes of a ring, for any numbers of teeth and bolts. The rim is a structured grid with the same
number of columns below every tooth. Around each bolt the block of columns nearest to its axis is
replaced by rings of quadrilaterals between the block's border and the hole's true circle (an
O-grid)::

    +--+--+--+--+          The hole is exactly about its axis; the block is off by half a column
    |  \ | |  / |          at most. Border and hole have the same number of nodes, and the spokes
    +---(   )---+          are straight lines through the bolt's axis.
    |  / | |  \ |
    +--+--+--+--+
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import ceil, pi

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.fe_mesh import HEX_FROM_VTK, FeMesh

Wall = tuple[Ints, Ints | None]  # edges of a section (k, 2), and numbers of layers, None: all

_LAND = 0.2  # least width between neighbouring base sections, in tip radii of the tool


def base_section_angle(tooth: ToothGeometry) -> float:
    """Half angle of a tooth's base section, rad: to where the root meets the root circle, and less
    than half a pitch."""
    land = _LAND * tooth.tool.tip_radius / tooth.root_radius
    return min(tooth.root.end_angle, (tooth.pitch_angle - land) / 2.0)


def base_section_depth(tooth: ToothGeometry) -> float:
    """Depth of the base section below the root circle at the tooth's middle, m."""
    return tooth.tool.tip_radius


@dataclass(frozen=True)
class ToothProfile:
    """The +θ side of a tooth from its tip to its base section: points (rows + 1, 2) m; roll: roll
    lengths (flank + 1,) m of the first of them, which are on the involute."""

    tooth: ToothGeometry
    points: Array
    roll: Array


def tooth_profile(tooth: ToothGeometry, flank: int, root: int) -> ToothProfile:
    """Profile with ``flank`` elements of equal length along the involute, ``root`` along the
    root."""
    tip, form = tooth.roll_length(tooth.tip_radius), tooth.roll_length(tooth.form_radius)
    # arc length along an involute is ρ²/(2 r_b)
    roll = np.sqrt(np.linspace(tip**2, form**2, flank + 1))
    radius = np.hypot(tooth.base_radius, roll)
    half = tooth.half_angle(radius)
    upper = radius[:, None] * np.column_stack([np.cos(half), np.sin(half)])
    lower = tooth.root.points(root, base_section_angle(tooth))
    return ToothProfile(tooth, np.concatenate([upper, lower[1:]]), roll)


def tooth_block(profile: ToothProfile, across: Array) -> Array:
    """Nodes P (rows + 1, columns, 2) m at places ``across`` (rows + 1, columns), −1 … 1."""
    tooth, (x, y) = profile.tooth, profile.points.T
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    share = (arc[:, None] / arc[-1]) ** 2
    at_tip = np.sqrt(tooth.tip_radius**2 - (across * y[0]) ** 2) - x[0]
    depth = tooth.root_radius - tooth.outward * base_section_depth(tooth) - x[-1]
    t = 1.0 - np.abs(across)
    bow = (1.0 - share) * at_tip + share * depth * (t + t**2 - t**3)
    return np.stack([x[:, None] + bow, y[:, None] * across], axis=2)


def even_columns(rows: int, columns: int) -> Array:
    """Places −1 … 1 across (rows, columns) at equal steps, exactly symmetric."""
    places = np.linspace(-1.0, 1.0, columns)
    return np.tile(0.5 * (places - places[::-1]), (rows, 1))


def graded(rows: int, growth: float) -> Array:
    """Coordinates (rows + 1,) from 0 to 1, their steps growing by a ratio."""
    steps = growth ** np.arange(rows)
    return np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def quads_of(grid: Ints) -> Ints:
    """Quadrilaterals (…, 4) of a grid of node numbers (…, rows, columns)."""
    corners = (grid[..., :-1, :-1], grid[..., 1:, :-1], grid[..., 1:, 1:], grid[..., :-1, 1:])
    return np.stack(corners, axis=-1).reshape(-1, 4)


def counter_clockwise(points: Array, quads: Ints) -> Ints:
    """Quadrilaterals (m, 4) of points (n, 2), with clockwise ones reversed."""
    at = points[quads]
    d1, d2 = at[:, 2] - at[:, 0], at[:, 3] - at[:, 1]
    clockwise = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0] < 0.0
    return np.where(clockwise[:, None], quads[:, ::-1], quads)


@dataclass(frozen=True)
class SectionDivisions:
    """Numbers of elements: across the tooth, along involute and root, from the base section to the
    rim's edge."""

    tooth: int
    flank: int
    fillet: int
    rim: int


@dataclass(frozen=True)
class ToothedSection:
    """Transverse section of a gear; its edges have the body to their left.

    radius, angle: of the nodes (n,) m, rad; quads: (m, 4) counter-clockwise; tooth_lines: edges
    (z, k, 2) of "flank" (-θ side), "backflank" (+θ side) and "root" (base section); rim: edges
    (k, 2) of the rim's border; holes: edges (n_b, k, 2) of bolt holes, or empty.
    """

    radius: Array
    angle: Array
    quads: Ints
    tooth_lines: dict[str, Ints]
    rim: Ints
    holes: Ints = field(default_factory=lambda: np.zeros((0, 0, 2), dtype=np.int64))

    @property
    def points(self) -> Array:
        """Cartesian coordinates (n, 2) m of the nodes."""
        return _cartesian(self.radius, self.angle)


def toothed_section(
    tooth: ToothGeometry, rim_radius: float, divisions: SectionDivisions, growth: float = 1.0
) -> ToothedSection:
    """Structured section from the teeth's tips to a circle ``rim_radius``, m, of equally spaced
    nodes; growth: ratio of successive radial element lengths from the base section on."""
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
    """Nodes (rows + rim + 1, tooth + 1, 2) m of the tooth on the x axis and of the rim below it."""
    profile = tooth_profile(tooth, div.flank, div.fillet)
    block = tooth_block(profile, even_columns(len(profile.points), div.tooth + 1))
    half = tooth.pitch_angle * div.tooth / (div.tooth + 1) / 2.0 * even_columns(1, div.tooth + 1)[0]
    foot = rim_radius * np.column_stack([np.cos(half), np.sin(half)])
    down = graded(div.rim, growth)[1:, None, None]
    return np.concatenate([block, block[-1] + down * (foot - block[-1])])


def with_bolt_holes(
    inner: ToothedSection,
    outer_radius: float,
    bolt_angles: Array,
    bolt_circle_radius: float,
    hole_radius: float,
    rows: tuple[int, int, int],
    where: str,
) -> ToothedSection:
    """Section of a ring with bolt holes.

    inner: section up to the inner border of the blocks; outer_radius, bolt_circle_radius,
    hole_radius: m; bolt_angles: (n_b,) rad; rows: numbers of rows in a block, outside the blocks
    and in an O-grid; where: source of the case. InputError where holes are too close.
    """
    block_rows, outer_rows, rings = rows
    start = inner.rim[:, 0]  # counter-clockwise
    columns = len(start)
    low = float(inner.radius[start[0]])
    high = min(2.0 * bolt_circle_radius - low, outer_radius)
    if high > outer_radius - 0.3 * hole_radius:
        high, outer_rows = outer_radius, 0
    blocks = np.linspace(low, high, block_rows + 1)[1:]
    radii = np.concatenate([blocks, np.linspace(high, outer_radius, outer_rows + 1)[1:]])
    new = len(inner.radius) + np.arange(len(radii) * columns).reshape(-1, columns)
    node = np.vstack([start, new])
    following = np.roll(node, -1, axis=1)
    grid = np.stack(
        [node[:-1], node[1:], following[1:], following[:-1]], axis=2
    )  # (row, column, 4)
    radius = np.concatenate([inner.radius, np.repeat(radii, columns)])
    angle = np.concatenate([inner.angle, np.tile(inner.angle[start], len(radii))])

    column = 2.0 * pi / columns * bolt_circle_radius
    # wide enough for a hole at half a column from the block's middle
    across = max(round((high - low) / column), ceil(1.0 + 2.6 * hole_radius / column))
    first = _first_columns(bolt_angles - inner.angle[start[0]], columns, across, where)
    taken = (first[:, None] + np.arange(across + 1)) % columns
    solid = np.ones((len(radii), columns), dtype=bool)
    solid[:block_rows, taken[:, :-1]] = False
    # counter-clockwise round each block, from the corner at the inner row and last column
    block = np.moveaxis(node[: block_rows + 1, taken], 1, 0)
    sides = (block[:, 0, :0:-1], block[:, :-1, 0], block[:, -1, :-1], block[:, :0:-1, -1])
    border = np.concatenate(sides, axis=1)
    around = _cartesian(radius[border], angle[border])
    centre = _cartesian(bolt_circle_radius, bolt_angles)[:, None]
    places, layers = _o_grids(around, border, centre, hole_radius, rings, len(radius))
    ahead_of, hole = np.roll(layers, -1, axis=2), layers[:, -1]
    corners = (layers[:, :-1], ahead_of[:, :-1], ahead_of[:, 1:], layers[:, 1:])
    quads = np.concatenate([inner.quads, grid[solid], np.stack(corners, axis=-1).reshape(-1, 4)])
    used, quads = np.unique(quads, return_inverse=True)
    x, y = places.T
    number = np.full(len(radius) + len(places), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    return ToothedSection(
        np.concatenate([radius, np.hypot(x, y)])[used],
        np.concatenate([angle, np.arctan2(y, x)])[used],
        quads.reshape(-1, 4),
        {name: number[ids] for name, ids in inner.tooth_lines.items()},
        number[np.column_stack([node[-1], following[-1]])],
        # clockwise round the hole: the outward normal of the wall points to the bolt's axis
        number[np.stack([np.roll(hole, -1, axis=1), hole], axis=2)],
    )


def _cartesian(radius: Array | float, angle: Array) -> Array:
    """Cartesian coordinates (..., 2) m."""
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def _first_columns(angles: Array, columns: int, across: int, where: str) -> Ints:
    """First column (n_b,) of the block of ``across`` columns round each bolt; angles: of the bolts
    from column 0, (n_b,) rad. InputError where blocks overlap."""
    first = np.round(angles / (2.0 * pi / columns) - across / 2.0).astype(np.int64)
    spacing = np.diff(np.sort(first % columns), append=np.min(first % columns) + columns)
    if len(angles) > 1 and spacing.min() < across:
        problem = "the bolt holes are too close to each other for the FE mesh"
        remedy = "use fewer or thinner bolts, or stage.ring.fe.bolts.holes = false"
        raise InputError(where, "stage.ring.fe.bolts.number", problem, remedy)
    return first


def _o_grids(
    around: Array, border: Ints, centre: Array, radius: float, rings: int, first: int
) -> tuple[Array, Ints]:
    """New nodes (n, 2) m between the borders of blocks and their holes, numbered from ``first``,
    and numbers (n_b, rings + 1, b) of the nodes on all rings, from the border inwards.

    around: positions (n_b, b, 2) of the nodes ``border`` (n_b, b); centre (n_b, 1, 2), radius: of
    the holes, m.
    """
    spoke = around - centre
    on_hole = centre + radius * spoke / np.linalg.norm(spoke, axis=2, keepdims=True)
    share = (np.arange(1, rings + 1) / rings)[:, None, None]
    places = (1.0 - share) * around[:, None] + share * on_hole[:, None]
    numbers = first + np.arange(places[..., 0].size).reshape(places.shape[:3])
    return places.reshape(-1, 2), np.concatenate([border[:, None], numbers], axis=1)


def extruded(
    radius: Array,
    angle: Array,
    quads: Ints,
    twist: Array | float,
    z: Array,
    walls: Mapping[str, Wall],
) -> FeMesh:
    """FE mesh of a section extruded along z, with patches ``walls``, end_minus and end_plus.

    radius, angle: of the section's nodes (n,) m, rad; quads: (m, 4) counter-clockwise; twist: of
    the nodes (n,) or of all, rad/m; z: layer borders, m; walls: by patch, edges with the body to
    their left, and layers.
    """
    n, layers = len(radius), len(z) - 1
    turned = angle + np.broadcast_to(twist, n) * z[:, None]
    x, y = radius * np.cos(turned), radius * np.sin(turned)
    points = np.stack([x, y, np.broadcast_to(z[:, None], x.shape)], axis=2).reshape(-1, 3)
    level = n * np.arange(layers)[:, None, None]
    vtk = np.concatenate([quads + level, quads + level + n], axis=2).reshape(-1, 8)
    facets = {}
    for name, (edges, chosen) in walls.items():
        step = (level if chosen is None else level[chosen])[:, :, 0]
        a, b = edges[:, 0] + step, edges[:, 1] + step
        facets[name] = np.stack([a, b, b + n, a + n], axis=2).reshape(-1, 4)
    facets |= {"end_minus": quads[:, ::-1], "end_plus": quads + n * layers}
    return FeMesh(points, vtk[:, HEX_FROM_VTK], "hex", facets)
