"""Compliance of a tooth pair by its tooth profiles: bending, foundation and contact.

Compliances per unit face width, m²/N, for a line load w, N/m, along the transverse line of action,
in plane strain. The line of the load crosses the middle line of the tooth at x_P = r_b/cos α'. The
contact part is the approach of the flank to that point, the other parts its displacement under the
load there: u(x) is the lever from a section at x to x_P, and the integrals over the tooth run from
x_P to the root section. (From the section of the load on they would count the stretch in between
twice, mainly its shear: at mid-height a quarter of the part of an external tooth, two fifths of an
internal one.) If the line crosses below the root section, the tooth has no part.

    bending     cos²α' 12 (1-ν²)/E ∫ u²/(2y)³ dx
    shear       cos²α' 1.2/G ∫ dx/(2y)
    axial       sin²α' (1-ν²)/E ∫ dx/(2y)
    foundation  cos²α' (1-ν²)/E [16.67/π (u_f/s_f)² + 2 (1-2ν)/(1-ν) u_f/s_f
                                 + 4.82/π (1 + tan²α'/(2.4 (1+ν)))]
    contact     secant of line contact (``hertz``) at the line load, of both flanks, to the points
                where the load's line crosses the teeth's middle lines

u_f, s_f: lever (negative below the root section) and thickness of the root section.
The foundation is a half plane fixed 1.3 s_f below the root section. Compared with plane-strain
finite elements fixed there, tooth and foundation together are 0 … 7 % too soft on external gears
and 3 … 15 % on an internal one, whose root widens fast and rotates less than a half plane
(``validation/weber_banaschek``).
Sources: Weber & Banaschek 1953 (Schriftenreihe Antriebstechnik 11); O'Donnell 1960, J. Appl. Mech.
27:461 and Cornell 1981, J. Mech. Des. 103:447 for the foundation's coefficients in plane strain.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.geometry import GearMeshGeometry
from flexgear.gears.hertz import ContactBody, line_contact, relative_radius
from flexgear.gears.tooth import ToothGeometry, ToothOutline

Side = Literal["planet", "gear"]
POINTS = 101  # along the path of contact


@dataclass(frozen=True)
class ToothCompliance:
    """Compliance of one tooth, (n,) m²/N; ``bending`` includes shear and axial compression."""

    bending: Array
    foundation: Array


@dataclass(frozen=True)
class PairCompliance:
    """Compliance of a pair, (n,) m²/N, at positions xi (n,) ∈ [0, 1] on the path of contact."""

    xi: Array
    planet: ToothCompliance
    gear: ToothCompliance
    contact: Array

    @property
    def total(self) -> Array:
        """Compliance of both teeth, both foundations and the contact, m²/N."""
        teeth = self.planet.bending + self.gear.bending
        return teeth + self.planet.foundation + self.gear.foundation + self.contact

    def share(self, side: Side, tie: Literal["root", "flank"]) -> Array:
        """Share (n,) of the total compliance that an FE body of one side includes. tie: "root",
        which includes the foundation, or "flank", the tooth as well."""
        tooth = self.planet if side == "planet" else self.gear
        return (tooth.foundation + (tooth.bending if tie == "flank" else 0.0)) / self.total


def tooth_compliance(
    outline: ToothOutline, radius: Array, young: float, poisson: float
) -> ToothCompliance:
    """Compliance of one tooth under loads at radii (n,), m, on its flank."""
    tooth = outline.tooth
    plane = (1 - poisson**2) / young
    shear = 2 * (1 + poisson) / young
    radius = np.asarray(radius, dtype=float)
    inner, outer = sorted((tooth.form_radius, tooth.tip_radius))
    radius = np.clip(radius, inner, outer)
    angle = tooth.load_angle(radius)
    x_cross = tooth.base_radius / np.cos(angle)
    bending = np.empty_like(radius)
    for n, (cross, a) in enumerate(zip(x_cross, angle, strict=True)):
        # outline from the load's line to the root section; one point below the root section
        at, order = float(cross), -outline.tooth.outward
        keep = order * outline.x > order * at
        y = float(np.interp(order * at, order * outline.x, outline.y))
        x, half = np.concatenate([[at], outline.x[keep]]), np.concatenate([[y], outline.y[keep]])
        lever = x - cross
        flexure = abs(float(np.trapezoid(lever**2 / (2 * half) ** 3, x)))
        inverse = abs(float(np.trapezoid(1 / (2 * half), x)))
        bending[n] = math.cos(a) ** 2 * (12 * plane * flexure + 1.2 * shear * inverse)
        bending[n] += math.sin(a) ** 2 * plane * inverse
    ratio = tooth.outward * (x_cross - outline.x[-1]) / outline.root_thickness
    foundation = (
        np.cos(angle) ** 2
        * plane
        * (
            16.67 / math.pi * ratio**2
            + 2 * (1 - 2 * poisson) / (1 - poisson) * ratio
            + 4.82 / math.pi * (1 + np.tan(angle) ** 2 / (2.4 * (1 + poisson)))
        )
    )
    return ToothCompliance(bending, foundation)


def pair_compliance(
    planet: ToothGeometry,
    gear: ToothGeometry,
    gear_mesh: GearMeshGeometry,
    *,
    young: float,
    poisson: float,
    line_load: float,
) -> PairCompliance:
    """Compliance of planet and gear (ring or sun) along the path of contact; line_load N/m."""
    xi = np.linspace(0.0, 1.0, POINTS)
    s = gear_mesh.s_lo + xi * (gear_mesh.s_hi - gear_mesh.s_lo)
    reach = planet.tangent_distance(gear, gear_mesh.working_angle)
    rho_p = np.maximum(s, 1e-3 * gear_mesh.base_pitch)
    rho_g = s + reach if gear.internal else np.maximum(reach - s, 1e-3 * gear_mesh.base_pitch)
    r_p = np.hypot(planet.base_radius, rho_p)
    r_g = np.hypot(gear.base_radius, rho_g)
    flanks = (
        ContactBody(young, poisson, middle_depth(planet, r_p)),
        ContactBody(young, poisson, middle_depth(gear, r_g)),
    )
    contact = line_contact(*flanks, relative_radius(rho_p, rho_g, internal=gear.internal))
    return PairCompliance(
        xi,
        tooth_compliance(planet.outline(), r_p, young, poisson),
        tooth_compliance(gear.outline(), r_g, young, poisson),
        contact.secant(line_load),
    )


def middle_depth(tooth: ToothGeometry, radius: Array) -> Array:
    """Distance (n,) along the load's line from contact at radii (n,) to the middle line of the
    tooth, m."""
    return radius * np.sin(tooth.half_angle(radius)) / np.cos(tooth.load_angle(radius))
