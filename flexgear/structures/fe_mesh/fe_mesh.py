"""Finite-element meshes of bodies: vertices, cells, named patches.

Numbering in the whole package:

* ``cells`` have the order of ``skfem.MeshHex1(points.T, cells.T)`` and
  ``skfem.MeshTet1(points.T, cells.T)``; det(dx/dξ) is positive.
* scikit-fem numbers a hexahedron by its reference coordinates (1,1,1), (1,1,0), (1,0,1), (0,1,1),
  (1,0,0), (0,1,0), (0,0,1), (0,0,0). VTK, gmsh, Abaqus and CalculiX go round the bottom face
  counter-clockwise seen from inside the cell, then round the top. ``HEX_TO_VTK`` and
  ``HEX_FROM_VTK`` convert and keep the cell right-handed: ``vtk_cells = cells[:, HEX_TO_VTK]``.
  (scikit-fem's own export mapping gives left-handed cells instead.)
* A facet is a row of vertex ids in cyclic order. The normal (p1 - p0) x (p2 - p0) of a facet on the
  surface points out of the body; normals of an interior section have one sense within a patch.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Ints
from flexgear.model.errors import FlexgearError

Kind = Literal["hex", "tet"]

HEX_TO_VTK = (7, 4, 1, 5, 6, 2, 0, 3)
HEX_FROM_VTK = (6, 2, 5, 7, 1, 3, 4, 0)

# Facets with outward normals and edges, as positions in VTK order (tetrahedra: the same in both).
FACETS_VTK: dict[str, tuple[tuple[int, ...], ...]] = {
    "hex": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
    "tet": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
}
EDGES_VTK: dict[str, tuple[tuple[int, int], ...]] = {
    "hex": (
        *((0, 1), (1, 2), (2, 3), (3, 0)),
        *((4, 5), (5, 6), (6, 7), (7, 4)),
        *((0, 4), (1, 5), (2, 6), (3, 7)),
    ),
    "tet": ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
}
# For every corner of a cell (VTK order) the ends of its three edges, right-handed.
_CORNERS_VTK: dict[str, tuple[tuple[int, int, int, int], ...]] = {
    "hex": (
        *((0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7)),
        *((4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3)),
    ),
    "tet": ((0, 1, 2, 3), (1, 2, 0, 3), (2, 0, 1, 3), (3, 0, 2, 1)),
}


@dataclass(frozen=True, eq=False)
class FeMesh:
    """Vertices, cells and named patches of one body; immutable.

    points: (n, 3) m; cells: (m, 8) for "hex" or (m, 4) for "tet", scikit-fem order (see module);
    facets: patch name -> (k, 4) or (k, 3) vertex ids of its facets.
    Raises FlexgearError for cells that are inverted, collapsed or not finite.
    """

    points: Array
    cells: Ints
    kind: Kind
    facets: Mapping[str, Ints]

    def __post_init__(self) -> None:
        for name, kind in (("points", np.float64), ("cells", np.int64)):
            object.__setattr__(self, name, np.array(getattr(self, name), dtype=kind))
        facets = {name: np.array(ids, dtype=np.int64) for name, ids in self.facets.items()}
        object.__setattr__(self, "facets", facets)
        for array in (self.points, self.cells, *facets.values()):
            array.setflags(write=False)
        determinant, _ = corner_jacobians(self.points, self.vtk_cells, self.kind)
        bad = int((~(determinant.min(axis=1) > 0.0)).sum())
        if bad:
            raise FlexgearError(f"FE mesh: {bad} cells are inverted or collapsed")

    @property
    def vtk_cells(self) -> Ints:
        """Cells in the right-handed order of VTK, gmsh, Abaqus and CalculiX."""
        return self.cells[:, HEX_TO_VTK] if self.kind == "hex" else self.cells

    @property
    def quadratic_dofs(self) -> int:
        """Degrees of freedom with one node a vertex and one an edge (20-node hex, 10-node tet)."""
        ends = np.sort(self.vtk_cells[:, np.array(EDGES_VTK[self.kind])].reshape(-1, 2), axis=1)
        return 3 * (len(self.points) + len(np.unique(ends, axis=0)))

    @cached_property
    def every_facet(self) -> Ints:
        """Facets (m·6, 4) or (m·4, 3) of all cells, outward from their cell; shared ones twice."""
        return facets_of(self.vtk_cells)

    @cached_property
    def boundary(self) -> Ints:
        """Facets (k, 3 or 4) that belong to one cell only, with outward normals."""
        return outer(self.every_facet)

    def quality(self) -> float:
        """Smallest scaled Jacobian: det [e1 e2 e3]/(|e1||e2||e3|), times √2 for tetrahedra.

        1 for a cube or a regular tetrahedron, 0 or less for a collapsed cell.
        """
        return float(corner_jacobians(self.points, self.vtk_cells, self.kind)[1].min())

    def quadrature(self) -> tuple[Array, Array]:
        """Points (m, q, 3) m and weights (m, q) m³ of ∫ … dV, exact for x xᵀ in a cell with plane
        faces: 2x2x2 Gauss points of a trilinear cell, four of a tetrahedron."""
        corners = self.points[self.vtk_cells]
        if self.kind == "tet":
            e1, e2, e3 = (corners[:, i] - corners[:, 0] for i in (1, 2, 3))
            volume = np.einsum("ij,ij->i", np.cross(e1, e2), e3) / 6.0
            near = (1.0 - 1.0 / np.sqrt(5.0)) / 4.0
            shares = np.full((4, 4), near) + (1.0 - 4.0 * near) * np.eye(4)
            return shares @ corners, np.repeat(volume[:, None] / 4.0, 4, axis=1)
        signs = np.array(
            [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1]]
            + [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
            dtype=float,
        )
        factor = 1.0 + signs[:, None] * signs / np.sqrt(3.0)  # (points, vertices, 3)
        shapes = factor.prod(axis=2) / 8.0
        gradient = signs * factor.prod(axis=2)[..., None] / factor / 8.0
        jacobian = np.einsum("qvi,mvj->mqij", gradient, corners)
        return shapes @ corners, np.linalg.det(jacobian)

    def volume(self) -> float:
        """Volume of the body, m³."""
        return float(self.quadrature()[1].sum())

    def centre(self, name: str) -> Array:
        """Centroid (3,) m of a patch; quadrilaterals as two triangles."""
        ids = triangles(self.facets[name])
        areas = facet_areas(self.points, ids)
        return np.asarray(areas @ self.points[ids].mean(axis=1) / areas.sum())


def facets_of(vtk_cells: Ints) -> Ints:
    """Facets (m·6, 4) or (m·4, 3) of cells in VTK order, outward from their cell."""
    table = np.array(FACETS_VTK["hex" if vtk_cells.shape[1] == 8 else "tet"])
    return vtk_cells[:, table].reshape(-1, table.shape[1])


def outer(facets: Ints) -> Ints:
    """Facets that occur once."""
    _, first, count = np.unique(
        np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True
    )
    return facets[np.sort(first[count == 1])]


def corner_jacobians(points: Array, vtk_cells: Ints, kind: Kind) -> tuple[Array, Array]:
    """Corner determinants det [e1 e2 e3] and scaled ones, (m, 4 or 8), of cells in VTK order."""
    table = np.array(_CORNERS_VTK[kind])
    at = points[vtk_cells[:, table]]
    e = at[:, :, 1:] - at[:, :, :1]
    determinant = np.einsum("mcj,mcj->mc", np.cross(e[:, :, 0], e[:, :, 1]), e[:, :, 2])
    lengths = np.maximum(np.linalg.norm(e, axis=3).prod(axis=2), np.finfo(float).tiny)
    factor = np.sqrt(2.0) if kind == "tet" else 1.0
    return determinant, factor * determinant / lengths


def facet_areas(points: Array, ids: Ints) -> Array:
    """Areas (k,) m² of facets by their vertex ids (k, 3 or 4); quadrilaterals as two triangles."""
    p = points[triangles(ids)]
    twice = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    return np.asarray(twice.reshape(-1, len(ids)).sum(axis=0) / 2.0)


def triangles(ids: Ints) -> Ints:
    """Triangles (t, 3) of facets (k, 3 or 4): first halves of quadrilaterals, then second ones."""
    return ids if ids.shape[1] == 3 else np.concatenate([ids[:, [0, 1, 2]], ids[:, [0, 2, 3]]])


def welded(points: Array, tolerance: float) -> tuple[Array, Ints]:
    """Different points (k, d) among points (n, d), those within a tolerance of each other counted
    once, and number of the different point for each (n,)."""
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray").T
    near = coo_array((np.ones(pairs.shape[1]), tuple(pairs)), shape=(len(points),) * 2)
    _, number = connected_components(near, directed=False)
    _, first = np.unique(number, return_index=True)
    return points[first], np.asarray(number, dtype=np.int64)


def facet_keys(ids: Ints, n: int) -> Ints:
    """Keys (k,) of facets (k, 3 or 4) of n vertices, which do not depend on the order of their ids:
    the three smallest ids are unique. FlexgearError for more than two million vertices."""
    s = np.sort(ids, axis=1)[:, :3]
    if n < 2_000_000:
        return (s[:, 0] * n + s[:, 1]) * n + s[:, 2]
    raise FlexgearError("FE mesh: more than two million vertices")
