"""Gyroscopic terms of rigid members in a flexible stage."""

import numpy as np
import pytest
from turning_ring import cheap, held_case, lumped

from flexgear.analysis.linear_dynamics import whirl_modes
from flexgear.analysis.modes import springs_at
from flexgear.coupling.build import build_system
from flexgear.model.case import validated_case
from flexgear.model.read import Written

POLAR, TILT, SPRING = 9e3, 5e3, 4e8  # of the carrier, kg m², and its support, N m/rad


def whirling(tmp_path, speed):
    """A stage with an elastic ring whose rigid carrier tilts alone: planets and sun are planar, and
    pins give them neither axial force nor moment. Its modes in the carrier's frame."""
    case = lumped(held_case(tmp_path, "ring", "carrier", "sun", speed=speed), "carrier", "sun")
    data = case.model_dump(mode="python")
    data["gyroscopic"] = True
    stage = data["stages"][0]
    for name in ("sun", "planet"):
        stage[name]["kinematics"] = "planar"
    stage["planet_bearing"] |= {"axial": 0.0, "tilt": 0.0, "z": 0.0}
    data["inputs"][0]["inertia"] = 0.0
    stage["carrier"] |= {"inertia": POLAR, "tilt_inertia": TILT, "kinematics": "spatial"}
    stage["carrier"]["support"] |= {"tilt": SPRING}
    case = validated_case(data, "test", Written())
    system = build_system(case, cheap(case))
    stiffness = system.stiffness + springs_at(system).stiffness
    found = whirl_modes(system.mass, stiffness, system.gyroscopic, system.centripetal)
    tilt = system.node_rows("stage.carrier", "stage.carrier")[3:5]
    return system, found, tilt


@pytest.mark.slow
def test_a_carrier_that_spins_on_tilt_springs_whirls_forward_and_backward(tmp_path):
    """In space ω² ∓ (J_p/J_t) Ω ω − k/J_t = 0; axes that turn with it see ω ∓ Ω."""
    speed = 600.0
    system, found, tilt = whirling(tmp_path, speed)
    spin = speed * np.pi / 30
    half, natural = 0.5 * POLAR / TILT * spin, np.sqrt(SPRING / TILT)
    forward, backward = (np.hypot(half, natural) + sign * half for sign in (1, -1))
    shapes = found.shapes
    size = np.sqrt(np.einsum("im,ij,jm->m", shapes.conj(), system.mass, shapes).real)
    alone = np.argsort(np.abs(tilt @ shapes).max(axis=0) / size)[-2:]
    omega = np.sort(2 * np.pi * found.frequencies[alone])
    expected = np.sort([forward - spin, backward + spin])
    np.testing.assert_allclose(omega, expected, rtol=1e-6)
    assert abs(expected[1] - expected[0]) > 1e-4 * natural
