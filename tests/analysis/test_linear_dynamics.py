"""Whirl modes, the Campbell diagram and harmonic steady states against closed forms."""

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
    campbell,
    crossings,
    direction,
    harmonic_response,
    steady_state,
    whirl_modes,
    whirl_sense,
)
from flexgear.coupling.loads import without_rolling
from flexgear.model.errors import FlexgearError

CORIOLIS = 2 * np.array([[0.0, -1.0], [1.0, 0.0]])
PLANE = np.eye(2)[None]


def point(m=2.0, k=800.0, speed=5.0):
    """Point mass on isotropic springs, in a frame that turns at ``speed``; ω = √(k/m)."""
    return m * np.eye(2), k * np.eye(2), m * speed * CORIOLIS, m * speed**2 * np.eye(2)


def rotor(axial, lateral, k, speed):
    """Tilting of a symmetric disc on an isotropic shaft in fixed axes (no centripetal term)."""
    gyro = speed * axial * np.array([[0.0, 1.0], [-1.0, 0.0]])
    return lateral * np.eye(2), k * np.eye(2), gyro, np.zeros((2, 2))


def test_foucault_splits_into_sum_and_difference():
    m = whirl_modes(*point())
    np.testing.assert_allclose(2 * np.pi * m.frequencies, [20 - 5, 20 + 5], rtol=1e-12)
    sense = whirl_sense(m.shapes, PLANE)
    # a forward circle is overtaken less quickly by axes that turn with it
    np.testing.assert_allclose(sense, [1.0, -1.0], atol=1e-12)
    assert [direction(s) for s in sense] == ["forward", "backward"]


def test_foucault_beyond_the_natural_frequency_is_stable():
    """K − s² C is negative there; Coriolis forces hold the mass all the same."""
    m = whirl_modes(*point(speed=30.0))
    np.testing.assert_allclose(2 * np.pi * m.frequencies, [30 - 20, 30 + 20], rtol=1e-9)
    np.testing.assert_allclose(m.growth, 0.0)
    np.testing.assert_allclose(whirl_sense(m.shapes, PLANE), [-1.0, -1.0], atol=1e-9)


def test_anisotropic_shaft_is_unstable_between_its_critical_speeds():
    """Jeffcott rotor on a shaft of unequal stiffness: λ⁴ + (…)λ² + (ω_x² − Ω²)(ω_y² − Ω²) = 0."""
    speed, w = 20.0, np.array([18.0, 22.0])
    args = (np.eye(2), np.diag(w**2), speed * CORIOLIS, speed**2 * np.eye(2))
    m = whirl_modes(*args)
    b = np.sum(w**2) + 2 * speed**2
    c = np.prod(w**2 - speed**2)
    squared = np.array([-b + np.sqrt(b**2 - 4 * c), -b - np.sqrt(b**2 - 4 * c)]) / 2
    np.testing.assert_allclose(m.growth, [np.sqrt(squared[0]), 0.0], rtol=1e-9)
    np.testing.assert_allclose(2 * np.pi * m.frequencies, [0, np.sqrt(-squared[1])], rtol=1e-9)
    outside = whirl_modes(args[0], args[1], args[2], args[3], 0.5)
    np.testing.assert_allclose(outside.growth, 0.0)


@given(
    axial=st.floats(0.1, 5.0), k=st.floats(1.0, 1e4), speed=st.floats(0.1, 100.0)
)  # fmt: skip
def test_disc_tilting_on_a_shaft(axial, k, speed):
    """ω = ± I_p Ω / 2 I_d + √((I_p Ω / 2 I_d)² + k / I_d): the forward one rises."""
    m = whirl_modes(*rotor(axial, 1.0, k, speed))
    half = axial * speed / 2
    root = np.hypot(half, np.sqrt(k))
    np.testing.assert_allclose(2 * np.pi * m.frequencies, [root - half, root + half], rtol=1e-8)
    np.testing.assert_allclose(whirl_sense(m.shapes, PLANE), [-1.0, 1.0], atol=1e-6)


def test_at_rest_the_plain_modes():
    stage = lin_parker(4)
    f, _ = stage.modes()
    zero = np.zeros_like(stage.mass)
    m = whirl_modes(stage.mass, stage.stiffness, zero, zero, 0.0)
    np.testing.assert_allclose(m.frequencies[1:], f[1:], rtol=1e-9)
    assert m.frequencies[0] == 0.0 and np.all(m.shapes.imag == 0)


def test_whole_stage_against_the_plain_state_space():
    """Residual of the quadratic problem, and ω from an unsymmetric eigenvalue solver."""
    stage = lin_parker(3)
    gyro, centripetal = gyroscopic_terms(stage, 50.0)
    m = whirl_modes(stage.mass, stage.stiffness, gyro, centripetal)
    assert len(m.frequencies) == len(stage.mass)
    w, x = 2 * np.pi * m.frequencies, m.shapes
    k = stage.stiffness - centripetal
    left = k @ x + 1j * (gyro @ x) * w - (stage.mass @ x) * w**2
    assert np.abs(left).max() < 1e-9 * np.abs(stage.stiffness).max() * np.abs(x).max()
    eye, zero = np.eye(len(k)), np.zeros_like(k)
    state = np.block([[zero, eye], [-np.linalg.solve(stage.mass, np.hstack([k, gyro]))]])
    plain = np.sort(np.linalg.eigvals(state).imag)[len(k) :]
    np.testing.assert_allclose(w[1:], plain[1:], rtol=1e-8)
    norm = np.einsum("dm,de,em->m", x.conj(), stage.mass, x)
    np.testing.assert_allclose(norm, 1.0, rtol=1e-10)


def gyroscopic_terms(stage, speed, bodies=(0, 2)):
    """Coriolis and centripetal terms of sun and carrier (and more), in axes of the carrier."""
    size = len(stage.mass)
    gyro, centripetal = np.zeros((size, size)), np.zeros((size, size))
    for i in bodies:
        at = slice(3 * i, 3 * i + 2)
        m = stage.mass[3 * i, 3 * i]
        gyro[at, at], centripetal[at, at] = m * speed * CORIOLIS, m * speed**2 * np.eye(2)
    return gyro, centripetal


def test_rolling_is_neither_driven_nor_held_by_planets_that_orbit():
    """With C on absolute displacements the train would run away; beside rolling it does not."""
    stage = lin_parker(3)
    gyro, centripetal = gyroscopic_terms(stage, 300.0, bodies=(0, 2, 3, 4, 5))
    assert whirl_modes(stage.mass, stage.stiffness, gyro, centripetal).growth.max() > 10.0
    rolling = stage.modes()[1][:, :1]
    rolling = rolling / rolling[8]  # per radian of the carrier
    input_angles = np.eye(len(stage.mass))[8:9]
    beside = without_rolling(centripetal, rolling, input_angles)
    np.testing.assert_allclose(beside @ rolling, 0.0, atol=1e-9 * np.abs(centripetal).max())
    m = whirl_modes(stage.mass, stage.stiffness, gyro, beside)
    assert m.frequencies[0] == 0.0 and not m.growth.any()
    assert m.frequencies[1] > 100.0
    # motion that leaves the carrier's angle alone feels all of C
    free = np.eye(len(stage.mass))[:, 9:11]
    np.testing.assert_allclose(free.T @ beside @ free, free.T @ centripetal @ free)


def test_translational_pairs_split_and_are_tracked():
    stage = lin_parker(3)
    gyro, centripetal = gyroscopic_terms(stage, 400.0)
    factors = np.linspace(0, 1, 21)
    c = campbell(stage.mass, stage.stiffness, gyro, centripetal, factors)
    assert c.frequencies.shape == (21, 18)
    np.testing.assert_allclose(c.frequencies[:, 0], 0.0)
    lowest = c.frequencies[:, 1:3]
    assert abs(np.diff(lowest[0])[0]) < 1e-6 * lowest[0, 0]
    assert abs(np.diff(lowest[-1])[0]) > 1.0
    # tracked frequencies run smoothly: no jump beyond what neighbouring steps show
    bend = np.abs(np.diff(c.frequencies, 2, axis=0)).max(axis=0)
    assert np.all(bend < 0.3 * np.abs(np.diff(c.frequencies, axis=0)).max(axis=0) + 0.5)


def test_modes_that_cross_keep_their_shape():
    """Two uncoupled discs: forward and backward branches cross without being exchanged."""
    a, b = rotor(1.0, 1.0, 1.0e4, 60.0), rotor(0.2, 1.0, 1.44e4, 60.0)
    args = [np.block([[x, np.zeros((2, 2))], [np.zeros((2, 2)), y]]) for x, y in zip(a, b)]  # noqa: B905
    planes = np.stack([np.eye(4)[:2], np.eye(4)[2:]])
    c = campbell(*args, np.linspace(0.05, 1, 40), planes=planes)
    expected = [
        sign * i * 60 * c.factors / 2 + np.hypot(i * 60 * c.factors / 2, np.sqrt(k))
        for i, k in ((1.0, 1e4), (0.2, 1.44e4))
        for sign in (-1, 1)
    ]
    np.testing.assert_allclose(
        sorted((2 * np.pi * c.frequencies.T).tolist()), sorted(np.array(expected).tolist()),
        rtol=1e-9,
    )  # fmt: skip
    np.testing.assert_allclose(np.abs(c.sense), 1.0, atol=1e-9)
    assert np.all(np.sign(c.sense) == np.sign(c.sense[0]))


def test_count_gives_the_lowest():
    stage = lin_parker(3)
    gyro, centripetal = gyroscopic_terms(stage, 100.0)
    args = stage.mass, stage.stiffness, gyro, centripetal
    np.testing.assert_allclose(
        whirl_modes(*args, count=5).frequencies, whirl_modes(*args).frequencies[:5], rtol=1e-9,
        atol=1e-9,
    )  # fmt: skip


def test_crossing_of_a_line_with_foucault():
    """Order n of base f_b meets ω₀ ± sΩ at s = f₀ / (n f_b ∓ Ω/2π)."""
    mass, k, gyro, centripetal = point()
    c = campbell(mass, k, gyro, centripetal, np.linspace(0, 2, 41))
    slopes = [4.0, 8.0]
    found = crossings(c, slopes)
    base, spin = 20 / (2 * np.pi), 5 / (2 * np.pi)
    wanted = sorted(base / (slope - sign * spin) for slope in slopes for sign in (-1, 1))
    np.testing.assert_allclose([x.factor for x in found], wanted, rtol=1e-9)
    for x in found:
        np.testing.assert_allclose(x.frequency, slopes[x.line] * x.factor)


def test_rigid_motion_has_no_crossing_and_a_grid_point_counts_once():
    mass = np.eye(2)
    stiffness = (2 * np.pi * 3.0) ** 2 * np.array([[1.0, -1.0], [-1.0, 1.0]]) / 2
    zero = np.zeros((2, 2))
    c = campbell(mass, stiffness, zero, zero, [0.0, 0.5, 1.0, 1.5])
    found = crossings(c, [3.0])
    assert [(x.mode, x.factor) for x in found] == [(1, 1.0)]


def test_gyroscopic_matrix_must_be_skew():
    with pytest.raises(FlexgearError, match="skew"):
        whirl_modes(np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))


def test_sense_of_a_line_and_of_nothing():
    shapes = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]], dtype=complex)
    sense = whirl_sense(shapes, np.eye(3)[:2][None])
    assert sense[0] == 0 and np.isnan(sense[1]) and direction(sense[1]) == "none"


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
