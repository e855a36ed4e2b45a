"""Craig-Bampton reduction, as a whole and by sectors, against the unreduced model with the same
ties and supports."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sla
import scipy.sparse as sp
from cyclic_samples import fixed_frequencies, plain_ring, some_supports
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_meshes import box, rigid_modes
from scipy.sparse.linalg import eigsh, spsolve

from flexgear.model.errors import FlexgearError
from flexgear.structures.estimate import (
    ProbeLoad,
    static_errors,
    with_probe_loads,
)
from flexgear.structures.fem.assembly import FeModel, facet_sample
from flexgear.structures.fem.ties import averaging_tie, interface_of, rigid_tie
from flexgear.structures.frequency_check import compare_frequencies
from flexgear.structures.reduction import reduce

STEEL = (210e9, 0.3, 7850.0)


pytestmark = pytest.mark.usefixtures("one_thread")
TEETH = 8
MODES = 24
PATHS = {  # options of the ring, numbers of sectors, path
    "whole": ({"teeth": TEETH}, (), "general: sectors not asked for"),
    "sectors": ({"teeth": TEETH}, (TEETH,), "cyclic: 8 sectors, 5 harmonics"),
    # as carriers have them: borders as large as their sectors, and few nodes
    "few sectors": ({"teeth": 5, "radial": 3, "axial": 3}, (5,), "cyclic: 5 sectors, 3 harmonics"),
}


@pytest.fixture(scope="module", params=PATHS)
def ring(request):
    options, sectors, path = PATHS[request.param]
    model, interface = plain_ring(**options)
    reduction = reduce(model, interface, MODES, sectors=sectors)
    assert reduction.body.report["path"] == path
    if sectors:  # both kinds of borders are tried
        assert reduction.condensation.has_short_borders == (request.param == "sectors")
    return model, interface, reduction


def on_dofs(ring, field):
    """A field of the condensation on the mesh's dofs."""
    model, _, reduction = ring
    return reduction.condensation.dofs_of(field, model.dofs)


@pytest.fixture(scope="module")
def supports(ring):
    return some_supports(ring[1])


@pytest.fixture(scope="module")
def supported(ring, supports):
    """Full K + B^T S B and M."""
    model, interface, _ = ring
    b = interface.rows
    return (model.stiffness + b.T @ sp.csr_matrix(supports) @ b).tocsc(), model.mass.tocsc()


def test_identity_on_the_interface_and_orthonormal_fixed_modes(ring):
    model, interface, reduction = ring
    b, phi = interface.rows, on_dofs(ring, reduction.fixed_modes)
    psi = on_dofs(ring, reduction.condensation.constraint_motion(np.eye(interface.size)))
    assert np.abs(b @ psi - np.eye(interface.size)).max() < 1e-10
    assert np.abs(b @ phi).max() < 1e-10 * np.abs(phi).max()
    assert np.abs(phi.T @ (model.mass @ phi) - np.eye(reduction.body.n_modes)).max() < 1e-10
    basis, scale = np.hstack([psi, phi]), np.sqrt(np.diag(reduction.body.mass))
    error = reduction.body.mass - basis.T @ (model.mass @ basis)
    assert np.abs(error / scale / scale[:, None]).max() < 1e-8


def test_stiffness_is_the_schur_complement_of_the_ties(ring):
    model, interface, reduction = ring
    b = interface.rows.toarray()
    bordered = np.block([[model.stiffness.toarray(), b.T], [b, np.zeros((len(b), len(b)))]])
    right = np.vstack([np.zeros((model.dofs, len(b))), np.eye(len(b))])
    solution = np.linalg.solve(bordered, right)
    expected = -solution[model.dofs :]
    scale = np.sqrt(np.diag(expected))
    error = (reduction.condensation.stiffness - expected) / scale / scale[:, None]
    assert np.abs(error).max() < 1e-7
    psi = on_dofs(ring, reduction.condensation.constraint_motion(np.eye(interface.size)))
    assert np.abs(psi - solution[: model.dofs]).max() < 1e-7


def test_fixed_modes_are_all_the_lowest_of_the_constrained_problem(ring):
    model, interface, reduction = ring
    free = sla.null_space(interface.rows.toarray())
    values = sla.eigh(
        free.T @ (model.stiffness @ free), free.T @ (model.mass @ free), eigvals_only=True
    )
    lowest = values[: reduction.body.n_modes]
    assert np.allclose(fixed_frequencies(reduction), np.sqrt(lowest) / 2 / np.pi, rtol=1e-8)


def test_six_rigid_modes_and_the_mass_of_the_body_are_kept(ring):
    model, _, reduction = ring
    body = reduction.body
    rigid = body.rigid_modes()
    scale = np.sqrt(np.diag(body.stiffness))
    force = (body.stiffness @ rigid) / scale[:, None]
    assert np.abs(force).max() < 1e-9 * np.abs(scale).max()
    values = sla.eigh(body.stiffness, body.mass, eigvals_only=True)
    assert np.abs(values[:6]).max() < 1e-7 * values[6]
    full = rigid_modes(model)
    assert np.allclose(rigid.T @ body.mass @ rigid, full.T @ (model.mass @ full), atol=1e-6)


@pytest.mark.parametrize("held", [False, True], ids=["free", "supported"])
def test_frequencies_never_below_the_full_ones_and_never_rising_with_modes(ring, supports, held):
    model, interface, reduction = ring
    k = model.stiffness.toarray()
    if held:
        k = k + interface.rows.T @ supports @ interface.rows
    full = sla.eigh(k, model.mass.toarray(), eigvals_only=True)[6:30]
    stiffness = reduction.body.stiffness.copy()
    if held:
        stiffness[: interface.size, : interface.size] += supports
    before = np.full(24, np.inf)
    for modes in range(0, MODES + 1, 6):
        d = interface.size + modes
        now = sla.eigh(stiffness[:d, :d], reduction.body.mass[:d, :d], eigvals_only=True)[6:30]
        assert np.all(now >= full * (1 - 1e-8))
        assert np.all(now <= before * (1 + 1e-10))
        before = now


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_interface_load_moves_the_reduced_body_as_the_full_one(ring, supports, supported, seed):
    model, interface, reduction = ring
    load = np.random.default_rng(seed).standard_normal(interface.size)
    u = spsolve(supported[0], interface.rows.T @ load)
    stiffness = reduction.body.stiffness.copy()
    stiffness[: interface.size, : interface.size] += supports
    q = np.linalg.solve(stiffness, np.concatenate([load, np.zeros(reduction.body.n_modes)]))
    assert np.allclose(q[: interface.size], interface.rows @ u, rtol=1e-6, atol=1e-9 * abs(q).max())
    field = reduction.body.recover(q)
    assert (
        np.abs(field - u.reshape(-1, 3)[: len(model.fe_mesh.points)]).max() < 1e-5 * np.abs(u).max()
    )


def test_recovery_of_a_large_rigid_rotation_is_exact(ring):
    model, _, reduction = ring
    turn = reduction.body.rigid_modes() @ np.array([0.1, 0, 0, 0, 0, 1e3])
    field = reduction.body.recover(turn)
    points = model.fe_mesh.points
    expected = np.column_stack([0.1 - 1e3 * points[:, 1], 1e3 * points[:, 0], 0 * points[:, 2]])
    assert np.abs(field - expected).max() < 1e-9
    assert reduction.body.recover(np.column_stack([turn, turn])).shape == (len(points), 3, 2)


def test_supported_solve_of_the_estimates_equals_a_direct_one(ring, supports, supported):
    model, _, reduction = ring
    f = np.random.default_rng(1).standard_normal((model.dofs, 3))
    exact = spsolve(supported[0], f)
    solved = reduction.condensation.supported_solve(reduction.condensation.field_of(f), supports)
    assert np.allclose(on_dofs(ring, solved), exact, atol=1e-8 * np.abs(exact).max())


def test_static_comparison_equals_the_unreduced_solution(ring, supports, supported):
    model, interface, reduction = ring
    patch = facet_sample(model, model.fe_mesh.facets["patch_003"])
    near_end = patch.points[:, 2] > 0.05
    forces = np.zeros((len(patch.points), 3))
    forces[near_end] = [1.0, 2.0, 0.5]
    load = ProbeLoad("tooth_3", "end", patch, forces)
    node = interface.node_names.index("tooth_3")
    u = spsolve(supported[0], patch.load(forces))
    full = (interface.rows @ u)[6 * node : 6 * node + 3]
    wrench = np.zeros(interface.size)
    wrench[6 * node : 6 * node + 6] = load.wrench(interface.positions[node])
    q = np.linalg.solve(reduction.condensation.stiffness + supports, wrench)
    expected = np.linalg.norm(full - q[6 * node : 6 * node + 3]) / np.linalg.norm(full)
    errors = static_errors(with_probe_loads(reduction, [load]), supports)
    assert errors == {"end": pytest.approx(expected, rel=1e-6)}
    assert (
        static_errors(with_probe_loads(reduction, [load]), 0 * supports) == {}
    )  # a free body has no answer
    assert expected > 1e-4


def test_frequency_comparison_knows_the_full_frequencies(ring, supports, supported):
    _, _, reduction = ring
    comparison = compare_frequencies(reduction, supports, 1500.0)
    values = eigsh(supported[0], 40, supported[1], sigma=0, return_eigenvectors=False)
    exact = np.sort(np.sqrt(values)) / 2 / np.pi
    exact = exact[exact < 1500.0]
    assert len(comparison.full) == len(exact) > 8
    assert np.allclose(comparison.full, exact, rtol=1e-4)
    assert comparison.errors.max() == pytest.approx(
        np.max(comparison.reduced / exact - 1), abs=1e-4
    )


def test_rigid_ties_keep_rigid_motion_and_stiffen_the_body():
    averaged = reduce(*plain_ring(TEETH), 6)
    model, interface = plain_ring(TEETH, teeth_tie=rigid_tie)
    reduction = reduce(model, interface, 6)
    psi = reduction.condensation.constraint_motion(np.eye(interface.size))
    assert np.abs(interface.rows @ psi - np.eye(interface.size)).max() < 1e-9
    values = sla.eigh(reduction.body.stiffness, reduction.body.mass, eigvals_only=True)
    soft = sla.eigh(averaged.body.stiffness, averaged.body.mass, eigvals_only=True)
    assert np.abs(values[:6]).max() < 1e-7 * values[6]
    assert np.all(values[6:12] > soft[6:12])


def test_progress_names_stages_and_ends_at_one():
    model = FeModel(box((4, 2, 2)), *STEEL)
    ties = [
        averaging_tie(p, model.fe_mesh.points[f].mean((0, 1)), facet_sample(model, f))
        for p, f in model.fe_mesh.facets.items()
        if p in ("x0", "x1")
    ]
    heard = []
    body = reduce(model, interface_of(model, ties), 5, lambda s, f: heard.append((s, f))).body
    assert {s for s, _ in heard} >= {"factorisation", "constraint modes", "fixed-interface modes"}
    assert all(0 <= f <= 1 for _, f in heard)
    assert body.node_slice("x1") == slice(6, 12)
    assert body.with_(name="other").name == "other"
    with pytest.raises(KeyError, match="x7"):
        body.node_slice("x7")


def test_two_nodes_on_one_patch_are_refused():
    model = FeModel(box((4, 2, 2)), *STEEL)
    sample = facet_sample(model, model.fe_mesh.facets["x0"])
    ties = [averaging_tie(n, np.zeros(3), sample) for n in ("a", "b")]
    with pytest.raises(FlexgearError, match="same points"):
        reduce(model, interface_of(model, ties), 2)


def test_a_mesh_in_two_pieces_is_refused():
    one = box((3, 1, 1))
    two = replace(
        one,
        points=np.concatenate([one.points, one.points + [5.0, 0, 0]]),
        cells=np.concatenate([one.cells, one.cells + len(one.points)]),
    )
    model = FeModel(two, *STEEL)
    ties = [
        averaging_tie(p, model.fe_mesh.points[f].mean((0, 1)), facet_sample(model, f))
        for p, f in one.facets.items()
        if p in ("x0", "x1")
    ]
    with pytest.raises(FlexgearError, match="piece"):
        reduce(model, interface_of(model, ties), 2)
