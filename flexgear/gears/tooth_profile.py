"""Half thickness of a tooth along its middle line, from the involute down into the root fillet.

Tooth frame: origin at the gear's centre, x along the tooth's middle line, y across. On the involute
at radius ρ the flank is at the half angle δ(ρ) = s/(2 r) ± (inv α_ρ - inv α_t), cos α_ρ = r_b/ρ
(+ internal). Below it a circular arc of radius ρ_f touches flank and root circle, its centre at
r_f + ρ_f (external) or r_f - ρ_f (internal); where it would touch below the base circle, the flank
runs down radially. The root section is where the arc makes 30° (external) or 60° (internal) with
the middle line, as in ISO 6336-3, or where the arc begins if it is steeper there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flexgear.gears.geometry import GearGeometry, involute

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ToothProfile:
    """One tooth in the transverse plane.

    x, y: (n,) m, from tip to root section, x falling outside and rising inside, the first
    flank_points on the flank; form_radius: where the involute ends, m.
    """

    gear: GearGeometry
    transverse_angle: float
    x: Array
    y: Array
    form_radius: float
    flank_points: int

    def half_angle(self, radius: Array) -> Array:
        """δ(ρ) on the involute, rad."""
        return half_angle(self.gear, self.transverse_angle, radius)

    def load_angle(self, radius: Array) -> Array:
        """α' between the load and the normal of the middle line: α_ρ - δ, internal α_ρ + δ."""
        sign = 1.0 if self.gear.internal else -1.0
        alpha = np.arccos(np.minimum(1.0, self.gear.base_radius / radius))
        return alpha + sign * self.half_angle(radius)

    @property
    def root_thickness(self) -> float:
        """Chord at the root section, m."""
        return 2.0 * float(self.y[-1])


def half_angle(gear: GearGeometry, transverse_angle: float, radius: Array) -> Array:
    """Half angle of the tooth at radii on its involute, rad."""
    alpha = np.arccos(np.minimum(1.0, gear.base_radius / np.asarray(radius, dtype=float)))
    sign = 1.0 if gear.internal else -1.0
    half = gear.thickness / (2 * gear.reference_radius)
    return half + sign * (np.tan(alpha) - alpha - involute(transverse_angle))


def tooth_profile(
    gear: GearGeometry, transverse_angle: float, fillet_radius: float, points: int = 160
) -> ToothProfile:
    """Profile from tip to root section; fillet_radius m."""
    out = -1.0 if gear.internal else 1.0  # sign of "away from the root"
    base = gear.base_radius

    def flank(radius: float) -> tuple[float, float]:
        """Flank angle α and half angle δ; radial below the base circle."""
        if radius <= base:
            return 0.0, float(half_angle(gear, transverse_angle, np.array(base)))
        return math.acos(base / radius), float(half_angle(gear, transverse_angle, np.array(radius)))

    def centre(radius: float) -> tuple[float, float]:
        """Centre of the arc that touches the flank at a radius (tooth frame)."""
        alpha, delta = flank(radius)
        radial = radius + out * fillet_radius * math.sin(alpha)
        across = fillet_radius * math.cos(alpha)
        return (
            radial * math.cos(delta) - across * math.sin(delta),
            radial * math.sin(delta) + across * math.cos(delta),
        )

    def miss(radius: float) -> float:
        return math.hypot(*centre(radius)) - (gear.root_radius + out * fillet_radius)

    low, high = sorted((gear.root_radius, gear.tip_radius))
    form = (
        float(brentq(miss, low, high, xtol=1e-14 * high))
        if miss(low) * miss(high) < 0
        else gear.root_radius
    )
    cx, cy = centre(form)
    alpha, delta = flank(form)
    # the arc is run through by the angle τ between its tangent and the middle line
    start = alpha + delta if gear.internal else alpha - delta
    root = math.radians(60.0 if gear.internal else 30.0)
    tau = np.linspace(start, max(start, root), points // 3)
    arc_x = cx - out * fillet_radius * np.sin(tau)
    arc_y = cy - fillet_radius * np.cos(tau)
    radius = np.linspace(gear.tip_radius, form, points)
    delta_r = half_angle(gear, transverse_angle, np.maximum(radius, base))
    x = np.concatenate([radius * np.cos(delta_r), arc_x[1:]])
    y = np.concatenate([radius * np.sin(delta_r), arc_y[1:]])
    return ToothProfile(gear, transverse_angle, x, y, max(form, base), points)
