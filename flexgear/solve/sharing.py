"""Quasi-static load sharing of the planets of a stage over its error cycle.

A train that is linear in its errors is looked at in every position of the error cycle; any other
train in the positions of as many whole gear-mesh cycles as asked for, spread over it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from flexgear.analysis.equilibrium import revolution
from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.results.labelled_dataset import labelled_dataset
from flexgear.results.load_sharing import (
    cycle_maxima,
    sharing_coefficients,
    sharing_histories,
    without_rounding,
)
from flexgear.solve.angles import (
    cycles_of_train,
    lead_speed,
    one_turn,
    samples_of_stage,
    stage_motions,
)
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.dataset import result_attrs, result_labels
from flexgear.solve.linear import LinearTrain, linear_train, why_not_linear
from flexgear.solve.model import Model, rated_rotations

SHOWN_CYCLES = 200  # of one turn that the dataset holds position by position
CHUNK = 20_000  # positions at once


def stages_sharing(
    model: Model,
    stage: str,
    *,
    cycles: int | None = None,
    progress: Progress = silent,
) -> xr.Dataset:
    """Load sharing of one planetary stage under rated torque.

    cycles: gear-mesh cycles to look at, at most. The dataset holds the positions of one turn of
    the stage, the maxima of every cycle that was looked at, and the coefficients over all of them.
    """
    number = model.case.stage_index(stage)
    motions = stage_motions(model.case, model.flow)
    linear = linear_train(model.system) if why_not_linear(model.system) is None else None
    every = cycles_of_train(motions, number)
    if model.case.stages[number].planets < 2:
        raise FlexgearError(f"{stage} has no planets that share a load")
    samples = samples_of_stage(model.case, motions, number, cycles, linear is not None)
    force = _forces(model, linear, samples.angles, progress, f"{stage}: load sharing")
    at = model.gear_meshes.of_stage(stage)
    names = tuple(model.gear_meshes.names[k] for k in at)
    per_cycle = float(samples.per_gear_mesh)
    turn = one_turn(
        motions[number], lead_speed(model.case, model.flow), int(per_cycle), SHOWN_CYCLES
    )
    shown = (  # where the error cycle is one turn, it has been looked at
        force[:, at]
        if np.array_equal(turn, samples.angles)
        else _forces(model, linear, turn, progress, f"{stage}: one turn")[:, at]
    )
    return labelled_dataset(
        "position",
        np.arange(len(turn)),
        {
            "input_angle": rated_rotations(model.system, turn),
            "gear_mesh_force": shown,
            "rated_gear_mesh_force": model.rated[at],
            **sharing_histories(shown, model.rated[at], names),
            **sharing_coefficients(force[:, at], names, {stage: per_cycle}),
            "cycle_maximum": cycle_maxima(force[:, at], per_cycle),
            "cycle_number": samples.gear_mesh,
        },
        result_attrs(
            model,
            stage=stage,
            cycles=float("inf") if every is None else every,
            cycles_looked_at=len(samples.gear_mesh),
            positions_per_gear_mesh=samples.per_gear_mesh,
            complete=int(every is not None and len(samples.gear_mesh) == every),
        ),
        result_labels(model),
        names,
    )


def shared_stages(model: Model) -> list[str]:
    """Stages with more than one planet that turn."""
    motions = stage_motions(model.case, model.flow)
    return [
        s.name
        for s, m in zip(model.case.stages, motions, strict=True)
        if s.planets > 1 and m.theta != 0
    ]


def _forces(
    model: Model,
    linear: LinearTrain | None,
    lead: Array,
    progress: Progress,
    progress_text: str,
) -> Array:
    """Gear-mesh forces (p, G) at rotations (p,) of the lead, N."""
    system = model.system
    parts: list[Array] = []
    for first in range(0, len(lead), CHUNK):
        input_angles = rated_rotations(system, lead[first : first + CHUNK])
        if linear is not None:
            parts.append(linear.forces(input_angles) @ model.gear_meshes.sign)
        else:

            def watch(share: float, done: int = first) -> None:
                progress(progress_text, (done + share * CHUNK) / max(len(lead), CHUNK))

            equilibrium = revolution(model.modal, input_angles, system.rated_torque, watch)
            parts.append(model.gear_meshes.forces(equilibrium.pair_load))
    progress(progress_text, 1.0)
    return without_rounding(np.concatenate(parts))


def sharing_attrs(data: xr.Dataset) -> dict[str, Any]:
    """What a dataset of load sharing says about how it was sampled, for summaries."""
    cycles = float(data.attrs["cycles"])
    return {
        "error_cycle_gear_meshes": int(cycles) if np.isfinite(cycles) else None,
        "gear_meshes_looked_at": int(data.attrs["cycles_looked_at"]),
        "complete": bool(data.attrs["complete"]),
    }
