"""Hertzian line contact of two flanks: approach, its tangent, half width and pressure.

Line load w (N/m), radius of relative curvature ρ, plane strain with c = (1 − ν²)/E of each body:

    a² = 4 w ρ (c_1 + c_2)/π,   p_max = 2 w/(π a)
    δ  = Σ_bodies (2 c/π) w [ln(2 h/a) + κ]

The approach of a line contact on a half plane is unbounded; it is measured from a reference point,
which gives h and κ of each body:

    "point"   the point at the depth h under the load: κ = −ν/(2 (1 − ν)). Weber & Banaschek 1953
    "layer"   the rigid base of a bonded layer of thickness h ≫ a; κ is the integral in
              ``layer_constant``. Complements the difference of two FE solutions, one of them
              clamped at the depth h
    "length"  infinity, for a load that is uniform on a length h ≫ a of a half space: κ = 1/2, at
              the middle of the length. Lundberg 1939, Forschung Ing.-Wes. 10:201

So δ = w (α − β ln w), dδ/dw = α − β − β ln w. δ rises with w up to ln w = α/β − 1, where a has
grown to about the depth; the formula does not hold beyond.

Helical flanks: ρ and w are those of the normal section, ρ_n = ρ_t/cos β_b, and the length of the
contact line is its axial extent over cos β_b.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
import scipy  # loads a subpackage at its first use

from flexgear.arrays import Array

Reference = Literal["point", "layer", "length"]
_HALF_PLANE = 20.0  # qh above which L(qh) is 1 to rounding


@dataclass(frozen=True)
class ContactBody:
    """One of two bodies in contact. young: E, Pa; poisson: ν; depth: h, m, a number or (n,);
    reference: point from which the approach is measured, "point", "layer" or "length" of the
    module's docstring."""

    young: float
    poisson: float
    depth: Array | float
    reference: Reference = "point"

    @property
    def compliance(self) -> float:
        """Compliance c = (1 − ν²)/E, 1/Pa."""
        return (1 - self.poisson**2) / self.young

    @property
    def constant(self) -> float:
        """Constant κ of the reference."""
        if self.reference == "point":
            return -self.poisson / (2 * (1 - self.poisson))
        return layer_constant(self.poisson) if self.reference == "layer" else 0.5


@dataclass(frozen=True)
class LineContact:
    """Law δ = w (α − β ln w) of one or n line contacts, w in N/m. alpha: α, m²/N, (n,) or a number;
    beta: β, m²/N, likewise; spread: a²/w, m²/(N/m)."""

    alpha: Array
    beta: Array | float
    spread: Array

    def secant(self, line_load: Array | float) -> Array:
        """Secant compliance δ/w, m²/N, for w > 0."""
        return self.alpha - self.beta * np.log(line_load)

    def approach(self, line_load: Array | float) -> Array:
        """Approach δ, m; zero without load."""
        w = np.asarray(line_load, dtype=float)
        return np.where(w > 0, w * self.secant(np.where(w > 0, w, 1.0)), 0.0)

    def tangent(self, line_load: Array | float) -> Array:
        """Tangent compliance dδ/dw, m²/N, for w > 0; grows without bound as w falls to zero."""
        return self.secant(line_load) - self.beta

    def half_width(self, line_load: Array | float) -> Array:
        """Half width a of the contact, m."""
        return np.sqrt(self.spread * line_load)

    def pressure(self, line_load: Array | float) -> Array:
        """Largest pressure p_max = 2 w/(π a), Pa."""
        return 2 / math.pi * np.sqrt(line_load / self.spread)

    def softer(self, alpha: Array, beta: Array) -> LineContact:
        """The same contact with α and β increased by the arguments, m²/N."""
        return LineContact(self.alpha + alpha, self.beta + beta, self.spread)

    def of_slice(self, length: Array | float) -> tuple[Array, Array]:
        """Constants a, m/N, and d, N, of the approach a f ln(d/f) under a force f, N, that is
        uniform on a length, m."""
        length = np.asarray(length, dtype=float)
        return self.beta / length, length * np.exp(self.alpha / self.beta)

    @property
    def largest_line_load(self) -> Array:
        """Line load at which dδ/dw = 0, N/m."""
        return np.exp(self.alpha / self.beta - 1)


def line_contact(first: ContactBody, second: ContactBody, radius: Array | float) -> LineContact:
    """Contact law of two bodies; radius: of relative curvature, m, a number or (n,)."""
    bodies = (first, second)
    total = sum(body.compliance for body in bodies)
    spread = np.asarray(4 * np.asarray(radius) * total / math.pi)
    alpha = -total / math.pi * np.log(spread)
    for body in bodies:
        alpha = alpha + 2 * body.compliance / math.pi * (
            np.log(2 * np.asarray(body.depth)) + body.constant
        )
    return LineContact(alpha, total / math.pi, spread)


def relative_radius(first: Array | float, second: Array | float, *, internal: bool) -> Array:
    """Radius of relative curvature ρ_1 ρ_2/(ρ_2 ± ρ_1), m; minus where the second flank is concave
    (a ring)."""
    rho_1, rho_2 = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    return rho_1 * rho_2 / (rho_2 - rho_1 if internal else rho_2 + rho_1)


@lru_cache
def layer_constant(poisson: float) -> float:
    """κ of a line load on an elastic layer bonded to a rigid base, relative to its thickness.

    A pressure cos(qx) displaces the surface of a layer of thickness h by (2 c/q) L(qh) cos(qx),

        L(t) = (2k sinh 2t − 4t)/(2k cosh 2t + 1 + k² + 4t²),   k = 3 − 4ν,

    so that κ = 1/2 − γ + ∫_0^1 L/t dt + ∫_1^∞ (L − 1)/t dt, γ Euler's constant.
    Source of L: Bentall & Johnson 1968, Int. J. Mech. Sci. 10:637; κ follows by Hertz's pressure.
    """

    def share(t: float) -> float:
        return float(layer_share(np.array(t), poisson))

    inner = scipy.integrate.quad(lambda t: share(t) / t, 0.0, 1.0, epsabs=1e-13)[0]
    outer = scipy.integrate.quad(lambda t: (share(t) - 1) / t, 1.0, _HALF_PLANE, epsabs=1e-13)[0]
    return float(0.5 - np.euler_gamma + inner + outer)


def layer_share(t: Array, poisson: float) -> Array:
    """L(t), t = qh of any shape: compliance of a layer to a pressure cos(qx) over that of a half
    plane."""
    k = 3 - 4 * poisson
    below = 2 * k * np.cosh(2 * t) + 1 + k**2 + 4 * t**2
    return np.asarray((2 * k * np.sinh(2 * t) - 4 * t) / below)
