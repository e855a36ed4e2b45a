"""Steps, samples and modes follow from the case; numbers too coarse for what it asks are named."""

import math

import pytest
from small_train import SMALL_STAGE

from flexgear.coupling.pace import (
    SAMPLES,
    STEPS,
    case_pace,
    speed_time_constant,
    timed_drops,
    too_coarse,
)
from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.solve.transient import stepping_of


def small(**settings):
    return load_case(SMALL_STAGE, {key.replace("__", "."): str(v) for key, v in settings.items()})


def test_a_fast_stage_is_resolved_up_to_its_highest_wanted_order():
    """72 ring teeth at 1 500 r/min: 1 800 Hz, ten orders of it, above what the gears swing at."""
    pace = case_pace(small())
    assert pace.gear_mesh == pytest.approx(1800)
    assert pace.resonance < pace.band == pytest.approx(18_000)
    assert pace.time_step == pytest.approx(1 / (STEPS * 18_000))
    assert pace.output_interval == pytest.approx(1 / (SAMPLES * 18_000))
    assert too_coarse(pace, small().solver) == []
    twice = case_pace(small(solver__gear_mesh_orders=20))
    assert twice.time_step == pytest.approx(pace.time_step / 2)


def test_a_slow_stage_is_resolved_up_to_where_its_gears_swing():
    """f_E = √(k̄/m)/2π does not depend on speed; at the ring m is J_p/r_bp² of a planet alone."""
    slow, slower = (case_pace(small(inputs__0__speed_rpm=n)) for n in (10, 1))
    assert slow.band == slower.band == slow.resonance == case_pace(small()).resonance
    light = case_pace(small(inputs__0__speed_rpm=1, material__density_kg_per_m3=7850 / 4))
    assert light.resonance == pytest.approx(2 * slow.resonance)


def test_gears_far_above_their_resonance_resolve_three_orders():
    """72 ring teeth at 30 000 r/min: 36 kHz; the gears vibrate on their gear meshes below 15 kHz,
    and of a forced vibration (f_E/f)² is left: a fiftieth at order 3."""
    fast = {"inputs__0__speed_rpm": 30_000}
    pace = case_pace(small(**fast))
    assert pace.orders == 3 and pace.band == pytest.approx(108_000)
    assert "the share of vibratory forces that inertia leaves" in pace.reasons["gear_mesh_orders"]
    stated = case_pace(small(**fast, solver__gear_mesh_orders=10))
    assert stated.band == pytest.approx(360_000) and "gear_mesh_orders" not in stated.reasons
    assert "gear_mesh_orders" not in case_pace(small()).reasons


def test_a_train_goes_by_its_fastest_gear_mesh():
    train = load_case("nrel-5mw", {"solver.gear_mesh_orders": "10"})
    assert case_pace(train).gear_mesh == pytest.approx(466.354, rel=1e-5)
    assert case_pace(train).band == pytest.approx(4663.54, rel=1e-5)


def test_members_that_only_slow_gear_meshes_excite_have_the_band_of_these():
    """The hub turns at a hundredth of the generator's speed; the sun of the planetary stage is
    joined to the next stage's gear, on whose gear mesh it has the higher resonance."""
    wide = {"solver.gear_mesh_orders": "10"}
    pace = case_pace(train := load_case("grc-750kw", wide))
    slow, middle, fast = (s.gear_mesh_frequency for s in power_flow(train).stages)
    assert pace.band == pytest.approx(10 * fast)
    assert set(pace.member_bands) == {
        *(f"lss.{part}" for part in ("ring", "carrier", "planet", "sun")), "iss.gear",
    }  # fmt: skip
    ring, sun = (pace.band_of(BodyName.parse(f"lss.{part}")) for part in ("ring", "sun"))
    assert pace.member_bands["iss.gear"] == sun >= 10 * middle
    assert 10 * slow < ring == pace.band_of(BodyName.parse("lss.planet_2")) < sun < pace.band
    assert pace.band_of(BodyName.parse("hss.pinion")) == pace.band
    assert pace.reduction_limit_of(BodyName.parse("lss.ring")) == ring
    assert "lss.ring" in pace.reasons["lowest_modes_band"]
    stated = case_pace(load_case("grc-750kw", {**wide, "solver.reduction_limit_hz": "2000"}))
    assert stated.reduction_limit_of(BodyName.parse("lss.ring")) == 2000.0
    for key in ("solver.modes_band_hz", "solver.modes_to_hz"):
        one = case_pace(load_case("grc-750kw", {**wide, key: "3000"}))
        assert not one.member_bands and "lowest_modes_band" not in one.reasons


def test_bodies_with_sensors_have_the_band_of_the_recorder():
    sensor = {"name": "a", "on": "lss.ring", "measures": "acceleration", "angle_deg": 0.0}
    sensor["direction"] = "radial"
    keys = {"solver.gear_mesh_orders": 10, "sensors": [sensor]}
    pace = case_pace(load_case("grc-750kw", keys))
    assert "lss.ring" not in pace.member_bands and "lss.carrier" in pace.member_bands
    heard = case_pace(load_case("grc-750kw", {**keys, "recorder.band_hz": 3000.0}))
    assert heard.member_bands["lss.ring"] == 3000.0


@pytest.mark.parametrize(
    ("key", "value", "named"),
    [
        ("solver__time_step_s", 1e-4, "solver.time_step_s"),
        ("solver__output_interval_s", 1e-3, "solver.output_interval_s"),
        ("solver__modes_band_hz", 500, "solver.modes_band_hz"),
        ("solver__modes_to_hz", 3000, "solver.modes_to_hz"),
        ("solver__duration_s", 1e-4, "solver.duration_s"),
    ],
)
def test_settings_that_are_too_coarse_are_named(key, value, named):
    """The defaults of a wind turbine, which once were everybody's."""
    case = small(**{key: value})
    (line,) = [n for n in too_coarse(case_pace(case), case.solver) if named in n]
    assert "leave it out" in line


def test_fewer_orders_and_samples_may_be_asked_for():
    case = small(solver__output_interval_s=1e-4, solver__gear_mesh_orders=2)
    assert too_coarse(case_pace(case), case.solver) == []


RAMP = {"drive__kind": "ramp", "drive__times_s": "[0, 0.01]", "drive__torques_nm": "[300, 200]"}


def windows(case):
    return stepping_of(case, power_flow(case), 0.02).windows


def test_a_series_is_run_with_the_step_that_is_asked_for():
    """Left out, it is that after a jump; a time step of the case holds everywhere, and what it is
    too coarse for is said. The longest step after a jump, where it is given, holds under series."""
    derived = case_pace(small(**RAMP))
    assert derived.series_time_step == derived.step_time_step < derived.time_step
    assert [w.time_step for w in windows(small(**RAMP))] == [derived.step_time_step]
    asked = small(**RAMP, solver__time_step_s=1e-6)
    assert case_pace(asked).series_time_step == 1e-6 and not windows(asked)
    (line,) = too_coarse(case_pace(asked), asked.solver)
    assert "solver.time_step_s = 1e-06 is the step during the series of stage.carrier" in line
    assert case_pace(asked).figures["series_time_step_s"] == 1e-6
    both = small(**RAMP, solver__time_step_s=1e-6, solver__step_time_step_s=2e-7)
    assert [w.time_step for w in windows(both)] == [2e-7]
    speed = '{law = "speed", kind = "ramp", times_s = [0, 0.01], speeds_rpm = [60, 50]}'
    followed = small(inputs__0__machine=speed, solver__time_step_s=1e-6)
    plan = stepping_of(followed, power_flow(followed), 0.02)
    assert plan.jumps == (0.0, 0.01) and not plan.windows  # a new start at kinks, no finer step
    assert too_coarse(case_pace(both), both.solver) == []


def test_without_a_load_series_no_time_step_of_one_is_reported():
    pace = case_pace(small(solver__time_step_s=1e-6))
    assert pace.series == () and "series_time_step_s" not in pace.figures
    assert too_coarse(pace, small(solver__time_step_s=1e-6).solver) == []


def test_drops_last_until_the_speed_is_back_but_no_longer_than_a_turn():
    """τ = J ω/T of both inertias at the carrier; heavy drives are cut at a revolution."""
    case = small()
    turn, ratio = 60 / 1500, 100 / 28
    inertia = case.inputs[0].inertia + ratio**2 * case.output.inertia
    assert speed_time_constant(case) == pytest.approx(inertia * 2 * math.pi * 25 / 300)
    assert timed_drops(case).after == pytest.approx(min(2 * speed_time_constant(case), turn))
    assert timed_drops(small(inputs__0__inertia_kg_m2=10)).after == pytest.approx(turn)
    steps_case = small(drive__steps__after_s=0.5, drive__steps__start_s=0.0)
    assert timed_drops(steps_case).times[::2] == (0.0, 0.5)
