"""The bundled star-ring: the hand calculation of its comments on a ring that turns with its hub."""

import math

import numpy as np
import pytest
from stage_samples import stiff_stage

from flexgear import load_case, power_flow
from flexgear.model.load import bundled_text

PLANETS, SUN, PLANET, RING = 4, 21, 27, 75
HELIX, TORQUE, SPEED = math.radians(15), 250.0, 3000.0
SUN_DIAMETER = SUN * 2e-3 / math.cos(HELIX)
TANGENTIAL = TORQUE / (PLANETS * SUN_DIAMETER / 2)
AXIAL = TANGENTIAL * math.tan(HELIX)


@pytest.fixture(scope="module")
def model():
    case = load_case("star-ring")
    return case.assemble(bodies=stiff_stage(case.view()))


@pytest.fixture(scope="module")
def static(model):
    return model.static([0.0, 5.0, 77.0])


def of(static, support):
    """Force and moment of a support at every position."""
    return static.bearing_force.sel(support=f"stage.{support}").values


@pytest.mark.parametrize(
    ("printed", "value"),
    [
        ("−75/21 = −3.5714", -RING / SUN),
        ("−3000 / 3.5714 = −840 r/min", -SPEED * SUN / RING),
        ("−3000 × 21/27 = −2333.3 r/min", -SPEED * SUN / PLANET),
        ("3000 / 60 × 21 = 1050 Hz", SPEED / 60 * SUN),
        ("(21 + 27)/2 × 2/cos 15° = 49.693 mm", (SUN + PLANET) / math.cos(HELIX)),
        ("250 / (4 × 21.741 mm) = 2874.8 N", TANGENTIAL),
        ("2874.8 × tan 15° = 770.3 N", AXIAL),
        ("250 N m × 314.16 rad/s = 78.54 kW", TORQUE * SPEED * math.pi / 30 / 1e3),
        ("2874.8/(25 × 43.482) × 48/27 = 4.7 MPa",
         TANGENTIAL / (25e-3 * SUN_DIAMETER) * (SUN + PLANET) / PLANET / 1e6),
    ],
)  # fmt: skip
def test_comments_say_what_the_formulas_give(printed, value):
    assert printed in bundled_text("star-ring")
    number = printed.rpartition("= ")[2].split()[0].replace("−", "-")
    digits = len(number.partition(".")[2])
    assert float(number) == pytest.approx(value, abs=0.5001 * 10.0**-digits)


def test_the_ring_turns_backwards_and_the_carrier_takes_the_sum():
    flow = power_flow(load_case("star-ring"))
    assert flow.speed["stage.ring"] == pytest.approx(-SPEED * SUN / RING * math.pi / 30)
    assert flow.speed["stage.carrier"] == 0.0
    assert flow.torque["stage.ring"] == pytest.approx(TORQUE * RING / SUN)
    assert flow.torque["stage.carrier"] == pytest.approx(-TORQUE * (1 + RING / SUN))
    stage = flow.stage("stage")
    assert stage.gear_mesh_frequency == pytest.approx(SPEED / 60 * SUN)
    for force in (stage.sun_working_force, stage.ring_working_force):
        assert abs(force) == pytest.approx(TANGENTIAL)


def test_equilibrium_is_that_of_the_hand_calculation(static):
    """Normal forces make up the torque; the knuckle takes the carrier's, the hub's bearing the
    ring's thrust, opposite to that of the sun."""
    assert static.closure.max() < 1e-9
    mean = np.abs(static.gear_mesh_force.values).reshape(3, 2, PLANETS).mean(axis=2)
    normal = TANGENTIAL / math.cos(math.radians(20)) / math.cos(HELIX)
    assert mean == pytest.approx(normal, rel=1e-9)
    knuckle = of(static, "carrier_drive")
    assert np.abs(knuckle[:, 5]) == pytest.approx(TORQUE * (1 + RING / SUN), rel=1e-9)
    sun = of(static, "output")[:, 2]
    assert np.abs(sun) == pytest.approx(PLANETS * AXIAL, rel=1e-9)


def test_a_short_run_turns_the_ring(model):
    run = model.transient(duration=2e-3)
    turned = run.ring_angle.values[-1, 0] - run.ring_angle.values[0, 0]
    span = float(run.time.values[-1] - run.time.values[0])
    assert turned == pytest.approx(-SPEED * SUN / RING * math.pi / 30 * span, rel=1e-3)
    assert np.ptp(run.carrier_angle.values) < 1e-3 * abs(turned)
