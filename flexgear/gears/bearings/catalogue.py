"""The bearing that a case describes, with what its catalogue data leaves out estimated by rule.

    C    ISO 281:2007 by f_c in closed form (Harris, Kotzalas 2006, ch. 11): rollers
         b_m 207.9 λν γ^(2/9) (1 − γ)^(29/27)/(1 + γ)^(1/4) (1 + (1.04 t)^4.5)^(−2/9)
         · (i L_we cos α)^(7/9) Z^(3/4) D_we^(29/27), λν = 0.83, b_m = 1.1,
         t = ((1 − γ)/(1 + γ))^(143/108)
    C_0  ISO 76:2006, rollers: 44 (1 − γ) i Z L_we D_we cos α; balls: i Z cos α/5 times the load
         under which a raceway has 4200 MPa (E 207 GPa), of which that standard's f_0 follows
    C_u  ISO 281:2007, annex B, simplified: C_0/8.2 of rollers, C_0/22 of balls,
         times (100/D_pw)^0.3 and (100/D_pw)^0.5 from D_pw = 100 mm on

in N and mm. The dynamic rating of balls is not estimated.
"""

from __future__ import annotations

import math

import numpy as np

from flexgear.gears.bearings.bearing import LIMIT_ESTIMATE, RollingBearing
from flexgear.gears.bearings.reference_life import LIFE_FACTOR_MATERIAL, Ratings
from flexgear.gears.bearings.rows import BallRow, RollerRow, Row, standard_drops
from flexgear.model.member import PlanetBearing, SeatBearing
from flexgear.model.rolling import RollingElements

LAMINAE = 30  # of a roller: the least number of the standard
STATIC_PRESSURE, STATIC_YOUNG = 4200e6, 207e9  # of balls at the static rating in ISO 76, Pa


def rolling_bearing(
    section: PlanetBearing | SeatBearing, laminae: int = LAMINAE
) -> RollingBearing | str:
    """The bearing with all its rows, or why it cannot be rated: which keys are missing."""
    elements = section.elements
    if elements is None:
        return "elements are missing (diameter, pitch_diameter, …)"
    rows = _rows(section, elements, laminae)
    estimates: list[str] = []
    each = len(rows) // section.count
    first = rows[0]
    dynamic = section.dynamic_rating
    if dynamic is None and isinstance(first, RollerRow):
        dynamic = dynamic_rating_of_rollers(first, each)
        estimates.append("dynamic_rating by ISO 281 from the size of the rollers")
    if dynamic is None:
        return "dynamic_rating is missing"
    static = section.static_rating
    if static is None:
        static = static_rating(first, each)
        estimates.append("static_rating by ISO 76 from the size of the rolling elements")
    limit = section.fatigue_load_limit
    if limit is None:
        limit = fatigue_load_limit(first, static)
        estimates.append(LIMIT_ESTIMATE)
    return RollingBearing(rows, Ratings(dynamic, static, limit, each), tuple(estimates))


def _rows(
    section: PlanetBearing | SeatBearing, elements: RollingElements, laminae: int
) -> tuple[Row, ...]:
    """Rows of all bearings, from −z to +z."""
    source = section.rollers or elements
    total = section.rollers.rows if section.rollers else (elements.rows or 1) * section.count
    spacing, gap, length = source.spacing or 0.0, source.clearance or 0.0, source.length or 0.0
    assert source.count is not None
    outward = 1.0 if elements.arrangement == "X" or total == 1 else -1.0
    rows: list[Row] = []
    for k in range(total):
        place = k - (total - 1) / 2
        # rows at +z whose contact lines meet outside are loaded by motion along −z
        angle = elements.contact_angle * outward * (1.0 if place >= 0 else -1.0)
        common = (source.count, elements.diameter, elements.pitch_diameter, angle, gap)
        if section.rolling == "ball":
            grooves = elements.inner_groove, elements.outer_groove
            inner, outer = (ratio * elements.diameter for ratio in grooves)
            rows.append(BallRow(*common, spacing * place, inner, outer))
        else:
            drops = _drops(elements, length, laminae)
            edge_stress = elements.edge_stress
            rows.append(RollerRow(*common, spacing * place, length, drops, edge_stress))
    return tuple(rows)


def _drops(elements: RollingElements, length: float, laminae: int) -> tuple[float, ...]:
    """P_k of the laminae, m."""
    if elements.profile == "logarithmic":
        return standard_drops(elements.diameter, length, elements.contact_angle, laminae)
    if elements.profile == "straight":
        return (0.0,) * laminae
    place = np.abs((2 * np.arange(laminae) + 1) / laminae - 1)
    table = np.interp(place, np.linspace(0, 1, len(elements.drops)), elements.drops)
    return tuple(float(drop) for drop in table)


def dynamic_rating_of_rollers(row: RollerRow, rows: int) -> float:
    """C, N, of a cylindrical roller bearing of so many rows."""
    g = row.gamma
    t = ((1 - g) / (1 + g)) ** (143 / 108)
    factor = 207.9 * LIFE_FACTOR_MATERIAL * g ** (2 / 9) * (1 - g) ** (29 / 27) / (1 + g) ** 0.25
    factor *= (1 + (1.04 * t) ** 4.5) ** (-2 / 9)
    size = (rows * 1e3 * row.length * math.cos(row.contact_angle)) ** (7 / 9)
    return float(1.1 * factor * size * row.count**0.75 * (1e3 * row.diameter) ** (29 / 27))


def static_rating(row: Row, rows: int) -> float:
    """C_0, N, of a bearing of so many rows."""
    elements = rows * row.count * math.cos(row.contact_angle)
    if isinstance(row, RollerRow):
        return float(44e6 * (1 - row.gamma) * elements * row.length * row.diameter)
    assert isinstance(row, BallRow)
    at_one = max(float(contact.pressure(1.0)) for contact in row.contacts)  # p³ grows with load
    return elements / 5 * (STATIC_PRESSURE / at_one) ** 3 * (row.young / STATIC_YOUNG) ** 2


def fatigue_load_limit(row: Row, static: float) -> float:
    """C_u, N, from C_0, N."""
    size = max(10 * row.pitch_diameter, 1.0)  # D_pw over 100 mm
    return static / 8.2 / size**0.3 if isinstance(row, RollerRow) else static / 22 / size**0.5
