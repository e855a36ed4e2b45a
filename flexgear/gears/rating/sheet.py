"""Lines of a rating sheet: what each symbol means, its unit, and where it is from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

LOADS, FLANK, ROOT, STEEL, KEY = (
    "ISO 6336-1", "ISO 6336-2", "ISO 6336-3", "ISO 6336-5", "[rating]",
)  # fmt: skip
COMPUTED, BEYOND = "computed, equilibria", "beyond ISO 6336"
BASIC, ROWS, REV = "ISO 281", "ISO/TS 16281", "10⁶ rev"
CAUSE = "direct path over norm"  # meaning of a line of the direct path that splits the difference
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
    "σ_0.2": ("MPa", "yield strength", "key yield_strength"),
    "S_0.2": ("", "against yield of the fillet", "σ_0.2/σ_F"),
    "S_direct": ("", "safety at the worst place", BEYOND),
    "D_direct": ("", "Miner's sum at the worst place", BEYOND),
    "L_direct": ("h", "until that is one", BEYOND),
    "s/g": ("", "place on the path, 0 at the planet's root", BEYOND),
    "z/b": ("", "place along the face", BEYOND),
    "φ": ("deg", "azimuth of the tooth", BEYOND),
    "planet": ("", "number of the planet", BEYOND),
    "σ_direct": ("MPa", "largest stress", BEYOND),
    "σ_direct/σ": ("", "over that of the norm, the product of what follows", BEYOND),
    "by form": ("", CAUSE, BEYOND),
    "by load distribution": ("", CAUSE, BEYOND),
    "by sharing between pairs": ("", CAUSE, BEYOND),
    "by distribution along the face": ("", CAUSE, BEYOND),
    "by rim": ("", CAUSE, BEYOND),
    "by alternation": ("", CAUSE, BEYOND),
    "F_r": ("N", "constant radial load of the same damage", COMPUTED),
    "F_a": ("N", "mean axial load", COMPUTED),
    "M": ("N m", "mean moment", COMPUTED),
    "F_r,max": ("N", "largest radial load", COMPUTED),
    "C": ("N", "dynamic rating of one bearing", "key dynamic_rating"),
    "C_0": ("N", "static rating of one bearing", "key static_rating"),
    "L_10": (REV, "basic life, radial load alone", BASIC),
    "κ": ("", "viscosity ratio", BASIC),
    "e_C": ("", "contamination factor", BASIC),
    "F": ("N", "radial load of all rows", ROWS),
    "ψ": ("mrad", "tilt of all rows", ROWS),
    "p": ("MPa", "largest pressure of all rows", ROWS),
    "L_10r": (REV, "life of all rows", ROWS),
    "L_nmr": (REV, "modified life of all rows", ROWS),
    "S_0": ("", "static safety", "ISO 76"),
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


def factor(symbol: str, value: float, source: str = "", row: int = 0) -> Factor:
    """A line of ``SYMBOLS``. source: in place of the one there; row: of a bearing, from 1, in place
    of all: "F_1", "L_10r,1"."""
    unit, meaning, usual = SYMBOLS[symbol]
    if row:
        meaning = meaning.replace("all rows", f"row {row}")
        symbol = f"{symbol}{',' if '_' in symbol else '_'}{row}"
    return Factor(symbol, float(value), unit, meaning, source or usual)


def sheet_of(
    values: Mapping[str, float | None], source: str = "", row: int = 0
) -> dict[str, Factor]:
    """Lines of ``SYMBOLS`` by symbol, but of those that are not known; source, row: as of
    ``factor``."""
    lines = [factor(s, value, source, row) for s, value in values.items() if value is not None]
    return {line.symbol: line for line in lines}


def value_of(lines: Sheet, symbol: str, without: float = math.nan) -> float:
    """Value of a line; ``without`` where there is none."""
    return lines[symbol].value if symbol in lines else without
