"""Gear-mesh cycles of a stage, position by position: transmission error and gear-mesh stiffness.

Gears and pins are perfect there, flanks as they are ground: errors of single teeth have no order
of the gear mesh. Where a ring bends between its bolts no cycle is like the next, and some of them
are looked at, spread over a turn.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.results.transmission_error import positions_for, with_orders
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
