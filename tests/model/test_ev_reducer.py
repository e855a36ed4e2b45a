"""The bundled ev-reducer: the hand calculation of its comments, and what follows from the case."""

import math

import numpy as np
import pytest
from stage_samples import stiff_stage

from flexgear import load_case, power_flow
from flexgear.coupling.pace import case_pace
from flexgear.model.load import bundled_text

PLANETS, SUN, PLANET, RING = 4, 23, 33, 89
HELIX, TORQUE, SPEED = math.radians(15), 200.0, 8000.0
RATIO = 1 + RING / SUN
SUN_DIAMETER = SUN * 1.5e-3 / math.cos(HELIX)
PLANET_DIAMETER = PLANET * 1.5e-3 / math.cos(HELIX)
TANGENTIAL = TORQUE / (PLANETS * SUN_DIAMETER / 2)
AXIAL = TANGENTIAL * math.tan(HELIX)
NORMAL = TANGENTIAL / math.cos(math.radians(20)) / math.cos(HELIX)
FREQUENCY = SPEED / RATIO / 60 * RING


@pytest.fixture(scope="module")
def case():
    return load_case("ev-reducer")


@pytest.fixture(scope="module")
def model(case):
    """Ring and carrier stiff, of the size of the case."""
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
        ("1 + 89/23 = 4.8696", RATIO),
        ("8000 / 4.8696 = 1642.9 r/min", SPEED / RATIO),
        ("1642.9 × 89/33 = 4430.7 r/min", SPEED / RATIO * RING / PLANET),
        ("1642.9 / 60 × 89 = 2436.9 Hz", FREQUENCY),
        ("200 N m × 837.76 rad/s = 167.55 kW", TORQUE * SPEED * math.pi / 30 / 1e3),
        ("carrier 200 × 4.8696 = 973.9 N m", TORQUE * RATIO),
        ("1.5 / cos 15° = 1.55291 mm", 1.5 / math.cos(HELIX)),
        ("(35.717 + 51.246)/2 = 43.482 mm", (SUN_DIAMETER + PLANET_DIAMETER) / 2 * 1e3),
        ("200 / (4 × 17.858 mm) = 2799.8 N", TANGENTIAL),
        ("2799.8 × tan 15° = 750.2 N", AXIAL),
        ("750.2 N × 51.246 mm = 38.4 N m", AXIAL * PLANET_DIAMETER),
        ("2799.8/(30 × 35.717) × 56/33 = 4.4 MPa",
         TANGENTIAL / (30e-3 * SUN_DIAMETER) * (SUN + PLANET) / PLANET / 1e6),
    ],
)  # fmt: skip
def test_comments_say_what_the_formulas_give(printed, value):
    assert printed in bundled_text("ev-reducer")
    number = printed.rpartition("= ")[2].split()[0]
    digits = len(number.partition(".")[2])
    assert float(number) == pytest.approx(value, abs=0.5001 * 10.0**-digits)


def test_speeds_torques_and_forces(case):
    flow = power_flow(case)
    stage = flow.stage("stage")
    assert flow.speed["stage.carrier"] == pytest.approx(SPEED / RATIO * math.pi / 30)
    planets = -SPEED / RATIO * RING / PLANET * math.pi / 30
    assert stage.planet_relative_speed == pytest.approx(planets)
    assert stage.gear_mesh_frequency == pytest.approx(FREQUENCY)
    assert flow.torque["stage.carrier"] == pytest.approx(-TORQUE * RATIO)
    assert flow.torque["stage.ring"] == pytest.approx(TORQUE * (RATIO - 1))
    for force in (stage.sun_working_force, stage.ring_working_force):
        assert abs(force) == pytest.approx(TANGENTIAL)
    assert stage.planet_bearing_force == pytest.approx(2 * TANGENTIAL)


def test_steps_and_bands_follow_from_the_gear_mesh(case):
    """Nothing of a machine that turns a thousand times slower: without [solver], default orders."""
    pace = case_pace(case)
    assert case.solver.model_fields_set == set()
    assert pace.band == pytest.approx(10 * FREQUENCY)
    assert pace.time_step == pytest.approx(1 / (40 * 10 * FREQUENCY))
    assert pace.output_interval == pytest.approx(1 / (8 * 10 * FREQUENCY))


def test_equilibrium_is_that_of_the_hand_calculation(static):
    mean = np.abs(static.gear_mesh_force.values).reshape(3, 2, PLANETS).mean(axis=2)
    assert static.closure.max() < 1e-9
    # errors move forces from planet to planet, their mean makes up the torque
    assert mean == pytest.approx(NORMAL, rel=1e-9)
    spline = of(static, "spline_1")
    assert spline[:, 5] == pytest.approx(-TORQUE * (RATIO - 1), rel=1e-9)
    assert np.abs(spline[:, 2]) == pytest.approx(PLANETS * AXIAL, rel=1e-9)
    assert of(static, "output")[:, 2] == pytest.approx(-spline[:, 2], rel=1e-9)


def test_hands_push_sun_and_ring_apart_and_tilt_planets(static):
    """The sun is right-handed, drives and turns in the positive sense: by the right-hand rule its
    teeth push it along +z, and planets see a couple, which moves with the lines of contact."""
    pins = np.stack([of(static, f"planet_bearing_{i}") for i in range(1, PLANETS + 1)])
    assert of(static, "output")[:, 2] == pytest.approx(PLANETS * AXIAL, rel=1e-9)
    assert np.abs(pins[..., 1]).mean(axis=0) == pytest.approx(2 * TANGENTIAL, rel=1e-3)
    assert np.abs(pins[..., 2]).max() < 1e-2 * AXIAL
    tilting = np.abs(pins[..., 4]).mean(axis=0)  # what is missing stays in the gear meshes
    assert (tilting > 0.8 * AXIAL * PLANET_DIAMETER).all()
    assert (tilting < AXIAL * PLANET_DIAMETER).all()


def test_a_short_run_holds_the_load(model):
    run = model.transient(duration=4 / FREQUENCY)
    ring = run.gear_mesh_force.values[:, :PLANETS].mean()
    assert ring == pytest.approx(NORMAL, rel=0.02)
    speeds = run.input_speed.values * 30 / math.pi
    assert speeds == pytest.approx(np.full_like(speeds, speeds[0, 0]), rel=1e-3)
