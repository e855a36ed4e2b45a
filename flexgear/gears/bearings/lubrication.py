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
from numpy.typing import ArrayLike

from flexgear.arrays import Array
from flexgear.model.lubricant import Lubricant
from flexgear.model.units import RPM

Rolling = Literal["ball", "roller"]
LEAST_RATIO, LARGEST_RATIO = 0.1, 4.0  # of viscosities, in which a_ISO is stated
LARGEST_FACTOR = 50.0

# mm²/s at 40 and 100 °C of oils with a viscosity index of 95 (ASTM D2270, method A)
_INDEX_95 = (
    (10, 15, 22, 32, 46, 68, 100, 150, 220, 320, 460, 680, 1000, 1500),
    (2.637, 3.381, 4.254, 5.29, 6.644, 8.53, 11.07, 14.54, 18.75, 23.95, 30.34, 39.1, 49.9, 64.2),
)  # fmt: skip
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


def viscosity_100(viscosity_40: float) -> float:
    """ν at 100 °C of an oil with a viscosity index of 95, m²/s; from 10 to 1500 mm²/s at 40 °C,
    beyond as at these ends."""
    thick, thin = np.log(_INDEX_95)
    place = math.log(1e6 * viscosity_40)
    beyond = place - float(np.clip(place, thick[0], thick[-1]))
    return float(1e-6 * np.exp(np.interp(place, thick, thin) + beyond))


def viscosity_at(lubricant: Lubricant, temperature: float | None = None) -> float | None:
    """ν, m²/s, at a temperature, K, else at that of the section; None where neither is stated."""
    if temperature is None and lubricant.operating_viscosity is not None:
        return lubricant.operating_viscosity
    at = lubricant.temperature if temperature is None else temperature
    if at is None:
        return None
    thin = lubricant.viscosity_100 or viscosity_100(lubricant.viscosity_40)
    points = np.log10(np.log10(1e6 * np.array([lubricant.viscosity_40, thin]) + 0.7))
    kelvin = np.log10([313.15, 373.15])
    slope = (points[1] - points[0]) / (kelvin[1] - kelvin[0])
    exponent = points[0] + slope * (math.log10(at) - kelvin[0])
    return float(1e-6 * (10 ** (10**exponent) - 0.7))


def dynamic_viscosity(lubricant: Lubricant | None) -> float | None:
    """η = ρ ν of the oil in contacts, Pa·s; None where density or temperature is not stated."""
    kinematic = None if lubricant is None else viscosity_at(lubricant)
    if lubricant is None or kinematic is None or lubricant.density is None:
        return None
    return kinematic * lubricant.density


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
    """a_ISO of fatigue ratios e_C C_u/P of any shape; below κ = 0.1, where it is not stated, that
    of κ = 0.1, which is 0.1 whatever the load."""
    kappa = min(max(viscosity_ratio, LEAST_RATIO), LARGEST_RATIO)
    _, y, z = next(row for row in reversed(_BRANCHES[rolling]) if kappa >= row[0])
    ratio = np.asarray(fatigue_ratio, dtype=float)
    if rolling == "ball":
        less, power = (2.5671 - y / kappa**z) ** 0.83 * np.cbrt(ratio), -9.3
    else:  # the printed figures leave -1e-4 at 0.1, where nothing is meant
        less, power = max(1.5859 - y / kappa**z, 0.0) * ratio**0.4, -9.185
    return np.minimum(0.1 * np.maximum(1 - less, 1e-3) ** power, LARGEST_FACTOR)
