r"""What a reduced body keeps of its constraint modes, without ever holding them.

With Psi = Psi_t [I 0] + Y N, N = G^{-1} [-H I], H and G of `cyclic_solver.py`, J = [I 0],

    Psi^T M Psi = J^T A J + J^T B N + N^T B^T J + N^T C N,
    A = Psi_t^T M Psi_t,  B = Psi_t^T M Y,  C = Y^T M Y.

A is block-circulant: the fields of sector 0's ties give all. B and C come block by block of Y from
what M Y does to the ties, for Psi_t^T g = -lambda and Y^T g = q0 of a solution under g.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.structures.cyclic_matrices import Circulant
from flexgear.structures.cyclic_solver import CyclicSolver
from flexgear.structures.cyclic_threads import shared
from flexgear.structures.cyclic_ties import SectorTies

Array = NDArray[np.float64]
Singles = NDArray[np.float32]
Ints = NDArray[np.int64]


def condensed_stiffness(solver: CyclicSolver, ties: SectorTies) -> Array:
    """K_bb (b, b) = [K_t 0; 0 0] + [-H I]^T G^{-1} [-H I]."""
    own = circulant(solver.stiffness)
    out = solver.other_motions().T @ solver.other_share()
    out[: len(own), : len(own)] += own
    return _in_body(out, ties)


def project_constraint_modes(
    solver: CyclicSolver, ties: SectorTies, mass: Circulant, block: int, recovery: Singles
) -> Array:
    """Psi^T M Psi (b, b); fills in Psi at the mesh's first dofs, recovery (r, b).

    block: columns of Y worked on at once.
    """
    vertices = ties.sectors.nodes[:, 0] < len(recovery) // 3
    rows = np.flatnonzero(np.repeat(vertices, 3))
    t, z, m = ties.rows.shape[0], ties.sectors.count, ties.other_size

    periodic = solver.periodic_motion()
    own = -solver.tied(mass.product(periodic))[0].transpose(0, 2, 1)
    periodic = periodic[rows]
    across, others = np.empty((t * z, m)), np.empty((m, m))
    other = np.empty((len(rows), z, m))
    for start in range(0, m, block):
        columns = slice(start, min(start + block, m))
        y = solver.other_motion(columns)
        other[:, :, columns] = y[rows]
        reactions, others[:, columns] = solver.tied(mass.product(y))
        across[:, columns] = -reactions.reshape(t * z, -1)

    share = solver.other_share()
    mixed = np.vstack([across, np.zeros((m, m))]) @ share
    out = mixed + mixed.T + share.T @ others @ share
    out[: t * z, : t * z] += circulant(own)
    _recover(ties, rows, periodic, other, ties.joined_rows(share), recovery)
    return _in_body(out, ties)


def circulant(blocks: Array) -> Array:
    """(t z, t z) in the order (tie, sector) from what sector 0 does to the others (t, t, z)."""
    t, _, z = blocks.shape
    s = np.arange(z)
    return blocks[:, :, (s[:, None] - s) % z].transpose(0, 2, 1, 3).reshape(t * z, t * z)


def _in_body(matrix: Array, ties: SectorTies) -> Array:
    """A matrix on [periodic in sector axes, others] on the interface's own dofs; symmetric."""
    out = ties.joined_rows(ties.joined_rows(matrix).T)
    return 0.5 * (out + out.T)


def _recover(
    ties: SectorTies, rows: Ints, periodic: Array, other: Array, share: Array, recovery: Singles
) -> None:
    """Psi at vertices from Psi_t (r, z, t) of sector 0, Y (r, z, m) and N (m, b)."""
    nodes = ties.sectors.nodes[rows[::3] // 3]  # (v, z)
    z = ties.sectors.count
    turns = ties.sectors.turns()
    columns = ties.periodic_dofs.reshape(-1, 3, z).transpose(0, 2, 1).ravel()  # (t/3, z, 3)
    cos, sin = turns[:, 0, 0], turns[:, 1, 0]

    def part(which: slice) -> None:
        for s in range(which.start, which.stop):
            field = np.ascontiguousarray(other[:, s]) @ share
            behind = (s - np.arange(z)) % z  # sector 0's field as sector j's
            mine = periodic[:, behind].transpose(0, 2, 1).reshape(-1, 3, z)
            _turn(mine, cos, sin)
            field[:, columns] += mine.swapaxes(1, 2).reshape(len(rows), -1)
            parts = field.reshape(len(nodes), 3, -1)
            _turn(parts, cos[s], sin[s])
            whole = recovery.reshape(-1, 3, recovery.shape[1])
            whole[nodes[:, s]] = parts

    shared(z, part, chunk=1)


def _turn(x: Array, cos: Array, sin: Array) -> None:
    """Components x (n, 3, ...) turned about z, in place; cos and sin of the last axis or of all."""
    first = cos * x[:, 0] - sin * x[:, 1]
    x[:, 1] = sin * x[:, 0] + cos * x[:, 1]
    x[:, 0] = first
