"""A body whose matrices are assembled when somebody asks for them, or for a part of its cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.fem.assembly import FeModel, assemble
from flexgear.structures.fem.elements import FeMeshLike, numbering


@dataclass(frozen=True)
class _Cells:
    """Some cells of a mesh as a mesh of their own, without patches."""

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    kind: str
    facets: dict[str, NDArray[np.int64]]


class UnassembledModel(FeModel):
    """The same body as `assemble` makes: E in Pa, density in kg/m3."""

    def __init__(
        self, fe_mesh: FeMeshLike, young_modulus: float, poisson_ratio: float, density: float
    ) -> None:
        basis = numbering(fe_mesh)
        put = object.__setattr__  # the class is frozen
        put(self, "fe_mesh", fe_mesh)
        put(self, "basis", basis)
        put(self, "nodes", np.ascontiguousarray(basis.doflocs.T))
        put(self, "_material", (young_modulus, poisson_ratio, density))

    @cached_property
    def whole(self) -> FeModel:
        """With the matrices of all cells."""
        return assemble(self.fe_mesh, *self._material)  # type: ignore[attr-defined]

    @property
    def stiffness(self) -> sp.csr_matrix:  # type: ignore[override]
        """K (3n, 3n)."""
        return self.whole.stiffness

    @property
    def scalar_mass(self) -> sp.csr_matrix:  # type: ignore[override]
        """(n, n) with M = scalar_mass (x) I_3."""
        return self.whole.scalar_mass

    def part(self, cells: NDArray[np.int64]) -> tuple[FeModel, NDArray[np.int64]]:
        """Some cells alone, and which node of this body each of their nodes is."""
        corners = np.asarray(self.fe_mesh.cells)[cells]
        vertices, numbers = np.unique(corners, return_inverse=True)
        points = np.asarray(self.fe_mesh.points)[vertices]
        small = _Cells(points, numbers.reshape(corners.shape), self.fe_mesh.kind, {})
        model = assemble(small, *self._material)  # type: ignore[attr-defined]
        nodes = np.empty(len(model.nodes), dtype=np.int64)
        nodes[model.basis.element_dofs] = self.basis.element_dofs[:, cells]
        return model, nodes
