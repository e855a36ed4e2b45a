r"""Interface ties of a body of equal sectors: those that share its period, and the others.

Ties whose rows turn into one another sector by sector (teeth, pins) are written once, on the dofs
of one sector, in its axes:  q(s) = B [x(s), x_b(s + 1)].  The others (fits, bolts) see all sectors
together, q in the body's axes, and keep a few rows on each sector they touch,

    q = sum_s C_s x(s).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Ints
from flexgear.structures.bodies import rotation, six
from flexgear.structures.cyclic.sectors import Sectors, orbits
from flexgear.structures.fem.ties import Interface

_TOLERANCE = 1e-9  # of the largest radius, or of a tie's largest row entry


@dataclass(frozen=True, eq=False)
class SectorTies:
    """B (6c, 3n + 3b) of the c ties that every sector has, C_s of the others.

    periodic: (z, c) interface nodes of the sectors; other: (m,) the remaining nodes; local: for
    each sector its rows among the 6 m, and C_s (rows, 3n) CSR.
    """

    sectors: Sectors = field(repr=False)
    periodic: Ints = field(repr=False)
    rows: sp.csr_matrix = field(repr=False)
    other: Ints = field(repr=False)
    local: tuple[tuple[Ints, sp.csr_matrix], ...] = field(repr=False)

    @property
    def other_size(self) -> int:
        """Dofs of the ties that do not share the period."""
        return 6 * len(self.other)

    @property
    def periodic_dofs(self) -> Ints:
        """(6c, z) interface dofs of the periodic ties."""
        dofs = 6 * self.periodic[:, :, None] + np.arange(6)
        return dofs.reshape(len(dofs), -1).T

    @property
    def other_dofs(self) -> Ints:
        """(6m,) interface dofs of the others."""
        return (6 * self.other[:, None] + np.arange(6)).ravel()

    def split(self, q: Array) -> tuple[Array, Array]:
        """(6c, z, k) in the sectors' axes and (6m, k) of interface vectors (6n, k)."""
        return self.turned(q[self.periodic_dofs], back=True), q[self.other_dofs]

    def joined(self, periodic: Array, other: Array) -> Array:
        """Interface vectors (6n, k) from (6c, z, k) and (6m, k)."""
        out = np.empty((6 * (self.periodic.size + len(self.other)), other.shape[1]))
        out[self.periodic_dofs] = self.turned(periodic, back=False)
        out[self.other_dofs] = other
        return out

    def joined_rows(self, matrix: Array) -> Array:
        """(m, 6n) on the interface's dofs of (m, 6c z + 6m) on [periodic, others] ones."""
        t, z = self.rows.shape[0], self.sectors.count
        columns = matrix.T
        return self.joined(columns[: t * z].reshape(t, z, -1), columns[t * z :]).T

    def motion(self, x: Array) -> Array:
        """q = B x (6n, k) of fields (3n, z, k) in sector form."""
        z, k = x.shape[1:]
        motion = self.rows[:, : len(x)] @ x.reshape(len(x), -1)
        border = x[len(x) - 3 * self.sectors.border :]
        ahead = self.rows[:, len(x) :] @ np.roll(border, -1, axis=1).reshape(len(border), -1)
        other = np.zeros((self.other_size, k))
        for s, (at, rows) in enumerate(self.local):
            if len(at):
                other[at] += rows @ np.ascontiguousarray(x[:, s])
        return self.joined((motion + ahead).reshape(-1, z, k), other)

    def turned(self, q: Array, back: bool) -> Array:
        """Translations and rotations (6c, z, k) in the body's axes, or back in the sectors'."""
        turns = self.sectors.turns()
        if back:
            turns = turns.swapaxes(1, 2)
        parts = q.reshape(len(q) // 3, 3, *q.shape[1:])
        return np.einsum("sij,ajsk->aisk", turns, parts).reshape(q.shape)


def sector_ties(interface: Interface, sectors: Sectors) -> SectorTies | None:
    """Ties by sectors; None where no tie has the period or one reaches beyond its sector."""
    z = sectors.count
    ties = _TiesBySector(interface.rows, sectors)
    starts: list[Ints] = []
    rows: list[sp.csr_matrix] = []
    for orbit in _node_orbits(interface.positions, sectors):
        if not all(ties.alike(orbit[0], node, s) for s, node in enumerate(orbit)):
            continue
        begin = ties.home(orbit[0])
        if begin is None:
            return None
        starts.append(np.roll(orbit, begin))
        seen = ties.seen(orbit[0], begin)
        rows.append(sp.hstack([seen[:, ::z], seen[:, 1::z][:, 3 * sectors.interior :]]))
    if not starts:
        return None
    periodic = np.stack(starts, axis=1)
    rest = np.setdiff1d(np.arange(len(interface.node_names)), periodic)
    local = tuple(ties.of_sector(s, rest) for s in range(z))
    return SectorTies(sectors, periodic, sp.vstack(rows).tocsr(), rest, local)


def _node_orbits(positions: Array, sectors: Sectors) -> Ints:
    """Interface nodes (k, z) whose positions turn into one another, each set once."""
    tolerance = _TOLERANCE * max(float(np.hypot(positions[:, 0], positions[:, 1]).max()), 1e-300)
    distance, image = cKDTree(positions).query(positions @ rotation(sectors.pitch).T)
    paths = orbits(np.arange(len(positions)), image, sectors.count)
    rising = np.sort(paths, axis=1)
    whole = (distance <= tolerance)[paths].all(axis=1) & (np.diff(rising) > 0).all(axis=1)
    return paths[whole & (paths[:, 0] == rising[:, 0])]


class _TiesBySector:
    """B (6 nodes, 3n z) on fields in sector form."""

    def __init__(self, rows: sp.csr_matrix, sectors: Sectors) -> None:
        self.sectors, self.turns = sectors, sectors.turns()
        self.rows = (rows @ sectors.axes).tocsr()

    def seen(self, node: int, s: int) -> sp.csr_matrix:
        """(6, 3n z) rows of a tie as seen from sector s, which is the first then."""
        part, z = self.rows[6 * node : 6 * node + 6].tocoo(), self.sectors.count
        columns = part.col - part.col % z + (part.col - s) % z
        shifted = sp.csr_matrix((part.data, (part.row, columns)), shape=part.shape)
        return sp.csr_matrix(six(self.turns[s].T)) @ shifted

    def alike(self, first: int, node: int, s: int) -> bool:
        """Whether a tie seen from sector s is the first one seen from sector 0."""
        rows = self.seen(first, 0)
        difference = np.abs((self.seen(node, s) - rows).data).max(initial=0.0)
        return bool(difference <= _TOLERANCE * float(np.abs(rows.data).max()))

    def home(self, node: int) -> int | None:
        """The sector whose own nodes and next border hold all of a tie; None if there is none."""
        columns = self.rows[6 * node : 6 * node + 6].indices
        local, sector = np.divmod(columns, self.sectors.count)
        inside = np.unique(sector[local < 3 * self.sectors.interior])
        if len(inside) != 1:
            return None
        beyond = (sector - inside[0]) % self.sectors.count
        return int(inside[0]) if beyond.max() <= 1 else None

    def of_sector(self, s: int, nodes: Ints) -> tuple[Ints, sp.csr_matrix]:
        """Rows of nodes with entries in sector s, and these rows (r, 3n)."""
        dofs = (6 * nodes[:, None] + np.arange(6)).ravel()
        part = self.rows[dofs][:, s :: self.sectors.count].tocsr()
        used = np.repeat(np.diff(part.indptr).reshape(-1, 6).any(axis=1), 6)
        return np.flatnonzero(used), part[used]
