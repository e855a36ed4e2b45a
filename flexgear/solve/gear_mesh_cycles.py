"""Gear-mesh cycles of a stage, position by position: transmission error and gear-mesh stiffness.

Gears and pins are perfect there, flanks as they are ground: errors of single teeth have no order
of the gear mesh. Where a ring bends between its bolts no cycle is like the next, and some of them
are looked at, spread over a turn.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.results.transmission_error import ERRORS, positions_for, with_orders
from flexgear.solve.angles import lead_speed, stage_motions
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.model import Model
from flexgear.solve.static import static

Array = NDArray[np.float64]
CYCLES = 7  # of a stage whose ring bends: prime, so that planets and bolts seldom repeat with them


def gear_mesh_cycles(model: Model, stage: str, progress: Progress = silent) -> xr.Dataset:
    """Equilibria of the model without errors over cycles of a stage's gear mesh under rated torque,
    with orders of the transmission error up to ``solver.gear_mesh_orders`` and the phase of the
    gear mesh, ``gear_mesh_phase``, in cycles; flanks are those of the stage, which has to turn."""
    phase, lead = _positions(model, stage)
    ideal = model.without_errors() if model.has_errors else model
    data = static(ideal, lead, progress=progress, stage=stage)
    data = data.isel(flank=data["flank_stage"].to_numpy() == stage)
    return with_orders(data, phase, model.case.solver.gear_mesh_orders)


def sliced_stages(model: Model) -> list[str]:
    """Stages that turn and whose tooth pairs have slices."""
    motions = stage_motions(model.case, model.flow)
    turning = {motion.name for motion in motions if motion.theta}
    return [
        stage.name
        for stage in model.case.stages
        if stage.gear_mesh.model == "face_load" and stage.name in turning
    ]


def _positions(model: Model, stage: str) -> tuple[Array, Array]:
    """Phases (p,) of the gear mesh in cycles, and rotations (p,) of the lead, rad."""
    motion = next(m for m in stage_motions(model.case, model.flow) if m.name == stage)
    per_turn, solver = motion.cycle.per_turn, model.case.solver
    each = max(positions_for(solver.gear_mesh_orders), solver.positions_per_gear_mesh)
    bends = stage in model.case.fe_ring_stages
    count = min(CYCLES, per_turn) if bends else 1
    start = np.floor(np.arange(count) * per_turn / count)
    phase = (start[:, None] + np.arange(each) / each).ravel()
    lead = abs(lead_speed(model.case, model.flow) / motion.theta)
    return phase, 2.0 * math.pi / per_turn * lead * phase


def cycle_figures(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Figures over gear-mesh cycles of the flanks of a stage that carry, by name."""
    figures: dict[str, dict[str, Any]] = {}
    for name in map(str, data["flank"].to_numpy()):
        of_flank = data.sel(flank=name)
        if not np.isfinite(of_flank["transmission_error_order"]).all():
            continue
        stiffness = 1e-6 * of_flank["gear_mesh_stiffness"].to_numpy()
        figures[name] = {
            "gear_mesh_stiffness_n_per_um": {
                "min": float(stiffness.min()),
                "mean": float(stiffness.mean()),
                "max": float(stiffness.max()),
            },
        }
        for error in ERRORS:
            amplitudes = of_flank[f"{error}_order"].to_numpy()
            figures[name] |= {
                f"{error}_cycle_peak_to_peak_um": 1e6 * _widest(of_flank, error),
                f"{error}_orders_um": [1e6 * float(a) for a in amplitudes],
            }
    return figures


def _widest(of_flank: xr.Dataset, error: str) -> float:
    """Largest peak-to-peak value, m, within one cycle."""
    cycle = np.floor(of_flank["gear_mesh_phase"].to_numpy() + 1e-9)
    values = of_flank[error].to_numpy()
    return max(float(np.ptp(values[cycle == c])) for c in np.unique(cycle))
