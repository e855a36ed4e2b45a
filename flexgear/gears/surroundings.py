"""Rim, ring support, carrier, shaft, bearings and inertias of a proposed stage; SI."""

import math
from dataclasses import dataclass

from flexgear.gears.bearings.basic_life import roller_bearing_stiffness
from flexgear.gears.sizing import Proposal

STEEL, DENSITY = 2.06e11, 7850.0  # Pa, kg/m³
BOLTS = {  # stress area, m², by nominal diameter, m (ISO 724, ISO 898-1)
    5e-3: 14.2e-6, 6e-3: 20.1e-6, 8e-3: 36.6e-6, 10e-3: 58.0e-6, 12e-3: 84.3e-6, 16e-3: 157e-6,
    20e-3: 245e-6, 24e-3: 353e-6, 30e-3: 561e-6, 36e-3: 817e-6, 42e-3: 1121e-6, 48e-3: 1473e-6,
    56e-3: 2030e-6, 64e-3: 2676e-6, 72e-3: 3460e-6,
}  # fmt: skip
PRELOAD = 0.65 * 940e6  # Pa, of grade 10.9 over the stress area (VDI 2230)
FRICTION, SAFETY = 0.12, 1.5
LEAST_BOLTS, MANY_BOLTS = 8, 40
RIM, THICKEST_RIM = 3.0, 3.5  # modules: ISO 6336-3 reduces no strength from 3.5 modules
OVAL = 0.05  # modules by which a splined ring may bend: half of what counts as small
BOLTED_RIM = 2.2  # rim thickness over bolt diameter, bolts in the middle of the rim
SPACING = 3.0  # diameters between bolts, for the wrench
SHEAR = 1e8  # Pa, in the sun's shaft
TWIST = 1e-3  # rad, of a shaft's spline at rated torque
ROLL = 0.02  # modules by which the teeth of a splined ring move round the axis at rated torque
SECONDS = 0.05  # kinetic energy of the machine at a port over rated power


@dataclass(frozen=True)
class Bolting:
    """Bolts on a circle in the middle of the rim; m, N/m, N m/rad. axial, across, tilt: stiffnesses
    of one bolt; friction: share of the ring's torque that friction transmits with ``SAFETY``; pins
    take the rest."""

    number: int
    diameter: float
    circle: float
    rim: float
    axial: float
    across: float
    tilt: float
    friction: float


@dataclass(frozen=True)
class Splined:
    """Outer spline of the ring, over 0.8 of the face width; m, N/m, N m/rad."""

    rim: float
    half_width: float
    across: float
    tilt: float
    torsion: float


def ring_support(p: Proposal) -> Bolting | Splined:
    """Support of the ring, or of one half. In a rim of 3 to 3.5 modules the thinnest bolts, 8 to
    50, whose friction carries the torque with safety 1.5 (VDI 2230); else the thickest bolts that
    fit, with pins; an outer spline if no bolts fit into such a rim."""
    torque, bolting = p.ring_torque / p.request.halves, None
    for diameter, area in BOLTS.items():
        rim = max(RIM * p.module, BOLTED_RIM * diameter)
        if rim > THICKEST_RIM * p.module * (1 + 1e-9):
            break
        circle = p.root_diameter("ring") + rim
        fit = math.floor(math.pi * circle / (SPACING * diameter))
        bolt_torque = FRICTION * PRELOAD * area * circle / 2 / SAFETY
        needed = max(math.ceil(torque / bolt_torque), LEAST_BOLTS)
        number = _number_of_bolts(needed, fit, p.gear_set.teeth["ring"].teeth)
        axial = STEEL * math.pi / 4 * 3 * diameter**2 / p.face_width  # sleeve of two diameters
        share = min(number * bolt_torque / torque, 1.0)
        bolting = Bolting(
            number, diameter, circle, rim, axial, 0.5 * axial, axial * diameter**2, share
        )
        if share == 1.0:
            break
    return bolting or _splined(p, torque)


def _number_of_bolts(needed: int, fit: int, teeth: int) -> int:
    """Number of bolts whose greatest common divisor with the ring's number of teeth is largest: the
    ring then repeats in small parts, and its reduction is fast.

    needed: bolts that carry the torque by friction; up to a quarter more are taken. fit: bolts for
    which the circle has room. If more than that, or than ``MANY_BOLTS``, were needed, pins carry
    the rest, and the number is within a quarter of the smaller of both."""
    many = min(fit, MANY_BOLTS)
    if needed <= many:
        numbers = range(needed, min(fit, 5 * needed // 4) + 1)
    else:
        numbers = range(min(fit, 5 * many // 4), math.ceil(0.75 * many) - 1, -1)
    return max(numbers, key=lambda number: math.gcd(number, teeth))


def _splined(p: Proposal, torque: float) -> Splined:
    """Outer spline of a ring, or of one half, with its torque, N m.

    A spline does not keep the ring round. As a thin ring of mean radius R with radial forces F at N
    equal angles it bends at these, with θ = π/N, by

        w = F R³/(2 E I) ((θ + sin θ cos θ)/(2 sin² θ) − 1/θ),  I = b h³/12

    (Timoshenko, Strength of Materials II): the rim h is so thick that w is at most ``OVAL``.
    """
    ring, angle = p.gear_set.teeth["ring"], math.pi / p.request.planets
    shape = (angle + math.sin(angle) * math.cos(angle)) / (2 * math.sin(angle) ** 2) - 1 / angle
    force = torque * math.tan(ring.transverse_angle)
    force /= p.request.planets * p.module * ring.reference_radius
    rim = least = max(RIM * p.module, 1.2e-3)
    for _ in range(5):  # R grows with the rim
        radius = 0.5 * (p.root_diameter("ring") + rim)
        bending = 6 * force * radius**3 * shape / (STEEL * p.face_width * OVAL * p.module)
        rim = max(least, bending ** (1 / 3))
    half_width = 0.4 * p.face_width
    torsion = torque * ring.reference_radius / ROLL  # the radius in modules
    across = 0.3 * torsion / (0.5 * p.root_diameter("ring") + rim) ** 2
    return Splined(rim, half_width, across, across * half_width**2, torsion)


@dataclass(frozen=True)
class Hub:
    """Hub of a rotating ring: a flange a third as wide as the gear; SI. z: position of its centre,
    from the middle of the gear."""

    mass: float
    inertia: float
    tilt_inertia: float
    z: float


def ring_hub(p: Proposal, rim: float) -> Hub:
    """Proposed hub that carries a ring; rim: radial thickness of the ring's rim, m."""
    radius, width = 0.5 * p.root_diameter("ring") + rim, p.gear_width / 3
    mass = DENSITY * math.pi * radius**2 * width
    tilt = mass * (radius**2 / 4 + width**2 / 12)
    return Hub(mass, 0.5 * mass * radius**2, tilt, 0.5 * (p.gear_width + width))


@dataclass(frozen=True)
class CarrierSize:
    """Dimensions of an FE carrier and the planets' bore, m."""

    plate_diameter: float
    plate: float
    gap: float
    web_width: float
    web_clearance: float
    pin: float
    bore: float
    hub_bore: float
    hub: float
    hub_length: float
    shaft: float


def carrier_size(p: Proposal) -> CarrierSize:
    """Dimensions of a carrier with two plates. Pin and bearing fill the planets' bore, plates
    enclose the pins and pass through the ring, webs take most of the space between planets."""
    m, a = p.module, p.center_distance
    root = p.root_diameter("planet")
    bore = min(0.7 * root, root - 5.4 * m)  # ISO 6336-3: the rim is full from 1.2 tooth heights on
    pin = 0.75 * bore
    through = 2 * m * p.gear_set.teeth["ring"].tip_radius - 2 * m
    plate = max(min(2 * (a + 0.8 * pin), through), 2 * (a + 0.6 * pin))
    shaft = (16 * p.sun_torque / (math.pi * SHEAR)) ** (1 / 3)
    hub_bore = min(1.15 * shaft, 1.6 * (a - 0.55 * pin))
    hub = min(max(hub_bore + pin, 1.3 * hub_bore), 0.85 * plate)
    clearance = max(0.5 * m, 5e-4)
    seat = 0.25 * hub
    return CarrierSize(
        plate_diameter=plate,
        plate=max(0.5 * pin, plate / 16),  # by trials: thinner ones miss 2 % at "quick"
        gap=p.gear_width + 2 * m,
        web_width=_web(p, plate / 2, clearance),
        web_clearance=clearance,
        pin=pin,
        bore=bore,
        hub_bore=hub_bore,
        hub=hub,
        hub_length=2 * seat,
        shaft=shaft,
    )


def _web(p: Proposal, edge: float, clearance: float) -> float:
    """Width of a web, m: 0.8 of the space between two planets at the edge of the plates, and at
    most 0.7 tip radii of a planet."""
    a, radius = p.center_distance, p.planet_tip_radius + clearance
    angle = math.acos(min(1.0, (edge**2 + a**2 - radius**2) / (2 * edge * a)))
    free = 2 * edge * math.sin(math.pi / p.request.planets - angle)
    return min(0.8 * free, 0.7 * p.planet_tip_radius)


def bearing_stiffness(p: Proposal) -> float:
    """Radial stiffness of a planet bearing under its load, N/m: half that of a roller bearing, to
    include the compliance of pin and seat."""
    return 0.5 * roller_bearing_stiffness(p.pin_force, p.gear_width)


def port_inertia(p: Proposal) -> float:
    """Polar inertia of the machine at the slow member, kg m²: its energy is rated power times
    0.05 s, at most that of a hundred steel discs of the size of the ring."""
    radius = p.module * p.gear_set.teeth["ring"].reference_radius
    disc = 0.5 * math.pi * DENSITY * p.gear_width * radius**4
    return min(2 * SECONDS * p.request.torque / p.request.speed, 100 * disc)
