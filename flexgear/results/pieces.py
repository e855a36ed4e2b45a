"""A dataset in a file taken piece by piece: nothing that grows with its length comes into
memory."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator

import xarray as xr

from flexgear.results.sinks import TIME, Ranges, histories

AT_ONCE = 2**24  # bytes of all variables over time that are read together


def pieces(data: xr.Dataset) -> Iterator[xr.Dataset]:
    """The samples of a transient in their order, as many at a time as ``AT_ONCE`` holds."""
    samples = data.sizes[TIME]
    whole = sum(variable.nbytes for variable in histories(data).values())
    count = max(1, samples * AT_ONCE // max(whole, 1))
    for first in range(0, samples, count):
        yield data.isel({TIME: slice(first, first + count)})


def ranges_of(data: xr.Dataset, watched: Callable[[xr.Dataset], xr.Dataset]) -> Ranges:
    """Ranges over a transient of what ``watched`` makes of its pieces."""
    ranges = Ranges(watched)
    for piece in pieces(data):
        ranges.append(piece)
    return ranges


def between(data: xr.Dataset, begin: float, end: float | None = None) -> xr.Dataset:
    """Samples with begin ≤ time ≤ end, s; the times are looked at one by one, not all."""
    samples, time = range(data.sizes[TIME]), data.variables[TIME]

    def at(sample: int) -> float:
        return float(time[sample])

    first = bisect_left(samples, begin, key=at)
    last = None if end is None else bisect_right(samples, end, key=at)
    return data.isel({TIME: slice(first, last)})
