r"""A tooth segment whose middle tooth has a crack at its root, and the same one in one piece.

The crack starts on the −θ side of the middle tooth, where the root section begins (the tangent at
30° to the tooth's middle line, 60° in a ring), and runs straight into the tooth, towards the rim by
the stated angle. A row of nodes of the segment is laid along it, and rows beside it give way::

        |    .    |        Columns meet the crack's end at its deepest layer, and are closer there.
        |    .    |        Layers along the face with less of a crack are cut up to the nearest of
       /·\___.    |        the columns. Nodes inside the crack are there twice, those of its front
      |    \  '---|        and of its end once; elements above it take the second ones.
      |     \  /  |
      +------\/---+

Above and below the crack elements are the same, so that the difference of both segments has next to
no error of the FE mesh but that of the front's singular stress: with quadratic elements of h at the
front of a crack of depth a it is of the order h/a of what the crack adds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.structures.fe_mesh.section import ToothProfile, tooth_profile
from flexgear.structures.fe_mesh.tooth_segment import (
    SegmentParameters,
    SegmentSection,
    ToothSegment,
    segment_of,
)

CUT, WHOLE = 6, 7  # columns up to the end of the crack, and beyond
CLOSER = 1.4  # exponent by which columns are closer at the crack's end
STRONGEST = 3.0  # of the exponent beyond


@dataclass(frozen=True)
class CrackedSegmentParameters(SegmentParameters):
    """A segment and the crack of its middle tooth.

    angle: between crack and middle line of the tooth, rad; depths: (layers,) along the crack from
    the surface, m, in each layer along the face, not all zero.
    """

    angle: float = 0.0
    depths: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class CrackedSegment:
    """The segment in one piece, and points (n, 3) m and cells (m, 8) of the cracked one, whose
    first points are those of the other."""

    whole: ToothSegment
    points: Array
    cells: Ints


def cracked_segment(p: CrackedSegmentParameters) -> CrackedSegment:
    """FlexgearError where the segment cannot be made."""
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
    return CrackedSegment(whole, np.vstack([points, points[first]]), cells)


class _CrackedSection(SegmentSection):
    """The section with a row along the deepest crack."""

    p: CrackedSegmentParameters

    @property
    def cut_shares(self) -> Array:
        """Places (CUT + 1,) of columns along the crack, 0 at the surface, 1 at its end."""
        return np.asarray(1.0 - (1.0 - np.linspace(0.0, 1.0, CUT + 1)) ** CLOSER)

    @cached_property
    def crack_row(self) -> int:
        """Number of the row along which the crack runs."""
        section = self.tooth.root.section
        points = tooth_profile(self.tooth, self.div.flank, self.div.fillet).points
        start = np.array([section.distance, 0.5 * section.thickness])
        first = self.div.flank + 1  # below the involute, and above the base section
        return first + int(np.hypot(*(points[first:-1] - start).T).argmin())

    @cached_property
    def profile(self) -> ToothProfile:
        """With a node where the root section begins."""
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
        moved = start[0] - self.tooth.outward * down - block[row, :, 0]
        middle = block[:, block.shape[1] // 2, 0]
        reach = np.where(np.arange(len(block)) < row, middle[0], middle[-1])
        share = (middle - reach) / (middle[row] - reach)
        block[:, :, 0] += share[:, None] * moved
        return block
