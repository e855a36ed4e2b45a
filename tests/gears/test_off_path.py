"""Tips that touch beyond the path of contact, against outlines turned until they meet."""

import math
from dataclasses import replace

import numpy as np
import pytest
from gears.stages import flexible_paths

from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case

VARIANTS = {
    "standard": {},
    "spur": {"stage.helix_angle_deg": "0"},
    "shifted": {
        "stage.sun.profile_shift": "0.2", "stage.planet.profile_shift": "0.1",
        "stage.ring.profile_shift": "-0.4105", "stage.center_distance_mm": "549.8",
        "stage.planets": "4",
    },
    # the whole path lies on one side of the pitch point: a tip comes nearer to its mate's root
    "one_sided": {
        "stage.sun.profile_shift": "-0.6", "stage.planet.profile_shift": "0.6",
        "stage.ring.profile_shift": "-0.6",
        "stage.sun.addendum": "0.5", "stage.ring.addendum": "0.5", "stage.planets": "4",
    },
}  # fmt: skip
BOTH = pytest.mark.parametrize("kind", ["ring", "sun"])
EVERY = pytest.mark.parametrize("name", VARIANTS)


@pytest.fixture(scope="module")
def stages():
    by_name = {}
    for name, keys in VARIANTS.items():
        case = load_case("wind-5mw", keys).view()
        by_name[name] = (stage_geometry(case), flexible_paths(case))
    return by_name


class Outlines:
    """Planet at the origin and gear on the x axis, turning as they roll, as sets of points.

    The +y flank of the planet's tooth presses the gear's tooth above it: at s on the line of action
    T + s n, T = r_b (cos α, −sin α), n = (sin α, cos α). Gears are turned until no point of the one
    is inside the other.
    """

    def __init__(self, g, kind, middle):
        self.planet, self.gear = g.planet, g.gears[kind]
        self.angle = g.gear_meshes[kind].working_angle
        self.sense = -1.0 if self.gear.internal else 1.0  # the gear's centre, and how it turns
        self.distance = self.sense * g.center_distance
        self.profile = {kind: _half(t) for kind, t in (("planet", g.planet), ("gear", self.gear))}
        self.s, self.turned = middle, self.gear_touch(middle)

    def planet_angle(self, s):
        """Middle of the planet's tooth that is touched at s."""
        base = self.planet.base_radius
        half = float(self.planet.half_angle(math.hypot(base, s)))
        return math.atan2(s, base) - self.angle - half

    def gear_angle(self, s):
        """Middle of the gear's tooth, rolled on from where both were made to touch."""
        return self.turned - self.sense * (s - self.s) / self.gear.base_radius

    def gear_touch(self, s):
        """The gear's angle at which it touches the planet."""
        radius, half = self.profile["planet"]
        seen = radius * np.exp(1j * (self.planet_angle(s) + half)) - self.distance
        if not self.gear.internal:
            seen = -seen  # angles from −x
        return self._free(seen, "gear")

    def planet_touch(self, s):
        """The planet's angle at which it touches the gear."""
        radius, half = self.profile["gear"]
        seen = self.sense * -1 * radius * np.exp(1j * (self.gear_angle(s) + self.sense * half))
        return self._free(seen + self.distance, "planet")

    def _free(self, seen, name):
        """Angle of tooth ``name`` that the points, about its centre, leave."""
        radius, half = self.profile[name]
        at = np.abs(seen)
        common = (at >= radius[0]) & (at <= radius[-1])
        side = np.interp(at[common], radius, half)
        angle = np.angle(seen[common])
        if name == "gear" and self.gear.internal:
            return float((angle + side).max())
        return float((angle - side).min())

    def gap(self, s):
        """Turn of the gear that is not at its tip, on its base circle."""
        if s > self.s:
            room = self.gear_touch(s) - self.gear_angle(s)
            return self.sense * room * self.gear.base_radius
        return (self.planet_touch(s) - self.planet_angle(s)) * self.planet.base_radius


def _half(tooth, points=20_000):
    """Radius rising and half angle of flank and fillet, (n,)."""
    line = tooth.profile(points, points)
    radius, half = np.hypot(*line.T), np.arctan2(line[:, 1], line[:, 0])
    order = np.argsort(radius)
    return radius[order], half[order]


def beyond(path, distances):
    """Path coordinates so far before and after the path."""
    return np.concatenate([path.s_lo - distances, path.s_hi + distances])


@EVERY
@BOTH
def test_gap_is_what_a_gear_turns_until_outlines_meet(stages, name, kind):
    g, paths = stages[name]
    path = paths[kind]
    outlines = Outlines(g, kind, 0.5 * (path.s_lo + path.s_hi))
    inside = np.linspace(path.s_lo, path.s_hi, 9)
    assert [outlines.gap(s) for s in inside] == pytest.approx(np.zeros(9), abs=2e-9)
    places = beyond(path, np.array([0.05, 0.1, 0.2]) * path.base_pitch)
    expected = np.array([outlines.gap(s) for s in places]) * path.cos_base_helix
    assert path.off_path.gap(places) == pytest.approx(expected, rel=1e-3)


@EVERY
@BOTH
def test_span_ends_where_the_gap_is_the_approach(stages, name, kind):
    _, paths = stages[name]
    path, approach = paths[kind], 2e-5
    low, high = path.off_path.span(approach)
    assert low < path.s_lo and high > path.s_hi
    assert path.off_path.gap(np.array([low, high])) == pytest.approx([approach] * 2, rel=1e-6)
    assert path.off_path.span(0.0) == pytest.approx((path.s_lo, path.s_hi), abs=1e-12)


@BOTH
def test_rolls_meet_at_the_ends(stages, kind):
    """On the path both lie on the line of action; the edge keeps its own, its mate's goes on."""
    g, paths = stages["standard"]
    path, offset = paths[kind], g.center_distance * math.sin(paths[kind].alpha)
    sign = 1 if kind == "ring" else -1
    step = 1e-9
    ends = np.array([path.s_lo - step, path.s_lo, path.s_hi, path.s_hi + step])
    planet, gear = path.off_path.rolls(ends)
    assert planet == pytest.approx(ends, abs=10 * step)
    assert gear == pytest.approx(offset + sign * ends, abs=10 * step)
    far = np.array([path.s_lo - 5e-3, path.s_hi + 5e-3])
    planet, gear = path.off_path.rolls(far)
    assert gear[0] == pytest.approx(g.gears[kind].roll_length(g.gears[kind].tip_radius))
    assert planet[1] == pytest.approx(g.planet.roll_length(g.planet.tip_radius))


def test_path_that_ends_without_a_tip_is_not_prolonged():
    """A sun whose flank ends at its base circle before the planet's tip comes there."""
    case = load_case("wind-5mw", {
        "stage.sun.teeth": "12", "stage.planet.teeth": "42", "stage.planets": "3",
        "stage.ring.teeth": "96",
    }).view()  # fmt: skip
    path = flexible_paths(case)["sun"]
    assert path.off_path.after is None
    assert np.isinf(path.off_path.gap(path.s_hi + 1e-3))
    assert path.off_path.span(1e-4)[1] == path.s_hi


@pytest.mark.parametrize("short", [0.68, 0.72])
def test_thick_fillet_closes_the_gap(stages, short):
    """A planet's root that reaches above what the sun's tip needs: its tool is too short."""
    g, paths = stages["one_sided"]
    path, less = paths["sun"], short * 18e-3
    tool = replace(g.planet.tool, depth=g.planet.tool.depth - less)
    planet = replace(g.planet, tool=tool, root_radius=g.planet.root_radius + less)
    plain = path.off_path
    assert planet.form_radius > math.hypot(planet.base_radius, path.s_lo)
    outlines = Outlines(replace(g, gears={**g.gears, "planet": planet}), "sun", path.s_hi)
    places = path.s_lo - np.array([0.02, 0.1]) * path.base_pitch
    expected = np.array([outlines.gap(s) for s in places]) * path.cos_base_helix
    gaps = replace(plain, planet=planet).gap(places)
    assert gaps == pytest.approx(expected, abs=1e-8)
    assert (gaps < plain.gap(places) - 1e-6).all()
