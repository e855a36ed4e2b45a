"""Reduction sector by sector against the general path on the same mesh, and against theory."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sla
from cyclic_samples import (
    STEEL,
    TEETH,
    bent,
    plain_ring,
    ring_ties,
    some_supports,
    toothed_ring_mesh,
)
from plain_meshes import annulus

from flexgear.model.errors import FlexgearError
from flexgear.structures.bodies import turn
from flexgear.structures.estimate import (
    ProbeLoad,
    compare_frequencies,
    probed,
    static_errors,
    tooth_lines,
)
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of, rigid_tie
from flexgear.structures.reduction import reduce

MODES = 20


pytestmark = pytest.mark.usefixtures("one_thread")


def plain():
    model, interface = plain_ring()
    return model, interface, TEETH


def toothed():
    """The generator's ring: twisted sectors, borders through the rim."""
    fe_mesh = toothed_ring_mesh()
    model = FeModel(fe_mesh, *STEEL)
    ties = ring_ties(model, 24, 0.215, 0.275, fe_mesh.points[:, 2].max(), patch="tooth_root")
    return model, interface_of(model, ties), 24


def few_sectors():
    """As carriers have them: borders as large as their sectors, and few nodes."""
    model, interface = plain_ring(teeth=5, radial=3, axial=4)
    return model, interface, 5


@pytest.fixture(scope="module", params=[plain, toothed, few_sectors])
def pair(request):
    """The same body reduced as a whole and by sectors."""
    model, interface, sectors = request.param()
    whole = reduce(model, interface, MODES)
    return model, interface, whole, reduce(model, interface, MODES, sectors=(sectors,))


@pytest.fixture(scope="module")
def supports(pair):
    return some_supports(pair[1])


def supported(reduction, supports):
    stiffness = reduction.body.stiffness.copy()
    stiffness[: len(supports), : len(supports)] += supports
    return stiffness


def of_unit_diagonal(matrix, like):
    scale = 1 / np.sqrt(np.diag(like))
    return scale[:, None] * matrix * scale


def test_paths_are_named(pair):
    _, _, whole, by_sectors = pair
    assert whole.body.report["path"] == "general: sectors not asked for"
    assert by_sectors.body.report["path"].startswith("cyclic: ")
    assert by_sectors.body.report["solver"] == "cyclic"
    cyclic = by_sectors.condensation  # both kinds of borders are tried
    assert cyclic.has_short_borders == (cyclic.sectors.count > 5)


def test_supported_solves_and_constraint_modes_agree(pair, supports):
    model, interface, whole, by_sectors = pair
    random = np.random.default_rng(0)
    right = random.standard_normal((model.dofs, 3))
    q = random.standard_normal((interface.size, 3))
    cyclic = by_sectors.condensation
    for expected, found in (
        (
            whole.condensation.supported_solve(right, supports),
            cyclic.supported_solve(cyclic.field_of(right), supports),
        ),
        (whole.condensation.constraint_motion(q), cyclic.constraint_motion(q)),
    ):
        found = cyclic.dofs_of(found, model.dofs)
        assert np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()
    expected = whole.condensation.constraint_load(right)
    assert np.abs(cyclic.constraint_load(right) - expected).max() < 1e-8 * np.abs(expected).max()


def test_reduced_stiffness_and_mass_agree(pair):
    _, interface, whole, by_sectors = pair
    b = interface.size
    for name in ("stiffness", "mass"):
        expected = getattr(whole.body, name)[:b, :b]
        found = getattr(by_sectors.body, name)[:b, :b]
        assert np.abs(of_unit_diagonal(found - expected, expected)).max() < 1e-8


def test_frequencies_agree_fixed_free_and_supported(pair, supports):
    _, _, whole, by_sectors = pair
    assert np.allclose(by_sectors.frequencies, whole.frequencies, rtol=1e-8)
    for held in (0.0 * supports, supports):
        expected, found = (
            sla.eigh(supported(r, held), r.body.mass, eigvals_only=True)
            for r in (whole, by_sectors)
        )
        first = 0 if held.any() else 6
        assert np.allclose(found[first:], expected[first:], rtol=1e-8)
        assert np.abs(found[:first]).max(initial=0.0) < 1e-7 * expected[6]


def test_receptances_agree(pair, supports):
    _, interface, whole, by_sectors = pair
    b = interface.size
    for hertz in (0.0, 37.0, 400.0, 1234.5):
        expected, found = (
            np.linalg.inv(supported(r, supports) - (2 * np.pi * hertz) ** 2 * r.body.mass)[:b, :b]
            for r in (whole, by_sectors)
        )
        scale = np.sqrt(np.abs(np.diag(expected)))
        error = np.abs(found - expected) / scale / scale[:, None]
        assert error.max() < 1e-8 * (np.abs(expected) / scale / scale[:, None]).max()


def test_recovered_fields_agree(pair):
    _, interface, whole, by_sectors = pair
    q = np.zeros((interface.size + MODES, 3))
    q[: interface.size] = np.random.default_rng(2).standard_normal((interface.size, 3))
    expected, found = (r.body.recover(q) for r in (whole, by_sectors))
    assert np.abs(found - expected).max() < 2e-6 * np.abs(expected).max()


def test_error_estimates_agree(pair, supports):
    model, _, whole, by_sectors = pair
    if "tooth_flank_001" in model.fe_mesh.facets:
        lines = tooth_lines(model, [4], 0.1, outward=-1.0)
        loads = [replace(p, node=f"tooth_{int(p.node[6:])}") for p in lines]
    else:
        patch = facet_sample(model, model.fe_mesh.facets["patch_003"])
        forces = np.where(patch.points[:, 2:] > 0.05, [1.0, 2.0, 0.5], 0.0)
        loads = [ProbeLoad("tooth_3", "end", patch, forces)]
    expected, found = (static_errors(probed(r, loads), supports) for r in (whole, by_sectors))
    assert found == pytest.approx(expected, rel=1e-7)
    expected, found = (compare_frequencies(r, supports, 1500.0) for r in (whole, by_sectors))
    assert np.allclose(found.full, expected.full, rtol=1e-8)
    assert found.errors == pytest.approx(expected.errors, abs=1e-8)


def test_the_same_input_gives_the_same_numbers(pair):
    model, interface, _, by_sectors = pair
    sectors = by_sectors.condensation.sectors.count
    again = reduce(model, interface, MODES, sectors=(sectors,)).body
    assert np.array_equal(again.mass, by_sectors.body.mass)
    assert np.array_equal(again.stiffness, by_sectors.body.stiffness)


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
    made = reduce(model, interface, 4, sectors=(TEETH,))
    assert made.body.report["path"] == reason
    assert made.body.report["solver"] == "cholmod"
    assert np.allclose(made.frequencies, reduce(model, interface, 4).frequencies, rtol=1e-12)


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
    made = reduce(model, interface_of(model, ties), 12, sectors=(teeth,))
    values, vectors = sla.eigh(made.body.stiffness, made.body.mass)
    cyclic, b = made.condensation, made.condensation.interface.size
    fields = cyclic.constraint_motion(vectors[:b, 6:40]) + made.fixed_modes @ vectors[b:, 6:40]
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
