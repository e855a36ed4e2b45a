"""Load bins of a case: from its load cases, and from load series sorted into joint bins of torque,
speed and loads on the first input.

A sample represents the time w by the trapezoidal rule, scaled from the duration of the files of its
design load case to the hours of this load case, and w |ω| / 2π turns. As the life of gears and
bearings is counted in turns, the torque of a bin is

    T = (Σ n_i |T_i|^p / Σ n_i)^(1/p)

over the turns n_i of its samples. Loads are means weighted by n_i |T_i|^p; the speed is turns over
hours. So the bins have the hours and turns of the samples, and their damage for a life curve
N ~ T^(−p).
"""

import math
from collections import defaultdict
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.files.load_files import read_channels
from flexgear.gears.load_bins import HOUR, LoadBin, bins_of_load_cases
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load_cases import DesignLoadCase, LoadCase, LoadSeries

LOADS = ("force_x", "force_y", "force_z", "moment_x", "moment_y")
# of roller bearings, case-hardened flanks and roots, and these beyond the knee of their curves
EXPONENTS = (10.0 / 3.0, 6.6, 8.7, 16.3, 50.0)
STEPS = ("torque_step", "speed_step", *["force_step"] * 3, *["moment_step"] * 2)
MAX_RATIO = 1e6  # of the largest value to the width of a bin
FINE = 40  # intervals of the duration curve of torque per bin of torque
Report = Callable[[str, float], None]


class Samples(NamedTuple):
    """n samples of one file. weight (n,): hours in the life; speed (n,): rad/s; torque (n,): N·m;
    loads (n, 5): N and N·m, in the order of ``LOADS``; time (n,): s."""

    weight: Array
    speed: Array
    torque: Array
    loads: Array
    time: Array

    @property
    def turns(self) -> Array:
        """Turns (n,) of the first input represented by each sample."""
        return HOUR * self.weight * np.abs(self.speed) / (2.0 * math.pi)


class SeriesBins:
    """Sums of samples by bin, and extreme samples.

    hours, turns, energy: sums over all samples; changes: of the sense of torque in the life;
    duration: turns by number k of an interval of torque from k to k + 1 times ``fine_step``, N·m;
    damage: Σ n |T / T_rated|^p of all samples, by exponent p; bins: by the numbers of the lower
    edges of torque, speed and loads the sums of hours, turns n, n |T / T_rated|^p, w |T /
    T_rated|^p, s and s · load, s the weight of a sample in the means of loads; extremes: size and
    load case, by name.
    """

    def __init__(self, series: LoadSeries, torque: float, speed: float, source: str) -> None:
        """torque, speed: rated ones of the first input, N·m, rad/s; source: case, for messages."""
        self.series, self.torque, self.speed, self.source = series, torque, speed, source
        moment = series.moment_step or abs(torque) / 2.0
        self.steps = np.array([
            series.torque_step or abs(torque) / 20.0,
            series.speed_step or abs(speed) / 4.0,
            *[series.force_step or 1.0] * 3,
            *[moment] * 2,
        ])  # fmt: skip
        self.fine_step = float(self.steps[0]) / FINE
        self.hours = self.turns = self.energy = self.changes = 0.0
        self.duration = defaultdict[int, float](float)
        self.damage = dict.fromkeys(EXPONENTS, 0.0)
        self.bins: dict[tuple[int, ...], Array] = {}
        self.extremes: dict[str, tuple[float, LoadCase]] = {}

    def add(self, samples: Samples) -> None:
        """Add samples to all sums. InputError for bins too narrow for the values."""
        state = np.column_stack([samples.torque, samples.speed, samples.loads])
        sizes = np.abs(state).max(axis=0, initial=0.0) / self.steps
        if not sizes.max() <= MAX_RATIO:
            problem = f"is a bin's width that goes {sizes.max():.2g} times into the largest value"
            key = f"load_series.{STEPS[int(sizes.argmax())]}"
            remedy = f"give a wider one, {MAX_RATIO:g} times at most"
            raise InputError(self.source, key, problem, remedy)
        turns, relative = samples.turns, np.abs(samples.torque / self.torque)
        self.hours += float(samples.weight.sum())
        self.turns += float(turns.sum())
        self.energy += float((samples.weight * samples.torque * samples.speed).sum())
        repeats = HOUR * float(samples.weight.sum()) / float(np.ptp(samples.time))
        senses = np.sign(samples.torque[samples.torque != 0.0])
        self.changes += repeats * np.count_nonzero(np.diff(senses))
        for exponent in EXPONENTS:
            self.damage[exponent] += float((turns * relative**exponent).sum())
        fine = np.floor(samples.torque / self.fine_step).astype(int)
        intervals, inverse = np.unique(fine, return_inverse=True)
        for interval, total in zip(intervals.tolist(), np.bincount(inverse, turns), strict=True):
            self.duration[interval] += float(total)
        numbers = np.floor(state / self.steps).astype(int)
        places, inverse = np.unique(numbers, axis=0, return_inverse=True)
        power = relative**self.series.exponent
        share = turns * power + 1e-9 * samples.weight  # the second term decides at zero speed
        columns = [samples.weight, turns, turns * power, samples.weight * power, share]
        columns += list(share * samples.loads.T)
        sums = [np.bincount(inverse.ravel(), column, len(places)) for column in columns]
        for place, row in zip(places.tolist(), np.column_stack(sums), strict=True):
            self.bins[tuple(place)] = self.bins.get(tuple(place), 0.0) + row

    def keep_extremes(self, samples: Samples, path: Path) -> None:
        """Store the samples with the largest torque in either sense and the largest bending moment,
        if they exceed the stored ones."""
        relative = samples.torque / self.torque
        sizes = {"largest torque": relative, "largest torque against the rated": -relative}
        sizes["largest bending moment"] = np.hypot(samples.loads[:, 3], samples.loads[:, 4])
        for name, size in sizes.items():
            k = int(size.argmax())
            if size[k] > self.extremes.get(name, (0.0,))[0]:
                place = f"{path} at {samples.time[k]:g} s"
                state = self._load_case(name, samples.torque[k], samples.speed[k], samples.loads[k])
                self.extremes[name] = (
                    float(size[k]), state.model_copy(update={"extreme": True, "source": place}),
                )  # fmt: skip

    def damage_of_bins(self, exponent: float) -> float:
        """Σ n |T / T_rated|^p of the bins over that of the samples."""
        total = sum(
            HOUR * (c.hours or 0.0) * abs(c.speed or 0.0) / (2.0 * math.pi)
            * abs((c.torque or 0.0) / self.torque) ** exponent
            for c in self.load_cases
        )  # fmt: skip
        return total / self.damage[exponent] if self.damage[exponent] else 1.0

    @cached_property
    def load_cases(self) -> tuple[LoadCase, ...]:
        """A load case for each bin, by rising torque, and those of extreme samples."""
        cases = []
        for number, at in enumerate(sorted(self.bins), 1):
            hours, turns, by_turns, by_hours, share = self.bins[at][:5]
            loads = self.bins[at][5:] / share
            ratio = by_turns / turns if turns > 0.0 else by_hours / hours
            torque = math.copysign(
                abs(self.torque) * ratio ** (1.0 / self.series.exponent), at[0] + 0.5
            )
            if self.series.value == "edge":
                outer = np.array([k + 1 if k >= 0 else k for k in at]) * self.steps
                torque, loads = outer[0], np.where(loads == 0.0, 0.0, outer[2:])
            speed = math.copysign(2.0 * math.pi * turns / (HOUR * hours), at[1] + 0.5)
            state = self._load_case(f"bin {number}", torque, speed, loads)
            cases.append(state.model_copy(update={"hours": float(hours), "source": self.source}))
        return (*cases, *(load_case for _, load_case in self.extremes.values()))

    def _load_case(self, name: str, torque: float, speed: float, loads: Array) -> LoadCase:
        x, y, z, bending_x, bending_y = (float(load) for load in loads)
        sense = torque / self.torque * (speed / self.speed or 1.0)
        return LoadCase.model_construct(
            name=name, torque=float(torque), speed=float(speed),
            force=(x, y, z) if any(self.series.force) else None,
            moment=(bending_x, bending_y, 0.0) if any(self.series.moment) else None,
            back_driven=bool(sense < 0.0),
        )  # fmt: skip


def bins_of_series(case: Case, report: Report | None = None) -> SeriesBins | None:
    """Bins of the case's load series; None without series. InputError for files that cannot be
    read, and for torque of the wrong sense."""
    series = case.load_series
    if series is None:
        return None
    case.require_load()
    flow, first = power_flow(case), case.inputs[0].member
    moments = sum(float(load.first[5]) for load in case.loads if load.member == first)
    torque, speed = flow.torque[first] - moments, flow.speed[first]
    if not torque or not speed:
        problem = f"needs a rated torque and speed of {first} to compare with"
        raise InputError(case.source, "load_series", problem, "give them in inputs and output")
    sums = SeriesBins(series, torque, speed, case.source)
    cases = series.design_load_cases
    for k, design in enumerate(cases):
        if report is not None:
            report("load series", k / len(cases))
        for path, samples in _samples(case, series, design):
            sums.keep_extremes(samples, path)
            if design.hours_per_year:
                sums.add(samples)
    if sums.energy * torque * speed < 0.0:
        problem = f"takes power out at {first} over all files, where the rated torque puts it in"
        negated = series.torque[1:] if series.torque.startswith("-") else f"-{series.torque}"
        remedy = f'name it with the other sign: torque = "{negated}"'
        raise InputError(case.source, "load_series.torque", problem, remedy)
    return sums


def _samples(case: Case, series: LoadSeries, design: DesignLoadCase) -> list[tuple[Path, Samples]]:
    """Path and samples of all files of a design load case, weighted by its hours. InputError where
    ``load_series.start`` leaves no samples of a file."""
    files = []
    for path in design.paths(case.source):
        values = read_channels(path, series.channels)
        time = values["time"]
        after = time - time[0] >= series.start * (1.0 - 1e-9)  # allows for rounded times
        if after.sum() < 2:
            problem = f"leaves out all of {path}, {time[-1] - time[0]:g} s"
            raise InputError(case.source, "load_series.start", problem, "lower it")
        values = {key: value[after] for key, value in values.items()}
        half = 0.5 * np.diff(values["time"])
        loads = np.column_stack([values.get(name, np.zeros(after.sum())) for name in LOADS])
        if "azimuth" in values:
            loads = _in_fixed_axes(loads, values["azimuth"])
        weight = np.append(half, 0.0) + np.append(0.0, half)
        files.append(
            (path, Samples(weight, values["speed"], values["torque"], loads, values["time"]))
        )
    total = sum(float(samples.weight.sum()) for _, samples in files)
    hours = series.years * (design.hours_per_year or 0.0)
    return [(path, s._replace(weight=s.weight * hours / total)) for path, s in files]


def _in_fixed_axes(loads: Array, azimuth: Array) -> Array:
    """Loads (n, 5) in fixed axes from those in axes rotated about z by ``azimuth`` (n,), rad."""
    cos, sin = np.cos(azimuth), np.sin(azimuth)
    turned = loads.copy()
    for x, y in ((0, 1), (3, 4)):
        turned[:, x] = cos * loads[:, x] - sin * loads[:, y]
        turned[:, y] = sin * loads[:, x] + cos * loads[:, y]
    return turned


def load_bins(case: Case, report: Report | None = None) -> tuple[LoadBin, ...]:
    """All load bins of a case, extreme ones last. InputError for an invalid one or none at all."""
    return bins_with_series(case, bins_of_series(case, report))


def bins_with_series(case: Case, series: SeriesBins | None) -> tuple[LoadBin, ...]:
    """Load bins of the case from its load cases and from the bins of its load series."""
    bins = bins_of_load_cases(case, series.load_cases if series else ())
    if not bins:
        raise InputError(
            case.source, "load_cases", "is missing",
            'add [[load_cases]] with name, hours, torque_knm, or [spectrum] with file = "bins.csv"',
        )  # fmt: skip
    return tuple(sorted(bins, key=lambda load_bin: load_bin.extreme))
