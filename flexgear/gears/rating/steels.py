"""Gear steels: allowable stress numbers by hardness, life factors, notch and roughness factors.

Allowable stress numbers of ISO 6336-5, table 1 of the edition of 2003 (wrought steels), are
straight lines over the surface hardness,

    σ_Hlim, σ_Flim = A x + B     N/mm², x: Vickers hardness.

Life factors Z_NT and Y_NT are straight lines between knees in logarithms (ISO 6336-2, table 2; ISO
6336-3, table 1). Slip-layer thickness ρ' and roughness formulas: ISO 6336-3, 13.2 and 13.3.
"""

import math
from typing import NamedTuple

import numpy as np

from flexgear.model.rating import GearRating, SteelKind
from flexgear.model.section import Refusal

Knees = tuple[tuple[float, float], ...]  # cycles and life factor
LONG_LIFE = 1e10  # cycles at which long-life factors apply
THROUGH_HARDENED: frozenset[SteelKind] = frozenset({"through_hardened", "through_hardened_carbon"})
NITRIDED: frozenset[SteelKind] = frozenset(
    {"nitrided", "nitrided_through_hardening", "nitrocarburised"}
)
SURFACE_HARDENED: frozenset[SteelKind] = NITRIDED | {"case_hardened", "induction_hardened"}


class Line(NamedTuple):
    """Strength A x + B, N/mm², at most ``limit``, for x from ``low`` to ``high`` HV."""

    slope: float
    constant: float
    low: float
    high: float
    limit: float = math.inf


# fmt: off
STRENGTHS: dict[tuple[SteelKind, str], tuple[Line, Line]] = {  # flank, root; by steel and grade
    ("case_hardened", "ML"): (Line(0, 1300, 600, 800), Line(0, 312, 600, 800)),
    ("case_hardened", "MQ"): (Line(0, 1500, 660, 800), Line(0, 425, 660, 800)),
    ("case_hardened", "ME"): (Line(0, 1650, 660, 800), Line(0, 525, 660, 800)),
    ("induction_hardened", "ML"): (Line(0.740, 602, 485, 615), Line(0.305, 76, 485, 615)),
    ("induction_hardened", "MQ"): (Line(0.541, 882, 500, 615), Line(0.138, 290, 500, 615, 369)),
    ("induction_hardened", "ME"): (Line(0.505, 1013, 500, 615), Line(0.271, 237, 500, 615)),
    ("nitrided", "ML"): (Line(0, 1125, 650, 900), Line(0, 270, 650, 900)),
    ("nitrided", "MQ"): (Line(0, 1250, 650, 900), Line(0, 420, 650, 900)),
    ("nitrided", "ME"): (Line(0, 1450, 650, 900), Line(0, 468, 650, 900)),
    ("nitrided_through_hardening", "ML"): (Line(0, 788, 450, 650), Line(0, 258, 450, 650)),
    ("nitrided_through_hardening", "MQ"): (Line(0, 998, 450, 650), Line(0, 363, 450, 650)),
    ("nitrided_through_hardening", "ME"): (Line(0, 1217, 450, 650), Line(0, 432, 450, 650)),
    ("nitrocarburised", "ML"): (Line(0, 650, 300, 650), Line(0, 224, 300, 650)),
    ("nitrocarburised", "MQ"): (Line(1.167, 425, 300, 650, 950), Line(0.653, 94, 300, 650, 388)),
    ("nitrocarburised", "ME"): (Line(1.167, 425, 300, 650, 950), Line(0.653, 94, 300, 650, 388)),
    ("through_hardened", "ML"): (Line(1.313, 188, 200, 360), Line(0.423, 104, 200, 360)),
    ("through_hardened", "MQ"): (Line(1.313, 373, 200, 360), Line(0.425, 187, 200, 360)),
    ("through_hardened", "ME"): (Line(2.213, 260, 200, 390), Line(0.358, 231, 200, 390)),
    ("through_hardened_carbon", "ML"): (Line(0.963, 283, 135, 210), Line(0.250, 108, 115, 215)),
    ("through_hardened_carbon", "MQ"): (Line(0.925, 360, 135, 210), Line(0.240, 163, 115, 215)),
    ("through_hardened_carbon", "ME"): (Line(0.838, 432, 135, 210), Line(0.283, 202, 115, 215)),
}
# fmt: on
LEAST_CORE_HARDNESS = 25.0  # HRC, of grade MQ
HARD_CORE = 30.0  # HRC, with which grade MQ has a higher root strength
HARD_CORE_ROOT_STRENGTH = 500.0  # N/mm²


def strength_keys(data: GearRating, place: str) -> list[str]:
    """Missing keys without which the strength of "flank" or "root" is unknown."""
    keys = ["steel"] if data.steel is None else []
    if getattr(data, f"{place}_strength") is not None:
        return keys
    if data.grade is None:
        keys.append("grade")
    if data.steel is not None and data.vickers_hardness is None:
        line = STRENGTHS[data.steel, data.grade or "MQ"][place == "root"]
        keys += ["vickers_hardness"] if line.slope else []
    return keys


def allowable_stress(data: GearRating, place: str) -> float | None:
    """σ_Hlim ("flank") or σ_Flim ("root"), Pa; None if data are missing. Raises Refusal for a
    hardness outside the range of the standard."""
    stated: float | None = getattr(data, f"{place}_strength")
    if stated is not None:
        return stated
    if data.steel is None or data.grade is None or strength_keys(data, place):
        return None
    line = STRENGTHS[data.steel, data.grade][place == "root"]
    hardness = data.vickers_hardness
    if hardness is not None and not line.low <= hardness <= line.high:
        problem = (
            f"is {hardness:g}, and ISO 6336-5 has no {place} strength of {data.steel} "
            f"{data.grade} beyond {line.low:g} to {line.high:g} HV"
        )
        raise Refusal("vickers_hardness", problem, f"check it, or give {place}_strength_mpa")
    value = min(line.slope * (hardness or 0.0) + line.constant, line.limit)
    core = data.core_rockwell_hardness
    if place == "root" and (data.steel, data.grade) == ("case_hardened", "MQ") and core is not None:
        if core < LEAST_CORE_HARDNESS:
            problem = f"is {core:g}, below the {LEAST_CORE_HARDNESS:g} HRC of grade MQ"
            remedy = 'take grade "ML", or give root_strength_mpa'
            raise Refusal("core_rockwell_hardness", problem, remedy)
        value = HARD_CORE_ROOT_STRENGTH if core >= HARD_CORE else value
    return 1e6 * value


def flank_knees(steel: SteelKind, long_life: float, limited_pitting: bool) -> Knees:
    """Knees of the life factor Z_NT of flanks; long_life: Z_NT at 1e10 cycles."""
    if steel == "nitrocarburised":
        return ((1e5, 1.1), (2e6, 1.0), (LONG_LIFE, long_life))
    if steel in NITRIDED:
        return ((1e5, 1.3), (2e6, 1.0), (LONG_LIFE, long_life))
    if limited_pitting:
        return ((6e5, 1.6), (1e7, 1.3), (1e9, 1.0), (LONG_LIFE, long_life))
    return ((1e5, 1.6), (5e7, 1.0), (LONG_LIFE, long_life))


def root_knees(steel: SteelKind, long_life: float) -> Knees:
    """Knees of the life factor Y_NT of roots; long_life: Y_NT at 1e10 cycles."""
    first = (1e4, 2.5) if steel in THROUGH_HARDENED else (1e3, 2.5)
    if steel in NITRIDED:
        first = (1e3, 1.1) if steel == "nitrocarburised" else (1e3, 1.6)
    return (first, (3e6, 1.0), (LONG_LIFE, long_life))


_SLIP_YIELD = (500.0, 600.0, 800.0, 1000.0)  # N/mm²
_SLIP_LAYER = (0.0281, 0.0194, 0.0064, 0.0014)  # mm


def slip_layer(data: GearRating) -> float:
    """Slip-layer thickness ρ', mm, linear between the yield strengths of the table."""
    if data.steel in THROUGH_HARDENED:
        assert data.yield_strength is not None
        return float(np.interp(data.yield_strength / 1e6, _SLIP_YIELD, _SLIP_LAYER))
    return 0.1005 if data.steel in NITRIDED else 0.0030


def mean_stress_ratio(steel: SteelKind, notch_factor: float, static: bool) -> float:
    """Mean stress ratio M of ISO 6336-3, annex B, for endurance or static strength; notch_factor:
    Y_S."""
    if steel == "case_hardened" and not static:
        return max(0.8 - 0.15 * notch_factor, 0.0)
    if steel in NITRIDED:
        return 0.3
    if steel in THROUGH_HARDENED:
        return 0.5 if static else 0.3
    return 0.7 if steel == "case_hardened" else 0.6 if static else 0.4


def root_roughness_factor(steel: SteelKind, roughness: float) -> float:
    """Relative surface factor Y_RrelT for the roughness R_z, m; constant above 40 µm."""
    rz = min(max(1e6 * roughness, 1.0), 40.0)
    if steel in NITRIDED:
        return 1.025 if 1e6 * roughness < 1.0 else 4.299 - 3.259 * (rz + 1.0) ** 0.0058
    return 1.12 if 1e6 * roughness < 1.0 else 1.674 - 0.529 * (rz + 1.0) ** 0.1


def root_size_factor(steel: SteelKind, module: float) -> float:
    """Size factor Y_X for the normal module, m."""
    mn = 1e3 * module
    if steel in THROUGH_HARDENED:
        return min(max(1.03 - 0.006 * mn, 0.85), 1.0)
    return min(max(1.05 - 0.01 * mn, 0.80), 1.0)
