"""Paths of contact against real involute flanks at many carrier angles."""

import math

import numpy as np
import pytest
from gears.flanks import Teeth
from gears.stages import contact, flexible_paths, pair_indices

from flexgear.gears.geometry import stage_geometry
from flexgear.model.load import load_case

VARIANTS = [
    {},
    {"stage.planet_hand": "left"},
    {"stage.helix_angle_deg": "0"},
    {"stage.planets": "3", "stage.sun.teeth": "28", "stage.planet.teeth": "32",
     "stage.ring.teeth": "92", "stage.backlash_ring_mm": "0"},
    {"stage.sun.teeth": "27", "stage.sun.profile_shift": "0.3",
     "stage.planet.profile_shift": "-0.3", "stage.ring.profile_shift": "0.3"},
    {"stage.sun.profile_shift": "0.2", "stage.planet.profile_shift": "0.1",
     "stage.ring.profile_shift": "-0.4105", "stage.center_distance_mm": "549.8",
     "stage.planets": "4", "stage.sun.teeth": "27"},
]  # fmt: skip


class Bench:
    """Ring, planets and sun in the carrier frame at a carrier angle, touching on the drive flanks.

    The planet is turned until its flank touches ring tooth 0's; the sun until it touches planet 1.
    """

    def __init__(self, case):
        self.case, self.stage = case, case.stage
        self.g = stage_geometry(case)
        self.paths = flexible_paths(case)
        self.hand = 1.0 if case.stage.planet_hand == "right" else -1.0
        self.tan = math.tan(case.stage.helix_angle)

    def twist(self, name):
        sign = -self.hand if name == "sun" else self.hand
        return sign * self.tan / getattr(self.g, name).reference_radius

    def ring(self, theta, planet):
        """Ring teeth seen from planet axes (its x axis outward), about the ring's centre."""
        first = -theta - self.stage.planet_angles[planet]
        return Teeth(
            self.g.ring, self.g.transverse_angle, self.twist("ring"), first,
            (-self.g.center_distance, 0.0),
        )  # fmt: skip

    def planet(self, theta, planet, first):
        turn = -theta * self.g.ring.teeth / self.g.planet.teeth  # relative to the carrier
        return Teeth(self.g.planet, self.g.transverse_angle, self.twist("planet"), first + turn)

    def sun(self, theta, planet, first):
        turn = theta * self.g.ring.teeth / self.g.sun.teeth
        angle = first + turn - self.stage.planet_angles[planet]
        return Teeth(
            self.g.sun, self.g.transverse_angle, self.twist("sun"), angle,
            (-self.g.center_distance, 0.0),
        )  # fmt: skip


@pytest.fixture(scope="module", params=range(len(VARIANTS)))
def bench(request):
    return Bench(load_case("wind-5mw", VARIANTS[request.param]).view())


def first_angles(bench, kind_of_flank="drive"):
    """Planet tooth 0's angle of every planet and sun tooth 0's, from one contact each."""
    path, planets = bench.paths["ring"], []
    for i in range(bench.stage.planets):
        k = int(pair_indices(path, i, 0.0, 0.0)[0])
        c = contact(path, i, k, 0.0, 0.0)
        number = path.planet_tooth0[i] + path.planet_step * k
        trial = bench.planet(0.0, i, 0.0)
        planets.append(2 * math.pi / trial.gear.teeth * (trial.locate(c, +1) - number))
    path = bench.paths["sun"]
    k = int(pair_indices(path, 0, 0.0, 0.0)[0])
    c = contact(path, 0, k, 0.0, 0.0)
    number = path.gear_tooth0[0] + path.gear_step * k
    trial = bench.sun(0.0, 0, 0.0)
    sun = 2 * math.pi / trial.gear.teeth * (trial.locate(c, SUN_SIDE) - number)
    return planets, sun


# flank sides (+1: towards +angle) of the drive contact, found by hand from the force directions
RING_SIDE, PLANET_RING_SIDE, PLANET_SUN_SIDE, SUN_SIDE = -1, +1, -1, -1
ANGLES = (0.0, 0.1234, 1.0, 2 * math.pi - 0.01, 2 * math.pi + 0.5, -3.3)


def whole(value, teeth, number):
    """Whether a real tooth number is the given one, modulo the teeth."""
    off = (value - number + 0.5 * teeth) % teeth - 0.5 * teeth
    return abs(off) < 1e-8 * teeth


@pytest.mark.parametrize("theta", ANGLES)
def test_both_flanks_pass_through_the_contact_point_with_the_path_normal(bench, theta):
    planets, sun = first_angles(bench)
    for i in range(bench.stage.planets):
        for kind, gear, side, planet_side in (
            ("ring", bench.ring(theta, i), RING_SIDE, PLANET_RING_SIDE),
            ("sun", bench.sun(theta, i, sun), SUN_SIDE, PLANET_SUN_SIDE),
        ):
            path = bench.paths[kind]
            planet = bench.planet(theta, i, planets[i])
            normal = np.array([*path.normal_xy, path.slope]) / math.hypot(1, path.slope)
            for z in (-0.9 * path.half_face, 0.0, 0.6 * path.half_face):
                for c, mine, other in touch(path, i, theta, z, gear, side, planet, planet_side):
                    for teeth, number, which in ((gear, mine, side), (planet, other, planet_side)):
                        radius = float(np.hypot(*(c[:2] - teeth.centre)))
                        n = teeth.normal(number, which, radius, z)
                        assert abs(abs(n @ normal) - 1) < 1e-9
                    # the force on the planet points into its tooth and out of the gear's
                    into = planet.tooth_direction(other, z) - c[:2]
                    out_of = gear.tooth_direction(mine, z) - c[:2]
                    assert into @ path.normal_xy > 0 > out_of @ path.normal_xy


@pytest.mark.parametrize("theta", ANGLES[:3])
def test_coast_flanks_touch_when_the_planet_has_crossed_the_backlash(bench, theta):
    """Ring and sun are thinned behind; one turn of the planet closes all its coast pairs."""
    planets, sun = first_angles(bench)
    cos_bb = math.cos(bench.g.base_helix_angle)
    for i in range(bench.stage.planets):
        path = bench.paths["ring_coast"]
        ring = bench.ring(theta, i)
        ring.thin(bench.stage.backlash_ring / cos_bb, -RING_SIDE)
        turn = -path.backlash / cos_bb / bench.g.planet.base_radius
        planet = bench.planet(theta, i, planets[i] + turn)
        for z in (-0.7 * path.half_face, 0.5 * path.half_face):
            list(touch(path, i, theta, z, ring, -RING_SIDE, planet, -PLANET_RING_SIDE))
        path = bench.paths["sun_coast"]
        # the sun follows the planet, then crosses its own backlash
        follow = turn * bench.g.planet.base_radius
        play = path.backlash / cos_bb
        gear = bench.sun(theta, i, sun - (follow - play) / bench.g.sun.base_radius)
        gear.thin(bench.stage.backlash_sun / cos_bb, -SUN_SIDE)
        for z in (-0.7 * path.half_face, 0.5 * path.half_face):
            list(touch(path, i, theta, z, gear, -SUN_SIDE, planet, -PLANET_SUN_SIDE))


def touch(path, i, theta, z, gear, side, planet, planet_side):
    """Contact points of planet i and numbers of the teeth of gear and planet that meet there."""
    for k in pair_indices(path, i, theta, z):
        c = contact(path, i, k, theta, z)
        mine = path.gear_tooth0[i] + path.gear_step * k
        other = path.planet_tooth0[i] + path.planet_step * k
        assert whole(gear.locate(c, side), path.gear_teeth, mine)
        assert whole(planet.locate(c, planet_side), path.planet_teeth, other)
        yield c, mine, other


def test_shares_of_pairs_are_those_of_the_contact_ratio(bench):
    theta = (np.arange(2000) + 0.5) / 2000 * 2 * np.pi / bench.g.ring.teeth
    for kind, gear_mesh in (("ring", bench.g.ring_gear_mesh), ("sun", bench.g.sun_gear_mesh)):
        path = bench.paths[kind]
        reach = abs(path.slope) * path.half_face
        epsilon = gear_mesh.total_contact_ratio
        assert (path.s_hi - path.s_lo + 2 * reach) / path.base_pitch == pytest.approx(epsilon)
        k = np.arange(-200, 200)
        s = path.s0[1] + k[:, None] * path.base_pitch + path.rate * theta
        count = ((s > path.s_lo - reach) & (s < path.s_hi + reach)).sum(0)
        low = math.floor(epsilon)
        assert set(np.unique(count)) <= {low, low + 1}
        assert np.mean(count == low + 1) == pytest.approx(epsilon - low, abs=2e-3)
        k_pair = np.interp(s, path.s_grid, path.k_grid, left=0, right=0)
        assert ((k_pair > 0).sum(0) == count).mean() > 0.99
