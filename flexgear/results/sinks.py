"""Sinks for the samples of a long run: memory, statistics, or several sinks at once.

A sink gets the size of the run, then labelled chunks of samples, and finally the variables that are
known only at the end. Except for MemorySink, sinks store no chunks, so that the memory of a run is
independent of its duration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

TIME = "time"
SENSOR_TIME = "sensor_time"  # time of the samples of sensors
CLOCKS = (TIME, SENSOR_TIME)  # axes that grow during a run


@dataclass(frozen=True)
class RunSize:
    """Size of a run, known at its start. pattern: its dataset without samples; samples: number of
    samples; recorded: number of samples of sensors."""

    pattern: xr.Dataset
    samples: int
    recorded: int = 0

    @property
    def counts(self) -> dict[str, int]:
        """Number of samples along each axis of time."""
        return dict(zip(CLOCKS, (self.samples, self.recorded), strict=True))

    @property
    def size(self) -> int:
        """Bytes of all samples in a file, before compression."""
        return sum(
            count * sample_size(variable, clock)
            for clock, count in self.counts.items()
            for variable in histories(self.pattern, clock).values()
        )


class DatasetSink:
    """Base class of sinks, which ignores all samples."""

    def begin(self, run_size: RunSize) -> None:
        """Prepare for a run; called before the first sample."""

    def append(self, data: xr.Dataset) -> None:
        """Process the next samples."""

    def finish(self, last: xr.Dataset) -> None:
        """Add variables without time and attributes; called after the last sample."""


def with_last(data: xr.Dataset, last: xr.Dataset) -> xr.Dataset:
    """The dataset with the variables and attributes of ``last``, known after the last sample."""
    variables = {n: v for n, v in last.variables.items() if n in last.data_vars}
    return data.assign(variables).assign_coords(last.coords).assign_attrs(last.attrs)


def histories(data: xr.Dataset, clock: str = TIME) -> dict[str, xr.Variable]:
    """Variables over an axis of time, including the axis."""
    return {str(n): v for n, v in data.variables.items() if clock in v.dims}


def as_stored(data: xr.Dataset) -> xr.Dataset:
    """A dataset rounded to the precision of files: single precision if ``is_single``."""
    variables = {n: data.variables[n] for n in data.data_vars}
    return data.assign({n: v.astype("f4") for n, v in variables.items() if is_single(v)})


def sample_size(variable: xr.Variable, clock: str = TIME) -> int:
    """Bytes of one sample in a file."""
    values = int(np.prod([n for d, n in variable.sizes.items() if d != clock]))
    return values * (4 if is_single(variable) else variable.dtype.itemsize)


def is_single(variable: xr.Variable) -> bool:
    """Whether files store a variable in single precision.

    These are variables with more than one axis, except angles, which increase over revolutions, and
    signals of sensors, which have weak lines beside strong ones.
    """
    exact = variable.attrs.get("units") == "rad" or SENSOR_TIME in variable.dims
    return variable.ndim > 1 and variable.dtype == np.float64 and not exact


class MemorySink(DatasetSink):
    """A sink that stores all samples, or a part of each chunk, as one dataset in memory."""

    def __init__(self, part: Callable[[xr.Dataset], xr.Dataset] = lambda data: data) -> None:
        self._part = part
        self._chunks: list[xr.Dataset] = []
        self.data = xr.Dataset()

    def begin(self, run_size: RunSize) -> None:
        """Delete the samples of an earlier run."""
        self._chunks = [self._part(run_size.pattern)]

    def append(self, data: xr.Dataset) -> None:
        """Store the next samples."""
        self._chunks.append(self._part(data))

    def finish(self, last: xr.Dataset) -> None:
        """Join all samples into one dataset."""
        parts = [
            xr.concat(
                [chunk.drop_dims(other, errors="ignore") for chunk in self._chunks], clock,
                data_vars="minimal", coords="minimal", compat="override", join="override",
                combine_attrs="override",
            )
            for clock, other in (CLOCKS, CLOCKS[::-1])
            if clock in self._chunks[0].dims
        ]  # fmt: skip
        whole = xr.merge(parts, compat="override", combine_attrs="override")
        self._chunks = []
        self.data = with_last(whole, self._part(last))


def recorded(data: xr.Dataset) -> xr.Dataset:
    """The variables over the time of sensors."""
    return data.drop_dims(TIME, errors="ignore")[list(histories(data, SENSOR_TIME))]


class SinkGroup(DatasetSink):
    """A sink that passes a run to several sinks."""

    def __init__(self, sinks: Sequence[DatasetSink]) -> None:
        self._sinks = tuple(sinks)

    def begin(self, run_size: RunSize) -> None:
        """Begin every sink."""
        for sink in self._sinks:
            sink.begin(run_size)

    def append(self, data: xr.Dataset) -> None:
        """Pass the next samples to every sink."""
        for sink in self._sinks:
            sink.append(data)

    def finish(self, last: xr.Dataset) -> None:
        """Finish every sink."""
        for sink in self._sinks:
            sink.finish(last)


class Ranges(DatasetSink):
    """First, smallest, largest and mean value over time of the variables that ``watched`` computes
    from chunks; NaN are ignored."""

    def __init__(self, watched: Callable[[xr.Dataset], xr.Dataset]) -> None:
        self._watched = watched
        self._sum = self._count = self.first = self.least = self.largest = xr.Dataset()

    def append(self, data: xr.Dataset) -> None:
        """Add the next samples."""
        values = self._watched(data)
        if not values.sizes[TIME]:
            return
        ranges = Ranges(self._watched)
        ranges.first = values.isel({TIME: 0}, drop=True)
        ranges.least, ranges.largest = values.min(TIME), values.max(TIME)
        ranges._sum, ranges._count = values.sum(TIME, dtype=float), values.count(TIME)
        self.join(ranges)

    def join(self, later: Ranges) -> None:
        """Add the ranges of the samples that follow."""
        if not later.first.data_vars:
            return
        if not self.first.data_vars:
            self.first, self.least, self.largest = later.first, later.least, later.largest
            self._sum, self._count = later._sum, later._count
            return
        self.least = xr.apply_ufunc(np.fmin, self.least, later.least)
        self.largest = xr.apply_ufunc(np.fmax, self.largest, later.largest)
        self._sum, self._count = self._sum + later._sum, self._count + later._count

    @property
    def mean(self) -> xr.Dataset:
        """Mean values, NaN without any value."""
        return self._sum / self._count


PIECE_BYTES = 2**24  # of all variables over time


def pieces(data: xr.Dataset) -> Iterator[xr.Dataset]:
    """The samples of a transient in pieces of ``PIECE_BYTES``."""
    samples = data.sizes[TIME]
    total = sum(variable.nbytes for variable in histories(data).values())
    count = max(1, samples * PIECE_BYTES // max(total, 1))
    for first in range(0, samples, count):
        yield data.isel({TIME: slice(first, first + count)})


def ranges_of(data: xr.Dataset, watched: Callable[[xr.Dataset], xr.Dataset]) -> Ranges:
    """Ranges over a transient of the variables that ``watched`` computes from its pieces."""
    ranges = Ranges(watched)
    for piece in pieces(data):
        ranges.append(piece)
    return ranges


def between(data: xr.Dataset, begin: float, end: float | None = None) -> xr.Dataset:
    """The samples with begin ≤ time ≤ end, s, also on the axis of sensors."""
    return data.sel({clock: slice(begin, end) for clock in CLOCKS if clock in data.dims})
