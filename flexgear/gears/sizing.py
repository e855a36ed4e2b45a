"""A first proposal of planetary stages from what is asked of them: teeth, module, face width.

Rules of thumb with their sources; they give a stage that can be computed, not one that is proven.
With T_s the torque of the sun and k = z_r/z_s, the ring has k T_s and the carrier (1 + k) T_s,
whichever of the three is held.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from flexgear.gears.tooth_numbers import ToothNumbers, tooth_numbers
from flexgear.model.errors import InputError

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
    """Which member is held, which turns slowly and which fast; reverses: in opposite senses."""

    name: str
    held: str
    slow: str
    fast: str
    reverses: bool = False

    def ratio(self, basic: float) -> float:
        """Speed of the fast over the slow member, without sign, for z_r/z_s = ``basic``."""
        return {"ring": 1 + basic, "carrier": basic, "sun": 1 + 1 / basic}[self.held]

    def basic_ratio(self, ratio: float) -> float:
        """z_r/z_s, the inverse."""
        if self.held == "sun":
            return 1 / (ratio - 1) if ratio > 1 else math.inf
        return ratio - 1 if self.held == "ring" else ratio

    def sun_torque(self, torque: float, basic: float) -> float:
        """Of the torque of the slow member."""
        return torque / (basic if self.slow == "ring" else 1 + basic)


ARRANGEMENTS = {
    one.name: one
    for one in (
        Arrangement("planetary", held="ring", slow="carrier", fast="sun"),
        Arrangement("star", held="carrier", slow="ring", fast="sun", reverses=True),
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
    """Teeth and shifts; normal module and face width (of a half of a double-helical stage), m."""

    request: StageRequest
    teeth: ToothNumbers
    module: float
    face_width: float

    @property
    def basic_ratio(self) -> float:
        """z_r/z_s."""
        return self.teeth.ring / self.teeth.sun

    @property
    def ratio(self) -> float:
        """Of what is proposed."""
        return self.request.kind.ratio(self.basic_ratio)

    @property
    def transverse_module(self) -> float:
        """m."""
        return self.module / math.cos(self.request.helix)

    @property
    def center_distance(self) -> float:
        """m."""
        return self.teeth.distance * self.module

    @property
    def planet_tip_radius(self) -> float:
        """m."""
        height = (1 + self.teeth.shifts[1]) * self.module
        return 0.5 * self.teeth.planet * self.transverse_module + height

    def root_diameter(self, role: str) -> float:
        """Of "sun", "planet" or "ring", m."""
        which = ("sun", "planet", "ring").index(role)
        teeth = (self.teeth.sun, self.teeth.planet, self.teeth.ring)[which]
        dedendum = self.teeth.ring_dedendum if role == "ring" else 1.25
        depth = 2 * (dedendum - self.teeth.shifts[which]) * self.module
        return teeth * self.transverse_module + (depth if role == "ring" else -depth)

    @property
    def ring_tip_diameter(self) -> float:
        """m."""
        height = (self.teeth.ring_addendum + self.teeth.shifts[2]) * self.module
        return self.teeth.ring * self.transverse_module - 2 * height

    @property
    def half_gap(self) -> float:
        """Between the halves of a double-helical stage, m."""
        return HALF_GAP * self.module

    @property
    def gear_width(self) -> float:
        """Of the whole gears, m."""
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
    for teeth in tooth_numbers(basic, request.planets, request.helix):
        try:
            yield Proposal(request, teeth, *_size(request, teeth))
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
    between = sorted(request.kind.ratio(basic) for basic in (1.5, 11.0))
    limits: dict[str, tuple[float, float, float, str]] = {
        "--ratio": (request.ratio, between[0], between[1], _usual_ratio(request)),
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


def _usual_ratio(request: StageRequest) -> str:
    low, high = sorted(request.kind.ratio(basic) for basic in (2.0, 9.0))
    return f"{low:.3g} to {high:.3g} is usual of a {request.arrangement} stage"


def _size(request: StageRequest, teeth: ToothNumbers) -> tuple[float, float]:
    """Module and face width, m: the smallest module whose face is not too wide for its pinion."""
    for module in MODULES if request.module is None else (request.module * 1e3,):
        width, widest = _width(request, teeth, module), _widest(request, teeth, module)
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


def _width(request: StageRequest, teeth: ToothNumbers, module: float) -> float:
    """Face width, mm, that carries flank and root and is not narrower than six modules."""
    pinion, wheel = sorted((teeth.sun, teeth.planet))
    u, shares = wheel / pinion, request.planets * request.halves
    sun = request.kind.sun_torque(request.torque, teeth.ring / teeth.sun)
    torque = FACTOR * sun / shares * 1e3 * pinion / teeth.sun
    diameter = module * pinion / math.cos(request.helix)
    force = 2 * torque / diameter
    flank = force * (u + 1) / u / (diameter * FLANK)
    return max(flank, force * FORM / (module * ROOT), NARROWEST * module)


def _widest(request: StageRequest, teeth: ToothNumbers, module: float) -> float:
    """Face width, mm, that the pinion allows."""
    pinion = min(teeth.sun, teeth.planet) * module / math.cos(request.helix)
    return max(WIDTH * pinion, NARROWEST * module)
