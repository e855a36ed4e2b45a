"""The same matrices by plain scikit-fem forms: slow, short, the reference of the tests."""

from __future__ import annotations

import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementVector
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from flexgear.structures.fem.elements import INTEGRATION_ORDER, FeMeshLike, scalar_basis


def plain_matrices(
    fe_mesh: FeMeshLike, young_modulus: float, poisson_ratio: float, density: float
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Stiffness (N/m) and mass (kg) as `assembly.assemble` gives them, dofs in the same order."""
    scalar = scalar_basis(fe_mesh)
    basis = Basis(scalar.mesh, ElementVector(scalar.elem), intorder=INTEGRATION_ORDER)

    @BilinearForm
    def inertia(u, v, _):  # type: ignore[no-untyped-def]
        return density * dot(u, v)

    elasticity = linear_elasticity(*lame_parameters(young_modulus, poisson_ratio))
    return elasticity.assemble(basis).tocsr(), inertia.assemble(basis).tocsr()
