"""Slices that bend each other: complementarity, limits, and a direct minimum of the energy."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls
from train_contexts import rigid_stage

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.laws import COUPLED_SLICES_LAW, SLICES_LAW, respond
from flexgear.coupling.pair_data import OF_LINE
from flexgear.model.load import load_case

COUNT = 15
PLACE = np.linspace(-0.35, 1.35, COUNT)
LOCAL = 2e-9  # m/N


def parameters(flexibility, gap, scale=0.0, limit=1e9, tau=0.0):
    lower = flexibility[np.tril_indices(COUNT)]
    stiffness = 1 / np.diag(flexibility)
    ones = np.ones(COUNT)
    head = [COUNT, tau]
    return np.concatenate([head, PLACE, stiffness, gap, scale * ones, limit * ones, lower])


def flexible(rng, reach):
    """A positive definite matrix that falls off along the face."""
    off = np.abs(PLACE[:, None] - PLACE)
    spread = LOCAL * (np.eye(COUNT) + 0.8 * np.exp(-off / reach))
    return spread * np.outer(*[1 + 0.2 * rng.random(COUNT)] * 2)


def pressed(p, a, b):
    return respond(COUPLED_SLICES_LAW, p, np.array([[a, b], [0.0, 0.0]]))


motions = st.tuples(st.floats(-3e-5, 6e-5), st.floats(-3e-5, 6e-5))


@settings(max_examples=60)
@given(motions, st.integers(0, 1000), st.floats(0.05, 1.0))
def test_without_line_contact_it_is_the_least_of_a_quadratic_energy(motion, seed, reach):
    """min ½ fᵀ C f − xᵀ f over f ≥ 0, by non-negative least squares on the root of C."""
    rng = np.random.default_rng(seed)
    flexibility, gap = flexible(rng, reach), 2e-5 * rng.random(COUNT)
    x = (1 - PLACE) * motion[0] + PLACE * motion[1] - gap
    root = np.linalg.cholesky(flexibility).T
    unit = np.abs(x).max() + 1e-30
    f = nnls(root, np.linalg.solve(root.T, x / unit))[0] * unit
    energy, force, _ = pressed(parameters(flexibility, gap), *motion)
    largest = max(f.sum(), 1e-3)
    assert force[0] == pytest.approx([(1 - PLACE) @ f, PLACE @ f], abs=1e-8 * largest)
    assert energy == pytest.approx(0.5 * x @ f, rel=1e-6, abs=1e-12)


def test_diagonal_flexibility_is_slices_beside_each_other():
    gap = np.linspace(0, 3e-5, COUNT)
    flexibility = np.diag(LOCAL * (1 + np.arange(COUNT)))
    motion = np.array([[3e-5, 1e-5], [0.5, -0.3]])
    both = [
        respond(law, parameters(flexibility, gap, tau=1e-5), motion)
        for law in (SLICES_LAW, COUPLED_SLICES_LAW)
    ]
    for one, two in zip(*both, strict=True):
        np.testing.assert_allclose(two, one, rtol=1e-10, atol=1e-10 * np.abs(one).max())


@pytest.mark.parametrize("approach", [1e-9, 1e-6, 3e-5])
def test_line_contact_closes_by_its_law(approach):
    """With C far stiffer than the line contact, a f ln(d/f) = δ of every slice."""
    scale, limit = 2e-10, 1e8
    p = parameters(np.eye(COUNT) * 1e-16, np.zeros(COUNT), scale, limit)
    _, force, tangent = pressed(p, approach, approach)
    f = force[0].sum() / COUNT
    assert scale * f * np.log(limit / f) + 1e-16 * f == pytest.approx(approach, rel=1e-9)
    slope = COUNT / (scale * (np.log(limit / f) - 1) + 1e-16)
    assert tangent[0].sum() == pytest.approx(slope, rel=1e-6)


def test_a_stage_whose_slices_do_not_bend_each_other_is_that_of_springs():
    case = load_case("wind-5mw").with_(**{"stage.gear_mesh.model": "face_load"})
    springs = rigid_stage(case)
    pairs = springs.system.pairs
    count = int(pairs.slices[0])
    table = pairs.slice_table
    stiffness = table[:, :, OF_LINE + count : OF_LINE + 2 * count]
    lower = np.zeros((*table.shape[:2], count * (count + 1) // 2))
    diagonal = np.cumsum(np.arange(1, count + 1)) - 1
    lower[:, :, diagonal] = 1.0 / np.where(stiffness > 0, stiffness, 1.0)
    contact = [np.zeros_like(stiffness), np.ones_like(stiffness)]
    bending = pairs._replace(
        slice_table=np.concatenate([table, *contact, lower], axis=2),
        bent=np.ones_like(pairs.bent),
    )
    system = springs.system.with_(pairs=bending)
    modal = replace(springs.modal, system=system)
    angles, torque = np.linspace(0.0, 0.1, 3), system.rated_torque
    one, two = (revolution(m, angles, torque) for m in (springs.modal, modal))
    np.testing.assert_allclose(two.pair_load, one.pair_load, atol=2e-6 * one.pair_load.max())
    assert two.closure.max() < 1e-8
