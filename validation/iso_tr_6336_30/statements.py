"""Printed factors and safeties beside those that ``flexgear rate`` writes for ``case.toml``."""

from functools import lru_cache
from pathlib import Path

from rows import Row, compared, gathered, reference

from flexgear.gears.nominal_stress import virtual_teeth
from flexgear.model.load import load_case
from flexgear.studies.rating import rate

PAPER = "iso_tr_6336_30"
HERE = Path(__file__).parent
GEARS = {"1": "pinion", "2": "gear"}


@lru_cache(maxsize=2)
def figures(edition: str = "2019") -> dict[str, float]:
    """By the quantities of reference.csv, in its units; edition: of ISO 6336."""
    case = load_case(HERE / "case.toml", {"rating.edition": edition})
    rating, stage = rate(case, workers=1), case.stages[0]
    sheets = {part.name: part.factors[0] for part in rating.parts}
    out = {symbol: line.value for symbol, line in rating.gear_meshes[0].factors[0].items()}
    out["c_γβ"] = 0.85 * out["c_γα"]  # ISO 6336-1:2006, 9.3
    for place, gear in GEARS.items():
        sheet = sheets[f"pair.{gear} flank"]
        lines = {symbol: line.value for symbol, line in sheet.items()}
        out |= lines
        out[f"z_n{place}"] = virtual_teeth(stage.member(gear).teeth, stage)
        out |= {f"{name}{place}": lines[name] for name in ("N_L", "Z_NT", "σ_HP", "S_H")}
    return out


def rows() -> list[Row]:
    """All printed figures."""
    return gathered(PAPER, printed)


def printed() -> list[Row]:
    """Every line of reference.csv."""
    return [compared(PAPER, line, figures()[name], 7) for name, line in reference(PAPER).items()]
