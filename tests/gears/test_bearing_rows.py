"""Loads of rolling elements against closed forms, limits and invariances."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import elliprd, elliprf

from flexgear.coupling.laws.rollers import roller_loads, roller_parameters
from flexgear.gears.bearings.bearing import RollingBearing, equilibrium
from flexgear.gears.bearings.reference_life import Ratings
from flexgear.gears.bearings.rows import (
    BallRow,
    RollerRow,
    point_contact,
    roller_stiffness,
    standard_drops,
)
from flexgear.model.bearings import Rollers
from flexgear.model.errors import FlexgearError

MM, STEEL = 1e-3, 210e9 / 0.91
UNRATED = Ratings(1e5)


def rollers(count=18, gap=0.0, position=0.0, laminae=30, angle=0.0, straight=True):
    drops = (0.0,) * laminae if straight else standard_drops(15 * MM, 16 * MM, angle, laminae)
    return RollerRow(count, 15 * MM, 80 * MM, angle, gap, position, 16 * MM, drops)


def balls(count=9, gap=0.0, angle=0.0, position=0.0):
    return BallRow(count, 12 * MM, 60 * MM, angle, gap, position, 6.24 * MM, 6.36 * MM)


def bearing(*rows):
    return RollingBearing(rows, UNRATED)


@pytest.mark.parametrize(("make", "factor"), [(balls, 4.37), (rollers, 4.08)])
def test_largest_load_of_rigid_rings_without_clearance(make, factor):
    row = make(count=300)
    load = np.array([1e3, 0, 0, 0, 0])
    loads = row.state(equilibrium(bearing(row), load)).element_loads
    assert loads.max() * row.count / 1e3 == pytest.approx(factor, rel=2e-3)
    cos = np.maximum(np.cos(2 * np.pi * np.arange(4000) / 4000), 0)
    load_zone_integral = np.mean(cos ** (row.exponent + 1))  # Sjövall's J_r(1/2)
    assert loads.max() * row.count * load_zone_integral == pytest.approx(1e3, rel=1e-3)


def test_one_roller_under_the_load_carries_it_all():
    """With a gap so wide that its neighbours stay free: δ = g + (F/c_L)^0.9."""
    row = rollers(count=6, gap=1 * MM)
    u = equilibrium(bearing(row), np.array([500.0, 0, 0, 0, 0]))
    stiffness = 35948 * 16 ** (8 / 9)  # N/mm^(10/9)
    assert 1e3 * u[0] == pytest.approx(1 + (500 / stiffness) ** 0.9, rel=1e-9)
    assert row.state(u).element_loads == pytest.approx([500, 0, 0, 0, 0, 0], rel=1e-7)


def test_the_law_that_dynamics_use_has_the_same_loads():
    """Up to its neglect of the rollers' own tilt."""
    section = Rollers(count=18, rows=2, length=16 * MM, spacing=20 * MM, clearance=10e-6)
    x, y, rx, ry = 30e-6, -10e-6, 2e-4, 3e-4
    parameters = np.array(roller_parameters(section, 1e9, 0.0))
    expected = roller_loads(parameters, np.array([[x, y, rx, ry]]), np.zeros(1))[0]
    motion = np.array([x, y, 0, rx, ry])
    for position, loads in zip(section.places, expected, strict=True):
        row = rollers(gap=10e-6, position=position, laminae=1)
        assert row.state(motion).element_loads == pytest.approx(loads, rel=1e-12)


motions = st.tuples(*[st.floats(-5e-5, 5e-5)] * 3, *[st.floats(-1e-3, 1e-3)] * 2)


@pytest.mark.parametrize(
    "row",
    [
        rollers(gap=5e-6, position=7 * MM, straight=False),
        rollers(angle=-0.3, gap=-5e-6),
        balls(gap=5e-6, position=3 * MM),
        balls(angle=0.6),
    ],
)
@given(motion=motions, towards=st.tuples(*[st.floats(-1, 1)] * 5))
def test_force_and_tangent_are_derivatives_of_the_energy(row, motion, towards):
    """By central differences, to what force and tangent change over the step."""
    step = 1e-9 * np.array([1, 1, 1, 50, 50]) * np.array(towards)
    state = row.state(np.array(motion))
    after, before = (row.state(np.array(motion) + sign * step) for sign in (1, -1))
    work = state.force @ step
    bound = np.abs((after.force - state.force) @ step) + np.abs((before.force - state.force) @ step)
    assert abs((after.energy - before.energy) / 2 - work) <= bound + 1e-11 * state.energy + 1e-20
    bent = step @ state.tangent @ step
    bound = sum(abs(step @ other.tangent @ step - bent) for other in (after, before))
    change = (after.force - before.force) @ step / 2
    noise = 1e-13 * np.abs(state.force) @ np.abs(step)
    assert abs(change - bent) <= bound + 1e-6 * bent + noise + 1e-20


@pytest.mark.parametrize("row", [rollers(gap=5e-6, straight=False), balls(gap=5e-6)])
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, -1.3])
def test_equilibrium_balances_and_turns_with_the_load(row, angle):
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s], [s, c]])
    load = np.array([4e3, 0, 0, 0, 12.0])
    straight = equilibrium(bearing(row), load)
    turned = np.concatenate([turn @ load[:2], [0], turn @ load[3:]])
    motion = equilibrium(bearing(row), turned)
    force = row.state(motion, angle).force
    assert force == pytest.approx(turned, abs=4e3 * 1e-7)
    assert motion[:2] == pytest.approx(turn @ straight[:2], rel=1e-5, abs=1e-10)
    assert motion[3:] == pytest.approx(turn @ straight[3:], rel=1e-5, abs=1e-9)


def test_two_rows_are_one_row_cut_apart():
    """Tilt and eccentric load included, as laminae stand at the same places."""
    whole = RollerRow(18, 15 * MM, 80 * MM, 0, 5e-6, 0, 16 * MM, (0.0,) * 40)
    halves = [
        RollerRow(18, 15 * MM, 80 * MM, 0, 5e-6, z * MM, 8 * MM, (0.0,) * 20) for z in (-4, 4)
    ]
    motion = np.array([2e-5, 1e-5, 0, 2e-4, 9e-4])
    together = sum(row.state(motion).force for row in halves)
    ratio = 2 * roller_stiffness(8 * MM) / roller_stiffness(16 * MM)  # c_L grows as L^(8/9)
    assert together == pytest.approx(ratio * whole.state(motion).force, rel=1e-12)


def test_pure_thrust_on_angular_contact_balls():
    """Every ball carries F/(Z sin α); α grows with it, tan α = (A sin α₀ + δ_a)/(A cos α₀)."""
    row = balls(angle=0.5)
    motion = equilibrium(bearing(row), np.array([0, 0, 3e3, 0, 0]))
    state = row.state(motion)
    distance = 0.6 * MM
    alpha = math.atan2(distance * math.sin(0.5) + motion[2], distance * math.cos(0.5))
    assert alpha > 0.5
    assert state.element_loads == pytest.approx(np.full(9, 3e3 / 9 / math.sin(alpha)), rel=1e-6)


def test_faced_rows_take_thrust_either_way():
    pair = bearing(balls(angle=-0.5, position=5 * MM), balls(angle=0.5, position=-5 * MM))
    ahead = equilibrium(pair, np.array([2e3, 0, 1e3, 0, 0]), {"rx": 0, "ry": 0})
    back = equilibrium(pair, np.array([2e3, 0, -1e3, 0, 0]), {"rx": 0, "ry": 0})
    assert ahead[2] == pytest.approx(-back[2], rel=1e-5) and ahead[0] == pytest.approx(back[0])


def test_loads_that_a_bearing_cannot_balance_are_refused():
    with pytest.raises(FlexgearError, match="takes no axial load"):
        equilibrium(bearing(rollers()), np.array([1e3, 0, 1.0, 0, 0]))
    with pytest.raises(FlexgearError, match="no equilibrium"):
        equilibrium(bearing(balls(angle=0.5)), np.array([0, 0, -1e3, 0, 0]))


@given(share=st.floats(1e-3, 1.0), size=st.floats(10, 1e4))
@example(share=1 - 1e-6, size=10.0)
@example(share=1 - 1.9e-4, size=10.0)
@example(share=1 - 2.1e-4, size=10.0)
def test_point_contact_meets_hertz_by_carlsons_integrals(share, size):
    """Johnson 1985, eq. 3.63: the potential of an ellipsoidal pressure gives both curvatures and
    the approach."""
    contact = point_contact(size, share * size, STEEL)
    a, b = contact.semi_axes(100.0)
    assert float(contact.pressure(100.0)) * 2 / 3 * math.pi * a * b == pytest.approx(100, rel=1e-10)
    factor = 3 * 100 / (4 * math.pi * STEEL / 2)
    assert factor * 2 / 3 * elliprd(0, a**2, b**2) == pytest.approx(size / 2, rel=1e-5)
    assert factor * 2 / 3 * elliprd(0, b**2, a**2) == pytest.approx(share * size / 2, rel=1e-5)
    approach = factor * 2 * elliprf(0, a**2, b**2)
    assert contact.compliance * 100 ** (2 / 3) == pytest.approx(approach, rel=1e-5)


def test_pressure_of_a_cylinder_in_rings():
    """Hertz: p² = w E*/(π R), R = D/2 (1 ∓ γ)."""
    row = rollers(laminae=1)
    p = row.pressure(np.full((18, 1), 2e3))
    gamma = 15 / 80
    radii = 7.5 * MM * np.array([1 - gamma, 1 + gamma])
    assert p == pytest.approx(np.sqrt(2e3 / (16 * MM) * STEEL / 2 / math.pi / radii), rel=1e-12)


def test_logarithmic_profile():
    """Means over the roller: ∫ ln 1/(1 − u²) du over (0, 1) is 2 − 2 ln 2."""
    drops = np.array(standard_drops(20 * MM, 40 * MM, laminae=2000))
    assert drops.mean() == pytest.approx(0.00035 * 20 * MM * (2 - 2 * math.log(2)), rel=1e-3)
    long = np.array(standard_drops(10 * MM, 50 * MM, laminae=2000))
    assert not long[500:1500].any() and long[0] > 0
    ends = 0.0005 * 10 * MM * (2 - 2 * math.log(2)) / 2  # of half the length
    assert long.mean() == pytest.approx(ends, rel=2e-3)
    assert quad(lambda u: -math.log(1 - u**2), 0, 1)[0] == pytest.approx(2 - 2 * math.log(2))
