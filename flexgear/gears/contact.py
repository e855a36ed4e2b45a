"""Paths of contact: which tooth pair is where at a carrier angle.

Planet axes: x radial outward, y tangential, z axial; n is the unit in-plane force on the planet,
(−sin α, −cos α) from the ring and (+sin α, −cos α) from the sun. The path coordinate s is the
distance from the planet's base tangent point T_p against n, so that a contact point is
C = T_p − s n + z e_z and s = ρ_p. On the flank of ring tooth j (centre at φ_j)

    s = r_b,r (φ_j − s_r/2r_r + inv α_t + α_w − θ_c − φ_i + κ z) − R_c sin α_w ,

falling with θ_c (planet tip to ring tip); the planet tooth that meets it stands at
γ = s/r_b,p − s_p/2r_p − inv α_t − α_w, and on the other side of that planet's teeth
s = r_b,p (π + α_w + s_p/2r_p + inv α_t − γ), rising. Back flanks follow by mirroring angles.
Backlash is imposed by thinning the teeth of ring and sun on their back flanks, so that loaded
flanks stay where they are; back paths are those of a stage whose planets touch the ring behind.
Re-derived from the involutes; the modulo rule of Tan et al. 2023, eqs. 11–14 is not used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.geometry import StageGeometry, involute, stage_geometry
from flexgear.gears.laws import pair_law
from flexgear.gears.stiffness import pair_stiffness
from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.model.case import Case

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
TABLE = 2001
ASSEMBLY_TOLERANCE = 1e-3  # of a sun tooth pitch


@dataclass(frozen=True)
class GearMeshPath:
    """One kind of gear mesh ("ring", "sun", "ring_back", "sun_back") of all N planets.

    Pair k of planet i: s = s0[i] + k base_pitch + rate θ_c at z = 0, s(z) = s + slope z.
    Tooth numbers (0-based): (gear_tooth0[i] + gear_step k) mod gear_teeth, likewise the planet's.
    s_grid, k_grid, zc_grid: pair stiffness (N/m, along the 3D normal) and centroid (m).
    Lengths m, angles rad, rate m/rad.
    """

    kind: str
    s0: Array
    rate: float
    base_pitch: float
    s_lo: float
    s_hi: float
    slope: float
    half_face: float
    alpha: float
    beta_b: float
    base_radius_planet: float
    base_radius_gear: float
    center_distance: float
    normal_xy: Array
    tangent_point: Array
    gear_tooth0: IntArray
    gear_step: int
    gear_teeth: int
    planet_tooth0: IntArray
    planet_step: int
    planet_teeth: int
    s_grid: Array
    k_grid: Array
    zc_grid: Array
    backlash: float

    def position(self, planet: int, index: int, carrier_angle: float) -> float:
        """Path coordinate of pair ``index`` of planet ``planet`` (0-based) at z = 0, m."""
        return float(self.s0[planet] + index * self.base_pitch + self.rate * carrier_angle)


def ring_start(g: StageGeometry, planet_angles: Array, tooth_angle: float = 0.0) -> Array:
    """s of the ring tooth at ``tooth_angle`` with every planet at θ_c = 0, z = 0; (N,) m."""
    a, r = g.ring_mesh.working_angle, g.ring
    half = r.thickness / (2 * r.reference_radius)
    angle = tooth_angle - half + involute(g.transverse_angle) + a - planet_angles
    return r.base_radius * angle - g.center_distance * math.sin(a)


def planet_tooth_angle(g: StageGeometry, s: Array) -> Array:
    """γ of the planet tooth whose ring-side flank is at s, in planet axes, rad."""
    p = g.planet
    half = p.thickness / (2 * p.reference_radius)
    return s / p.base_radius - half - involute(g.transverse_angle) - g.ring_mesh.working_angle


def sun_side(g: StageGeometry, planet_tooth: Array) -> Array:
    """s on the sun side of planet teeth at angles γ, m."""
    p = g.planet
    half = p.thickness / (2 * p.reference_radius)
    a = g.sun_mesh.working_angle
    return p.base_radius * (math.pi + a + half + involute(g.transverse_angle) - planet_tooth)


def sun_tooth_angle(g: StageGeometry, s: Array) -> Array:
    """Centre angle of the sun tooth at s, in planet axes, rad."""
    a, sun = g.sun_mesh.working_angle, g.sun
    half = sun.thickness / (2 * sun.reference_radius)
    rho = g.center_distance * math.sin(a) - s
    return a + half + involute(g.transverse_angle) - rho / sun.base_radius


def _tooth_numbers(angles: Array, reference: float, teeth: int) -> tuple[IntArray, Array]:
    """Nearest tooth numbers of angles and how far off they are, in pitches."""
    place = (angles - reference) * teeth / (2 * math.pi)
    number = np.rint(place)
    return number.astype(np.int64), place - number


def assembly_mismatch(g: StageGeometry, planet_angles: Array) -> Array:
    """How far each planet's sun tooth is from where planet 1 puts it, in sun pitches, (N,)."""
    gamma = planet_tooth_angle(g, ring_start(g, planet_angles))
    sigma = sun_tooth_angle(g, sun_side(g, gamma)) + planet_angles
    return _tooth_numbers(sigma, float(sigma[0]), g.sun.teeth)[1]


def _back_planet_tooth(g: StageGeometry, gamma: Array, s_back: Array) -> Array:
    """Angles of planet teeth 0 when the back flank of ring tooth 0 is touched, rad (N,)."""
    pitch = 2 * math.pi / g.planet.teeth
    off = -planet_tooth_angle(g, s_back) - gamma
    return gamma + off - pitch * np.rint(off / pitch)


def _require_assembly(case: Case, g: StageGeometry, phi: Array) -> None:
    if case.stage.allow_unassemblable:
        return
    if np.abs(assembly_mismatch(g, phi)).max() > ASSEMBLY_TOLERANCE:
        raise InputError(
            case.source,
            "stage.planets",
            f"the planets do not assemble: (z_s + z_r)/N = {g.assembly:.4g}",
            "choose tooth numbers with (z_s + z_r)/N whole, or planet_positions that assemble, "
            "or set allow_unassemblable = true",
        )


def gear_mesh_paths(case: Case) -> dict[str, GearMeshPath]:
    """Paths of all four kinds. Raises InputError where the planets don't assemble."""
    g = stage_geometry(case.stage, case.source)
    phi = np.asarray(case.stage.planet_angles, dtype=float)
    _require_assembly(case, g, phi)
    cos_bb = math.cos(g.base_helix_angle)
    zero = np.zeros(len(phi), np.int64)
    # front: planets touch ring teeth, the sun touches planets
    ring = ring_start(g, phi)
    gamma = planet_tooth_angle(g, ring)
    sun = sun_side(g, gamma)
    sigma0 = float((sun_tooth_angle(g, sun) + phi)[0])
    # back flanks are front flanks of the stage mirrored in y = 0; ring and sun are thinned there
    ring_back = ring_start(g, -phi) + case.stage.backlash_ring / cos_bb
    gamma_back = _back_planet_tooth(g, gamma, ring_back)
    sun_back = sun_side(g, -gamma_back)

    def sun_teeth(s: Array, m: int) -> IntArray:
        return _tooth_numbers(m * sun_tooth_angle(g, s) + phi, sigma0, g.sun.teeth)[0]

    behind = _tooth_numbers(-planet_tooth_angle(g, ring_back) - gamma, 0.0, g.planet.teeth)[0]
    return {
        "ring": _path(case, g, "ring", ring, zero, zero),
        "sun": _path(case, g, "sun", sun, sun_teeth(sun, 1), zero),
        "ring_back": _path(case, g, "ring_back", ring_back, zero, behind),
        "sun_back": _path(case, g, "sun_back", sun_back, sun_teeth(sun_back, -1), zero),
    }


def _path(
    case: Case,
    g: StageGeometry,
    kind: str,
    s0: Array,
    gear_tooth0: IntArray,
    planet_tooth0: IntArray,
) -> GearMeshPath:
    ring, m = kind.startswith("ring"), -1 if kind.endswith("back") else 1
    gear_mesh = g.ring_mesh if ring else g.sun_mesh
    gear, side = (g.ring, 1) if ring else (g.sun, -1)
    a, p = gear_mesh.working_angle, g.planet
    hand = 1.0 if case.stage.planet_hand == "right" else -1.0
    t = side * m * hand * math.tan(g.base_helix_angle)
    half = case.stage.face_width / 2
    reach = abs(t) * half
    grid = np.linspace(gear_mesh.s_lo - reach, gear_mesh.s_hi + reach, TABLE)
    law = pair_law(case, g, "ring" if ring else "sun")
    k, zc = pair_stiffness(law, grid, gear_mesh.s_lo, gear_mesh.s_hi, t, half)
    return GearMeshPath(
        kind=kind,
        s0=s0,
        rate=-side * m * g.ring.base_radius,
        base_pitch=gear_mesh.base_pitch,
        s_lo=gear_mesh.s_lo,
        s_hi=gear_mesh.s_hi,
        slope=t,
        half_face=half,
        alpha=a,
        beta_b=math.atan(t),
        base_radius_planet=p.base_radius,
        base_radius_gear=gear.base_radius,
        center_distance=g.center_distance,
        normal_xy=np.array([-side * math.sin(a), -m * math.cos(a)]),
        tangent_point=p.base_radius * np.array([side * math.cos(a), -m * math.sin(a)]),
        gear_tooth0=gear_tooth0,
        gear_step=m,
        gear_teeth=gear.teeth,
        planet_tooth0=planet_tooth0,
        planet_step=side * m,
        planet_teeth=p.teeth,
        s_grid=grid,
        k_grid=k,
        zc_grid=zc,
        backlash=gear_mesh.backlash,
    )
