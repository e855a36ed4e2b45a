"""Basic and reference life of bearings, lubrication, estimates: scaling, limits, printed tables."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from flow_samples import planetary, train
from hypothesis import strategies as st

from flexgear.gears.bearings.basic_life import (
    BALL,
    ROLLER,
    bearing_life_hours,
    rating_life,
    rating_life_hours,
    varying_load,
)
from flexgear.gears.bearings.bearing import (
    RollingBearing,
    rate_load,
    rate_motion,
    rolling_bearing,
)
from flexgear.gears.bearings.nominal import bearing_life_ratios, nominal_bearings
from flexgear.gears.bearings.reference_life import (
    Lubrication,
    Ratings,
    row_lives,
)
from flexgear.gears.bearings.rows import BallRow, RollerRow, standard_drops
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import load_case

positive = st.floats(1e-2, 1e7)


def test_rating_load_gives_a_million_revolutions():
    assert rating_life(5.5e6, 5.5e6) == pytest.approx(1e6)
    assert rating_life(5.5e6, -5.5e6, BALL) == pytest.approx(1e6)
    # one million revolutions at 33 1/3 r/min last 500 h: how C is defined
    assert rating_life_hours(1.0, 1.0, 100 / 3 * math.pi / 30) == pytest.approx(500)


def test_no_load_or_no_motion_never_wears_out():
    assert rating_life(1.0, 0.0) == math.inf
    assert rating_life_hours(1.0, 1.0, 0.0) == math.inf
    assert _ratios(held_ring(1.0, 0.0), held_ring(1.0, 1e5)) == {"ball": {}, "roller": {}}


def _ratios(first, second):
    """Ratios of lives by kind and bearing."""
    return bearing_life_ratios(first, power_flow(first), second, power_flow(second))


def held_ring(speed: float, power: float):
    return train(
        planetary(), inputs={"a.carrier": {"speed": speed, "power": power}}, output=("a.sun", {})
    )


def counter_rotating(carrier: float, power: float):
    """The ring turns the other way and takes no more than its torque asks for."""
    return train(
        planetary(held=()),
        inputs={"a.carrier": {"speed": carrier}, "a.ring": {"speed": -carrier}},
        output=("a.sun", {"torque": -power / (9 * carrier)}),
    )


def test_twice_the_speed_at_one_power_lasts_longer_by_two_to_the_exponent_less_one():
    ratios = _ratios(held_ring(2.0, 1e5), held_ring(1.0, 1e5))["roller"]
    assert ratios == {"a_planet_bearing": pytest.approx(2 ** (ROLLER - 1))}


def test_counter_rotation_of_ring_and_carrier():
    """ω_s = 9 ω_c instead of 5 ω_c (z_r/z_s = 4): loads 5/9, relative speed of planets twice."""
    cases = held_ring(1.0, 1e5), counter_rotating(1.0, 1e5)
    one, both = map(power_flow, cases)
    assert both.speed["a.sun"] == pytest.approx(9.0)
    assert both.stages[0].planet_relative_speed == pytest.approx(
        2 * one.stages[0].planet_relative_speed
    )
    ratio = _ratios(*reversed(cases))["ball"]["a_planet_bearing"]
    assert ratio == pytest.approx((9 / 5) ** 3 / 2)


def test_life_of_the_planet_bearings_of_a_flexible_stage():
    """Both gear meshes push a planet with T/(N R_c) altogether, which turns (z_r/z_p) ω_c against
    its pin; two bearings share it."""
    rating = {"dynamic_rating_kn": "9000", "rolling": "roller", "count": "2"}
    case = load_case("wind-5mw", {f"stage.planet_bearing.{k}": v for k, v in rating.items()}).view()
    alone, distance = case.case, stage_geometry(case).center_distance
    hours = nominal_bearings(case, power_flow(alone).stage("stage"))
    load = case.case.inputs[0].torque / (5 * distance)
    speed = case.case.inputs[0].speed * 93 / 33 / (2 * math.pi)
    turns = 1e6 * (9e6 / (load / 2)) ** (10 / 3)
    assert hours["planet_bearing"].life_hours == pytest.approx(turns / speed / 3600)
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
    bearings = view.stage.seat_bearings
    expected = 1e6 * (2e6 / 2e5) ** (10 / 3) * 2 * math.pi / 1.2 / 3600
    assert bearing_life_hours(bearings["far"], 4e5, -1.2) == pytest.approx(expected)
    assert bearing_life_hours(bearings["far"], [4e5, 0.0], -1.2) == pytest.approx(2 * expected)
    assert bearing_life_hours(bearings["far"], [0.0], -1.2) == math.inf
    assert bearing_life_hours(bearings["drive"], [1e5], -1.2) is None


MM = 1e-3
RATINGS = Ratings(1e5, 1.2e5, 1.5e4)
OIL = Lubrication(0.7, 0.1)


def rollers(laminae=30, **more):
    drops = standard_drops(15 * MM, 16 * MM, 0.0, laminae)
    row = RollerRow(14, 15 * MM, 72.5 * MM, length=16 * MM, gap=10e-6, drops=drops)
    return replace(row, **more)


def balls(**more):
    row = BallRow(9, 12 * MM, 60 * MM, inner_groove=6.24 * MM, outer_groove=6.36 * MM)
    return replace(row, **more)


def life(row, load, stationary="outer", ratings=RATINGS, lubrication=None):
    bearing = RollingBearing((row,), ratings)
    rating = rate_load(bearing, np.array(load, dtype=float), stationary, lubrication)
    return rating.basic_life if lubrication is None else rating.modified_life


@pytest.mark.parametrize(("row", "power"), [(rollers(), 4.0), (balls(), 3.0)])
@pytest.mark.parametrize("stationary", ["inner", "outer"])
def test_scaling_of_loads_and_ratings(row, power, stationary):
    """Lives go with the fourth power of the loads of laminae, with the third of those of balls."""
    loads = row.state(np.array([4e-5, 0, 0, 0, 3e-4])).loads
    basic, _ = row_lives(row, RATINGS, loads, stationary)
    half, _ = row_lives(row, RATINGS, loads / 2, stationary)
    assert half == pytest.approx(2**power * basic, rel=1e-12)
    better, _ = row_lives(row, Ratings(2e5), loads, stationary)
    assert better == pytest.approx(half, rel=1e-12)


def test_life_falls_with_tilt_and_does_not_see_its_sign():
    bearing = RollingBearing((rollers(),), RATINGS)
    tilts = [0, 5e-4, 1e-3, 2e-3, 4e-3]
    lives = [
        rate_load(bearing, [1e4, 0, 0, 0, 0], "inner", held={"rx": 0.0, "ry": tilt}).basic_life
        for tilt in tilts
    ]
    assert all(a > b for a, b in pairwise(lives)) and lives[-1] < lives[0] / 2
    back = rate_load(bearing, [1e4, 0, 0, 0, 0], "inner", held={"rx": 0.0, "ry": -2e-3})
    assert back.basic_life == pytest.approx(lives[3], rel=1e-6)


@pytest.mark.parametrize("edge_stress", [False, True])
def test_finer_laminae_converge(edge_stress):
    lives = [
        life(rollers(n, edge_stress=edge_stress), [3e4, 0, 0, 0, 60]) for n in (25, 50, 100, 400)
    ]
    errors = np.abs(np.array(lives[:3]) / lives[3] - 1)
    assert errors[1] < errors[0] and errors[2] < errors[1] / 1.5 and errors[2] < 0.02


def test_uniform_load_has_the_catalogue_life():
    """Without profile, edges and λν the load C itself gives 10⁶ revolutions, by the standard's
    factors of the load zone of half a turn (0.378 and 0.364 have three digits)."""
    row = rollers(gap=0.0, count=200, drops=(0.0,) * 30, edge_stress=False, diameter=1 * MM)
    basic = life(row, [1e5 / 0.83, 0, 0, 0, 0])
    assert basic == pytest.approx(1e6, rel=0.03)
    ball = balls(
        gap=0.0, count=120, diameter=1 * MM, inner_groove=0.52 * MM, outer_groove=0.53 * MM
    )
    assert life(ball, [10, 0, 0, 0, 0], ratings=Ratings(10)) == pytest.approx(1e6, rel=0.03)


@pytest.mark.parametrize("angle", [15, 25, 40])
def test_angular_contact_under_half_a_turn_of_load_has_the_catalogue_life(angle):
    """P = F_r where half of the balls carry, F_a = 1.22 F_r tan α, at every contact angle: L =
    (C/F_r)³ by ISO 281. Motion along the radius alone makes that zone; 0.407 and 0.389 have three
    digits, and the load is small, so that contact angles stay."""
    row = balls(count=300, contact_angle=math.radians(angle), pitch_diameter=1.5, diameter=12 * MM)
    state = row.state(np.array([1e-8, 0, 0, 0, 0]))
    radial, axial = state.force[0], state.force[2]
    assert axial == pytest.approx(1.216 * radial * math.tan(row.contact_angle), rel=1e-3)
    basic, _ = row_lives(row, Ratings(100 * radial), state.loads, "outer")
    assert basic == pytest.approx(1e12, rel=5e-3)


def test_modified_life_of_rollers_by_hand():
    """Every lamina of 14 rollers carries 100 N: P = 0.323 · 14 · 30 · 100 N = 13 566 N whatever the
    raceways. With e_C C_u/P = 0.2 and κ = 1, a_ISO = 0.1 (1 − 0.3511 · 0.5253)^(−9.185) = 0.651."""
    row, even = rollers(edge_stress=False), np.full((14, 30), 100.0)
    ratings = Ratings(1e5, fatigue_load_limit=5426.4)
    basic, modified = row_lives(row, ratings, even, "outer", Lubrication(1.0, 0.5))
    assert modified / basic == pytest.approx(0.6506, rel=1e-3)


@pytest.mark.parametrize("make", [rollers, balls])
def test_rows_of_equal_load_and_limits_of_lubrication(make):
    row = make()
    alone = rate_load(RollingBearing((row,), RATINGS), [1e4, 0, 0, 0, 0], "inner", OIL)
    pair = RollingBearing((replace(row, position=-0.05), replace(row, position=0.05)), RATINGS)
    both = rate_load(pair, [2e4, 0, 0, 0, 0], "inner", OIL)
    e = 9 / 8 if isinstance(row, RollerRow) else 10 / 9
    assert both.basic_life == pytest.approx(2 ** (-1 / e) * alone.basic_life, rel=1e-5)
    assert both.modified_life == pytest.approx(2 ** (-1 / e) * alone.modified_life, rel=1e-5)
    best = rate_motion(
        RollingBearing((row,), RATINGS), alone.motion, "inner", Lubrication(4.0, 1.0)
    )
    assert best.modified_life <= 50 * best.basic_life * (1 + 1e-12)
    assert best.modified_life > alone.modified_life
    dirty = rate_motion(
        RollingBearing((row,), RATINGS), alone.motion, "inner", Lubrication(1, 1e-12)
    )
    assert dirty.modified_life == pytest.approx(0.1 * alone.basic_life, rel=1e-2)
    starved = rate_motion(
        RollingBearing((row,), RATINGS), alone.motion, "inner", Lubrication(0.02, 0.5)
    )
    assert starved.modified_life == pytest.approx(0.1 * alone.basic_life, rel=0.01)
    assert set(starved.estimates) == {"a_ISO"} and not alone.estimates


@pytest.mark.parametrize("make", [rollers, balls])
@pytest.mark.parametrize("degrees", [15, 40])
def test_one_row_with_a_contact_angle_takes_no_moment_without_thrust(make, degrees):
    row = make(contact_angle=math.radians(degrees))
    bearing, level = RollingBearing((row,), RATINGS), {"rx": 0.0, "ry": 0.0}
    with pytest.raises(FlexgearError, match="one row slides along its contact angle"):
        rate_load(bearing, [1e4, 0, 0, 0, 500], "inner")
    loaded = rate_load(bearing, [1e4, 0, 2e4, 0, 0], "inner", held=level)
    assert loaded.rows[0].load == pytest.approx((1e4, 2e4), rel=1e-6)


@pytest.mark.parametrize("places", [[0.0], [-30.0, 30.0], [-94.0, -31.0, 31.0, 94.0]])
def test_tiny_loads_have_an_equilibrium(places):
    """Lives grow with the third power down to loads whose closings are rounding of the grooves'."""
    rows = tuple(balls(position=place * MM) for place in places)
    bearing = RollingBearing(rows, Ratings(1e5))
    directions = [np.array([math.cos(k), math.sin(k), 0, 0, 0]) for k in range(12)]
    whole = [rate_load(bearing, 1e4 * along, "inner").basic_life for along in directions]
    tiny = [rate_load(bearing, 1e-4 * along, "inner").basic_life for along in directions]
    assert tiny == pytest.approx([1e24 * life for life in whole], rel=1e-4)


def test_estimates_count_where_figures_rest_on_them():
    bearing = rolling_bearing(planet_bearing(static_rating_kn="5000"))
    assert len(bearing.estimates) == 1
    load = [5e5, 0, 0, 0, 0]
    assert not rate_load(bearing, load, "inner").estimates
    assert rate_load(bearing, load, "inner", OIL).estimates == bearing.estimates


def test_without_load_nothing_fails():
    still = rate_motion(RollingBearing((rollers(),), RATINGS), np.zeros(5), "inner", OIL)
    assert still.basic_life == still.modified_life == still.static_safety == math.inf
    assert still.pressure == 0


ELEMENTS = {
    "dynamic_rating_kn": "2500", "rolling": "roller", "elements.count": "24",
    "elements.rows": "2", "elements.diameter_mm": "60", "elements.pitch_diameter_mm": "500",
    "elements.length_mm": "100", "elements.spacing_mm": "120", "elements.clearance_um": "40",
}  # fmt: skip


def planet_bearing(**changes):
    settings = {k: v for k, v in (ELEMENTS | changes).items() if v is not None}
    settings = {f"stage.planet_bearing.{key}": value for key, value in settings.items()}
    return load_case("wind-5mw", settings).stages[0].planet_bearing


def test_a_bearing_of_a_case():
    bearing = rolling_bearing(planet_bearing())
    assert [row.position for row in bearing.rows] == [-0.06, 0.06]
    assert bearing.ratings.rows == 2 and bearing.ratings.dynamic_rating == 2.5e6
    assert set(bearing.estimates) == {"static_rating", "fatigue_load_limit"}
    stated = {"static_rating_kn": "5000", "fatigue_load_limit_kn": "600"}
    assert not rolling_bearing(planet_bearing(**stated)).estimates
    guessed = rolling_bearing(planet_bearing(dynamic_rating_kn=None))
    assert "dynamic_rating" in guessed.estimates
    pair = rolling_bearing(planet_bearing(count="2", **{"elements.laminae": "41"}))
    assert len(pair.rows) == 4 and pair.ratings.rows == 2
    assert [len(row.drops) for row in (*bearing.rows, *pair.rows)] == [30, 30, *[41] * 4]
    balls = {"rolling": "ball", "elements.length_mm": None}
    arms = [rolling_bearing(planet_bearing(**balls, **arm)).rows[0].arm for arm in (
        {}, {"elements.tilt_arm_mm": "250"})]  # fmt: skip
    assert arms[0] > 0.2505 and arms[1] == 0.25


def test_rollers_that_spring_say_their_size_once():
    rollers = {
        "rollers.count": "24", "rollers.rows": "2", "rollers.length_mm": "100",
        "rollers.spacing_mm": "120", "rollers.clearance_um": "40",
    }  # fmt: skip
    names = ("elements.diameter_mm", "elements.pitch_diameter_mm")
    drop = {k: None for k in ELEMENTS if k.startswith("elements") and k not in names}
    assert rolling_bearing(planet_bearing(**rollers, **drop)) == rolling_bearing(planet_bearing())
    with pytest.raises(InputError, match=r"elements.count.*is given in rollers"):
        planet_bearing(**rollers)
    with pytest.raises(InputError, match=r"elements.diameter.*only 65"):
        planet_bearing(**rollers, **drop | {"elements.diameter_mm": "70"})
    with pytest.raises(InputError, match=r"rollers.spacing.*0 mm is less than .* 100 mm"):
        planet_bearing(**drop, **rollers | {"rollers.spacing_mm": None})


def test_faced_rows_of_tapered_rollers():
    angles = {"elements.contact_angle_deg": "15"}
    outside = rolling_bearing(planet_bearing(**angles))
    inside = rolling_bearing(planet_bearing(**angles, **{"elements.arrangement": "X"}))
    assert [row.contact_angle > 0 for row in outside.rows] == [True, False]
    assert [row.contact_angle > 0 for row in inside.rows] == [False, True]
    load = [5e5, 0, 0, 0, 3e4]
    tilts = [rate_load(b, load, "inner").rows[0].tilt for b in (outside, inside)]
    assert tilts[0] < tilts[1]  # contact lines that meet outside resist tilt


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"elements.length_mm": None}, r"elements.length.*missing.*add elements.length_mm"),
        ({"elements.spacing_mm": None}, r"elements.spacing.*missing"),
        ({"elements.spacing_mm": "90"}, r"elements.spacing.*90 mm is less than .* 100 mm"),
        ({"rolling": None}, r"rolling.*missing"),
        ({"elements.diameter_mm": "70"}, r"diameter.*only 65"),
        ({"elements.profile": "table"}, r"drops.*needs profile"),
        ({"rolling": "ball"}, r"elements.length.*that of rollers.*delete it"),
        (
            {"rolling": "ball", "elements.length_mm": None, "elements.clearance_um": "3500"},
            r"clearance.*that are 3 mm apart.*below 3 mm",
        ),
    ],
)
def test_bad_elements_are_one_line(changes, line):
    with pytest.raises(InputError, match=line):
        planet_bearing(**changes)


def test_missing_data_of_a_rolling_bearing_are_named():
    assert rolling_bearing(load_case("wind-5mw").stages[0].planet_bearing) is None
    drop = {"rolling": "ball", "elements.length_mm": None, "dynamic_rating_kn": None}
    assert "dynamic_rating" in rolling_bearing(planet_bearing(**drop)).estimates
