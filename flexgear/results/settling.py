"""Detection of the time at which a transient has settled, from its samples in chunks.

Motion that is periodic with the gear mesh has no difference over its period P; vibration from the
start has one, which decays:

    D_w = max over window w of |x(t) − x(t − P)|,   x: gear-mesh forces, positions of bodies

The run is divided into equal windows. It has settled at the first window from which D exceeds its
largest value in the second half of the run by at most SHARE of the peak-to-peak of x there. It has
not settled if D increases from quarter to quarter by more than that share, to above the second
quarter in every window of the last, or still decreases by twice as much, from above the last
quarter in every window of the third. For this D is the distance of x(t) from the range of
NEIGHBOURS samples about t − P: where tooth pairs take up load at once, the difference from
interpolated samples depends on their place about the jump, which varies from period to period and
may drift over the run; other gear meshes of a train have other periods. Runout and weight change x
once per revolution, which is a small change over one gear-mesh period. Memory is independent of the
duration: D, smallest and largest x of every window, and the samples of one period are stored.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.results.orders import SINGLE
from flexgear.results.report.wording import EQUILIBRIUM
from flexgear.results.run_orders import motion_rounding
from flexgear.results.sinks import SENSOR_TIME, TIME, DatasetSink, Ranges, RunSize, between

SHARE = 0.05  # of the peak-to-peak, allowed difference from settled motion
WINDOWS = 32  # of a run
NEIGHBOURS = (-2, -1, 0, 1)  # samples about a time between samples −1 and 0
MIN_PERIODS = 8  # of the gear mesh, for a decision
MIN_RANGE = 0.1  # lower limit of a peak-to-peak over the largest one of its kind
MIN_RELATIVE = 1e-3  # lower limit of a peak-to-peak over the largest value of its kind
_WORDS = {True: "yes", False: "no", None: "not known"}


@dataclass(frozen=True)
class Window:
    """The part of a run that is evaluated: start and end, s; settled: None if the run is too short
    or its drive changes; sentence: the reason; begins: motion in which the run begins."""

    start: float
    end: float
    settled: bool | None
    sentence: str
    begins: str = EQUILIBRIUM

    @property
    def attributes(self) -> dict[str, Any]:
        """The window as attributes of a dataset."""
        times = {"settle_s": self.start, "settled": _WORDS[self.settled]}
        return {**times, "settling": self.sentence, "begins": self.begins}

    @property
    def figures(self) -> dict[str, Any]:
        """The window as figures of a summary."""
        times = {"window_s": [self.start, self.end], "settled": self.settled}
        return {**times, "settling": self.sentence, "begins": self.begins}


def window_of(data: xr.Dataset, end: float | None = None) -> Window:
    """The window in the attributes of a transient. end: end of the run, s, default: last sample."""
    word = data.attrs.get("settled", "not known")
    settled = next((value for value, text in _WORDS.items() if text == word), None)
    end = float(data.variables[TIME][-1]) if end is None else end
    reason, begins = (data.attrs.get(name, "") for name in ("settling", "begins"))
    return Window(float(data.attrs["settle_s"]), end, settled, reason, begins)


def window_edges(span: float, start: float | None = None, begin: float = 0.0) -> Array:
    """Start times (w,) of the windows of a run of ``span`` s from ``begin``, s. start: start of the
    evaluated window, if the case states it; there are then two windows."""
    if start is not None:
        return begin + np.unique(np.array([0.0, start]))
    return np.asarray(begin + np.arange(WINDOWS) * (span / WINDOWS), dtype=np.float64)


def cut(time: Array, edges: Array) -> Iterator[tuple[int, slice]]:
    """Number of the window and slice of samples for each part of a chunk at times (t,)."""
    number = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, None)
    for k in np.unique(number):
        first, last = np.searchsorted(number, [k, k + 1])
        yield int(k), slice(int(first), int(last))


def settled(data: xr.Dataset, most: int | None = None) -> xr.Dataset:
    """The samples of a transient in its settled window, or the last ``most`` of them."""
    rest = between(data, window_of(data).start)
    return rest if most is None else rest.isel({TIME: slice(-most, None)})


class WindowedRanges(DatasetSink):
    """A sink for ranges, by window, of the variables that ``watched`` computes from samples."""

    def __init__(self, watched: Callable[[xr.Dataset], xr.Dataset], edges: Array) -> None:
        self._watched, self._edges = watched, edges
        self._parts: dict[int, Ranges] = {}

    def append(self, data: xr.Dataset) -> None:
        """Add the next samples."""
        for k, piece in cut(data.variables[TIME].to_numpy(), self._edges):
            self._parts.setdefault(k, Ranges(self._watched)).append(data.isel({TIME: piece}))

    def since(self, start: float) -> Ranges:
        """Ranges of the windows that begin at ``start`` or later, s, which is a start time."""
        first = int(np.searchsorted(self._edges, start))
        ranges = Ranges(self._watched)
        for k in sorted(self._parts):
            if k >= first:
                ranges.join(self._parts[k])
        return ranges


class Settling(DatasetSink):
    """A sink that detects the settled window of a run of ``span`` s from ``begin``, s.

    period: of the slowest gear mesh, s.
    """

    def __init__(self, period: float, span: float, begin: float = 0.0) -> None:
        self._period, self._span, self._begin = period, span, begin
        self._time, self._x = np.zeros(0), np.zeros((0, 0))  # samples of the last period
        self._sizes: list[int] = []
        # largest D, distance from neighbours, x and −x of each window
        self._largest = np.full((WINDOWS, 4, 0), -np.inf)

    def append(self, data: xr.Dataset) -> None:
        """Add the next samples."""
        time, x = data[TIME].to_numpy(), self._watched(data)
        if not len(time):
            return
        count = len(self._time)
        if count:
            time, x = np.concatenate([self._time, time]), np.concatenate([self._x, x])
        kept_from = max(int(np.searchsorted(time, time[-1] - self._period)) - 1, 0)
        self._time, self._x = time[kept_from:], x[kept_from:]
        first = max(count, int(np.searchsorted(time, time[0] + self._period)))
        if first < len(time):
            earlier, low, high = _earlier(time[first:] - self._period, time, x)
            now = x[first:]
            distance = np.maximum(np.maximum(now - high, low - now), 0.0)
            self._count(time[first:], now, np.abs(now - earlier), distance)

    def window(self) -> Window:
        """The window to be evaluated, the whole run if it has not settled."""
        end, periods = self._begin + self._span, self._span / self._period
        difference = self._largest[:, 0]
        whole = Window(self._begin, end, None, "")
        if periods < MIN_PERIODS or np.isinf(difference[WINDOWS // 4 :]).any():
            count = f"{periods:.3g} periods of the slowest gear mesh"
            return replace(whole, sentence=f"{count} are too few to tell whether it has settled")
        limit = SHARE * self._peak_to_peak(slice(WINDOWS // 2, None))
        distance = self._largest[:, 1].reshape(4, WINDOWS // 4, difference.shape[1])
        quarters = distance.max(axis=1)
        rise = np.diff(quarters[1:], axis=0)
        least = distance.min(axis=1)
        grows = (rise > 0).all(axis=0) & (rise.sum(axis=0) > limit) & (least[3] > quarters[1])
        decays = (rise < 0).all(axis=0) & (rise[1] < -2.0 * limit) & (least[2] > quarters[3])
        if (grows | decays).any():
            how = "grows until" if grows.any() else "from the start still decays at"
            sentence = f"vibration {how} the end of the run"
            return replace(whole, settled=False, sentence=sentence)
        above = (difference > difference[WINDOWS // 2 :].max(axis=0) + limit).any(axis=1)
        first = int(np.flatnonzero(above)[-1]) + 1 if above.any() else 0
        return Window(
            float(window_edges(self._span, begin=self._begin)[first]),
            end,
            True,
            f"from there on vibration repeats from one gear-mesh period to the next within "
            f"{100 * SHARE:g} % of its peak-to-peak",
        )

    def _watched(self, data: xr.Dataset) -> Array:
        """Gear-mesh forces and radial displacements of bodies, (t, n)."""
        radial = data["body_displacement"].sel(dof=["ux", "uy"]).to_numpy()
        kinds = [data["gear_mesh_force"].to_numpy(), radial.reshape(len(radial), -1)]
        self._sizes = [kind.shape[1] for kind in kinds]
        return np.concatenate(kinds, axis=1)

    def _count(self, time: Array, x: Array, difference: Array, distance: Array) -> None:
        if not self._largest.shape[2]:
            self._largest = np.full((WINDOWS, 4, x.shape[1]), -np.inf)
        since = time - self._begin
        number = np.minimum((since * (WINDOWS / self._span)).astype(int), WINDOWS - 1)
        at, starts = np.unique(number, return_index=True)
        values = np.stack([difference, distance, x, -x], axis=1)
        most = np.maximum.reduceat(values, starts, axis=0)
        self._largest[at] = np.maximum(self._largest[at], most)

    def _peak_to_peak(self, windows: slice) -> Array:
        """Peak-to-peak value of each x, with lower limits relative to the values of its kind."""
        high, low = self._largest[windows, 2].max(axis=0), -self._largest[windows, 3].max(axis=0)
        range_ = high - low
        for end, size in zip(np.cumsum(self._sizes), self._sizes, strict=True):
            kind = slice(end - size, end)
            if size:
                least = MIN_RANGE * range_[kind].max()
                threshold = MIN_RELATIVE * np.maximum(np.abs(high[kind]), np.abs(low[kind])).max()
                range_[kind] = np.maximum(range_[kind], max(least, threshold))
        return range_


def _earlier(at: Array, time: Array, x: Array) -> tuple[Array, Array, Array]:
    """Values x (t, n) linearly interpolated at other times, and the smallest and largest of the
    samples NEIGHBOURS about these."""
    after = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    weight = ((at - time[after - 1]) / (time[after] - time[after - 1]))[:, None]
    about = [x[np.clip(after + k, 0, len(time) - 1)] for k in NEIGHBOURS]
    low, high = np.minimum.reduce(about), np.maximum.reduce(about)
    return (1.0 - weight) * x[after - 1] + weight * x[after], low, high


RECORDED = 2**16  # samples of sensors in a piece


class SensorRanges(DatasetSink):
    """A sink for ranges of the signals of sensors by window."""

    def __init__(self, edges: Array) -> None:
        self._ranges = WindowedRanges(lambda x: x.assign(square=x["sensor_signal"] ** 2), edges)
        self._units: dict[str, str] = {}
        self._end = np.empty(0)  # times of the last samples

    def begin(self, run_size: RunSize) -> None:
        """Read names and units of the sensors."""
        self._ranges.begin(run_size)
        if "sensor" in run_size.pattern:
            names, units = (run_size.pattern[n].to_numpy() for n in ("sensor", "sensor_unit"))
            self._units = dict(zip(map(str, names), map(str, units), strict=True))

    def append(self, data: xr.Dataset) -> None:
        """Add the next samples."""
        if data.sizes.get(SENSOR_TIME):
            self._end = np.append(self._end, data[SENSOR_TIME])[-16:]
            of_sensors = data[["sensor_signal"]].drop_vars(TIME, errors="ignore")
            self._ranges.append(of_sensors.rename({SENSOR_TIME: TIME}))

    def figures(self, start: float) -> dict[str, dict[str, Any]]:
        """Statistics of each sensor in the windows from ``start``, s, without variation that is
        rounding; empty without samples."""
        rest = self._ranges.since(start)
        if not rest.first.data_vars:
            return {}
        mean, square = (rest.mean[n].to_numpy() for n in ("sensor_signal", "square"))
        least, largest = (r["sensor_signal"].to_numpy() for r in (rest.least, rest.largest))
        rms = np.sqrt(np.maximum(square - mean**2, 0.0))
        noise = np.array([motion_rounding(unit, self._end) for unit in self._units.values()])
        mean[np.maximum(np.abs(least), np.abs(largest)) <= noise] = 0.0
        constant = largest - least <= np.maximum(noise, SINGLE * np.abs(mean))
        rms[constant], least[constant], largest[constant] = 0.0, mean[constant], mean[constant]
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


def sensor_levels(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """``SensorRanges.figures`` of all samples of a transient, which are read in pieces; empty
    without sensors or samples."""
    count = data.sizes.get(SENSOR_TIME, 0)
    levels = SensorRanges(np.array([-np.inf]))
    levels.begin(RunSize(data, 0))
    for first in range(0, count, RECORDED):
        levels.append(data.isel({SENSOR_TIME: slice(first, first + RECORDED)}))
    return levels.figures(-np.inf)
