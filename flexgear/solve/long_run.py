"""Runs of any length: samples become labelled chunks that go to a sink as they come.

Nothing of a run that grows with its duration stays in memory, unless the sink keeps it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.kernels.step_arrays import State
from flexgear.analysis.start import packed_state, start_state, state_size
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
from flexgear.coupling.modal import ModalSystem
from flexgear.model.errors import InputError
from flexgear.results.dataset_file import WHOLE, dataset_file
from flexgear.results.labelled_dataset import coordinate, variable
from flexgear.results.sinks import Coming, DatasetSink

Samples = dict[str, NDArray[np.float64]]
BUFFER = 2**24  # bytes of samples that are labelled together
ENOUGH = 2.0  # s of a run that show how long the rest takes
LONGEST = 30 * 86400.0  # s that a run may take: nobody waits longer for one
FASTEST = 1e-6  # s that a step takes at least, of the smallest train
NO_STEPS = Steps(0, 0, {})


@dataclass(frozen=True)
class TimedRun:
    """A dataset, the simulated time, wall time and time of one core of its steps, s, without what
    the samples cost."""

    data: xr.Dataset
    simulated: float
    wall: float
    core: float

    @property
    def realtime_factor(self) -> float:
        """Simulated time over that of one core."""
        return self.simulated / max(self.core, 1e-9)


def shelved(place: Path | None, name: str, run: Callable[..., TimedRun]) -> TimedRun:
    """A run whose samples go to the file ``name``.nc of a folder; None: into memory."""
    if place is None:
        return run()
    path = place / f"{name}.nc"
    with dataset_file(path, in_memory=WHOLE) as sink:
        timed = run(sink=sink)
    return replace(timed, data=sink.dataset(path))


@dataclass(frozen=True)
class LongRun:
    """A run to be stepped through.

    labelled: a dataset of some samples; last: what is known only after the last step, variables
    without time and attributes; source: name of the case, for messages; carried: the state to start
    from, equilibrium if left out; recorded: samples of sensors.
    """

    modal: ModalSystem
    drive: Drive
    stepping: Stepping
    energy: bool
    labelled: Callable[[Transient], xr.Dataset]
    last: Callable[[Steps], xr.Dataset]
    source: str
    carried: State | None = None
    recorded: int = 0

    def into(self, sink: DatasetSink, progress: Callable[[float], None]) -> TimedRun:
        """Run it; the dataset has no samples. InputError where it would take more than a month."""
        refuse_endless(self.stepping, self.source)
        start, begin = self.carried, np.full(1, self.stepping.start)
        if start is None:
            start = start_state(self.modal, prescribed_values(self.modal, self.drive, begin)[0])
        pattern = self._pattern()
        sink.begin(Coming(pattern, self.stepping.samples, self.recorded))
        chunks = _Chunks(self.modal, self.labelled, sink.append)
        wall, core = time.perf_counter(), time.thread_time()

        def watched(share: float) -> None:
            spent = time.perf_counter() - wall
            if spent > ENOUGH and spent / share > LONGEST:
                raise _endless(
                    self.stepping, self.source, f"about {spent / share / 86400:.3g} days"
                )
            progress(share)

        steps = transient(
            self.modal, self.drive, self.stepping, start=start, sink=chunks,
            track_energy=self.energy, progress=watched,
        )  # fmt: skip
        wall, core = time.perf_counter() - wall, time.thread_time() - core
        wall, core = wall - chunks.wall, core - chunks.core
        chunks.flush()
        last = self._last(steps, packed_state(self.modal, start))
        sink.finish(last)
        empty = pattern.assign(last.data_vars).assign_coords(last.coords).assign_attrs(last.attrs)
        return TimedRun(empty, self.stepping.duration, wall, core)

    def _last(self, steps: Steps, end: Array) -> xr.Dataset:
        """What is known only after the last step, the state there (n,) included."""
        last = self.last(steps)
        end_time = self.stepping.start + self.stepping.duration
        entries = coordinate("state", "state", np.arange(1, len(end) + 1))
        last = last.assign(end_state=variable("end_state", end)).assign_coords(state=entries)
        return last.assign_attrs(end_time_s=end_time)

    def _pattern(self) -> xr.Dataset:
        """The dataset without a sample."""
        samples = by_name(np.zeros(0), empty_samples(self.modal, 0), np.zeros(0, dtype=bool))
        last = self._last(NO_STEPS, np.zeros(state_size(self.modal)))
        empty = self.labelled(collected(self.modal, samples, NO_STEPS))
        return empty.assign(last.data_vars).assign_coords(last.coords).assign_attrs(last.attrs)


def refuse_endless(stepping: Stepping, source: str) -> None:
    """InputError where a run has so many steps that no machine gets through them in a month."""
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
    """A sink of the time stepping that hands labelled chunks on.

    wall, core: what it took of the time of the steps, s.
    """

    def __init__(
        self,
        modal: ModalSystem,
        labelled: Callable[[Transient], xr.Dataset],
        take: Callable[[xr.Dataset], None],
    ) -> None:
        self._modal, self._labelled, self._take = modal, labelled, take
        self._held, self._size = Collector(), 0
        self.wall = self.core = 0.0

    def append(self, samples: Samples) -> None:
        """Some samples more."""
        self._held.append(samples)
        self._size += sum(values.nbytes for values in samples.values())
        if self._size >= BUFFER:
            wall, core = time.perf_counter(), time.thread_time()
            self.flush()
            self.wall += time.perf_counter() - wall
            self.core += time.thread_time() - core

    def flush(self) -> None:
        """Hand on what is held."""
        samples = self._held.arrays()
        self._held, self._size = Collector(), 0
        if samples:
            self._take(self._labelled(collected(self._modal, samples, NO_STEPS)))
