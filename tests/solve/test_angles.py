"""Rated motion of stages and the cycles of their errors."""

import numpy as np
import pytest

from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.solve.angles import (
    cycles_of_train,
    given_speeds,
    lead_angles,
    lead_speed,
    one_turn,
    stage_motions,
)


def test_rated_motion_of_stages():
    train = load_case("double-rotor-5mw")
    flow = power_flow(train)
    motions = stage_motions(train, flow)
    assert given_speeds(train) == ["stage_1.carrier", "stage_1.ring"]
    assert lead_speed(train, flow) == pytest.approx(12.1 * np.pi / 30)
    assert motions[0].theta == pytest.approx((12.1 + 16.21) * np.pi / 30)
    assert motions[0].gear_mesh_frequency == pytest.approx(56 * (12.1 + 16.21) / 60)
    assert motions[2].theta == pytest.approx(flow.speed["stage_3.gear"])
    angles = one_turn(motions[0], lead_speed(train, flow), 4, 1000)
    assert len(angles) == 4 * 56
    assert angles[-1] + angles[1] == pytest.approx(2 * np.pi * 12.1 / (12.1 + 16.21))
    # no errors: every gear-mesh cycle is like the last
    assert all(m.cycle.gear_meshes == 1 for m in motions)


def test_angles_of_a_stage_where_only_the_output_has_a_speed():
    """grc-750kw: the generator's shaft leads, 81.49 times as fast as the carrier that drives."""
    train = load_case("grc-750kw")
    flow = power_flow(train)
    assert given_speeds(train) == ["hss.pinion"]
    ratios = (1 + 99 / 21), 82 / 23, 88 / 22
    turn = np.array([0.0, 2 * np.pi])
    for stage, ratio in (("lss", np.prod(ratios)), ("iss", np.prod(ratios[1:])), ("hss", 4.0)):
        assert lead_angles(train, flow, turn, stage) == pytest.approx(ratio * turn)
    assert lead_angles(train, flow, turn) == pytest.approx(np.prod(ratios) * turn)
    same = load_case("wind-5mw")
    assert lead_angles(same, power_flow(same), turn) == pytest.approx(turn)


@pytest.mark.parametrize(
    ("change", "cycles"),
    [
        ({}, 1),
        ({"stage.errors.planet_eccentricity_um": "[10]"}, 34),
        ({"stage.errors.sun_eccentricity_um": "10"}, 26),
        ({"stage.errors.ring_offset_um": "10"}, 94),
        ({"stage.carrier.support.radial_x_n_per_m": "2e8"}, 94),
        ({"gravity_m_per_s2": "[0, -9.81, 0]"}, 94),
    ],
)
def test_error_cycle_follows_from_what_disturbs(change, cycles):
    """Gear-mesh cycles until it comes back: a turn of the planet, the sun, or against space."""
    train = load_case("lin-parker", change)
    motions = stage_motions(train, power_flow(train))
    assert motions[0].cycle.gear_meshes == cycles
    assert cycles_of_train(motions, 0) == cycles
