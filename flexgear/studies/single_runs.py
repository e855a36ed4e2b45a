"""One analysis each, from a modal system to a labelled dataset."""

from __future__ import annotations

import json
import math

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.step_plan import FineWindow, Stepping
from flexgear.analysis.transient import Drive, Steps, Transient
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pace import stage_pace, timed_drops
from flexgear.model.drive import Drive as DriveParameters
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.results.fields import field_dataset
from flexgear.results.sinks import DatasetSink, Gathered
from flexgear.studies.long_run import LongRun, TimedRun
from flexgear.studies.stage_bodies import Progress, StageBodies, silent
from flexgear.studies.stage_dataset import equilibrium_of, transient_of
from flexgear.studies.stepping import adaptive_steps, step_attributes


def equilibria(
    case: FlexibleStage,
    modal: ModalSystem,
    angles: ArrayLike,
    torque: float | None = None,
    progress: Progress = silent,
) -> tuple[Equilibrium, xr.Dataset]:
    """Equilibria at carrier angles (rad) under a torque (N·m, rated unless given)."""
    rated = case.drive.rated_torque if torque is None else torque
    found = revolution(
        modal, np.asarray(angles, dtype=float), rated, lambda share: progress("equilibria", share)
    )
    return found, equilibrium_of(case, found)


def revolution_time(case: FlexibleStage) -> float:
    """Time of one revolution of the carrier at rated speed, s."""
    return 2 * math.pi / case.drive.rated_speed


def constant_drive(case: FlexibleStage) -> DriveParameters:
    """Rated torque for good."""
    return case.drive.model_copy(update={"kind": "constant", "torque": case.drive.rated_torque})


def simulate(
    case: FlexibleStage,
    modal: ModalSystem,
    *,
    drive: DriveParameters | None = None,
    duration: float | None = None,
    output_interval: float | None = None,
    energy: bool = False,
    progress: Progress = silent,
    label: str = "transient",
    sink: DatasetSink | None = None,
) -> TimedRun:
    """Transient under the case's drive (or another) for its duration or one revolution.

    While a jump of the torque settles the fine time step is used, unless the case asks for steps by
    a tolerance. sink: takes the samples as they come, so that the run's length does
    not count; ``data`` is then empty. InputError where the run would not come to an end.
    """
    drive = drive or case.drive
    stepping = stage_stepping(case, drive, duration, output_interval)
    said = json.dumps(stage_pace(case).summary)

    def labelled(found: Transient) -> xr.Dataset:
        return transient_of(case, found, energy)

    def last(steps: Steps) -> xr.Dataset:
        return xr.Dataset(attrs={**step_attributes(steps), "solver": said})

    memory = Gathered()
    run = LongRun(modal, Drive(drive.torque_at), stepping, energy, labelled, last, case.source)
    cost = run.into(sink or memory, lambda share: progress(label, share), tried=sink is not None)
    data = memory.data if sink is None else cost.empty
    return TimedRun(data, stepping.duration, cost.wall, cost.core)


def stage_stepping(
    case: FlexibleStage,
    drive: DriveParameters,
    duration: float | None = None,
    output_interval: float | None = None,
) -> Stepping:
    """Steps and samples of a run under a drive, for its duration or one revolution, s."""
    pace = stage_pace(case)
    span = duration or case.solver.duration or revolution_time(case)
    jumps = tuple(t for t in drive.change_times() if 0 <= t < span)
    windows = [FineWindow(t, min(t + pace.settling, span), pace.step_time_step) for t in jumps]
    if drive.kind in ("ramp", "csv"):  # a given series may be steep anywhere
        windows = [FineWindow(0.0, span, pace.step_time_step)]
    return Stepping(
        duration=span,
        time_step=pace.time_step,
        output_interval=min(output_interval or pace.output_interval, span),
        jumps=jumps,
        windows=tuple(windows),
        adaptive=adaptive_steps(case.solver, pace),
    )


def torque_step(
    case: FlexibleStage,
    modal: ModalSystem,
    torque: float,
    *,
    energy: bool = False,
    progress: Progress = silent,
    label: str = "torque drop",
    sink: DatasetSink | None = None,
) -> TimedRun:
    """Transient in which the torque drops to ``torque`` (N·m) as ``drive.steps`` says.

    Its samples are twice as close as in steady running.
    """
    start, duration, after = timed_drops(case).times
    return simulate(
        case,
        modal,
        drive=case.drive.drop(torque, start, duration),
        duration=start + duration + after,
        output_interval=0.5 * stage_pace(case).output_interval,
        energy=energy,
        progress=progress,
        label=label,
        sink=sink,
    )


def deformed(bodies: StageBodies, found: Equilibrium, position: int = 0) -> dict[str, xr.Dataset]:
    """Full displacement fields of ring and carrier at one equilibrium, where they bend."""
    recovery, system = Recovery(found), found.modal.system
    fields = {}
    for name, body in (("ring", bodies.ring), ("carrier", bodies.carrier)):
        if system.body(name).rigid:
            continue
        fields[name] = field_dataset(
            name,
            body.points,
            body.cells,
            body.recover(recovery.coordinates(name, position)),
            carrier_angle=float(found.carrier_angle[position]),
            input_torque=float(found.input_torque[position]),
        )
    return fields
