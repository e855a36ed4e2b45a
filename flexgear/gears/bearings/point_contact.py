"""Hertzian point contact of a ball with a raceway of the same material.

With the sum of curvatures Σρ, their relative difference F(ρ), and the complete elliptic integrals
K, E of the modulus k, k² = 1 − 1/χ²:

    F(ρ) = 1 − 2/(χ² − 1) · (K/E − 1)                     gives χ = a/b, the ratio of the ellipse
    a = χ b = (2 χ² E/π)^(1/3) (3 Q/Σρ · (1 − ν²)/E_mod)^(1/3)
    δ = K (Σρ/(χ² E))^(1/3) (3 Q (1 − ν²)/(√2 π E_mod))^(2/3),   p_max = 3 Q/(2 π a b)

Sources: Hertz 1881; Harris, Kotzalas 2006, Essential Concepts of Bearing Technology, ch. 6;
ISO/TS 16281:2008 writes √2 π/3 as 1.48.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy  # which loads its parts as they are named

from flexgear.arrays import Array

_LARGEST = math.log(1e6)  # of the logarithm of χ


@dataclass(frozen=True)
class PointContact:
    """ratio: χ; first, second: K and E of it; curvature: Σρ, 1/m; modulus: E_mod/(1 − ν²), Pa."""

    ratio: float
    first: float
    second: float
    curvature: float
    modulus: float

    @property
    def compliance(self) -> float:
        """δ/Q^(2/3), m/N^(2/3)."""
        shape = self.first * (self.curvature / (self.ratio**2 * self.second)) ** (1 / 3)
        return float(shape * (3 / (math.sqrt(2) * math.pi * self.modulus)) ** (2 / 3))

    def semi_axes(self, load: Array | float) -> tuple[Array, Array]:
        """a along, b across the ellipse, m, under Q, N."""
        size = np.cbrt(3 * np.asarray(load, dtype=float) / (self.curvature * self.modulus))
        a = np.cbrt(2 * self.ratio**2 * self.second / math.pi) * size
        return a, a / self.ratio

    def pressure(self, load: Array | float) -> Array:
        """p_max, Pa, under Q, N."""
        q = np.asarray(load, dtype=float)
        a, b = self.semi_axes(np.where(q > 0, q, 1.0))
        return np.where(q > 0, 1.5 * q / (math.pi * a * b), 0.0)


def point_contact(rolling: float, groove: float, modulus: float) -> PointContact:
    """Contact of a sum of curvatures ``rolling`` in the plane of rolling and ``groove`` across it,
    1/m, where the bodies conform more closely: 0 < groove <= rolling. modulus: E/(1 − ν²), Pa."""
    if not 0 < groove <= rolling:
        raise ValueError("the groove must be open, and conform at least as closely as the raceway")
    difference = (rolling - groove) / (rolling + groove)

    def excess(log_ratio: float) -> float:
        first, second, minor = _integrals(math.exp(log_ratio))
        return float(1 - 2 * minor * (first / second - 1) / (1 - minor) - difference)

    log_ratio = 4 / 3 * difference  # F = 3/4 ln χ + O(ln³ χ), where excess is rounding alone
    if difference > 1e-4:
        log_ratio = scipy.optimize.brentq(excess, 1e-6, _LARGEST, xtol=1e-14)
    ratio = math.exp(log_ratio)
    first, second, _ = _integrals(ratio)
    return PointContact(ratio, first, second, rolling + groove, modulus)


def _integrals(ratio: float) -> tuple[float, float, float]:
    """K, E and 1/χ²."""
    minor = ratio**-2
    first = float(scipy.special.ellipkm1(minor))
    return first, float(scipy.special.ellipe(1 - minor)), minor
