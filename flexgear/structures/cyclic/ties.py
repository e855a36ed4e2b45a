r"""Interface ties of a body of equal sectors: periodic ones, and the others.

Periodic ties (teeth, pins) are images of one another sector by sector. One matrix on the dofs of a
sector, along its axes, describes them all:  q(s) = B [x(s), x_b(s + 1)].  The others (fits, bolts)
are sums over the sectors that they touch, q along the body's axes,

    q = sum_s C_s x(s).
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Ints
from flexgear.structures.bodies import rotation
from flexgear.structures.cyclic.sectors import Sectors, orbits
from flexgear.structures.fem.ties import Interface

_TOLERANCE = 1e-9  # of the largest radius, or of a tie's largest row entry


@dataclass(frozen=True, eq=False)
class SectorTies:
    """Ties of a body of equal sectors, c periodic ones in every sector and m others.

    periodic: (z, c) interface nodes by sector; rows: B (6c, 3n + 3b); other: (m,) the remaining
    nodes; local: for each sector the numbers (r,) of its rows among the 6 m, and C_s (r, 3n) CSR;
    invariant: whether the others, too, are the same when the body turns by one sector.
    """

    sectors: Sectors = field(repr=False)
    periodic: Ints = field(repr=False)
    rows: sp.csr_matrix = field(repr=False)
    other: Ints = field(repr=False)
    local: tuple[tuple[Ints, sp.csr_matrix], ...] = field(repr=False)
    invariant: bool

    @property
    def other_size(self) -> int:
        """Number of dofs of the other ties."""
        return 6 * len(self.other)

    @property
    def periodic_dofs(self) -> Ints:
        """Interface dofs (6c, z) of the periodic ties."""
        dofs = 6 * self.periodic[:, :, None] + np.arange(6)
        return dofs.reshape(len(dofs), -1).T

    @property
    def other_dofs(self) -> Ints:
        """Interface dofs (6m,) of the other ties."""
        return (6 * self.other[:, None] + np.arange(6)).ravel()

    def split(self, q: Array) -> tuple[Array, Array]:
        """Parts of interface vectors (6n, k) of the periodic ties (6c, z, k), along the sectors'
        axes, and of the others (6m, k)."""
        return self.turned(q[self.periodic_dofs], back=True), q[self.other_dofs]

    def joined(self, periodic: Array, other: Array) -> Array:
        """Interface vectors (6n, k) from the parts that ``split`` returns."""
        out = np.empty((6 * (self.periodic.size + len(self.other)), other.shape[1]))
        out[self.periodic_dofs] = self.turned(periodic, back=False)
        out[self.other_dofs] = other
        return out

    def joined_rows(self, matrix: Array) -> Array:
        """Matrix (r, 6n) on the interface's dofs from one (r, 6c z + 6m) on [periodic, other]
        dofs."""
        t, z = self.rows.shape[0], self.sectors.count
        columns = matrix.T
        return self.joined(columns[: t * z].reshape(t, z, -1), columns[t * z :]).T

    def turned(self, q: Array, back: bool) -> Array:
        """Translations and rotations (6c, z, k) along the sectors' axes in components along the
        body's axes; back: the reverse."""
        turns = self.sectors.turns()
        if back:
            turns = turns.swapaxes(1, 2)
        parts = q.reshape(len(q) // 3, 3, *q.shape[1:])
        return np.einsum("sij,ajsk->aisk", turns, parts).reshape(q.shape)


def sector_ties(interface: Interface, sectors: Sectors) -> SectorTies | None:
    """Ties by sectors; None where no tie is periodic, or one of them reaches beyond its sector and
    the next border."""
    z = sectors.count
    ties = _TiesBySector(interface.rows, sectors)
    starts: list[Ints] = []
    rows: list[sp.csr_matrix] = []
    for orbit in _node_orbits(interface.positions, sectors):
        if not all(ties.alike(orbit[0], node, s) for s, node in enumerate(orbit)):
            continue
        first = ties.sector_of(orbit[0])
        if first is None:
            return None
        starts.append(np.roll(orbit, first))
        of_first = ties.relative_to(orbit[0], first)
        rows.append(sp.hstack([of_first[:, ::z], of_first[:, 1::z][:, 3 * sectors.interior :]]))
    if not starts:
        return None
    periodic = np.stack(starts, axis=1)
    rest = np.setdiff1d(np.arange(len(interface.node_names)), periodic)
    local = tuple(ties.of_sector(s, rest) for s in range(z))
    invariant = all(ties.alike(node, node, 1) for node in rest)
    return SectorTies(sectors, periodic, sp.vstack(rows).tocsr(), rest, local, invariant)


def _node_orbits(positions: Array, sectors: Sectors) -> Ints:
    """Interface nodes (k, z) whose positions are images of one another, each set once."""
    tolerance = _TOLERANCE * max(float(np.hypot(positions[:, 0], positions[:, 1]).max()), 1e-300)
    distance, image = cKDTree(positions).query(positions @ rotation(sectors.pitch).T)
    paths = orbits(np.arange(len(positions)), image, sectors.count)
    rising = np.sort(paths, axis=1)
    whole = (distance <= tolerance)[paths].all(axis=1) & (np.diff(rising) > 0).all(axis=1)
    return paths[whole & (paths[:, 0] == rising[:, 0])]


class _TiesBySector:
    """Matrix B (6 nodes, 3n z) of all ties on fields in sector form."""

    def __init__(self, rows: sp.csr_matrix, sectors: Sectors) -> None:
        self.sectors, self.turns = sectors, sectors.turns()
        self.rows = (rows @ sectors.axes).tocsr()

    def relative_to(self, node: int, s: int) -> sp.csr_matrix:
        """Rows (6, 3n z) of a tie along the axes of sector s, sectors counted from there."""
        part, z = self.rows[6 * node : 6 * node + 6].tocoo(), self.sectors.count
        columns = part.col - part.col % z + (part.col - s) % z
        shifted = sp.csr_matrix((part.data, (part.row, columns)), shape=part.shape)
        return sp.csr_matrix(np.kron(np.eye(2), self.turns[s].T)) @ shifted

    def alike(self, first: int, node: int, s: int) -> bool:
        """Whether a tie relative to sector s is the same as the first one relative to sector 0."""
        rows = self.relative_to(first, 0)
        difference = np.abs((self.relative_to(node, s) - rows).data).max(initial=0.0)
        return bool(difference <= _TOLERANCE * float(np.abs(rows.data).max()))

    def sector_of(self, node: int) -> int | None:
        """The sector whose nodes and next border have all entries of a tie; None without one."""
        columns = self.rows[6 * node : 6 * node + 6].indices
        local, sector = np.divmod(columns, self.sectors.count)
        inside = np.unique(sector[local < 3 * self.sectors.interior])
        if len(inside) != 1:
            return None
        ahead = (sector - inside[0]) % self.sectors.count
        return int(inside[0]) if ahead.max() <= 1 else None

    def of_sector(self, s: int, nodes: Ints) -> tuple[Ints, sp.csr_matrix]:
        """Numbers (r,) of the rows of nodes that have entries in sector s, and these entries
        (r, 3n)."""
        dofs = (6 * nodes[:, None] + np.arange(6)).ravel()
        part = self.rows[dofs][:, s :: self.sectors.count].tocsr()
        used = np.repeat(np.diff(part.indptr).reshape(-1, 6).any(axis=1), 6)
        return np.flatnonzero(used), part[used]
