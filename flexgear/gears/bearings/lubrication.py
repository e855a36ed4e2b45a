"""What the lubricant does to the life of rolling bearings, by ISO 281:2007.

Viscosity over temperature (Walther; ASTM D341), ν in mm²/s, T in K:

    log₁₀ log₁₀(ν + 0.7) = A − B log₁₀ T

from two points; that at 100 °C follows from a viscosity index of 95 where it is not given (ASTM
D2270, method A). Viscosity ratio κ = ν/ν_1, with n in r/min and D_pw in mm,

    ν_1 = 45 000 n^(−0.83) D_pw^(−0.5),  n < 1000;   4500 n^(−0.5) D_pw^(−0.5),  n >= 1000

Contamination factor of oil in a circuit with a filter (ISO 281:2007, annex A, as text books and
makers' programs print it):

    e_C = a (1 − b/D_pw^(1/3)),   a = c κ^0.68 D_pw^0.55 <= 1

Life modification factor of radial bearings, in the branches of κ below, κ <= 4, a_ISO <= 50:

    ball    a_ISO = 0.1 [1 − (2.5671 − y/κ^z)^0.83 (e_C C_u/P)^(1/3)]^(−9.3)
    roller  a_ISO = 0.1 [1 − (1.5859 − y/κ^z) (e_C C_u/P)^0.4]^(−9.185)
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import scipy
from numpy.typing import ArrayLike

from flexgear.arrays import Array
from flexgear.model.lubricant import Lubricant
from flexgear.model.units import RPM

Rolling = Literal["ball", "roller"]
VISCOSITY_INDEX = 95.0
LEAST_RATIO, LARGEST_RATIO = 0.1, 4.0  # of viscosities, in which a_ISO is stated
LARGEST_FACTOR = 50.0

# ν at 100 °C up to which L = a Y² + b Y + c and H = d Y² + e Y + f hold: ASTM D2270-10, appendix
_INDEX = (
    (3.8, 1.14673, 1.7576, -0.109, 0.84155, 1.5521, -0.077),
    (4.4, 3.38095, -15.4952, 33.196, 0.78571, 1.7929, -0.183),
    (5.0, 2.5000, -7.2143, 13.812, 0.82143, 1.5679, 0.119),
    (6.4, 0.10100, 16.6350, -45.469, 0.04985, 9.1613, -18.557),
    (7.0, 3.35714, -23.5643, 78.466, 0.22619, 7.7369, -16.656),
    (7.7, 0.01191, 21.4750, -72.870, 0.79762, -0.7321, 14.610),
    (9.0, 0.41858, 16.1558, -56.040, 0.05794, 10.5156, -28.240),
    (12.0, 0.88779, 7.5527, -16.600, 0.26665, 6.7015, -10.810),
    (15.0, 0.76720, 10.7972, -38.180, 0.20073, 8.4658, -22.490),
    (18.0, 0.97305, 5.3135, -2.200, 0.28889, 5.9741, -4.930),
    (22.0, 0.97256, 5.2500, -0.980, 0.24504, 7.4160, -16.730),
    (28.0, 0.91413, 7.4759, -21.820, 0.20323, 9.1267, -34.230),
    (40.0, 0.87031, 9.7157, -50.770, 0.18411, 10.1015, -46.750),
    (55.0, 0.84703, 12.6752, -133.310, 0.17029, 11.4866, -80.620),
    (70.0, 0.85921, 11.1009, -83.19, 0.17130, 11.3680, -76.940),
    (math.inf, 0.83531, 14.6731, -216.246, 0.16841, 11.8493, -96.947),
)
_CLEANLINESS = {  # c and b
    "-/13/10": (0.0864, 0.5663),
    "-/15/12": (0.0432, 0.9987),
    "-/17/14": (0.0288, 1.6329),
    "-/19/16": (0.0216, 2.3362),
}
_BRANCHES: dict[str, tuple[tuple[float, float, float], ...]] = {  # κ from which, y, z
    "ball": ((0.1, 2.2649, 0.054381), (0.4, 1.9987, 0.19087), (1.0, 1.9987, 0.071739)),
    "roller": ((0.1, 1.3993, 0.054381), (0.4, 1.2348, 0.19087), (1.0, 1.2348, 0.071739)),
}


def viscosity_index(viscosity_40: float, viscosity_100: float) -> float:
    """VI by method A (up to 100) of ASTM D2270; viscosities in m²/s, that at 100 °C >= 2 mm²/s."""
    y = 1e6 * viscosity_100
    _, a, b, c, d, e, f = next(row for row in _INDEX if y <= row[0])
    low, high = a * y**2 + b * y + c, d * y**2 + e * y + f
    return 100 * (low - 1e6 * viscosity_40) / (low - high)


def viscosity_100_of_index(viscosity_40: float, index: float = VISCOSITY_INDEX) -> float:
    """Viscosity at 100 °C, m²/s, of an oil of that viscosity index. ValueError for thinner oils
    than the index is defined for."""

    def excess(viscosity_100: float) -> float:
        return viscosity_index(viscosity_40, viscosity_100) - index

    low, high = 2e-6, 0.9 * viscosity_40
    if high <= low or excess(low) * excess(high) > 0:
        raise ValueError("the viscosity index is defined from 2 mm²/s at 100 °C")
    return float(scipy.optimize.brentq(excess, low, high, xtol=1e-12))


def viscosity_at(lubricant: Lubricant, temperature: float | None = None) -> float | None:
    """ν, m²/s, at a temperature, K, else at that of the section; None where neither is stated."""
    if temperature is None and lubricant.operating_viscosity is not None:
        return lubricant.operating_viscosity
    at = lubricant.temperature if temperature is None else temperature
    if at is None:
        return None
    thin = lubricant.viscosity_100 or viscosity_100_of_index(lubricant.viscosity_40)
    points = np.log10(np.log10(1e6 * np.array([lubricant.viscosity_40, thin]) + 0.7))
    kelvin = np.log10([313.15, 373.15])
    slope = (points[1] - points[0]) / (kelvin[1] - kelvin[0])
    exponent = points[0] + slope * (math.log10(at) - kelvin[0])
    return float(1e-6 * (10 ** (10**exponent) - 0.7))


def reference_viscosity(pitch_diameter: float, speed: float) -> float:
    """ν_1, m²/s; D_pw in m, speed of the inner against the outer ring in rad/s, not zero."""
    n, d = abs(speed) * RPM, 1e3 * pitch_diameter
    return 1e-6 * (45000 * n**-0.83 if n < 1000 else 4500 * n**-0.5) * d**-0.5


def contamination_factor(
    lubricant: Lubricant, pitch_diameter: float, viscosity_ratio: float
) -> float | None:
    """e_C, D_pw in m; None where neither cleanliness nor contamination is stated."""
    if lubricant.cleanliness is None:
        return lubricant.contamination
    c, b = _CLEANLINESS[lubricant.cleanliness]
    d = 1e3 * pitch_diameter
    a = min(c * min(viscosity_ratio, LARGEST_RATIO) ** 0.68 * d**0.55, 1.0)
    return max(a * (1 - b / d ** (1 / 3)), 0.0)


def life_modification(rolling: Rolling, viscosity_ratio: float, fatigue_ratio: ArrayLike) -> Array:
    """a_ISO of fatigue ratios e_C C_u/P of any shape. ValueError for κ below 0.1, where it is not
    stated."""
    kappa = min(viscosity_ratio, LARGEST_RATIO)
    if not kappa >= LEAST_RATIO:
        raise ValueError("a_ISO is stated for viscosity ratios from 0.1")
    _, y, z = next(row for row in reversed(_BRANCHES[rolling]) if kappa >= row[0])
    ratio = np.asarray(fatigue_ratio, dtype=float)
    if rolling == "ball":
        less, power = (2.5671 - y / kappa**z) ** 0.83 * np.cbrt(ratio), -9.3
    else:
        less, power = (1.5859 - y / kappa**z) * ratio**0.4, -9.185
    return np.minimum(0.1 * np.maximum(1 - less, 1e-3) ** power, LARGEST_FACTOR)
