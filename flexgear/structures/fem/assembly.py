r"""Stiffness and mass of linear elasticity, assembled by batched matrix products.

With the scalar shape functions N_a of an element and

    G_{ai,bj} = \int dN_a/dx_i dN_b/dx_j dV

the element matrices are

    K_{ai,bj} = lambda G_{ai,bj} + mu G_{aj,bi} + mu delta_ij sum_k G_{ak,bk}
    M_{ai,bj} = rho delta_ij \int N_a N_b dV.

G of a chunk of elements is one batched product (3a x q)(q x 3b) over quadrature points q.
Dofs are node-major: dof = 3 node + (0, 1, 2) for x, y, z. Units SI. Source: any text on finite
elements; the same integrals as `skfem.models.elasticity` (see `forms.py`), equal to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skfem import CellBasis

from flexgear.structures.fem.elements import FeMeshLike, scalar_basis
from flexgear.structures.kinematics import rigid_motion

_CHUNK = 1024  # elements whose matrices are held at once


@dataclass(frozen=True, eq=False)
class FeModel:
    """An unreduced elastic body.

    stiffness: (3n, 3n) symmetric CSR, N/m; scalar_mass: (n, n) CSR, kg; nodes: (n, 3) m, vertices
    of the mesh first, then edge midpoints.
    """

    fe_mesh: FeMeshLike
    basis: CellBasis = field(repr=False)
    nodes: NDArray[np.float64] = field(repr=False)
    stiffness: sp.csr_matrix = field(repr=False)
    scalar_mass: sp.csr_matrix = field(repr=False)

    @cached_property
    def mass(self) -> sp.csr_matrix:
        """(3n, 3n) CSR, kg: scalar_mass (x) I_3."""
        return sp.kron(self.scalar_mass, sp.identity(3), format="csr")

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom, 3 per node."""
        return 3 * len(self.nodes)

    @cached_property
    def facet_keys(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Rising keys (f,) of all facets, the facet number of each, sorted vertices (f, c)."""
        vertices = np.sort(self.basis.mesh.facets.T.astype(np.int64), axis=1)
        keys = facet_key(vertices, len(self.nodes))
        order = np.argsort(keys)
        return keys[order], order, vertices

    @cached_property
    def cell_corners(self) -> NDArray[np.float64]:
        """Vertices of every cell (e, v, 3), m."""
        return self.basis.mesh.p.T[self.basis.mesh.t.T]

    @cached_property
    def cell_tree(self) -> cKDTree:
        """The cells' middles, to find cells near a point."""
        return cKDTree(self.cell_corners.mean(axis=1))

    @property
    def vertex_dofs(self) -> int:
        """Degrees of freedom at mesh vertices; they are the first ones."""
        return 3 * len(self.fe_mesh.points)

    def rigid_modes(self) -> NDArray[np.float64]:
        """Rigid motion of the nodes (3n, 6) for unit ux, uy, uz, tx, ty, tz about the origin."""
        return rigid_motion(self.nodes).reshape(-1, 6)

    def at_vertices(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Displacements (n_points, 3[, k]) at mesh vertices of dof vectors (3n[, k])."""
        return u[: self.vertex_dofs].reshape((-1, 3) + u.shape[1:])


def facet_key(facets: NDArray[np.int64], base: int) -> NDArray[np.int64]:
    """One number (k,) a facet, of its three smallest vertices; facets (k, c) sorted by row."""
    return (facets[:, 0] * base + facets[:, 1]) * base + facets[:, 2]


def assemble(
    fe_mesh: FeMeshLike, young_modulus: float, poisson_ratio: float, density: float
) -> FeModel:
    """Stiffness and mass of an isotropic body (E in Pa, density in kg/m3)."""
    basis = scalar_basis(fe_mesh)
    lam = young_modulus * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))
    mu = young_modulus / (2 * (1 + poisson_ratio))
    pattern = _Pattern(basis)
    k_blocks = np.zeros((pattern.size, 9))
    m_blocks = np.zeros((pattern.size, 1))
    for start in range(0, basis.nelems, _CHUNK):
        chunk = slice(start, min(start + _CHUNK, basis.nelems))
        stiffness, mass = _element_matrices(basis, chunk, lam, mu)
        pattern.add(k_blocks, chunk, stiffness)
        pattern.add(m_blocks, chunk, density * mass)
    scalar_mass = sp.csr_matrix(
        (m_blocks[:, 0], pattern.indices, pattern.indptr), shape=(basis.N, basis.N)
    )
    scalar_mass = 0.5 * (scalar_mass + scalar_mass.T.tocsr())  # exactly symmetric
    return FeModel(
        fe_mesh=fe_mesh,
        basis=basis,
        nodes=np.ascontiguousarray(basis.doflocs.T),
        stiffness=pattern.matrix(k_blocks.reshape(-1, 3, 3)),
        scalar_mass=scalar_mass,
    )


def _element_matrices(
    basis: CellBasis, chunk: slice, lam: float, mu: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """K_e (e, a*b, 9) in N/m and the scalar mass integral (e, a*b, 1) in m3 of a chunk."""
    dx = basis.dx[chunk]  # (e, q); some weights of tetrahedra are negative
    a, count = len(basis.basis), len(dx)
    gradient = np.stack([basis.basis[i][0].grad[:, chunk] for i in range(a)])  # (a, 3, e, q)
    gradient = gradient.transpose(2, 0, 1, 3).reshape(count, 3 * a, -1)
    g = np.matmul(gradient * dx[:, None], gradient.transpose(0, 2, 1))
    g = g.reshape(-1, a, 3, a, 3).transpose(0, 1, 3, 2, 4)  # (e, a, b, i, j)
    k = lam * g + mu * g.swapaxes(3, 4)
    trace = mu * np.einsum("eabkk->eab", g)
    k[..., [0, 1, 2], [0, 1, 2]] += trace[..., None]
    value = np.stack(
        [np.broadcast_to(np.asarray(basis.basis[i][0]), basis.dx.shape)[chunk] for i in range(a)],
        axis=1,
    )  # (e, a, q)
    m = np.matmul(value * dx[:, None], value.transpose(0, 2, 1))
    return k.reshape(count, a * a, 9), m.reshape(count, a * a, 1)


class _Pattern:
    """Node-to-node sparsity of the mesh and the place of every element block in it."""

    def __init__(self, basis: CellBasis) -> None:
        dofs = basis.element_dofs.T.astype(np.int64)  # (e, a)
        n, per_node = basis.N, dofs.shape[1]
        rows = np.repeat(dofs, per_node, axis=1).ravel()
        columns = np.tile(dofs, (1, per_node)).ravel()
        keys, place = np.unique(rows * n + columns, return_inverse=True)
        self.n = n
        self.size = len(keys)
        self.indices = (keys % n).astype(np.int32)
        self.indptr = np.searchsorted(keys // n, np.arange(n + 1)).astype(np.int32)
        self._place = place.reshape(len(dofs), -1)

    def add(self, blocks: NDArray[np.float64], chunk: slice, values: NDArray[np.float64]) -> None:
        """Add element blocks (e, a*b, c) of a chunk into the global blocks (size, c)."""
        place = self._place[chunk].ravel()
        used, local = np.unique(place, return_inverse=True)
        gather = sp.csr_matrix(
            (np.ones(len(place)), (local.ravel(), np.arange(len(place)))),
            shape=(len(used), len(place)),
        )
        blocks[used] += gather @ values.reshape(len(place), -1)

    def matrix(self, blocks: NDArray[np.float64]) -> sp.csr_matrix:
        """CSR matrix (3n, 3n) of node blocks (size, 3, 3), exactly symmetric."""
        bsr = sp.bsr_matrix((blocks, self.indices, self.indptr), shape=(3 * self.n, 3 * self.n))
        matrix = bsr.tocsr()
        return 0.5 * (matrix + matrix.T.tocsr())
