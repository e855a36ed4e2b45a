"""Lines of a rating sheet: what each symbol of ISO 6336 means, its unit, and where it is from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

LOADS, FLANK, ROOT, STEEL, KEY = (
    "ISO 6336-1", "ISO 6336-2", "ISO 6336-3", "ISO 6336-5", "[rating]",
)  # fmt: skip
SYMBOLS = {  # unit, meaning, source
    "F_t": ("N", "force at the reference circle", LOADS),
    "v": ("m/s", "speed of the pitch line", LOADS),
    "K_A": ("", "application factor", LOADS),
    "K_γ": ("", "load sharing of the planets", LOADS),
    "K_v": ("", "dynamic factor", LOADS),
    "K_Hβ": ("", "face load factor, flank", LOADS),
    "K_Fβ": ("", "face load factor, root", LOADS),
    "K_Hα": ("", "transverse load factor, flank", LOADS),
    "K_Fα": ("", "transverse load factor, root", LOADS),
    "Z_H": ("", "zone factor", FLANK),
    "Z_E": ("√(N/mm²)", "elasticity factor", FLANK),
    "Z_ε": ("", "contact ratio factor", FLANK),
    "Z_β": ("", "helix angle factor", FLANK),
    "f_ZCa": ("", "profile modification factor", KEY),
    "Z_B": ("", "single pair tooth contact factor", FLANK),
    "Z_D": ("", "single pair tooth contact factor", FLANK),
    "σ_H0": ("MPa", "nominal contact stress", FLANK),
    "σ_H": ("MPa", "contact stress", FLANK),
    "σ_Hlim": ("MPa", "allowable stress number", STEEL),
    "Z_L": ("", "lubricant factor", FLANK),
    "Z_v": ("", "velocity factor", FLANK),
    "Z_R": ("", "roughness factor", FLANK),
    "Z_W": ("", "work hardening factor", FLANK),
    "Z_X": ("", "size factor", FLANK),
    "S_Hmin": ("", "least safety", KEY),
    "N_L": ("", "load cycles", "ISO 6336-6"),
    "Z_NT": ("", "life factor", FLANK),
    "σ_HP": ("MPa", "permissible stress", FLANK),
    "S_H": ("", "safety", FLANK),
    "Y_F": ("", "form factor", ROOT),
    "Y_S": ("", "stress correction factor", ROOT),
    "Y_β": ("", "helix angle factor", ROOT),
    "Y_DT": ("", "deep tooth factor", ROOT),
    "Y_B": ("", "rim thickness factor", ROOT),
    "σ_F0": ("MPa", "nominal root stress", ROOT),
    "σ_F": ("MPa", "root stress", ROOT),
    "σ_Flim": ("MPa", "allowable stress number", STEEL),
    "Y_ST": ("", "stress correction of test gears", ROOT),
    "Y_δrelT": ("", "relative notch sensitivity factor", ROOT),
    "Y_RrelT": ("", "relative surface factor", ROOT),
    "Y_X": ("", "size factor", ROOT),
    "Y_M": ("", "mean stress factor", ROOT),
    "S_Fmin": ("", "least safety", KEY),
    "Y_NT": ("", "life factor", ROOT),
    "σ_FP": ("MPa", "permissible stress", ROOT),
    "S_F": ("", "safety", ROOT),
}


@dataclass(frozen=True)
class Factor:
    """A line of a rating sheet; value in ``unit``."""

    symbol: str
    value: float
    unit: str
    meaning: str
    source: str


Sheet = Mapping[str, Factor]  # lines by symbol, in order


def factor(symbol: str, value: float, source: str = "") -> Factor:
    """A line of ``SYMBOLS``; source: in place of the one there."""
    unit, meaning, usual = SYMBOLS[symbol]
    return Factor(symbol, float(value), unit, meaning, source or usual)


def sheet_of(values: Mapping[str, float]) -> dict[str, Factor]:
    """Lines of ``SYMBOLS``."""
    return {symbol: factor(symbol, value) for symbol, value in values.items()}


def sheet(lines: Iterable[Factor]) -> dict[str, Factor]:
    """Lines by their symbols."""
    return {line.symbol: line for line in lines}


def value_of(lines: Sheet, symbol: str, without: float = math.nan) -> float:
    """Value of a line; ``without`` where there is none."""
    return lines[symbol].value if symbol in lines else without
