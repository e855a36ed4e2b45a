"""Nodes and sample points of an FE model, and fields and gradients there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from skfem import Element, ElementQuad1, ElementTriP1
from skfem.quadrature import get_quadrature

from flexgear.arrays import Array, Ints
from flexgear.model.errors import FlexgearError
from flexgear.structures.fe_mesh.fe_mesh import facet_keys
from flexgear.structures.fem.assembly import INTEGRATION_ORDER, FeModel


def edge_nodes(model: FeModel, first: Ints, second: Ints) -> Ints:
    """Nodes at the middles of edges between vertices, arrays of one shape; FlexgearError for linear
    elements, which have none."""
    mesh, n = model.basis.mesh, len(model.nodes)
    if not len(model.basis.edge_dofs):
        raise FlexgearError("linear finite elements have no nodes at the middles of edges")
    ends = np.sort(mesh.edges.astype(np.int64), axis=0)
    keys = ends[0] * n + ends[1]
    of_pairs = np.minimum(first, second).astype(np.int64) * n + np.maximum(first, second)
    order = np.argsort(keys)
    edges = order[np.minimum(np.searchsorted(keys[order], of_pairs), len(keys) - 1)]
    if not np.array_equal(keys[edges], of_pairs):
        raise FlexgearError("two vertices of the FE mesh have no edge between them")
    return model.basis.edge_dofs[0].astype(np.int64)[edges]


def facet_nodes(model: FeModel, facets: Ints) -> Ints:
    """All nodes (k,) of facets given by their vertices (f, 3 or 4)."""
    nodes = model.basis.get_dofs(facet_numbers(model, facets)).all()
    return np.sort(nodes.astype(np.int64))


def nodes_between(model: FeModel, free: Ints, border: Ints) -> Ints:
    """Nodes of the cells whose vertices are all among two sets, but for those of facets between
    vertices of ``border`` alone."""
    mesh, inside = model.basis.mesh, np.zeros(len(model.nodes), dtype=bool)
    inside[border] = True
    held = model.basis.get_dofs(np.flatnonzero(inside[mesh.facets].all(axis=0))).all()
    inside[free] = True
    cells = inside[mesh.t].all(axis=0)
    return np.setdiff1d(model.basis.element_dofs[:, cells], held)


_INSIDE = 1e-6
_RINGS, _SPOKES = 4, 16  # of points on a disc
_FACETS = {3: ElementTriP1(), 4: ElementQuad1()}


@dataclass(frozen=True, eq=False)
class Sample:
    """u(points) = interpolation @ u_nodes, integral of f = weights @ f(points).

    points (m, 3) in m; weights (m,) in m2; interpolation (m, n) CSR on the model's nodes.
    """

    points: Array
    weights: Array
    interpolation: sp.csr_matrix

    def load(self, forces: Array) -> Array:
        """Dof vectors (3n[, k]) of point forces (m, 3[, k]) in N: work-equivalent nodal forces."""
        rows = forces.reshape(len(self.points), -1)
        nodal = self.interpolation.T @ rows
        return nodal.reshape((3 * self.interpolation.shape[1],) + forces.shape[2:])


def facet_sample(model: FeModel, facets: Ints) -> Sample:
    """Quadrature points of facets given by their vertices (k, 4) or (k, 3), in cyclic order.

    Geometry is (bi)linear on a facet: x = sum_i N_i x_i, dA = |dx/da x dx/db| da db.
    """
    facets, mesh, elem = np.asarray(facets), model.basis.mesh, model.basis.elem
    cells = mesh.f2t[0, facet_numbers(model, facets)]
    flat, weights = get_quadrature(mesh.brefdom, INTEGRATION_ORDER)
    value, slope = _functions(_FACETS[facets.shape[1]], flat)  # (q, c), (2, q, c)
    corners = mesh.p.T[facets]
    points = value @ corners  # (f, q, 3)
    normal = np.cross(slope[0] @ corners, slope[1] @ corners)
    place = (mesh.t[:, cells].T[:, None] == facets[:, :, None]).argmax(axis=2)
    local = value @ elem.refdom.p.T[place]  # (f, q, 3) reference coordinates in the cells
    nodes = model.basis.element_dofs[:, cells].T  # (f, a)
    shape, _ = _functions(elem, local.reshape(-1, 3).T)
    return Sample(
        points.reshape(-1, 3),
        (np.linalg.norm(normal, axis=2) * weights).ravel(),
        _interpolation(np.repeat(nodes, len(weights), axis=0), shape, model.basis.N),
    )


def point_sample(
    model: FeModel,
    points: Array,
    weights: Array,
    slack: float = _INSIDE,
) -> Sample:
    """Given points (m, 3), located in the elements; weights (m,) are taken as they are.

    slack: how far outside its element a point may lie, in reference coordinates.
    """
    cells, local = locate(model, points, slack)
    nodes = model.basis.element_dofs.T[cells]
    shape, _ = _functions(model.basis.elem, local.T)
    return Sample(points, weights, _interpolation(nodes, shape, model.basis.N))


def disc_points(
    centre: Array,
    normal: Array,
    diameter: float,
    toward: Array | None = None,
) -> tuple[Array, Array]:
    """Points (m, 3) and weights (m,) in m2 that integrate over a disc.

    Gauss-Legendre in r^2 (the Jacobian r dr absorbed) times equal angles: exact for polynomials
    of degree 2 _RINGS - 1 in r^2 and of degree below _SPOKES in angle. toward: a direction (3,) in
    the disc, in whose mirror the spokes lie alike. Discs whose directions turn with the elements
    below them have the same points in them.
    """
    x, w = np.polynomial.legendre.leggauss(_RINGS)
    radius = 0.5 * diameter
    r = radius * np.sqrt(0.5 * (x + 1))
    angle = 2 * np.pi * (np.arange(_SPOKES) + 0.5) / _SPOKES
    normal = normal / np.linalg.norm(normal)
    helper = np.eye(3)[np.argmin(np.abs(normal))] if toward is None else toward
    e1 = np.cross(normal, helper)
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(normal, e1)
    ray = np.cos(angle)[:, None] * e1 + np.sin(angle)[:, None] * e2
    points = centre + (r[:, None, None] * ray).reshape(-1, 3)
    weights = np.repeat(0.5 * w * np.pi * radius**2 / _SPOKES, _SPOKES)
    return points, weights


def facet_numbers(model: FeModel, facets: Ints) -> Ints:
    """scikit-fem's numbers of facets given by their vertices (k, c), in any order."""
    sorted_facets = np.sort(np.asarray(facets, dtype=np.int64), axis=1)
    keys, order, vertices = model.facet_keys
    place = np.searchsorted(keys, facet_keys(sorted_facets, len(model.nodes)))
    numbers = order[np.minimum(place, len(order) - 1)]
    if not np.array_equal(vertices[numbers], sorted_facets):
        raise FlexgearError("a named patch holds facets that are not faces of the mesh's cells")
    return numbers


def locate(model: FeModel, points: Array, slack: float = _INSIDE) -> tuple[Ints, Array]:
    """Element (m,) and reference coordinates (m, 3) of each point; Newton on the element map."""
    corners, tree = model.cell_corners, model.cell_tree
    cells = np.zeros(len(points), dtype=np.int64)
    local = np.zeros((len(points), 3))
    excess = np.full(len(points), np.inf)
    for neighbours in (16, 128):
        todo = np.flatnonzero(excess > slack)
        if not len(todo):
            break
        _, near = tree.query(points[todo], k=min(neighbours, len(corners)))
        near = near.reshape(len(todo), -1)
        x = _inverse_map(model, corners, near, points[todo])
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
    """Functions (..., a) of an element and their slopes (d, ..., a) at reference coordinates
    (d, ...)."""
    parts = [elem.lbasis(at, i) for i in range(len(elem.doflocs))]
    value = np.stack([np.broadcast_to(value, at.shape[1:]) for value, _ in parts], axis=-1)
    return value, np.stack([np.broadcast_to(slope, at.shape) for _, slope in parts], axis=-1)


def _inverse_map(
    model: FeModel,
    corners: Array,
    cells: Ints,
    points: Array,
) -> Array:
    """Reference coordinates (m, c, 3) of point m in each of its candidate cells (m, c)."""
    elem, tet = model.basis.mesh.elem(), model.fe_mesh.kind == "tet"
    vertices = corners[cells]  # (m, c, v, 3)
    x = np.full(cells.shape + (3,), 0.25 if tet else 0.5)
    for _ in range(2 if tet else 12):
        value, slope = _functions(elem, np.moveaxis(x, -1, 0))  # (m, c, v), (3, m, c, v)
        residual = points[:, None] - np.einsum("mcv,mcvi->mci", value, vertices)
        jacobian = np.moveaxis(slope, 0, -2) @ vertices  # (m, c, j, i)
        step = np.linalg.solve(jacobian.swapaxes(2, 3), residual[..., None])[..., 0]
        x = np.clip(x + step, -1.0, 2.0)
    return x


def _interpolation(nodes: Ints, shape: Array, count: int) -> sp.csr_matrix:
    """CSR (m, count) with shape (m, a) at columns nodes (m, a); rounding zeros are left out."""
    rows = np.repeat(np.arange(len(nodes)), nodes.shape[1])
    values = shape.ravel()
    keep = np.abs(values) > 1e-13
    return sp.coo_matrix(
        (values[keep], (rows[keep], nodes.ravel()[keep])), shape=(len(nodes), count)
    ).tocsr()


def element_gradient(model: FeModel, vertices: Ints) -> sp.csr_matrix:
    """D (3k, n): rows 3i + j give ∂f/∂x_j at vertex i of nodal values f (n,), the mean over the
    elements that meet there of the derivative of their functions."""
    cells, basis = model.basis.mesh.t, model.basis
    place = np.full(len(model.nodes), -1)
    place[vertices] = np.arange(len(vertices))
    rows, columns, values = [], [], []
    for corner, at in enumerate(place[cells]):
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
    count = np.bincount(place[cells].ravel() + 1, minlength=len(vertices) + 1)[1:]
    return (sp.diags_array(np.repeat(1.0 / count, 3)) @ total).tocsr()
