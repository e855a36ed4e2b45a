r"""Blocks on which the rows of a flank act, with FE teeth turned back, for means over a cycle.

Contacts keep their place relative to the planet, while the teeth of an FE ring or FE planet pass
through the gear mesh. For a mean at a fixed place of the gear's displacement field, the motion of
tooth j, at the angle φ_j when the gear has advanced by δ, is replaced by that of the field at
φ_j − δ:

    u(φ_j − δ) = Σ_m D(φ_m − φ_j + δ) R(φ_j − φ_m) u_m

u_m (6,): displacement and rotation of tooth m of z; R: rotation about the axis; D: Dirichlet kernel
of z teeth, the band-limited interpolation between z equal angles. This interpolation commutes with
every matrix that is the same for all teeth (circulant).
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag

from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import Rows
from flexgear.coupling.pair_data import PairData
from flexgear.structures.bodies import rigid_rows


@dataclass(frozen=True)
class _Teeth:
    """The z teeth of an FE gear.

    first: number of their first block; place (z,): their angles, rad; turns: index of the angle of
    the train with which they pass the gear mesh, −1 where they do not pass it; sense: 1 where they
    pass it against that angle, else −1."""

    first: int
    place: Array
    turns: int
    sense: float

    def turned_back(self, wrench: Array, tooth: Ints, turned: Array) -> Array:
        """Rows (n, 6) on the motion of teeth (n,) as rows (n, 6 z) on the motions of all teeth,
        turned back by the advance; turned (n, A): angles of the train since the start, rad."""
        count = len(self.place)
        advance = np.zeros(len(tooth)) if self.turns < 0 else self.sense * turned[:, self.turns]
        angle = self.place - self.place[tooth][:, None]
        same_tooth = np.arange(count) == tooth[:, None]
        kernel = _kernel(angle + advance[:, None], count)
        share = np.where(advance[:, None] == 0.0, same_tooth, kernel)[..., None]
        c, s = share * np.cos(angle)[..., None], share * np.sin(angle)[..., None]
        x, y, z = (wrench[:, None, k::3] for k in range(3))
        out = np.empty((len(tooth), count, 6))
        out[..., 0::3] = c * x - s * y
        out[..., 1::3] = s * x + c * y
        out[..., 2::3] = share * z
        return out.reshape(len(tooth), 6 * count)


class FlankEnds:
    """Blocks on which the rows of flank m act: those of its planet and its gear, or all teeth of a
    gear or planet whose teeth are blocks. columns (c,): their dofs among those of all blocks; rigid
    (c, 6 e): their motions by those of e rigid ends."""

    def __init__(self, pairs: PairData, m: int) -> None:
        gear, planet = int(pairs.gear_block[m]), int(pairs.planet_tooth_block[m])
        self.teeth: list[_Teeth] = []
        if pairs.per_tooth[m]:
            place = _angles(pairs.tooth_position, gear, int(pairs.gear_teeth[m]))
            self.teeth.append(_Teeth(gear, place, int(pairs.turns[m]), 1.0))
        if pairs.planet_turns[m] >= 0:
            place = _angles(pairs.tooth_position, planet, int(pairs.planet_teeth[m]))
            self.teeth.append(_Teeth(planet, place, int(pairs.planet_turns[m]), -1.0))
        bodies = [int(pairs.planet_block[m]), *([] if pairs.per_tooth[m] else [gear])]
        blocks = [*bodies, *(t.first + k for t in self.teeth for k in range(len(t.place)))]
        self.columns = (6 * np.array(blocks)[:, None] + np.arange(6)).ravel().astype(np.int64)
        starts = np.cumsum([6 * len(bodies), *(6 * len(t.place) for t in self.teeth)]).tolist()
        self._teeth_columns = [slice(a, b) for a, b in pairwise(starts)]
        self._body_column = {block: 6 * k for k, block in enumerate(bodies)}
        ends = [np.zeros((1, 3))] * len(bodies)
        ends += [pairs.tooth_position[t.first : t.first + len(t.place)] for t in self.teeth]
        self.rigid = block_diag(*(rigid_rows(positions) for positions in ends))

    def coefficients(self, rows: Rows, at: Ints, angles: Array, start: Array) -> Array:
        """The rows numbered ``at`` (n,) on the motions ``columns``: (n, c). Teeth are turned back
        by their advance from angles ``start`` (A,) to ``angles``, of all rows (A,) or each (n, A).
        """
        out = np.zeros((len(at), len(self.columns)))
        turned = np.broadcast_to(angles - start, (len(at), len(start)))
        blocks, coef, width = rows.blocks[at], rows.coef[at], rows.row["width"][at]
        for a in range(int(width.max(initial=0))):
            for block, column in self._body_column.items():
                selected = (a < width) & (blocks[:, a] == block)
                out[selected, column : column + 6] += coef[selected, a]
            for teeth, columns in zip(self.teeth, self._teeth_columns, strict=True):
                tooth = blocks[:, a] - teeth.first
                selected = np.flatnonzero((a < width) & (tooth >= 0) & (tooth < len(teeth.place)))
                out[selected, columns] += teeth.turned_back(
                    coef[selected, a], tooth[selected], turned[selected]
                )
        return out


def _angles(positions: Array, first: int, teeth: int) -> Array:
    """Angles (z,) about the axis, rad, of ``teeth`` tooth nodes from block ``first`` on; positions
    (n, 3) m: of all blocks."""
    place = positions[first : first + teeth]
    return np.arctan2(place[:, 1], place[:, 0])


def _kernel(x: Array, count: int) -> Array:
    """Dirichlet kernel of ``count`` equal angles: 1 at x = 0, 0 at other multiples of 2π/count."""
    denominator = count * (np.sin(0.5 * x) if count % 2 else np.tan(0.5 * x))
    at_zero = np.abs(np.sin(0.5 * x)) < 1e-12
    return np.where(at_zero, 1.0, np.sin(0.5 * count * x) / np.where(at_zero, 1.0, denominator))
