"""Transverse profile of an internal gear's tooth: involute flanks and root fillet.

Polar coordinates (r, θ) about the ring's centre, the tooth centred at θ = 0, its tip inward.

Lengths (transverse plane): m_t = m_n/cos β, tan α_t = tan α_n/cos β, r = z m_t/2,
r_b = r cos α_t. Profile shift x follows ISO 21771 with the tooth number of an internal gear
negative, as in gears/geometry.py: x > 0 moves the profile towards the centre of the ring, so tip
and root circles shrink and the tooth of the ring grows thicker,

    r_a = r - (h_a* + x) m_n,   r_f = r + (h_f* - x) m_n,   s_t = m_t π/2 + 2 x m_n tan α_t.

Half angle of the tooth at radius ρ: δ(ρ) = s_t/(2 r) + inv α(ρ) - inv α_t, cos α(ρ) = r_b/ρ; it
grows outward because the tooth of the ring is the space of an external gear.
Root fillet: circular arc of radius ρ_f = coefficient · m_n, tangent to flank and root circle. Its
centre c = P(ρ) + ρ_f n(ρ) with the flank's normal n into the space, |c| = r_f - ρ_f.
Source: ISO 21771:2007; the fillet is elementary geometry.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, floor, hypot, pi, tan

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexgear.model.errors import InputError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RingTooth:
    """Radii (m) and angles (rad) of the transverse profile of a ring tooth.

    form_radius: where involute and fillet meet; fillet_centre: (x, y) of the fillet on the +θ
    side; fillet_end: half angle at which the fillet meets the root circle; pitch_angle: 2π/z.
    """

    teeth: int
    reference_radius: float
    base_radius: float
    tip_radius: float
    root_radius: float
    tooth_thickness: float
    transverse_pressure_angle: float
    form_radius: float
    fillet_radius: float
    fillet_centre: tuple[float, float]
    fillet_end: float

    @property
    def pitch_angle(self) -> float:
        return 2.0 * pi / self.teeth

    def half_angle(self, radius: Array | float) -> Array:
        """δ(ρ) = s_t/(2 r) + inv α(ρ) - inv α_t, rad; ρ between base circle and form circle."""
        r = np.asarray(radius, dtype=np.float64)
        alpha = np.arccos(self.base_radius / r)
        alpha_t = self.transverse_pressure_angle
        return (
            self.tooth_thickness / (2.0 * self.reference_radius)
            + np.tan(alpha)
            - alpha
            - (np.tan(alpha_t) - alpha_t)
        )

    def root_radius_at(self, angle: Array | float) -> Array:
        """Radius of the root profile (fillet, then root circle) at half angle θ >= δ(form).

        On the fillet |ρ e(θ) - c| = ρ_f, the outer of the two solutions.
        """
        theta = np.minimum(np.asarray(angle, dtype=np.float64), self.fillet_end)
        cx, cy = self.fillet_centre
        along = cx * np.cos(theta) + cy * np.sin(theta)
        across = cy * np.cos(theta) - cx * np.sin(theta)
        return along + np.sqrt(np.maximum(self.fillet_radius**2 - across**2, 0.0))


def ring_tooth(
    teeth: int,
    normal_module: float,
    pressure_angle: float,
    helix_angle: float,
    profile_shift: float,
    addendum: float,
    dedendum: float,
    root_fillet: float,
    where: str = "case",
) -> RingTooth:
    """Profile from module (m), angles (rad, normal pressure angle) and coefficients of m_n."""
    m_n, beta = normal_module, abs(helix_angle)
    m_t = m_n / cos(beta)
    alpha_t = float(np.arctan(tan(pressure_angle) / cos(beta)))
    r = teeth * m_t / 2.0
    r_b = r * cos(alpha_t)
    r_a = r - (addendum + profile_shift) * m_n
    r_f = r + (dedendum - profile_shift) * m_n
    s_t = m_t * pi / 2.0 + 2.0 * profile_shift * m_n * tan(alpha_t)
    rho = root_fillet * m_n
    if r_a <= r_b:
        raise InputError(
            where,
            "stage.ring.addendum",
            f"the tip circle ({r_a * 1e3:.1f} mm) lies inside the base circle "
            f"({r_b * 1e3:.1f} mm), where no involute exists",
            "lower the addendum or the profile shift, or use more teeth",
        )
    if r_f <= r_a:
        raise InputError(
            where, "stage.ring.dedendum", "the root circle is inside the tip circle", "raise it"
        )
    if rho <= 0.0:
        raise InputError(where, "stage.ring.root_fillet", "must be above 0", "0.38 is usual")

    def flank(radius: float) -> tuple[float, float]:
        alpha = float(np.arccos(min(r_b / radius, 1.0)))
        inv = tan(alpha) - alpha - (tan(alpha_t) - alpha_t)
        return alpha, s_t / (2.0 * r) + inv

    def centre(radius: float, fillet: float) -> tuple[float, float]:
        # The +θ flank leaves the radius by the angle α(ρ): tangent cos α e_r + sin α e_θ, and
        # the normal into the space is -sin α e_r + cos α e_θ.
        alpha, delta = flank(radius)
        radial = radius - fillet * np.sin(alpha)
        around = fillet * np.cos(alpha)
        return (
            float(radial * np.cos(delta) - around * np.sin(delta)),
            float(radial * np.sin(delta) + around * np.cos(delta)),
        )

    def tangent(fillet: float) -> tuple[float, tuple[float, float], float] | None:
        """Form radius, centre and end angle of a fillet of this radius, None if none fits."""

        def miss(radius: float) -> float:
            return hypot(*centre(radius, fillet)) - (r_f - fillet)

        if miss(r_a) >= 0.0 or miss(r_f) <= 0.0:
            return None
        form = float(brentq(miss, r_a, r_f, xtol=1e-15 * r_f, rtol=1e-14))
        at = centre(form, fillet)
        end = float(np.arctan2(at[1], at[0]))
        return (form, at, end) if end <= pi / teeth else None

    if flank(r_a)[1] <= 0.0:
        raise InputError(
            where, "stage.ring.addendum", "the tooth is pointed before its tip circle", "lower it"
        )
    found = tangent(rho)
    if found is None:
        low, high = 0.0, root_fillet
        for _ in range(30):
            half = (low + high) / 2.0
            low, high = (half, high) if tangent(half * m_n) else (low, half)
        raise InputError(
            where,
            "stage.ring.root_fillet",
            f"a fillet of {rho * 1e3:.2f} mm does not fit into the root of the tooth space",
            f"at most {floor(low * 1000) / 1000:g}"
            if low > 0.01
            else "lower the dedendum: the tooth space ends before the root circle",
        )
    form, c, end = found
    return RingTooth(teeth, r, r_b, r_a, r_f, s_t, alpha_t, form, rho, c, end)
