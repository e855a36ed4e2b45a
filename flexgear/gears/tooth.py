"""One tooth in the transverse plane: circles, thickness, involute flanks, root fillets.

The only place that knows the involute. With normal module m_n, normal pressure angle α_n, helix
angle β, and for a ring ISO's negative tooth number, so that x > 0 thickens every tooth:

    tan α_t = tan α_n / cos β,   r = z m_n / (2 cos β),   r_b = r cos α_t
    s = m_n (π/2 + 2 x tan α_n) / cos β      transverse thickness at the reference circle
    r_a = r ± m_n (h_a + x),   r_f = r ∓ m_n (h_f − x)      upper sign external, lower internal
    δ(ρ) = s/(2 r) ∓ (inv α_ρ − inv α_t),   cos α_ρ = r_b/ρ,   inv α = tan α − α

δ is the half angle of the tooth at the radius ρ: it falls outward on an external tooth and grows
outward on a ring's, which is the space of an external gear.

The root fillet is a circular arc of radius ρ_f that touches flank and root circle; its centre lies
at r_f + ρ_f (external) or r_f − ρ_f (internal) from the gear's. Where it would touch below the base
circle, the flank runs down radially. The root section is where the arc makes 30° (external) or 60°
(internal) with the tooth's middle line, as in ISO 6336-3, or where the arc begins if it is steeper
there.

Frame of a tooth: origin at the gear's centre, x along the middle line of the tooth, y across.
Source: ISO 21771:2007; the fillet is elementary geometry.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Array = NDArray[np.float64]
ROOT_SECTION = {False: math.radians(30.0), True: math.radians(60.0)}  # by internal, ISO 6336-3


class Rack(Protocol):
    """What all gears of a stage are cut with; m and rad, pressure angle in the normal section."""

    @property
    def normal_module(self) -> float: ...
    @property
    def pressure_angle(self) -> float: ...
    @property
    def helix_angle(self) -> float: ...


class Blank(Protocol):
    """What one gear states of its teeth; all but the number are multiples of the normal module."""

    @property
    def teeth(self) -> int: ...
    @property
    def profile_shift(self) -> float: ...
    @property
    def addendum(self) -> float: ...
    @property
    def dedendum(self) -> float: ...
    @property
    def root_fillet(self) -> float: ...


def involute(angle: float) -> float:
    """inv α = tan α − α, rad."""
    return math.tan(angle) - angle


def involutes(angles: Array) -> Array:
    """The same of many angles."""
    return np.asarray(np.tan(angles) - angles)


def inverse_involute(value: float) -> float:
    """α with inv α = value, by Newton's rule from α ≈ (3 v)^{1/3}."""
    if value < 0:
        raise ValueError("an involute function below zero has no angle")
    angle = min((3 * value) ** (1 / 3), 1.4)
    for _ in range(50):
        step = (involute(angle) - value) / max(math.tan(angle) ** 2, 1e-300)
        angle -= step
        if abs(step) < 1e-15:
            break
    return angle


def transverse_angle(rack: Rack) -> float:
    """α_t at the reference circle, tan α_t = tan α_n / cos β, rad."""
    return math.atan(math.tan(rack.pressure_angle) / math.cos(rack.helix_angle))


def base_helix_angle(rack: Rack) -> float:
    """β_b, sin β_b = sin β cos α_n, rad."""
    return math.asin(math.sin(rack.helix_angle) * math.cos(rack.pressure_angle))


@dataclass(frozen=True)
class Fillet:
    """Root fillet on the +y side. contact_radius: where it touches the flank, m; centre: (x, y) in
    the tooth's frame, m; end: half angle at which it touches the root circle, rad."""

    radius: float
    contact_radius: float
    centre: tuple[float, float]
    end: float


@dataclass(frozen=True)
class ToothOutline:
    """Half of a tooth. x, y: (n,) m, from tip to root section, x falling outside and rising inside,
    the first flank_points on the flank."""

    tooth: ToothGeometry
    x: Array
    y: Array
    flank_points: int

    @property
    def root_thickness(self) -> float:
        """Chord at the root section, m."""
        return 2.0 * float(self.y[-1])


@dataclass(frozen=True)
class ToothGeometry:
    """The tooth of one gear; formulas in the module's head.

    Radii and ``thickness`` (transverse, at the reference circle) m; transverse_angle: α_t at the
    reference circle, rad; fillet_radius: ρ_f, m.
    """

    teeth: int
    internal: bool
    reference_radius: float
    base_radius: float
    tip_radius: float
    root_radius: float
    thickness: float
    transverse_angle: float
    fillet_radius: float

    @property
    def pitch_angle(self) -> float:
        """2π/z, rad."""
        return 2.0 * math.pi / self.teeth

    @property
    def base_pitch(self) -> float:
        """p_b = 2π r_b / z, m."""
        return self.pitch_angle * self.base_radius

    @property
    def outward(self) -> float:
        """+1 where the tip is outside the root, −1 on a ring."""
        return -1.0 if self.internal else 1.0

    def pressure_angle(self, radius: Array | float) -> Array:
        """α_ρ, cos α_ρ = r_b/ρ, rad; 0 below the base circle."""
        return np.arccos(np.minimum(1.0, self.base_radius / np.asarray(radius, dtype=float)))

    def half_angle(self, radius: Array | float) -> Array:
        """δ(ρ) on the involute, rad; below the base circle as on it, where flanks are radial."""
        alpha = self.pressure_angle(radius)
        half = self.thickness / (2 * self.reference_radius)
        return half - self.outward * (involutes(alpha) - involute(self.transverse_angle))

    @cached_property
    def base_half_angle(self) -> float:
        """Half angle at the base circle, where flanks begin: s/(2 r) ± inv α_t, rad."""
        half = self.thickness / (2 * self.reference_radius)
        return half + self.outward * involute(self.transverse_angle)

    def thickness_at(self, radius: float) -> float:
        """Transverse tooth thickness along the circle of that radius, 2 ρ δ(ρ), m."""
        return 2.0 * radius * float(self.half_angle(radius))

    def load_angle(self, radius: Array) -> Array:
        """Angle α_ρ ∓ δ(ρ) between a normal load on the flank at ρ and the normal of the middle
        line (upper sign external), rad."""
        return self.pressure_angle(radius) - self.outward * self.half_angle(radius)

    def roll_length(self, radius: float) -> float:
        """√(ρ² − r_b²): radius of curvature of the flank at ρ, the length along the line of action
        from the base tangent point, m."""
        return math.sqrt(max(radius**2 - self.base_radius**2, 0.0))

    def tangent_distance(self, mate: ToothGeometry, working_angle: float) -> float:
        """Distance between both base tangent points on the line of action, (r_b2 ± r_b1) tan α_w
        (− with a ring), m."""
        arm = mate.base_radius + (-1.0 if mate.internal else 1.0) * self.base_radius
        return arm * math.tan(working_angle)

    def path_of_contact(self, mate: ToothGeometry, working_angle: float) -> tuple[float, float]:
        """Span s_lo … s_hi of the path of contact with ``mate``, counted on the line of action from
        this gear's base tangent point (s is the radius of curvature of its flank), m.

        With a ring from the ring's tip to this gear's tip, with an external gear from its tip to
        this gear's tip; flanks end at base circles, a ring's at its root circle.
        """
        between = self.tangent_distance(mate, working_angle)
        tip, mate_tip = self.roll_length(self.tip_radius), mate.roll_length(mate.tip_radius)
        if mate.internal:
            last = mate.roll_length(mate.root_radius) - between
            return max(mate_tip - between, 0.0), min(tip, last)
        return max(between - mate_tip, 0.0), min(tip, between)

    def interferes_with(self, mate: ToothGeometry, working_angle: float) -> bool:
        """Whether a ring's tip reaches this gear's flank below its base circle."""
        between = self.tangent_distance(mate, working_angle)
        return mate.internal and mate.roll_length(mate.tip_radius) < between

    @cached_property
    def fillet(self) -> Fillet:
        """The root fillet. ValueError where no arc of that radius touches flank and root circle."""
        found = self.fillet_of(self.fillet_radius)
        if found is None:
            raise ValueError(f"no fillet of {self.fillet_radius:g} m touches flank and root circle")
        return found

    @property
    def form_radius(self) -> float:
        """Where the involute ends: at the fillet, or at the base circle above it, m."""
        return max(self.fillet.contact_radius, self.base_radius)

    def fillet_of(self, fillet_radius: float) -> Fillet | None:
        """The arc of that radius that touches flank and root circle; None if there is none."""
        target = self.root_radius + self.outward * fillet_radius

        def miss(radius: float) -> float:
            return math.hypot(*self._fillet_centre(radius, fillet_radius)) - target

        low, high = sorted((self.root_radius, self.tip_radius))
        if miss(low) >= 0.0 or miss(high) <= 0.0:
            return None
        contact = float(brentq(miss, low, high, xtol=1e-15 * high, rtol=1e-14))
        x, y = self._fillet_centre(contact, fillet_radius)
        return Fillet(fillet_radius, contact, (x, y), math.atan2(y, x))

    def root_profile(self, half_angle: Array | float) -> Array:
        """Radius of fillet and root circle at half angles from that of the fillet's contact on, m.

        On the fillet |ρ e(θ) − c| = ρ_f, of both solutions the one on the root circle's side.
        """
        fillet = self.fillet
        theta = np.minimum(np.asarray(half_angle, dtype=float), fillet.end)
        x, y = fillet.centre
        along = x * np.cos(theta) + y * np.sin(theta)
        across = y * np.cos(theta) - x * np.sin(theta)
        return along - self.outward * np.sqrt(np.maximum(fillet.radius**2 - across**2, 0.0))

    def profile_half_angle(self, radius: Array | float) -> Array:
        """Half angle of flank and fillet, rad; inverse of ``root_profile``. Where no fillet of the
        radius fits, the flank's down to the root circle.

        On the fillet |ρ e(θ) − c| = ρ_f, of both solutions the one on the tooth's side.
        """
        rho, half = np.asarray(radius, dtype=float), self.half_angle(radius)
        fillet = self.fillet_of(self.fillet_radius)
        if fillet is None:
            return half
        centre = math.hypot(*fillet.centre)
        cosine = (rho**2 + centre**2 - fillet.radius**2) / (2 * rho * centre)
        arc = fillet.end - np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.where(self.outward * (rho - fillet.contact_radius) < 0, arc, half)

    def outline(self, points: int = 160) -> ToothOutline:
        """Flank and fillet from tip to root section, ``points`` of them on the flank."""
        fillet, sign = self.fillet, self.outward
        alpha, delta = self._flank(fillet.contact_radius)
        # the arc is run through by the angle τ between its tangent and the middle line
        start = alpha - sign * delta
        tau = np.linspace(start, max(start, ROOT_SECTION[self.internal]), points // 3)
        arc_x = fillet.centre[0] - sign * fillet.radius * np.sin(tau)
        arc_y = fillet.centre[1] - fillet.radius * np.cos(tau)
        radius = np.linspace(self.tip_radius, fillet.contact_radius, points)
        half = self.half_angle(radius)
        x = np.concatenate([radius * np.cos(half), arc_x[1:]])
        y = np.concatenate([radius * np.sin(half), arc_y[1:]])
        return ToothOutline(self, x, y, points)

    def _flank(self, radius: float) -> tuple[float, float]:
        """Angle of the flank to the radius, α_ρ, and half angle δ; radial below the base circle."""
        return float(self.pressure_angle(radius)), float(self.half_angle(radius))

    def _fillet_centre(self, radius: float, fillet_radius: float) -> tuple[float, float]:
        """Centre of the arc that touches the +y flank at a radius. The normal into the space is
        ±sin α e_r + cos α e_θ."""
        alpha, delta = self._flank(radius)
        radial = radius + self.outward * fillet_radius * math.sin(alpha)
        across = fillet_radius * math.cos(alpha)
        return (
            radial * math.cos(delta) - across * math.sin(delta),
            radial * math.sin(delta) + across * math.cos(delta),
        )


def tooth_geometry(blank: Blank, rack: Rack, *, internal: bool = False) -> ToothGeometry:
    """The tooth of a gear that is cut with a rack of these measures."""
    module, x = rack.normal_module, blank.profile_shift
    cos_b, at = math.cos(rack.helix_angle), transverse_angle(rack)
    r = module * blank.teeth / (2 * cos_b)
    out = -1.0 if internal else 1.0
    return ToothGeometry(
        teeth=blank.teeth,
        internal=internal,
        reference_radius=r,
        base_radius=r * math.cos(at),
        tip_radius=r + out * module * (blank.addendum + x),
        root_radius=r - out * module * (blank.dedendum - x),
        thickness=module * (math.pi / 2 + 2 * x * math.tan(rack.pressure_angle)) / cos_b,
        transverse_angle=at,
        fillet_radius=blank.root_fillet * module,
    )
