"""Load zone of a radial bearing with rigid rings and many rolling elements.

    J_r(ε) = 1/(2π) ∫ [1 − (1 − cos ψ)/(2ε)]ⁿ cos ψ dψ over the zone,   Q_max = F_r/(Z J_r(ε))

ε = (1 − g/δ)/2 is the extent of the zone for a displacement δ and a radial gap g on every side
(ε = 1/2 without clearance, more under preload); n = 3/2 for point, 10/9 for line contact.
Source: Sjoevall 1933; Harris, Kotzalas 2006, Essential Concepts of Bearing Technology, ch. 7.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

POINT, LINE = 1.5, 10.0 / 9.0  # exponents of load over approach


def load_zone_integral(extent: float, exponent: float) -> float:
    """J_r(ε) for n = ``exponent``."""
    if extent <= 0:
        raise ValueError("the extent of a load zone is positive")
    half = math.acos(1 - 2 * extent) if extent < 1 else math.pi

    def share(psi: float) -> float:
        return float(max(1 - (1 - np.cos(psi)) / (2 * extent), 0.0) ** exponent * np.cos(psi))

    return float(scipy.integrate.quad(share, 0.0, half, epsabs=1e-12)[0] / math.pi)
