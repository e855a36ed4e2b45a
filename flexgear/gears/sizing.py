"""A first proposal of planetary stages from ratio, torque and speed: teeth, module, face width.

Ring teeth z_r = z_s + 2 z_p, or one more, so that planets are half a tooth smaller than there is
room and the sun's gear mesh is spread to the ring's centre distance; (z_s + z_r)/N is whole, so
that N planets at equal spacing find their teeth. All lengths here are in normal modules.

Shifts: x_r = −x_p keeps ring and planet at their reference distance, and with the sum of sun and
planet Σ that fits it, by ISO/TR 4467 with λ = 0.5 (1: the smaller, u = z_2/z_1)

    x_1 = λ (u − 1)/(u + 1) + Σ/(u + 1).

Rules of thumb with their sources; they give a stage that can be computed, not one that is proven.
With T_s the torque of the sun and k = z_r/z_s, the ring has k T_s and the carrier (1 + k) T_s,
whichever of the three is held.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from flexgear.gears.implausible import NOTHING, proud_of_tip
from flexgear.gears.tooth import (
    PlainRack,
    ToothGeometry,
    involute,
    tooth_geometry,
    transverse_angle,
)
from flexgear.model.errors import InputError
from flexgear.model.member import Gear

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
class GearSet:
    """Gears by "sun", "planet" and "ring", their teeth of one module, and the distance between
    centres in normal modules. The ring's addendum is below 1 where its tip must clear the planets'
    root, its dedendum deeper where the planets' tips must clear its root."""

    gears: Mapping[str, Gear]
    teeth: Mapping[str, ToothGeometry]
    distance: float

    @property
    def pinion(self) -> int:
        """Teeth of the smaller of sun and planet."""
        return min(self.gears["sun"].teeth, self.gears["planet"].teeth)


def tooth_numbers(basic_ratio: float, planets: int, helix: float) -> Iterator[GearSet]:
    """Tooth numbers that mesh and assemble for z_r/z_s about ``basic_ratio``, the best first: exact
    ratio, no common divisor, a pinion of usual size, clearance between planets."""
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


def _meshing(sun: int, planet: int, ring: int, helix: float) -> GearSet | None:
    """With shifts and addendum; None where teeth interfere, are too thin or hardly overlap."""
    rack = PlainRack(1.0, PRESSURE_ANGLE, helix)  # ISO 53 profile A of one module
    alpha, cosine = transverse_angle(rack), math.cos(helix)
    distance, reference = (ring - planet) / (2 * cosine), (sun + planet) / (2 * cosine)
    working = math.acos(reference * math.cos(alpha) / distance)
    total = (involute(working) - involute(alpha)) * (sun + planet)
    total /= 2 * math.tan(PRESSURE_ANGLE)
    x_sun, x_planet = _shares(sun, planet, total)
    gears = {
        "sun": Gear(teeth=sun, profile_shift=x_sun),
        "planet": Gear(teeth=planet, profile_shift=x_planet),
    }
    teeth = {role: tooth_geometry(gear, rack) for role, gear in gears.items()}
    addendum = _ring_addendum(planet, ring, x_planet, rack)
    thinnest = min(tooth.thickness_at(tooth.tip_radius) for tooth in teeth.values())
    if addendum < LEAST_ADDENDUM or thinnest * cosine < LEAST_TIP:
        return None
    inner, body = teeth["sun"], teeth["planet"]
    for dedendum, fillet in ROOTS:
        gears["ring"] = Gear(
            teeth=ring, profile_shift=round(-x_planet, 4) + 0.0, addendum=addendum,
            dedendum=dedendum, root_fillet=fillet,
        )  # fmt: skip
        hollow = teeth["ring"] = tooth_geometry(gears["ring"], rack, internal=True)
        if _is_clear(hollow, body, alpha):
            break
    ratios = [_ratio(body, inner, working), _ratio(body, hollow, alpha)]
    if min(ratios) < LEAST_RATIO or body.interferes_with(hollow, alpha):
        return None
    pairs = ((body, inner, working), (inner, body, working), (body, hollow, alpha),
             (hollow, body, alpha))  # fmt: skip
    return GearSet(gears, teeth, distance) if all(_is_clear(*p) for p in pairs) else None


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


def _ratio(planet: ToothGeometry, gear: ToothGeometry, angle: float) -> float:
    low, high = planet.path_of_contact(gear, angle)
    return (high - low) / planet.base_pitch


def _ring_addendum(planet: int, ring: int, x_planet: float, rack: PlainRack) -> float:
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


MODULES = (  # mm, DIN 780 series 1 and 2
    0.5, 0.6, 0.8, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9, 10,
    11, 12, 14, 16, 18, 20, 22, 25, 28, 32, 36, 40, 45, 50,
)  # fmt: skip
FACTOR = 1.5  # application and load sharing together, on the nominal tooth load (chosen)
FLANK = 6.0  # N/mm², K* = F/(b d1) (u + 1)/u of case-hardened gears, factors included
ROOT = 450.0  # N/mm², permissible bending of case-hardened gears with safety 1.9 (σ_FE 860)
FORM = 4.3  # Y_Fa Y_Sa of ISO 6336-3 for about 20 teeth
WIDTH, NARROWEST = 1.0, 6.0  # face: over the pinion's diameter at most, over the module at least
HELIX = {False: 30.0, True: 40.0}  # degrees at most: halves take each other's thrust
HALF_GAP = 6.0  # modules between halves, for the tool to run out


@dataclass(frozen=True)
class Arrangement:
    """Which member is held, which turns slowly and which fast."""

    name: str
    held: str
    slow: str
    fast: str

    def ratio(self, basic: float) -> float:
        """Speed of the fast over the slow member, without sign, for z_r/z_s = ``basic``."""
        return {"ring": 1 + basic, "carrier": basic, "sun": 1 + 1 / basic}[self.held]

    def basic_ratio(self, ratio: float) -> float:
        """z_r/z_s, the inverse."""
        if self.held == "sun":
            return 1 / (ratio - 1) if ratio > 1 else math.inf
        return ratio - 1 if self.held == "ring" else ratio

    def sun_torque(self, torque: float, basic: float) -> float:
        """Torque of the sun from that of the slow member, N m."""
        return torque / (basic if self.slow == "ring" else 1 + basic)


ARRANGEMENTS = {
    one.name: one
    for one in (
        Arrangement("planetary", held="ring", slow="carrier", fast="sun"),
        Arrangement("star", held="carrier", slow="ring", fast="sun"),
        Arrangement("solar", held="sun", slow="carrier", fast="ring"),
    )
}


@dataclass(frozen=True)
class StageRequest:
    """ratio: of the fast over the slow member's speed, without sign; torque, N m, and speed, rad/s,
    of the slow member; helix, rad; module, m, None: follows; double_helical: two halves of opposite
    hand; arrangement: of ``ARRANGEMENTS``."""

    ratio: float
    planets: int
    torque: float
    speed: float
    helix: float = 0.0
    module: float | None = None
    double_helical: bool = False
    arrangement: str = "planetary"

    @property
    def kind(self) -> Arrangement:
        """Which member is held."""
        return ARRANGEMENTS[self.arrangement]

    @property
    def halves(self) -> int:
        """Gear meshes beside each other along the axis."""
        return 2 if self.double_helical else 1


@dataclass(frozen=True)
class Proposal:
    """Gears; normal module and face width (of a half of a double-helical stage), m."""

    request: StageRequest
    gear_set: GearSet
    module: float
    face_width: float

    @property
    def basic_ratio(self) -> float:
        """z_r/z_s."""
        return self.gear_set.gears["ring"].teeth / self.gear_set.gears["sun"].teeth

    @property
    def ratio(self) -> float:
        """Ratio of the proposal."""
        return self.request.kind.ratio(self.basic_ratio)

    @property
    def center_distance(self) -> float:
        """m."""
        return self.gear_set.distance * self.module

    @property
    def planet_tip_radius(self) -> float:
        """Tip radius of a planet, m."""
        return self.module * self.gear_set.teeth["planet"].tip_radius

    def root_diameter(self, role: str) -> float:
        """Root diameter of "sun", "planet" or "ring", m."""
        return 2 * self.module * self.gear_set.teeth[role].root_radius

    @property
    def ring_tip_diameter(self) -> float:
        """m."""
        return 2 * self.module * self.gear_set.teeth["ring"].tip_radius

    @property
    def half_gap(self) -> float:
        """Between the halves of a double-helical stage, m."""
        return HALF_GAP * self.module

    @property
    def gear_width(self) -> float:
        """Width of the whole gears, both halves of a double-helical stage included, m."""
        return (
            2 * self.face_width + self.half_gap if self.request.double_helical else self.face_width
        )

    @property
    def sun_torque(self) -> float:
        """N m."""
        return self.request.kind.sun_torque(self.request.torque, self.basic_ratio)

    @property
    def ring_torque(self) -> float:
        """N m, of both halves."""
        return self.basic_ratio * self.sun_torque

    @property
    def carrier_torque(self) -> float:
        """N m."""
        return (1 + self.basic_ratio) * self.sun_torque

    @property
    def pin_force(self) -> float:
        """Mean force of a planet on its pin, N."""
        return self.carrier_torque / (self.request.planets * self.center_distance)


def proposals(request: StageRequest) -> Iterator[Proposal]:
    """Stages that assemble and fit their centre distance, the best first; InputError where there
    are none."""
    _require_possible(request)
    basic, last = request.kind.basic_ratio(request.ratio), None
    for gear_set in tooth_numbers(basic, request.planets, request.helix):
        try:
            yield Proposal(request, gear_set, *_size(request, gear_set))
        except InputError as error:
            last = error
    raise last or InputError(
        "new", "--planets",
        f"no tooth numbers give ratio {request.ratio:g} with {request.planets} planets that "
        "assemble and clear each other",
        _room_for(request),
    )  # fmt: skip


def _room_for(request: StageRequest) -> str:
    """Advice for planets that do not fit: the ratio at which their pitch circles touch."""
    sine = math.sin(math.pi / request.planets)
    if request.planets == 2:
        return "take another ratio, or three planets"
    bound = request.kind.ratio((1 + sine) / (1 - sine))
    side = "from" if request.kind.held == "sun" else "up to"
    return f"use fewer planets; {request.planets} have room {side} a ratio of about {bound:.3g}"


def _require_possible(request: StageRequest) -> None:
    steepest = HELIX[request.double_helical]
    low, high = sorted(request.kind.ratio(basic) for basic in (2.0, 9.0))
    usual = f"{low:.3g} to {high:.3g} is usual of a {request.arrangement} stage"
    between = sorted(request.kind.ratio(basic) for basic in (1.5, 11.0))
    limits: dict[str, tuple[float, float, float, str]] = {
        "--ratio": (request.ratio, between[0], between[1], usual),
        "--planets": (request.planets, 2, 12, "3 to 5 is usual"),
        "--torque-nm": (request.torque, 1.0, 5e7, f"give that of the {request.kind.slow}"),
        "--speed-rpm": (
            request.speed * 30 / math.pi, 0.1, 2e4, f"give that of the {request.kind.slow}",
        ),
        "--helix-deg": (
            math.degrees(request.helix), 5.0 if request.double_helical else 0.0, steepest,
            f"0 for spur gears, up to {HELIX[False]:g} for helical, 5 to {HELIX[True]:g} for "
            "double-helical ones",
        ),
    }  # fmt: skip
    for key, (value, low, high, remedy) in limits.items():
        if not low <= value <= high:
            raise InputError("new", key, f"{value:g} is not from {low:.4g} to {high:.4g}", remedy)


def _size(request: StageRequest, gear_set: GearSet) -> tuple[float, float]:
    """Module and face width, m: the smallest module whose face is not too wide for its pinion."""
    for module in MODULES if request.module is None else (request.module * 1e3,):
        pinion = gear_set.pinion * module / math.cos(request.helix)
        width, widest = _width(request, gear_set, module), max(WIDTH * pinion, NARROWEST * module)
        if width <= widest:
            step = 1.0 if width > 10 else 0.1
            return module * 1e-3, math.ceil(width / step - 1e-9) * step * 1e-3
    if request.module is None:
        raise InputError("new", "--torque-nm", "is more than any module takes", "use more planets")
    raise InputError(
        "new", "--module-mm",
        f"{module:g} mm needs a face of {width:.0f} mm, and {widest:.0f} mm is as wide as it goes",
        "raise it, or leave it out",
    )  # fmt: skip


def _width(request: StageRequest, gear_set: GearSet, module: float) -> float:
    """Face width, mm, that carries flank and root and is not narrower than six modules."""
    sun, planet, ring = (gear_set.gears[role].teeth for role in ("sun", "planet", "ring"))
    pinion, wheel = sorted((sun, planet))
    u, shares = wheel / pinion, request.planets * request.halves
    torque = request.kind.sun_torque(request.torque, ring / sun)
    torque *= FACTOR / shares * 1e3 * pinion / sun
    diameter = module * pinion / math.cos(request.helix)
    force = 2 * torque / diameter
    flank = force * (u + 1) / u / (diameter * FLANK)
    return max(flank, force * FORM / (module * ROOT), NARROWEST * module)
