r"""FE models: which scikit-fem elements stand for which cells, stiffness and mass.

Quadratic interpolation on straight-edged geometry: 20-node serendipity on 8-vertex hexahedra,
10-node on 4-vertex tetrahedra. Integration order 4 is 3 x 3 x 3 Gauss points on hexahedra, exact
for the mass matrix of a parallelepiped, and is what CalculiX takes for C3D20. Cells come in
scikit-fem's vertex order, right-handed (see `flexgear.structures.fe_mesh.fe_mesh`).

Stiffness and mass of linear elasticity come from scalar forms: with the shape functions N_a and

    G^{ij}_{ab} = \int dN_a/dx_i dN_b/dx_j dV,

    K_{ai,bj} = lambda G^{ij}_{ab} + mu G^{ji}_{ab} + mu delta_ij sum_k G^{kk}_{ab}
    M_{ai,bj} = rho delta_ij \int N_a N_b dV,

which takes a quarter of the time of ``skfem.models.elasticity`` and gives the same to rounding.
Dofs are node-major: dof = 3 node + (0, 1, 2) for x, y, z. Units SI. Source: any text on finite
elements.
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
    BilinearForm,
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

INTEGRATION_ORDER = 4
_MESHES = {"hex": MeshHex, "tet": MeshTet}
_ELEMENTS = {"hex": ElementHexS2, "tet": ElementTetP2}
_KINDS: dict[type[Mesh], Kind] = {MeshHex: "hex", MeshTet: "tet"}


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
    def stiffness(self) -> sp.csr_matrix:
        """(3n, 3n) symmetric CSR, N/m."""
        basis = scalar_basis(self.fe_mesh)
        lam, mu = lame_parameters(self.young_modulus, self.poisson_ratio)
        out = sp.csr_matrix((self.dofs, self.dofs))
        for i, j in np.ndindex(3, 3):
            slopes = BilinearForm(lambda u, v, _, i=i, j=j: v.grad[i] * u.grad[j]).assemble(basis)
            unit = np.outer(np.eye(3)[i], np.eye(3)[j])
            share = lam * unit + mu * unit.T + (mu * np.eye(3) if i == j else 0.0)
            out += sp.kron(slopes, share, format="csr")
        return 0.5 * (out + out.T.tocsr())  # exactly symmetric

    @cached_property
    def scalar_mass(self) -> sp.csr_matrix:
        """(n, n) CSR, kg, the same for x, y and z."""
        mass = BilinearForm(lambda u, v, _: self.density * u * v)
        out = mass.assemble(scalar_basis(self.fe_mesh))
        return 0.5 * (out + out.T.tocsr())

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
