r"""FE models: which scikit-fem elements stand for which cells, stiffness and mass.

Quadratic interpolation on straight-edged geometry: 20-node serendipity on 8-vertex hexahedra,
10-node on 4-vertex tetrahedra. Integration order 4 is 3 x 3 x 3 Gauss points on hexahedra, exact
for the mass matrix of a parallelepiped, and is what CalculiX takes for C3D20. Cells come in
scikit-fem's vertex order, right-handed (see `flexgear.structures.fe_mesh.fe_mesh`).

Stiffness and mass of linear elasticity are assembled by batched matrix products. With the scalar
shape functions N_a of an element and

    G_{ai,bj} = \int dN_a/dx_i dN_b/dx_j dV

the element matrices are

    K_{ai,bj} = lambda G_{ai,bj} + mu G_{aj,bi} + mu delta_ij sum_k G_{ak,bk}
    M_{ai,bj} = rho delta_ij \int N_a N_b dV.

G of a chunk of elements is one batched product (3a x q)(q x 3b) over quadrature points q.
Dofs are node-major: dof = 3 node + (0, 1, 2) for x, y, z. Units SI. Source: any text on finite
elements; the same integrals as `skfem.models.elasticity`, equal to rounding.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import (
    Basis,
    CellBasis,
    Element,
    ElementHexS2,
    ElementQuad2,
    ElementTetP2,
    ElementVector,
    Mesh,
    MeshHex,
    MeshQuad,
    MeshTet,
)
from skfem.assembly.basis.abstract_basis import AbstractBasis
from skfem.models.elasticity import lame_parameters, linear_elasticity

from flexgear.arrays import Array, Ints
from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, Kind, facet_keys
from flexgear.structures.linalg.threads import blocks

INTEGRATION_ORDER = 4
_MESHES = {"hex": MeshHex, "tet": MeshTet}
_ELEMENTS = {"hex": ElementHexS2, "tet": ElementTetP2}
_KINDS: dict[type[Mesh], Kind] = {MeshHex: "hex", MeshTet: "tet"}
_CHUNK = 1024  # elements whose matrices are held at once


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """Vertices (n, 3) m, cells (m, 8) or (m, 4), and patches by name, their facets (k, 4) or
    (k, 3) in cyclic order: an ``FeMesh`` that is taken as it is."""

    points: Array
    cells: Ints
    kind: Kind
    facets: Mapping[str, Ints]


def solid_mesh(mesh: Mesh) -> SolidMesh:
    """A mesh of scikit-fem with its named boundaries as patches; InputError for other cells than
    hexahedra and tetrahedra with straight edges."""
    kind = _KINDS.get(type(mesh))
    if kind is None:
        problem = f"is a {type(mesh).__name__}"
        raise InputError("reduce_mesh", "mesh", problem, "give a MeshHex or a MeshTet")
    facets, boundaries = mesh.facets.T.astype(np.int64), mesh.boundaries or {}
    patches = {str(name): facets[np.asarray(numbers)] for name, numbers in boundaries.items()}
    points, cells = np.ascontiguousarray(mesh.p.T), np.ascontiguousarray(mesh.t.T)
    return SolidMesh(points, cells.astype(np.int64), kind, patches)


@dataclass(frozen=True, eq=False)
class FeModel:
    """An unreduced elastic body: an FE mesh, E in Pa, density in kg/m³.

    Its matrices are assembled when they are asked for.
    """

    fe_mesh: FeMesh | SolidMesh
    young_modulus: float
    poisson_ratio: float
    density: float

    @cached_property
    def basis(self) -> AbstractBasis:
        """Numbers and places of the scalar basis's nodes, its functions not evaluated anywhere.

        Node n carries dofs 3n, 3n+1, 3n+2 (x, y, z). Vertices come first and keep their numbers,
        edge midpoints follow.
        """
        nowhere = (np.zeros((3, 0)), np.zeros(0))
        basis = AbstractBasis(*_mesh_and_element(self.fe_mesh), quadrature=nowhere)
        basis.nelems = basis.mesh.nelements
        return basis

    @cached_property
    def nodes(self) -> Array:
        """(n, 3) m, vertices of the mesh first, then edge midpoints."""
        return np.ascontiguousarray(self.basis.doflocs.T)

    @cached_property
    def _matrices(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Stiffness and scalar mass."""
        basis = scalar_basis(self.fe_mesh)
        nu, young = self.poisson_ratio, self.young_modulus
        lam, mu = young * nu / ((1 + nu) * (1 - 2 * nu)), young / (2 * (1 + nu))
        pattern = _Pattern(basis)
        k_blocks = np.zeros((pattern.size, 9))
        m_blocks = np.zeros((pattern.size, 1))
        for chunk in blocks(basis.nelems, _CHUNK):
            stiffness, mass = _element_matrices(basis, chunk, lam, mu)
            pattern.add(k_blocks, chunk, stiffness)
            pattern.add(m_blocks, chunk, self.density * mass)
        table = (m_blocks[:, 0], pattern.indices, pattern.indptr)
        scalar_mass = sp.csr_matrix(table, shape=(basis.N, basis.N))
        scalar_mass = 0.5 * (scalar_mass + scalar_mass.T.tocsr())  # exactly symmetric
        return pattern.matrix(k_blocks.reshape(-1, 3, 3)), scalar_mass

    @property
    def stiffness(self) -> sp.csr_matrix:
        """(3n, 3n) symmetric CSR, N/m."""
        return self._matrices[0]

    @property
    def scalar_mass(self) -> sp.csr_matrix:
        """(n, n) CSR, kg, the same for x, y and z."""
        return self._matrices[1]

    @cached_property
    def mass(self) -> sp.csr_matrix:
        """(3n, 3n) CSR, kg: scalar_mass (x) I_3."""
        return sp.kron(self.scalar_mass, sp.identity(3), format="csr")

    def part(self, cells: Ints) -> tuple[FeModel, Ints]:
        """Some cells alone, and which node of this body each of their nodes is."""
        corners = np.asarray(self.fe_mesh.cells)[cells]
        vertices, numbers = np.unique(corners, return_inverse=True)
        points = np.asarray(self.fe_mesh.points)[vertices]
        small = SolidMesh(points, numbers.reshape(corners.shape), self.fe_mesh.kind, {})
        model = replace(self, fe_mesh=small)
        nodes = np.empty(len(model.nodes), dtype=np.int64)
        nodes[model.basis.element_dofs] = self.basis.element_dofs[:, cells]
        return model, nodes

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom, 3 per node."""
        return 3 * len(self.nodes)

    @property
    def vertex_dofs(self) -> int:
        """Degrees of freedom at mesh vertices; they are the first ones."""
        return 3 * len(self.fe_mesh.points)

    @cached_property
    def facet_keys(self) -> tuple[Ints, Ints, Ints]:
        """Rising keys (f,) of all facets, the facet number of each, sorted vertices (f, c)."""
        vertices = np.sort(self.basis.mesh.facets.T.astype(np.int64), axis=1)
        keys = facet_keys(vertices, len(self.nodes))
        order = np.argsort(keys)
        return keys[order], order, vertices

    @cached_property
    def cell_corners(self) -> Array:
        """Vertices of every cell (e, v, 3), m."""
        return self.basis.mesh.p.T[self.basis.mesh.t.T]

    @cached_property
    def cell_tree(self) -> cKDTree:
        """The cells' middles, to find cells near a point."""
        return cKDTree(self.cell_corners.mean(axis=1))


def scalar_basis(fe_mesh: FeMesh | SolidMesh) -> CellBasis:
    """Scalar quadratic basis on the cells."""
    return CellBasis(*_mesh_and_element(fe_mesh), intorder=INTEGRATION_ORDER)


def _mesh_and_element(fe_mesh: FeMesh | SolidMesh) -> tuple[Mesh, Element]:
    cells = np.ascontiguousarray(np.asarray(fe_mesh.cells).T)
    points = np.ascontiguousarray(np.asarray(fe_mesh.points, dtype=float).T)
    return _MESHES[fe_mesh.kind](points, cells), _ELEMENTS[fe_mesh.kind]()


def _element_matrices(basis: CellBasis, chunk: slice, lam: float, mu: float) -> tuple[Array, Array]:
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

    def add(self, blocks: Array, chunk: slice, values: Array) -> None:
        """Add element blocks (e, a*b, c) of a chunk into the global blocks (size, c)."""
        place = self._place[chunk].ravel()
        used, local = np.unique(place, return_inverse=True)
        gather = sp.csr_matrix(
            (np.ones(len(place)), (local.ravel(), np.arange(len(place)))),
            shape=(len(used), len(place)),
        )
        blocks[used] += gather @ values.reshape(len(place), -1)

    def matrix(self, blocks: Array) -> sp.csr_matrix:
        """CSR matrix (3n, 3n) of node blocks (size, 3, 3), exactly symmetric."""
        bsr = sp.bsr_matrix((blocks, self.indices, self.indptr), shape=(3 * self.n, 3 * self.n))
        matrix = bsr.tocsr()
        return 0.5 * (matrix + matrix.T.tocsr())


def plane_strain(
    points: Array, cells: Ints, young: float, poisson: float
) -> tuple[Array, sp.csr_matrix]:
    """Nodes (n, 2), m, and stiffness (2n, 2n), N/m per m of face, of quadratic quadrilaterals with
    straight sides; dofs 2 n and 2 n + 1 are x and y of node n.

    points: vertices (p, 2), m; cells: (m, 4) of them, round each cell; young: Pa.
    """
    fe_mesh = MeshQuad(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    basis = Basis(fe_mesh, ElementVector(ElementQuad2()))
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    return np.ascontiguousarray(basis.doflocs[:, ::2].T), stiffness.tocsr()
