"""Transients of a case: machines and loads over time, steady running, drives and torque drops."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexgear.analysis.step_plan import Adaptive, FineWindow, Stepping
from flexgear.analysis.transient import Drive, run_in_memory
from flexgear.arrays import Array
from flexgear.coupling.machines import Brake
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pace import case_pace, timed_drops
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.machine import Machine, TorqueHistory, machine_of, machines_of
from flexgear.model.train import MemberLoad, load_histories
from flexgear.results.settling import Settling, Window, window_edges
from flexgear.results.sinks import DatasetSink, Gathered
from flexgear.results.time_figures import axis_distance
from flexgear.solve.angles import stage_motions
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.deformed import require_bending
from flexgear.solve.long_run import LongRun, RunSharing, TimedRun, carried_state
from flexgear.solve.model import Model
from flexgear.solve.sensors import clock_of

_STEADY = {
    "kind": "constant", "torque": None, "speed": None, "times": (), "torques": (), "speeds": (),
    "file": None,
}  # fmt: skip


@dataclass(frozen=True)
class Ends:
    """Histories at the ports (P,): each with its machine, its rated torque N m or speed rad/s, and
    by how much it is scaled. None: a torque in rated proportion to the first port's. loads: of the
    case, of which histories are prescribed, too."""

    machines: tuple[Machine | None, ...]
    rated: Array
    scale: Array
    loads: tuple[MemberLoad, ...] = ()

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times at which a torque or a set speed jumps, or a given speed has a kink, s."""
        times: set[float] = set()
        for machine in self.machines:
            if machine is not None and machine.law != "brake":
                times.update(machine.kinks() if machine.law == "speed" else machine.change_times())
        return tuple(sorted(times))

    @property
    def varies(self) -> bool:
        """Whether one of them changes continuously."""
        varies = any(machine is not None and machine.is_series for machine in self.machines)
        return varies or any(load.is_history for load in self.loads)

    @property
    def steep(self) -> bool:
        """Whether one of them may change fast anywhere."""
        steep = any(machine is not None and machine.is_steep for machine in self.machines)
        return steep or any(load.is_history for load in self.loads)

    def drive(self) -> Drive:
        """For the time stepping."""
        return Drive(self._prescribed, self._rates, lambda time: load_histories(self.loads, time))

    def _prescribed(self, time: Array) -> Array:
        return self._columns(time, lambda machine, rated: machine.at(time, rated))

    def _rates(self, time: Array) -> Array:
        return self._columns(time, lambda machine, rated: machine.rate_at(time))

    def _columns(self, time: Array, of: Callable[[Machine, float], Array]) -> Array:
        """(k, P) at times (k,)."""
        out = np.zeros((len(time), len(self.machines)))
        for p, machine in enumerate(self.machines):
            if machine is not None and machine.law != "brake":
                out[:, p] = self.scale[p] * of(machine, float(self.rated[p]))
        for p, machine in enumerate(self.machines):
            if machine is None:
                out[:, p] = out[:, 0] * self.rated[p] / self.rated[0]
        return out


def ends_of(
    case: Case, flow: PowerFlow, drive: TorqueHistory | None = None, share: float = 1.0
) -> Ends:
    """Histories of a case's ports, torques scaled by ``share``.

    drive: what the first input follows if it follows a torque; all other machines are then at their
    rated torque or speed for good.
    """
    machines = list(machines_of(case))
    if drive is not None:
        machines = [
            None if machine is None else machine.model_copy(update=_STEADY) for machine in machines
        ]
        if machines[0] is not None and machines[0].law == "torque":
            machines[0] = machine_of(drive)
    members = [port.member for port in case.ports]
    rated = np.array([flow.torque[member] for member in members])
    first = machines[0]
    if first is None or first.law != "torque" or rated[0] == 0.0:
        machines = [machine or Machine() for machine in machines]
    speeds = [machine is not None and machine.follows_speed for machine in machines]
    rated[speeds] = np.array([flow.speed[member] for member in members])[speeds]
    return Ends(tuple(machines), rated, np.where(speeds, 1.0, share), case.loads)


def require_brakes(model: Model) -> None:
    """InputError where a port that gives power at rated load is said to brake."""
    case = model.case
    for p, machine in enumerate(machines_of(case)):
        member = case.ports[p].member
        if machine is None or machine.law != "brake" or model.flow.power[member] <= 0:
            continue
        last = p == len(case.inputs)
        raise InputError(
            case.source,
            "output.member" if last else f"inputs[{p}].machine.law",
            f"{member} gives {model.flow.power[member]:.6g} W to the train, but in a transient "
            f"{'the output' if last else 'it'} brakes",
            "name the member that takes the power, and the others as inputs",
        )


def braked(modal: ModalSystem, share: float) -> ModalSystem:
    """The train with the torque of its brakes scaled."""
    machines = tuple(
        replace(machine, rated_torque=abs(share) * machine.rated_torque)
        if isinstance(machine, Brake)
        else machine
        for machine in modal.system.machines
    )
    return replace(modal, system=modal.system.with_(machines=machines))


SAMPLES_AT_REST = 100
MOST_STEPS = 400_000  # of a run whose duration nobody gave
RATED_DRIVE = TorqueHistory()  # rated torque for good, rated torques and speeds at all other ports


def usual_duration(case: Case, flow: PowerFlow) -> float:
    """Start-up and one turn of the slowest stage, s; cut short where that takes too many steps.

    A train at rest is looked at for as long again as it settles, and for some samples.
    """
    if case.solver.duration is not None:
        return case.solver.duration
    pace, turn = case_pace(case), _slowest_turn(case, flow)
    longest = max(MOST_STEPS * pace.time_step, 1.5 * pace.settling)
    return min(pace.start_up + turn, longest)


def cut_short(case: Case, flow: PowerFlow) -> list[str]:
    """A line where nobody gave the duration and the usual one is less than a turn."""
    span, turn = usual_duration(case, flow), _slowest_turn(case, flow)
    if case.solver.duration is not None or span >= turn:
        return []
    return [
        f"solver.duration_s is left out and cut to {span:.4g} s, {MOST_STEPS} steps, of the "
        f"{turn:.4g} s that a turn of the slowest stage takes; give it, or a longer time step"
    ]


def _slowest_turn(case: Case, flow: PowerFlow) -> float:
    pace, motions = case_pace(case), stage_motions(case, flow)
    at_rest = max(pace.settling, SAMPLES_AT_REST * pace.output_interval)
    return max((m.turn_period for m in motions if m.theta), default=at_rest)


def _settling(model: Model, stepping: Stepping, ends: Ends) -> Settling | Window:
    """Window over which figures of a run are taken, where the case states when it has settled; else
    the search for it in the samples."""
    start, begin, span = model.case.solver.settle, stepping.start, stepping.duration
    end = begin + span
    if start is not None:
        if span <= start:
            raise InputError(
                model.case.source,
                "solver.settle_s",
                f"{start:g} s of start-up leave nothing of a run of {span:g} s",
                "lower it, or run for longer",
            )
        return Window(begin + start, end, None, "as solver.settle_s says")
    if ends.jumps or ends.varies:
        return Window(begin, end, None, "the drive or a load changes")
    turning = [s.gear_mesh_frequency for s in model.flow.stages if s.gear_mesh_frequency]
    if not turning:
        return Window(begin, end, None, "nothing turns")
    return Settling(1.0 / min(turning), span, begin)


def stepping_of(
    case: Case,
    flow: PowerFlow,
    duration: float | None = None,
    *,
    drive: TorqueHistory | None = None,
    output_interval: float | None = None,
    start: float = 0.0,
) -> Stepping:
    """Steps and samples of a run from ``start`` s on, for ``usual_duration`` unless given; drive:
    see ``simulate``.

    Near a jump of a torque steps are fine until it has settled, in a given series everywhere,
    unless the case says how long a step is.
    """
    pace, ends = case_pace(case), ends_of(case, flow, drive)
    span = usual_duration(case, flow) if duration is None else duration
    end = start + span
    late = [t for t in ends.jumps if max(start - pace.settling, 0.0) <= t < end]
    windows = [FineWindow(t, min(t + pace.settling, end), pace.step_time_step) for t in late]
    if ends.steep and pace.series_time_step < pace.time_step:
        windows = [FineWindow(start, end, pace.series_time_step)]
    adaptive = None
    if case.solver.step_tolerance > 0.0:
        limits = pace.shortest_time_step, pace.longest_time_step
        adaptive = Adaptive(case.solver.step_tolerance, *limits)
    return Stepping(
        duration=span,
        time_step=pace.time_step,
        output_interval=min(output_interval or pace.output_interval, span),
        jumps=tuple(t for t in late if t >= start),
        windows=tuple(windows),
        adaptive=adaptive,
        start=start,
        between=clock_of(case, pace).step if case.sensors else math.inf,
    )


def simulate(
    model: Model,
    *,
    duration: float | None = None,
    drive: TorqueHistory | None = None,
    torque_share: float = 1.0,
    output_interval: float | None = None,
    energy: bool = False,
    fields: Sequence[str] = (),
    progress: Progress = silent,
    label: str = "transient",
    sink: DatasetSink | None = None,
    start: xr.Dataset | None = None,
) -> TimedRun:
    """Transient under the machines at the ports, torques times ``torque_share``, from equilibrium,
    or from the end of the transient ``start``, whose time goes on.

    duration: s, ``usual_duration`` if left out. drive: torque of the first input in the place of
    what the case says, all other machines then at rated torque or speed. The torque of brakes is
    scaled by ``torque_share`` too, so that the train keeps its rated speed. Load sharing
    coefficients are those of the settled window (``results.settling``). fields: bodies that bend,
    whose coordinates are kept at every sample, for ``deformed``. sink: takes the samples as they
    come, so that the run's length does not count; ``data`` is then empty. Raises InputError where a
    brake drives, nothing is left after the start-up or the run would not come to an end,
    FlexgearError where the time stepping runs away.
    """
    case = model.case
    require_brakes(model)
    for body in fields:
        require_bending(model, body)
    modal, ends = braked(model.modal, torque_share), ends_of(case, model.flow, drive, torque_share)
    carried = None if start is None else carried_state(model, modal, ends.drive(), start)
    stepping = stepping_of(
        case, model.flow, duration, drive=drive, output_interval=output_interval,
        start=0.0 if carried is None else carried.time,
    )  # fmt: skip
    edges = window_edges(stepping.duration, case.solver.settle, stepping.start)
    run = LongRun(
        model, modal, ends.drive(), stepping, _settling(model, stepping, ends),
        RunSharing(model, stepping.interval, edges, math.copysign(1.0, torque_share)),
        torque_share, energy, fields, None if carried is None else carried.state,
    )  # fmt: skip
    memory = Gathered()
    timed = run.into(sink or memory, lambda share: progress(label, share))
    return replace(timed, data=memory.data) if sink is None else timed


def torque_drop(
    model: Model,
    torque: float,
    *,
    energy: bool = False,
    progress: Progress = silent,
    label: str = "torque drop",
    sink: DatasetSink | None = None,
) -> TimedRun:
    """Transient in which the drive's torque drops to ``torque`` (N m) as ``drive.steps`` says.

    Its samples are twice as close as in steady running.
    """
    start, duration, after = timed_drops(model.case).times
    return simulate(
        model,
        drive=model.case.drive.drop(torque, start, duration, model.system.rated_torque),
        duration=start + duration + after,
        output_interval=0.5 * model.pace.output_interval,
        energy=energy,
        progress=progress,
        label=label,
        sink=sink,
    )


def compile_transient(model: Model, *, energy: bool = False) -> None:
    """A run of a few steps, so that compilation does not count as simulation."""
    step, ends = model.pace.time_step, ends_of(model.case, model.flow, RATED_DRIVE)
    for account in (False, True) if energy else (False,):
        stepping = Stepping(3 * step, step, step)
        run_in_memory(model.modal, ends.drive(), stepping, track_energy=account)


def train_histories(data: xr.Dataset) -> xr.Dataset:
    """Histories of which the command line prints the range."""
    names = ["input_speed", "port_torque", "inertia_torque", "gear_mesh_force"]
    return data[names].assign(axis_distance=axis_distance(data))
