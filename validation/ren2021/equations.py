"""The paper's 16 + 4N equations as plain matrices with corrected signs, without the package.

Coordinates (x, y, z, u) of carrier, left ring (the paper's r2), right ring (r1) and sun, then
(ξ, η, ρ, u) of the planets, u = r θ, in the frame of the carrier (eqs. 1 and 2). Every force
follows from the deflections of eq. 3 by virtual work, which sets right what eqs. 5, 8 and 9 print
wrongly (source.md). The sun drives. Gear meshes are numbered sun left, sun right, ring left, ring
right, planets 1 … N in each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from linear import Linear, modal_damping

from flexgear.arrays import Array

CARRIER, LEFT, RIGHT, SUN, PLANETS = 0, 4, 8, 12, 16  # first coordinates
HALVES = (("sun", +1, SUN), ("sun", -1, SUN), ("ring", +1, LEFT), ("ring", -1, RIGHT))


@dataclass(frozen=True)
class Stage:
    """Table 1, and what the paper leaves out: module and gear-mesh stiffness (of a half, N/m)."""

    planets: int = 3
    sun_teeth: int = 23
    planet_teeth: int = 17
    ring_teeth: int = 57
    pressure_angle: float = float(np.radians(20.0))  # normal
    helix_angle: float = float(np.radians(25.0))
    face_width: float = 0.170  # of a half
    carrier: tuple[float, float] = (5091.0, 5724.0)  # mass and J/r², kg
    planet: tuple[float, float] = (525.0, 420.0)
    sun: tuple[float, float] = (750.0, 663.0)
    ring: tuple[float, float] = (450.0, 546.0)
    torque: float = 100e3
    speed: float = 100.0 * np.pi / 30.0
    module: float = 0.022
    sun_stiffness: float = 2.5e9
    ring_stiffness: float = 3.3e9
    damping_ratio: float = 0.02  # of supports and bearings, by modes without gear meshes
    gear_mesh_damping: float = 0.07  # ratio of each gear mesh

    @property
    def transverse_angle(self) -> float:
        """tan α_t = tan α_n / cos β."""
        return float(np.arctan(np.tan(self.pressure_angle) / np.cos(self.helix_angle)))

    @property
    def base_helix(self) -> float:
        """sin β_b = sin β cos α_n."""
        return float(np.arcsin(np.sin(self.helix_angle) * np.cos(self.pressure_angle)))

    @property
    def sun_radius(self) -> float:
        """Base radius of the sun, m."""
        return self._reference(self.sun_teeth) * float(np.cos(self.transverse_angle))

    @property
    def carrier_radius(self) -> float:
        """Centre distance, m."""
        return self._reference(self.sun_teeth + self.planet_teeth)

    @property
    def angles(self) -> Array:
        """φ_i of the planets, rad; evenly spaced, though 80/3 is no integer."""
        return 2 * np.pi * np.arange(self.planets) / self.planets

    @property
    def carrier_speed(self) -> float:
        """ω_c, rad/s, with the rings held."""
        return self.speed * self.sun_teeth / (self.sun_teeth + self.ring_teeth)

    @property
    def sun_relative(self) -> float:
        """ω_s − ω_c, rad/s."""
        return self.speed - self.carrier_speed

    @property
    def planet_relative(self) -> float:
        """ω_p − ω_c, rad/s, against the sense of the sun."""
        return -self.sun_relative * self.sun_teeth / self.planet_teeth

    @property
    def gear_mesh_rate(self) -> float:
        """ω_m = z_r ω_c, rad/s."""
        return self.ring_teeth * self.carrier_speed

    @property
    def cycles(self) -> int:
        """Gear-mesh cycles until sun, planet and ring stand as at the start."""
        return int(np.lcm.reduce([self.sun_teeth, self.planet_teeth, self.ring_teeth]))

    @property
    def mean_force(self) -> float:
        """Gear-mesh force of one half along the 3D normal, T_s/(2 N r_s cos β_b), N."""
        return self.torque / (2 * self.planets * self.sun_radius * float(np.cos(self.base_helix)))

    def _reference(self, teeth: int) -> float:
        return self.module * teeth / (2 * float(np.cos(self.helix_angle)))


@dataclass(frozen=True)
class Supports:
    """Table 2, N/m: radial k_s, k_c, k_p (x and y), k_r of each ring; axial and torsional."""

    sun: float = 1e9
    carrier: float = 1e9
    ring: float = 1e10
    planet: float = 1e9
    axial: float = 1e9
    ring_axial: float = 1e10
    ring_torsion: float = 1e10

    def times(self, factor: float) -> Supports:
        """All of them ``factor`` times as stiff."""
        return Supports(**{name: factor * value for name, value in vars(self).items()})


def deflections(stage: Stage) -> Array:
    """(4N, 16 + 4N) rows of the gear-mesh deflections μ of eq. 3."""
    at, cb, sb = stage.transverse_angle, np.cos(stage.base_helix), np.sin(stage.base_helix)
    rows = np.zeros((4 * stage.planets, PLANETS + 4 * stage.planets))
    s, c = np.sin(at) * cb, np.cos(at) * cb
    for half, (kind, hand, first) in enumerate(HALVES):
        for i, phi in enumerate(stage.angles):
            row = rows[half * stage.planets + i]
            columns = slice(PLANETS + 4 * i, PLANETS + 4 * i + 4)
            if kind == "sun":
                a = phi - at
                row[first : first + 4] = -np.sin(a) * cb, np.cos(a) * cb, hand * sb, cb
                row[columns] = -s, -c, -hand * sb, cb
            else:
                a = phi + at
                row[first : first + 4] = -np.sin(a) * cb, np.cos(a) * cb, -hand * sb, cb
                row[columns] = s, -c, hand * sb, -cb
    return rows


def bearings(stage: Stage) -> Array:
    """(3N, 16 + 4N) rows of the planet bearings' deflections of eq. 3."""
    rows = np.zeros((3 * stage.planets, PLANETS + 4 * stage.planets))
    for i, phi in enumerate(stage.angles):
        first = PLANETS + 4 * i
        rows[3 * i, :2] = np.cos(phi), np.sin(phi)
        rows[3 * i + 1, :4] = -np.sin(phi), np.cos(phi), 0, 1
        rows[3 * i + 2, 2] = 1
        for k in range(3):
            rows[3 * i + k, first + k] = -1
    return rows


def matrices(stage: Stage, supports: Supports, gyroscopic: bool = True) -> Linear:
    """The stage as a linear system.

    Eq. 10 has no damping, without which start-up never dies: modes of the stage without gear meshes
    have the damping ratio of ``stage``, gear meshes c = 2 ζ √(k m) with 1/m = r²/J + r²/J of both
    gears. gyroscopic: Coriolis and centripetal terms of eqs. 5-9.
    """
    pairs = (stage.carrier, stage.ring, stage.ring, stage.sun, *[stage.planet] * stage.planets)
    mass = np.diag([value for m, i in pairs for value in (m, m, m, i)])
    rows, planet = deflections(stage), bearings(stage)
    k = np.repeat([stage.sun_stiffness] * 2 + [stage.ring_stiffness] * 2, stage.planets)
    stiffness = supports.planet * planet.T @ planet
    for first, radial, axial, torsion in (
        (CARRIER, supports.carrier, supports.axial, 0.0),
        (LEFT, supports.ring, supports.ring_axial, supports.ring_torsion),
        (RIGHT, supports.ring, supports.ring_axial, supports.ring_torsion),
        (SUN, supports.sun, supports.axial, 0.0),
    ):
        values = (radial, radial, axial, torsion)
        stiffness[range(first, first + 4), range(first, first + 4)] += values
    inertia = [1 / (1 / stage.planet[1] + 1 / gear[1]) for gear in (stage.sun, stage.ring)]
    c = 2 * stage.gear_mesh_damping * np.sqrt(k * np.repeat(inertia, 2 * stage.planets))
    damping = modal_damping(mass, stiffness, stage.damping_ratio) + rows.T @ (c[:, None] * rows)
    stiffness += rows.T @ (k[:, None] * rows)
    if gyroscopic:
        speed = stage.carrier_speed
        for x in range(0, len(mass), 4):
            damping[x, x + 1] -= 2 * speed * mass[x, x]
            damping[x + 1, x] += 2 * speed * mass[x, x]
            stiffness[[x, x + 1], [x, x + 1]] -= speed**2 * mass[x, x]
    load = np.zeros(len(mass))
    load[SUN + 3] = stage.torque / stage.sun_radius
    ratio = 1 + stage.ring_teeth / stage.sun_teeth
    load[CARRIER + 3] = -stage.torque * ratio / stage.carrier_radius
    return Linear(mass, damping, stiffness, rows, k, c, load)
