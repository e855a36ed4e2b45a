"""Division of a run into time intervals without jumps, and into steps."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from flexgear.analysis.kernels.refinement import Control, control
from flexgear.arrays import Array

CHUNK = 4096  # ticks of one compiled call, whose overhead equals about thirty steps
LAST_SAMPLES = 8  # at the end of a run, in ``Stepping.sampled``
_ROUNDED = 1 + 1e-9


@dataclass(frozen=True)
class FineWindow:
    """A time interval with a finer step, s."""

    start: float
    stop: float
    time_step: float


@dataclass(frozen=True)
class Adaptive:
    """Step sizes chosen by an error estimate (``kernels.refinement``).

    tolerance: error of a pair's load in one step over the largest load at rated torque; shortest,
    longest: limits of the step size, s. Step sizes are the longest one halved repeatedly."""

    tolerance: float
    shortest: float
    longest: float

    def sizes(self, span: float, interval: float) -> tuple[Array, int]:
        """Step sizes (L,) s, rising, and the number of shortest steps between two samples. The
        sample interval of about ``interval`` s and the span are whole multiples of each size."""
        between = span / max(1, round(span / interval))
        longest = between / int(np.ceil(between / self.longest - 1e-9))
        halved = max(0, int(np.ceil(np.log2(longest / self.shortest) - 1e-9)))
        sizes: Array = longest / 2.0 ** np.arange(halved, -1, -1, dtype=np.float64)
        return sizes, round(between / longest) << halved


@dataclass(frozen=True)
class Plan:
    """Steps in a time interval without a jump, from ``start``, s.

    sizes (L,): step sizes, s, rising; ticks: number of shortest steps; every: ticks from sample to
    sample; sparse: samples from output to output, the others being for sensors only."""

    start: float
    sizes: Array
    ticks: int
    every: int
    control: Control
    sparse: int = 1

    @property
    def chunk(self) -> int:
        """Ticks of one compiled call; more with several step sizes, as longer steps skip ticks."""
        return CHUNK << len(self.sizes) // 2

    @property
    def outputs(self) -> int:
        """Number of samples that are outputs."""
        return self.ticks // (self.every * self.sparse)

    @property
    def times(self) -> Array:
        """Times of all samples, s."""
        count = np.arange(1, self.ticks // self.every + 1) * self.every
        return self.start + float(self.sizes[0]) * count.astype(np.float64)


@dataclass(frozen=True)
class Stepping:
    """Steps and samples of a run; all times in s.

    output_interval: between outputs, with at least one output between two jumps or window edges;
    jumps: times at which a torque jumps or the slope of a given speed changes; windows: intervals
    with finer steps; adaptive: chooses step sizes in the place of ``time_step`` and windows; start:
    time at which the run begins; between: largest interval between samples for sensors."""

    duration: float
    time_step: float
    output_interval: float
    jumps: tuple[float, ...] = ()
    windows: tuple[FineWindow, ...] = ()
    adaptive: Adaptive | None = None
    start: float = 0.0
    between: float = math.inf

    def plans(self, load: float = np.inf) -> list[Plan]:
        """A plan for each interval between two jumps; load: reference of the step error, N."""
        stop = self.start + self.duration
        edges = [edge for w in self.windows for edge in (w.start, w.stop)]
        edges = edges if self.adaptive is None else []
        cuts = sorted(c for c in {self.start, stop, *self.jumps, *edges} if self.start <= c <= stop)
        pieces = [(a, b) for a, b in pairwise(cuts) if b - a >= 1e-12 * self.duration]
        if self.adaptive is None:
            return [self._equal_steps(a, b) for a, b in pieces]
        return [self._graded_steps(a, b, self.adaptive, load) for a, b in pieces]

    def _equal_steps(self, start: float, stop: float) -> Plan:
        """Equal steps between two times, with outputs about every ``output_interval`` and samples
        at most ``between`` apart, or at every step."""
        middle, span = 0.5 * (start + stop), stop - start
        fine = [w.time_step for w in self.windows if w.start <= middle <= w.stop]
        steps = max(1, int(np.ceil(span / min([self.time_step, *fine]) - 1e-9)))
        h = span / steps
        output = min(max(1, round(self.output_interval / h)), steps)
        parts = [n for n in range(1, output + 1) if output % n == 0]
        at_most = self.between * _ROUNDED
        sparse = next((n for n in parts if output // n * h <= at_most), output)
        every = output // sparse
        return Plan(start, np.array([h]), steps, every, control(1, every=every), sparse)

    def _graded_steps(self, start: float, stop: float, adaptive: Adaptive, load: float) -> Plan:
        """Steps of several sizes with errors relative to ``load``, N; samples as in equal steps."""
        interval, span = self.output_interval, stop - start
        several = self.between < interval
        sparse = math.ceil(interval / self.between / _ROUNDED) if several else 1
        sizes, every = adaptive.sizes(span, interval / sparse)
        levels = control(len(sizes), adaptive.tolerance, load, every)
        return Plan(start, sizes, round(span / sizes[0]), every, levels, sparse)

    @property
    def least_steps(self) -> float:
        """Approximate number of steps without finer windows; infinite on overflow."""
        longest = self.time_step if self.adaptive is None else self.adaptive.longest
        return self.duration / longest

    @property
    def samples(self) -> int:
        """Number of outputs."""
        return sum(plan.outputs for plan in self.plans())

    @property
    def interval(self) -> float:
        """Interval between two outputs of the first plan, s."""
        first = self.plans()[0]
        return first.every * first.sparse * float(first.sizes[0])

    @property
    def finest(self) -> float:
        """Shortest time between two samples, s."""
        return min(plan.every * float(plan.sizes[0]) for plan in self.plans())

    @property
    def sampled(self) -> Array:
        """Times of the first sample and of the last ``LAST_SAMPLES``, s."""
        plans = self.plans()
        last = np.zeros(0)
        for plan in reversed(plans):
            last = np.concatenate([plan.times, last])
            if len(last) >= LAST_SAMPLES:
                break
        return np.concatenate([plans[0].times[:1], last[-LAST_SAMPLES:]])
