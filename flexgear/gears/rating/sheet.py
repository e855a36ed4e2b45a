"""Lines of a rating sheet: unit, meaning and source of each symbol."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

LOADS, STEEL, KEY, TEETH = "ISO 6336-1", "ISO 6336-5:2003, table 1", "[rating]", "ISO 21771"
COMPUTED, BEYOND = "computed, equilibria", "beyond ISO 6336"
BASIC, ROWS, REV = "ISO 281", "ISO/TS 16281", "10⁶ rev"
CAUSE = "part of σ_direct/σ"  # of a factor that explains the difference
SYMBOLS = {  # unit, meaning, source
    "F_t": ("N", "force at the reference circle", LOADS),
    "v": ("m/s", "speed of the pitch line", LOADS),
    "K_A": ("", "application factor", LOADS),
    "K_γ": ("", "load sharing of the planets", LOADS),
    "K_v": ("", "dynamic factor", LOADS),
    "K_Hβ": ("", "face load factor, flank", LOADS),
    "f_ma": ("µm", "misalignment by helix slope deviations", "ISO 6336-1, clause 7"),
    "K_Fβ": ("", "face load factor, root", LOADS),
    "K_Hα": ("", "transverse load factor, flank", LOADS),
    "K_Fα": ("", "transverse load factor, root", LOADS),
    "c′_th": ("N/(mm µm)", "theoretical stiffness of a pair", "ISO 6336-1, clause 9"),
    "c′": ("N/(mm µm)", "stiffness of a pair", "ISO 6336-1, clause 9"),
    "c_γα": ("N/(mm µm)", "stiffness of the gear mesh", "ISO 6336-1, clause 9"),
    "m_red": ("kg/mm", "reduced mass per width", "ISO 6336-1, clause 6"),
    "N": ("", "resonance ratio", "ISO 6336-1, clause 6"),
    "f_pb,eff": ("µm", "base pitch deviation after running in", "ISO 6336-1, clause 6"),
    "f_fα,eff": ("µm", "profile form deviation after running in", "ISO 6336-1, clause 6"),
    "C_a": ("µm", "tip relief of B_k", "ISO 6336-1, clause 6"),
    "ε_α": ("", "transverse contact ratio", TEETH),
    "ε_β": ("", "overlap ratio", TEETH),
    "ρ_red": ("mm", "radius of relative curvature", "ISO 6336-2, clause 12"),
    "ε_αn": ("", "contact ratio of the virtual gears", "ISO 6336-3, clause 6"),
    "b": ("mm", "effective face width", "ISO 6336-3, clause 5"),
    "h_Fe/m_n": ("", "lever of the load", "ISO 6336-3, clause 6"),
    "s_Fn/m_n": ("", "thickness of the critical section", "ISO 6336-3, clause 6"),
    "ρ_F/m_n": ("", "radius of the fillet there", "ISO 6336-3, clause 6"),
    "α_Fen": ("deg", "load angle", "ISO 6336-3, clause 6"),
    "Z_H": ("", "zone factor", "ISO 6336-2, clause 6"),
    "Z_E": ("√(N/mm²)", "elasticity factor", "ISO 6336-2, clause 7"),
    "Z_ε": ("", "contact ratio factor", "ISO 6336-2, clause 8"),
    "Z_β": ("", "helix angle factor", "ISO 6336-2, clause 9"),
    "f_ZCa": ("", "profile modification factor", KEY),
    "Z_B": ("", "single pair tooth contact factor", "ISO 6336-2, clause 6"),
    "Z_D": ("", "single pair tooth contact factor", "ISO 6336-2, clause 6"),
    "σ_H0": ("MPa", "nominal contact stress", "ISO 6336-2, clause 5"),
    "σ_H": ("MPa", "contact stress", "ISO 6336-2, clause 5"),
    "σ_Hlim": ("MPa", "allowable stress number", STEEL),
    "Z_L": ("", "lubricant factor", "ISO 6336-2, clause 12"),
    "Z_v": ("", "velocity factor", "ISO 6336-2, clause 12"),
    "Z_R": ("", "roughness factor", "ISO 6336-2, clause 12"),
    "Z_W": ("", "work hardening factor", "ISO 6336-2, clause 13"),
    "Z_X": ("", "size factor", "ISO 6336-2, clause 14"),
    "S_Hmin": ("", "least safety", KEY),
    "N_L": ("", "load cycles", "ISO 6336-6"),
    "Z_NT": ("", "life factor", "ISO 6336-2, clause 11"),
    "σ_HP": ("MPa", "permissible stress", "ISO 6336-2, clause 5"),
    "S_H": ("", "safety", "ISO 6336-2, clause 5"),
    "Y_F": ("", "form factor", "ISO 6336-3, clause 6"),
    "Y_S": ("", "stress correction factor", "ISO 6336-3, clause 7"),
    "Y_β": ("", "helix angle factor", "ISO 6336-3, clause 8"),
    "Y_DT": ("", "deep tooth factor", "ISO 6336-3, clause 10"),
    "Y_B": ("", "rim thickness factor", "ISO 6336-3, clause 9"),
    "σ_F0": ("MPa", "nominal root stress", "ISO 6336-3, clause 5"),
    "σ_F": ("MPa", "root stress", "ISO 6336-3, clause 5"),
    "σ_Flim": ("MPa", "allowable stress number", STEEL),
    "Y_ST": ("", "stress correction of test gears", "ISO 6336-3, clause 5"),
    "Y_δrelT": ("", "relative notch sensitivity factor", "ISO 6336-3, clause 13"),
    "Y_RrelT": ("", "relative surface factor", "ISO 6336-3, clause 14"),
    "Y_X": ("", "size factor", "ISO 6336-3, clause 15"),
    "Y_M": ("", "mean stress factor", "ISO 6336-3, annex B"),
    "R": ("", "stress ratio of Y_M", "load cases of both senses, changes not counted"),
    "S_Fmin": ("", "least safety", KEY),
    "Y_NT": ("", "life factor", "ISO 6336-3, clause 12"),
    "σ_FP": ("MPa", "permissible stress", "ISO 6336-3, clause 5"),
    "S_F": ("", "safety", "ISO 6336-3, clause 5"),
    "σ_0.2": ("MPa", "yield strength", "key yield_strength"),
    "S_0.2": ("", "safety against yield of the fillet", "σ_0.2/σ_F"),
    "S_direct": ("", "safety at the worst place", BEYOND),
    "D_direct": ("", "Miner's sum at the worst place", BEYOND),
    "L_direct": ("h", "life until that sum is one", BEYOND),
    "s/g": ("", "position on the path, 0 at the planet's root", BEYOND),
    "z/b": ("", "position along the face", BEYOND),
    "φ": ("deg", "azimuth of the tooth", BEYOND),
    "planet": ("", "number of the planet", BEYOND),
    "σ_direct": ("MPa", "largest stress", BEYOND),
    "σ_direct/σ": ("", "over the stress of ISO 6336, product of the following", BEYOND),
    "by form": ("", CAUSE, BEYOND),
    "by load distribution": ("", CAUSE, BEYOND),
    "by sharing between pairs": ("", CAUSE, BEYOND),
    "by distribution along the face": ("", CAUSE, BEYOND),
    "by rim": ("", CAUSE, BEYOND),
    "by alternation": ("", CAUSE, BEYOND),
    "F_r": ("N", "constant radial load of the same damage", COMPUTED),
    "F_a": ("N", "mean axial load", COMPUTED),
    "M": ("N m", "mean moment", COMPUTED),
    "M_x": ("N m", "its part about the direction of F_r", COMPUTED),
    "M_y": ("N m", "its part across that", COMPUTED),
    "σ_My": ("N m", "standard deviation of that part", COMPUTED),
    "F_r,max": ("N", "largest radial load", COMPUTED),
    "C": ("N", "dynamic rating of one bearing", "key dynamic_rating"),
    "C_0": ("N", "static rating of one bearing", "key static_rating"),
    "C_u": ("N", "fatigue load limit of one bearing", "key fatigue_load_limit"),
    "P": ("N", "constant equivalent load of the same damage", BASIC),
    "P_0": ("N", "largest static equivalent load", "ISO 76"),
    "F_M": ("N", "radial load on each half by M, not counted", "M/(2 √(k_tilt/k_radial))"),
    "L_10": (REV, "basic life", BASIC),
    "κ": ("", "viscosity ratio", BASIC),
    "e_C": ("", "contamination factor", BASIC),
    "a_ISO": ("", "life modification factor", BASIC),
    "L_nm": (REV, "modified life", BASIC),
    "F": ("N", "radial load of all rows", ROWS),
    "ψ": ("mrad", "tilt of all rows", ROWS),
    "p": ("MPa", "largest pressure of all rows", ROWS),
    "L_10r": (REV, "life of all rows", ROWS),
    "L_nmr": (REV, "modified life of all rows", ROWS),
    "S_0": ("", "static safety", "ISO 76"),
}


@dataclass(frozen=True)
class Factor:
    """Line of a rating sheet; value in ``unit``."""

    symbol: str
    value: float
    unit: str
    meaning: str
    source: str


Sheet = Mapping[str, Factor]  # lines by symbol, in order


def factor(symbol: str, value: float, source: str = "", row: int = 0) -> Factor:
    """Line of a symbol of ``SYMBOLS``. source: in place of the usual one; row: of a bearing, from
    1, in place of all rows: "F_1", "L_10r,1"."""
    unit, meaning, usual = SYMBOLS[symbol]
    if row:
        meaning = meaning.replace("all rows", f"row {row}")
        symbol = f"{symbol}{',' if '_' in symbol else '_'}{row}"
    return Factor(symbol, float(value), unit, meaning, source or usual)


def sheet_of(
    values: Mapping[str, float | None], source: str = "", row: int = 0
) -> dict[str, Factor]:
    """Lines by symbol, without values that are None; source, row: as in ``factor``."""
    lines = [factor(s, value, source, row) for s, value in values.items() if value is not None]
    return {line.symbol: line for line in lines}


def dated(lines: Sheet, edition: int) -> Sheet:
    """Lines with the edition in sources that are parts of ISO 6336 of two editions."""
    name = r"(ISO 6336-[1236])(?!:)"
    return {
        symbol: replace(line, source=re.sub(name, rf"\1:{edition}", line.source))
        for symbol, line in lines.items()
    }


def value_of(lines: Sheet, symbol: str, without: float = math.nan) -> float:
    """Value of the line of a symbol; ``without`` if there is none."""
    return lines[symbol].value if symbol in lines else without
