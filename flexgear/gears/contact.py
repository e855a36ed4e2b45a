"""Paths of contact: position of every tooth pair on its path at a carrier angle.

Planet axes: x radial outward, y tangential, z axial; n is the unit in-plane force on the planet,
(−sin α, −cos α) from the ring and (+sin α, −cos α) from the sun. The path coordinate s is the
distance from the planet's base tangent point T_p against n, so that a contact point is
C = T_p − s n + z e_z and s = ρ_p. On the flank of ring tooth j (centre at φ_j)

    s = r_b,r (φ_j − δ_b,r + α_w − θ_c − φ_i + κ z) − R_c sin α_w ,

with δ_b the half angle of a tooth at the base circle (``tooth``); s falls with θ_c, from planet tip
to ring tip. The planet tooth in contact with that ring tooth has the centre angle
γ = s/r_b,p − δ_b,p − α_w, and its flank towards the sun s = r_b,p (π + α_w + δ_b,p − γ), which
rises with θ_c. Paths of coast flanks follow by mirroring all angles. Backlash is made by thinner
teeth of ring and sun on their coast flanks, so that it does not move contact on drive flanks.
Derived from the involutes; the modulo rule of Tan et al. 2023, eqs. 11–14 is not used.

``paths`` builds the paths of any stage: halves of double-helical gears have a side and a mid-plane,
and stiffness may be a wave over the base pitch in place of single pairs.
"""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Self

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.gears.geometry import StageGeometry
from flexgear.gears.off_path import OffPath
from flexgear.gears.slices import Slices
from flexgear.gears.stiffness import Law, pair_stiffness


class GearMeshKind(StrEnum):
    """Gear mesh of planets with the ring or the sun, on their drive or coast flanks. A parallel
    stage has only those of the sun, which is its pinion."""

    RING = "ring"
    SUN = "sun"
    RING_COAST = "ring_coast"
    SUN_COAST = "sun_coast"

    @classmethod
    def both(cls, gear: str) -> tuple[Self, Self]:
        """Kinds of the drive and of the coast flanks of a gear, "ring" or "sun"."""
        drive, coast = (kind for kind in cls if kind.gear == gear)
        return drive, coast

    @property
    def internal(self) -> bool:
        """Whether the gear has internal teeth."""
        return self in (GearMeshKind.RING, GearMeshKind.RING_COAST)

    @property
    def gear(self) -> str:
        """Name of the gear: "ring" or "sun"."""
        return "ring" if self.internal else "sun"

    @property
    def coast(self) -> bool:
        """Whether the gear mesh is on coast flanks."""
        return self in (GearMeshKind.RING_COAST, GearMeshKind.SUN_COAST)


TABLE_POINTS = 2001
ASSEMBLY_TOLERANCE = 1e-3  # of a sun tooth pitch


@dataclass(frozen=True, repr=False)
class GearMeshPath:
    """One kind of gear mesh of all N planets.

    Pair k of planet i: s = s0[i] + k base_pitch + rate θ_c at z = 0, s(z) = s + slope z.
    Tooth numbers (0-based): (gear_tooth0[i] + gear_step k) mod gear_teeth, likewise the planet's.
    s_grid, k_grid, zc_grid: pair stiffness (N/m, along the 3D normal) and centroid (m).
    carries: whether these flanks carry the rated torque. side: "left" or "right" half of a
    double-helical stage; z counts from its mid-plane z_offset. wave: (T,) N/m, periodic stiffness
    of the whole gear mesh at s = s_lo + j/T base_pitch; None where every pair has its stiffness.
    gap_grid: gap of modified flanks at s_grid, m along the 3D normal. off_path: tip contact beyond
    s_lo and s_hi, with the gap at any s. slices: slices of contact lines over s_grid, including the
    gap, where the load distribution along the face is computed.
    Lengths m, angles rad, rate m/rad.
    """

    kind: GearMeshKind
    s0: Array
    rate: float
    base_pitch: float
    s_lo: float
    s_hi: float
    slope: float
    half_face: float
    alpha: float
    base_radius_planet: float
    base_radius_gear: float
    center_distance: float
    normal_xy: Array
    tangent_point: Array
    gear_tooth0: Ints
    gear_step: int
    gear_teeth: int
    planet_tooth0: Ints
    planet_step: int
    planet_teeth: int
    s_grid: Array
    k_grid: Array
    zc_grid: Array
    gap_grid: Array
    backlash: float
    off_path: OffPath
    carries: bool = True
    side: str = ""
    z_offset: float = 0.0
    wave: Array | None = None
    slices: Slices | None = None

    def __repr__(self) -> str:
        teeth = f"{self.gear_teeth}/{self.planet_teeth} teeth"
        s = f"s from {1e3 * self.s_lo:.4g} to {1e3 * self.s_hi:.4g} mm"
        return f"<{f'{self.side} {self.kind.value}'.strip()} path of contact: {teeth}, {s}>"

    @property
    def touching(self) -> tuple[float, float]:
        """Path coordinates between which a point of a contact line may touch, m."""
        return (self.s_lo, self.s_hi) if self.slices is None else self.slices.span

    @property
    def cos_base_helix(self) -> float:
        """cos β_b: component of the 3D normal N in the plane of rotation."""
        return 1.0 / math.hypot(1.0, self.slope)

    @property
    def planet_arm(self) -> float:
        """Signed moment of N about the planet's axis, m."""
        (x, y), (nx, ny) = self.tangent_point, self.normal_xy
        return math.copysign(self.base_radius_planet, x * ny - y * nx) * self.cos_base_helix

    @property
    def gear_arm(self) -> float:
        """Signed moment of N about the gear's axis, m: same sign as ``planet_arm`` at the ring,
        opposite at the sun."""
        inward = 1.0 if self.kind.internal else -1.0
        sign = inward * math.copysign(1.0, self.planet_arm)
        return sign * self.base_radius_gear * self.cos_base_helix

    @property
    def mean_stiffness(self) -> float:
        """Mean stiffness over a base pitch, N/m: of the wave, or of the sum of all pairs."""
        if self.wave is not None:
            return float(self.wave.mean())
        return float(np.trapezoid(self.k_grid, self.s_grid)) / self.base_pitch

    def position(self, planet: int, index: int, carrier_angle: float) -> float:
        """Path coordinate of pair ``index`` of planet ``planet`` (0-based) at z = 0, m."""
        return float(self.s0[planet] + index * self.base_pitch + self.rate * carrier_angle)


def ring_start(g: StageGeometry, planet_angles: Array) -> Array:
    """Path coordinates s (N,), m, at which the ring tooth on the x axis touches every planet, at
    θ_c = 0 and z = 0."""
    a, ring = g.ring_gear_mesh.working_angle, g.ring
    angle = -ring.base_half_angle + a - planet_angles
    return ring.base_radius * angle - g.center_distance * math.sin(a)


def planet_tooth_angle(g: StageGeometry, s: Array) -> Array:
    """Centre angle γ, in planet axes, of the planet tooth whose ring-side flank is at s, rad."""
    planet = g.planet
    return s / planet.base_radius - planet.base_half_angle - g.ring_gear_mesh.working_angle


def sun_side(g: StageGeometry, planet_tooth: Array) -> Array:
    """Path coordinate s of the sun-side flank of planet teeth at centre angles γ, m."""
    planet, a = g.planet, g.sun_gear_mesh.working_angle
    return planet.base_radius * (math.pi + a + planet.base_half_angle - planet_tooth)


def sun_tooth_angle(g: StageGeometry, s: Array) -> Array:
    """Centre angle, in planet axes, of the sun tooth that touches at s, rad."""
    a, sun = g.sun_gear_mesh.working_angle, g.sun
    rho = g.center_distance * math.sin(a) - s
    return a + sun.base_half_angle - rho / sun.base_radius


def tooth_numbers(angles: Array, reference: float, teeth: int) -> tuple[Ints, Array]:
    """Numbers of the teeth nearest to angles, and the remaining differences in pitches. reference:
    angle of tooth 0, rad."""
    place = (angles - reference) * teeth / (2 * math.pi)
    number = np.rint(place)
    return number.astype(np.int64), place - number


def assembly_mismatch(g: StageGeometry, planet_angles: Array) -> Array:
    """Assembly error (N,) in sun pitches: position of the sun tooth at every planet relative to the
    position that planet 1 requires."""
    gamma = planet_tooth_angle(g, ring_start(g, planet_angles))
    sigma = sun_tooth_angle(g, sun_side(g, gamma)) + planet_angles
    return tooth_numbers(sigma, float(sigma[0]), g.sun.teeth)[1]


# s0 of every planet, m, and numbers of the teeth of gear and planet in contact there, (N,) each
Start = tuple[Array, Ints, Ints]


def planetary_starts(g: StageGeometry, planet_angles: Array) -> dict[GearMeshKind, Start]:
    """Contact positions and teeth at θ_c = 0, by kind of gear mesh of a planetary stage."""
    phi, zero = planet_angles, np.zeros(len(planet_angles), np.int64)
    # drive flanks: planets touch ring teeth, the sun touches planets
    ring = ring_start(g, phi)
    gamma = planet_tooth_angle(g, ring)
    sun = sun_side(g, gamma)
    sigma0 = float((sun_tooth_angle(g, sun) + phi)[0])
    # coast flanks are drive flanks of the stage mirrored in y = 0; ring and sun are thinned there
    ring_coast = ring_start(g, -phi) + g.ring_gear_mesh.allowance / math.cos(g.base_helix_angle)
    # planet teeth 0 when the coast flank of ring tooth 0 touches
    pitch = 2 * math.pi / g.planet.teeth
    angle = -planet_tooth_angle(g, ring_coast)
    gamma_coast = angle - pitch * np.rint((angle - gamma) / pitch)
    sun_coast = sun_side(g, -gamma_coast)

    def sun_teeth(s: Array, m: int) -> Ints:
        return tooth_numbers(m * sun_tooth_angle(g, s) + phi, sigma0, g.sun.teeth)[0]

    coast_teeth = tooth_numbers(-planet_tooth_angle(g, ring_coast) - gamma, 0.0, g.planet.teeth)[0]
    return {
        GearMeshKind.RING: (ring, zero, zero),
        GearMeshKind.SUN: (sun, sun_teeth(sun, 1), zero),
        GearMeshKind.RING_COAST: (ring_coast, zero, coast_teeth),
        GearMeshKind.SUN_COAST: (sun_coast, sun_teeth(sun_coast, -1), zero),
    }


def gear_mesh_path(
    g: StageGeometry,
    kind: GearMeshKind,
    start: Start,
    *,
    planet_hand: str,
    half_face: float,
    law: Law,
) -> GearMeshPath:
    """Path of one kind of gear mesh that starts at ``start``.

    m is −1 where N has a component along +y of the planet. ``rolling`` is the length that the
    planet's base circle rolls per rad of θ, m/rad: r_b,ring in a planetary stage, where the planet
    turns by −(r_b,r/r_b,p) θ in the carrier; −r_b in a parallel one, where the gear turns by +θ.
    """
    parallel = "ring" not in g.gears
    rolling = -g.planet.base_radius if parallel else g.ring.base_radius
    gear, planet, gear_mesh = g.gears[kind.gear], g.planet, g.gear_meshes[kind.gear]
    side, m = (1 if gear.internal else -1), (-1 if kind.coast != parallel else 1)
    hand = 1 if planet_hand == "right" else -1
    a, t = gear_mesh.working_angle, side * m * hand * math.tan(g.base_helix_angle)
    reach = abs(t) * half_face
    grid = np.linspace(gear_mesh.s_lo - reach, gear_mesh.s_hi + reach, TABLE_POINTS)
    k, zc = pair_stiffness(law, grid, gear_mesh.s_lo, gear_mesh.s_hi, t, half_face)
    return GearMeshPath(
        kind=kind,
        s0=start[0],
        rate=-side * m * rolling,
        base_pitch=gear_mesh.base_pitch,
        s_lo=gear_mesh.s_lo,
        s_hi=gear_mesh.s_hi,
        slope=t,
        half_face=half_face,
        alpha=a,
        base_radius_planet=g.base["planet"],
        base_radius_gear=g.base[kind.gear],
        center_distance=g.center_distance,
        normal_xy=np.array([-side * math.sin(a), -m * math.cos(a)]),
        tangent_point=planet.base_radius * np.array([side * math.cos(a), -m * math.sin(a)]),
        gear_tooth0=start[1],
        gear_step=m,
        gear_teeth=gear.teeth,
        planet_tooth0=start[2],
        planet_step=side * m,
        planet_teeth=planet.teeth,
        s_grid=grid,
        k_grid=k,
        zc_grid=zc,
        gap_grid=np.zeros_like(grid),
        backlash=gear_mesh.backlash,
        off_path=OffPath(
            planet=planet,
            gear=gear,
            offset=g.center_distance * math.sin(a),
            s_lo=gear_mesh.s_lo,
            s_hi=gear_mesh.s_hi,
            cos_base_helix=math.cos(g.base_helix_angle),
        ),
    )
