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
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.structures.cyclic.sectors import Sectors
from flexgear.structures.fem import Interface
from flexgear.structures.kinematics import rotation, six

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

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
    blocks = _LocalBlocks(interface.rows, sectors)
    orbits: list[Ints] = []
    rows: list[sp.csr_matrix] = []
    for orbit in _orbits(interface.positions, sectors):
        if not blocks.alike(orbit):
            continue
        begin = blocks.home(orbit[0])
        if begin is None:
            return None
        orbits.append(np.roll(orbit, begin))
        rows.append(blocks.rows(orbit[0], begin))
    if not orbits:
        return None
    periodic = np.stack(orbits, axis=1)
    rest = np.setdiff1d(np.arange(len(interface.node_names)), periodic)
    even = np.array([blocks.even(node) for node in rest], dtype=bool)
    other = np.concatenate([rest[even], rest[~even]])
    shares = [blocks.share(node) for node in rest[even]]
    none = sp.csr_matrix((0, 3 * len(sectors.nodes)))
    return SectorTies(
        sectors,
        periodic,
        sp.vstack(rows).tocsr(),
        other,
        sp.vstack([none, *shares]).tocsr(),
        blocks.by_sector(rest[~even], 6 * len(shares)),
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


class _LocalBlocks:
    """The rows of B as blocks (6, 3) on nodes, columns in the axes of each node's sector."""

    def __init__(self, rows: sp.csr_matrix, sectors: Sectors) -> None:
        n, z = sectors.nodes.shape
        self.sectors = sectors
        self.turns = sectors.turns()
        local, sector = np.empty(n * z, dtype=np.int64), np.empty(n * z, dtype=np.int64)
        local[sectors.nodes] = np.arange(n)[:, None]
        sector[sectors.nodes] = np.arange(z)
        blocks = rows.tobsr(blocksize=(6, 3))
        self.indptr = blocks.indptr
        self.local, self.sector = local[blocks.indices], sector[blocks.indices]
        self.data = blocks.data @ self.turns[self.sector]

    def alike(self, orbit: Ints) -> bool:
        """Whether the ties of an orbit are images of one another."""
        first = self._relative(orbit[0], 0)
        return all(
            np.abs((self._relative(node, s) - first).data).max(initial=0.0) <= self._scale(first)
            for s, node in enumerate(orbit)
        )

    def home(self, node: int) -> int | None:
        """The sector whose own nodes and next border hold all of a tie; None if there is none."""
        at = self._at(node)
        local, sector = self.local[at], self.sector[at]
        inside = np.unique(sector[local < self.sectors.interior])
        if len(inside) != 1:
            return None
        beyond = (sector - inside[0]) % self.sectors.count
        return int(inside[0]) if beyond.max() <= 1 else None

    def rows(self, node: int, begin: int) -> sp.csr_matrix:
        """Rows (6, 3n + 3b) of the tie of a node on the dofs of sector ``begin``, in that sector's
        axes."""
        n = len(self.sectors.nodes)
        at = self._at(node)
        ahead = self.sector[at] != begin
        place = np.where(ahead, self.local[at] + self.sectors.border, self.local[at])
        back = six(self.turns[begin].T)
        return _rows(place, back @ self.data[at], n + self.sectors.border)

    def even(self, node: int) -> bool:
        """Whether a turn by one pitch leaves a tie as it is."""
        first, turned = self._relative(node, 0), self._relative(node, 1)
        return bool(np.abs((turned - first).data).max(initial=0.0) <= self._scale(first))

    def share(self, node: int) -> sp.csr_matrix:
        """(6, 3n) of sector 0 in an even tie."""
        at = self._at(node)
        mine = self.sector[at] == 0
        return _rows(self.local[at][mine], self.data[at][mine], len(self.sectors.nodes))

    def by_sector(self, nodes: Ints, begin: int) -> tuple[tuple[Ints, sp.csr_matrix], ...]:
        """For each sector the rows with entries, counted from begin on, and these rows (r, 3n)."""
        n, z = self.sectors.nodes.shape
        parts: list[list[tuple[int, sp.csr_matrix]]] = [[] for _ in range(z)]
        for i, node in enumerate(nodes):
            at = self._at(node)
            for s in np.unique(self.sector[at]):
                mine = self.sector[at] == s
                parts[s].append((i, _rows(self.local[at][mine], self.data[at][mine], n)))
        out = []
        for part in parts:
            index = [begin + 6 * i + c for i, _ in part for c in range(6)]
            matrix = sp.vstack([m for _, m in part]) if part else sp.csr_matrix((0, 3 * n))
            out.append((np.array(index, dtype=np.int64), matrix.tocsr()))
        return tuple(out)

    def _at(self, node: int) -> slice:
        return slice(self.indptr[node], self.indptr[node + 1])

    @staticmethod
    def _scale(rows: sp.csr_matrix) -> float:
        return _TOLERANCE * float(np.abs(rows.data).max())

    def _relative(self, node: int, s: int) -> sp.csr_matrix:
        """(6, 3nz) rows of a tie seen from sector s."""
        at, n = self._at(node), len(self.sectors.nodes)
        sector = (self.sector[at] - s) % self.sectors.count
        back = six(self.turns[s].T)
        return _rows(sector * n + self.local[at], back @ self.data[at], n * self.sectors.count)


def _rows(nodes: Ints, blocks: Array, count: int) -> sp.csr_matrix:
    """CSR (6, 3 count) of blocks (b, 6, 3) at nodes (b,)."""
    columns = np.tile(3 * nodes[:, None] + np.arange(3), (1, 6)).ravel()
    row = np.tile(np.repeat(np.arange(6), 3), len(nodes))
    return sp.coo_matrix((blocks.ravel(), (row, columns)), shape=(6, 3 * count)).tocsr()
