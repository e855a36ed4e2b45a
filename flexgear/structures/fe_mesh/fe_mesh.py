"""The finite-element mesh that every body is made from: vertices, cells, named patches.

Numbering, stated here once for the whole package:

* ``cells`` follow scikit-fem: ``skfem.MeshHex1(points.T, cells.T)`` and
  ``skfem.MeshTet1(points.T, cells.T)`` take them as they are, and det(dx/dξ) is positive.
* scikit-fem numbers a hexahedron by its reference coordinates (1,1,1), (1,1,0), (1,0,1), (0,1,1),
  (1,0,0), (0,1,0), (0,0,1), (0,0,0). VTK, gmsh, Abaqus and CalculiX go round the bottom face
  counter-clockwise seen from inside the cell, then round the top. ``HEX_TO_VTK`` and
  ``HEX_FROM_VTK`` convert and keep the cell right-handed: ``vtk_cells = cells[:, HEX_TO_VTK]``.
  (scikit-fem's own export mapping gives left-handed cells instead.)
* A facet is a row of vertex ids in cyclic order. Facets on the surface have the normal
  (p1 - p0) x (p2 - p0) pointing out of the body; facets of an interior section may point either
  way but do so alike within a patch.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
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
    "tet": ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)),
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
    Raises FlexgearError unless: all finite; every vertex belongs to a cell; every cell has
    positive corner Jacobians; every facet is a facet of a cell, none twice in a patch.
    """

    points: Array
    cells: Ints
    kind: Kind
    facets: Mapping[str, Ints]

    def __post_init__(self) -> None:
        if self.kind not in ("hex", "tet"):
            raise FlexgearError(f"FE mesh: kind must be hex or tet, not {self.kind!r}")
        points = np.array(self.points, dtype=np.float64)
        cells = np.array(self.cells, dtype=np.int64)
        facets = {name: np.array(ids, dtype=np.int64) for name, ids in self.facets.items()}
        for array in (points, cells, *facets.values()):
            array.setflags(write=False)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "cells", cells)
        object.__setattr__(self, "facets", MappingProxyType(facets))
        self._check()

    def __reduce__(self) -> tuple[type[FeMesh], tuple[Array, Ints, Kind, dict[str, Ints]]]:
        return FeMesh, (self.points, self.cells, self.kind, dict(self.facets))

    @property
    def vtk_cells(self) -> Ints:
        """Cells in the right-handed order of VTK, gmsh, Abaqus and CalculiX."""
        return self.cells[:, HEX_TO_VTK] if self.kind == "hex" else self.cells

    @cached_property
    def edges(self) -> Ints:
        """(k, 2) vertex ids of the edges, each once, smaller id first."""
        pairs = self.vtk_cells[:, np.array(EDGES_VTK[self.kind])].reshape(-1, 2)
        return np.unique(np.sort(pairs, axis=1), axis=0)

    @property
    def quadratic_dofs(self) -> int:
        """Degrees of freedom with one node a vertex and one an edge (20-node hex, 10-node tet)."""
        return 3 * (len(self.points) + len(self.edges))

    @cached_property
    def every_facet(self) -> Ints:
        """(m·6, 4) or (m·4, 3) facets of all cells, outward from their cell; shared ones twice."""
        table = np.array(FACETS_VTK[self.kind])
        return self.vtk_cells[:, table].reshape(-1, table.shape[1])

    @cached_property
    def boundary(self) -> Ints:
        """(k, 3 or 4) facets that belong to one cell only, normals outward."""
        every = self.every_facet
        _, first, count = np.unique(
            np.sort(every, axis=1), axis=0, return_index=True, return_counts=True
        )
        return every[np.sort(first[count == 1])]

    def corner_jacobians(self) -> tuple[Array, Array]:
        """det [e1 e2 e3] at the corners of every cell, and divided by the lengths: (m, 4 or 8)."""
        return corner_jacobians(self.points, self.vtk_cells, self.kind)

    def quality(self) -> float:
        """Smallest scaled Jacobian: det [e1 e2 e3]/(|e1||e2||e3|), times √2 for tetrahedra.

        1 for a cube or a regular tetrahedron, 0 or less for a collapsed cell.
        """
        return float(self.corner_jacobians()[1].min())

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

    def cell_volumes(self) -> Array:
        """V = ∫ dV (m,) m³."""
        return np.asarray(self.quadrature()[1].sum(axis=1))

    def volume(self) -> float:
        """Volume of the body, m³."""
        return float(self.cell_volumes().sum())

    def facet_areas(self, name: str) -> Array:
        """Areas of the facets of a patch (k,) m²; a quadrilateral as its two triangles."""
        return facet_areas(self.points, self.facets[name])

    def content_hash(self) -> str:
        """SHA-256 over the kind, vertices, cells and patches: the key of everything derived."""
        digest = hashlib.sha256(f"fe_mesh:{self.kind}".encode())
        named = [("points", self.points), ("cells", self.cells)]
        for name, array in [*named, *sorted(self.facets.items())]:
            digest.update(f"{name}:{array.shape}:{array.dtype.str}".encode())
            digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    def with_facets(self, facets: Mapping[str, Ints]) -> FeMesh:
        """The same vertices and cells under other patches."""
        return FeMesh(self.points, self.cells, self.kind, facets)

    def _check(self) -> None:
        n, corners = len(self.points), 8 if self.kind == "hex" else 4
        sides = 4 if self.kind == "hex" else 3
        if self.points.ndim != 2 or self.points.shape[1:] != (3,) or n == 0:
            raise FlexgearError(f"FE mesh: points must be (n, 3), not {self.points.shape}")
        if not np.isfinite(self.points).all():
            raise FlexgearError("FE mesh: a vertex coordinate is not a finite number")
        if self.cells.ndim != 2 or self.cells.shape[1] != corners or len(self.cells) == 0:
            raise FlexgearError(f"FE mesh: {self.kind} cells have {corners} vertices each")
        if self.cells.min() < 0 or self.cells.max() >= n:
            raise FlexgearError("FE mesh: a cell refers to a vertex that is not there")
        if len(np.unique(self.cells)) != n:
            raise FlexgearError("FE mesh: some vertices belong to no cell")
        bad = int((self.corner_jacobians()[0].min(axis=1) <= 0.0).sum())
        if bad:
            raise FlexgearError(f"FE mesh: {bad} cells are inverted or collapsed")
        mesh_keys, first = np.unique(facet_keys(self.every_facet, n), return_index=True)
        last = self.every_facet[first].max(axis=1)
        for name, ids in self.facets.items():
            if ids.ndim != 2 or ids.shape[1] != sides or len(ids) == 0:
                raise FlexgearError(f"FE mesh: patch {name} must be (k > 0, {sides}) vertex ids")
            if ids.min() < 0 or ids.max() >= n:
                raise FlexgearError(f"FE mesh: patch {name} refers to a vertex that is not there")
            keys = facet_keys(ids, n)
            if len(np.unique(keys)) != len(keys):
                raise FlexgearError(f"FE mesh: patch {name} holds a facet twice")
            at = np.minimum(np.searchsorted(mesh_keys, keys), len(mesh_keys) - 1)
            if (mesh_keys[at] != keys).any() or (last[at] != ids.max(axis=1)).any():
                raise FlexgearError(f"FE mesh: patch {name} holds a facet of no cell")


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
    """Areas (k,) of triangles or quadrilaterals given as cyclic vertex ids (k, 3 or 4)."""
    p = points[ids]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2.0
    if ids.shape[1] == 4:
        area = area + np.linalg.norm(np.cross(p[:, 2] - p[:, 0], p[:, 3] - p[:, 0]), axis=1) / 2.0
    return area


def facet_keys(ids: Ints, n: int) -> Ints:
    """One integer a facet, the same for any order: three smallest ids name a facet of a cell."""
    s = np.sort(ids, axis=1)[:, :3]
    if n < 2_000_000:
        return (s[:, 0] * n + s[:, 1]) * n + s[:, 2]
    raise FlexgearError("FE mesh: more than two million vertices")
