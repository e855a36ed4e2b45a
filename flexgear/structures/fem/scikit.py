"""A mesh of scikit-fem as one that assembly takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skfem import Mesh, MeshHex, MeshTet

from flexgear.model.errors import InputError

_KINDS: dict[type[Mesh], str] = {MeshHex: "hex", MeshTet: "tet"}


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """Vertices (n, 3) m, cells (m, 8) or (m, 4), and patches by name, their facets (k, 4) or
    (k, 3) in cyclic order, as ``FeMeshLike`` has them."""

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    kind: str
    facets: Mapping[str, NDArray[np.int64]]


def solid_mesh(mesh: Mesh) -> SolidMesh:
    """The mesh with its named boundaries as patches; InputError for other cells than hexahedra and
    tetrahedra with straight edges."""
    kind = _KINDS.get(type(mesh))
    if kind is None:
        problem = f"is a {type(mesh).__name__}"
        raise InputError("reduce_mesh", "mesh", problem, "give a MeshHex or a MeshTet")
    facets, boundaries = mesh.facets.T.astype(np.int64), mesh.boundaries or {}
    patches = {str(name): facets[np.asarray(numbers)] for name, numbers in boundaries.items()}
    points, cells = np.ascontiguousarray(mesh.p.T), np.ascontiguousarray(mesh.t.T)
    return SolidMesh(points, cells.astype(np.int64), kind, patches)
