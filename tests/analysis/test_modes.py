"""Coupled modes up to a limit: those of the whole spectrum, rigid ones first."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import linalg

from flexgear.analysis.modes import modes, springs_at


@pytest.fixture(scope="module")
def every(linear):
    return modes(linear, springs_at(linear, 0.3).stiffness)


@pytest.mark.parametrize("limit", [1e-3, 5.0, 300.0, 2000.0])
def test_modes_up_to_a_limit_are_the_lowest_of_all(linear, every, limit):
    some = modes(linear, springs_at(linear, 0.3).stiffness, limit)
    n = int(np.sum(every.frequencies <= limit))
    assert len(some.frequencies) == n >= 1
    assert some.frequencies[0] == 0.0
    np.testing.assert_allclose(some.frequencies, every.frequencies[:n], rtol=1e-7)
    gram = some.shapes.T @ linear.mass @ some.shapes
    np.testing.assert_allclose(gram, np.eye(n), atol=1e-10)
    np.testing.assert_allclose(np.sum(list(some.energy.values()), axis=0), 1.0, atol=1e-10)


def test_shapes_solve_the_coupled_system(linear):
    contact = springs_at(linear, 0.3).stiffness
    found = modes(linear, contact, limit_hz=1000.0)
    k = linear.stiffness + contact
    force = linear.mass @ found.shapes * (2 * np.pi * found.frequencies) ** 2
    left = linalg.norm(k @ found.shapes - force, axis=0)
    assert left.max() < 1e-8 * np.abs(k).max() * np.abs(found.shapes).max()
