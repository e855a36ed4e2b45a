"""What a proposed stage stands in: rim and bolts, carrier, shaft, bearings, inertias; SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flexgear.gears.bearing_stiffness import roller_bearing_stiffness
from flexgear.gears.sizing import Proposal
from flexgear.model.errors import InputError

STEEL = 2.06e11  # Pa
BOLTS = {  # nominal diameter: stress area, m (ISO 724, ISO 898-1)
    4e-3: 8.78e-6, 5e-3: 14.2e-6, 6e-3: 20.1e-6, 8e-3: 36.6e-6, 10e-3: 58.0e-6, 12e-3: 84.3e-6,
    16e-3: 157e-6, 20e-3: 245e-6, 24e-3: 353e-6, 30e-3: 561e-6, 36e-3: 817e-6, 42e-3: 1121e-6,
    48e-3: 1473e-6, 56e-3: 2030e-6, 64e-3: 2676e-6, 72e-3: 3460e-6, 90e-3: 5590e-6, 100e-3: 6990e-6,
}  # fmt: skip
CLAMP = 0.65 * 940e6  # Pa, preload of grade 10.9 over the stress area (VDI 2230)
FRICTION, SAFETY, MOST_BOLTS = 0.12, 1.5, 96
SHEAR = 1e8  # Pa, in the sun's shaft
SECONDS = 0.05  # rated power times this is the kinetic energy of what hangs on a port


@dataclass(frozen=True)
class Bolting:
    """Bolts on their circle in the middle of the rim outside the root circle; m, N/m, N m/rad."""

    number: int
    diameter: float
    circle: float
    rim: float
    axial: float
    across: float
    tilt: float


def bolting(p: Proposal) -> Bolting:
    """The thinnest bolts whose friction carries the ring's torque with safety 1.5 (VDI 2230).

    They stand in a rim of 3.5 modules or more, from where on it is full by ISO 6336-3, that leaves
    the helix of the teeth room to fade towards the straight bolts. Of a double-helical stage those
    of one half.
    """
    root = p.ring * p.transverse_module + 2 * (1.25 - p.shifts[2]) * p.module
    torque = (p.wanted.torque - p.sun_torque) / p.wanted.halves
    for diameter, area in BOLTS.items():
        fading = 0.6 * p.face_width * math.tan(p.wanted.helix)
        rim = max(3.5 * p.module, 2.2 * diameter, 2.4 * (fading + 0.6 * diameter))
        circle = root + rim
        needed = math.ceil(SAFETY * torque / (FRICTION * CLAMP * area * circle / 2))
        number = max(needed, 8)
        if number <= MOST_BOLTS and number * 2.8 * diameter <= math.pi * circle:
            clamped = math.pi / 4 * 3 * diameter**2  # a sleeve twice as wide as the bolt
            axial = STEEL * clamped / p.face_width
            return Bolting(number, diameter, circle, rim, axial, 0.5 * axial, axial * diameter**2)
    raise InputError("new", "--torque-nm", "is more than bolts can hold", "use fewer planets")


@dataclass(frozen=True)
class CarrierSize:
    """Lengths of an FE carrier and of the planets' bore, m."""

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
    """Two plates round the planets: pins fill the planets' bore but for the bearing, the plates
    enclose the pins and pass through the ring, webs take most of the room between planets."""
    m, a = p.module, p.center_distance
    root = p.planet * p.transverse_module - 2 * (1.25 - p.shifts[1]) * m
    bore = min(0.7 * root, root - 5.4 * m)  # ISO 6336-3: the rim is full from 1.2 tooth heights on
    pin = 0.75 * bore
    through = p.ring * p.transverse_module - 2 * (1 + p.shifts[2]) * m - 2 * m
    plate = max(min(2 * (a + 0.8 * pin), through), 2 * (a + 0.6 * pin))
    shaft = (16 * p.sun_torque / (math.pi * SHEAR)) ** (1 / 3)
    hub_bore = min(1.15 * shaft, 1.6 * (a - 0.55 * pin))
    hub = min(max(hub_bore + pin, 1.3 * hub_bore), 0.85 * plate)
    clearance = max(0.5 * m, 5e-4)
    seat = 0.25 * hub
    return CarrierSize(
        plate_diameter=plate,
        plate=0.5 * pin,
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
    """Most of the free width between two planets at the plates' edge, m."""
    a, clear = p.center_distance, p.planet_tip_radius + clearance
    turn = math.acos(min(1.0, (edge**2 + a**2 - clear**2) / (2 * edge * a)))
    free = 2 * edge * math.sin(math.pi / p.wanted.planets - turn)
    return min(0.8 * free, 0.7 * p.planet_tip_radius)


def bearing_stiffness(p: Proposal) -> float:
    """Radial stiffness of a planet bearing at its load, N/m: half of a roller bearing's, since pin
    and seat give way, too."""
    return 0.5 * roller_bearing_stiffness(p.pin_force, p.gear_width)


def port_inertia(p: Proposal) -> float:
    """Polar inertia at the carrier whose energy is the rated power of 0.05 s, but at most that of a
    hundred steel discs as large as the ring, kg m²."""
    disc = 0.5 * math.pi * 7850.0 * p.gear_width * (0.5 * p.ring * p.transverse_module) ** 4
    return min(2 * SECONDS * p.wanted.torque / p.wanted.speed, 100 * disc)
