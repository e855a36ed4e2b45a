r"""FE models of bodies: elements, stiffness and mass, and sample points of surfaces.

Quadratic interpolation on straight-edged geometry: 20-node serendipity elements on 8-vertex
hexahedra, 10-node elements on 4-vertex tetrahedra. Integration order 4 is 3 x 3 x 3 Gauss points on
hexahedra, exact for the mass matrix of a parallelepiped and the same as of CalculiX's C3D20. Cells
are in scikit-fem's vertex order, right-handed (see `flexgear.structures.fe_mesh.fe_mesh`).

Stiffness and mass of linear elasticity are made of scalar forms: with the shape functions N_a and

    G^{ij}_{ab} = \int dN_a/dx_i dN_b/dx_j dV,

    K_{ai,bj} = lambda G^{ij}_{ab} + mu G^{ji}_{ab} + mu delta_ij sum_k G^{kk}_{ab}
    M_{ai,bj} = rho delta_ij \int N_a N_b dV,

which takes a quarter of the time of ``skfem.models.elasticity`` and agrees with it to rounding.
Dofs are node-major: dof = 3 node + (0, 1, 2) for x, y, z. Units SI. Source: any text on finite
elements.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Self

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import (
    Basis,
    BilinearForm,
    Element,
    ElementHexS2,
    ElementQuad1,
    ElementQuad2,
    ElementTetP2,
    ElementTriP1,
    ElementVector,
    Mesh,
    MeshHex,
    MeshQuad,
    MeshTet,
)
from skfem.assembly.basis.abstract_basis import AbstractBasis
from skfem.models.elasticity import lame_parameters, linear_elasticity
from skfem.quadrature import get_quadrature

from flexgear.arrays import Array, Ints
from flexgear.model.bodies import Material
from flexgear.model.errors import FlexgearError, InputError
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, Kind, facet_keys

INTEGRATION_ORDER = 4
_FE_MESHES: dict[Kind, type[Mesh]] = {"hex": MeshHex, "tet": MeshTet}
_ELEMENTS = {"hex": ElementHexS2, "tet": ElementTetP2}


@dataclass(frozen=True, eq=False)
class SolidFeMesh:
    """An ``FeMesh`` without its checks: vertices (n, 3) m, cells (m, 8) or (m, 4), and patches by
    name, their facets (k, 4) or (k, 3) in cyclic order."""

    points: Array
    cells: Ints
    kind: Kind
    facets: Mapping[str, Ints]


def solid_fe_mesh(fe_mesh: Mesh) -> SolidFeMesh:
    """A mesh of scikit-fem with its named boundaries as patches. InputError for other cells than
    hexahedra and tetrahedra with straight edges."""
    kind = next((kind for kind, form in _FE_MESHES.items() if type(fe_mesh) is form), None)
    if kind is None:
        problem = f"is a {type(fe_mesh).__name__}"
        raise InputError("reduce_fe_mesh", "fe_mesh", problem, "give a MeshHex or a MeshTet")
    facets, boundaries = fe_mesh.facets.T.astype(np.int64), fe_mesh.boundaries or {}
    patches = {str(name): facets[np.asarray(numbers)] for name, numbers in boundaries.items()}
    points, cells = np.ascontiguousarray(fe_mesh.p.T), np.ascontiguousarray(fe_mesh.t.T)
    return SolidFeMesh(points, cells.astype(np.int64), kind, patches)


@dataclass(frozen=True, eq=False)
class FeModel:
    """An unreduced elastic body: an FE mesh, E in Pa, density in kg/m³. Its matrices are assembled
    at their first use."""

    fe_mesh: FeMesh | SolidFeMesh
    young_modulus: float
    poisson_ratio: float
    density: float

    @classmethod
    def of(cls, fe_mesh: FeMesh, material: Material) -> Self:
        """Model of an FE mesh with a case's material."""
        return cls(fe_mesh, material.young_modulus, material.poisson_ratio, material.density)

    @cached_property
    def basis(self) -> AbstractBasis:
        """Scalar quadratic basis without quadrature points, for numbers and positions of nodes.

        Node n has dofs 3n, 3n+1, 3n+2 (x, y, z). Vertices come first, with their numbers in the FE
        mesh, then edge midpoints.
        """
        nowhere = (np.zeros((3, 0)), np.zeros(0))
        basis = AbstractBasis(*_fe_mesh_and_element(self.fe_mesh), quadrature=nowhere)
        basis.nelems = basis.mesh.nelements
        return basis

    @cached_property
    def nodes(self) -> Array:
        """Positions (n, 3) m of the nodes: vertices of the mesh, then edge midpoints."""
        return np.ascontiguousarray(self.basis.doflocs.T)

    @cached_property
    def stiffness(self) -> sp.csr_matrix:
        """Stiffness K (3n, 3n), symmetric CSR, N/m."""
        basis, shape = scalar_basis(self.fe_mesh), (len(self.nodes), len(self.nodes))
        lam, mu = lame_parameters(self.young_modulus, self.poisson_ratio)
        products: dict[tuple[int, int], sp.csr_matrix] = {}
        for i, j in combinations_with_replacement(range(3), 2):
            form = BilinearForm(lambda u, v, _, i=i, j=j: v.grad[i] * u.grad[j]).elemental(basis)
            products[i, j] = sp.coo_matrix((form.data, form.indices), shape).tocsr()
        pairs = products[0, 0]  # all have entries for the same pairs of nodes
        numbers = np.arange(pairs.nnz)
        turned = sp.csr_matrix((numbers, pairs.indices, pairs.indptr), shape).T.tocsr().data
        trace = sum(products[k, k].data for k in range(3))
        blocks = np.empty((pairs.nnz, 3, 3))
        for (i, j), product in products.items():
            g = product.data
            block = lam * g + mu * g[turned] + (mu * trace if i == j else 0.0)
            if i == j:
                block = 0.5 * (block + block[turned])  # exactly symmetric
            blocks[:, i, j], blocks[:, j, i] = block, block[turned]
        out = sp.bsr_matrix((blocks, pairs.indices, pairs.indptr)).tocsr()
        out.eliminate_zeros()
        return out

    @cached_property
    def scalar_mass(self) -> sp.csr_matrix:
        """Mass (n, n) between nodes, CSR, kg, the same for x, y and z."""
        mass = BilinearForm(lambda u, v, _: self.density * u * v)
        out = mass.assemble(scalar_basis(self.fe_mesh))
        return 0.5 * (out + out.T.tocsr())

    @cached_property
    def mass(self) -> sp.csr_matrix:
        """Mass M (3n, 3n), CSR, kg: scalar_mass (x) I_3."""
        return sp.kron(self.scalar_mass, sp.identity(3), format="csr")

    def part(self, cells: Ints) -> tuple[Self, Ints]:
        """Model of the cells with these numbers, and numbers of its nodes in this model (k,)."""
        corners = np.asarray(self.fe_mesh.cells)[cells]
        vertices, numbers = np.unique(corners, return_inverse=True)
        points = np.asarray(self.fe_mesh.points)[vertices]
        small = SolidFeMesh(points, numbers.reshape(corners.shape), self.fe_mesh.kind, {})
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
        """Keys (f,) of all facets, rising; the facet number of each key (f,); and vertices (f, c)
        of all facets by facet number, rising in each."""
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
        """Search tree of the cells' middles."""
        return cKDTree(self.cell_corners.mean(axis=1))


def scalar_basis(fe_mesh: FeMesh | SolidFeMesh) -> Basis:
    """Scalar quadratic basis of an FE mesh, with quadrature points."""
    return Basis(*_fe_mesh_and_element(fe_mesh), intorder=INTEGRATION_ORDER)


def _fe_mesh_and_element(fe_mesh: FeMesh | SolidFeMesh) -> tuple[Mesh, Element]:
    cells = np.ascontiguousarray(np.asarray(fe_mesh.cells).T)
    points = np.ascontiguousarray(np.asarray(fe_mesh.points, dtype=float).T)
    return _FE_MESHES[fe_mesh.kind](points, cells), _ELEMENTS[fe_mesh.kind]()


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


def edge_nodes(model: FeModel, first: Ints, second: Ints) -> Ints:
    """Nodes at the middles of edges between vertices ``first`` and ``second``, all of one shape.
    FlexgearError where there is no such node."""
    middles = 0.5 * (model.nodes[first] + model.nodes[second])
    gap, nodes = cKDTree(model.nodes).query(middles)
    if gap.max() > 1e-9 * np.abs(model.nodes).max():
        raise FlexgearError("an edge of the FE mesh has no node at its middle")
    return np.asarray(nodes, dtype=np.int64)


def facet_nodes(model: FeModel, facets: Ints) -> Ints:
    """All nodes (k,) of facets (f, 3 or 4) given by their vertices, rising."""
    nodes = model.basis.get_dofs(facet_numbers(model, facets)).all()
    return np.sort(nodes.astype(np.int64))


def nodes_between(model: FeModel, free: Ints, border: Ints) -> Ints:
    """Nodes of the cells whose vertices are all in ``free`` or ``border``, without the nodes of
    facets whose vertices are all in ``border``."""
    fe_mesh, inside = model.basis.mesh, np.zeros(len(model.nodes), dtype=bool)
    inside[border] = True
    held = model.basis.get_dofs(np.flatnonzero(inside[fe_mesh.facets].all(axis=0))).all()
    inside[free] = True
    cells = inside[fe_mesh.t].all(axis=0)
    return np.setdiff1d(model.basis.element_dofs[:, cells], held)


_INSIDE = 1e-6  # reference coordinates by which rounding may move a point out of its element
_RINGS, _SPOKES = 4, 16  # of points on a disc
_FACETS = {3: ElementTriP1(), 4: ElementQuad1()}


@dataclass(frozen=True, eq=False)
class Sample:
    """Points of a surface for interpolation and integration.

    u(points) = interpolation @ u_nodes, integral of f over the surface = weights @ f(points);
    points (m, 3) m; weights (m,) m²; interpolation (m, n) CSR on the model's nodes.
    """

    points: Array
    weights: Array
    interpolation: sp.csr_matrix

    def load(self, forces: Array) -> Array:
        """Work-equivalent nodal forces (3n[, k]) of point forces (m, 3[, k]), N."""
        rows = forces.reshape(len(self.points), -1)
        nodal = self.interpolation.T @ rows
        return nodal.reshape((3 * self.interpolation.shape[1],) + forces.shape[2:])


def facet_sample(model: FeModel, facets: Ints) -> Sample:
    """Quadrature points of facets given by their vertices (k, 4) or (k, 3), in cyclic order.

    Geometry is (bi)linear on a facet: x = sum_i N_i x_i, dA = |dx/da x dx/db| da db.
    """
    facets, fe_mesh, elem = np.asarray(facets), model.basis.mesh, model.basis.elem
    cells = fe_mesh.f2t[0, facet_numbers(model, facets)]
    flat, weights = get_quadrature(fe_mesh.brefdom, INTEGRATION_ORDER)
    value, slope = _functions(_FACETS[facets.shape[1]], flat)  # (q, c), (2, q, c)
    corners = fe_mesh.p.T[facets]
    points = value @ corners  # (f, q, 3)
    normal = np.cross(slope[0] @ corners, slope[1] @ corners)
    corner = (fe_mesh.t[:, cells].T[:, None] == facets[:, :, None]).argmax(axis=2)
    local = value @ elem.refdom.p.T[corner]  # (f, q, 3) reference coordinates in the cells
    return Sample(
        points.reshape(-1, 3),
        (np.linalg.norm(normal, axis=2) * weights).ravel(),
        _interpolation(model, np.repeat(cells, len(weights)), local.reshape(-1, 3)),
    )


def point_sample(model: FeModel, points: Array, weights: Array, slack: float = _INSIDE) -> Sample:
    """Sample of points (m, 3) m with weights (m,), each located in its element.

    slack: distance from its element at which a point may lie, in reference coordinates.
    """
    return Sample(points, weights, _interpolation(model, *locate(model, points, slack)))


def disc_points(
    centre: Array, diameter: float, toward: Sequence[float] = (1.0, 0.0, 0.0)
) -> tuple[Array, Array]:
    """Points (m, 3) m and weights (m,) m² for integration over a disc normal to z.

    Gauss-Legendre in r², for r dr = d(r²)/2, times equal angles: exact for polynomials of degree
    2 _RINGS - 1 in r² and of degree below _SPOKES in angle. toward: direction (3,) in the disc, an
    axis of symmetry of the spokes; if it turns with the elements, so do the points.
    """
    x, w = np.polynomial.legendre.leggauss(_RINGS)
    radius = 0.5 * diameter
    r = radius * np.sqrt(0.5 * (x + 1))
    angle = 2 * np.pi * (np.arange(_SPOKES) + 0.5) / _SPOKES
    e1 = np.cross((0.0, 0.0, 1.0), toward)
    e1 /= np.linalg.norm(e1)
    e2 = np.cross((0.0, 0.0, 1.0), e1)
    ray = np.cos(angle)[:, None] * e1 + np.sin(angle)[:, None] * e2
    points = centre + (r[:, None, None] * ray).reshape(-1, 3)
    weights = np.repeat(0.5 * w * np.pi * radius**2 / _SPOKES, _SPOKES)
    return points, weights


def facet_numbers(model: FeModel, facets: Ints) -> Ints:
    """scikit-fem's numbers (k,) of facets given by their vertices (k, c) in any order.
    FlexgearError for facets that are no faces of cells."""
    sorted_facets = np.sort(np.asarray(facets, dtype=np.int64), axis=1)
    keys, order, vertices = model.facet_keys
    after = np.searchsorted(keys, facet_keys(sorted_facets, len(model.nodes)))
    numbers = order[np.minimum(after, len(order) - 1)]
    if not np.array_equal(vertices[numbers], sorted_facets):
        raise FlexgearError("a named patch holds facets that are not faces of the mesh's cells")
    return numbers


def locate(model: FeModel, points: Array, slack: float = _INSIDE) -> tuple[Ints, Array]:
    """Element (m,) and reference coordinates (m, 3) of each point (m, 3) m, by Newton's method on
    the element map; slack: as of ``point_sample``. FlexgearError for points outside the FE mesh."""
    cells = np.zeros(len(points), dtype=np.int64)
    local = np.zeros((len(points), 3))
    excess = np.full(len(points), np.inf)
    for neighbours in (16, 128):
        todo = np.flatnonzero(excess > slack)
        if not len(todo):
            break
        _, near = model.cell_tree.query(points[todo], k=min(neighbours, model.cell_tree.n))
        near = near.reshape(len(todo), -1)
        x = _inverse_map(model, near, points[todo])
        outside = np.maximum(-x, x - 1).max(axis=2)
        if model.fe_mesh.kind == "tet":
            outside = np.maximum(outside, x.sum(axis=2) - 1)
        best = np.argmin(outside, axis=1)
        rows = np.arange(len(todo))
        cells[todo], local[todo] = near[rows, best], x[rows, best]
        excess[todo] = outside[rows, best]
    if np.any(excess > slack):
        worst = points[int(np.argmax(excess))]
        raise FlexgearError(
            f"a tie's point ({worst[0]:.4g}, {worst[1]:.4g}, {worst[2]:.4g}) m lies outside "
            "the finite-element mesh: compare bolt circle and bolt face with the mesh"
        )
    return cells, local


def _functions(elem: Element, at: Array) -> tuple[Array, Array]:
    """Shape functions (..., a) of an element and their derivatives (d, ..., a) at reference
    coordinates (d, ...)."""
    parts = [elem.lbasis(at, i) for i in range(len(elem.doflocs))]
    value = np.stack([np.broadcast_to(value, at.shape[1:]) for value, _ in parts], axis=-1)
    return value, np.stack([np.broadcast_to(slope, at.shape) for _, slope in parts], axis=-1)


def _inverse_map(model: FeModel, cells: Ints, points: Array) -> Array:
    """Reference coordinates (m, c, 3) of point m in each of its candidate cells (m, c)."""
    elem, tet = model.basis.mesh.elem(), model.fe_mesh.kind == "tet"
    vertices = model.cell_corners[cells]  # (m, c, v, 3)
    x = np.full(cells.shape + (3,), 0.25 if tet else 0.5)
    for _ in range(2 if tet else 12):
        value, slope = _functions(elem, np.moveaxis(x, -1, 0))  # (m, c, v), (3, m, c, v)
        residual = points[:, None] - np.einsum("mcv,mcvi->mci", value, vertices)
        jacobian = np.moveaxis(slope, 0, -2) @ vertices  # (m, c, j, i)
        step = np.linalg.solve(jacobian.swapaxes(2, 3), residual[..., None])[..., 0]
        x = np.clip(x + step, -1.0, 2.0)
    return x


def _interpolation(model: FeModel, cells: Ints, local: Array) -> sp.csr_matrix:
    """Interpolation (m, n), CSR, from nodal values to reference coordinates local (m, 3) in cells
    (m,), without entries that are zero but for rounding."""
    nodes = model.basis.element_dofs[:, cells].T  # (m, a)
    shape, _ = _functions(model.basis.elem, local.T)
    row, a = np.nonzero(np.abs(shape) > 1e-13)
    entries = shape[row, a], (row, nodes[row, a])
    return sp.coo_matrix(entries, shape=(len(nodes), model.basis.N)).tocsr()


def element_gradient(model: FeModel, vertices: Ints) -> sp.csr_matrix:
    """Matrix D (3k, n) on nodal values f (n,): row 3i + j gives ∂f/∂x_j at the i-th of ``vertices``
    (k,), the mean of the derivatives in all elements that meet there."""
    cells, basis = model.basis.mesh.t, model.basis
    row = np.full(len(model.nodes), -1)
    row[vertices] = np.arange(len(vertices))
    rows, columns, values = [], [], []
    for corner, at in enumerate(row[cells]):
        inside = np.flatnonzero(at >= 0)
        local = basis.elem.refdom.p[:, [corner]]
        inverse = basis.mapping.invDF(local, inside)[..., 0]  # (reference, x, cell)
        for a, nodes in enumerate(basis.element_dofs[:, inside]):
            slope = np.asarray(basis.elem.lbasis(local, a)[1])[:, 0]
            rows.append((3 * at[inside] + np.arange(3)[:, None]).ravel())
            columns.append(np.broadcast_to(nodes, (3, len(inside))).ravel())
            values.append(np.einsum("ijc,i->jc", inverse, slope).ravel())
    table = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    total = sp.csr_matrix(table, shape=(3 * len(vertices), len(model.nodes)))
    count = np.bincount(row[cells].ravel() + 1, minlength=len(vertices) + 1)[1:]
    return (sp.diags_array(np.repeat(1.0 / count, 3)) @ total).tocsr()
