r"""Block-circulant matrices of a body of equal sectors, and vectors sector by sector.

A field in sector form is x (3n, z, k): local dof, sector, vector, each sector in its own axes,
which turn with it. Then with the next sector's border b(s + 1)

    (A x)(s) = A_0 x(s) + A_1 x_b(s + 1),   plus  A_1^T x(s)  on the border of s + 1,

and A_0, A_1 are the same for all sectors. The scalar mass matrix acts on x, y and z alike; across
a border it meets components in the neighbour's axes, x_b <- Q x_b with Q the turn by one pitch.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.cyclic.sectors import Sectors
from flexgear.structures.fem import FeModel
from flexgear.structures.kinematics import rotation

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Circulant:
    """A_0 (n, n) and A_1 (n, b) CSR of a block-circulant matrix; b the last rows of n.

    scalar: one entry a node, for x, y and z; ahead_turn: Q (3, 3) then.
    """

    here: sp.csr_matrix = field(repr=False)
    ahead: sp.csr_matrix = field(repr=False)
    scalar: bool = False
    ahead_turn: Array | None = None

    def product(self, x: Array) -> Array:
        """A x in sector form, (3n, z, k)."""
        rows, b = self.ahead.shape
        border = slice(len(x) - 3 * b if self.scalar else len(x) - b, None)
        flat = np.ascontiguousarray(x).reshape(rows, -1)
        next_border = self._turned(np.roll(x[border], -1, axis=1), forward=True)
        out = (self.here @ flat + self.ahead @ next_border.reshape(b, -1)).reshape(x.shape)
        back = (self.ahead.T @ flat).reshape(next_border.shape)
        out[border] += np.roll(self._turned(back, forward=False), 1, axis=1)
        return out

    def extended(self) -> sp.csr_matrix:
        """[A_0 A_1; A_1^T 0], a matrix of one sector whose sum over sectors is A."""
        b = self.ahead.shape[1]
        return sp.bmat(
            [[self.here, self.ahead], [self.ahead.T, sp.csr_matrix((b, b))]], format="csr"
        )

    def on_dofs(self) -> Circulant:
        """The same with three rows a node where it is scalar."""
        if not self.scalar:
            return self
        ahead = sp.kron(self.ahead, self.ahead_turn).tocsr()
        return Circulant(sp.kron(self.here, np.eye(3)).tocsr(), ahead)

    def less(self, factor: float, other: Circulant) -> Circulant:
        """The matrix A - factor B."""
        return Circulant(self.here - factor * other.here, self.ahead - factor * other.ahead)

    def _turned(self, x: Array, forward: bool) -> Array:
        """Border components in the axes of the sector before (forward) or back in their own."""
        if not self.scalar or self.ahead_turn is None:
            return x
        q = self.ahead_turn if forward else self.ahead_turn.T
        parts = x.reshape(-1, 3, *x.shape[1:])
        return np.einsum("ij,aj...->ai...", q, parts).reshape(x.shape)


def sector_matrices(model: FeModel, sectors: Sectors) -> tuple[Circulant, Circulant]:
    """Stiffness and (scalar) mass of a body of equal sectors.

    A model that is assembled already is sliced, another assembled over one sector only.
    """
    n = len(sectors.nodes)
    sector_nodes = np.concatenate([sectors.nodes[:, 0], sectors.nodes[sectors.interior :, 1]])
    part = getattr(model, "part", None)
    if part is None:
        stiffness, mass, at = model.stiffness, model.scalar_mass, sector_nodes
    else:
        small, numbers = part(sectors.cells)
        place = np.empty(len(model.nodes), dtype=np.int64)
        place[numbers] = np.arange(len(numbers))
        stiffness, mass, at = small.stiffness, small.scalar_mass, place[sector_nodes]
    dofs = (3 * at[:, None] + np.arange(3)).ravel()
    stiffness = stiffness[dofs][:, dofs].tocsr()
    mass = mass[at][:, at].tocsr()
    q = rotation(sectors.pitch)
    turned = sp.block_diag([sp.identity(3 * n), sp.kron(sp.identity(sectors.border), q)]).tocsr()
    stiffness = (turned.T @ stiffness @ turned).tocsr()
    whole = part is None
    return (
        _circulant(stiffness, 3 * n, 3 * sectors.border, whole),
        _circulant(mass, n, sectors.border, whole, q),
    )


def _circulant(
    matrix: sp.csr_matrix, n: int, b: int, whole: bool, q: Array | None = None
) -> Circulant:
    """From a matrix on own dofs and the next border: of the whole body, or of one sector's cells.

    The whole body's rows hold everything already; one sector's part at the next border is what
    every sector adds at its own.
    """
    here = matrix[:n, :n]
    if not whole:
        at = sp.csr_matrix((np.ones(b), (np.arange(n - b, n), np.arange(b))), (n, b))
        here = here + at @ matrix[n:, n:] @ at.T
    return Circulant(here.tocsr(), matrix[:n, n:].tocsr(), q is not None, q)


def to_sectors(x: Array, sectors: Sectors) -> Array:
    """(3n, z, k) in sector form of dof vectors (3N, k)."""
    n, z = sectors.nodes.shape
    whole = x.reshape(-1, 3, x.shape[1])
    cos, sin = _cos_sin(sectors)
    out = np.empty((n, 3, z, x.shape[1]))
    gathered = whole[sectors.nodes]  # (n, z, 3, k)
    out[:, 0] = cos * gathered[:, :, 0] + sin * gathered[:, :, 1]
    out[:, 1] = cos * gathered[:, :, 1] - sin * gathered[:, :, 0]
    out[:, 2] = gathered[:, :, 2]
    return out.reshape(3 * n, z, -1)


def from_sectors(x: Array, sectors: Sectors, nodes: int) -> Array:
    """Dof vectors (3 nodes, k) of the mesh's first nodes from sector form (3n, z, k)."""
    n, z = sectors.nodes.shape
    parts = x.reshape(n, 3, z, x.shape[2])
    out = np.empty((nodes, 3, x.shape[2]))
    for s, turned in enumerate(sectors.turns()):
        mine = sectors.nodes[:, s] < nodes
        out[sectors.nodes[mine, s]] = turned @ parts[mine, :, s]
    return out.reshape(3 * nodes, x.shape[2])


def _cos_sin(sectors: Sectors) -> tuple[Array, Array]:
    angle = sectors.pitch * np.arange(sectors.count)
    return np.cos(angle)[:, None], np.sin(angle)[:, None]
