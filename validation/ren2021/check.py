"""Ren et al. 2021: the plain equations by themselves."""

import numpy as np
import pytest

from ren2021.equations import SUN, Stage, Supports, bearings, deflections, matrices
from ren2021.errors import Errors, harmonics
from ren2021.sharing import sharing

STAGE = Stage()


def test_forces_of_the_equations_balance() -> None:
    """Moving everything as one rigid body in the plane or along the axis deflects nothing."""
    for axis in range(3):
        q = np.zeros(matrices(STAGE, Supports()).rows.shape[1])
        for first in (0, 4, 8, SUN):
            q[first + axis] = 1.0
        for i, phi in enumerate(STAGE.angles):
            start = 16 + 4 * i
            along = {0: (np.cos(phi), -np.sin(phi), 0), 1: (np.sin(phi), np.cos(phi), 0)}
            q[start : start + 3] = along.get(axis, (0, 0, 1))
        assert np.abs(deflections(STAGE) @ q).max() < 1e-12
        assert np.abs(bearings(STAGE) @ q).max() < 1e-12


def test_errors_by_geometry_are_displacements() -> None:
    """A carrier off its axis by c is as all other members off by −c: K is that of −c of them."""
    system = matrices(STAGE, Supports(), gyroscopic=False)
    t = np.zeros(1)
    carrier = system.forces(harmonics(STAGE, Errors(carrier=1e-5), "geometry"), t, True)
    others = system.forces(harmonics(STAGE, Errors(sun=1e-5, ring=1e-5), "geometry"), t, True)
    mean = STAGE.mean_force
    np.testing.assert_allclose(carrier - mean, mean - others, atol=1e-6 * mean)
    assert np.abs(carrier - mean).max() > 1e-3 * mean


@pytest.mark.parametrize("signs", ["geometry", "equation 20"])
def test_equal_errors_of_all_planets_in_phase_share_evenly(signs: str) -> None:
    system = matrices(STAGE, Supports(), gyroscopic=False)
    factors = sharing(STAGE, system, Errors(planets=(2e-5,) * 3), signs, True, 50)
    assert factors.momentary == pytest.approx(1.0, abs=1e-9)
