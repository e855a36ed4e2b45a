"""Loads of the rolling elements of one row from the relative motion of both rings.

The motion is (x, y, z, r_x, r_y), m and rad, of one ring against the other at the middle of the
bearing, z along the axis. At the angle ψ of an element of a row at z_0 the rings approach radially
and axially by, and tilt against one another by,

    u_r = x cos ψ + y sin ψ + z_0 θ,   u_a = z − R θ,   θ = r_y cos ψ − r_x sin ψ.

Rollers, in laminae at x_k along the roller, with a contact angle α, a gap g on every side and a
profile that falls by P_k on each side of the roller:

    δ_k = u_r cos α + u_a sin α − g + x_k θ − 2 P_k,   q_k = c_L/n_s δ_k^(10/9),
    c_L = 35 948 L^(8/9) N/mm^(10/9), L in mm, R = D_pw/2

Balls, whose contact angle α_j changes with the load, with A = r_i + r_e − D_w the distance of the
centres of the grooves and α_0 the nominal contact angle:

    δ = √((A cos α_0 − g + u_r)² + (A sin α_0 + u_a)²) − A,   Q = c_P δ^(3/2),
    1/c_P^(2/3) = sum of the compliances of both raceways,
    R = D_pw/2 + (r_i − D_w/2) (A cos α_0 − g)/A

so that z counts from the middle of the axial play where α_0 = 0; where not, the groove has no
shoulder on the other side (it is a cylinder there, so the axial term is at least zero). Signs:
α > 0 where motion along +z loads the row. Rollers stay in the middle between both raceways;
centrifugal forces are neglected.
Sources: ISO/TS 16281:2008, 4.2 and 5.2; Harris, Kotzalas 2006, ch. 6 and 7.

Hertzian point contact of a ball with a raceway of the same material, with the sum of curvatures Σρ,
their relative difference F(ρ), and the complete elliptic integrals K, E of the modulus k,
k² = 1 − 1/χ²:

    F(ρ) = 1 − 2/(χ² − 1) · (K/E − 1)                     gives χ = a/b, the ratio of the ellipse
    a = χ b = (2 χ² E/π)^(1/3) (3 Q/Σρ · (1 − ν²)/E_mod)^(1/3)
    δ = K (Σρ/(χ² E))^(1/3) (3 Q (1 − ν²)/(√2 π E_mod))^(2/3),   p_max = 3 Q/(2 π a b)

Sources: Hertz 1881; Harris, Kotzalas 2006, Essential Concepts of Bearing Technology, ch. 6;
ISO/TS 16281:2008 writes √2 π/3 as 1.48.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy  # loads a subpackage at its first use

from flexgear.arrays import Array
from flexgear.gears.hertz import ContactBody, line_contact

_LARGEST_LOG_RATIO = math.log(1e6)  # ln χ


@dataclass(frozen=True)
class PointContact:
    """Hertzian contact with an elliptic area. ratio: χ of the axes of the ellipse; first, second:
    elliptic integrals K and E; curvature: Σρ, 1/m; modulus: E_mod/(1 − ν²), Pa."""

    ratio: float
    first: float
    second: float
    curvature: float
    modulus: float

    @property
    def compliance(self) -> float:
        """Compliance δ/Q^(2/3), m/N^(2/3)."""
        shape = self.first * (self.curvature / (self.ratio**2 * self.second)) ** (1 / 3)
        return float(shape * (3 / (math.sqrt(2) * math.pi * self.modulus)) ** (2 / 3))

    def semi_axes(self, load: Array | float) -> tuple[Array, Array]:
        """Major semi-axis a and minor semi-axis b of the ellipse, m, under Q, N."""
        size = np.cbrt(3 * np.asarray(load, dtype=float) / (self.curvature * self.modulus))
        a = np.cbrt(2 * self.ratio**2 * self.second / math.pi) * size
        return a, a / self.ratio

    def pressure(self, load: Array | float) -> Array:
        """Largest pressure p_max, Pa, under Q, N."""
        q = np.asarray(load, dtype=float)
        a, b = self.semi_axes(np.where(q > 0, q, 1.0))
        return np.where(q > 0, 1.5 * q / (math.pi * a * b), 0.0)


def point_contact(rolling: float, groove: float, modulus: float) -> PointContact:
    """Contact of a ball with a grooved raceway. rolling: sum of the curvatures of both bodies in
    the plane of rolling, 1/m; groove: sum across it, where the bodies conform more closely;
    modulus: E/(1 − ν²), Pa. Raises ValueError unless 0 < groove <= rolling."""
    if not 0 < groove <= rolling:
        raise ValueError("the groove must be open, and conform at least as closely as the raceway")
    difference = (rolling - groove) / (rolling + groove)

    def excess(log_ratio: float) -> float:
        first, second, minor = _integrals(math.exp(log_ratio))
        return float(1 - 2 * minor * (first / second - 1) / (1 - minor) - difference)

    log_ratio = 4 / 3 * difference  # F = 3/4 ln χ + O(ln³ χ); excess is mere rounding near χ = 1
    if difference > 1e-4:
        log_ratio = scipy.optimize.brentq(excess, 1e-6, _LARGEST_LOG_RATIO, xtol=1e-14)
    ratio = math.exp(log_ratio)
    first, second, _ = _integrals(ratio)
    return PointContact(ratio, first, second, rolling + groove, modulus)


def _integrals(ratio: float) -> tuple[float, float, float]:
    """Complete elliptic integrals K and E at an axis ratio χ, and 1/χ²."""
    minor = ratio**-2
    first = float(scipy.special.ellipkm1(minor))
    return first, float(scipy.special.ellipe(1 - minor)), minor


POINT, LINE = 1.5, 10.0 / 9.0  # exponents of the approach in the load
YOUNG, POISSON = 210e9, 0.3  # of bearing steel


def roller_stiffness(length: float) -> float:
    """c_L, N/m^(10/9), of a steel roller of effective length in m between two raceways."""
    return float(35948.0 * (1e3 * length) ** (8 / 9) * 1e3**LINE)


@dataclass(frozen=True)
class RowState:
    """Loads of a row at one motion of its rings. loads: (Z, n) of every lamina of every element, N,
    n = 1 for balls; angles: ψ (Z,), rad; force: (5,) against the motion, N and N m; tangent: (5, 5)
    its derivative; energy: J."""

    loads: Array
    angles: Array
    force: Array
    tangent: Array
    energy: float

    @property
    def element_loads(self) -> Array:
        """Load Q (Z,) of every element, N."""
        return np.asarray(self.loads.sum(axis=1))


@dataclass(frozen=True)
class Row:
    """Geometry of one row of rolling elements.

    count: Z; diameter: D_w or D_we, m; pitch_diameter: D_pw, m; contact_angle: nominal, rad; gap:
    radial, on every side, m (negative: preload); position: z_0 of the middle of the row, m; phase:
    angle of the first element from the load, rad.
    """

    count: int
    diameter: float
    pitch_diameter: float
    contact_angle: float = 0.0
    gap: float = 0.0
    position: float = 0.0
    phase: float = field(default=0.0, kw_only=True)

    exponent: ClassVar[float]  # of the approach in the load

    @property
    def gamma(self) -> float:
        """γ = D_w cos α/D_pw."""
        return self.diameter * math.cos(self.contact_angle) / self.pitch_diameter

    @property
    def arm(self) -> float:
        """Arm R of a tilt, m."""
        return self.pitch_diameter / 2

    @property
    def stiffness(self) -> float:
        """Stiffness c_L or c_P of one element, N/m^exponent."""
        raise NotImplementedError

    def approach(self, psi: Array) -> tuple[Array, Array]:
        """Derivatives of u_r and u_a with respect to the motion, (Z, 5) each."""
        c, s, zero = np.cos(psi), np.sin(psi), np.zeros_like(psi)
        z, r = self.position, self.arm
        radial = np.stack([c, s, zero, -z * s, z * c], axis=1)
        return radial, np.stack([zero, zero, zero + 1, r * s, -r * c], axis=1)

    def angles(self, first: float = 0.0) -> Array:
        """Angles ψ (Z,) of the elements, rad; first: angle from which ``phase`` counts."""
        return first + self.phase + 2 * np.pi * np.arange(self.count) / self.count

    def state(self, motion: Array, first: float = 0.0) -> RowState:
        """Loads at a motion (5,); first: angle from which ``phase`` counts, rad."""
        raise NotImplementedError

    def pressure(self, loads: Array) -> Array:
        """Largest contact pressure of inner and outer raceway (2,), Pa, under loads (Z, n), N."""
        raise NotImplementedError


@dataclass(frozen=True)
class RollerRow(Row):
    """Row of cylindrical or tapered rollers. length: L_we, m; drops (n_s,): P_k of the laminae from
    one end of the roller to the other, m; edge_stress: whether the life includes the stress
    concentration at the ends of rollers."""

    length: float = 0.0
    drops: tuple[float, ...] = (0.0,) * 30
    edge_stress: bool = True

    exponent: ClassVar[float] = LINE

    @property
    def laminae(self) -> Array:
        """Middles x_k (n_s,) of the laminae, m."""
        n = len(self.drops)
        return self.length * ((np.arange(n) + 0.5) / n - 0.5)

    @property
    def stiffness(self) -> float:
        return roller_stiffness(self.length)

    def state(self, motion: Array, first: float = 0.0) -> RowState:
        psi = self.angles(first)
        radial, axial = self.approach(psi)
        alpha, x = self.contact_angle, self.laminae
        middle = math.cos(alpha) * radial + math.sin(alpha) * axial
        tilt = np.zeros_like(middle)
        tilt[:, 3], tilt[:, 4] = -np.sin(psi), np.cos(psi)
        gap = self.gap * math.cos(alpha) + 2 * np.asarray(self.drops)
        closing = np.maximum((middle @ motion)[:, None] + np.outer(tilt @ motion, x) - gap, 0.0)
        stiffness = self.stiffness / len(self.drops)
        slopes = LINE * stiffness * closing ** (LINE - 1)
        loads = slopes * closing / LINE
        force = loads.sum(axis=1) @ middle + (loads @ x) @ tilt
        cross = middle.T * (slopes @ x) @ tilt
        tangent = middle.T * slopes.sum(axis=1) @ middle + cross + cross.T
        tangent += tilt.T * (slopes @ x**2) @ tilt
        energy = float((loads * closing).sum() / (1 + LINE))
        return RowState(loads, psi, force, tangent, energy)

    def pressure(self, loads: Array) -> Array:
        """Pressure (2,) of a line contact with the line load of the most loaded lamina, Pa."""
        line_load = float(loads.max()) * len(self.drops) / self.length
        body = ContactBody(YOUNG, POISSON, self.length)
        radii = self.diameter / 2 * np.array([1 - self.gamma, 1 + self.gamma])
        return line_contact(body, body, radii).pressure(line_load)


@dataclass(frozen=True)
class BallRow(Row):
    """Row of balls. inner_groove, outer_groove: r_i and r_e, m; tilt_arm: in place of R, m (some
    programs take D_pw/2); young, poisson: of balls and rings, Pa and 1."""

    inner_groove: float = 0.0
    outer_groove: float = 0.0
    tilt_arm: float | None = None
    young: float = YOUNG
    poisson: float = POISSON

    exponent: ClassVar[float] = POINT

    @property
    def groove_distance(self) -> float:
        """Distance A of the centres of the grooves, m."""
        return self.inner_groove + self.outer_groove - self.diameter

    @property
    def radial_distance(self) -> float:
        """Radial distance A cos α_0 − g of the centres of the grooves in middle position, m."""
        return self.groove_distance * math.cos(self.contact_angle) - self.gap

    @property
    def arm(self) -> float:
        if self.tilt_arm is not None:
            return self.tilt_arm
        free = self.radial_distance / self.groove_distance
        return self.pitch_diameter / 2 + (self.inner_groove - self.diameter / 2) * free

    @cached_property
    def contacts(self) -> tuple[PointContact, PointContact]:
        """Contacts with the inner and the outer raceway, at the nominal contact angle."""
        modulus, d, g = self.young / (1 - self.poisson**2), self.diameter, self.gamma
        inner = point_contact(2 / d / (1 - g), 2 / d - 1 / self.inner_groove, modulus)
        outer = point_contact(2 / d / (1 + g), 2 / d - 1 / self.outer_groove, modulus)
        return inner, outer

    @property
    def stiffness(self) -> float:
        return float(sum(contact.compliance for contact in self.contacts) ** -POINT)

    def state(self, motion: Array, first: float = 0.0) -> RowState:
        psi = self.angles(first)
        radial, axial = self.approach(psi)
        r = self.radial_distance + radial @ motion
        a = self.groove_distance * math.sin(self.contact_angle) + axial @ motion
        if self.contact_angle:  # no shoulder on the other side
            a = np.copysign(np.maximum(np.copysign(1.0, self.contact_angle) * a, 0.0), a)
        distance = np.hypot(r, a)
        closing = np.maximum(distance - self.groove_distance, 0.0)
        gradient = (r[:, None] * radial + a[:, None] * axial) / distance[:, None]
        loads = self.stiffness * closing**POINT
        slopes = POINT * self.stiffness * np.sqrt(closing)
        across = loads / distance  # geometric stiffness: contact lines change direction
        tangent = gradient.T * (slopes - across) @ gradient
        for part, share in ((radial, across), (axial, across * (a != 0))):
            tangent += part.T * share @ part
        energy = float((loads * closing).sum() / (1 + POINT))
        return RowState(loads[:, None], psi, loads @ gradient, tangent, energy)

    def pressure(self, loads: Array) -> Array:
        return np.array([float(contact.pressure(loads.max())) for contact in self.contacts])


def standard_drops(
    diameter: float, length: float, contact_angle: float = 0.0, laminae: int = 30
) -> tuple[float, ...]:
    """Drops P_k (laminae,) of the logarithmic profile of ISO/TS 16281:2008, m.

    diameter: D_we, m; length: L_we, m; contact_angle: rad, zero for cylindrical rollers. With
    x along the roller from its middle,

        P = 0.00035 D_we ln 1/(1 − (2x/L)²)    cylindrical rollers, L <= 2.5 D_we
        P = 0.00045 D_we ln 1/(1 − (2x/L)²)    tapered rollers
        P = 0.0005 D_we ln 1/(1 − ((2|x| − L + 2.5 D_we)/(2.5 D_we))²)    longer cylindrical rollers

    where the last is zero but for lengths of 1.25 D_we at both ends.
    """
    x = np.abs((2 * np.arange(laminae) + 1) / laminae - 1)  # 2|x_k|/L
    if contact_angle:
        size, share = 0.00045, x
    elif length <= 2.5 * diameter:
        size, share = 0.00035, x
    else:
        size = 0.0005
        share = np.maximum(x * length - length + 2.5 * diameter, 0.0) / (2.5 * diameter)
    return tuple(float(p) for p in -size * diameter * np.log(1 - share**2))
