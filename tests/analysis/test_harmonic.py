"""Harmonic steady state against closed forms, time integration and balances."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lumped_stage import lin_parker
from scipy.integrate import solve_ivp

from flexgear.analysis.linear_dynamics import (
    GearMeshRows,
    SteadyState,
    harmonic_response,
    steady_state,
)
from flexgear.model.errors import FlexgearError


@given(w=st.floats(0.1, 50.0), c=st.floats(0.1, 10.0), phase=st.floats(-3, 3))
def test_one_degree_of_freedom(w, c, phase):
    """x = f / √((k − mω²)² + (cω)²), behind the force by atan2(cω, k − mω²)."""
    m, k = 2.0, 300.0
    f = 5.0 * np.exp(1j * phase)
    q = harmonic_response(np.eye(1) * m, np.eye(1) * c, np.eye(1) * k, [w], np.array([[f]]))
    size = 5.0 / np.hypot(k - m * w * w, c * w)
    angle = phase - np.arctan2(c * w, k - m * w * w)
    np.testing.assert_allclose(q[0, 0], size * np.exp(1j * angle), rtol=1e-10)


def test_absorber_stands_still_at_its_own_frequency():
    """Two masses, the second tuned to the excitation: the first rests, the second carries −f."""
    k2, m2 = 50.0, 0.5
    w = np.sqrt(k2 / m2)
    mass, stiffness = np.diag([3.0, m2]), np.array([[400 + k2, -k2], [-k2, k2]])
    q = harmonic_response(mass, np.zeros((2, 2)), stiffness, [w], np.array([[7.0 + 0j], [0.0]]))
    np.testing.assert_allclose(q[:, 0], [0.0, -7.0 / k2], atol=1e-12)


def test_gear_pair_under_transmission_error():
    """Two free gears: δ = V q + e obeys δ̈ + 2ζω₀ δ̇ + ω₀² δ = ë, F = k δ + c δ̇ (+ mean load)."""
    j1, j2, r1, r2, k, c = 0.02, 0.3, 0.05, 0.15, 2e8, 4e3
    v = np.array([[-r1, -r2]])
    equivalent = 1 / (r1**2 / j1 + r2**2 / j2)
    w, e = np.array([0.0, 900.0, 6000.0]), np.array([[1e-5, 2e-5j, -3e-6]])
    mean = 1500.0
    loads = np.zeros((2, 3))
    loads[:, 0] = mean * v[0]  # external torques that press the flanks together
    rigid = np.array([[r2], [-r1]])
    s = steady_state(
        np.diag([j1, j2]), np.zeros((2, 2)), np.zeros((2, 2)),
        GearMeshRows(v, np.array([k]), np.array([c])), w, e, loads, rigid,
    )  # fmt: skip
    x = -(w**2) * e[0] / (k / equivalent - w**2 + 1j * w * c / equivalent)
    wanted = (k + 1j * w * c) * x
    wanted[0] = mean
    np.testing.assert_allclose(s.forces[0], wanted, rtol=1e-9)
    # and q stays clear of the rigid motion on average
    assert abs(rigid[:, 0] @ np.diag([j1, j2]) @ s.motion[:, 0]) < 1e-12


def stage_excitation(stage, seed=1):
    """Errors of slow and fast kinds at every gear mesh and an input torque that varies."""
    rng = np.random.default_rng(seed)
    n = len(stage.rows)
    omega = np.array([0.0, 12.0, 700.0, 5200.0])
    errors = 1e-5 * (rng.normal(size=(n, 4)) + 1j * rng.normal(size=(n, 4)))
    errors[:, 0] = errors[:, 0].real
    loads = np.zeros((len(stage.mass), 4), dtype=complex)
    loads[2, 0], loads[2, 2] = -300.0, 20.0 - 5.0j
    loads[8, 0] = 300.0 * 2 * 0.137515 / 0.03871 / 2 + 300.0  # carrier balances the sun
    return omega, errors, loads


def rolling(stage):
    """The rigid motion of the stage, by its zero frequency."""
    return stage.modes()[1][:, :1]


def damping_of(stage, ratio=0.03):
    """C = M Φ diag(2ζω) Φᵀ M of the whole stage: nothing on rigid motion."""
    f, shapes = stage.modes()
    left = stage.mass @ shapes[:, 1:]
    return (left * (4 * np.pi * ratio * f[1:])) @ left.T


def test_whole_stage_with_free_rolling_against_time_integration():
    """Started in the steady state, an ODE solver must stay in it over many periods."""
    stage = lin_parker(3, ring_torsion=1e9)
    omega, errors, loads = stage_excitation(stage)
    rigid = rolling(stage)
    loads[:, 0] -= stage.mass @ rigid[:, 0] * (rigid[:, 0] @ loads[:, 0])  # exact balance
    damping = damping_of(stage)
    c = np.full(len(stage.rows), 2e3)
    meshes = GearMeshRows(stage.rows, stage.gear_mesh_stiffness, c)
    s = steady_state(
        stage.mass, damping, stage.support, meshes, omega, errors, loads, rigid
    )  # fmt: skip
    v, k = stage.rows, stage.gear_mesh_stiffness
    d = len(stage.mass)
    inverse = np.linalg.inv(stage.mass)

    def rate(t, y):
        q, p = y[:d], y[d:]
        turn = np.exp(1j * omega * t)
        e, de = (errors @ turn).real, (1j * omega * errors @ turn).real
        force = k * (v @ q + e) + c * (v @ p + de)
        a = inverse @ ((loads @ turn).real - damping @ p - stage.support @ q - v.T @ force)
        return np.concatenate([p, a])

    start = np.concatenate([s.motion.sum(axis=1).real, (1j * s.omega * s.motion).sum(axis=1).real])
    end = 0.02
    run = solve_ivp(rate, (0, end), start, method="DOP853", rtol=1e-10, atol=1e-14)
    q, p = run.y[:d, -1], run.y[d:, -1]
    turn = np.exp(1j * omega * end)
    force = k * (v @ q + (errors @ turn).real)
    force += c * (v @ p + (1j * omega * errors @ turn).real)
    scale = np.abs(s.forces).max()
    np.testing.assert_allclose(s.forces_at([end])[0], force, atol=1e-6 * scale)
    np.testing.assert_allclose(
        (s.motion @ np.exp(1j * s.omega * end)).real, q, atol=1e-6 * np.abs(s.motion).max()
    )


def test_slow_excitation_of_a_train_that_rolls_loses_no_digits():
    """At 1e-3 rad/s gear-mesh forces are quasi-static: those of ω = 0 under the same errors."""
    stage = lin_parker(4)
    _, errors, _ = stage_excitation(stage)
    meshes = GearMeshRows(stage.rows, stage.gear_mesh_stiffness, np.zeros(8))
    zero, rigid = np.zeros_like(stage.mass), rolling(stage)
    e = errors[:, [0, 0]].real
    s = steady_state(stage.mass, zero, stage.support, meshes, [0.0, 1e-3], e, rigid=rigid)
    np.testing.assert_allclose(s.forces[:, 1], s.forces[:, 0], rtol=1e-7, atol=1e-6)
    # with no torque on a free train, the sun gear meshes hold no torque together
    assert abs(s.forces[4:, 0].sum()) < 1e-8 * np.abs(s.forces).max()


def test_linearity_and_sum_of_frequencies():
    stage = lin_parker(3)
    omega, errors, loads = stage_excitation(stage)
    keep, rigid = [1, 2, 3], rolling(stage)
    meshes = GearMeshRows(stage.rows, stage.gear_mesh_stiffness, np.full(6, 1e3))
    args = stage.mass, damping_of(stage), stage.support, meshes
    whole = steady_state(*args, omega[keep], errors[:, keep], loads[:, keep], rigid)
    only = [
        steady_state(*args, omega[[i]], errors[:, [i]], loads[:, [i]], rigid) for i in keep
    ]  # fmt: skip
    t = np.linspace(0, 0.1, 7)
    np.testing.assert_allclose(whole.forces_at(t), sum(o.forces_at(t) for o in only), atol=1e-9)


def test_power_in_is_power_lost():
    """Mean power of errors and loads = mean power of dampers: ½ Re Σ … over amplitudes."""
    stage = lin_parker(3)
    omega, errors, loads = (x[..., 2:3] for x in stage_excitation(stage))
    damping, c = damping_of(stage), np.full(6, 3e3)
    meshes = GearMeshRows(stage.rows, stage.gear_mesh_stiffness, c)
    s = steady_state(
        stage.mass, damping, stage.support, meshes, omega, errors, loads, rolling(stage)
    )
    w, q = omega[0], s.motion[:, 0]
    rate = 1j * w * q
    from_loads = 0.5 * np.real(rate.conj() @ loads[:, 0])
    from_errors = 0.5 * np.real((1j * w * errors[:, 0]).conj() @ s.forces[:, 0])
    closing = 1j * w * (stage.rows @ q + errors[:, 0])
    lost = 0.5 * np.real(rate.conj() @ damping @ rate) + 0.5 * np.sum(c * np.abs(closing) ** 2)
    np.testing.assert_allclose(from_loads + from_errors, lost, rtol=1e-9)


def test_gyroscopic_damping_is_allowed():
    """Circular forcing of a point mass in turning axes: x = f / (k − m (ω + Ω)²)."""
    m, k, spin, w = 2.0, 800.0, 5.0, 11.0
    gyro = 2 * m * spin * np.array([[0.0, -1.0], [1.0, 0.0]])
    q = harmonic_response(
        m * np.eye(2), gyro, (k - m * spin**2) * np.eye(2), [w], np.array([[1.0], [-1j]])
    )
    np.testing.assert_allclose(q[:, 0], np.array([1.0, -1j]) / (k - m * (w + spin) ** 2))


def test_unbalanced_mean_load_is_refused():
    mass, k = np.eye(2), np.array([[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(FlexgearError, match="not balanced"):
        harmonic_response(mass, 0 * k, k, [0.0], np.array([[1.0], [0.0]]) + 0j, np.ones((2, 1)))


def test_unnamed_rigid_motion_and_undamped_resonance_are_refused():
    k = np.array([[1.0, -1.0], [-1.0, 1.0]])
    load = np.array([[1.0], [-1.0]]) + 0j
    for w in (0.0, np.sqrt(2)):
        with pytest.raises(FlexgearError, match="no steady state"):
            harmonic_response(np.eye(2), 0 * k, k, [w], load)


def test_rigid_motion_that_is_none_is_refused():
    with pytest.raises(FlexgearError, match="resists"):
        harmonic_response(np.eye(2), np.zeros((2, 2)), np.eye(2), [1.0], np.ones((2, 1)) + 0j,
                          np.ones((2, 1)))  # fmt: skip


def test_forces_in_time():
    t = np.linspace(0, 1, 5)
    state = SteadyState(np.array([0.0, 3.0]), np.zeros((0, 2)), np.array([[1.0, 2.0j]]))
    x = state.forces_at(t)
    np.testing.assert_allclose(x[:, 0], 1.0 - 2.0 * np.sin(3 * t))
