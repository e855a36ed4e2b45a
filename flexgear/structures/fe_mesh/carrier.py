"""Planet carrier: two side plates, webs between the planets, pins, hub and bearing seats.

Frame: origin on the axis in the middle between the plates (mid-face of the gears), z the axis of
rotation; pin i (1-based) at 2π(i-1)/N or where ``planet_angles`` say. The drive side is -z unless
``drive_side`` says "+z", which gives the exact mirror image. From there along the axis::

    hub (its end face is the patch "drive") | seat "bearing_drive" | plate | gap with pins and
    webs | plate | seat "bearing_far"

Plates, hub and seats are rings round one bore, through which the sun's shaft passes. Pins are one
piece with both plates. A web lies between two planets: bounded by the plates' edge, where it is
web_width wide (less if the planets need the room), by arcs about the two pins that clear the
planets' tips by web_clearance or more, and by a flat at web_inner_radius. In a gap wider than that
of equally spaced planets it has the shape that it has there, and stands in the middle.

gmsh (OpenCASCADE) meshes the half sector from a pin to the middle of the gap with straight
tetrahedra; with equally spaced planets its mirror image and N rotations make the carrier exactly
N-fold periodic and mirror-symmetric, else every gap that differs has a half sector of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import cos, pi, sin
from typing import Any, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexgear.model.errors import FlexgearError, InputError
from flexgear.structures.fe_mesh.carrier_sector import FLATTEST, SIZE, half_sectors
from flexgear.structures.fe_mesh.carrier_web import Web
from flexgear.structures.fe_mesh.carrier_whole import complete
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, corner_jacobians
from flexgear.structures.fe_mesh.session import gmsh_session, meshing_unit

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Fidelity = Literal["quick", "standard", "fine"]

SAME_ANGLE = 1e-9  # rad; gaps that differ by less are meshed alike
# gmsh fails on pins, or never ends, about a third thinner
_SLENDER = 25.0  # length between the plates over the diameter of a pin, at most
_THIN = 15.0  # thickness of a plate over that, at most
_CASE_KEYS = {  # where the case holds what is not a plain key of [stage.carrier.fe]
    "fidelity": "solver.fidelity",
    "planets": "stage.planets",
    "center_distance": "stage.center_distance",
    "planet_tip_radius": "stage.planet.addendum",
    "gear_face_width": "stage.face_width",
    "seat_drive_diameter": "stage.carrier.fe.seat_drive.diameter",
    "seat_drive_width": "stage.carrier.fe.seat_drive.width",
    "seat_far_diameter": "stage.carrier.fe.seat_far.diameter",
    "seat_far_width": "stage.carrier.fe.seat_far.width",
}


@dataclass(frozen=True)
class CarrierMeshParameters:
    """Everything the carrier's FE mesh depends on; m and rad.

    planet_angles: where each pin stands; None: equally spaced, the first at 0;
    gear_face_width, planet_tip_radius: only for clearance checks and the shape of the webs;
    pin_seat_width: axial length, centred at z = 0, of the patches pin_i; None: all between the
    plates; web_inner_radius: None lets the web begin where it is a third of its width thick;
    hub_length: from the drive-side plate to the hub's end face, the seat included.
    """

    planets: int = 5
    planet_angles: tuple[float, ...] | None = None
    center_distance: float = 0.54466
    planet_tip_radius: float = 0.318
    gear_face_width: float = 0.43
    plate_diameter: float = 1.6
    plate_thickness_drive: float = 0.16
    plate_thickness_far: float = 0.14
    plate_gap: float = 0.48
    web_width: float = 0.4
    web_inner_radius: float | None = None
    web_clearance: float = 0.01
    pin_diameter: float = 0.32
    pin_bore: float = 0.0
    pin_seat_width: float | None = None
    hub_outer_diameter: float = 0.9
    hub_bore: float = 0.4
    hub_length: float = 0.25
    seat_drive_diameter: float = 1.0
    seat_drive_width: float = 0.12
    seat_far_diameter: float = 0.7
    seat_far_width: float = 0.1
    drive_side: Literal["-z", "+z"] = "-z"
    fidelity: Fidelity = "standard"
    where: str = "case"

    def in_units_of(self, unit: float) -> CarrierMeshParameters:
        """The same carrier with all lengths over a unit, m: every number but counts and angles."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        lengths: dict[str, Any] = {
            name: value / unit for name, value in values.items() if isinstance(value, float)
        }
        return replace(self, **lengths)

    @property
    def size(self) -> float:
        """Largest dimension, m."""
        return self.plate_diameter

    @property
    def seat_width(self) -> float:
        """Axial length of the patches pin_i, m; all the gap where next to nothing would be left."""
        width = self.plate_gap if self.pin_seat_width is None else self.pin_seat_width
        rest = (self.plate_gap - width) / 2.0
        return self.plate_gap if 0.0 < rest < 0.05 * self.pin_diameter else width

    @property
    def hub_diameter(self) -> float:
        """That of the hub, m, without a small step to the seat: it would only make slivers."""
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
        """Where pin i stands in the carrier (N,), rad."""
        if self.planet_angles is None:
            return 2.0 * pi * np.arange(self.planets) / self.planets
        return np.array(self.planet_angles, dtype=float)

    @property
    def half_gaps(self) -> tuple[tuple[float, ...], Ints, Ints]:
        """Half angles between neighbouring pins, each once; the pins in the order in which they
        stand (N,); and which half angle follows each of these pins (N,)."""
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
        """The web between planets that stand twice half_gap (rad) apart.

        In a gap wider than at equal spacing the web keeps the shape that equal spacing gives it.
        """
        return Web(
            phi=min(half_gap, pi / self.planets),
            center_distance=self.center_distance,
            edge=self.plate_diameter / 2.0,
            width=self.web_width,
            clear=self.planet_tip_radius + self.web_clearance,
            inner_radius=self.web_inner_radius,
        )

    def check(self) -> None:
        """Raise InputError, naming the key and the remedy, if no carrier can be made."""
        reject, mm = self._reject, 1e3
        if self.fidelity not in SIZE:
            reject("fidelity", f"{self.fidelity!r} is unknown", "quick, standard or fine")
        if self.drive_side not in ("-z", "+z"):
            reject("drive_side", f"{self.drive_side!r} is unknown", '"-z" or "+z"')
        if self.planets < 2:
            reject("planets", "a carrier FE mesh wants two planets or more", "raise it")
        for key in (
            *("center_distance", "planet_tip_radius", "gear_face_width", "plate_diameter"),
            *("plate_thickness_drive", "plate_thickness_far", "plate_gap", "web_width"),
            *("pin_diameter", "hub_outer_diameter", "hub_bore", "hub_length"),
            *("seat_drive_diameter", "seat_drive_width", "seat_far_diameter", "seat_far_width"),
        ):
            if not getattr(self, key) > 0.0:
                reject(key, "must be above 0", "give a positive length")
        between = 2.0 * self.center_distance * sin(min(self.half_gaps[0]))
        if between <= 2.0 * self.planet_tip_radius:
            reject(
                "planets",
                f"neighbouring planets overlap by {(2 * self.planet_tip_radius - between) * mm:.1f}"
                " mm at their tips",
                "use fewer planets or fewer planet teeth",
            )
        if self.plate_gap <= self.gear_face_width:
            reject(
                "plate_gap",
                f"{self.plate_gap * mm:.0f} mm leaves no room for planets of "
                f"{self.gear_face_width * mm:.0f} mm face width",
                "make it wider than the face width",
            )
        if not 0.0 < self.seat_width <= self.plate_gap:
            reject("pin_seat_width", "must be above 0 and no wider than plate_gap", "change it")
        pin, bore, plate = self.pin_diameter / 2.0, self.hub_bore / 2.0, self.plate_diameter / 2.0
        if not 0.0 <= self.pin_bore < 0.9 * self.pin_diameter:
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
            reject(
                "plate_diameter",
                f"{plate * 2 * mm:.0f} mm does not enclose the pins, which reach to "
                f"{(self.center_distance + pin) * 2 * mm:.0f} mm",
                "raise it",
            )
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
        start, mm = web.start, 1e3
        tip = f"planets of {self.planet_tip_radius * mm:.1f} mm tip radius"
        if abs(web.edge - self.center_distance) >= web.arc_radius:
            self._reject(
                "web_width",
                f"webs of {self.web_width * mm:.0f} mm would close round the {tip}",
                "lower it",
            )
        if self.web_inner_radius is not None and (
            start <= self.hub_bore / 2.0
            or web.half_thickness(start) < 0.02 * self.web_width
            or start < self.center_distance * cos(web.phi)
        ):
            self._reject(
                "web_inner_radius",
                f"webs from {start * mm:.1f} mm collide with {tip} or with the bore",
                f"begin beyond {replace(web, inner_radius=None).start * mm:.0f} mm "
                "or leave the key out",
            )
        if start >= 0.96 * web.edge * cos(web.edge_angle):
            self._reject(
                "plate_diameter",
                f"no room for webs between {tip}: they would begin at {start * 2 * mm:.0f} mm",
                "raise plate_diameter, or lower web_width or the planets' tip radius",
            )

    def _reject(self, key: str, problem: str, remedy: str) -> NoReturn:
        raise InputError(
            self.where, _CASE_KEYS.get(key, f"stage.carrier.fe.{key}"), problem, remedy
        )


def carrier_fe_mesh(p: CarrierMeshParameters) -> FeMesh:
    """Tetrahedra of the carrier; patches drive, bearing_drive, bearing_far, pin_1 .. pin_N."""
    p.check()
    unit = meshing_unit(p.plate_diameter)
    fe_mesh = _in_gmsh(p.in_units_of(unit))
    return replace(fe_mesh, points=fe_mesh.points * unit)


def _in_gmsh(p: CarrierMeshParameters) -> FeMesh:
    """FE mesh of the carrier in the unit of its lengths, made by gmsh."""
    with gmsh_session("carrier") as gmsh:
        for meshes in half_sectors(gmsh, p):
            halves = [FeMesh(points, cells, "tet", {}) for points, cells in meshes]
            factor = _pin_factor(p, halves[0])  # one for all: they meet in a pin's plane
            moved = [(_rounded(p, half.points, factor), half.cells) for half in halves]
            if all(corner_jacobians(*half, "tet")[1].min() > FLATTEST for half in moved):
                rounded = [FeMesh(*half, "tet", {}) for half in moved]
                return complete(p, rounded, [_half_patches(p, half) for half in halves])
    raise InputError(
        p.where,
        "stage.carrier.fe",
        "no sound FE mesh: some edges nearly touch",
        "move hub, seat, bore and pin diameters apart by a few mm",
    )


def _half_patches(p: CarrierMeshParameters, half: FeMesh) -> dict[str, Ints]:
    """Patches of the half sector, found by their exact surfaces; keys without pin numbers."""
    facets = half.boundary
    at = half.points[facets]
    gap, tolerance = p.plate_gap / 2.0, 1e-7 * p.plate_diameter
    z_drive, z_far = -gap - p.plate_thickness_drive, gap + p.plate_thickness_far

    def cylinder(x: float, radius: float, low: float, high: float, name: str) -> Ints:
        off = np.abs(np.hypot(at[..., 0] - x, at[..., 1]) - radius).max(axis=1)
        z = at[..., 2]
        inside = (z.min(axis=1) > low - tolerance) & (z.max(axis=1) < high + tolerance)
        matching = facets[(off < tolerance) & inside & (np.ptp(z, axis=1) > tolerance)]
        if len(matching) == 0:
            raise FlexgearError(f"carrier: the FE mesh has no facets on {name}")
        return matching

    end = np.abs(at[..., 2] - (z_drive - p.hub_length)).max(axis=1) < tolerance
    seat = p.seat_width / 2.0
    return {
        "drive": facets[end],
        "bearing_drive": cylinder(
            0.0, p.seat_drive_diameter / 2.0, z_drive - p.seat_drive_width, z_drive, "seat_drive"
        ),
        "bearing_far": cylinder(
            0.0, p.seat_far_diameter / 2.0, z_far, z_far + p.seat_far_width, "seat_far"
        ),
        "pin": cylinder(p.center_distance, p.pin_diameter / 2.0, -seat, seat, "pins"),
    }


def _pin_factor(p: CarrierMeshParameters, half: FeMesh) -> float:
    """How far the pins' surface is to be pushed out until each pin has its true volume.

    A polygon inscribed in a circle has too small a section: bending stiffness goes with the
    square of the area and 16 straight sides would lose 5 %.
    """
    radius, gap = p.pin_diameter / 2.0, p.plate_gap / 2.0
    centre = half.points[half.cells].mean(axis=1)
    pin = np.hypot(centre[:, 0] - p.center_distance, centre[:, 1]) < radius
    pin_cells = half.cells[pin & (np.abs(centre[:, 2]) < gap)]
    exact = pi * (radius**2 - p.pin_bore**2 / 4.0) * gap  # half of π r² times the length 2 gap

    def missing(factor: float) -> float:
        e = _rounded(p, half.points, factor)[pin_cells]
        return float(np.linalg.det(e[:, 1:] - e[:, :1]).sum() / 6.0 - exact)

    return 1.0 if missing(1.0) >= 0.0 else float(brentq(missing, 1.0, 1.5))


def _rounded(p: CarrierMeshParameters, points: Array, factor: float) -> Array:
    """Vertices (n, 3) with those on the pin's surface at `factor` times its radius."""
    x, y, z = points[:, 0] - p.center_distance, points[:, 1], points[:, 2]
    tolerance = 1e-7 * p.plate_diameter
    skin = np.abs(np.hypot(x, y) - p.pin_diameter / 2.0) < tolerance
    skin &= np.abs(z) < p.plate_gap / 2.0 + tolerance
    moved = points.copy()
    moved[skin, 0] = p.center_distance + x[skin] * factor
    moved[skin, 1] = y[skin] * factor
    return moved
