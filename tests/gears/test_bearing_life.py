"""ISO 281 basic rating life and its ratio between trains."""

import math

import pytest
from flow_samples import planetary, train
from hypothesis import given
from hypothesis import strategies as st

from flexgear.gears.bearings.basic_life import (
    BALL,
    ROLLER,
    bearing_life_hours,
    life_ratio,
    planet_bearing_life_hours,
    planet_bearing_life_ratios,
    rating_life,
    rating_life_hours,
    varying_load,
)
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError
from flexgear.model.load import load_case

positive = st.floats(1e-2, 1e7)
exponents = st.sampled_from([BALL, ROLLER])


def test_rating_load_gives_a_million_revolutions():
    assert rating_life(5.5e6, 5.5e6) == pytest.approx(1e6)
    assert rating_life(5.5e6, -5.5e6, BALL) == pytest.approx(1e6)
    # one million revolutions at 33 1/3 r/min last 500 h: how C is defined
    assert rating_life_hours(1.0, 1.0, 100 / 3 * math.pi / 30) == pytest.approx(500)


def test_exponents():
    assert rating_life(2.0, 1.0, BALL) == pytest.approx(8e6)
    assert rating_life(2.0, 1.0, ROLLER) == pytest.approx(1e6 * 2 ** (10 / 3))


def test_no_load_or_no_motion_never_wears_out():
    assert rating_life(1.0, 0.0) == math.inf
    assert rating_life_hours(1.0, 1.0, 0.0) == math.inf
    assert planet_bearing_life_ratios(held_ring(1.0, 0.0), held_ring(1.0, 1e5)) == {}


@given(load=positive, speed=positive, other=positive, turning=positive, exponent=exponents)
def test_a_ratio_is_the_quotient_of_two_lives_in_hours(load, speed, other, turning, exponent):
    """Whatever C; sign of load and speed do not matter."""
    hours = rating_life_hours(3e5, load, speed, exponent)
    against = rating_life_hours(3e5, other, turning, exponent)
    ratio = life_ratio(-load, speed, other, -turning, exponent)
    assert ratio == pytest.approx(hours / against)
    assert ratio * life_ratio(other, turning, load, speed, exponent) == pytest.approx(1)


def held_ring(speed: float, power: float):
    return power_flow(
        train(
            planetary(),
            inputs={"a.carrier": {"speed": speed, "power": power}},
            output=("a.sun", {}),
        )
    )


def counter_rotating(carrier: float, power: float):
    """The ring turns the other way and takes no more than its torque asks for."""
    return power_flow(
        train(
            planetary(held=()),
            inputs={"a.carrier": {"speed": carrier}, "a.ring": {"speed": -carrier}},
            output=("a.sun", {"torque": -power / (9 * carrier)}),
        )
    )


def test_twice_the_speed_at_one_power_lasts_longer_by_two_to_the_exponent_less_one():
    ratios = planet_bearing_life_ratios(held_ring(2.0, 1e5), held_ring(1.0, 1e5))
    assert ratios == {"a": pytest.approx(2 ** (ROLLER - 1))}


def test_counter_rotation_of_ring_and_carrier():
    """ω_s = 9 ω_c instead of 5 ω_c (z_r/z_s = 4): loads 5/9, relative speed of planets twice."""
    one, both = held_ring(1.0, 1e5), counter_rotating(1.0, 1e5)
    assert both.speed["a.sun"] == pytest.approx(9.0)
    assert both.stages[0].planet_relative_speed == pytest.approx(
        2 * one.stages[0].planet_relative_speed
    )
    ratio = planet_bearing_life_ratios(both, one, BALL)["a"]
    assert ratio == pytest.approx((9 / 5) ** 3 / 2)


def test_life_of_the_planet_bearings_of_a_flexible_stage():
    """Both gear meshes push a planet with T/(N R_c) altogether, which turns (z_r/z_p) ω_c against
    its pin; two bearings share it."""
    rating = {"dynamic_rating_kn": "9000", "rolling": "roller", "count": "2"}
    case = load_case("wind-5mw", {f"stage.planet_bearing.{k}": v for k, v in rating.items()}).view()
    alone, distance = case.case, stage_geometry(case).center_distance
    hours = planet_bearing_life_hours(alone, power_flow(alone))
    load = case.case.inputs[0].torque / (5 * distance)
    speed = case.case.inputs[0].speed * 93 / 33 / (2 * math.pi)
    turns = 1e6 * (9e6 / (load / 2)) ** (10 / 3)
    assert hours == {"stage": pytest.approx(turns / speed / 3600)}
    with pytest.raises(InputError, match=r"stage.planet_bearing.rolling: is missing"):
        load_case("wind-5mw", {"stage.planet_bearing.dynamic_rating_kn": "9000"}).view()


def test_a_varying_load_lasts_as_long_as_its_mean_of_the_exponent():
    """Of two loads in turn each takes its own share of life: 1/L = (1/L₁ + 1/L₂)/2."""
    one, two = 3e4, 5e4
    each = [1 / rating_life(1e6, load, BALL) for load in (one, two)]
    together = 1 / rating_life(1e6, varying_load([one, -two], BALL), BALL)
    assert together == pytest.approx(sum(each) / 2, rel=1e-14)
    assert varying_load([0.0, 0.0], ROLLER) == 0.0


def test_a_life_is_that_of_the_constant_load_of_the_same_damage():
    """Two side by side share each load; half the revolutions without load: twice the life."""
    rating = {"dynamic_rating_kn": "2000", "rolling": "roller", "count": "2"}
    view = load_case(
        "wind-5mw", {f"stage.carrier.bearing_far.{k}": v for k, v in rating.items()}
    ).view()
    bearings = view.seat_bearings
    expected = 1e6 * (2e6 / 2e5) ** (10 / 3) * 2 * math.pi / 1.2 / 3600
    assert bearing_life_hours(bearings["far"], 4e5, -1.2) == pytest.approx(expected)
    assert bearing_life_hours(bearings["far"], [4e5, 0.0], -1.2) == pytest.approx(2 * expected)
    assert bearing_life_hours(bearings["far"], [0.0], -1.2) == math.inf
    assert bearing_life_hours(bearings["drive"], [1e5], -1.2) is None
