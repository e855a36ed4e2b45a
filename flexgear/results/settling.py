"""When a transient has settled, found from its motion as the samples come.

What repeats with the gear mesh leaves no difference over one of its periods P; vibration that is
left from the start does, and dies out:

    D_w = max over window w of |x(t) − x(t − P)|,   x: gear-mesh forces, places of bodies

The run is cut into equal windows. It has settled at the first window from which on D exceeds its
largest value in the second half of the run by no more than a share of the peak-to-peak of x there.
It has not where D rises from quarter to quarter by more than that share to the end, or still falls
by twice as much from the third to the last. Runout and weight change x once a turn, but over one
period of the gear mesh hardly, so that they do not pass for start-up. Nothing that grows with the
run is kept: D, least and largest x of every window, and the samples of one period.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.results.sinks import SENSOR_TIME, TIME, Coming, DatasetSink, Ranges, between

SHARE = 0.05  # of the peak-to-peak, by which figures may still differ from settled ones
WINDOWS = 32  # of a run
FEWEST = 8  # gear-mesh periods that tell whether a run has settled
NEGLIGIBLE = 0.1  # of the largest peak-to-peak of its kind: smaller ones count as this
_WORDS = {True: "yes", False: "no", None: "not known"}
STILL = 1e-3  # of the largest value of its kind, the same


@dataclass(frozen=True)
class Window:
    """The part of a run that figures are taken from: start and end, s; settled: None where the run
    is too short to tell or its drive changes; sentence: reason, in words."""

    start: float
    end: float
    settled: bool | None
    sentence: str

    @property
    def attributes(self) -> dict[str, Any]:
        """The window as attributes of a dataset."""
        return {"settle_s": self.start, "settled": _WORDS[self.settled], "settling": self.sentence}

    @property
    def figures(self) -> dict[str, Any]:
        """The window as figures of a summary."""
        ends = [self.start, self.end]
        return {"window_s": ends, "settled": self.settled, "settling": self.sentence}


def window_of(data: xr.Dataset, end: float | None = None) -> Window:
    """The window of a transient that its attributes name; of earlier versions without how. end: of
    a run without its samples, s."""
    word = data.attrs.get("settled", "not known")
    settled = next((value for value, text in _WORDS.items() if text == word), None)
    end = float(data.variables[TIME][-1]) if end is None else end
    return Window(float(data.attrs["settle_s"]), end, settled, data.attrs.get("settling", ""))


def window_edges(span: float, start: float | None = None, begin: float = 0.0) -> Array:
    """Times (w,) s at which the windows of a run of ``span`` s from ``begin`` s on begin. start: of
    the window that figures are taken from, if the case states it: it is then one of two."""
    if start is not None:
        return begin + np.unique(np.array([0.0, start]))
    return np.asarray(begin + np.arange(WINDOWS) * (span / WINDOWS), dtype=np.float64)


def cut(time: Array, edges: Array) -> Iterator[tuple[int, slice]]:
    """The pieces of a chunk of samples at times (t,), each with the number of its window."""
    number = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, None)
    for k in np.unique(number):
        first, last = np.searchsorted(number, [k, k + 1])
        yield int(k), slice(int(first), int(last))


def settled(data: xr.Dataset, most: int | None = None) -> xr.Dataset:
    """The samples of a transient in its settled window; at most ``most``, the last ones."""
    rest = between(data, window_of(data).start)
    return rest if most is None else rest.isel({TIME: slice(-most, None)})


class WindowedRanges(DatasetSink):
    """A sink: ranges of what ``watched`` makes of the samples, from any window on."""

    def __init__(self, watched: Callable[[xr.Dataset], xr.Dataset], edges: Array) -> None:
        self._watched, self._edges = watched, edges
        self._parts: dict[int, Ranges] = {}

    def append(self, data: xr.Dataset) -> None:
        """Look at some samples more."""
        for k, piece in cut(data.variables[TIME].to_numpy(), self._edges):
            self._parts.setdefault(k, Ranges(self._watched)).append(data.isel({TIME: piece}))

    def since(self, start: float) -> Ranges:
        """Ranges of the windows that begin at ``start`` s or later, which is one of the edges."""
        first = int(np.searchsorted(self._edges, start))
        ranges = Ranges(self._watched)
        for k in sorted(self._parts):
            if k >= first:
                ranges.join(self._parts[k])
        return ranges


class Settling(DatasetSink):
    """A sink that finds the settled window of a run of ``span`` s from ``begin`` s on.

    period: of the slowest gear mesh, s.
    """

    def __init__(self, period: float, span: float, begin: float = 0.0) -> None:
        self._period, self._span, self._begin = period, span, begin
        self._time, self._x = np.zeros(0), np.zeros((0, 0))  # of the last period
        self._sizes: list[int] = []
        # of every window the largest of D, x and −x
        self._largest = np.full((WINDOWS, 3, 0), -np.inf)

    def append(self, data: xr.Dataset) -> None:
        """Look at some samples more."""
        time, x = data[TIME].to_numpy(), self._watched(data)
        if not len(time):
            return
        count = len(self._time)
        if count:
            time, x = np.concatenate([self._time, time]), np.concatenate([self._x, x])
        held = max(int(np.searchsorted(time, time[-1] - self._period)) - 1, 0)
        self._time, self._x = time[held:], x[held:]
        first = max(count, int(np.searchsorted(time, time[0] + self._period)))
        if first < len(time):
            earlier = _interpolated(time[first:] - self._period, time, x)
            self._count(time[first:], x[first:], np.abs(x[first:] - earlier))

    def window(self) -> Window:
        """The window that figures are to be taken from; all of the run where it has not settled."""
        end, periods = self._begin + self._span, self._span / self._period
        difference = self._largest[:, 0]
        whole = Window(self._begin, end, None, "")
        if periods < FEWEST or np.isinf(difference[WINDOWS // 4 :]).any():
            return replace(
                whole,
                sentence=f"{periods:.3g} periods of the slowest gear mesh are too "
                "few to tell whether it has settled",
            )
        limit = SHARE * self._peak_to_peak(slice(WINDOWS // 2, None))
        quarters = difference.reshape(4, WINDOWS // 4, difference.shape[1]).max(axis=1)
        rise = np.diff(quarters[1:], axis=0)
        grows = (rise > 0).all(axis=0) & (rise.sum(axis=0) > limit)
        decays = (rise < 0).all(axis=0) & (rise[1] < -2.0 * limit)
        if (grows | decays).any():
            how = "grows until" if grows.any() else "from the start is still there at"
            sentence = f"vibration {how} the end of the run"
            return replace(whole, settled=False, sentence=sentence)
        above = (difference > quarters[2:].max(axis=0) + limit).any(axis=1)
        first = int(np.flatnonzero(above)[-1]) + 1 if above.any() else 0
        return Window(
            float(window_edges(self._span, begin=self._begin)[first]),
            end,
            True,
            f"from there on vibration repeats from one gear-mesh period to the next within "
            f"{100 * SHARE:g} % of its peak-to-peak",
        )

    def _watched(self, data: xr.Dataset) -> Array:
        """Gear-mesh forces and places of bodies across their axes, (t, n)."""
        places = data["body_displacement"].sel(dof=["ux", "uy"]).to_numpy()
        kinds = [data["gear_mesh_force"].to_numpy(), places.reshape(len(places), -1)]
        self._sizes = [kind.shape[1] for kind in kinds]
        return np.concatenate(kinds, axis=1)

    def _count(self, time: Array, x: Array, difference: Array) -> None:
        if not self._largest.shape[2]:
            self._largest = np.full((WINDOWS, 3, x.shape[1]), -np.inf)
        since = time - self._begin
        number = np.minimum((since * (WINDOWS / self._span)).astype(int), WINDOWS - 1)
        at, starts = np.unique(number, return_index=True)
        values = np.stack([difference, x, -x], axis=1)
        most = np.maximum.reduceat(values, starts, axis=0)
        self._largest[at] = np.maximum(self._largest[at], most)

    def _peak_to_peak(self, windows: slice) -> Array:
        """Peak-to-peak value of every x, at least a share of the largest of its kind and of its
        magnitude."""
        high, low = self._largest[windows, 1].max(axis=0), -self._largest[windows, 2].max(axis=0)
        range_ = high - low
        for end, size in zip(np.cumsum(self._sizes), self._sizes, strict=True):
            kind = slice(end - size, end)
            if size:
                least = NEGLIGIBLE * range_[kind].max()
                threshold = STILL * np.maximum(np.abs(high[kind]), np.abs(low[kind])).max()
                range_[kind] = np.maximum(range_[kind], max(least, threshold))
        return range_


def _interpolated(at: Array, time: Array, x: Array) -> Array:
    """x (t, n) at other times, on straight lines."""
    after = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    weight = ((at - time[after - 1]) / (time[after] - time[after - 1]))[:, None]
    return np.asarray((1.0 - weight) * x[after - 1] + weight * x[after])


class SensorRanges(DatasetSink):
    """A sink: ranges of the signals of sensors, from any window of a run on."""

    def __init__(self, edges: Array) -> None:
        self._ranges = WindowedRanges(lambda x: x.assign(square=x["sensor_signal"] ** 2), edges)
        self._units: dict[str, str] = {}

    def begin(self, coming: Coming) -> None:
        """Begin anew."""
        self._ranges.begin(coming)
        if "sensor" in coming.pattern:
            names, units = (coming.pattern[n].to_numpy() for n in ("sensor", "sensor_unit"))
            self._units = dict(zip(map(str, names), map(str, units), strict=True))

    def append(self, data: xr.Dataset) -> None:
        """Look at some samples more."""
        if data.sizes.get(SENSOR_TIME):
            of_sensors = data[["sensor_signal"]].drop_vars(TIME, errors="ignore")
            self._ranges.append(of_sensors.rename({SENSOR_TIME: TIME}))

    def figures(self, start: float) -> dict[str, dict[str, Any]]:
        """By sensor, of the windows from ``start`` s on; empty without any sample."""
        rest = self._ranges.since(start)
        if not rest.first.data_vars:
            return {}
        mean, square = (rest.mean[n].to_numpy() for n in ("sensor_signal", "square"))
        least, largest = (r["sensor_signal"].to_numpy() for r in (rest.least, rest.largest))
        rms = np.sqrt(np.maximum(square - mean**2, 0.0))
        return {
            name: {
                "unit": unit,
                "mean": float(mean[k]),
                "rms_about_mean": float(rms[k]),
                "min": float(least[k]),
                "max": float(largest[k]),
            }
            for k, (name, unit) in enumerate(self._units.items())
        }
