"""The whole run of a train, variants, and two trains side by side."""

import numpy as np
import pytest
from train_contexts import bundled, mixed, one_stage

from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.results.summary import missing
from flexgear.results.train_summary import TRAIN_REQUIRED
from flexgear.studies.train_angles import (
    cycles_of_train,
    given_speeds,
    lead_speed,
    one_turn,
    stage_motions,
)
from flexgear.studies.train_compare import against, compare_sharing, contexts, is_still
from flexgear.studies.train_modes import usual_limit
from flexgear.studies.train_run import run_train


def short(name, **changes):
    return load_case(name, {"solver.settle_s": "0.02", "solver.duration_s": "0.06", **changes})


def test_run_of_a_train_with_errors():
    progress = []
    result = run_train(short("herringbone"), lambda stage, share: progress.append(stage))
    assert list(missing(result.summary, TRAIN_REQUIRED)) == []
    assert set(result.datasets) == {
        "modes", "campbell", "equilibrium", "sharing_stage", "sharing_stage_without_errors",
        "transient", "harmonic",
    }  # fmt: skip
    sharing = result.summary["load_sharing"]["quasi_static"]
    assert sharing["lumped"]["stage"]["complete"] is True
    assert sharing["lumped"]["stage"]["stage ring left"]["instantaneous"] > 1.04
    clean = sharing["lumped, without errors"]["stage"]["stage ring left"]
    assert clean["instantaneous"] == pytest.approx(1.0)
    assert result.summary["power_flow"]["members"]["stage.sun"]["speed_rpm"] == pytest.approx(100)
    assert result.summary["transient"]["displacement_um_max"]["stage.sun"] > 1
    assert result.with_timing(pictures=2.0).summary["timing_s"]["pictures"] == 2.0
    assert {"modes", "transient, lumped"} <= set(progress)
    for data in result.datasets.values():
        assert data.attrs["content_hash"] == result.summary["content_hash"]


def test_run_of_a_train_without_errors_and_with_two_inputs():
    result = run_train(short("double-rotor-5mw", **{"solver.time_step_s": "5e-5"}))
    assert "transient_without_errors" not in result.datasets
    assert result.summary["harmonic"]["largest_difference"] < 1e-5
    stages = result.summary["stages"]
    assert stages["stage_1"]["planet_bearing_life_h"] > 1e5
    assert "ring_gear_mesh_force_n" not in stages["stage_3"]


def test_mixed_train_has_a_rigid_variant(tmp_path):
    """Flexible and rigid bodies side by side: the gear meshes carry the same in the mean."""
    train, bodies = mixed(tmp_path)
    found = contexts(train, bodies=bodies)
    assert list(found) == ["flexible", "rigid", "flexible, without errors"]
    # modes are listed as far as they are judged, and all of rigid bodies
    assert usual_limit(found["flexible"]) == found["flexible"].modal.choice.band_hz
    assert usual_limit(found["rigid"]) is None
    figures = compare_sharing(found, cycles=2, transient=False)
    assert "flexible: harmonic" not in figures
    first, second = (figures[f"{v}: quasi-static"]["first ring"] for v in ("flexible", "rigid"))
    assert first["instantaneous"] != pytest.approx(second["instantaneous"], rel=1e-6)


def test_comparison_of_analyses_agrees_where_it_must(tmp_path):
    """Slow running: quasi-static and harmonic load sharing are the same; clean gears share."""
    context = one_stage(
        tmp_path, planets=4, sun="3e8",
        **{"stage.errors.planet_eccentricity_um": "[20, 0, 0, 0]", "inputs.0.speed_rpm": "0.5"},
    )  # fmt: skip
    figures = compare_sharing({"lumped": context}, transient=False)
    quasi, harmonic = figures["lumped: quasi-static"], figures["lumped: harmonic"]
    for group, by in quasi.items():
        assert by["instantaneous"] > 1.01
        assert by["instantaneous"] == pytest.approx(harmonic[group]["instantaneous"], rel=1e-5)
        assert by["hu-2023"] == pytest.approx(harmonic[group]["hu-2023"], rel=1e-5)
    assert not is_still(context)
    assert is_still(bundled("lin-parker"))


def test_two_trains_side_by_side():
    """The double rotor turns planets faster under half the load: life by (P'/P)^p ω'/ω."""
    figures = against(load_case("double-rotor-5mw"), load_case("nrel-5mw"))
    double, single = figures["double-rotor-5mw"], figures["nrel-5mw"]
    load = single["stage_1_planet_bearing_force_n"] / double["stage_1_planet_bearing_force_n"]
    speed = (
        single["stage_1_planet_speed_in_carrier_rpm"]
        / double["stage_1_planet_speed_in_carrier_rpm"]
    )
    ratio = figures["planet_bearing_life_ratio"]
    assert ratio["stage_1_ball"] == pytest.approx(load**3 * speed)
    assert ratio["stage_1_roller"] == pytest.approx(load ** (10 / 3) * speed)
    hours = double["stage_1_planet_bearing_life_h"] / single["stage_1_planet_bearing_life_h"]
    assert hours == pytest.approx(ratio["stage_1_roller"])


def test_a_train_against_itself_under_another_torque():
    figures = against(
        load_case("lin-parker", {"inputs.0.torque_nm": "50"}), load_case("lin-parker")
    )
    assert list(figures) == ["lin-parker", "lin-parker, reference", "planet_bearing_life_ratio"]
    assert figures["planet_bearing_life_ratio"]["stage_ball"] == pytest.approx(8.0)


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
