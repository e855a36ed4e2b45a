"""The bundled grc-750kw: the hand calculation of its comments, rows of rollers, weight."""

import math

import numpy as np
import pytest
from stage_samples import stiff_stage

from flexgear import load_case, power_flow
from flexgear.analysis.equilibrium import equilibrium

RATIO = (1 + 99 / 21) * 82 / 23 * 88 / 22
PIN = 325e3 / (3 * 0.010 / math.cos(math.radians(7.5)) * (21 + 39) / 2)
RPM = math.pi / 30


def static_of(**settings):
    case = load_case("grc-750kw", settings)
    model = case.assemble(bodies=stiff_stage(case.view("lss")))
    return model.static(np.arange(0.0, 360.0, 30.0))


def test_speeds_and_torques():
    flow = power_flow(load_case("grc-750kw"))
    assert pytest.approx(81.491, abs=5e-4) == RATIO
    assert flow.speed["lss.carrier"] == pytest.approx(1800 / RATIO * RPM)
    assert flow.speed["lss.sun"] == pytest.approx(126.2 * RPM, rel=2e-4)
    assert flow.speed["iss.pinion"] == pytest.approx(-450 * RPM)
    assert flow.torque["hss.pinion"] == pytest.approx(-325e3 / RATIO)
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
        found = equilibrium(loaded.modal, 0.0, loaded.system.rated_torque)
        assert found.closure.max() < 1e-8
        assert found.active_flanks[0].tolist() == loaded.system.pairs.carries.tolist()
