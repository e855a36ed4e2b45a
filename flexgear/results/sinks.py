"""Where the samples of a long run go: into memory, into figures, or several ways at once.

A sink is told what is coming, gets labelled chunks, and in the end what is known only then. It
keeps no chunk unless it says so: what a run needs in memory does not grow with its duration.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

TIME = "time"
SENSOR_TIME = "sensor_time"  # of a recorder with a clock of its own
CLOCKS = (TIME, SENSOR_TIME)  # axes that grow with a run


@dataclass(frozen=True)
class Coming:
    """Size of a run before it starts. pattern: its dataset without a sample; samples: number of
    samples; recorded: number of samples of sensors."""

    pattern: xr.Dataset
    samples: int
    recorded: int = 0

    @property
    def counts(self) -> dict[str, int]:
        """Samples along each axis that grows."""
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
    """Takes a run piece by piece."""

    def begin(self, coming: Coming) -> None:
        """Before the first sample."""

    def append(self, data: xr.Dataset) -> None:
        """Take the next samples."""

    def finish(self, last: xr.Dataset) -> None:
        """After the last sample: variables without time, attributes."""


def with_last(data: xr.Dataset, last: xr.Dataset) -> xr.Dataset:
    """A dataset completed by variables and attributes that are known only after the last sample."""
    variables = {n: v for n, v in last.variables.items() if n in last.data_vars}
    return data.assign(variables).assign_coords(last.coords).assign_attrs(last.attrs)


def histories(data: xr.Dataset, clock: str = TIME) -> dict[str, xr.Variable]:
    """Variables over time, or the time of sensors, and time itself."""
    return {str(n): v for n, v in data.variables.items() if clock in v.dims}


def as_stored(data: xr.Dataset) -> xr.Dataset:
    """A dataset rounded to the precision of a file: single precision where ``is_single``."""
    variables = {n: data.variables[n] for n in data.data_vars}
    return data.assign({n: v.astype("f4") for n, v in variables.items() if is_single(v)})


def sample_size(variable: xr.Variable, clock: str = TIME) -> int:
    """Bytes of one sample in a file."""
    values = int(np.prod([n for d, n in variable.sizes.items() if d != clock]))
    return values * (4 if is_single(variable) else variable.dtype.itemsize)


def is_single(variable: xr.Variable) -> bool:
    """Whether a file holds a variable in single precision: with more than one axis, except angles,
    which grow from turn to turn and separate orders, and signals of sensors, which have weak lines
    beside strong ones."""
    exact = variable.attrs.get("units") == "rad" or SENSOR_TIME in variable.dims
    return variable.ndim > 1 and variable.dtype == np.float64 and not exact


class Gathered(DatasetSink):
    """A sink that keeps everything in memory, or a part of it, as one dataset."""

    def __init__(self, part: Callable[[xr.Dataset], xr.Dataset] = lambda data: data) -> None:
        self._part = part
        self._chunks: list[xr.Dataset] = []
        self.data = xr.Dataset()

    def begin(self, coming: Coming) -> None:
        """Drop the samples of an earlier run."""
        self._chunks = [self._part(coming.pattern)]

    def append(self, data: xr.Dataset) -> None:
        """Keep the next samples."""
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
    """The part recorded by sensors, over their own time."""
    return data.drop_dims(TIME, errors="ignore")[list(histories(data, SENSOR_TIME))]


class Several(DatasetSink):
    """Passes a run to several sinks."""

    def __init__(self, sinks: Sequence[DatasetSink]) -> None:
        self._sinks = tuple(sinks)

    def begin(self, coming: Coming) -> None:
        """Begin every sink."""
        for sink in self._sinks:
            sink.begin(coming)

    def append(self, data: xr.Dataset) -> None:
        """Pass the next samples to all of them."""
        for sink in self._sinks:
            sink.append(data)

    def finish(self, last: xr.Dataset) -> None:
        """Finish all of them."""
        for sink in self._sinks:
            sink.finish(last)


class Ranges(DatasetSink):
    """First, least, largest and mean value over time of the variables that ``watched`` makes of a
    chunk. NaN do not count."""

    def __init__(self, watched: Callable[[xr.Dataset], xr.Dataset]) -> None:
        self._watched = watched
        self._sum = self._count = self.first = self.least = self.largest = xr.Dataset()

    def append(self, data: xr.Dataset) -> None:
        """Take the next samples into account."""
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
        """Mean values; NaN where there were none."""
        return self._sum / self._count


AT_ONCE = 2**24  # bytes of all variables over time that are read together


def pieces(data: xr.Dataset) -> Iterator[xr.Dataset]:
    """The samples of a transient in their order, as many at a time as ``AT_ONCE`` holds."""
    samples = data.sizes[TIME]
    whole = sum(variable.nbytes for variable in histories(data).values())
    count = max(1, samples * AT_ONCE // max(whole, 1))
    for first in range(0, samples, count):
        yield data.isel({TIME: slice(first, first + count)})


def ranges_of(data: xr.Dataset, watched: Callable[[xr.Dataset], xr.Dataset]) -> Ranges:
    """Ranges over a transient of the variables that ``watched`` makes of its pieces."""
    ranges = Ranges(watched)
    for piece in pieces(data):
        ranges.append(piece)
    return ranges


def between(data: xr.Dataset, begin: float, end: float | None = None) -> xr.Dataset:
    """Samples with begin ≤ time ≤ end, s, by the time of sensors, too."""

    def samples(clock: str) -> slice:
        time = data.variables[clock].to_numpy()
        stop = len(time) if end is None else np.searchsorted(time, end, side="right")
        return slice(int(np.searchsorted(time, begin)), int(stop))

    return data.isel({clock: samples(clock) for clock in CLOCKS if clock in data.dims})
