"""Printed factors and safeties beside those of ``flexgear.gears.rating``."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from rows import Row, compared, gathered, reference

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.nominal_stress import virtual_teeth
from flexgear.gears.power_flow import power_flow
from flexgear.gears.rating.cycles import load_cycles
from flexgear.gears.rating.load_factors import method_b
from flexgear.gears.rating.pair import gear_pair, pair_load
from flexgear.gears.rating.rate import rate
from flexgear.model.load import load_case

PAPER = "iso_tr_6336_30"
HERE = Path(__file__).parent
FACE_LOAD_FACTOR = 1.16  # an input of the example
SECONDS = 50_000 * 3600.0
GEARS = {"1": "sun", "2": "planet"}  # pinion and wheel


@lru_cache(maxsize=1)
def figures() -> dict[str, float]:
    """By the quantities of reference.csv, in its units."""
    case = load_case(HERE / "case.toml")
    view, flow = case.view(), power_flow(case).stages[0]
    pair = gear_pair(view, stage_geometry(view), "sun")
    load = pair_load(pair, flow)
    factors = method_b(pair, load, FACE_LOAD_FACTOR)
    assert factors is not None
    out = {
        "K_Fβ": factors.face_root,
        "K_Fα": factors.transverse_root,
        "c′_th": pair.theoretical_stiffness / 1e9,
        "c′": pair.single_stiffness / 1e9,
        "c_γα": pair.mesh_stiffness / 1e9,
        "c_γβ": pair.face_stiffness / 1e9,
    }
    states, rates = rate(pair, load, factors), load_cycles(view, flow)
    for place, part in GEARS.items():
        state, cycles = states[part].flank, rates["sun", part] * SECONDS
        out |= {factor.symbol: factor.value for factor in state.factors}
        life, permissible, safety = (
            f(cycles) for f in (state.life_factor, state.permissible, state.safety)
        )
        assert life is not None and permissible is not None and safety is not None
        out[f"z_n{place}"] = virtual_teeth(pair.gears[part].teeth, view.stage)
        out[f"N_L{place}"], out[f"Z_NT{place}"] = cycles, life
        out[f"σ_HP{place}"], out[f"S_H{place}"] = permissible / 1e6, safety
    return out


def rows() -> list[Row]:
    """All printed figures."""
    return gathered(PAPER, printed)


def printed() -> list[Row]:
    """Every line of reference.csv."""
    lines = reference(HERE / "reference.csv")
    return [compared(PAPER, line, figures()[name], 7) for name, line in lines.items()]
