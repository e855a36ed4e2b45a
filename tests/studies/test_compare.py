"""Analyses of one case side by side, and two cases side by side."""

import math

import pytest
from train_contexts import bundled, mixed

from flexgear.model.load import load_case
from flexgear.solve.modes import usual_limit
from flexgear.solve.run import models_of
from flexgear.solve.run_transients import is_static
from flexgear.studies.compare import against, compare_sharing


def test_mixed_train_has_a_rigid_variant(tmp_path):
    """Flexible and rigid bodies side by side: the gear meshes carry the same in the mean."""
    train, bodies = mixed(tmp_path)
    models = models_of(train, bodies=bodies)
    assert list(models) == ["flexible", "rigid", "flexible, without errors"]
    # modes are listed as far as they are judged, and all of rigid bodies
    assert usual_limit(models["flexible"]) == models["flexible"].modal.choice.band_hz
    assert usual_limit(models["rigid"]) is None
    figures = compare_sharing(models, cycles=2, transient=False)
    first, second = (figures[f"{v}: quasi-static"]["first ring"] for v in ("flexible", "rigid"))
    assert first["instantaneous"] != pytest.approx(second["instantaneous"], rel=1e-6)


def test_trains_that_roll_in_one_equilibrium_have_no_transient():
    assert is_static(bundled("lin-parker"))
    assert not is_static(bundled("herringbone"))


def test_two_trains_side_by_side():
    """The double rotor turns planets faster under half the load: life by (P'/P)^p ω'/ω."""
    figures = against(load_case("double-rotor-5mw"), load_case("nrel-5mw"))
    double, single = figures["double-rotor-5mw"], figures["nrel-5mw"]
    load = single["stage_1_planet_bearing_force_n"] / double["stage_1_planet_bearing_force_n"]
    speed = (
        single["stage_1_planet_speed_in_carrier_rpm"]
        / double["stage_1_planet_speed_in_carrier_rpm"]
    )
    ratio = figures["bearing_life_ratio"]
    assert ratio["stage_1_planet_bearing_ball"] == pytest.approx(load**3 * speed)
    assert ratio["stage_1_planet_bearing_roller"] == pytest.approx(load ** (10 / 3) * speed)
    hours = (
        double["stage_1_nominal_planet_bearing_life_h"]
        / single["stage_1_nominal_planet_bearing_life_h"]
    )
    assert hours == pytest.approx(ratio["stage_1_planet_bearing_roller"])


def test_a_train_against_itself_under_another_torque():
    figures = against(
        load_case("lin-parker", {"inputs.0.torque_nm": "50"}), load_case("lin-parker")
    )
    assert list(figures) == ["lin-parker", "lin-parker, reference", "bearing_life_ratio"]
    assert figures["bearing_life_ratio"]["stage_planet_bearing_ball"] == pytest.approx(8.0)
    base_radius = 88.4e-3 * 26 / 60 * math.cos(math.radians(24.6))  # of a sun that drives
    for name, torque in (("lin-parker", 50), ("lin-parker, reference", 100)):
        force = pytest.approx(torque / (4 * base_radius))
        assert figures[name]["stage_sun_gear_mesh_force_n"] == force
        assert figures[name]["stage_ring_gear_mesh_force_n"] == force


def test_bearings_of_a_shaft_last_as_long_as_their_loads_let_them():
    """Under twice the torque all forces on a gear pair's bearings are twice as large, and thrust
    counts as before: every life falls by 2^p."""
    case = load_case("nrel-5mw")
    double = case.with_(**{"inputs.0.power": 2 * case.inputs[0].power})
    ratio = against(double, case)["bearing_life_ratio"]
    for place in ("pinion_support_1", "pinion_support_2", "gear_support_1", "gear_support_2"):
        assert ratio[f"stage_3_{place}_ball"] == pytest.approx(2**-3)
        assert ratio[f"stage_3_{place}_roller"] == pytest.approx(2 ** (-10 / 3))
    # a pair of bearings of 5 500 kN each against four of 3 300 kN
    bearing = "stages.stage_1.planet_bearing"
    four = case.with_(**{f"{bearing}.count": 4, f"{bearing}.dynamic_rating": 3.3e6})
    ratio = against(four, case)["bearing_life_ratio"]["stage_1_planet_bearing_roller"]
    assert ratio == pytest.approx(1.2 ** (10 / 3))
