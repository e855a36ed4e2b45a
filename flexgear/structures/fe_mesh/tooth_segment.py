r"""FE mesh of a few teeth of a gear in hexahedra, with true flanks and fillets, rim and helix.

Frame: the gear's axis is z, z = 0 the middle of the face; the middle of tooth j = 0 … n − 1 of the
segment is at the angle (j − (n − 1)/2) 2π/z_gear at z = 0. The section at z is that at z = 0 turned
by κ z.

Section of one tooth (an external one; a ring's has its tip inside)::

        tip                  Columns: one layer of stated depth under both flanks, ``tooth``
       +-+--+-+              columns between them. Rows: ``flank`` elements of equal length along
       | |  | |              the involute, ``fillet`` elements along the root that the tool cuts,
       +-+--+-+              shorter where it curves; curved as those of ``section``, down to
      / /    \ \               the base section, the surface of a ring's root tie.
     +-+------+-+--+
     | |      | |  |
     +-+------+-+--+         ``rim`` rows down to the held circle, ``land`` columns to the next

Nodes of the profile are exactly on it.

Patches: tooth_flank_NNN (−θ side), tooth_backflank_NNN (+θ side) on the involutes,
tooth_fillet_NNN, tooth_backfillet_NNN below them, tooth_root_NNN (base section, interior where
there is a rim), held (held circle and both cut faces; the base section where there is no rim),
end_minus, end_plus. NNN counts the teeth of the segment from 1.

The crack of a segment starts on the −θ side of the middle tooth, where the root section begins (the
tangent at 30° to the tooth's middle line, 60° in a ring), and runs straight into the tooth, towards
the rim by the stated angle. A row of nodes is moved onto it, and neighbouring rows follow::

        |    .    |        A column is at the crack's end where it is deepest, with columns closer
        |    .    |        together there. Layers along the face with a shallower crack are cut to
       /·\___.    |        the nearest column. Nodes inside the crack are doubled, those of its
      |    \  '---|        front and ends are not; elements above it have the second ones.
      |     \  /  |
      +------\/---+

The whole and the cracked segment have the same elements, so that their difference has hardly any
error of the FE mesh but that of the singular stress at the front: of the order h/a of the added
compliance, for quadratic elements of length h at the front of a crack of depth a.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.errors import FlexgearError
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, welded
from flexgear.structures.fe_mesh.section import (
    ToothProfile,
    Wall,
    base_section_angle,
    base_section_depth,
    counter_clockwise,
    extruded,
    graded,
    quads_of,
    tooth_block,
    tooth_profile,
)

_SAME = 1e-9  # largest distance of nodes that blocks share, over the root radius
_DEEPEST_LAYER = 0.35  # largest depth of the layer under a flank, over the tooth's thickness there


@dataclass(frozen=True)
class SegmentDivisions:
    """Numbers of elements, see the module's docstring; layers: along the face."""

    flank: int = 10
    fillet: int = 4
    tooth: int = 3
    rim: int = 5
    land: int = 2
    layers: int = 15
    growth: float = 1.35  # ratio of successive rows of the rim


@dataclass(frozen=True)
class SegmentParameters:
    """All parameters of a segment; m, rad/m.

    held_radius: where the rim is cut and held, inside the root of an external gear and outside that
    of a ring; None: the tooth is cut off at its base section. flank_layer: depth of the layer under
    the flanks, less where the tip is too thin for it; teeth: number of teeth; margin: rim without
    teeth beyond the lands at its ends, in pitches.
    """

    tooth: ToothGeometry
    face_width: float
    helix_rate: float
    held_radius: float | None
    flank_layer: float
    teeth: int = 3
    divisions: SegmentDivisions = SegmentDivisions()
    margin: float = 0.0

    @property
    def middle(self) -> int:
        """Index of the middle tooth, from 0."""
        return (self.teeth - 1) // 2

    @property
    def layer_positions(self) -> Array:
        """Borders of the layers along the face (layers + 1,), m."""
        return np.linspace(-0.5, 0.5, self.divisions.layers + 1) * self.face_width

    @property
    def roll_slope(self) -> float:
        """Slope d roll/dz of contact lines on −θ flanks."""
        return -self.tooth.outward * self.tooth.base_radius * self.helix_rate

    def check(self) -> None:
        """FlexgearError where no segment can be made."""
        if self.held_radius is None:
            if self.teeth != 1:
                raise FlexgearError("tooth segment: without a rim it has one tooth")
            return
        deep = self.tooth.outward * (self.tooth.root_radius - self.held_radius)
        if deep <= 1.5 * base_section_depth(self.tooth):
            raise FlexgearError(
                f"tooth segment: held at {self.held_radius:g} m, which is not below the teeth's "
                f"base sections (root circle {self.tooth.root_radius:g} m)"
            )


@dataclass(frozen=True, eq=False)
class ToothSegment:
    """FE mesh of a segment, and its vertices on flanks and layers.

    surface_nodes: vertices (teeth, rows + 1, layers + 1) of the −θ sides from the tip down to the
    base section, the first flank + 1 rows on the involute; inner_nodes: of the inner border of the
    layer below, likewise; roll: roll lengths (flank + 1,) of the flank's rows from the tip on, m;
    depth: (flank + 1,) of the layer in these rows, m; z: layer borders (layers + 1,) m.
    """

    parameters: SegmentParameters
    fe_mesh: FeMesh
    surface_nodes: Ints
    inner_nodes: Ints
    roll: Array
    depth: Array
    z: Array

    @property
    def flank_nodes(self) -> Ints:
        """Vertices (teeth, flank + 1, layers + 1) of the −θ flanks, from tip to form circle."""
        return self.surface_nodes[:, : len(self.roll)]


def tooth_segment(p: SegmentParameters) -> ToothSegment:
    """The segment as in the module's docstring. FlexgearError where it cannot be made."""
    p.check()
    return segment_of(p, SegmentSection(p))


def segment_of(p: SegmentParameters, section: SegmentSection) -> ToothSegment:
    """The segment of a section, extruded along the face."""
    z = p.layer_positions
    radius, angle = np.hypot(*section.points.T), np.arctan2(*section.points.T[::-1])
    walls: dict[str, Wall] = {name: (_edges(line), None) for name, line in section.lines.items()}
    walls["held"] = np.concatenate([_edges(line) for line in section.held]), None
    levels = len(radius) * np.arange(len(z))
    return ToothSegment(
        p,
        extruded(radius, angle, section.quads, p.helix_rate, z, walls),
        section.surface[:, :, None] + levels,
        section.inner[:, :, None] + levels,
        section.profile.roll,
        section.depth,
        z,
    )


def _edges(line: Ints) -> Ints:
    """Edges (k, 2) of a line of nodes (k + 1,)."""
    return np.column_stack([line[:-1], line[1:]])


class SegmentSection:
    """Section of a segment: points (n, 2) m, quads (m, 4) counter-clockwise, named lines of nodes;
    blocks: numbers (rows + rim + 1, columns) of every tooth's nodes."""

    def __init__(self, p: SegmentParameters) -> None:
        self.p, self.tooth, self.div = p, p.tooth, p.divisions
        block = self._tooth_block()
        rows = len(self.profile.points) - 1
        parts = [self._turned(block, j) for j in range(p.teeth)]
        if p.held_radius is not None:
            parts += self._lands()
        every = np.concatenate([part.reshape(-1, 2) for part in parts])
        self.points, number = welded(every, _SAME * self.tooth.root_radius)
        numbers = np.split(number, np.cumsum([part.size // 2 for part in parts])[:-1])
        grids: list[Ints] = [
            ids.reshape(part.shape[:2]) for ids, part in zip(numbers, parts, strict=True)
        ]
        self.blocks = columns = grids[: p.teeth]
        quads = np.concatenate([quads_of(grid) for grid in grids])
        self.quads = counter_clockwise(self.points, quads)
        self.surface = np.array([grid[: rows + 1, 0] for grid in columns])
        self.inner = np.array([grid[: rows + 1, 1] for grid in columns])
        self.lines = self._lines(columns, rows)
        self.held = self._held(grids)

    @cached_property
    def profile(self) -> ToothProfile:
        """Profile of a tooth, on the +θ side."""
        return tooth_profile(self.tooth, self.div.flank, self.div.fillet)

    def _tooth_block(self) -> Array:
        """Nodes (rows + rim + 1, columns, 2) of the tooth at the angle 0 and of the rim below."""
        across = self._columns()  # (rows + 1, columns)
        block = tooth_block(self.profile, across)
        self.depth = self._layer_depth(block)
        if self.p.held_radius is None:
            return block
        half = self._held_share * self.tooth.pitch_angle / 2 * np.linspace(-1, 1, across.shape[1])
        foot = self.p.held_radius * np.column_stack([np.cos(half), np.sin(half)])
        down = self._depths[1:, None, None]
        return np.concatenate([block, block[-1] + down * (foot - block[-1])])

    def _columns(self) -> Array:
        """Places −1 … 1 of the columns in every row. The outer ones bound layers with their depth
        along the flank's normal; below the flank they have the place of its last row."""
        flank, y = self.div.flank + 1, self.profile.points[:, 1]
        slant = 1.0 / np.cos(self.tooth.load_angle(np.hypot(*self.profile.points[:flank].T)))
        across = np.minimum(self.p.flank_layer * slant, 2 * _DEEPEST_LAYER * y[:flank])
        share = 1 - across / y[:flank]
        share = np.concatenate([share, np.full(len(y) - flank, share[-1])])
        inner = share[:, None] * np.linspace(-1, 1, self.div.tooth + 1)
        edge = np.ones((len(y), 1))
        return np.concatenate([-edge, inner, edge], axis=1)

    def _layer_depth(self, block: Array) -> Array:
        """Depth of the layer along the normal of the −θ flank, row by row, m."""
        flank = block[: self.div.flank + 1]
        slope = self.tooth.load_angle(np.hypot(*flank[:, 0].T))
        inward = np.column_stack([-self.tooth.outward * np.sin(slope), np.cos(slope)])
        return np.sum((flank[:, 1] - flank[:, 0]) * inward, axis=1)

    @cached_property
    def _depths(self) -> Array:
        """Positions 0 … 1 of the rim's rows from the base section to the held circle."""
        return graded(self.div.rim, self.div.growth)

    @property
    def _held_share(self) -> float:
        """Share of a pitch on the held circle that lies below the tooth."""
        top = 2 * base_section_angle(self.tooth) / self.tooth.pitch_angle
        columns = self.div.tooth + 2
        return min(top, columns / (columns + self.div.land))

    def _turned(self, block: Array, j: int) -> Array:
        """A block of the tooth at the angle 0, turned to tooth j."""
        angle = (j - (self.p.teeth - 1) / 2) * self.tooth.pitch_angle
        c, s = np.cos(angle), np.sin(angle)
        return np.asarray(block @ np.array([[c, s], [-s, c]]))

    def _lands(self) -> list[Array]:
        """Blocks below the root lands beside and between the teeth, and of the rim without teeth
        beyond them, by rising angle."""
        begin, pitch, teeth = base_section_angle(self.tooth), self.tooth.pitch_angle, self.p.teeth
        held = self._held_share * pitch / 2
        top = np.linspace(begin, pitch - begin, self.div.land + 1)
        radius = np.full(len(top), self.tooth.root_radius)
        radius[[0, -1]] = np.hypot(*self.profile.points[-1])
        block = self._rim_block(radius, top, np.linspace(held, pitch - held, self.div.land + 1))
        lands = [self._turned(block, j) for j in range(-1, teeth)]
        if self.p.margin > 0.0:
            away = np.linspace(0, 1, ceil(self.p.margin * (self.div.land + 2)) + 1)
            away *= self.p.margin * pitch
            bare = self._rim_block(radius[-1] + 0 * away, away + top[-1], away + pitch - held)
            before = self._turned(bare[:, ::-1] * np.array([1.0, -1.0]), 0)
            lands = [before, *lands, self._turned(bare, teeth - 1)]
        return lands

    def _rim_block(self, radius: Array, top: Array, foot: Array) -> Array:
        """Nodes (rim + 1, k, 2) on straight lines from points (radius, top), (k,) each, to the held
        circle at angles ``foot`` (k,)."""
        upper = radius[:, None] * np.column_stack([np.cos(top), np.sin(top)])
        assert self.p.held_radius is not None
        lower = self.p.held_radius * np.column_stack([np.cos(foot), np.sin(foot)])
        return upper + self._depths[:, None, None] * (lower - upper)

    def _lines(self, columns: list[Ints], rows: int) -> dict[str, Ints]:
        """Named lines of nodes, with the body on their left seen from +z."""
        flank, sense = self.div.flank + 1, -int(self.tooth.outward)
        lines = {}
        for j, grid in enumerate(columns, 1):
            for name, column, direction in (("", 0, sense), ("back", -1, -sense)):
                lines[f"tooth_{name}flank_{j:03d}"] = grid[:flank, column][::direction]
                lines[f"tooth_{name}fillet_{j:03d}"] = grid[flank - 1 : rows + 1, column][
                    ::direction
                ]
            lines[f"tooth_root_{j:03d}"] = grid[rows][::sense]
        return lines

    def _held(self, grids: list[Ints]) -> list[Ints]:
        """Lines of nodes of the patch "held": last rows, and both cut faces."""
        sense, lands = -int(self.tooth.outward), grids[self.p.teeth :]
        sides = [lands[0][:, 0][::sense], lands[-1][:, -1][::-sense]] if lands else []
        return [*(grid[-1][::sense] for grid in grids), *sides]


CUT, WHOLE = 6, 7  # numbers of columns up to the end of the crack, and beyond
CLOSER = 1.4  # exponent of the columns' spacing before the crack's end, where they are closer
STRONGEST = 3.0  # largest exponent beyond the end


@dataclass(frozen=True)
class CrackedSegmentParameters(SegmentParameters):
    """A segment and the crack of its middle tooth.

    angle: between crack and middle line of the tooth, rad; depths: (layers,) along the crack from
    the surface, m, in each layer along the face, not all zero.
    """

    angle: float = 0.0
    depths: tuple[float, ...] = ()


def cracked_segment(p: CrackedSegmentParameters) -> tuple[ToothSegment, FeMesh]:
    """The whole segment, and the FE mesh of the cracked one, which has more points at its end and
    only the patch "held". FlexgearError where they cannot be made."""
    p.check()
    section = _CrackedSection(p)
    whole, grid = segment_of(p, section), section.blocks[p.middle]
    row, per_level = section.crack_row, len(section.points)
    places = np.array(p.depths) / max(p.depths)
    cut = np.abs(section.cut_shares - places[:, None]).argmin(axis=1)  # columns in each layer
    faces = np.arange(grid.shape[1] - 1) < cut[:, None]
    inside = np.pad(faces, 1, constant_values=True)
    doubled = inside[:-1, :-1] & inside[1:, :-1] & inside[:-1, 1:] & inside[1:, 1:]
    level = per_level * np.arange(len(faces) + 1)[:, None]
    first = (grid[row] + level)[doubled]
    points, cells = np.asarray(whole.fe_mesh.points), np.array(whole.fe_mesh.cells)
    second = np.arange(len(points) + len(first))
    second[first] = len(points) + np.arange(len(first))
    above = np.isin(cells, grid[row - 1] + level).any(axis=1)
    above &= np.isin(cells, grid[row] + level).any(axis=1)
    cells[above] = second[cells[above]]
    held = {"held": whole.fe_mesh.facets["held"]}
    return whole, FeMesh(np.vstack([points, points[first]]), cells, "hex", held)


class _CrackedSection(SegmentSection):
    """The section with a row along the deepest crack."""

    p: CrackedSegmentParameters

    @property
    def cut_shares(self) -> Array:
        """Places (CUT + 1,) of columns along the crack, 0 at the surface, 1 at its end."""
        return np.asarray(1.0 - (1.0 - np.linspace(0.0, 1.0, CUT + 1)) ** CLOSER)

    @cached_property
    def crack_row(self) -> int:
        """Number of the row along the crack."""
        section = self.tooth.root.section
        points = tooth_profile(self.tooth, self.div.flank, self.div.fillet).points
        start = np.array([section.distance, 0.5 * section.thickness])
        first = self.div.flank + 1  # below the involute, and above the base section
        return first + int(np.hypot(*(points[first:-1] - start).T).argmin())

    @cached_property
    def profile(self) -> ToothProfile:
        """Profile of a tooth with a node where the crack begins."""
        profile = tooth_profile(self.tooth, self.div.flank, self.div.fillet)
        section, row = self.tooth.root.section, self.crack_row
        points = profile.points.copy()
        start = np.array([section.distance, 0.5 * section.thickness])
        along, place = points[row + 1] - points[row - 1], start - points[row - 1]
        if 0.2 < along @ place / (along @ along) < 0.8:
            points[row] = start
        return replace(profile, points=points)

    def _columns(self) -> Array:
        half = self.profile.points[self.crack_row, 1]
        end = -1.0 + max(self.p.depths) * np.sin(self.p.angle) / half
        cut = -1.0 + self.cut_shares * (end + 1.0)
        last = (cut[-1] - cut[-2]) / (1.0 - end)
        power = np.clip(np.log(last) / -np.log(WHOLE), 1.0, STRONGEST)
        beyond = end + (1.0 - end) * np.linspace(0.0, 1.0, WHOLE + 1)[1:] ** power
        return np.tile(np.concatenate([cut, beyond]), (len(self.profile.points), 1))

    def _tooth_block(self) -> Array:
        block, row = super()._tooth_block(), self.crack_row
        start, across = self.profile.points[row], self._columns()[0]
        end = across[CUT]
        down = start[1] / np.tan(self.p.angle) * np.minimum(
            across + 1.0, (end + 1.0) * (1.0 - across) / (1.0 - end)
        )  # fmt: skip
        shift = start[0] - self.tooth.outward * down - block[row, :, 0]
        middle = block[:, block.shape[1] // 2, 0]
        reach = np.where(np.arange(len(block)) < row, middle[0], middle[-1])
        share = (middle - reach) / (middle[row] - reach)
        block[:, :, 0] += share[:, None] * shift
        return block
