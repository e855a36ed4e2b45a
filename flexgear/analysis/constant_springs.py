"""Springs in turning frames between bodies whose receptances are the same at every angle.

They are worked out at some angles; where all agree, a step eliminates the springs from its contact
problem (``kernels.eliminated_springs``), else they stay rows of it.
"""

from __future__ import annotations

import numpy as np

from flexgear.analysis.kernels.active_dofs import Channels
from flexgear.analysis.kernels.eliminated_springs import EliminatedSprings, no_springs
from flexgear.analysis.kernels.vectors import aligned, rounded_up
from flexgear.arrays import Array
from flexgear.coupling.pair_data import PairData
from flexgear.structures.bodies import rotation

ANGLES = (0.0, 0.7, 2.3, 4.4)  # rad, of the first angle of a system; each further one turns on
SAME = 1e-11  # of the receptances of two rows by themselves


def eliminated_springs(pairs: PairData, channels: Channels, ports: int) -> EliminatedSprings:
    """The rotating-frame supports for steps with the receptances of ``channels``; none of them
    where a receptance between them, or to a port or line of action, changes with the angle."""
    levels, stiffness = len(channels.displacement), pairs.support_stiffness
    first = 6 * len(channels.part)
    head = slice(first, first + ports + 2 * len(pairs.s0) + 1)
    nothing = no_springs(levels, head.stop - head.start)
    if not len(stiffness) or not stiffness.all():
        return nothing
    count, size = len(stiffness), rounded_up(len(stiffness))
    at = np.unique(pairs.support_block[pairs.support_block >= 0])
    at = (6 * at[:, None] + np.arange(6)).ravel()
    rows = np.array([_rows(pairs, angle, first)[:, at] for angle in ANGLES])
    shape = (levels, head.stop - head.start, size)
    condensed, *tables = aligned(levels, count, size), *(aligned(*shape) for _ in range(3))
    displacement, modal, force = tables
    for level, g in enumerate(channels.displacement):
        between = rows @ g[np.ix_(at, at)] @ rows.transpose(0, 2, 1)
        each = np.sqrt(np.abs(np.diagonal(between[0])))
        scale = np.outer(each, np.sqrt(np.abs(np.diag(g)[head])))
        for table, matrix in ((displacement, g), (modal, g - channels.residual)):
            across = rows @ matrix[at, head]
            if not _all_same(across, scale):
                return nothing
            table[level, :, :count] = across[0].T
        if not _all_same(between, np.outer(each, each)):
            return nothing
        flexibility = np.diag(1.0 / stiffness) + 0.5 * (between[0] + between[0].T)
        condensed[level, :, :count] = np.linalg.inv(flexibility)
        force[level] = displacement[level, :, :count] @ condensed[level]
    return EliminatedSprings(np.array(stiffness), condensed, displacement, modal, force)


def _all_same(values: Array, scale: Array) -> bool:
    """Whether values (angles, …) differ by nothing but rounding."""
    return bool((np.abs(values - values[0]) <= SAME * scale + np.finfo(float).tiny).all())


def _rows(pairs: PairData, angle: float, channels: int) -> Array:
    """Rows (B, channels) of the supports where every angle of the system is a multiple of one."""
    out = np.zeros((len(pairs.support_block), channels))
    for row, blocks, angles, vectors in zip(
        out, pairs.support_block, pairs.support_angle, pairs.support_vector, strict=True
    ):
        for block, index, vector in zip(blocks, angles, vectors, strict=True):
            if block >= 0:
                turn = rotation(angle * (index + 1)) if index >= 0 else np.eye(3)
                row[6 * block : 6 * block + 6] += (vector.reshape(2, 3) @ turn).ravel()
    return out
