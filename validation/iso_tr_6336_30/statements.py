"""Printed factors and safeties beside those of ``flexgear.gears.rating``."""

from functools import lru_cache
from pathlib import Path

from rows import Row, compared, gathered, reference

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.nominal_stress import virtual_teeth
from flexgear.gears.power_flow import power_flow
from flexgear.gears.rating.capacity import rate
from flexgear.gears.rating.load_factors import (
    dynamic_factor,
    root_face_factor,
    transverse_factors,
)
from flexgear.gears.rating.pair import gear_pair, load_cycles, pair_load
from flexgear.model.load import load_case

PAPER = "iso_tr_6336_30"
HERE = Path(__file__).parent
FACE_LOAD_FACTOR = 1.16  # an input of the example
SECONDS = 50_000 * 3600.0
GEARS = {"1": "sun", "2": "planet"}  # pinion and wheel


@lru_cache(maxsize=2)
def figures(edition: str = "2019") -> dict[str, float]:
    """By the quantities of reference.csv, in its units; edition: of ISO 6336."""
    case = load_case(HERE / "case.toml", {"rating.edition": edition})
    view, flow = case.view(), power_flow(case).stages[0]
    pair = gear_pair(view, stage_geometry(view), "sun")
    load = pair_load(pair, flow)
    dynamic, _ = dynamic_factor(pair, load, 1.0)
    transverse = transverse_factors(pair, load, 1.0, dynamic * FACE_LOAD_FACTOR)
    factors = {
        "K_v": dynamic,
        "K_Hβ": FACE_LOAD_FACTOR,
        "K_Fβ": root_face_factor(pair, FACE_LOAD_FACTOR),
        "K_Hα": transverse[0],
        "K_Fα": transverse[1],
    }
    out = {
        **factors,
        "c′_th": pair.theoretical_stiffness / 1e9,
        "c′": pair.single_stiffness / 1e9,
        "c_γα": pair.gear_mesh_stiffness / 1e9,
        "c_γβ": 0.85 * pair.gear_mesh_stiffness / 1e9,  # ISO 6336-1:2006, 9.3
    }
    states, rates = rate(pair, load, factors), load_cycles(view, flow)
    for place, part in GEARS.items():
        state, cycles = states[part, "flank"], rates["sun", part] * SECONDS
        lines = {symbol: factor.value for symbol, factor in state.sheet(cycles).items()}
        out |= lines
        out[f"z_n{place}"] = virtual_teeth(pair.gears[part].teeth, view.stage)
        out |= {f"{name}{place}": lines[name] for name in ("N_L", "Z_NT", "σ_HP", "S_H")}
    return out


def rows() -> list[Row]:
    """All printed figures."""
    return gathered(PAPER, printed)


def printed() -> list[Row]:
    """Every line of reference.csv."""
    return [compared(PAPER, line, figures()[name], 7) for name, line in reference(PAPER).items()]
