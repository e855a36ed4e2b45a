"""Tooth numbers and profile shifts of a planetary stage for a ratio and a number of planets.

Ring teeth z_r = z_s + 2 z_p, or one more, so that planets are half a tooth smaller than there is
room and the sun's gear mesh is spread to the ring's centre distance; (z_s + z_r)/N is whole, so
that N planets at equal spacing find their teeth. All lengths here are in normal modules.

Shifts: x_r = −x_p keeps ring and planet at their reference distance, and with the sum of sun and
planet Σ that fits it, by ISO/TR 4467 with λ = 0.5 (1: the smaller, u = z_2/z_1)

    x_1 = λ (u − 1)/(u + 1) + Σ/(u + 1).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from flexgear.gears.tooth import ToothGeometry, involute, tooth_geometry, transverse_angle
from flexgear.gears.tooth_warnings import NOTHING, proud_of_tip
from flexgear.model.planetary_gears import Gear

PRESSURE_ANGLE = math.radians(20.0)  # ISO 53
LEAST_TEETH, MOST_SUN, MOST_RING = 17, 160, 400  # the least is not undercut without shift
USUAL_PINION = 23  # teeth: fewer bend more easily, more need a larger gear for the same module
WRONG = 0.05  # that a ratio may be off; an exact one comes first
ROOM = 0.25  # modules between the tips of neighbouring planets; a module and more is usual
LEAST_RATIO = 1.1  # transverse contact ratio
LEAST_TIP = 0.25  # modules
LEAST_ADDENDUM = 0.8  # modules, of a ring that clears the roots of its planets
ROOTS = ((1.25, 0.38), (1.4, 0.39))  # dedendum and tool's tip of a ring: ISO 53 profiles A and D


@dataclass(frozen=True)
class Rack:
    """ISO 53 profile A of one module."""

    helix_angle: float
    normal_module: float = 1.0
    pressure_angle: float = PRESSURE_ANGLE


@dataclass(frozen=True)
class ToothNumbers:
    """Teeth and profile shifts of sun, planet, ring; ring_addendum: over the module, 1 or less
    where its tip must clear the planets' root; ring_dedendum, ring_fillet: likewise, deeper where
    the planets' tips must clear its root; distance: between centres, in normal modules."""

    sun: int
    planet: int
    ring: int
    shifts: tuple[float, float, float]
    ring_addendum: float
    ring_dedendum: float
    ring_fillet: float
    distance: float


def tooth_numbers(basic_ratio: float, planets: int, helix: float) -> Iterator[ToothNumbers]:
    """Those that mesh and assemble for z_r/z_s about ``basic_ratio``, the best first: an exact
    ratio, teeth that meet all others (no common divisor), a pinion of usual size, room between
    planets."""
    for _, sun, planet, ring in sorted(_candidates(basic_ratio, planets, helix)):
        meshing = _meshing(sun, planet, ring, helix)
        if meshing is not None:
            yield meshing


def _candidates(
    basic_ratio: float, planets: int, helix: float
) -> Iterator[tuple[float, int, int, int]]:
    for sun in range(LEAST_TEETH, MOST_SUN + 1):
        about = sun * basic_ratio
        low, high = math.ceil(about * (1 - WRONG)), math.floor(about * (1 + WRONG))
        for ring in range(max(low, sun + 2 * LEAST_TEETH), min(high, MOST_RING) + 1):
            planet = (ring - sun) // 2
            room = _room(planet, ring, planets, helix)
            if (sun + ring) % planets == 0 and room >= ROOM:
                cost = _cost(abs(ring / about - 1), sun, planet, ring)
                yield cost + max(0.0, 1.0 - room), sun, planet, ring


def _room(planet: int, ring: int, planets: int, helix: float) -> float:
    """Between the tips of neighbouring planets without shift; less for one that they thicken."""
    distance = (ring - planet) / math.cos(helix)
    return distance * math.sin(math.pi / planets) - planet / math.cos(helix) - 2.0


def _cost(wrong: float, sun: int, planet: int, ring: int) -> float:
    """One unit: a common divisor, ten teeth off the usual pinion, a thousandth off the ratio."""
    divisors = (math.gcd(sun, planet) > 1) + (math.gcd(ring, planet) > 1)
    inexact = 0.0 if wrong < 1e-6 else 5.0 + 1e3 * wrong
    return inexact + divisors + abs(min(sun, planet) - USUAL_PINION) / 10


def _meshing(sun: int, planet: int, ring: int, helix: float) -> ToothNumbers | None:
    """With shifts and addendum; None where teeth interfere, are too thin or hardly overlap."""
    rack = Rack(helix)
    alpha, cosine = transverse_angle(rack), math.cos(helix)
    distance, reference = (ring - planet) / (2 * cosine), (sun + planet) / (2 * cosine)
    working = math.acos(reference * math.cos(alpha) / distance)
    total = (involute(working) - involute(alpha)) * (sun + planet)
    total /= 2 * math.tan(PRESSURE_ANGLE)
    x_sun, x_planet = _shares(sun, planet, total)
    shifts = (x_sun, x_planet, round(-x_planet, 4) + 0.0)
    wheels = {
        "sun": Gear(teeth=sun, profile_shift=x_sun),
        "planet": Gear(teeth=planet, profile_shift=x_planet),
    }
    external = {name: tooth_geometry(gear, rack) for name, gear in wheels.items()}
    addendum = _ring_addendum(planet, ring, x_planet, rack)
    if addendum < LEAST_ADDENDUM or min(map(_tip, external.values())) * cosine < LEAST_TIP:
        return None
    body = external["planet"]
    for dedendum, fillet in ROOTS:
        gear = Gear(
            teeth=ring, profile_shift=shifts[2], addendum=addendum, dedendum=dedendum,
            root_fillet=fillet,
        )  # fmt: skip
        hollow = tooth_geometry(gear, rack, internal=True)
        if _is_clear(hollow, body, alpha):
            break
    ratios = [_ratio(body, external["sun"], working), _ratio(body, hollow, alpha)]
    if min(ratios) < LEAST_RATIO or body.interferes_with(hollow, alpha):
        return None
    pairs = ((body, external["sun"], working), (external["sun"], body, working))
    if not all(_is_clear(*pair) for pair in (*pairs, (body, hollow, alpha), (hollow, body, alpha))):
        return None
    return ToothNumbers(sun, planet, ring, shifts, addendum, dedendum, fillet, distance)


def _is_clear(tooth: ToothGeometry, mate: ToothGeometry, angle: float) -> bool:
    """Whether the mate's tip stays off the tooth's root."""
    return proud_of_tip(tooth, mate, angle) <= NOTHING


def _shares(sun: int, planet: int, total: float) -> tuple[float, float]:
    """x_s and x_p of the sum ``total``; neither gear is undercut."""
    small, large = sorted((sun, planet))
    u = large / small
    x = 0.5 * (u - 1) / (u + 1) + total / (u + 1)
    x = round(min(max(x, 1 - small / LEAST_TEETH), total - 1 + large / LEAST_TEETH), 4)
    other = round(total - x, 4)
    return (x, other) if sun <= planet else (other, x)


def _tip(tooth: ToothGeometry) -> float:
    return tooth.thickness_at(tooth.tip_radius)


def _ratio(planet: ToothGeometry, gear: ToothGeometry, angle: float) -> float:
    low, high = planet.path_of_contact(gear, angle)
    return (high - low) / planet.base_pitch


def _ring_addendum(planet: int, ring: int, x_planet: float, rack: Rack) -> float:
    """1, or so much less that the ring's tip meets the planets' flank above what the rack's tip
    rounding leaves: its roll length is at least that there, r_p sin α_t − (h_F − x_p)/sin α_t,
    and the tangent distance (r_r − r_p) sin α_t."""
    alpha, cosine = transverse_angle(rack), math.cos(rack.helix_angle)
    gear = Gear(teeth=planet)
    straight = gear.dedendum - gear.root_fillet * (1 - math.sin(rack.pressure_angle))
    reference = ring / (2 * cosine)
    roll = reference * math.sin(alpha) - (straight - x_planet) / math.sin(alpha)
    tip = math.hypot(reference * math.cos(alpha), max(roll, 0.0))
    return min(1.0, math.floor(100 * (reference - tip + x_planet)) / 100)
