"""Transients of any length: samples are labelled in chunks and passed to a sink during the run.

Memory does not grow with the duration of a run, unless the sink stores all samples.

A run may continue another one of the same train. Bodies, springs and gear meshes must be the same;
machines, loads and options of the solver may differ. So a sweep over speed can go up and down in
steps, each of which starts from the last motion of the previous one.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.kernels.step_arrays import State
from flexgear.analysis.recording import Recorder
from flexgear.analysis.start import (
    CarriedState,
    packed_state,
    start_state,
    state_size,
    unpacked_state,
)
from flexgear.analysis.step_plan import Stepping
from flexgear.analysis.step_space import empty_samples
from flexgear.analysis.transient import (
    Collector,
    Drive,
    Steps,
    Transient,
    by_name,
    collected,
    prescribed_values,
    transient,
)
from flexgear.arrays import Array
from flexgear.compiled import compilation_times
from flexgear.coupling.machines import GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.model.content import content_hash
from flexgear.model.errors import InputError, echo
from flexgear.model.units import RPM
from flexgear.results.dataset_file import MAX_IN_MEMORY, dataset_file
from flexgear.results.labelled_dataset import coordinate, variable
from flexgear.results.load_sharing import DEFINITIONS, SharingCoefficients
from flexgear.results.report.wording import EQUILIBRIUM
from flexgear.results.settling import Settling, Window, cut
from flexgear.results.sinks import DatasetSink, RunSize, SinkGroup, with_last
from flexgear.solve.dataset import sensor_data, transient_data
from flexgear.solve.deformed import body_coordinates
from flexgear.solve.model import Model

Samples = dict[str, NDArray[np.float64]]
BUFFER = 2**24  # bytes of samples labelled together
ENOUGH = 2.0  # s of computing after which the time of the whole run is estimated
LONGEST = 30 * 86400.0  # s, longest computing time of a run that is accepted
FASTEST = 1e-6  # s, least computing time of a step, of the smallest train
NO_STEPS = Steps(0, 0, {})


@dataclass(frozen=True)
class TimedRun:
    """The dataset of a run, its simulated time, and the wall time and CPU time of its steps, s,
    without the processing of samples."""

    data: xr.Dataset
    simulated: float
    wall: float
    core: float

    @property
    def realtime_factor(self) -> float:
        """Simulated time over CPU time."""
        return self.simulated / max(self.core, 1e-9)


def shelved(folder: Path | None, name: str, run: Callable[..., TimedRun]) -> TimedRun:
    """Run ``run`` with its samples in the file ``name``.nc of a folder; None: in memory."""
    if folder is None:
        return run()
    path = folder / f"{name}.nc"
    with dataset_file(path, in_memory=MAX_IN_MEMORY) as sink:
        timed = run(sink=sink)
    return replace(timed, data=sink.dataset(path))


@dataclass(frozen=True)
class LongRun:
    """A transient before its execution.

    modal: the train in modes, with its machines; settling: the window for its figures, or the
    search for it; sharing: sink for load sharing coefficients; fields: flexible bodies whose
    coordinates are saved; carried: initial state, equilibrium if left out; begins: its words.
    """

    model: Model
    modal: ModalSystem
    drive: Drive
    stepping: Stepping
    settling: Settling | Window
    sharing: RunSharing
    torque_share: float = 1.0
    energy: bool = False
    fields: Sequence[str] = ()
    carried: State | None = None
    begins: str = EQUILIBRIUM

    @cached_property
    def _recorder(self) -> Recorder | None:
        """Recorder of the sensors, which keeps samples between chunks; None without sensors."""
        sensors = self.model.sensors
        rotations = len(self.model.system.input_rows)
        return None if sensors is None else sensors.recorder(self.stepping.finest, rotations)

    def into(self, sink: DatasetSink, progress: Callable[[float], None]) -> TimedRun:
        """Execute the run with its samples in ``sink``; the returned dataset has none. InputError
        where it would take more than a month."""
        stepping, source, recorder = self.stepping, self.model.case.source, self._recorder
        refuse_endless(stepping, source)
        start, begin = self.carried, np.full(1, stepping.start)
        if start is None:
            start = start_state(self.modal, prescribed_values(self.modal, self.drive, begin)[0])
        pattern = self._pattern()
        recorded = 0 if recorder is None else recorder.clock.count(stepping.sampled)
        searches = [self.settling] if isinstance(self.settling, Settling) else []
        sinks = SinkGroup([*searches, self.sharing, sink])
        sinks.begin(RunSize(pattern, stepping.samples, recorded))
        chunks = _Chunks(self.modal, self._labelled, sinks.append)
        wall, core = time.perf_counter(), time.thread_time()

        def report(share: float) -> None:
            spent = time.perf_counter() - wall
            if spent > ENOUGH and spent / share > LONGEST:
                raise _endless(stepping, source, f"about {spent / share / 86400:.3g} days")
            progress(share)

        with compilation_times() as compiled:
            steps = transient(
                self.modal, self.drive, stepping, start=start, sink=chunks,
                track_energy=self.energy, progress=report,
            )  # fmt: skip
        wall = time.perf_counter() - wall - chunks.wall
        core = time.thread_time() - core - chunks.core
        share = 1.0 - sum(compiled) / wall  # the rest is compilation, at the same load
        wall, core = share * wall, share * core
        chunks.flush()
        last = self._last(steps, packed_state(self.modal, start))
        sinks.finish(last)
        return TimedRun(with_last(pattern, last), stepping.duration, wall, core)

    def _labelled(self, run: Transient) -> xr.Dataset:
        """The dataset of a chunk of samples, with the sensor signals that they complete."""
        recorder, outputs = self._recorder, run.outputs()
        recorded = None if recorder is None else sensor_data(self.model, recorder, run)
        data = transient_data(self.model, outputs, torque_share=self.torque_share)
        if recorded is not None:
            data = data.merge(recorded, combine_attrs="no_conflicts")
        if self.fields:
            data = data.merge(body_coordinates(outputs, self.fields))
        balance = outputs.energy.items() if self.energy else ()
        energies = {f"energy_{name}": values for name, values in balance}
        return data.assign({name: variable(name, v, "time") for name, v in energies.items()})

    def _last(self, steps: Steps, end: Array) -> xr.Dataset:
        """Dataset of the variables known after the last step, with the final state ``end`` (n,)."""
        settling, pace = self.settling, self.model.pace
        window = settling.window() if isinstance(settling, Settling) else settling
        window = replace(window, begins=self.begins)
        sizes = ", ".join(f"{h:.4g} s: {count}" for h, count in sorted(steps.by_size.items()))
        entries = coordinate("state", "state", np.arange(1, len(end) + 1))
        last = self.sharing.coefficients(window.start)
        last = last.assign(end_state=variable("end_state", end)).assign_coords(state=entries)
        return last.assign_attrs(
            steps=steps.taken,
            steps_refused=steps.refused,
            step_sizes=sizes,
            solver=json.dumps(pace.summary),
            state_content=state_content(self.model),
            **window.attributes,
            end_time_s=self.stepping.start + self.stepping.duration,
        )

    def _pattern(self) -> xr.Dataset:
        """The dataset of the run without samples."""
        samples = by_name(np.zeros(0), empty_samples(self.modal, 0), np.zeros(0, dtype=bool))
        last = self._last(NO_STEPS, np.zeros(state_size(self.modal)))
        return with_last(self._labelled(collected(self.modal, samples, NO_STEPS)), last)


class RunSharing(DatasetSink):
    """A sink that computes load sharing coefficients from any window of a run to its end.

    interval: between samples, s; edges: start times of the windows, s; sense: −1 for reversed
    torques, else 1.
    """

    def __init__(self, model: Model, interval: float, edges: Array, sense: float = 1.0) -> None:
        per_cycle = {
            s.name: 1.0 / (s.gear_mesh_frequency * interval) if s.gear_mesh_frequency else 0.0
            for s in model.flow.stages
        }
        self._sharing = SharingCoefficients(model.gear_meshes.names, per_cycle)
        self._edges, self._sense = edges, sense

    def append(self, data: xr.Dataset) -> None:
        """Add a chunk of samples."""
        force = self._sense * data.variables["gear_mesh_force"].to_numpy()
        for window, piece in cut(data.variables["time"].to_numpy(), self._edges):
            self._sharing.append(force[piece], window)

    def coefficients(self, start: float) -> xr.Dataset:
        """Load sharing coefficients of the samples from time ``start`` on, s."""
        figures = self._sharing.coefficients(int(np.searchsorted(self._edges, start)))
        names = coordinate("definition", "definition", list(DEFINITIONS))
        return xr.Dataset({n: variable(n, v) for n, v in figures.items()}, {"definition": names})


def refuse_endless(stepping: Stepping, source: str) -> None:
    """Raise InputError for a run with more steps than any computer does in a month."""
    if not stepping.least_steps * FASTEST <= LONGEST:
        raise _endless(stepping, source, "more than a month on any machine")


def _endless(stepping: Stepping, source: str, time_taken: str) -> InputError:
    return InputError(
        source,
        "solver.time_step_s",
        f"{stepping.duration:g} s take {stepping.least_steps:.3g} steps, {time_taken}",
        "simulate a shorter time, or with longer steps",
    )


class _Chunks:
    """A sink of the time stepping that labels samples in chunks and passes these on.

    wall, core: wall time and CPU time of this during the steps, s.
    """

    def __init__(
        self,
        modal: ModalSystem,
        labelled: Callable[[Transient], xr.Dataset],
        pass_on: Callable[[xr.Dataset], None],
    ) -> None:
        self._modal, self._labelled, self._pass_on = modal, labelled, pass_on
        self._buffer, self._size = Collector(), 0
        self.wall = self.core = 0.0

    def append(self, samples: Samples) -> None:
        """Add samples; pass on those in the buffer if it is full."""
        self._buffer.append(samples)
        self._size += sum(values.nbytes for values in samples.values())
        if self._size >= BUFFER:
            wall, core = time.perf_counter(), time.thread_time()
            self.flush()
            self.wall += time.perf_counter() - wall
            self.core += time.thread_time() - core

    def flush(self) -> None:
        """Pass on all samples in the buffer."""
        samples = self._buffer.arrays()
        self._buffer, self._size = Collector(), 0
        if samples:
            self._pass_on(self._labelled(collected(self._modal, samples, NO_STEPS)))


_TRAIN_SECTIONS = (
    "kinematics", "gyroscopic", "gravity", "material", "stages", "joints", "held", "housing",
    "lubricant",
)  # fmt: skip
SAME_SPEED = 1e-6  # jump of a given speed at the start of a run, over rated speed, that is accepted


def state_content(model: Model) -> str:
    """SHA-256 of the data that must agree in two transients if one continues the other."""
    case = model.case
    ports = [[port.member, case.port_inertia(port.member)] for port in case.ports]
    return content_hash([case.content_hash(*_TRAIN_SECTIONS), model.variant, ports])


def end_of(earlier: xr.Dataset, source: str) -> float:
    """End time of a transient, s; InputError for a dataset that does not state it."""
    if "end_state" not in earlier or "end_time_s" not in earlier.attrs:
        remedy = "give what transient() returned, or the file of a transient of this version"
        raise InputError(source, "start", "is not the end of a transient", remedy)
    time = earlier.attrs["end_time_s"]
    if not isinstance(time, (int, float, np.number)) or not 0.0 <= time < math.inf:
        raise InputError(source, "start", f"ends at {echo(time)} s", "run the earlier part again")
    return float(time)


def carried_state(
    model: Model, modal: ModalSystem, drive: Drive, earlier: xr.Dataset
) -> CarriedState:
    """The final state of an ``earlier`` transient as the initial state of one under ``drive``.

    InputError for a transient of another train, or where a given speed would jump.
    """
    source = model.case.source
    time = end_of(earlier, source)
    values = earlier["end_state"].to_numpy()
    if values.ndim != 1 or not np.isfinite(values).all():
        problem = "ends in a state with values that are no numbers"
        raise InputError(source, "start", problem, "run the earlier part again")
    same = earlier.attrs.get("state_content") == state_content(model)
    if not same or len(values) != state_size(modal):
        problem = f"is the end of a run of another train, {earlier.attrs.get('case')}"
        remedy = "machines, loads and solver may differ, bodies, springs and gear meshes not"
        raise InputError(source, "start", problem, remedy)
    state = unpacked_state(modal, values)
    prescribed = prescribed_values(modal, drive, np.full(1, time))[0]
    speeds = modal.system.port_rows @ modal.modes @ state.velocity
    for p, machine in enumerate(modal.system.machines):
        rated = abs(model.flow.speed[modal.system.ports[p].name])
        if isinstance(machine, GivenSpeed) and abs(prescribed[p] - speeds[p]) > SAME_SPEED * rated:
            raise InputError(
                source, f"machine of {modal.system.ports[p].name}",
                f"holds {RPM * prescribed[p]:.6g} rpm at {time:g} s, where the earlier run ended "
                f"at {RPM * speeds[p]:.6g} rpm",
                'begin its history at that speed, with kind = "soft"',
            )  # fmt: skip
    return CarriedState(state, time)
