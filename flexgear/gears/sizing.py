"""A first proposal of a planetary stage from what is asked of it: teeth, module, face width.

Rules of thumb with their sources; they give a stage that can be computed, not one that is proven.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flexgear.model.errors import InputError

MODULES = (  # mm, DIN 780 series 1 and 2
    0.5, 0.6, 0.8, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 9, 10,
    11, 12, 14, 16, 18, 20, 22, 25, 28, 32, 36, 40, 45, 50,
)  # fmt: skip
PRESSURE_ANGLE = 20.0  # degrees, ISO 53
LEAST_TEETH = 17  # no undercut of a 20° rack without profile shift
MOST_SUN, MOST_RING = 160, 400
FACTOR = 1.5  # application and load sharing together, on the nominal tooth load (chosen)
FLANK = 3.0  # N/mm², K* = F/(b d1) (u + 1)/u of case-hardened gears
ROOT = 300.0  # N/mm², permissible bending of case-hardened gears with safety 1.5
FORM = 4.3  # Y_Fa Y_Sa of ISO 6336-3 for about 20 teeth
WIDTH, NARROWEST = (
    1.0,
    6.0,
)  # face width over the pinion's diameter at most, over the module at least
OVERLAP = {False: 1.5, True: 3.0}  # at most, of single- and of double-helical gears
HELIX = {False: 20.0, True: 35.0}  # degrees at most, likewise: halves take each other's thrust
HALF_GAP = 6.0  # modules between halves, for the tool to run out


@dataclass(frozen=True)
class Wanted:
    """ratio: sun over carrier speed, ring held; torque of the carrier, N m; speed of the carrier,
    rad/s; helix, rad; module, m, None: follows; double_helical: two halves of opposite hand."""

    ratio: float
    planets: int
    torque: float
    speed: float
    helix: float = 0.0
    module: float | None = None
    double_helical: bool = False

    @property
    def halves(self) -> int:
        """Gear meshes beside each other along the axis."""
        return 2 if self.double_helical else 1


@dataclass(frozen=True)
class Proposal:
    """Tooth numbers, profile shifts of sun, planet, ring; normal module and face width (of a half
    of a double-helical stage), m."""

    wanted: Wanted
    sun: int
    planet: int
    ring: int
    shifts: tuple[float, float, float]
    module: float
    face_width: float

    @property
    def ratio(self) -> float:
        """Of what is proposed."""
        return 1 + self.ring / self.sun

    @property
    def transverse_module(self) -> float:
        """m."""
        return self.module / math.cos(self.wanted.helix)

    @property
    def center_distance(self) -> float:
        """m; that of the reference circles, since x_s + x_p = 0."""
        return 0.5 * (self.sun + self.planet) * self.transverse_module

    @property
    def planet_tip_radius(self) -> float:
        """m."""
        height = (1 + self.shifts[1]) * self.module
        return 0.5 * self.planet * self.transverse_module + height

    @property
    def ring_addendum(self) -> float:
        """Over the module, 1 or so much less that the ring's tip stays off the root of planets that
        a rack of ISO 53 profile A cuts: with x_p + x_r = 0 the tip's roll length is at least
        r_r sin α_t − (h_fP − ρ_fP (1 − sin α_n) − x_p)/sin α_t, all over the module."""
        angle = math.atan(math.tan(math.radians(PRESSURE_ANGLE)) / math.cos(self.wanted.helix))
        reference = 0.5 * self.ring / math.cos(self.wanted.helix)
        straight = 1.25 - 0.38 * (1 - math.sin(math.radians(PRESSURE_ANGLE))) - self.shifts[1]
        roll = reference * math.sin(angle) - straight / math.sin(angle)
        tip = math.hypot(reference * math.cos(angle), roll)
        return min(1.0, math.floor(100 * (reference - tip - self.shifts[2])) / 100)

    @property
    def half_gap(self) -> float:
        """Between the halves of a double-helical stage, m."""
        return HALF_GAP * self.module

    @property
    def gear_width(self) -> float:
        """Of the whole gears, m."""
        return (
            2 * self.face_width + self.half_gap if self.wanted.double_helical else self.face_width
        )

    @property
    def pin_force(self) -> float:
        """Mean force of a planet on its pin, N."""
        return self.wanted.torque / (self.wanted.planets * self.center_distance)

    @property
    def sun_torque(self) -> float:
        """N m."""
        return self.wanted.torque / self.ratio


def propose(wanted: Wanted) -> Proposal:
    """A stage that assembles and fits its centre distance; InputError where there is none."""
    _require_possible(wanted)
    sun, planet = _teeth(wanted)
    ring = sun + 2 * planet
    x = _shift(sun, planet)
    module, width = _size(wanted, sun, planet)
    return Proposal(wanted, sun, planet, ring, (x, -x, x), module, width)


def _require_possible(wanted: Wanted) -> None:
    limits = {
        "--ratio": (wanted.ratio, 2.5, 12.0, "3 to 10 is usual"),
        "--planets": (wanted.planets, 2, 12, "3 to 5 is usual"),
        "--torque-nm": (wanted.torque, 1.0, 5e7, "give that of the carrier"),
        "--speed-rpm": (wanted.speed * 30 / math.pi, 0.1, 2e4, "give that of the carrier"),
        "--helix-deg": (
            math.degrees(wanted.helix),
            5.0 if wanted.double_helical else 0.0,
            HELIX[wanted.double_helical],
            "0 for spur gears, up to 20 for helical, 5 to 35 for double-helical ones",
        ),
    }
    for key, (value, low, high, remedy) in limits.items():
        if not low <= value <= high:
            raise InputError("new", key, f"{value:g} is not from {low:g} to {high:g}", remedy)


def _teeth(wanted: Wanted) -> tuple[int, int]:
    """Teeth of sun and planet: z_r = z_s + 2 z_p, (z_s + z_r)/N whole, planets clear of each other;
    close to the ratio, without common divisor, few."""
    found = []
    for sun in range(LEAST_TEETH, MOST_SUN + 1):
        about = sun * (wanted.ratio - 2) / 2
        for planet in range(max(LEAST_TEETH, int(about) - 2), int(about) + 4):
            ring = sun + 2 * planet
            room = (sun + planet) * math.sin(math.pi / wanted.planets) - (planet + 2)
            if (sun + ring) % wanted.planets or ring > MOST_RING or room < 2.5:
                continue
            if _interferes(sun, planet):
                continue
            wrong = abs(math.log((1 + ring / sun) / wanted.ratio))
            hunting = math.gcd(sun, planet) == 1 and math.gcd(ring, planet) == 1
            pinion = min(sun, planet)
            found.append((max(wrong, 0.01) * 100 + (not hunting) + abs(pinion - 23) / 10,
                          wrong, sun, planet))  # fmt: skip
    close = [one for one in found if one[1] < 0.05]
    if not close:
        raise InputError(
            "new", "--planets",
            f"no tooth numbers give ratio {wanted.ratio:g} with {wanted.planets} planets that "
            "assemble and clear each other",
            "use fewer planets, or a lower ratio",
        )  # fmt: skip
    best = min(close)
    return best[2], best[3]


def _interferes(sun: int, planet: int) -> bool:
    """Whether the ring's tip reaches below the planet's base circle, r_a² < r_b² + (a sin α)² with
    lengths in modules."""
    half, alpha = (sun + 2 * planet) / 2, math.radians(20)
    tip = half - 1 - _shift(sun, planet)
    return tip**2 < (half * math.cos(alpha)) ** 2 + ((sun + planet) / 2 * math.sin(alpha)) ** 2


def _shift(sun: int, planet: int) -> float:
    """x_s = −x_p at the reference distance: λ (u − 1)/(u + 1) of ISO/TR 4467 with λ = 0.5, which
    strengthens the smaller gear; the planet is not undercut."""
    x = 0.5 * (planet - sun) / (planet + sun)
    least = {"sun": 1 - sun / LEAST_TEETH, "planet": planet / LEAST_TEETH - 1}
    return round(min(max(x, least["sun"]), least["planet"]), 3)


def _size(wanted: Wanted, sun: int, planet: int) -> tuple[float, float]:
    """Module and face width, m: the smallest module whose face is not too wide for its pinion."""
    given = wanted.module
    for module in MODULES if given is None else (given * 1e3,):
        width, widest = _width(wanted, sun, planet, module), _widest(wanted, sun, planet, module)
        if width <= widest:
            step = 1.0 if width > 10 else 0.1
            return module * 1e-3, math.ceil(width / step) * step * 1e-3
    if given is None:
        raise InputError("new", "--torque-nm", "is more than any module takes", "use more planets")
    raise InputError(
        "new", "--module-mm",
        f"{module:g} mm needs a face of {width:.0f} mm, and {widest:.0f} mm is as wide as it goes",
        "raise it, or leave it out",
    )  # fmt: skip


def _width(wanted: Wanted, sun: int, planet: int, module: float) -> float:
    """Face width, mm, that carries flank and root and is not narrower than six modules."""
    u, pinion = max(sun, planet) / min(sun, planet), min(sun, planet)
    shares = wanted.planets * wanted.halves
    torque = FACTOR * wanted.torque / (2 + 2 * planet / sun) / shares * 1e3 * pinion / sun
    diameter = module * pinion / math.cos(wanted.helix)
    force = 2 * torque / diameter
    flank = force * (u + 1) / u / (diameter * FLANK)
    return max(flank, force * FORM / (module * ROOT), NARROWEST * module)


def _widest(wanted: Wanted, sun: int, planet: int, module: float) -> float:
    """Face width, mm, that the pinion and, of helical gears, the largest overlap ratio allow."""
    pinion = WIDTH * module * min(sun, planet) / math.cos(wanted.helix)
    least = NARROWEST * module
    if wanted.helix == 0.0:
        return max(pinion, least)
    return max(
        min(pinion, OVERLAP[wanted.double_helical] * math.pi * module / math.sin(wanted.helix)),
        least,
    )
