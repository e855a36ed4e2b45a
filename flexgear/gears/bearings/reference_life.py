"""Reference rating life (ISO/TS 16281) and static safety of rows of rolling elements.

Rollers: with the load of an element Q_c, or lamina q_c, at the dynamic rating C of i rows, at the
inner (i) and outer (e) raceway,

    Q_ci = C/(λν 0.378 Z cos α i^(7/9)) (1 + t^4.5)^(2/9),    t = 1.038 ((1 − γ)/(1 + γ))^(143/108)
    Q_ce = C/(λν 0.364 Z cos α i^(7/9)) (1 + t^−4.5)^(2/9),     λν = 0.83,   q_c = Q_c n_s^(−7/9)

and equivalent loads of lamina k, with exponent w = 4 on the ring that turns relative to the load
and w = 4.5 on the ring that is stationary relative to it,

    q_k = (1/Z Σ_j (f_k q_jk)^w)^(1/w),   f_k = 1 − 0.01/ln(1.985 |2k − n_s − 1|/(2 n_s − 2)),

the life of a row in 10⁶ revolutions at a reliability of 0.9, without and with the effect of
lubrication, is

    L_10r = [Σ_k ((q_ki/q_ci)^4.5 + (q_ke/q_ce)^4.5)]^(−8/9)
    L_nmr = [Σ_k a_ISO,k^(−9/8) ((q_ki/q_ci)^4.5 + (q_ke/q_ce)^4.5)]^(−8/9)

A common factor of all loads changes the life by its fourth power. a_ISO,k is evaluated with C_u/i
and the load of a row all of whose laminae are loaded like lamina k,

    P_k = 0.323 Z n_s cos α [(q_ki^4.5 + (r q_ke)^4.5)/(1 + r^4.5)]^(2/9),   r = 1.038 q_ci/q_ce.

Balls, w = 3 and 10/3:

    Q_ci = C/(0.407 Z cos α i^0.7) (1 + t^(10/3))^0.3,   Q_ce with 0.389 and t^(−10/3),
    t = 1.044 ((1 − γ)/(1 + γ))^1.72 (r_i (2 r_e − D_w)/(r_e (2 r_i − D_w)))^0.41
    L_10r = [(Q_i/Q_ci)^(10/3) + (Q_e/Q_ce)^(10/3)]^(−9/10),   L_nmr = a_ISO L_10r

with a_ISO of C_u/i and P = C i^(−0.7) L_10r^(−1/3). Rows fail independently: L^(−9/8) of rollers
and L^(−10/9) of balls add up.

Static safety is the element load at C_0 over the largest (ISO 76: Q_0 = 5 C_0/(i Z cos α)).

Source: ISO/TS 16281:2008, 4.3 and 5.3; ISO 281:2007.

Lubrication by ISO 281:2007. Viscosity over temperature (Walther; ASTM D341), ν in mm²/s, T in K:

    log₁₀ log₁₀(ν + 0.7) = A − B log₁₀ T

with A and B from the viscosities at 40 and 100 °C; where a case lacks the latter, it follows from a
viscosity index of 95 (ASTM D2270, method A). Viscosity ratio κ = ν/ν_1, n in r/min, D_pw in mm,

    ν_1 = 45 000 n^(−0.83) D_pw^(−0.5),  n < 1000;   4500 n^(−0.5) D_pw^(−0.5),  n >= 1000

Contamination factor of oil in a circuit with a filter (ISO 281:2007, annex A, as printed in text
books and programs of bearing manufacturers):

    e_C = a (1 − b/D_pw^(1/3)),   a = c κ^0.68 D_pw^0.55 <= 1

Life modification factor of radial bearings, y and z by range of κ (``_Y_Z``), κ <= 4, a_ISO <= 50:

    ball    a_ISO = 0.1 [1 − (2.5671 − y/κ^z)^0.83 (e_C C_u/P)^(1/3)]^(−9.3)
    roller  a_ISO = 0.1 [1 − (1.5859 − y/κ^z) (e_C C_u/P)^0.4]^(−9.185)
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexgear.arrays import Array
from flexgear.gears.bearings.rows import BallRow, RollerRow, Row, RowState
from flexgear.model.bearings import Lubricant
from flexgear.model.units import RPM

Rolling = Literal["ball", "roller"]
LEAST_RATIO, LARGEST_RATIO = 0.1, 4.0  # viscosity ratios κ between which ISO 281 defines a_ISO
LARGEST_FACTOR = 50.0

# mm²/s at 40 and 100 °C of oils with a viscosity index of 95 (ASTM D2270, method A)
_INDEX_95 = (
    (10, 15, 22, 32, 46, 68, 100, 150, 220, 320, 460, 680, 1000, 1500),
    (2.637, 3.381, 4.254, 5.29, 6.644, 8.53, 11.07, 14.54, 18.75, 23.95, 30.34, 39.1, 49.9, 64.2),
)  # fmt: skip
_CLEANLINESS = {  # c and b by ISO 4406 code
    "-/13/10": (0.0864, 0.5663),
    "-/15/12": (0.0432, 0.9987),
    "-/17/14": (0.0288, 1.6329),
    "-/19/16": (0.0216, 2.3362),
}
_Y_Z: dict[str, tuple[tuple[float, float, float], ...]] = {  # least κ, y, z
    "ball": ((0.1, 2.2649, 0.054381), (0.4, 1.9987, 0.19087), (1.0, 1.9987, 0.071739)),
    "roller": ((0.1, 1.3993, 0.054381), (0.4, 1.2348, 0.19087), (1.0, 1.2348, 0.071739)),
}


def viscosity_100(viscosity_40: float) -> float:
    """Viscosity at 100 °C of an oil with a viscosity index of 95, m²/s, from that at 40 °C, m²/s.
    Interpolated between 10 and 1500 mm²/s; outside, the ratio of both viscosities is constant."""
    thick, thin = np.log(_INDEX_95)
    place = math.log(1e6 * viscosity_40)
    beyond = place - float(np.clip(place, thick[0], thick[-1]))
    return float(1e-6 * np.exp(np.interp(place, thick, thin) + beyond))


def viscosity_at(lubricant: Lubricant) -> float | None:
    """Kinematic viscosity ν at operating temperature, m²/s; None if the section states neither."""
    if lubricant.operating_viscosity is not None or lubricant.temperature is None:
        return lubricant.operating_viscosity
    thin = lubricant.viscosity_100 or viscosity_100(lubricant.viscosity_40)
    points = np.log10(np.log10(1e6 * np.array([lubricant.viscosity_40, thin]) + 0.7))
    kelvin = np.log10([313.15, 373.15])
    slope = (points[1] - points[0]) / (kelvin[1] - kelvin[0])
    exponent = points[0] + slope * (math.log10(lubricant.temperature) - kelvin[0])
    return float(1e-6 * (10 ** (10**exponent) - 0.7))


def dynamic_viscosity(lubricant: Lubricant | None) -> float | None:
    """Dynamic viscosity η = ρ ν, Pa·s; None without density, or without ``viscosity_at``."""
    kinematic = None if lubricant is None else viscosity_at(lubricant)
    if lubricant is None or kinematic is None or lubricant.density is None:
        return None
    return kinematic * lubricant.density


def reference_viscosity(pitch_diameter: float, speed: float) -> float:
    """Reference viscosity ν_1, m²/s; D_pw in m, relative speed of both rings in rad/s, not zero."""
    n, d = abs(speed) * RPM, 1e3 * pitch_diameter
    return 1e-6 * (45000 * n**-0.83 if n < 1000 else 4500 * n**-0.5) * d**-0.5


def contamination_factor(
    lubricant: Lubricant, pitch_diameter: float, viscosity_ratio: float
) -> float | None:
    """Contamination factor e_C, D_pw in m; None if the section has neither the factor nor a
    cleanliness code."""
    if lubricant.cleanliness is None:
        return lubricant.contamination
    c, b = _CLEANLINESS[lubricant.cleanliness]
    d = 1e3 * pitch_diameter
    a = min(c * min(viscosity_ratio, LARGEST_RATIO) ** 0.68 * d**0.55, 1.0)
    return max(a * (1 - b / d ** (1 / 3)), 0.0)


def life_modification(rolling: Rolling, viscosity_ratio: float, fatigue_ratio: ArrayLike) -> Array:
    """Life modification factor a_ISO at fatigue ratios e_C C_u/P (an array of any shape) and one
    viscosity ratio κ. Below κ = 0.1, where the standard gives no a_ISO, it is 0.1."""
    kappa = min(max(viscosity_ratio, LEAST_RATIO), LARGEST_RATIO)
    _, y, z = next(row for row in reversed(_Y_Z[rolling]) if kappa >= row[0])
    ratio = np.asarray(fatigue_ratio, dtype=float)
    if rolling == "ball":
        less, power = (2.5671 - y / kappa**z) ** 0.83 * np.cbrt(ratio), -9.3
    else:  # at κ = 0.1 the printed constants give -1e-4 in place of 0
        less, power = max(1.5859 - y / kappa**z, 0.0) * ratio**0.4, -9.185
    return np.minimum(0.1 * np.maximum(1 - less, 1e-3) ** power, LARGEST_FACTOR)


Ring = Literal["inner", "outer"]
LIFE_FACTOR_MATERIAL = 0.83  # λν of radial roller bearings


@dataclass(frozen=True)
class Ratings:
    """Load ratings C, C_0 and C_u of a bearing with ``rows`` rows, N."""

    dynamic_rating: float
    static_rating: float | None = None
    fatigue_load_limit: float | None = None
    rows: int = 1


@dataclass(frozen=True)
class Lubrication:
    """Lubrication of a bearing: viscosity ratio κ and contamination factor e_C."""

    viscosity_ratio: float
    contamination: float


@dataclass(frozen=True)
class RowRating:
    """Load, life and static safety of one row.

    position: along the axis, m; load: radial and axial resultant, N; tilt: of one ring against the
    other, rad; pressure: largest, Pa; basic_life L_10r, modified_life L_nmr: revolutions, inf
    without load, the latter None without lubrication or C_u; static_safety: inf without load, None
    without C_0.
    """

    position: float
    load: tuple[float, float]
    tilt: float
    pressure: float
    basic_life: float
    modified_life: float | None
    static_safety: float | None


@lru_cache
def edge_factors(laminae: int) -> Array:
    """Factors f_k (n_s,) of laminae for the stress concentration at the ends of rollers."""
    k = np.arange(1, laminae + 1)
    place = np.abs(2 * k - laminae - 1) / max(2 * laminae - 2, 1)
    with np.errstate(divide="ignore"):
        return np.asarray(1 - 0.01 / np.log(1.985 * place))


class _LifeLaw(NamedTuple):
    """Constants of the life of rollers or balls.

    rotating, stationary: exponents w of the ring that turns relative to the load, and of the other;
    damage: exponent of q/q_c; life: negative exponent of the sum of damages; rows: exponent of i
    and n_s in q_c; inner, outer: factors in q_ci and q_ce.
    """

    kind: Rolling
    rotating: float
    stationary: float
    damage: float
    life: float
    rows: float
    inner: float
    outer: float


LIFE_LAWS = {
    RollerRow: _LifeLaw(
        "roller", 4.0, 4.5, 4.5, 8 / 9, 7 / 9,
        0.378 * LIFE_FACTOR_MATERIAL, 0.364 * LIFE_FACTOR_MATERIAL,
    ),
    BallRow: _LifeLaw("ball", 3.0, 10 / 3, 10 / 3, 9 / 10, 0.7, 0.407, 0.389),
}  # fmt: skip


def _raceway_ratio(row: Row) -> float:
    """Ratio t in the rated element loads of both raceways."""
    curvature_ratio = (1 - row.gamma) / (1 + row.gamma)
    if isinstance(row, BallRow):
        inner, outer, d = row.inner_groove, row.outer_groove, row.diameter
        grooves = inner * (2 * outer - d) / (outer * (2 * inner - d))
        return float(1.044 * curvature_ratio**1.72 * grooves**0.41)
    return float(1.038 * curvature_ratio ** (143 / 108))


def _equivalent(loads: Array, exponent: float) -> Array:
    """Power mean (n,) of loads (Z, n) over the elements."""
    largest = np.maximum(loads.max(), 1e-300)
    return np.asarray(largest * np.mean((loads / largest) ** exponent, axis=0) ** (1 / exponent))


def row_lives(
    row: Row,
    ratings: Ratings,
    loads: Array,
    stationary: Ring,
    lubrication: Lubrication | None = None,
) -> tuple[float, float | None]:
    """L_10r and L_nmr, revolutions, under loads (Z, n), N, n = 1 for balls. stationary: ring that
    is stationary relative to the load: the inner one in planets, whose load turns with the carrier.
    L_nmr is None without lubrication or C_u."""
    law, laminae, t = LIFE_LAWS[type(row)], loads.shape[1], _raceway_ratio(row)
    row_rating = ratings.dynamic_rating / ratings.rows**law.rows
    edges = edge_factors(laminae) if isinstance(row, RollerRow) and row.edge_stress else 1.0
    rated, equivalent = np.zeros(2), np.zeros((2, laminae))
    elements = row.count * math.cos(row.contact_angle)
    for k, (ring, factor, sign) in enumerate((("inner", law.inner, 1), ("outer", law.outer, -1))):
        raceway = (1 + t ** (sign * law.damage)) ** (1 / law.damage)
        rated[k] = row_rating / laminae**law.rows / elements * raceway / factor
        exponent = law.stationary if ring == stationary else law.rotating
        equivalent[k] = _equivalent(loads * edges, exponent)
    damages = ((equivalent / rated[:, None]) ** law.damage).sum(axis=0)
    basic, limit = _life(float(damages.sum()), law.life), ratings.fatigue_load_limit
    if lubrication is None or limit is None:
        return basic, None
    if isinstance(row, RollerRow):
        outer = (1.038 * rated[0] / rated[1]) ** law.damage
        mean = np.array([1.0, outer]) @ equivalent**law.damage / (1 + outer)
        load = 0.323 * elements * laminae * mean ** (1 / law.damage)
    else:
        load = row_rating * damages ** (1 / law.damage)
    load = np.maximum(load, 1e-300)
    fatigue = lubrication.contamination * limit / ratings.rows / load
    factors = life_modification(law.kind, lubrication.viscosity_ratio, fatigue)
    return basic, _life(float((factors ** (-1 / law.life) * damages).sum()), law.life)


def _life(damage: float, exponent: float) -> float:
    """Life, revolutions, for the sum of damages of 10⁶ revolutions; inf without damage."""
    return 1e6 * damage**-exponent if damage > 0 else math.inf


def row_rating(
    row: Row,
    ratings: Ratings,
    motion: Array,
    state: RowState,
    stationary: Ring,
    lubrication: Lubrication | None = None,
) -> RowRating:
    """Rating of a row at a motion (5,) with its state; see ``row_lives``."""
    basic, modified = row_lives(row, ratings, state.loads, stationary, lubrication)
    largest, safety = float(state.element_loads.max()), None
    if ratings.static_rating is not None:
        elements = ratings.rows * row.count * math.cos(row.contact_angle)
        safety = 5 * ratings.static_rating / elements / largest if largest else math.inf
    return RowRating(
        position=row.position,
        load=(float(np.hypot(*state.force[:2])), float(state.force[2])),
        tilt=float(np.hypot(*motion[3:])),
        pressure=float(row.pressure(state.loads).max()),
        basic_life=basic,
        modified_life=modified,
        static_safety=safety,
    )


def life_of_rows(rows: Sequence[Row], lives: Sequence[float | None]) -> float | None:
    """Life, revolutions, of rows that fail independently: (Σ L^(−e))^(−1/e), e = 9/8 of rollers,
    10/9 of balls; None if any life is None."""
    defined, exponent = [x for x in lives if x is not None], 1 / LIFE_LAWS[type(rows[0])].life
    if len(defined) < len(lives):
        return None
    shortest = min(defined)
    if math.isinf(shortest):
        return math.inf
    return float(shortest * sum((shortest / x) ** exponent for x in defined) ** (-1 / exponent))
