"""Whirl modes, the Campbell diagram and harmonic steady states against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lumped_stage import lin_parker
from scipy.integrate import solve_ivp

from flexgear.analysis.linear_dynamics import (
    campbell,
    crossings,
    harmonic_response,
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


def test_whirl_modes_at_rest_are_the_plain_modes():
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
    points = crossings(c, slopes)
    base, spin = 20 / (2 * np.pi), 5 / (2 * np.pi)
    factors = sorted(base / (slope - sign * spin) for slope in slopes for sign in (-1, 1))
    np.testing.assert_allclose([x.factor for x in points], factors, rtol=1e-9)
    for x in points:
        np.testing.assert_allclose(x.frequency, slopes[x.line] * x.factor)


def test_rigid_motion_has_no_crossing_and_a_grid_point_counts_once():
    mass = np.eye(2)
    stiffness = (2 * np.pi * 3.0) ** 2 * np.array([[1.0, -1.0], [-1.0, 1.0]]) / 2
    zero = np.zeros((2, 2))
    c = campbell(mass, stiffness, zero, zero, [0.0, 0.5, 1.0, 1.5])
    points = crossings(c, [3.0])
    assert [(x.mode, x.factor) for x in points] == [(1, 1.0)]


def test_gyroscopic_matrix_must_be_skew():
    with pytest.raises(FlexgearError, match="skew"):
        whirl_modes(np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))


def test_sense_of_a_line_and_of_nothing():
    shapes = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]], dtype=complex)
    sense = whirl_sense(shapes, np.eye(3)[:2][None])
    assert sense[0] == 0 and np.isnan(sense[1])


@given(w=st.floats(0.1, 50.0), c=st.floats(0.1, 10.0), phase=st.floats(-3, 3))
def test_one_degree_of_freedom(w, c, phase):
    """x = f / √((k − mω²)² + (cω)²), behind the force by atan2(cω, k − mω²)."""
    m, k = 2.0, 300.0
    f = 5.0 * np.exp(1j * phase)
    q = harmonic_response(np.eye(1) * m, np.eye(1) * c, np.eye(1) * k, [w], np.array([[f]]))
    size = 5.0 / np.hypot(k - m * w * w, c * w)
    angle = phase - np.arctan2(c * w, k - m * w * w)
    np.testing.assert_allclose(q[0, 0], size * np.exp(1j * angle), rtol=1e-10)


def rolling(stage):
    """The rigid motion of the stage, by its zero frequency."""
    return stage.modes()[1][:, :1]


def damping_of(stage, ratio=0.03):
    """C = M Φ diag(2ζω) Φᵀ M of the whole stage: nothing on rigid motion."""
    f, shapes = stage.modes()
    left = stage.mass @ shapes[:, 1:]
    return (left * (4 * np.pi * ratio * f[1:])) @ left.T


def harmonic_loads(stage, omega, seed=1):
    """Loads (d, K) on every coordinate, real ones at rest, balanced there."""
    rng = np.random.default_rng(seed)
    loads = rng.normal(size=(len(stage.mass), len(omega), 2)) @ [1.0, 1.0j]
    rigid, mean = rolling(stage)[:, 0], omega == 0
    loads[:, mean] = loads[:, mean].real
    loads[:, mean] -= np.outer(stage.mass @ rigid, rigid @ loads[:, mean])
    return 1e3 * loads


def test_whole_stage_with_free_rolling_against_time_integration():
    """Started in the steady state, an ODE solver must stay in it over many periods."""
    stage, omega = lin_parker(3, ring_torsion=1e9), np.array([0.0, 12.0, 700.0, 5200.0])
    loads, damping = harmonic_loads(stage, omega), damping_of(stage)
    q = harmonic_response(stage.mass, damping, stage.stiffness, omega, loads, rolling(stage))
    d, inverse = len(stage.mass), np.linalg.inv(stage.mass)

    def rate(t, y):
        force = (loads @ np.exp(1j * omega * t)).real
        return np.concatenate(
            [y[d:], inverse @ (force - damping @ y[d:] - stage.stiffness @ y[:d])]
        )

    start, end = np.concatenate([q, 1j * omega * q]).sum(axis=1).real, 0.02
    run = solve_ivp(rate, (0, end), start, method="DOP853", rtol=1e-10, atol=1e-14)
    exact = (q @ np.exp(1j * omega * end)).real
    np.testing.assert_allclose(run.y[:d, -1], exact, atol=1e-6 * np.abs(q).max())


def test_slow_excitation_of_a_train_that_rolls_loses_no_digits():
    """At 1e-3 rad/s strains are quasi-static: those of ω = 0 under the same loads."""
    stage, omega = lin_parker(4), np.array([0.0, 1e-3])
    loads = harmonic_loads(stage, np.zeros(1)) @ np.ones((1, 2))
    zero = np.zeros_like(stage.mass)
    q = harmonic_response(stage.mass, zero, stage.stiffness, omega, loads, rolling(stage))
    closing = stage.rows @ q
    np.testing.assert_allclose(
        closing[:, 1], closing[:, 0], rtol=1e-7, atol=1e-9 * np.abs(closing).max()
    )


@pytest.mark.parametrize(
    ("stiffness", "omega", "load", "rigid", "text"),
    [
        ([[1, -1], [-1, 1]], 0.0, [1, 0], [[1], [1]], "not balanced"),
        ([[1, 0], [0, 1]], 1.0, [1, 1], [[1], [1]], "resists"),
        ([[1, -1], [-1, 1]], 0.0, [1, -1], None, "no steady state"),
        ([[1, -1], [-1, 1]], np.sqrt(2), [1, -1], None, "no steady state"),
    ],
)
def test_a_response_without_steady_state_is_refused(stiffness, omega, load, rigid, text):
    """Mean loads that do work on rolling, rolling that is none, or is not named; a resonance."""
    load, rigid = np.array(load)[:, None] + 0j, None if rigid is None else np.array(rigid, float)
    with pytest.raises(FlexgearError, match=text):
        harmonic_response(
            np.eye(2), np.zeros((2, 2)), np.array(stiffness, float), [omega], load, rigid
        )
