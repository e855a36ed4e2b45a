"""Bundled cases against the hand calculations of their comments: an EV reducer, a star whose ring
turns with its hub, and a wind gearbox with rows of rollers and weight."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from stage_samples import stiff_stage

from flexgear import load_case, power_flow
from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.pace import case_pace
from flexgear.model.load import bundled_text

RPM = math.pi / 30
HELIX = math.radians(15)


@dataclass(frozen=True)
class Hand:
    """Teeth, module (m), torque on the sun (N m) and its speed (r/min) of a stage of four planets
    with a helix of 15°, and what follows."""

    sun: int
    planet: int
    ring: int
    module: float
    torque: float
    speed: float

    @property
    def sun_diameter(self):
        return self.sun * self.module / math.cos(HELIX)

    @property
    def planet_diameter(self):
        return self.planet * self.module / math.cos(HELIX)

    @property
    def tangential(self):
        return self.torque / (4 * self.sun_diameter / 2)

    @property
    def axial(self):
        return self.tangential * math.tan(HELIX)

    @property
    def normal(self):
        return self.tangential / math.cos(math.radians(20)) / math.cos(HELIX)

    def load(self, width):
        """Tangential force over width and diameter, times (u + 1)/u; MPa."""
        return (
            self.tangential
            / (width * self.sun_diameter)
            * (self.sun + self.planet)
            / (self.planet * 1e6)
        )


EV = Hand(23, 33, 89, 1.5e-3, 200.0, 8000.0)
RATIO = 1 + EV.ring / EV.sun
FREQUENCY = EV.speed / RATIO / 60 * EV.ring
STAR = Hand(21, 27, 75, 2e-3, 250.0, 3000.0)


@pytest.fixture(scope="module")
def models():
    """Ring and carrier stiff, of the size of the case."""
    cases = {name: load_case(name) for name in ("ev-reducer", "star-ring")}
    return {name: c.assemble(bodies=stiff_stage(c.view())) for name, c in cases.items()}


@pytest.fixture(scope="module")
def statics(models):
    return {name: model.static([0.0, 5.0, 77.0]) for name, model in models.items()}


def of(static, support):
    """Force and moment of a support at every position."""
    return static.bearing_force.sel(support=f"stage.{support}").values


@pytest.mark.parametrize(
    ("name", "printed", "value"),
    [
        ("ev-reducer", "1 + 89/23 = 4.8696", RATIO),
        ("ev-reducer", "8000 / 4.8696 = 1642.9 r/min", EV.speed / RATIO),
        ("ev-reducer", "1642.9 × 89/33 = 4430.7 r/min", EV.speed / RATIO * EV.ring / EV.planet),
        ("ev-reducer", "1642.9 / 60 × 89 = 2436.9 Hz", FREQUENCY),
        ("ev-reducer", "200 N m × 837.76 rad/s = 167.55 kW", EV.torque * EV.speed * RPM / 1e3),
        ("ev-reducer", "carrier 200 × 4.8696 = 973.9 N m", EV.torque * RATIO),
        ("ev-reducer", "1.5 / cos 15° = 1.55291 mm", 1.5 / math.cos(HELIX)),
        ("ev-reducer", "(35.717 + 51.246)/2 = 43.482 mm",
         (EV.sun_diameter + EV.planet_diameter) / 2 * 1e3),
        ("ev-reducer", "200 / (4 × 17.858 mm) = 2799.8 N", EV.tangential),
        ("ev-reducer", "2799.8 × tan 15° = 750.2 N", EV.axial),
        ("ev-reducer", "750.2 N × 51.246 mm = 38.4 N m", EV.axial * EV.planet_diameter),
        ("ev-reducer", "2799.8/(30 × 35.717) × 56/33 = 4.4 MPa", EV.load(30e-3)),
        ("star-ring", "−75/21 = −3.5714", -STAR.ring / STAR.sun),
        ("star-ring", "−3000 / 3.5714 = −840 r/min", -STAR.speed * STAR.sun / STAR.ring),
        ("star-ring", "−3000 × 21/27 = −2333.3 r/min", -STAR.speed * STAR.sun / STAR.planet),
        ("star-ring", "3000 / 60 × 21 = 1050 Hz", STAR.speed / 60 * STAR.sun),
        ("star-ring", "(21 + 27)/2 × 2/cos 15° = 49.693 mm",
         (STAR.sun + STAR.planet) / math.cos(HELIX)),
        ("star-ring", "250 / (4 × 21.741 mm) = 2874.8 N", STAR.tangential),
        ("star-ring", "2874.8 × tan 15° = 770.3 N", STAR.axial),
        ("star-ring", "250 N m × 314.16 rad/s = 78.54 kW", STAR.torque * STAR.speed * RPM / 1e3),
        ("star-ring", "2874.8/(25 × 43.482) × 48/27 = 4.7 MPa", STAR.load(25e-3)),
    ],
)  # fmt: skip
def test_comments_say_what_the_formulas_give(name, printed, value):
    assert printed in bundled_text(name)
    number = printed.rpartition("= ")[2].split()[0].replace("−", "-")
    digits = len(number.partition(".")[2])
    assert float(number) == pytest.approx(value, abs=0.5001 * 10.0**-digits)


def test_steps_and_bands_follow_from_the_gear_mesh():
    """Nothing of a machine that turns a thousand times slower: without [solver], default orders."""
    case = load_case("ev-reducer")
    pace = case_pace(case)
    assert case.solver.model_fields_set == set()
    assert pace.band == pytest.approx(10 * FREQUENCY)
    assert pace.time_step == pytest.approx(1 / (40 * 10 * FREQUENCY))
    assert pace.output_interval == pytest.approx(1 / (8 * 10 * FREQUENCY))


@pytest.mark.parametrize(("name", "hand"), [("ev-reducer", EV), ("star-ring", STAR)])
def test_equilibrium_is_that_of_the_hand_calculation(statics, name, hand):
    """Errors move forces from planet to planet, their mean makes up the torque; thrusts of ring and
    sun are opposite."""
    static = statics[name]
    mean = np.abs(static.gear_mesh_force.values).reshape(3, 2, 4).mean(axis=2)
    assert static.closure.max() < 1e-9
    assert mean == pytest.approx(hand.normal, rel=1e-9)
    sun = of(static, "output")[:, 2]
    assert np.abs(sun) == pytest.approx(4 * hand.axial, rel=1e-9)
    if name == "ev-reducer":
        spline = of(static, "spline_1")
        assert spline[:, 5] == pytest.approx(-EV.torque * (RATIO - 1), rel=1e-9)
        assert sun == pytest.approx(-spline[:, 2], rel=1e-9)
    else:  # the knuckle takes the carrier's torque
        knuckle = of(static, "carrier_drive")
        torque = STAR.torque * (1 + STAR.ring / STAR.sun)
        assert np.abs(knuckle[:, 5]) == pytest.approx(torque, rel=1e-9)


def test_hands_push_sun_and_ring_apart_and_tilt_planets(statics):
    """The sun is right-handed, drives and turns in the positive sense: by the right-hand rule its
    teeth push it along +z, and planets see a couple, which moves with the lines of contact."""
    static = statics["ev-reducer"]
    pins = np.stack([of(static, f"planet_bearing_{i}") for i in range(1, 5)])
    assert of(static, "output")[:, 2] == pytest.approx(4 * EV.axial, rel=1e-9)
    assert np.abs(pins[..., 1]).mean(axis=0) == pytest.approx(2 * EV.tangential, rel=1e-3)
    assert np.abs(pins[..., 2]).max() < 1e-2 * EV.axial
    tilting = np.abs(pins[..., 4]).mean(axis=0)  # what is missing stays in the gear meshes
    assert (tilting > 0.8 * EV.axial * EV.planet_diameter).all()
    assert (tilting < EV.axial * EV.planet_diameter).all()


@pytest.mark.slow
def test_a_short_run_holds_the_load_of_the_reducer(models):
    run = models["ev-reducer"].transient(duration=4 / FREQUENCY)
    ring = run.gear_mesh_force.values[:, :4].mean()
    assert ring == pytest.approx(EV.normal, rel=0.02)
    speeds = run.input_speed.values / RPM
    assert speeds == pytest.approx(np.full_like(speeds, speeds[0, 0]), rel=1e-3)


def test_a_short_run_turns_the_ring_of_the_star(models):
    run = models["star-ring"].transient(duration=2e-3)
    turned = run.ring_angle.values[-1, 0] - run.ring_angle.values[0, 0]
    span = float(run.time.values[-1] - run.time.values[0])
    assert turned == pytest.approx(-STAR.speed * STAR.sun / STAR.ring * RPM * span, rel=1e-3)
    assert np.ptp(run.carrier_angle.values) < 1e-3 * abs(turned)


GRC_RATIO = (1 + 99 / 21) * 82 / 23 * 88 / 22
PIN = 325e3 / (3 * 0.010 / math.cos(math.radians(7.5)) * (21 + 39) / 2)


def static_of(**settings):
    case = load_case("grc-750kw", settings)
    model = case.assemble(bodies=stiff_stage(case.view("lss")))
    return model.static(np.arange(0.0, 360.0, 30.0))


def test_speeds_and_torques_of_the_wind_gearbox():
    flow = power_flow(load_case("grc-750kw"))
    assert pytest.approx(81.491, abs=5e-4) == GRC_RATIO
    assert flow.speed["lss.carrier"] == pytest.approx(1800 / GRC_RATIO * RPM)
    assert flow.speed["lss.sun"] == pytest.approx(126.2 * RPM, rel=2e-4)
    assert flow.speed["iss.pinion"] == pytest.approx(-450 * RPM)
    assert flow.torque["hss.pinion"] == pytest.approx(-325e3 / GRC_RATIO)
    frequencies = [stage.gear_mesh_frequency for stage in flow.stages]
    assert frequencies == pytest.approx([36.446, 172.5, 660.0], rel=1e-4)
    assert flow.stage("lss").planet_bearing_force == pytest.approx(PIN)
    assert pytest.approx(358.0e3, rel=1e-4) == PIN


def test_pins_carry_the_torque_and_two_rows_each_about_half():
    static = static_of()
    pins = static.planet_bearing_force.values
    assert static.closure.max() < 1e-8
    assert np.abs(pins[..., 1]).mean() == pytest.approx(PIN, rel=1e-3)
    rows = static.planet_bearing_row_load.values
    assert rows.shape[-1] == 2
    assert (rows.sum(axis=-1) >= np.linalg.norm(pins[..., :2], axis=-1) * (1 - 1e-9)).all()


def test_without_weight_three_planets_share_equally_in_the_mean():
    """Weight makes the loads swing once a turn; nothing else here knows where up is."""

    def swing(static):
        force = np.linalg.norm(static.planet_bearing_force.values[..., :2], axis=-1)
        return np.ptp(force, axis=0).max() / force.mean()

    assert swing(static_of()) > 10 * swing(static_of(gravity_m_per_s2="[0, 0, 0]"))


def test_bearings_with_clearance_find_their_side_under_moments():
    """At rest they carry nothing, so that the first straight line leads metres away. Coast flanks
    that only such a motion would close are not looked at."""
    case = load_case("grc-750kw", {"gravity_m_per_s2": "[0, -0.1, 0]"})
    bodies = stiff_stage(case.view("lss"))
    for x, y in ((300e3, 0.0), (-300e3, 0.0), (0.0, 300e3)):
        loaded = case.with_(**{"loads.0.moment": (x, y, 0.0)}).assemble(bodies=bodies)
        equilibrium = revolution(loaded.modal, 0.0, loaded.system.rated_torque)
        assert equilibrium.closure.max() < 1e-8
        assert equilibrium.active_flanks[0].tolist() == loaded.system.pairs.carries.tolist()
