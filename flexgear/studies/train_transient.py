"""Transient of a train under constant torques, from equilibrium at rated speed."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.step_plan import Stepping
from flexgear.analysis.transient import Collector, Drive, Steps, Transient, transient
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pace import train_pace
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.results.pieces import between
from flexgear.results.sinks import Coming, DatasetSink, Gathered, Several
from flexgear.results.train_dataset import variable
from flexgear.results.train_sharing import SharingCoefficients
from flexgear.results.train_summary import axis_distance
from flexgear.studies.long_run import LongRun, TimedRun
from flexgear.studies.stage_bodies import Progress, silent
from flexgear.studies.stepping import adaptive_steps, step_attributes
from flexgear.studies.train_angles import stage_motions
from flexgear.studies.train_dataset import TrainContext, train_labels, transient_data

Array = NDArray[np.float64]
SAMPLES_AT_REST = 100
MOST_STEPS = 400_000  # of a run whose duration nobody gave


def usual_duration(train: Case, flow: PowerFlow) -> float:
    """Settling and one turn of the slowest stage, s; cut short where that takes too many steps.

    A train at rest is looked at for as long again as it settles, and for some samples.
    """
    if train.solver.duration is not None:
        return train.solver.duration
    pace, turn = train_pace(train), _slowest_turn(train, flow)
    return min(pace.settling + turn, max(MOST_STEPS * pace.time_step, 1.5 * pace.settling))


def cut_short(train: Case, flow: PowerFlow) -> list[str]:
    """A line where nobody gave the duration and the usual one is less than a turn."""
    span, turn = usual_duration(train, flow), _slowest_turn(train, flow)
    if train.solver.duration is not None or span >= turn:
        return []
    return [
        f"solver.duration_s is left out and cut to {span:.4g} s, {MOST_STEPS} steps, of the "
        f"{turn:.4g} s that a turn of the slowest stage takes; give it, or a longer time step"
    ]


def _slowest_turn(train: Case, flow: PowerFlow) -> float:
    pace, motions = train_pace(train), stage_motions(train, flow)
    at_rest = max(pace.settling, SAMPLES_AT_REST * pace.output_interval)
    return max((m.turn_period for m in motions if m.theta), default=at_rest)


def settling(context: TrainContext, span: float) -> float:
    """Start-up left out of load sharing, s: as given, else at most half the run."""
    given, derived = context.train.solver.settle, context.pace.settling
    return min(derived, span / 2) if given is None else given


def train_stepping(train: Case, flow: PowerFlow, duration: float | None = None) -> Stepping:
    """Steps and samples of a run, for ``usual_duration`` unless given, s."""
    pace = train_pace(train)
    span = usual_duration(train, flow) if duration is None else duration
    return Stepping(
        duration=span,
        time_step=pace.time_step,
        output_interval=min(pace.output_interval, span),
        adaptive=adaptive_steps(train.solver, pace),
    )


def simulate_train(
    context: TrainContext,
    *,
    duration: float | None = None,
    torque_share: float = 1.0,
    energy: bool = False,
    progress: Progress = silent,
    label: str = "transient",
    sink: DatasetSink | None = None,
) -> TimedRun:
    """Rated torques times ``torque_share`` for ``duration`` s (None: ``usual_duration``).

    The brake's torque is scaled likewise, so that the train keeps its rated speed. Load sharing
    coefficients are taken after ``settling``. sink: takes the samples as they come, so that
    the run's length does not count; ``data`` is then empty. Raises InputError where the output
    drives, nothing is left after settling or the run would not come to an end, FlexgearError where
    the time stepping runs away.
    """
    train = context.train
    _require_brake(context)
    stepping = train_stepping(train, context.flow, duration)
    span = stepping.duration
    settle = settling(context, span)
    if span <= settle:
        raise InputError(
            train.source,
            "solver.settle_s",
            f"{settle:g} s of start-up leave nothing of a run of {span:g} s",
            "lower it, or run for longer",
        )
    modal = _braked(context.modal, torque_share)
    torque = torque_share * modal.system.rated_torque
    sharing = _Sharing(context, stepping.interval, torque_share)

    def labelled(found: Transient) -> xr.Dataset:
        attrs = {"settle_s": settle, "torque_share": torque_share}
        data = transient_data(context, found, **attrs)
        if not energy:
            return data
        account = {f"energy_{name}": values for name, values in found.energy.items()}
        return data.assign({name: variable(name, v, "time") for name, v in account.items()})

    def last(steps: Steps) -> xr.Dataset:
        said = {**step_attributes(steps), "solver": json.dumps(context.pace.summary)}
        return sharing.coefficients().assign_attrs(said)

    memory, drive = Gathered(), Drive(lambda t: np.full(len(t), torque))
    run = LongRun(modal, drive, stepping, energy, labelled, last, train.source)
    both = Several([sharing, sink or memory])
    cost = run.into(both, lambda share: progress(label, share), tried=sink is not None)
    return TimedRun(memory.data if sink is None else cost.empty, span, cost.wall, cost.core)


class _Sharing:
    """A sink that finds load sharing coefficients after settling."""

    def __init__(self, context: TrainContext, interval: float, share: float) -> None:
        per_cycle = {
            s.name: 1.0 / (s.gear_mesh_frequency * interval) if s.gear_mesh_frequency else 0.0
            for s in context.flow.stages
        }
        self._found = SharingCoefficients(context.gear_meshes.names, per_cycle)
        self._sense = math.copysign(1.0, share)
        self._definitions = train_labels(context)["definition"]

    def begin(self, coming: Coming) -> None:
        """Nothing is there yet."""

    def append(self, data: xr.Dataset) -> None:
        """Look at some samples more."""
        self._found.append(self._sense * settled(data)["gear_mesh_force"].to_numpy())

    def finish(self, last: xr.Dataset) -> None:
        """Nothing is left to do."""

    def coefficients(self) -> xr.Dataset:
        """What was found up to now."""
        found = {name: variable(name, value) for name, value in self._found.found().items()}
        return xr.Dataset(found, {"definition": self._definitions})


def compile_transient(context: TrainContext) -> None:
    """A run of a few steps, so that compilation does not count as simulation."""
    system, step = context.system, context.pace.time_step
    torque = system.rated_torque
    transient(
        context.modal,
        Drive(lambda t: np.full(len(t), torque)),
        duration=3 * step,
        time_step=step,
        output_interval=step,
        sink=Collector(),
    )


def settled(data: xr.Dataset, most: int | None = None) -> xr.Dataset:
    """The samples of a transient after its start-up; at most so many, the last ones."""
    rest = between(data, data.attrs["settle_s"])
    return rest if most is None else rest.isel(time=slice(-most, None))


def train_histories(data: xr.Dataset) -> xr.Dataset:
    """What of a transient the command line gives the range of, after its start-up."""
    rest = settled(data)
    names = ["master_speed", "port_torque", "gear_mesh_force"]
    return rest[names].assign(axis_distance=axis_distance(rest))


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
