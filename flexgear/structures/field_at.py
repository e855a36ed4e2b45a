"""Values anywhere in a body's FE mesh, or close beside it, from those at its vertices."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.structures.fe_mesh.fe_mesh import HEX_TO_VTK
from flexgear.structures.reduced import ReducedBody

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# of a hexahedron in VTK's order, round the diagonal 0-6
_TETRAHEDRA = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
_NEAREST = 48  # tetrahedra by their centres, among which the one around a point is


class FieldAt:
    """Linear interpolation in tetrahedra (a hexahedron is six): exact for linear fields."""

    def __init__(self, body: ReducedBody) -> None:
        self.points = np.asarray(body.points, dtype=float)
        cells = np.asarray(body.cells)
        if cells.shape[1] != 4:
            vtk = cells[:, HEX_TO_VTK]
            cells = np.concatenate([vtk[:, list(corners)] for corners in _TETRAHEDRA])
        self.cells: Ints = cells

    @cached_property
    def _inverse(self) -> Array:
        """(T, 3, 3): from a distance to the first vertex to weights of the three others."""
        corners = self.points[self.cells]
        return np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))

    @cached_property
    def _centres(self) -> cKDTree:
        return cKDTree(self.points[self.cells].mean(axis=1))

    def weights(self, places: Array) -> sp.csr_matrix:
        """(n, p): value at places (n, 3) per value at the vertices; beside the mesh the nearest
        tetrahedron goes on."""
        near = self._centres.query(places, k=min(_NEAREST, len(self.cells)))[1]
        near = near.reshape(len(places), -1)
        away = places[:, None] - self.points[self.cells[near, 0]]
        others = np.einsum("nkij,nkj->nki", self._inverse[near], away)
        every = np.concatenate([1.0 - others.sum(axis=2, keepdims=True), others], axis=2)
        best = np.argmax(every.min(axis=2), axis=1)
        at = np.arange(len(places))
        rows = np.repeat(at, 4), self.cells[near[at, best]].ravel()
        return sp.csr_matrix((every[at, best].ravel(), rows), (len(places), len(self.points)))
