r"""Mass and recovery of a reduced body from its constraint modes, without storing these.

With Psi = Psi_t [I 0] + Y N, N = G^{-1} [-H I], H and G of `cyclic/solver.py`, J = [I 0],

    Psi^T M Psi = J^T A J + J^T B N + N^T B^T J + N^T C N,
    A = Psi_t^T M Psi_t,  B = Psi_t^T M Y,  C = Y^T M Y.

A is block-circulant: the fields under sector 0's ties give all. A sector without loads moves by its
ends alone, x(s) = R e(s) + U(s) c(s), see `CyclicSolver.shapes`, so that products with M need the
ends only and no field of Y: with E one sector's part of M,

    x^T M y = sum_s e_x^T g_y + c_x^T (U^T E R e_y + U^T E U c_y),   g = R^T E R e + R^T E U c.
"""

from dataclasses import dataclass

import numpy as np
import scipy.fft
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.arrays import Array, Ints
from flexgear.structures.cyclic.sectors import Circulant
from flexgear.structures.cyclic.solver import CyclicSolver
from flexgear.structures.cyclic.ties import SectorTies
from flexgear.structures.linalg.dense import THREADS, dot, shared

Singles = NDArray[np.float32]

_COLUMNS = 32  # of Y that are processed together


def condensed_stiffness(solver: CyclicSolver, ties: SectorTies) -> Array:
    """K_bb (b, b) = [K_t 0; 0 0] + [-H I]^T G^{-1} [-H I]."""
    stiffness = circulant(solver.stiffness)
    out = solver.other_motions().T @ solver.other_share()
    out[: len(stiffness), : len(stiffness)] += stiffness
    return _in_body(out, ties)


@dataclass(frozen=True, eq=False)
class SectorMotion:
    """Inertia of a sector's ends, and motion of those of its dofs that are recovered (r,).

    rows: numbers of these dofs; shapes: R (r, e); fields: by sector, numbers (u,) of its other ties
    and U (r, u); inertia: R^T E R (e, e); mixed: by sector, R^T E U (e, u) and U^T E U (u, u);
    periodic: ends (e, z, t) of Psi_t under sector 0's ties.
    """

    rows: Ints
    shapes: Array
    fields: dict[int, tuple[Ints, Array]]
    inertia: Array
    mixed: dict[int, tuple[Array, Array]]
    periodic: Array


def sector_motion(
    solver: CyclicSolver, ties: SectorTies, mass: Circulant, recovered: int
) -> SectorMotion:
    """Motion of the sectors of an FE mesh; recovered: number of its first dofs to recover."""
    shapes, local = solver.shapes()
    inertia, mixed = _sector_mass(shapes, local, mass.extended())
    vertices = ties.sectors.nodes[:, 0] < recovered // 3
    rows = np.flatnonzero(np.repeat(vertices, 3))
    fields = {s: (at, field[rows]) for s, (at, field) in local.items()}
    return SectorMotion(rows, shapes[rows], fields, inertia, mixed, solver.periodic_ends())


def project_constraint_modes(
    solver: CyclicSolver, ties: SectorTies, motion: SectorMotion, recovery: Singles
) -> Array:
    """Psi^T M Psi (b, b); writes Psi at the mesh's first dofs to recovery (r, b)."""
    t, z, m = ties.rows.shape[0], ties.sectors.count, ties.other_size
    periodic = motion.periodic
    a = _correlated(periodic, _times(motion.inertia, periodic)).transpose(0, 2, 1)
    c, b, y = _other_products(solver, motion, periodic)

    n = solver.other_share()
    cross = np.vstack([b, np.zeros((m, m))]) @ n
    out = cross + cross.T + n.T @ c @ n
    out[: t * z, : t * z] += circulant(a)
    fields = _times(motion.shapes, periodic)
    _recover(ties, motion.rows, fields, y, ties.joined_rows(n), recovery)
    return _in_body(out, ties)


def _other_products(
    solver: CyclicSolver, motion: SectorMotion, periodic: Array
) -> tuple[Array, Array, Array]:
    """C = Y^T M Y (m, m), B = Psi_t^T M Y (t z, m) and Y at the recovered dofs (r, z, m)."""
    inertia, mixed, local = motion.inertia, motion.mixed, motion.fields
    ends = solver.other_ends()
    e, z, m = ends.shape
    t = periodic.shape[2]
    other = _times(motion.shapes, ends)
    others, across = np.empty((m, m)), np.empty((t * z, m))
    flat = ends.reshape(e * z, m)

    def part(columns: slice) -> None:
        some = np.ascontiguousarray(ends[:, :, columns])
        momentum = (inertia @ some.reshape(e, -1)).reshape(some.shape)
        for s, (at, _) in local.items():
            selected = (at >= columns.start) & (at < columns.stop)
            momentum[:, s, at[selected] - columns.start] += mixed[s][0][:, selected]
        across[:, columns] = _correlated(periodic, momentum).reshape(t * z, -1)
        others[:, columns] = flat.T @ momentum.reshape(e * z, -1)

    shared(m, part, _COLUMNS)
    for s, (at, fields) in local.items():
        mixed_part, fields_part = mixed[s]
        others[at] += mixed_part.T @ ends[:, s]
        others[np.ix_(at, at)] += fields_part
        other[:, s, at] += fields
    return others, across, other


def _sector_mass(
    shapes: Array, local: dict[int, tuple[Ints, Array]], mass: sp.csr_matrix
) -> tuple[Array, dict[int, tuple[Array, Array]]]:
    """``SectorMotion.inertia`` and ``mixed``, from R (r, e), U of each sector and its mass E."""
    numbers = sorted(local)
    begin = np.cumsum([0] + [len(local[s][0]) for s in numbers])
    fields = np.hstack([np.zeros((len(shapes), 0))] + [local[s][1] for s in numbers])
    loads = mass @ fields
    of_ends = dot(shapes, loads)
    mixed = {
        s: (of_ends[:, first:last], local[s][1].T @ loads[:, first:last])
        for s, first, last in zip(numbers, begin, begin[1:], strict=False)
    }
    return dot(shapes, mass @ shapes), mixed


def _times(a: Array, x: Array) -> Array:
    """Product (r, z, k) of a (r, n) and x (n, z, k)."""
    flat = x.reshape(len(x), -1)
    out = np.empty((len(a), flat.shape[1]))

    def part(columns: slice) -> None:
        out[:, columns] = a @ flat[:, columns]

    shared(flat.shape[1], part)
    return out.reshape(len(a), *x.shape[1:])


def _correlated(x: Array, y: Array) -> Array:
    """Correlation sum_s x(s - j)^T y(s) (a, z, c) for all j, of x (n, z, a) and y (n, z, c)."""
    first, second = (scipy.fft.rfft(f, axis=1, workers=THREADS).transpose(1, 0, 2) for f in (x, y))
    product = first.conj().transpose(0, 2, 1) @ second
    return scipy.fft.irfft(product, x.shape[1], axis=0).transpose(1, 0, 2)


def circulant(blocks: Array) -> Array:
    """Block-circulant matrix (t z, t z) in the order (tie, sector), from its blocks (t, t, z)
    between every sector and sector 0."""
    t, _, z = blocks.shape
    s = np.arange(z)
    return blocks[:, :, (s[:, None] - s) % z].transpose(0, 2, 1, 3).reshape(t * z, t * z)


def _in_body(matrix: Array, ties: SectorTies) -> Array:
    """Symmetric matrix (b, b) on the dofs of the interface, from one on [periodic dofs in sector
    axes, other dofs]."""
    out = ties.joined_rows(ties.joined_rows(matrix).T)
    return 0.5 * (out + out.T)


def _recover(
    ties: SectorTies, rows: Ints, periodic: Array, other: Array, share: Array, recovery: Singles
) -> None:
    """Write Psi at the vertices ``rows`` to recovery, from periodic, Psi_t (r, z, t) of sector 0's
    ties, other, Y (r, z, m), and share, N (m, b).

    The field under sector j's ties is that under sector 0's, turned by j pitches.
    """
    nodes, z = ties.sectors.nodes[rows[::3] // 3], ties.sectors.count  # (v, z)
    turns, dofs = ties.sectors.turns(), ties.periodic_dofs.T  # (z, t)
    out = recovery.reshape(-1, 3, recovery.shape[1])

    def part(which: slice) -> None:
        for s in range(which.start, which.stop):
            field = np.ascontiguousarray(other[:, s]) @ share
            local = periodic[:, (s - np.arange(z)) % z].reshape(len(field), z, -1, 3)
            field[:, dofs] += (local @ turns.swapaxes(1, 2)).reshape(len(field), *dofs.shape)
            out[nodes[:, s]] = turns[s] @ field.reshape(-1, 3, field.shape[1])

    shared(z, part, chunk=1)
