r"""Interface ties of a body of equal sectors: those that share its period, and the others.

Ties whose rows turn into one another sector by sector (teeth, pins) are written once, on the dofs
of one sector, in its axes:  q(s) = B [x(s), x_b(s + 1)].  The others see all sectors together, q in
the body's axes: of those that a turn by one pitch leaves as they are (fits), every sector has the
same share C in its axes, the rest (bolts) keep a few rows on each sector they touch,

    q = sum_s R_s C x(s),   q = sum_s C_s x(s).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Ints
from flexgear.structures.bodies import rotation, six
from flexgear.structures.cyclic.sectors import Sectors
from flexgear.structures.fem.ties import Interface

_TOLERANCE = 1e-9  # of the largest radius, or of a tie's largest row entry


@dataclass(frozen=True, eq=False)
class SectorTies:
    """B (6c, 3n + 3b) of the c ties that every sector has, C and C_s of the others.

    periodic: (z, c) interface nodes of the sectors; other: (m,) the remaining nodes, first those
    of even (6e, 3n), which all sectors share alike; uneven: for each sector its rows among the
    6 m, and C_s (rows, 3n) CSR.
    """

    sectors: Sectors = field(repr=False)
    periodic: Ints = field(repr=False)
    rows: sp.csr_matrix = field(repr=False)
    other: Ints = field(repr=False)
    even: sp.csr_matrix = field(repr=False)
    uneven: tuple[tuple[Ints, sp.csr_matrix], ...] = field(repr=False)

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
        e = self.even.shape[0]
        even = (self.even @ x.reshape(len(x), -1)).reshape(e, z, k)
        other[:e] = self.turned(even, back=False).sum(axis=1)
        for s, (at, rows) in enumerate(self.uneven):
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
    n, z, b = *sectors.nodes.shape, sectors.border
    ties = _TiesBySector(interface.rows, sectors)
    orbits: list[Ints] = []
    rows: list[sp.csr_matrix] = []
    for orbit in _orbits(interface.positions, sectors):
        if not all(ties.alike(orbit[0], node, s) for s, node in enumerate(orbit)):
            continue
        begin = ties.home(orbit[0])
        if begin is None:
            return None
        orbits.append(np.roll(orbit, begin))
        seen = ties.seen(orbit[0], begin)
        rows.append(sp.hstack([seen[:, : 3 * n], seen[:, 3 * (2 * n - b) : 6 * n]]))
    if not orbits:
        return None
    periodic = np.stack(orbits, axis=1)
    rest = np.setdiff1d(np.arange(len(interface.node_names)), periodic)
    even = np.array([ties.alike(node, node, 1) for node in rest], dtype=bool)
    shares = [ties.seen(node, 0)[:, : 3 * n] for node in rest[even]]
    none = sp.csr_matrix((0, 3 * n))
    return SectorTies(
        sectors,
        periodic,
        sp.vstack(rows).tocsr(),
        np.concatenate([rest[even], rest[~even]]),
        sp.vstack([none, *shares]).tocsr(),
        tuple(ties.of_sector(s, rest[~even], 6 * len(shares)) for s in range(z)),
    )


def _orbits(positions: Array, sectors: Sectors) -> list[Ints]:
    """Interface nodes (z,) whose positions turn into one another, each set once."""
    tolerance = _TOLERANCE * max(float(np.hypot(positions[:, 0], positions[:, 1]).max()), 1e-300)
    distance, image = cKDTree(positions).query(positions @ rotation(sectors.pitch).T)
    image = np.where(distance <= tolerance, image, -1)
    seen = np.zeros(len(positions), dtype=bool)
    out = []
    for first in range(len(positions)):
        orbit = [first]
        while not seen[first] and len(orbit) < sectors.count and image[orbit[-1]] >= 0:
            orbit.append(int(image[orbit[-1]]))
        if len(orbit) == sectors.count == len(set(orbit)) and not seen[orbit].any():
            seen[orbit] = True
            out.append(np.array(orbit))
    return out


class _TiesBySector:
    """B on the dofs of sector 0, of sector 1, … in the axes of each sector: (6 nodes, 3n z)."""

    def __init__(self, rows: sp.csr_matrix, sectors: Sectors) -> None:
        n, z = sectors.nodes.shape
        self.sectors, self.turns = sectors, sectors.turns()
        axis, local = np.arange(3), np.arange(n)[:, None] + n * np.arange(z)
        dofs = 3 * sectors.nodes[..., None, None] + axis[:, None]
        columns = 3 * local[..., None, None] + axis
        entries = np.broadcast_arrays(self.turns, dofs, columns)
        values, dofs, columns = (a.ravel() for a in entries)
        turned = sp.csr_matrix((values, (dofs, columns)), shape=(3 * n * z, 3 * n * z))
        self.rows = (rows @ turned).tocsr()

    def seen(self, node: int, s: int) -> sp.csr_matrix:
        """(6, 3n z) rows of a tie as seen from sector s, which is the first then."""
        part = self.rows[6 * node : 6 * node + 6].tocoo()
        columns = (part.col - 3 * len(self.sectors.nodes) * s) % part.shape[1]
        shifted = sp.csr_matrix((part.data, (part.row, columns)), shape=part.shape)
        return sp.csr_matrix(six(self.turns[s].T)) @ shifted

    def alike(self, first: int, node: int, s: int) -> bool:
        """Whether a tie seen from sector s is the first one seen from sector 0."""
        one = self.seen(first, 0)
        apart = np.abs((self.seen(node, s) - one).data).max(initial=0.0)
        return bool(apart <= _TOLERANCE * float(np.abs(one.data).max()))

    def home(self, node: int) -> int | None:
        """The sector whose own nodes and next border hold all of a tie; None if there is none."""
        columns = self.rows[6 * node : 6 * node + 6].indices
        sector, local = np.divmod(columns, 3 * len(self.sectors.nodes))
        inside = np.unique(sector[local < 3 * self.sectors.interior])
        if len(inside) != 1:
            return None
        beyond = (sector - inside[0]) % self.sectors.count
        return int(inside[0]) if beyond.max() <= 1 else None

    def of_sector(self, s: int, nodes: Ints, begin: int) -> tuple[Ints, sp.csr_matrix]:
        """Rows of nodes with entries in sector s, counted from begin on, and these rows (r, 3n)."""
        size = 3 * len(self.sectors.nodes)
        dofs = (6 * nodes[:, None] + np.arange(6)).ravel()
        part = self.rows[dofs][:, size * s : size * (s + 1)].tocsr()
        used = np.repeat(np.diff(part.indptr).reshape(-1, 6).any(axis=1), 6)
        return begin + np.flatnonzero(used), part[used]
