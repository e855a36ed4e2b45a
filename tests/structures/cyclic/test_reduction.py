"""Reduction sector by sector against the general path on the same mesh, and against theory."""

import numpy as np
import pytest
import scipy.linalg as sla
from cyclic_samples import (
    STEEL,
    TEETH,
    bent,
    fixed_frequencies,
    plain_ring,
    ring_ties,
    toothed_ring_mesh,
)
from plain_meshes import annulus

from flexgear.model.errors import FlexgearError
from flexgear.structures.bodies import turn
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of, rigid_tie
from flexgear.structures.reduction import reduce

MODES = 20


pytestmark = pytest.mark.usefixtures("one_thread")


def test_sectors_of_a_toothed_ring_are_reduced_as_the_whole():
    """The generator's: twisted sectors, borders through the rim."""
    fe_mesh = toothed_ring_mesh()
    model = FeModel(fe_mesh, *STEEL)
    ties = ring_ties(model, 24, 0.215, 0.275, fe_mesh.points[:, 2].max(), patch="tooth_root")
    interface = interface_of(model, ties)
    whole = reduce(model, interface, MODES)
    one, again = (reduce(model, interface, MODES, sectors=(24,)) for _ in range(2))
    assert np.allclose(fixed_frequencies(one), fixed_frequencies(whole), rtol=1e-8)
    for name in ("stiffness", "mass"):
        expected, matrix = getattr(whole.body, name), getattr(one.body, name)
        b, scale = interface.size, 1 / np.sqrt(np.diag(expected))
        error = scale[:, None] * (matrix - expected) * scale
        assert np.abs(error[:b, :b]).max() < 1e-8
        assert np.array_equal(getattr(again.body, name), matrix)  # the same input, the same numbers


def moved_node():
    model = FeModel(bent(annulus((24, 1, 2), teeth=TEETH)), *STEEL)
    return model, interface_of(model, ring_ties(model, TEETH, 0.7, 0.88, 0.15))


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (moved_node, "general: the FE mesh does not repeat by sectors"),
        (lambda: plain_ring(teeth_tie=rigid_tie), "general: rigid ties"),
    ],
)
def test_where_geometry_or_ties_break_the_period_the_general_path_serves(body, reason):
    model, interface = body()
    reduction = reduce(model, interface, 4, sectors=(TEETH,))
    assert reduction.body.report["path"] == reason
    assert reduction.body.report["solver"] == "cholmod"
    again = reduce(model, interface, 4)
    assert np.allclose(fixed_frequencies(reduction), fixed_frequencies(again), rtol=1e-12)


def test_ties_to_the_same_points_are_refused():
    model, _ = plain_ring()
    ties = ring_ties(model, TEETH, 0.7, 0.88, 0.15)
    again = facet_sample(model, model.fe_mesh.facets["outer"])
    twice = interface_of(model, [*ties, averaging_tie("again", np.zeros(3), again)])
    with pytest.raises(FlexgearError, match="same points"):
        reduce(model, twice, 4, sectors=(TEETH,))


def test_thin_ring_frequencies_by_harmonic():
    """In-plane bending of a free thin ring, n = 2 ... 5 waves around.

    omega_n^2 = n^2 (n^2 - 1)^2 / (n^2 + 1) E I / (rho A R^4); each a pair, and every mode's
    displacement in sector axes holds the one harmonic n.
    """
    teeth, thick = 30, 0.02
    fe_mesh = annulus((90, 1, 1), 1 - thick / 2, 1 + thick / 2, 0.06, teeth=teeth)
    model = FeModel(fe_mesh, *STEEL)
    ties = [
        averaging_tie(name, facets_middle(fe_mesh, name), facet_sample(model, fe_mesh.facets[name]))
        for name in (f"patch_{j + 1:03d}" for j in range(teeth))
    ]
    reduction = reduce(model, interface_of(model, ties), 12, sectors=(teeth,))
    values, vectors = sla.eigh(reduction.body.stiffness, reduction.body.mass)
    cyclic, b = reduction.condensation, reduction.condensation.interface.size
    fields = cyclic.constraint_motion(vectors[:b, 6:40]) + reduction.fixed_modes @ vectors[b:, 6:40]
    form = fields.reshape(-1, 3, teeth, 34)
    share = np.sum(form[:, 2] ** 2, axis=(0, 1)) / np.sum(form**2, axis=(0, 1, 2))
    content = np.sum(np.abs(np.fft.rfft(form, axis=2)) ** 2, axis=(0, 1))
    inplane = np.flatnonzero(share < 0.02)
    young, _, density = STEEL
    for n in range(2, 6):
        theory = np.sqrt(n**2 * (n**2 - 1) ** 2 / (n**2 + 1) * young * thick**2 / 12 / density)
        two = inplane[2 * (n - 2) : 2 * (n - 1)]
        assert np.allclose(np.sqrt(values[6 + two]), theory, rtol=0.01)
        assert np.allclose(values[6 + two[0]], values[6 + two[1]], rtol=1e-8)
        assert np.all(content[n, two] > (1 - 1e-8) * content[:, two].sum(axis=0))


def facets_middle(fe_mesh, name):
    return fe_mesh.points[fe_mesh.facets[name]].mean(axis=(0, 1))


@pytest.mark.parametrize("count", [6, 7, 8, 9])
def test_no_pair_of_modes_is_cut_so_that_the_reduced_body_is_as_regular_as_the_ring(count):
    """Turned by a pitch, teeth one on, the mass that modes share with the interface is the same."""
    model, interface = plain_ring()
    ties = ring_ties(model, TEETH, 0.7, 0.88, 0.15)[:-2]  # without bolts
    interface = interface_of(model, ties)
    body = reduce(model, interface, count, sectors=(TEETH,)).body
    b = body.interface_dofs
    shared = body.mass[:b, b:] @ body.mass[b:, :b]
    pitch = np.kron(np.eye(b // 6), turn(2 * np.pi / TEETH))
    names = list(interface.node_names)
    teeth = [names.index(f"tooth_{j + 1}") for j in range(TEETH)]
    order = np.arange(b // 6)
    order[teeth] = np.roll(teeth, 1)  # what a tooth has now, the one before had
    dofs = (6 * order[:, None] + np.arange(6)).ravel()
    turned = (pitch @ shared @ pitch.T)[np.ix_(dofs, dofs)]
    assert np.abs(turned - shared).max() < 1e-8 * np.abs(shared).max()
    assert body.n_modes in (count, count + 1)
