"""Plane strain on quadrilaterals, for small parts that are the same all along the face."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad
from skfem.models.elasticity import lame_parameters, linear_elasticity


def plane_strain(
    points: NDArray[np.float64], cells: NDArray[np.int64], young: float, poisson: float
) -> tuple[NDArray[np.float64], sp.csr_matrix]:
    """Nodes (n, 2), m, and stiffness (2n, 2n), N/m per m of face, of quadratic quadrilaterals with
    straight sides; dofs 2 n and 2 n + 1 are x and y of node n.

    points: vertices (p, 2), m; cells: (m, 4) of them, round each cell; young: Pa.
    """
    fe_mesh = MeshQuad(np.ascontiguousarray(points.T), np.ascontiguousarray(cells.T))
    basis = Basis(fe_mesh, ElementVector(ElementQuad2()))
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    return np.ascontiguousarray(basis.doflocs[:, ::2].T), stiffness.tocsr()
