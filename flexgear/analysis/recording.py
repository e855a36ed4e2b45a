"""Signals of sensors from a run: uniform grid, derivatives, filter, decimation.

Samples at the times of steps are interpolated to a uniform grid, three times as fine, by
polynomials through the eight samples around each point, so that the images of interpolation are
beyond the band. Central differences of order eight give derivatives on the grid. A linear-phase FIR
low-pass (Kaiser window) suppresses all frequencies above half of the sampling rate. Every M-th
value is output, at the time of the middle of its filter, so that there is no delay. Displacements
are differentiated after their recovery, which includes the quasi-static part: the rates of the kept
modes alone would not.

Samples and grid values that later signals need are stored from chunk to chunk, so that the result
does not depend on the size of chunks. There are no signals at the beginning and the end of a run,
where a filter would need samples outside it.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import scipy
from scipy.ndimage import correlate1d

from flexgear.arrays import Array

AROUND = 8  # samples for the interpolation of a value
LATER = AROUND // 2 + 1  # last samples, after whose first one values cannot be interpolated yet
REACH = 4  # values on each side of a central difference
SAMPLES = 16  # least number in a period of the highest frequency, as far as steps allow
FINER = 3  # least number of grid values per sample
REJECTION = 100.0  # dB, above half of the sampling rate
_OFFSETS = np.arange(-REACH, REACH + 1)


def _difference(order: int) -> Array:
    """Weights (2 REACH + 1,) of a central difference on a grid with spacing 1, exact for
    polynomials of degree 2 REACH; order: of the derivative."""
    powers = np.vander(_OFFSETS.astype(float), increasing=True).T
    unit = np.zeros(len(_OFFSETS))
    unit[order] = math.factorial(order)
    return np.asarray(np.linalg.solve(powers, unit))


def local_weights(places: Array, at: Array) -> Array:
    """Lagrange weights (n, k) of values at ``places`` (n, k) for interpolation at ``at`` (n,)."""
    distance = at[:, None] - places
    weights = np.ones_like(places)
    for j in range(places.shape[1]):
        for m in range(places.shape[1]):
            if m != j:
                weights[:, j] *= distance[:, m] / (places[:, j] - places[:, m])
    return weights


@dataclass(frozen=True)
class Clock:
    """Sampling of signals. band: highest frequency that passes, Hz; rate: sampling rate, Hz; step:
    shortest time between samples of the run, s."""

    band: float
    rate: float
    step: float

    @property
    def factor(self) -> int:
        """Number M of values of the fine grid per output value."""
        return math.ceil(FINER / (self.step * self.rate) * (1 - 1e-9))

    @property
    def fine(self) -> float:
        """Sampling rate of the fine grid, before decimation, Hz."""
        return self.factor * self.rate

    @cached_property
    def taps(self) -> Array:
        """Coefficients (2 H + 1,) of the low-pass with gain 1 at 0 Hz; H is a multiple of M."""
        width = (0.5 * self.rate - self.band) / (0.5 * self.fine)
        count, beta = scipy.signal.kaiserord(REJECTION, width)
        half = self.factor * math.ceil(count / 2 / self.factor)
        cutoff = 0.5 * (0.5 * self.rate + self.band)
        window = ("kaiser", beta)
        return np.asarray(scipy.signal.firwin(2 * half + 1, cutoff, window=window, fs=self.fine))

    def times(self, first: int, count: int) -> Array:
        """Times of ``count`` output values from number ``first`` on, s."""
        return np.arange(first, first + count) / self.rate

    def count(self, times: Array) -> int:
        """Number of output values of a run; times: of its first and last ``LATER`` samples, s."""
        if len(times) <= LATER:
            return 0
        half = len(self.taps) // 2 + REACH
        first = -(-(_grid(float(times[0]), self.fine) + half) // self.factor)
        last = (_grid_end(float(times[-LATER]), self.fine) - 1 - half) // self.factor
        return max(0, last + 1 - first)


def _grid(time: float, rate: float) -> int:
    """Number of the first grid value at or after ``time``."""
    return math.ceil(time * rate * (1 - 1e-12) - 1e-9)


def _grid_end(time: float, rate: float) -> int:
    """1 plus the number of the last grid value at or before ``time``."""
    return math.floor(time * rate * (1 + 1e-12)) + 1


@dataclass(frozen=True)
class Quantity:
    """Computation of a sensor's signal from n samples.

    position: function from samples to k columns (n, k); order: order of their time derivative, 0 to
    2; part: function from derivative and position to the signal (n,), by default the first column
    of the derivative, for positions with one component.
    """

    position: Callable[[Any], Array]
    order: int = 0
    part: Callable[[Array, Array], Array] = lambda derivative, _: derivative[:, 0]

    def over_period(self, samples: Any, omega: float) -> Array:
        """Signal (n,) from samples equally spaced over a period 2π/ω, by Fourier series."""
        position = self.position(samples)
        if self.order == 0:
            return self.part(position, position)
        spectrum = np.fft.rfft(position, axis=0)
        rates = (1j * omega * np.arange(len(spectrum)))[:, None] ** self.order
        return self.part(np.fft.irfft(rates * spectrum, len(position), axis=0), position)


class Recorder:
    """Computes the signals (m, s) of quantities from the samples of a run, chunk by chunk."""

    def __init__(self, clock: Clock, quantities: Sequence[Quantity]) -> None:
        self.clock, self._quantities = clock, tuple(quantities)
        self._differences = [_difference(order) * clock.fine**order for order in range(3)]
        self._times, self._values = np.zeros(0), np.zeros((0, 0))
        self._fine = np.zeros((0, 0))
        self._places: list[slice] = []  # columns of every quantity
        self._first = 0  # number of the first value of ``_fine``
        self._next: int | None = None  # number of the next value of the fine grid

    def append(self, times: Array, samples: Any) -> tuple[Array, Array]:
        """Add samples at times (t,), s; returns times (m,) and signals (m, s) that are complete."""
        positions = [quantity.position(samples) for quantity in self._quantities]
        stops = np.cumsum([0, *(position.shape[1] for position in positions)]).tolist()
        self._places = [slice(a, b) for a, b in pairwise(stops)]
        values = np.hstack(positions)
        if not len(self._times):
            self._values = self._fine = values[:0]
        self._times = np.concatenate([self._times, times])
        self._values = np.concatenate([self._values, values])
        if len(self._times) >= AROUND:
            self._fine = np.concatenate([self._fine, self._on_grid()])
        return self._completed()

    def _on_grid(self) -> Array:
        """New values (n, c) of the fine grid; drops samples that are no longer needed."""
        times, rate = self._times, self.clock.fine
        if self._next is None:
            self._next = self._first = _grid(float(times[0]), rate)
        stop = _grid_end(float(times[-LATER]), rate)
        numbers = np.arange(self._next, max(stop, self._next))
        grid = numbers / rate
        before = np.searchsorted(times, grid * (1 + 1e-12), side="right") - AROUND // 2
        before = np.maximum(before, 0)
        around = before[:, None] + np.arange(AROUND)
        weights = local_weights(times[around], grid)
        values = np.zeros((len(grid), self._values.shape[1]))
        for weight, sample in zip(weights.T, around.T, strict=True):
            values += weight[:, None] * self._values[sample]
        self._next += len(numbers)
        done = np.searchsorted(times, self._next / rate, side="right") - AROUND
        if done > 0:
            self._times, self._values = times[done:], self._values[done:]
        return values

    def _completed(self) -> tuple[Array, Array]:
        """Signals whose filters are within the fine grid; drops values that are used no more."""
        clock, m = self.clock, self.clock.factor
        half = len(clock.taps) // 2
        first = -(-(self._first + half + REACH) // m)
        count = (self._first + len(self._fine) - 1 - half - REACH) // m + 1 - first
        if count <= 0:
            return np.zeros(0), np.zeros((0, len(self._quantities)))
        start = first * m - half - self._first
        stop = start + (count - 1) * m + 2 * half + 1
        values = self._fine[start - REACH : stop + REACH]
        inside = slice(REACH, len(values) - REACH)
        columns = []
        for quantity, place in zip(self._quantities, self._places, strict=True):
            position = values[:, place]
            difference = correlate1d(position, self._differences[quantity.order], axis=0)
            columns.append(quantity.part(difference[inside], position[inside]))
        every = scipy.signal.upfirdn(clock.taps, np.stack(columns, axis=1), down=m, axis=0)
        delay = 2 * half // m
        keep = (first + count) * m - half - REACH - self._first
        self._fine, self._first = self._fine[keep:], self._first + keep
        return clock.times(first, count), np.asarray(every[delay : delay + count])
