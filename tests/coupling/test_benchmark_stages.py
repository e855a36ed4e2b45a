"""What the benchmarks run on can be made, and their peers find their way through it."""

import numpy as np
import pytest
from benchmarks.integrators import Integrator
from benchmarks.revolution import dense_position, whole_revolution
from benchmarks.stages import planet_system
from coupled import TORQUE

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.start import start_state
from flexgear.coupling.modal import modal_system


@pytest.mark.parametrize("planets", [3, 8])
def test_stages_of_any_number_of_planets_can_be_made(planets):
    assert len(planet_system(planets).pairs.s0) == 4 * planets  # sun and ring, both flanks


def test_an_integrator_may_try_states_far_off():
    """Motion of a thousand times the energy there was is what a first trial step may lead to."""
    modal = modal_system(planet_system(3), 3000.0)
    start = start_state(modal, TORQUE)
    start.velocity[modal.rigid_count] += 1e3 * np.sqrt(2.0 * start.energy_in[0])
    assert np.isfinite(Integrator(modal, TORQUE, "DOP853", 1e-3).run(start, 1e-9)).all()


def test_a_revolution_moves_as_dense_matrices_of_all_coordinates_do():
    system, angles = planet_system(3), np.array([0.1, 0.5])
    modal = modal_system(system, 3000.0)
    sharing, deflections = whole_revolution(modal, angles)
    assert sharing.shape == (2,) and len(deflections) == 2
    motion = Recovery(revolution(modal, angles, TORQUE)).motion(np.eye(system.size))
    expected = np.array([dense_position(system, angle) for angle in angles])
    np.testing.assert_allclose(motion, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
