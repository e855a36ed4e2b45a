"""Radial harmonics of a ring."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexgear.results.time_figures import harmonics, radial_harmonics, star_angle


def ring(z: int) -> np.ndarray:
    return 2 * np.pi * np.arange(z) / z


def radial_field(phi: np.ndarray, u_r: np.ndarray) -> np.ndarray:
    return np.stack([u_r * np.cos(phi), u_r * np.sin(phi), np.zeros_like(phi)], axis=-1)


@pytest.mark.parametrize("z", [93, 92])
def test_known_orders(z):
    phi = ring(z)
    u = 2.0 + 3.0 * np.cos(5 * phi - 0.7) + 0.5 * np.cos(10 * (phi - 0.2))
    c = radial_harmonics(radial_field(phi, u))
    np.testing.assert_allclose(np.abs(c[[0, 5, 10]]), [2.0, 3.0, 0.5], rtol=1e-12)
    np.testing.assert_allclose(np.angle(c[5]), 0.7)
    others = np.delete(np.abs(c), [0, 5, 10])
    assert others.max() < 1e-12


@pytest.mark.parametrize("z", [8, 9])
def test_sum_of_orders_gives_the_shape_back(z):
    values = np.random.default_rng(1).normal(size=z)
    c, phi = harmonics(values), ring(z)
    n = np.arange(len(c))[:, None]
    np.testing.assert_allclose(
        (np.abs(c)[:, None] * np.cos(n * phi - np.angle(c)[:, None])).sum(0), values
    )


@given(turn=st.floats(-10, 10))
def test_star_angle_follows_the_turn(turn):
    phi = ring(93)
    c = harmonics(np.cos(5 * (phi - turn)))
    assert abs(np.exp(5j * (star_angle(c, 5) - turn)) - 1) < 5e-9


def test_rigid_shift_is_order_one():
    c = radial_harmonics(np.tile([3.0, 4.0], (93, 1)))
    np.testing.assert_allclose(np.abs(c[1]), 5.0)
    np.testing.assert_allclose(star_angle(c, 1), np.arctan2(4, 3))


def test_rotation_about_the_axis_has_no_radial_part():
    phi = ring(93)
    tangential = np.stack([-np.sin(phi), np.cos(phi)], axis=-1)
    assert np.abs(radial_harmonics(tangential)).max() < 1e-15
