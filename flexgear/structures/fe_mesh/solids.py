r"""Solids in closed form: volume and moments of ring, planet and carrier, mass of rigid bodies.

    V = \int dV,   s = \int x dV,   S = \int x x^T dV,

of prisms along z over polygons (Green's theorem) and circles. A rigid motion u + theta x x of such
a body has

    M = rho [V I, -[s]x; [s]x, tr(S) I - S],   [s]x v = s x v.

Ring, planet and carrier are those of ``gears`` and ``carrier_mesh``, with true circles and flanks.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.tooth import ToothGeometry
from flexgear.structures.bodies import rotation
from flexgear.structures.fe_mesh.carrier import CarrierFeMeshParameters, Web
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import PlanetFeMeshParameters, RingFeMeshParameters


@dataclass(frozen=True, eq=False)
class Solid:
    """Moments of a solid about the origin: moments (4, 4), ∫ [1, x]ᵀ [1, x] dV, m³ to m⁵."""

    moments: Array

    @property
    def volume(self) -> float:
        """Volume V, m³."""
        return float(self.moments[0, 0])

    @property
    def first(self) -> Array:
        """First moments s (3,) m⁴."""
        return self.moments[0, 1:]

    @property
    def second(self) -> Array:
        """Second moments S (3, 3) m⁵."""
        return self.moments[1:, 1:]

    def __add__(self, other: Solid) -> Solid:
        return Solid(self.moments + other.moments)

    def __sub__(self, other: Solid) -> Solid:
        return Solid(self.moments - other.moments)

    def shifted(self, by: Array) -> Solid:
        """The solid displaced by (3,) m."""
        move = np.eye(4)
        move[1:, 0] = by
        return Solid(move @ self.moments @ move.T)

    def mirrored(self) -> Solid:
        """The mirror image in the plane z = 0."""
        image = np.array([1.0, 1.0, 1.0, -1.0])
        return Solid(np.outer(image, image) * self.moments)

    def rigid_mass(self, density: float) -> Array:
        """Mass M (6, 6) for ux, uy, uz, rx, ry, rz of the origin; density in kg/m³."""
        x, y, z = self.first
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        out = np.empty((6, 6))
        out[:3, :3] = self.volume * np.eye(3)
        out[:3, 3:], out[3:, :3] = -cross, cross
        out[3:, 3:] = np.trace(self.second) * np.eye(3) - self.second
        return density * out


EMPTY = Solid(np.zeros((4, 4)))


def cylinder(
    radius: float, low: float, high: float, centre: tuple[float, float] = (0.0, 0.0)
) -> Solid:
    """Solid cylinder between the heights z = low and high, m."""
    at, area = np.array([1.0, *centre]), pi * radius**2
    inertia = area * radius**2 / 4
    return _prism(area * np.outer(at, at) + inertia * np.diag([0.0, 1.0, 1.0]), low, high)


def prism(corners: Array, low: float, high: float) -> Solid:
    """Solid between the heights z = low and high over a polygon with counter-clockwise corners
    (n, 2), m."""
    p = np.column_stack([np.ones(len(corners)), corners])
    q = np.roll(p, -1, axis=0)
    twice = p[:, 1] * q[:, 2] - q[:, 1] * p[:, 2]
    plane = sum(np.einsum("k,ki,kj->ij", twice, x, x) for x in (p + q, p, q)) / 24
    plane[0] = plane[:, 0] = twice @ (p + q) / 6
    plane[0, 0] = twice.sum() / 2
    return _prism(plane, low, high)


def _prism(plane: Array, low: float, high: float) -> Solid:
    """Prism along z from the moments ∫ [1, x, y]ᵀ [1, x, y] dA (3, 3) of its section."""
    long, squared, cubed = high - low, (high**2 - low**2) / 2, (high**3 - low**3) / 3
    out = np.empty((4, 4))
    out[:3, :3] = long * plane
    out[:3, 3] = out[3, :3] = squared * plane[0]
    out[3, 3] = cubed * plane[0, 0]
    return Solid(out)


_POINTS = 24  # of a flank, of a fillet with its land, of an arc of a web


def ring_solid(p: RingFeMeshParameters) -> Solid:
    """Solid of the ring; the origin is its centre. The helix has no effect on the moments of equal
    sections but in products of x or y with z, which teeth all round cancel."""
    half = p.face_width / 2.0
    out = cylinder(p.outer_radius, -half, half) - prism(_outline(p.tooth), -half, half)
    if p.bolt_holes:
        for angle in p.first_bolt_angle + 2.0 * pi * np.arange(p.bolts) / p.bolts:
            place = p.bolt_circle_diameter / 2.0 * np.array([np.cos(angle), np.sin(angle)])
            out = out - cylinder(p.bolt_diameter / 2.0, -half, half, tuple(place))
    return out


def planet_solid(p: PlanetFeMeshParameters) -> Solid:
    """Solid of the planet with its bore; the origin is its centre."""
    half = p.face_width / 2.0
    return prism(_outline(p.tooth), -half, half) - cylinder(p.bore_radius, -half, half)


def carrier_solid(p: CarrierFeMeshParameters) -> Solid:
    """Solid of the carrier; z = 0 is the middle between its plates."""
    gap, bore = p.plate_gap / 2.0, p.hub_bore / 2.0
    drive, far = -gap - p.plate_thickness_drive, gap + p.plate_thickness_far
    seat, end = drive - p.seat_drive_width, drive - p.hub_length
    rounds = [
        (p.hub_diameter, end, seat),
        (p.seat_drive_diameter, seat, drive),
        (p.plate_diameter, drive, -gap),
        (p.plate_diameter, gap, far),
        (p.seat_far_diameter, far, far + p.seat_far_width),
    ]
    out = EMPTY
    for diameter, low, high in rounds:
        out = out + (cylinder(diameter / 2.0, low, high) - cylinder(bore, low, high))
    for angle in p.angles:
        place = (p.center_distance * np.cos(angle), p.center_distance * np.sin(angle))
        out = out + cylinder(p.pin_diameter / 2.0, -gap, gap, place)
        out = out - cylinder(p.pin_bore / 2.0, drive, far, place)
    halves, order, which = p.half_gaps
    for pin, kind in zip(order, which, strict=True):
        middle = p.angles[pin] + halves[kind]
        turned = _web_outline(p.web(halves[kind])) @ rotation(middle)[:2, :2].T
        out = out + prism(turned, -gap, gap)
    return out.mirrored() if p.drive_side == "+z" else out


def solid_of_fe_mesh(fe_mesh: FeMesh) -> Solid:
    """Solid of the cells of an FE mesh."""
    points, weights = fe_mesh.quadrature()
    at = np.concatenate([np.ones((*weights.shape, 1)), points], axis=2)
    return Solid(np.einsum("mq,mqi,mqj->ij", weights, at, at))


def _outline(tooth: ToothGeometry) -> Array:
    """Polygon (n, 2) m along all flanks, roots and tips of a gear, counter-clockwise."""
    side = tooth.profile(_POINTS, _POINTS)
    tip = np.linspace(-1.0, 1.0, _POINTS)[1:-1] * np.arctan2(side[0, 1], side[0, 0])
    radius, angle = np.hypot(*side.T), np.arctan2(side[:, 1], side[:, 0])
    radius = np.concatenate([radius[::-1], np.full(len(tip), tooth.tip_radius), radius])
    angle = np.concatenate([-angle[::-1], tip, angle])
    around = angle + tooth.pitch_angle * np.arange(tooth.teeth)[:, None]
    out = radius[:, None] * np.stack([np.cos(around), np.sin(around)], axis=2)
    return out.reshape(-1, 2)


def _web_outline(web: Web) -> Array:
    """Polygon (n, 2) m round a web on the x axis, counter-clockwise."""
    half = web.half_thickness(web.start)
    pin = web.center_distance * np.array([np.cos(web.phi), -np.sin(web.phi)])
    on_edge = web.edge * np.array([np.cos(web.edge_angle), -np.sin(web.edge_angle)])
    first, last = np.array([web.start, -half]) - pin, on_edge - pin
    turn = np.linspace(np.arctan2(first[1], first[0]), np.arctan2(last[1], last[0]), _POINTS)
    arc = pin + web.arc_radius * np.column_stack([np.cos(turn), np.sin(turn)])
    edge = np.linspace(-web.edge_angle, web.edge_angle, _POINTS)[1:-1]
    across = web.edge * np.column_stack([np.cos(edge), np.sin(edge)])
    return np.concatenate([arc, across, arc[::-1] * np.array([1.0, -1.0])])
