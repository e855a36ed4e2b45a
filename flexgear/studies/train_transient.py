"""Transient of a train under constant torques, from equilibrium at rated speed."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.transient import Collector, Drive, Transient, collected, transient
from flexgear.coupling.modal import ModalSystem
from flexgear.model.errors import FlexgearError, InputError
from flexgear.results.train_dataset import variable
from flexgear.results.train_sharing import sharing_coefficients
from flexgear.studies.stage_bodies import Progress, silent
from flexgear.studies.stepping import adaptive_steps, step_attributes
from flexgear.studies.train_angles import stage_motions
from flexgear.studies.train_dataset import TrainContext, train_labels, transient_data

Array = NDArray[np.float64]
MOST_STEPS = 400_000  # of a run whose duration nobody gave
RUNAWAY = 1e3  # times the rated speed: no train gets there, a diverging solution does


@dataclass(frozen=True)
class TrainRun:
    """A dataset and what it cost: simulated time, wall time, time of one core, s."""

    data: xr.Dataset
    result: Transient
    simulated: float
    wall: float
    core: float

    @property
    def realtime_factor(self) -> float:
        """Simulated time over that of one core."""
        return self.simulated / max(self.core, 1e-9)


def usual_duration(context: TrainContext) -> float:
    """Settling and one turn of the slowest stage, s; cut short where that takes too many steps."""
    solver = context.train.solver
    if solver.duration is not None:
        return solver.duration
    motions = stage_motions(context.train, context.flow)
    turn = max(m.turn_period for m in motions if m.theta)
    return min(solver.settle + turn, max(MOST_STEPS * solver.time_step, 1.5 * solver.settle))


def simulate_train(
    context: TrainContext,
    *,
    duration: float | None = None,
    torque_share: float = 1.0,
    energy: bool = False,
    progress: Progress = silent,
    label: str = "transient",
) -> TrainRun:
    """Rated torques times ``torque_share`` for ``duration`` s (None: ``usual_duration``).

    The brake's torque is scaled likewise, so that the train keeps its rated speed. Load sharing
    coefficients are taken after ``solver.settle``. Raises InputError where the output drives or
    nothing is left after settling, FlexgearError where the time stepping runs away.
    """
    train, solver = context.train, context.train.solver
    _require_brake(context)
    span = usual_duration(context) if duration is None else duration
    if span <= solver.settle:
        raise InputError(
            train.source,
            "solver.settle_s",
            f"{solver.settle:g} s of start-up leave nothing of a run of {span:g} s",
            "lower it, or run for longer",
        )
    modal = _braked(context.modal, torque_share)
    torque = torque_share * modal.system.rated_torque
    sink, start, busy = Collector(), time.perf_counter(), time.thread_time()
    steps = transient(
        modal,
        Drive(lambda t: np.full(len(t), torque)),
        duration=span,
        time_step=solver.time_step,
        output_interval=min(solver.output_interval, span),
        adaptive=adaptive_steps(solver),
        sink=sink,
        track_energy=energy,
        progress=lambda share: progress(label, share),
    )
    wall, core = time.perf_counter() - start, time.thread_time() - busy
    result = collected(modal, sink.arrays(), steps)
    refuse_runaway(context, result)
    data = transient_data(
        context, result, settle_s=solver.settle, torque_share=torque_share, **step_attributes(steps)
    )
    data = data.assign(_coefficients(context, result, torque_share))
    data = data.assign_coords(definition=train_labels(context)["definition"])
    if energy:
        data = data.assign(
            {f"energy_{n}": variable(f"energy_{n}", v, "time") for n, v in result.energy.items()}
        )
    return TrainRun(data, result, span, wall, core)


def compile_transient(context: TrainContext) -> None:
    """A run of a few steps, so that compilation does not count as simulation."""
    system, step = context.system, context.train.solver.time_step
    torque = system.rated_torque
    transient(
        context.modal,
        Drive(lambda t: np.full(len(t), torque)),
        duration=3 * step,
        time_step=step,
        output_interval=step,
        sink=Collector(),
    )


def settled(data: xr.Dataset) -> xr.Dataset:
    """The samples of a transient after its start-up."""
    return data.isel(time=np.flatnonzero(data["time"].to_numpy() >= data.attrs["settle_s"]))


def refuse_runaway(context: TrainContext, found: Transient) -> None:
    """One clear line instead of a result in which the time stepping ran away."""
    rated = np.abs(context.system.rated_master_speeds)
    away = np.flatnonzero(~np.all(np.abs(found.masters[:, :, 1]) <= RUNAWAY * rated.max(), axis=1))
    if away.size:
        raise FlexgearError(
            f"the time stepping ran away at t = {found.time[away[0]]:.4f} s: lower "
            "solver.time_step_s, or raise the damping"
        )


def _require_brake(context: TrainContext) -> None:
    output = context.train.ports[-1].member
    if context.flow.power[output] > 0:
        raise InputError(
            context.train.source,
            "output.member",
            f"{output} gives {context.flow.power[output]:.6g} W to the train, but in a transient "
            "the output brakes",
            "name the member that takes the power, and the others as inputs",
        )


def _braked(modal: ModalSystem, share: float) -> ModalSystem:
    """The same train with the brake's torque scaled."""
    brake = modal.system.brake
    scaled = replace(brake, rated_torque=abs(share) * brake.rated_torque)
    return replace(modal, system=modal.system.with_(brake=scaled))


def _coefficients(context: TrainContext, result: Transient, share: float) -> dict[str, Any]:
    """Load sharing after settling."""
    after = result.time >= context.train.solver.settle
    force = context.gear_meshes.forces(result.pair_load[after]) * (math.copysign(1.0, share))
    interval = float(np.median(np.diff(result.time))) if len(result.time) > 1 else math.inf
    per_cycle = {
        s.name: 1.0 / (s.gear_mesh_frequency * interval) if s.gear_mesh_frequency else 0.0
        for s in context.flow.stages
    }
    found = sharing_coefficients(force, context.gear_meshes.names, per_cycle)
    return {name: variable(name, value) for name, value in found.items()}
