"""Small reduced bodies: a free beam with fixed-interface modes, a ring of finite elements."""

from functools import cache

import numpy as np
import scipy.linalg
from plain_meshes import annulus

from flexgear.files.matrices.body import ReducedMatrices
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of
from flexgear.structures.reduction import reduce
from flexgear.structures.shaft import BeamSection, shaft_body

STEEL = (210e9, 0.3, 7850.0)
MODES = 5


@cache
def beam():
    """A stepped shaft on its ends and middle, with five fixed-interface modes."""
    sections = [BeamSection(0.4, 0.1, 0.02), BeamSection(0.6, 0.14)]
    young, poisson, density = STEEL
    full = shaft_body(sections, young=young, poisson=poisson, density=density, direction=1,
                      elements_per_section=4)  # fmt: skip
    nodes = [0, 4, 8]
    b = np.concatenate([np.arange(6 * k, 6 * k + 6) for k in nodes])
    i = np.setdiff1d(np.arange(full.size), b)
    k, m = full.stiffness, full.mass
    basis = np.zeros((full.size, len(b) + MODES))
    basis[b, : len(b)] = np.eye(len(b))
    basis[i, : len(b)] = -np.linalg.solve(k[np.ix_(i, i)], k[np.ix_(i, b)])
    _, modes = scipy.linalg.eigh(k[np.ix_(i, i)], m[np.ix_(i, i)])
    basis[i, len(b) :] = modes[:, :MODES]
    stiffness, mass = (basis.T @ matrix @ basis for matrix in (k, m))
    return ReducedMatrices(
        "beam",
        tuple(full.node_names[n] for n in nodes),
        full.positions[nodes],
        (stiffness + stiffness.T) / 2,
        (mass + mass.T) / 2,
        np.vstack([basis[6 * n : 6 * n + 3] for n in range(9)]),
        full.positions,
    )


@cache
def ring():
    """Four patches of a ring of finite elements and its outer face, with ten modes."""
    model = FeModel(annulus((8, 1, 1), teeth=4), *STEEL)
    ties = []
    for j in range(4):
        angle = 2 * np.pi * (j + 0.5) / 4
        sample = facet_sample(model, model.fe_mesh.facets[f"patch_{j + 1:03d}"])
        place = 0.7 * np.array([np.cos(angle), np.sin(angle), 0])
        ties.append(averaging_tie(f"tooth_{j + 1:03d}", place, sample))
    outer = facet_sample(model, model.fe_mesh.facets["outer"])
    ties.append(averaging_tie("fit_1", np.zeros(3), outer))
    body = reduce(model, interface_of(model, ties), 10).body
    return ReducedMatrices("ring", body.node_names, body.positions, body.stiffness, body.mass)


def frequencies(stiffness, mass, count=20):
    """Elastic ones, Hz."""
    squares = scipy.linalg.eigh(stiffness, mass, eigvals_only=True)
    return np.sqrt(squares[6 : 6 + count]) / (2 * np.pi)
