"""Which scikit-fem element stands for which cells.

Quadratic interpolation on straight-edged geometry: 20-node serendipity on 8-vertex hexahedra,
10-node on 4-vertex tetrahedra. Integration order 4 is 3 x 3 x 3 Gauss points on hexahedra, exact
for the mass matrix of a parallelepiped, and is what CalculiX takes for C3D20. Cells come in
scikit-fem's vertex order, right-handed (see `flexgear.structures.fe_mesh.fe_mesh`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from skfem import CellBasis, Element, ElementHexS2, ElementTetP2, Mesh, MeshHex, MeshTet
from skfem.assembly.basis.abstract_basis import AbstractBasis

INTEGRATION_ORDER = 4
_MESHES = {"hex": MeshHex, "tet": MeshTet}
_ELEMENTS = {"hex": ElementHexS2, "tet": ElementTetP2}


class FeMeshLike(Protocol):
    """What assembly needs of a finite-element mesh (see `flexgear.structures.fe_mesh`)."""

    @property
    def points(self) -> NDArray[np.float64]:
        """Vertices (n, 3), m."""

    @property
    def cells(self) -> NDArray[np.int64]:
        """Vertex numbers (m, 8) or (m, 4)."""

    @property
    def kind(self) -> str:
        """ "hex" or "tet"."""

    @property
    def facets(self) -> Mapping[str, NDArray[np.int64]]:
        """Patch name -> vertex numbers (k, 4) or (k, 3)."""


def scalar_basis(fe_mesh: FeMeshLike) -> CellBasis:
    """Scalar quadratic basis on the cells; node n of it carries dofs 3n, 3n+1, 3n+2 (x, y, z).

    Vertices come first and keep their numbers, edge midpoints follow.
    """
    return CellBasis(*_mesh_and_element(fe_mesh), intorder=INTEGRATION_ORDER)


def numbering(fe_mesh: FeMeshLike) -> AbstractBasis:
    """Numbers and places of the same basis's nodes, its functions not evaluated anywhere."""
    nowhere = (np.zeros((3, 0)), np.zeros(0))
    basis = AbstractBasis(*_mesh_and_element(fe_mesh), quadrature=nowhere)
    basis.nelems = basis.mesh.nelements
    return basis


def _mesh_and_element(fe_mesh: FeMeshLike) -> tuple[Mesh, Element]:
    kind = fe_mesh.kind
    cells = np.ascontiguousarray(np.asarray(fe_mesh.cells).T)
    points = np.ascontiguousarray(np.asarray(fe_mesh.points, dtype=float).T)
    return _MESHES[kind](points, cells), _ELEMENTS[kind]()
