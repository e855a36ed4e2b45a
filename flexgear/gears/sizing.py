"""First proposal of planetary stages from ratio, torque and speed: teeth, module, face width.

Ring teeth are z_r = z_s + 2 z_p, or one more: then planets are half a tooth smaller than the room
between sun and ring, and the centre distance of sun and planet is increased to that of the ring.
(z_s + z_r)/N is an integer, so that N equally spaced planets assemble. Lengths of gears are in
normal modules.

Profile shifts: with x_r = −x_p ring and planet mesh at their reference distance; the sum Σ of sun
and planet that gives this distance is divided by ISO/TR 4467 with λ = 0.5 (1: the smaller gear,
u = z_2/z_1),

    x_1 = λ (u − 1)/(u + 1) + Σ/(u + 1).

Sizes follow from rules of thumb: the result is a stage that can be computed, not a proven design.
With T_s the torque of the sun and k = z_r/z_s, the ring has k T_s and the carrier (1 + k) T_s,
whichever of the three is held.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from flexgear.gears.implausible_teeth import NEGLIGIBLE, root_protrusion
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
LEAST_TEETH, MOST_SUN, MOST_RING = 17, 160, 400  # 17 teeth are not undercut without shift
USUAL_PINION = 23  # teeth: fewer have weaker roots, more need larger gears at the same module
LARGE_PINION = 40  # teeth, beyond which the rim of the ring is thin beside its diameter
RATIO_TOLERANCE = 0.05  # relative; exact ratios come first
LEAST_CLEARANCE = 0.25  # modules between tips of neighbouring planets; one and more is usual
LEAST_CONTACT_RATIO = 1.1  # transverse
LEAST_TIP = 0.25  # modules, thickness
LEAST_ADDENDUM = 0.8  # modules, of a ring that clears the roots of its planets
ROOTS = ((1.25, 0.38), (1.4, 0.39))  # dedendum and tool's tip radius: ISO 53 profiles A and D


@dataclass(frozen=True)
class GearSet:
    """Gears by "sun", "planet" and "ring", their teeth, and the centre distance, for a module of 1.
    The ring has a smaller addendum where its tip must clear the planets' roots, and a larger
    dedendum where the planets' tips must clear its root."""

    gears: Mapping[str, Gear]
    teeth: Mapping[str, ToothGeometry]
    distance: float

    @property
    def pinion(self) -> int:
        """Teeth of the smaller of sun and planet."""
        return min(self.gears["sun"].teeth, self.gears["planet"].teeth)


def tooth_numbers(basic_ratio: float, planets: int, helix: float) -> Iterator[GearSet]:
    """Gear sets that mesh and assemble with z_r/z_s near ``basic_ratio``, the best first. Exact
    ratio, no common divisor, a pinion of usual size and clearance between planets are better;
    helix: rad."""
    for _, sun, planet, ring in sorted(_candidates(basic_ratio, planets, helix)):
        gear_set = _gear_set(sun, planet, ring, helix)
        if gear_set is not None:
            yield gear_set


def _candidates(
    basic_ratio: float, planets: int, helix: float
) -> Iterator[tuple[float, int, int, int]]:
    """Cost and teeth of sun, planet and ring that assemble with clearance between planets."""
    for sun in range(LEAST_TEETH, MOST_SUN + 1):
        exact = sun * basic_ratio
        low = max(math.ceil(exact * (1 - RATIO_TOLERANCE)), sun + 2 * LEAST_TEETH)
        for ring in range(low, min(math.floor(exact * (1 + RATIO_TOLERANCE)), MOST_RING) + 1):
            planet = (ring - sun) // 2
            # between tips of neighbouring planets without profile shift, modules
            distance = (ring - planet) / math.cos(helix)
            clearance = distance * math.sin(math.pi / planets) - planet / math.cos(helix) - 2.0
            if (sun + ring) % planets == 0 and clearance >= LEAST_CLEARANCE:
                cost = _cost(abs(ring / exact - 1), sun, planet, ring)
                yield cost + max(0.0, 1.0 - clearance), sun, planet, ring


def _cost(ratio_error: float, sun: int, planet: int, ring: int) -> float:
    """Cost of tooth numbers: 1 for a gear mesh with a common divisor, for ten teeth more or less
    than the usual pinion, for ten more than a large one, and for an error of the ratio of 0.001,
    plus 5 for any such error, and up to 2 for one beyond the rounding of a ratio that is typed with
    four figures."""
    divisors = (math.gcd(sun, planet) > 1) + (math.gcd(ring, planet) > 1)
    rounding = 2.0 * min(ratio_error / 3e-4, 1.0)
    inexact = 0.0 if ratio_error < 1e-6 else 5.0 + rounding + 1e3 * ratio_error
    pinion = min(sun, planet)
    teeth = abs(pinion - USUAL_PINION) + max(0, pinion - LARGE_PINION)
    return inexact + divisors + teeth / 10


def _gear_set(sun: int, planet: int, ring: int, helix: float) -> GearSet | None:
    """Gears with profile shifts and ring addendum; None if teeth interfere, are too thin, or have
    too small a contact ratio."""
    rack = PlainRack(1.0, PRESSURE_ANGLE, helix)  # ISO 53 profile A of one module
    alpha, cosine = transverse_angle(rack), math.cos(helix)
    distance, reference = (ring - planet) / (2 * cosine), (sun + planet) / (2 * cosine)
    working = math.acos(reference * math.cos(alpha) / distance)
    total = (involute(working) - involute(alpha)) * (sun + planet)
    total /= 2 * math.tan(PRESSURE_ANGLE)
    x_sun, x_planet = _shift_split(sun, planet, total)
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
        gear = Gear(
            teeth=ring, profile_shift=round(-x_planet, 4) + 0.0, addendum=addendum,
            dedendum=dedendum, root_fillet=fillet,
        )  # fmt: skip
        hollow = teeth["ring"] = tooth_geometry(gear, rack, internal=True)
        if hollow.tool.tip_radius < fillet:  # the cutter's tip is a full round
            fillet = math.floor(1000 * hollow.tool.tip_radius) / 1000
            gear = gear.model_copy(update={"root_fillet": fillet})
            hollow = teeth["ring"] = tooth_geometry(gear, rack, internal=True)
        gears["ring"] = gear
        if _is_clear(hollow, body, alpha):
            break
    ratios = [_contact_ratio(body, inner, working), _contact_ratio(body, hollow, alpha)]
    if min(ratios) < LEAST_CONTACT_RATIO or body.interferes_with(hollow, alpha):
        return None
    pairs = ((body, inner, working), (inner, body, working), (body, hollow, alpha),
             (hollow, body, alpha))  # fmt: skip
    return GearSet(gears, teeth, distance) if all(_is_clear(*p) for p in pairs) else None


def _is_clear(tooth: ToothGeometry, mate: ToothGeometry, angle: float) -> bool:
    """Whether the mate's tip clears the root of the tooth."""
    return root_protrusion(tooth, mate, angle) <= NEGLIGIBLE


def _shift_split(sun: int, planet: int, total: float) -> tuple[float, float]:
    """Profile shifts of sun and planet with the sum ``total``, without undercut."""
    small, large = sorted((sun, planet))
    u = large / small
    x = 0.5 * (u - 1) / (u + 1) + total / (u + 1)
    x = round(min(max(x, 1 - small / LEAST_TEETH), total - 1 + large / LEAST_TEETH), 4)
    other = round(total - x, 4)
    return (x, other) if sun <= planet else (other, x)


def _contact_ratio(planet: ToothGeometry, gear: ToothGeometry, angle: float) -> float:
    low, high = planet.path_of_contact(gear, angle)
    return (high - low) / planet.base_pitch


def _ring_addendum(planet: int, ring: int, x_planet: float, rack: PlainRack) -> float:
    """Addendum of the ring: 1, or less so that its tip meets the planet's flank above the fillet.
    Roll length of the ring's tip at least r_p sin α_t − (h_F − x_p)/sin α_t, where the fillet
    begins on the planet, plus the tangent distance (r_r − r_p) sin α_t."""
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
LOAD_FACTOR = 1.5  # application and load sharing, on the nominal tooth load (chosen)
FLANK_LIMIT = 6.0  # N/mm², K* = F/(b d1) (u + 1)/u of case-hardened gears, with load factor
ROOT_LIMIT = 450.0  # N/mm², permissible bending of case-hardened gears with safety 1.9 (σ_FE 860)
FORM_FACTOR = 4.3  # Y_Fa Y_Sa of ISO 6336-3 for about 20 teeth
WIDEST = 1.0  # face width over the pinion's diameter
NARROWEST = 6.0  # face width over the module
LARGEST_HELIX = {False: 30.0, True: 40.0}  # degrees, by double_helical: thrusts of halves cancel
HALF_GAP = 6.0  # modules between halves, for the tool to run out
MOST_WRAP = 0.65  # rad; calibrated: of 25 proposals, those above were up to 5.4 % off, below 1.1


@dataclass(frozen=True)
class Arrangement:
    """Arrangement of a planetary stage: held, slow and fast member."""

    name: str
    held: str
    slow: str
    fast: str

    def ratio(self, basic: float) -> float:
        """Absolute speed ratio of fast to slow member for z_r/z_s = ``basic``."""
        return {"ring": 1 + basic, "carrier": basic, "sun": 1 + 1 / basic}[self.held]

    def basic_ratio(self, ratio: float) -> float:
        """z_r/z_s for a speed ratio, the inverse of ``ratio``."""
        if self.held == "sun":
            return 1 / (ratio - 1) if ratio > 1 else math.inf
        return ratio - 1 if self.held == "ring" else ratio

    def sun_torque(self, torque: float, basic: float) -> float:
        """Torque of the sun from that of the slow member, N m."""
        return torque / (basic if self.slow == "ring" else 1 + basic)


ARRANGEMENTS = {
    arrangement.name: arrangement
    for arrangement in (
        Arrangement("planetary", held="ring", slow="carrier", fast="sun"),
        Arrangement("star", held="carrier", slow="ring", fast="sun"),
        Arrangement("solar", held="sun", slow="carrier", fast="ring"),
    )
}


@dataclass(frozen=True)
class StageRequest:
    """Requirements of a stage. ratio: absolute speed ratio of fast to slow member; torque, N m, and
    speed, rad/s: of the slow member; helix: rad; module: m, None to choose it; double_helical: two
    halves of opposite hand; arrangement: key of ``ARRANGEMENTS``."""

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
        """Arrangement of the members."""
        return ARRANGEMENTS[self.arrangement]

    @property
    def halves(self) -> int:
        """Number of halves."""
        return 2 if self.double_helical else 1


@dataclass(frozen=True)
class Proposal:
    """Proposed stage: gears, normal module, m, and face width (of one half), m."""

    request: StageRequest
    gear_set: GearSet
    module: float
    face_width: float

    @property
    def basic_ratio(self) -> float:
        """Ratio z_r/z_s of tooth numbers."""
        return self.gear_set.gears["ring"].teeth / self.gear_set.gears["sun"].teeth

    @property
    def ratio(self) -> float:
        """Absolute speed ratio of fast to slow member."""
        return self.request.kind.ratio(self.basic_ratio)

    @property
    def center_distance(self) -> float:
        """Centre distance, m."""
        return self.gear_set.distance * self.module

    @property
    def planet_tip_radius(self) -> float:
        """Tip radius of a planet, m."""
        return self.module * self.gear_set.teeth["planet"].tip_radius

    def root_diameter(self, role: str) -> float:
        """Root diameter of "sun", "planet" or "ring", m."""
        return 2 * self.module * self.gear_set.teeth[role].root_radius

    @property
    def wrap(self) -> float:
        """Angle round a planet that a tooth covers over the face width, rad: 2 b sin β/(m_n z)."""
        teeth = self.gear_set.gears["planet"].teeth
        return 2 * self.face_width * math.sin(self.request.helix) / (self.module * teeth)

    @property
    def bends_planets(self) -> bool:
        """Whether planets are FE bodies: not of two halves, and not with teeth that wrap so far
        that one node a tooth no longer carries their load as the tooth does."""
        return not self.request.double_helical and self.wrap <= MOST_WRAP

    @property
    def half_gap(self) -> float:
        """Gap between the halves of a double-helical stage, m."""
        return HALF_GAP * self.module

    @property
    def gear_width(self) -> float:
        """Width of the gears, of both halves and the gap of a double-helical stage, m."""
        return (
            2 * self.face_width + self.half_gap if self.request.double_helical else self.face_width
        )

    @property
    def sun_torque(self) -> float:
        """Torque of the sun, N m."""
        return self.request.kind.sun_torque(self.request.torque, self.basic_ratio)

    @property
    def ring_torque(self) -> float:
        """Torque of the ring, of both halves, N m."""
        return self.basic_ratio * self.sun_torque

    @property
    def carrier_torque(self) -> float:
        """Torque of the carrier, N m."""
        return (1 + self.basic_ratio) * self.sun_torque

    @property
    def pin_force(self) -> float:
        """Mean force of a planet on its pin, N."""
        return self.carrier_torque / (self.request.planets * self.center_distance)


def proposals(request: StageRequest) -> Iterator[Proposal]:
    """Stages that assemble and carry the torque, the best first. Raises InputError without any."""
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
        _advice(request),
    )  # fmt: skip


def _advice(request: StageRequest) -> str:
    """Advice for planets without room: the ratio at which their pitch circles touch."""
    sine = math.sin(math.pi / request.planets)
    if request.planets == 2:
        return "take another ratio, or three planets"
    bound = request.kind.ratio((1 + sine) / (1 - sine))
    side = "from" if request.kind.held == "sun" else "up to"
    return f"use fewer planets; {request.planets} have room {side} a ratio of about {bound:.3g}"


def _require_possible(request: StageRequest) -> None:
    """Raises InputError for values of a request outside their limits."""
    largest_helix = LARGEST_HELIX[request.double_helical]
    low, high = sorted(request.kind.ratio(basic) for basic in (2.0, 9.0))
    usual = f"{low:.3g} to {high:.3g} is usual of a {request.arrangement} stage; 4,5 are two stages"
    least, most = sorted(request.kind.ratio(basic) for basic in (1.5, 11.0))
    limits: dict[str, tuple[float, float, float, str]] = {
        "--ratio": (request.ratio, least, most, usual),
        "--planets": (request.planets, 2, 12, "3 to 5 is usual"),
        "--torque-nm": (request.torque, 1.0, 5e7, f"give that of the {request.kind.slow}"),
        "--speed-rpm": (
            request.speed * 30 / math.pi, 0.1, 2e4, f"give that of the {request.kind.slow}",
        ),
        "--module-mm": (
            1.0 if request.module is None else 1e3 * request.module, 0.2, 100.0,
            "leave it out, and it follows from torque and ratio",
        ),
        "--helix-deg": (
            math.degrees(request.helix), 5.0 if request.double_helical else 0.0, largest_helix,
            f"0 for spur gears, up to {LARGEST_HELIX[False]:g} for helical, 5 to "
            f"{LARGEST_HELIX[True]:g} for double-helical ones",
        ),
    }  # fmt: skip
    for key, (value, low, high, remedy) in limits.items():
        if not low <= value <= high:
            raise InputError("new", key, f"{value:.4g} is not from {low:.4g} to {high:.4g}", remedy)


def _size(request: StageRequest, gear_set: GearSet) -> tuple[float, float]:
    """Module and face width, m, with the smallest module whose face is not too wide for the
    pinion. Raises InputError if there is none."""
    for module in MODULES if request.module is None else (request.module * 1e3,):
        pinion = gear_set.pinion * module / math.cos(request.helix)
        width, widest = _width(request, gear_set, module), max(WIDEST * pinion, NARROWEST * module)
        if width <= widest:
            step = 1.0 if width > 10 else 0.1
            return module * 1e-3, math.ceil(width / step - 1e-9) * step * 1e-3
    if request.module is None:
        raise InputError("new", "--torque-nm", "is more than any module takes", "use more planets")
    problem = (
        f"{module:g} mm needs a face of {width:.0f} mm, and {widest:.0f} mm is the largest allowed"
    )
    raise InputError("new", "--module-mm", problem, "raise it, or leave it out")


def _width(request: StageRequest, gear_set: GearSet, module: float) -> float:
    """Face width, mm, sufficient for flank and root, and at least ``NARROWEST`` modules."""
    sun, planet, ring = (gear_set.gears[role].teeth for role in ("sun", "planet", "ring"))
    pinion, wheel = sorted((sun, planet))
    u, paths = wheel / pinion, request.planets * request.halves
    torque = request.kind.sun_torque(request.torque, ring / sun)
    torque *= LOAD_FACTOR / paths * 1e3 * pinion / sun
    diameter = module * pinion / math.cos(request.helix)
    force = 2 * torque / diameter
    flank = force * (u + 1) / u / (diameter * FLANK_LIMIT)
    return max(flank, force * FORM_FACTOR / (module * ROOT_LIMIT), NARROWEST * module)
