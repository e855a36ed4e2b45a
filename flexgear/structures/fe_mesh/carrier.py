"""Planet carrier: two side plates, webs between the planets, pins, hub and bearing seats.

Frame: origin on the axis in the middle between the plates (mid-face of the gears), z the axis of
rotation; pin i (1-based) at 2π(i-1)/N or where ``planet_angles`` say. The drive side is -z unless
``drive_side`` says "+z", which gives the exact mirror image. From there along the axis::

    hub (its end face is the patch "drive") | seat "bearing_drive" | plate | gap with pins and
    webs | plate | seat "bearing_far"

Plates, hub and seats are rings round one bore, through which the sun's shaft passes. Pins are one
piece with both plates. A web is between two planets: bounded by the plates' edge, where it is
web_width wide (less if the planets need the room), by arcs about the two pins that clear the
planets' tips by web_clearance or more, and by a flat at web_inner_radius. In a gap wider than that
of equally spaced planets it has the same shape as there, in the middle of the gap.
"""

from dataclasses import dataclass, replace
from math import acos, asin, cos, hypot, pi, sin, sqrt
from typing import Any, Literal, NoReturn, Self

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.model.bodies import Fidelity
from flexgear.model.errors import InputError

SAME_ANGLE = 1e-9  # rad; gaps that differ by less are meshed alike
# gmsh fails on pins about a third thinner, or does not end
_SLENDER = 25.0  # largest length of a pin between the plates over its diameter
_THIN = 15.0  # largest thickness of a plate over the diameter of a pin
_CASE_KEYS = {  # keys that are not plain ones of [stage.carrier.fe]
    "planets": "stage.planets",
    "seat_drive_diameter": "stage.carrier.fe.seat_drive.diameter",
    "seat_far_diameter": "stage.carrier.fe.seat_far.diameter",
}


@dataclass(frozen=True)
class Web:
    """A web on the middle line between two planets; m and rad.

    phi: half the angle between the planets; width: at the plates' edge; clear: radius about a pin
    that the planet needs; inner_radius: where the web begins, None: where its thickness is a third
    of its width.
    """

    phi: float
    center_distance: float
    edge: float
    width: float
    clear: float
    inner_radius: float | None = None

    @property
    def arc_radius(self) -> float:
        """Radius of the arcs about the pins that bound the web, m: the larger of ``clear`` and the
        distance from the pin to the web's corner on the plates' edge, width/2 from the middle
        line."""
        off = self.phi - asin(min(self.width / 2.0 / self.edge, 1.0))
        corner = hypot(self.edge * cos(off) - self.center_distance, self.edge * sin(off))
        return max(self.clear, corner if off > 0.0 else 0.0)

    def half_thickness(self, radius: float) -> float:
        """Half thickness h, m, at the radius ρ on the middle line θ = φ, R the centre distance:
        (ρ - R cos φ)² + (R sin φ - h)² = r_arc²."""
        free = self.arc_radius**2 - (radius - self.center_distance * cos(self.phi)) ** 2
        return self.center_distance * sin(self.phi) - sqrt(max(free, 0.0))

    @property
    def start(self) -> float:
        """Inner radius of the web, m: ``inner_radius`` or its default."""
        if self.inner_radius is not None:
            return self.inner_radius
        side = self.center_distance * sin(self.phi) - self.width / 6.0
        beyond = sqrt(max(self.arc_radius**2 - side**2, 0.0))
        return self.center_distance * cos(self.phi) + beyond

    @property
    def edge_angle(self) -> float:
        """Half angle of the web at the plates' edge, seen from the axis, rad (law of cosines)."""
        edge, r = self.edge, self.center_distance
        cosine = (edge**2 + r**2 - self.arc_radius**2) / (2.0 * edge * r)
        return self.phi - acos(max(-1.0, min(1.0, cosine)))


@dataclass(frozen=True, kw_only=True)
class CarrierFeMeshParameters:
    """All parameters of the carrier's FE mesh; m and rad.

    planet_angles: of the pins; None: equally spaced, the first at 0; gear_face_width,
    planet_tip_radius: only for clearance checks and the shape of the webs; pin_seat_width: axial
    length, centred at z = 0, of the patches pin_i; None: all between the plates; web_inner_radius:
    see ``Web``; hub_length: from the drive-side plate to the hub's end face, with the seat.
    """

    planets: int
    planet_angles: tuple[float, ...] | None = None
    center_distance: float
    planet_tip_radius: float
    gear_face_width: float
    plate_diameter: float
    plate_thickness_drive: float
    plate_thickness_far: float
    plate_gap: float
    web_width: float
    web_inner_radius: float | None = None
    web_clearance: float
    pin_diameter: float
    pin_bore: float = 0.0
    pin_seat_width: float | None = None
    hub_outer_diameter: float
    hub_bore: float
    hub_length: float
    seat_drive_diameter: float
    seat_drive_width: float
    seat_far_diameter: float
    seat_far_width: float
    drive_side: Literal["-z", "+z"] = "-z"
    fidelity: Fidelity = "standard"
    where: str = "case"

    def in_units_of(self, unit: float) -> Self:
        """The carrier with all lengths (numbers but counts and angles) divided by a unit, m."""
        lengths: dict[str, Any] = {
            k: v / unit for k, v in vars(self).items() if isinstance(v, float)
        }
        return replace(self, **lengths)

    @property
    def size(self) -> float:
        """Largest dimension, m."""
        return self.plate_diameter

    @property
    def seat_width(self) -> float:
        """Axial length of the patches pin_i, m: the whole gap where the rest would be a sliver."""
        width = self.plate_gap if self.pin_seat_width is None else self.pin_seat_width
        rest = (self.plate_gap - width) / 2.0
        return self.plate_gap if 0.0 < rest < 0.05 * self.pin_diameter else width

    @property
    def hub_diameter(self) -> float:
        """Outer diameter of the hub, m: that of the seat where the step would make slivers."""
        step = abs(self.hub_outer_diameter - self.seat_drive_diameter) / 2.0
        return (
            self.seat_drive_diameter
            if step < 0.1 * self.plate_thickness
            else self.hub_outer_diameter
        )

    @property
    def plate_thickness(self) -> float:
        """Mean of both plates, m."""
        return (self.plate_thickness_drive + self.plate_thickness_far) / 2.0

    @property
    def seat_heights(self) -> dict[str, float]:
        """z of the end face "drive" and of the middles of the bearing seats, m."""
        side = 1.0 if self.drive_side == "+z" else -1.0
        plate = self.plate_gap / 2.0 + self.plate_thickness_drive
        far = self.plate_gap / 2.0 + self.plate_thickness_far
        return {
            "drive": side * (plate + self.hub_length),
            "bearing_drive": side * (plate + self.seat_drive_width / 2.0),
            "bearing_far": -side * (far + self.seat_far_width / 2.0),
        }

    @property
    def angles(self) -> Array:
        """Angles of the pins (N,), rad."""
        if self.planet_angles is None:
            return 2.0 * pi * np.arange(self.planets) / self.planets
        return np.array(self.planet_angles, dtype=float)

    @property
    def half_gaps(self) -> tuple[tuple[float, ...], Ints, Ints]:
        """Different half angles between neighbouring pins, rad; pins in the order of their angles
        (N,); and index of the half angle that follows each of these pins (N,)."""
        around = self.angles % (2.0 * pi)
        order = np.argsort(around)
        if self.planet_angles is None:
            return (pi / self.planets,), order, np.zeros(self.planets, dtype=np.int64)
        halves = np.diff(around[order], append=around[order[0]] + 2.0 * pi) / 2.0
        kinds: list[float] = []
        which = np.empty(self.planets, dtype=np.int64)
        for i, half in enumerate(halves.tolist()):
            same = next((k for k, h in enumerate(kinds) if abs(h - half) < SAME_ANGLE), None)
            which[i] = len(kinds) if same is None else same
            if same is None:
                kinds.append(half)
        return tuple(kinds), order, which

    def web(self, half_gap: float) -> Web:
        """The web between planets at an angle of twice half_gap, rad; in wider gaps than at equal
        spacing it has the shape of equal spacing."""
        return Web(
            phi=min(half_gap, pi / self.planets),
            center_distance=self.center_distance,
            edge=self.plate_diameter / 2.0,
            width=self.web_width,
            clear=self.planet_tip_radius + self.web_clearance,
            inner_radius=self.web_inner_radius,
        )

    def check(self) -> None:
        """InputError with key and remedy where no carrier can be made."""
        reject, mm = self._reject, 1e3
        if self.planets < 2:
            reject("planets", "a carrier's FE mesh needs two planets or more", "raise it")
        overlap = 2.0 * (
            self.planet_tip_radius - self.center_distance * sin(min(self.half_gaps[0]))
        )
        if overlap >= 0.0:
            problem = f"neighbouring planets overlap by {overlap * mm:.1f} mm at their tips"
            reject("planets", problem, "use fewer planets or fewer planet teeth")
        if self.plate_gap <= self.gear_face_width:
            room = f"no room for planets of {self.gear_face_width * mm:.0f} mm face width"
            problem = f"{self.plate_gap * mm:.0f} mm leaves {room}"
            reject("plate_gap", problem, "make it wider than the face width")
        if self.seat_width > self.plate_gap:
            reject("pin_seat_width", "must be no wider than plate_gap", "change it")
        pin, bore, plate = self.pin_diameter / 2.0, self.hub_bore / 2.0, self.plate_diameter / 2.0
        if self.pin_bore >= 0.9 * self.pin_diameter:
            reject("pin_bore", "leaves no wall in the pin", "at most 0.9 of pin_diameter")
        least = max(self.plate_gap / _SLENDER, self.plate_thickness / _THIN)
        if 2.0 * pin < least:
            reject(
                "pin_diameter",
                f"pins of {2 * pin * mm:.3g} mm are too thin for the FE mesh of plates "
                f"{self.plate_gap * mm:.3g} mm apart and {self.plate_thickness * mm:.3g} mm thick",
                f"at least {least * mm:.3g} mm",
            )
        if pin >= self.planet_tip_radius:
            reject("pin_diameter", "the pin is as thick as the planet", "lower it")
        if plate <= self.center_distance + 1.05 * pin:
            reach = f"which reach to {(self.center_distance + pin) * 2 * mm:.0f} mm"
            problem = f"{plate * 2 * mm:.0f} mm does not enclose the pins, {reach}"
            reject("plate_diameter", problem, "raise it")
        if bore >= self.center_distance - 1.05 * pin:
            reject("hub_bore", "cuts into the pins", "lower it")
        for key in ("hub_outer_diameter", "seat_drive_diameter", "seat_far_diameter"):
            if not 1.05 * self.hub_bore < getattr(self, key) < self.plate_diameter:
                reject(key, "must lie between hub_bore and plate_diameter", "change it")
        if self.hub_length <= self.seat_drive_width:
            reject("hub_length", "is shorter than the bearing seat on it", "raise it")
        for half in self.half_gaps[0]:
            self._check_web(self.web(half))

    def _check_web(self, web: Web) -> None:
        """InputError where a web cannot be made."""
        start, mm = web.start, 1e3
        tip = f"planets of {self.planet_tip_radius * mm:.1f} mm tip radius"
        if abs(web.edge - self.center_distance) >= web.arc_radius:
            problem = f"webs of {self.web_width * mm:.0f} mm would close round the {tip}"
            self._reject("web_width", problem, "lower it")
        if self.web_inner_radius is not None and (
            start <= self.hub_bore / 2.0
            or web.half_thickness(start) < 0.02 * self.web_width
            or start < self.center_distance * cos(web.phi)
        ):
            beyond = replace(web, inner_radius=None).start * mm
            self._reject(
                "web_inner_radius",
                f"webs from {start * mm:.1f} mm collide with {tip} or with the bore",
                f"begin beyond {beyond:.0f} mm or leave the key out",
            )
        if start >= 0.96 * web.edge * cos(web.edge_angle):
            self._reject(
                "plate_diameter",
                f"no room for webs between {tip}: they would begin at {start * 2 * mm:.0f} mm",
                "raise plate_diameter, or lower web_width or the planets' tip radius",
            )

    def _reject(self, key: str, problem: str, remedy: str) -> NoReturn:
        """Raise InputError for a parameter."""
        key = _CASE_KEYS.get(key, f"stage.carrier.fe.{key}")
        raise InputError(self.where, key, problem, remedy)
