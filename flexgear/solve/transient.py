"""Transients of a case: machines and loads over time, steady running, drives and torque drops."""

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from flexgear.analysis.kernels.step_arrays import State
from flexgear.analysis.start import CarriedState, start_state
from flexgear.analysis.step_plan import Adaptive, FineWindow, Stepping
from flexgear.analysis.transient import Drive, prescribed_values, run_in_memory
from flexgear.arrays import Array
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pace import case_pace, timed_drops
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.tooth_faults import faults_of_stage, lost_contact
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearWarning, InputError
from flexgear.model.faults import Fault
from flexgear.model.machine import Machine, TorqueHistory, machine_of, machines_of
from flexgear.model.stage_view import StageView
from flexgear.model.train import MemberLoad, load_histories
from flexgear.model.units import RPM
from flexgear.results.report.wording import CONTINUED, EQUILIBRIUM, STEADY
from flexgear.results.settling import Settling, Window, window_edges
from flexgear.results.sinks import DatasetSink, MemorySink
from flexgear.results.time_figures import axis_distance
from flexgear.solve.angles import stage_motions
from flexgear.solve.bodies import Progress, silent
from flexgear.solve.deformed import require_bending
from flexgear.solve.long_run import LongRun, RunSharing, TimedRun, carried_state
from flexgear.solve.model import Model
from flexgear.solve.sensors import clock_of
from flexgear.solve.start_vibration import steady_start

_STEADY = {
    "kind": "constant", "torque": None, "speed": None, "times": (), "torques": (), "speeds": (),
    "file": None,
}  # fmt: skip


@dataclass(frozen=True)
class PortHistories:
    """Values prescribed to the machines at the P ports over time.

    machines (P,): None for a torque in rated proportion to that of the first port; rated (P,):
    rated torque, N·m, or speed, rad/s; scale (P,): factors; loads: of the case, whose histories are
    prescribed as well."""

    machines: tuple[Machine | None, ...]
    rated: Array
    scale: Array
    loads: tuple[MemberLoad, ...] = ()

    @property
    def jumps(self) -> tuple[float, ...]:
        """Times at which a torque or set speed jumps, s."""
        machines = (m for m in self.machines if m is not None and m.law not in ("brake", "speed"))
        return tuple(sorted({time for m in machines for time in m.change_times()}))

    @property
    def kinks(self) -> tuple[float, ...]:
        """Times, s, at which a prescribed speed begins to rise or fall at another rate."""
        machines = (m for m in self.machines if m is not None and m.law == "speed")
        return tuple(sorted({time for m in machines for time in m.kinks()}))

    @property
    def varies(self) -> bool:
        """Whether a machine or a load changes continuously."""
        varies = any(machine is not None and machine.is_series for machine in self.machines)
        return varies or any(load.changes for load in self.loads)

    @property
    def steep(self) -> bool:
        """Whether a machine or a load may change fast at any time."""
        steep = any(machine is not None and machine.is_steep for machine in self.machines)
        return steep or any(load.changes for load in self.loads)

    def drive(self) -> Drive:
        """The histories as functions of time for the time stepping."""
        return Drive(
            lambda time: self._columns(time, lambda machine, rated: machine.at(time, rated)),
            lambda time: self._columns(time, lambda machine, _: machine.rate_at(time)),
            lambda time: load_histories(self.loads, time),
        )

    def _columns(self, time: Array, values: Callable[[Machine, float], Array]) -> Array:
        """Values (k, P) at times (k,), s; values: function of a machine and its rated value."""
        out = np.zeros((len(time), len(self.machines)))
        for p, machine in enumerate(self.machines):
            if machine is not None and machine.law != "brake":
                out[:, p] = self.scale[p] * values(machine, float(self.rated[p]))
        for p, machine in enumerate(self.machines):
            if machine is None:
                out[:, p] = out[:, 0] * self.rated[p] / self.rated[0]
        return out


def port_histories(
    case: Case, flow: PowerFlow, drive: TorqueHistory | None = None, share: float = 1.0
) -> PortHistories:
    """Histories of the ports of a case, with torques scaled by ``share``.

    drive: torque of the first input, if its machine has given torque; all other machines then have
    constant rated torque or speed.
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
    return PortHistories(tuple(machines), rated, np.where(speeds, 1.0, share), case.loads)


def require_brakes(model: Model) -> None:
    """Raise InputError for a brake at a port that supplies power at rated load."""
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
    """The train with the torques of its brakes scaled by |share|."""
    machines = tuple(
        replace(machine, rated_torque=abs(share) * machine.rated_torque)
        if isinstance(machine, Brake)
        else machine
        for machine in modal.system.machines
    )
    return replace(modal, system=modal.system.with_(machines=machines))


SAMPLES_AT_REST = 100  # least number of samples for a train at rest
MAX_STEPS = 400_000  # of a run without given duration
NEAR_RATED = 0.01  # difference from rated speed, over it, at which a run goes on without a warning
RATED_DRIVE = TorqueHistory()  # constant rated torque


def usual_duration(case: Case, flow: PowerFlow) -> float:
    """Duration of a transient, s: that of the case, or by default start-up and one turn of the
    slowest stage, limited by the number of steps.

    For a train at rest the turn is replaced by its settling time, or by 100 samples if longer.
    """
    if case.solver.duration is not None:
        return case.solver.duration
    pace = case_pace(case)
    longest = max(MAX_STEPS * pace.time_step, 1.5 * pace.settling)
    return min(pace.start_up + _slowest_turn(case, flow), longest)


def cut_short(case: Case, flow: PowerFlow) -> list[str]:
    """A line for a case without given duration in which the default one is less than a turn."""
    span, turn = usual_duration(case, flow), _slowest_turn(case, flow)
    if case.solver.duration is not None or span >= turn:
        return []
    return [
        f"solver.duration_s is left out and cut to {span:.4g} s, {MAX_STEPS} steps, of the "
        f"{turn:.4g} s that a turn of the slowest stage takes; give it, or a longer time step"
    ]


def _slowest_turn(case: Case, flow: PowerFlow) -> float:
    pace, motions = case_pace(case), stage_motions(case, flow)
    at_rest = max(pace.settling, SAMPLES_AT_REST * pace.output_interval)
    return max((m.turn_period for m in motions if m.theta), default=at_rest)


def _settling(model: Model, stepping: Stepping, histories: PortHistories) -> Settling | Window:
    """Window for the figures of a run, if the case states the settling time or nothing can settle;
    else the search for it in the samples. InputError for a settling time beyond the run."""
    start, begin, span = model.case.solver.settle, stepping.start, stepping.duration
    end = begin + span
    if start is not None:
        if span <= start:
            problem = f"{start:g} s of start-up leave nothing of a run of {span:g} s"
            remedy = "lower it, or run for longer"
            raise InputError(model.case.source, "solver.settle_s", problem, remedy)
        return Window(begin + start, end, None, "as solver.settle_s says")
    if reason := _never_steady(model, histories):
        return Window(begin, end, None, reason)
    return Settling(1.0 / min(_gear_mesh_frequencies(model)), span, begin)


def _never_steady(model: Model, histories: PortHistories) -> str:
    """Reason why a run has no steady state that it could reach; empty if it may have one."""
    if histories.jumps or histories.varies:
        return "the drive or a load changes"
    return "" if _gear_mesh_frequencies(model) else "nothing turns"


def _gear_mesh_frequencies(model: Model) -> list[float]:
    return [s.gear_mesh_frequency for s in model.flow.stages if s.gear_mesh_frequency]


def stepping_of(
    case: Case,
    flow: PowerFlow,
    duration: float | None = None,
    *,
    drive: TorqueHistory | None = None,
    output_interval: float | None = None,
    start: float = 0.0,
) -> Stepping:
    """Steps and samples of a run; duration: s, ``usual_duration`` if left out; drive: see
    ``simulate``; output_interval: between samples, s; start: time at its start, s.

    Steps are finer after a jump until the train has settled, and, unless the case states the step,
    with load, torque or speed series during the whole run.
    """
    pace, histories = case_pace(case), port_histories(case, flow, drive)
    span = usual_duration(case, flow) if duration is None else duration
    end = start + span
    jumps = [t for t in histories.jumps if max(start - pace.settling, 0.0) <= t < end]
    windows = [FineWindow(t, min(t + pace.settling, end), pace.step_time_step) for t in jumps]
    if histories.steep and pace.series_time_step < pace.time_step:
        windows = [FineWindow(start, end, pace.series_time_step)]
    adaptive = None
    if case.solver.step_tolerance > 0.0:
        limits = pace.shortest_time_step, pace.longest_time_step
        adaptive = Adaptive(case.solver.step_tolerance, *limits)
    return Stepping(
        duration=span,
        time_step=pace.time_step,
        output_interval=min(output_interval or pace.output_interval, span),
        jumps=tuple(sorted(t for t in {*jumps, *histories.kinks} if start <= t < end)),
        windows=tuple(windows),
        adaptive=adaptive,
        start=start,
        between=clock_of(case, pace).step if case.sensors else math.inf,
    )


def fault_warnings(model: Model, duration: float | None = None) -> list[str]:
    """Warnings about faulty teeth in a transient of a duration, s: of those that leave no tooth
    pair in contact, see ``lost_contact``, and of those that may not come into contact. None: the
    duration of the case, or the default one, which is long enough."""
    texts, span = list[str](), duration or model.case.solver.duration or math.inf
    for flow in model.flow.stages:
        view = model.case.view(flow.name)
        texts += lost_contact(view, flow.gear_mesh_forces)
        for _, fault in faults_of_stage(view) if flow.gear_mesh_frequency else ():
            every = _longest_pitch(view, fault) / flow.gear_mesh_frequency
            if fault.tooth is not None and span < every:
                texts.append(
                    f"{fault.words}: at rated speed the tooth is in contact every {every:.3g} s, "
                    f"so that a run of {span:.3g} s may not contain the fault"
                )
    return texts


def _longest_pitch(view: StageView, fault: Fault) -> float:
    """Largest number of gear-mesh cycles between two contacts of a tooth at rated speed: of a sun's
    or ring's with one planet and the next; of a planet's with sun and ring, where the fault is on
    both sides; else of a turn."""
    teeth, planets = getattr(view.stage, fault.gear).teeth, sorted(view.stage.planet_angles)
    if fault.gear not in ("sun", "ring"):
        return 0.5 * teeth if fault.gear == "planet" and fault.flank is None else float(teeth)
    gaps = np.diff([*planets, planets[0] + 2 * np.pi])
    return float(teeth * gaps.max() / (2 * np.pi))


def _warn_of_speed(model: Model, modal: ModalSystem, carried: CarriedState) -> None:
    """Warn where a run under constant torques does not start at rated speed."""
    system = modal.system
    speed = system.ports[0].row @ modal.modes @ carried.state.velocity
    rated = model.flow.speed[system.ports[0].name]
    follow = any(isinstance(machine, (GivenSpeed, Controller)) for machine in system.machines)
    if not follow and abs(speed - rated) > NEAR_RATED * abs(rated):
        warnings.warn(
            f"the run starts at {RPM * speed:.6g} rpm of {system.ports[0].name}, where the earlier "
            f"one ended, not at rated {RPM * rated:.6g} rpm: torques alone change it; for a step "
            'of speed give that member a machine with law = "speed"',
            FlexgearWarning,
            stacklevel=2,
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
    sink: DatasetSink | None = None,
    start: xr.Dataset | None = None,
) -> TimedRun:
    """A transient under the machines at the ports; arguments: see ``face.model.Model.transient``.

    duration: ``usual_duration`` if left out, with a start from the steady motion, to first order,
    where vibration from the equilibrium would not settle in it (``start_vibration``). torque_share
    also scales brakes, so that the train keeps its rated speed.
    sink: receives the samples during the run, ``data`` is then empty. Load sharing coefficients are
    those of the settled window (``results.settling``). InputError for a brake that would drive, a
    settling time beyond the run, or a run that would be too long; FlexgearError for a diverging
    motion.
    """
    case = model.case
    require_brakes(model)
    for body in fields:
        require_bending(model, body)
    modal = braked(model.modal, torque_share)
    histories = port_histories(case, model.flow, drive, torque_share)
    carried = None if start is None else carried_state(model, modal, histories.drive(), start)
    if carried is not None and not _never_steady(model, histories):
        _warn_of_speed(model, modal, carried)
    stepping = stepping_of(
        case, model.flow, duration, drive=drive, output_interval=output_interval,
        start=0.0 if carried is None else carried.time,
    )  # fmt: skip
    begins, state = (EQUILIBRIUM, None) if carried is None else (CONTINUED, carried.state)
    chosen = duration, case.solver.duration, case.solver.settle, carried
    if not _never_steady(model, histories) and all(value is None for value in chosen):
        state = _steady_state(model, modal, histories.drive(), stepping.duration, torque_share)
        begins = EQUILIBRIUM if state is None else STEADY
    edges = window_edges(stepping.duration, case.solver.settle, stepping.start)
    run = LongRun(
        model, modal, histories.drive(), stepping, _settling(model, stepping, histories),
        RunSharing(model, stepping.interval, edges, math.copysign(1.0, torque_share)),
        torque_share, energy, fields, state, begins,
    )  # fmt: skip
    memory = MemorySink()
    timed = run.into(sink or memory, lambda share: progress("transient", share))
    return replace(timed, data=memory.data) if sink is None else timed


def _steady_state(
    model: Model, modal: ModalSystem, drive: Drive, span: float, torque_share: float
) -> State | None:
    """State at time 0 in steady motion, to first order; None: equilibrium, as vibration from it
    settles within ``span``, s."""
    added = steady_start(model, span, torque_share)
    if added is None:
        return None
    state = start_state(modal, prescribed_values(modal, drive, np.zeros(1))[0])
    return state._replace(eta=state.eta + added[0], velocity=state.velocity + added[1])


def torque_drop(
    model: Model,
    torque: float,
    *,
    energy: bool = False,
    progress: Progress = silent,
    sink: DatasetSink | None = None,
) -> TimedRun:
    """A transient in which the torque of the drive drops to ``torque``, N·m, by ``drive.steps`` of
    the case, with half the sample interval of steady running."""
    start, duration, after = timed_drops(model.case).times
    return simulate(
        model,
        drive=model.case.drive.drop(torque, start, duration, model.system.rated_torque),
        duration=start + duration + after,
        output_interval=0.5 * model.pace.output_interval,
        energy=energy,
        progress=progress,
        sink=sink,
    )


def compile_transient(model: Model, *, energy: bool = False) -> None:
    """Run a few steps, so that measured times exclude compilation; energy: also with balance."""
    step, histories = model.pace.time_step, port_histories(model.case, model.flow, RATED_DRIVE)
    for track_energy in (False, True) if energy else (False,):
        stepping = Stepping(3 * step, step, step)
        run_in_memory(model.modal, histories.drive(), stepping, track_energy=track_energy)


def train_histories(data: xr.Dataset) -> xr.Dataset:
    """Histories whose ranges are printed by the command line."""
    names = ["input_speed", "port_torque", "inertia_torque", "gear_mesh_force"]
    return data[names].assign(axis_distance=axis_distance(data))
