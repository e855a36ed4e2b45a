"""Whirl modes and the Campbell diagram against closed forms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from lumped_stage import lin_parker

from flexgear.analysis.linear_dynamics import (
    campbell,
    crossings,
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
