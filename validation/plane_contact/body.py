"""Compliance of a held plane body at the nodes of its flanks, and stress along its fillets.

Plane strain, quadratic triangles on straight sides (scikit-fem), CHOLMOD.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import Basis, ElementTriP2, ElementVector, FacetBasis, MeshTri
from skfem.models.elasticity import lame_parameters, linear_elasticity

from flexgear.arrays import Array
from flexgear.structures.linalg.sparse import Factor

ELEMENT = ElementVector(ElementTriP2())
COLUMNS = 256  # right-hand sides at a time


@dataclass(frozen=True)
class Elastic:
    """Young's modulus (Pa) and Poisson's ratio."""

    young: float
    poisson: float


class Body:
    """A plane body with some dofs held.

    chains: (c, 2n + 1) numbers of the nodes of c boundary chains, vertices and midpoints of facets
    in turn; compliance: displacement (m) of both components of those nodes, numbered
    2 (chain, node) + component, by unit forces (N per m of face) on them.
    """

    def __init__(
        self, fe_mesh: MeshTri, material: Elastic, held: NDArray[np.int64],
        springs: sp.csr_matrix | None = None,
    ):  # fmt: skip
        """held: dofs; springs: added to the stiffness matrix, N/m per m of face."""
        self.basis, self.material = self.basis_of(fe_mesh), material
        stiffness = linear_elasticity(*lame_parameters(material.young, material.poisson)).assemble(
            self.basis
        )
        if springs is not None:
            stiffness = stiffness + springs
        self.free = np.setdiff1d(np.arange(self.basis.N), held)
        self.factor = Factor(stiffness.tocsr()[self.free][:, self.free])
        self.place = np.full(self.basis.N, -1)
        self.place[self.free] = np.arange(len(self.free))

    @classmethod
    def held_at_facets(cls, fe_mesh: MeshTri, material: Elastic, facets: NDArray[np.int64]) -> Body:
        """Body that stands still along facets."""
        return cls(fe_mesh, material, cls.basis_of(fe_mesh).get_dofs(facets=facets).flatten())

    @staticmethod
    def basis_of(fe_mesh: MeshTri) -> Basis:
        """Degrees of freedom on the FE mesh."""
        return Basis(fe_mesh, ELEMENT)

    def of_chains(self, vertices: NDArray[np.int64], facets: NDArray[np.int64]) -> None:
        """Take chains (c, n + 1) of vertices and (c, n) facets between them."""
        c, n = facets.shape
        dofs = np.empty((c, 2 * n + 1, 2), np.int64)
        dofs[:, ::2] = np.moveaxis(self.basis.nodal_dofs[:, vertices], 0, -1)
        dofs[:, 1::2] = np.moveaxis(self.basis.facet_dofs[:, facets], 0, -1)
        self.dofs = dofs
        flat = self.place[dofs.ravel()]
        self.compliance = np.empty((flat.size, flat.size))
        for start in range(0, flat.size, COLUMNS):
            part = flat[start : start + COLUMNS]
            right = np.zeros((len(self.free), len(part)))
            moves = part >= 0  # held nodes of a chain do not move
            right[part[moves], np.flatnonzero(moves)] = 1.0
            motion = self.factor.solve(right)[flat]
            motion[flat < 0] = 0.0
            self.compliance[:, start : start + COLUMNS] = motion

    def displacement(self, force: Array) -> Array:
        """All dofs under forces (c, 2n + 1, 2) on the chains' nodes, m."""
        right = np.zeros(self.basis.N)
        np.add.at(right, self.dofs.ravel(), force.ravel())
        u = np.zeros(self.basis.N)
        u[self.free] = self.factor.solve(right[self.free])
        return u

    def edge_stress(self, u: Array, facets: NDArray[np.int64]) -> tuple[Array, Array]:
        """Stress along free edges at their quadrature points (facets, points), Pa, and where these
        are, (2, facets, points) m: σ_t = t · σ t of plane strain."""
        edge = FacetBasis(self.basis.mesh, ELEMENT, facets=facets, intorder=4)
        gradient = np.asarray(edge.interpolate(u).grad)
        strain = 0.5 * (gradient + np.swapaxes(gradient, 0, 1))
        lam, mu = lame_parameters(self.material.young, self.material.poisson)
        stress = 2 * mu * strain
        stress[[0, 1], [0, 1]] += lam * (strain[0, 0] + strain[1, 1])
        tangent = np.array([-edge.normals[1], edge.normals[0]])
        along = np.einsum("ifq,ijfq,jfq->fq", tangent, stress, tangent)
        return along, np.asarray(edge.global_coordinates())
