"""Contact of modified flanks across the profile: rigid curves laid on each other, a half plane
pressed with them, and closed forms."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from gears.stages import Gear

from flexgear.gears.off_path import OffPath
from flexgear.gears.profile_contact import FlankPair, profile_contact

MODULE, ANGLE = 18e-3, math.radians(20)
YOUNG, POISSON = 210e9, 0.3
PRESSED = 2 * (1 - POISSON**2) / (math.pi * YOUNG)
UM = 1e-6


def tooth(teeth, internal=False):
    """Standard teeth of module 18 mm, straight."""
    gear = Gear(teeth, profile_shift=0.0, root_fillet=0.38, normal_module=MODULE)
    return gear.tooth(internal)


@dataclass(frozen=True)
class Pair:
    """Planet of 33 teeth with a sun of 27 or a ring of 93; relief of both tips: amount µm, length
    mm on the path, power."""

    internal: bool
    amount: float
    length: float
    power: int = 1
    cos_base_helix: float = 1.0

    def __post_init__(self):
        gear = tooth(93, True) if self.internal else tooth(27)
        planet = tooth(33)
        arms = gear.base_radius + (-1 if self.internal else 1) * planet.base_radius
        offset = arms * math.tan(ANGLE)
        path = planet.path_of_contact(gear, ANGLE)
        off = OffPath(planet, gear, offset, *path, self.cos_base_helix)
        tips = [math.sqrt(one.tip_radius**2 - one.base_radius**2) for one in (planet, gear)]
        for name, value in (("planet", planet), ("gear", gear), ("off", off), ("tips", tips)):
            object.__setattr__(self, name, value)

    def relief(self, k):
        """What planet (0) or gear (1) lacks at a roll length, m."""
        return lambda roll, z=0.0: (
            self.amount
            * UM
            * np.clip(1 - np.abs(roll - self.tips[k]) / (1e-3 * self.length), 0, 1) ** self.power
            + 0.0 * np.asarray(z)
        )

    @property
    def flanks(self):
        return FlankPair(self.relief(0), self.relief(1), self.off)

    def gap(self, s, load=0.0):
        """As flexgear has it, rigid or under a line load, m."""
        contact = profile_contact(self.flanks, (self.off.s_lo, self.off.s_hi), 0.1, PRESSED, load)
        z = np.zeros_like(s)
        return contact.gap_at(s, z) + load * contact.at(contact.secant, s, z)


# ------------------------------------------------------------------------------- rigid curves
def curve(pair, k, low, high, count=20001):
    """Points of a modified flank at +θ of a tooth along +x (complex): the involute less what is
    ground off along its normal."""
    gear = (pair.planet, pair.gear)[k]
    rho = np.linspace(low, high, count)
    alpha = np.arctan2(rho, gear.base_radius)
    half = math.pi / (2 * gear.teeth) + (math.tan(ANGLE) - ANGLE)
    out = -1.0 if gear.internal else 1.0
    theta = math.pi / (2 * gear.teeth) - out * ((np.tan(alpha) - alpha) - (math.tan(ANGLE) - ANGLE))
    assert half > 0
    normal = np.exp(1j * theta) * (1j * np.cos(alpha) + out * np.sin(alpha))
    return np.hypot(rho, gear.base_radius) * np.exp(1j * theta) - normal * pair.relief(k)(rho)


def laid_on(pair, s):
    """By how much the planet turns on its base circle until the flanks touch, m: its +θ flank, and
    the flank of the gear that faces it, both turned as involutes touch at s."""
    planet, gear, reach = pair.planet, pair.gear, 2e-3
    touch = planet.base_radius * np.exp(-1j * ANGLE) + s * 1j * np.exp(-1j * ANGLE)
    distance = (planet.base_radius + gear.base_radius) / math.cos(ANGLE)
    if pair.internal:
        distance = -(gear.base_radius - planet.base_radius) / math.cos(ANGLE)
    ends = [math.sqrt(max((s + k * reach * 4) ** 2, 1e-8)) for k in (-1, 1)]
    mine = curve(pair, 0, ends[0], min(ends[1], pair.tips[0]))
    on_gear = abs(touch - distance)
    mate_roll = math.sqrt(on_gear**2 - gear.base_radius**2)
    low, high = mate_roll - 8 * reach, mate_roll + 8 * reach
    if pair.internal:
        theirs = np.conj(curve(pair, 1, max(low, pair.tips[1]), high))
    else:
        theirs = curve(pair, 1, max(low, 1e-4), min(high, pair.tips[1]))

    def turned(points, gear_of, centre, side):
        # the unmodified flank passes through the touch
        alpha = np.arccos(gear_of.base_radius / abs(touch - centre))
        out = -1.0 if gear_of.internal else 1.0
        half = math.pi / (2 * gear_of.teeth)
        half -= out * ((np.tan(alpha) - alpha) - (math.tan(ANGLE) - ANGLE))
        return centre + points * np.exp(1j * (np.angle(touch - centre) - side * half))

    mine = turned(mine, planet, 0.0, 1)
    theirs = turned(theirs, gear, distance, -1 if pair.internal else 1)
    angles = []
    for points, others, sign in ((mine, theirs, 1.0), (theirs, mine, -1.0)):
        order = np.argsort(abs(others))
        inside = (abs(points) > abs(others).min()) & (abs(points) < abs(others).max())
        at = np.interp(abs(points[inside]), abs(others)[order], np.angle(others)[order])
        angles.append(sign * (at - np.angle(points[inside])))
    return np.concatenate(angles).min() * planet.base_radius


PAIRS = [
    Pair(internal, *relief)
    for internal in (False, True)
    for relief in ((20, 8), (40, 20), (40, 15, 2))
]


@pytest.mark.parametrize("pair", PAIRS, ids=str)
def test_rigid_flanks_touch_where_curves_do(pair):
    """Kinks, slopes and tips; to a per cent of what is missing, as gaps are taken along another
    line there (``off_path``), and 0.02 µm."""
    low, high = pair.off.s_lo, pair.off.s_hi
    s = np.concatenate([np.linspace(low + 1e-5, low + 1.2 * pair.length * 1e-3, 9),
                        np.linspace(high - 1.2 * pair.length * 1e-3, high - 1e-5, 9)])  # fmt: skip
    expected = np.array([laid_on(pair, x) for x in s])
    missing = pair.flanks.missing(pair.off.rolls(s), 0.0)
    assert abs(pair.gap(s) - expected).max() < 0.02 * UM + 0.005 * missing.max()
    assert abs(missing - expected).max() > 0.3 * UM  # what flanks would lack where they roll


def test_a_slope_and_a_kink_in_closed_form():
    """g − ½ρ g_y² on the slope, g_y per length of profile, and y²/(2ρ) near the kink: an internal
    pair with 2.5e-3 per roll length lacks 3.0 µm of what it rolls by."""
    pair = Pair(True, 20, 8)
    start = pair.off.s_hi - 8e-3
    for s in (start + 4e-3, start + 1e-3):
        mate = pair.off.offset + s
        rho = s * mate / (mate - s)
        slope = 2.5e-3 * pair.planet.base_radius / s
        y = (start**2 - s**2) / (2 * pair.planet.base_radius)
        plain = 2.5e-3 * (s - start)
        by_hand = plain - 0.5 * rho * slope**2 if -y > rho * slope else y**2 / (2 * rho)
        gap = pair.gap(np.array([s]))[0]
        assert gap == pytest.approx(by_hand, abs=0.06 * UM)
        if s == start + 4e-3:
            assert plain - gap == pytest.approx(3.0 * UM, abs=0.1 * UM)


def test_helical_flanks_lack_the_same_times_the_cosine():
    spur, helical = Pair(True, 40, 20), Pair(True, 40, 20, 1, 0.9)
    s = np.linspace(spur.off.s_lo, spur.off.s_hi, 41)
    assert helical.gap(s) == pytest.approx(0.9 * spur.gap(s), abs=1e-12)


def test_lead_modifications_move_nothing_across_the_profile():
    """And off the path the gap is that of the tip edge with what the lead lacks."""
    pair = Pair(False, 0, 1)
    crowned = FlankPair(lambda rho, z: 4e-4 * z**2 + 0 * rho, pair.relief(1), pair.off)
    span = pair.off.span(30 * UM)
    contact = profile_contact(crowned, span, 0.1, PRESSED, 1e6)
    s = np.linspace(*span, 33)
    z = np.linspace(-0.1, 0.1, 33)
    assert contact.gap_at(s, z) == pytest.approx(pair.off.gap(s) + 4e-4 * z**2, abs=2e-9)
    assert (
        not contact.secant.any() and not contact.centre.any() and np.all(contact.narrowing == 1.0)
    )


def test_a_twist_is_looked_at_all_along_the_face():
    """Relief that fades towards one end of the face: there as without, at the other as with all."""
    pair = Pair(True, 40, 20)
    fading = FlankPair(
        lambda rho, z: pair.relief(0)(rho) * (0.5 + 5 * z),
        lambda rho, z: pair.relief(1)(rho) * (0.5 + 5 * z),
        pair.off,
    )
    contact = profile_contact(fading, (pair.off.s_lo, pair.off.s_hi), 0.1, PRESSED, 0.0)
    s = np.linspace(pair.off.s_lo, pair.off.s_hi, 33)
    assert contact.gap_at(s, np.full_like(s, 0.1)) == pytest.approx(pair.gap(s), abs=1e-8)
    assert contact.gap_at(s, np.full_like(s, -0.1)) == pytest.approx(0.0 * s, abs=1e-8)


# ------------------------------------------------------------------------- elastic half plane
def pressed(gap, load, reach, count=801):
    """Approach of a half plane pressed on an even grid: every cell's pressure sinks the surface by
    the integral of −2/(πE*) ln|y| over it; cells that pull are left out until none does."""
    y = np.linspace(-reach, reach, count)
    step = y[1] - y[0]

    def running(x):
        return x * (np.log(np.maximum(abs(x), 1e-300) / reach) - 1)

    distance = y[:, None] - y
    sinks = -2 * PRESSED * (running(distance + step / 2) - running(distance - step / 2))
    g = gap(y)
    touching = g <= np.sort(g)[20]
    for _ in range(100):
        n = np.flatnonzero(touching)
        both = np.linalg.solve(sinks[np.ix_(n, n)], np.column_stack([np.ones(len(n)), g[n]]))
        approach = (load / step + both[:, 1].sum()) / both[:, 0].sum()
        p = np.zeros(count)
        p[n] = approach * both[:, 0] - both[:, 1]
        carries = p - 1e12 * (g + sinks @ p - approach) > 0
        if (carries == touching).all():
            return approach
        touching = carries
    raise AssertionError


@pytest.mark.parametrize("load", [1.8e6, 0.2e6])
@pytest.mark.parametrize("from_tip", [9e-3, 8e-3, 6.5e-3, 4e-3])
def test_a_pressed_half_plane_closes_by_as_much_more_than_hertz_says(from_tip, load):
    """Before the kink, over it, beyond it: within 0.1 µm of 1 to 8 µm that rigid flanks miss."""
    pair = Pair(True, 20, 8)
    s = pair.off.s_hi - from_tip
    mate = pair.off.offset + s
    rho = s * mate / (mate - s)

    def parabola(y):
        return y**2 / (2 * rho)

    def ground(y):
        rolls = [np.sqrt(roll**2 + 2 * gear.base_radius * y)
                 for roll, gear in ((s, pair.planet), (mate, pair.gear))]  # fmt: skip
        return parabola(y) + pair.relief(0)(rolls[0]) + pair.relief(1)(rolls[1])

    reach = 5.0 * math.sqrt(4 * rho * PRESSED * load)
    expected = pressed(ground, load, reach) - pressed(parabola, load, reach)
    assert pair.gap(np.array([s]), load)[0] == pytest.approx(expected, abs=0.1 * UM)
