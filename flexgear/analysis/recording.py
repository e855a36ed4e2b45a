"""Signals of sensors from a run: uniform grid, derivatives, filter, decimation.

Samples at the times of the steps become values at k h of a uniform grid, thrice as fine, by
polynomials through the eight samples around, whose images then lie beyond the band; central
differences of order eight give derivatives there; a linear-phase FIR
low-pass (Kaiser window) takes away all from half of the sampling rate on; every M-th value is kept,
with the time of the middle of its filter, so that nothing is delayed. The rates are those of what
is recovered with its quasi-static part: differences of the modes' rates alone would leave it out.

What a signal needs of the past is kept from chunk to chunk: chunks of any size give what the whole
gives. The first and the last of a run are left out, where a filter would have to invent samples.
"""

from __future__ import annotations

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

AROUND = 8  # samples that a value between them follows from
LATER = AROUND // 2 + 1  # samples, of which the first is behind all that the others complete
REACH = 4  # of a central difference, to each side
SAMPLES = 16  # of a run in a period of the band's top, at least, where its steps allow
FINER = 3  # times as many values of the grid as samples, at least
REJECTION = 100.0  # dB, from half of the sampling rate on
_OFFSETS = np.arange(-REACH, REACH + 1)


def _difference(order: int) -> Array:
    """Weights (2 REACH + 1,) of a central difference of values one apart; exact for polynomials of
    degree 2 REACH."""
    powers = np.vander(_OFFSETS.astype(float), increasing=True).T
    unit = np.zeros(len(_OFFSETS))
    unit[order] = math.factorial(order)
    return np.asarray(np.linalg.solve(powers, unit))


def local_weights(places: Array, at: Array) -> Array:
    """Lagrange's weights (n, k) of values at places (n, k) for the value at (n,)."""
    away = at[:, None] - places
    weights = np.ones_like(places)
    for j in range(places.shape[1]):
        for m in range(places.shape[1]):
            if m != j:
                weights[:, j] *= away[:, m] / (places[:, j] - places[:, m])
    return weights


@dataclass(frozen=True)
class Clock:
    """band: highest frequency that passes; rate: of sampling, Hz; step: between samples of a run,
    where they are closest, s."""

    band: float
    rate: float
    step: float

    @property
    def factor(self) -> int:
        """Values of the fine grid for one that is kept."""
        return math.ceil(FINER / (self.step * self.rate) * (1 - 1e-9))

    @property
    def fine(self) -> float:
        """Sampling rate of the fine grid, before decimation, Hz."""
        return self.factor * self.rate

    @cached_property
    def taps(self) -> Array:
        """Coefficients (2 H + 1,) of the low-pass, unity at 0 Hz; H is a multiple of ``factor``."""
        width = (0.5 * self.rate - self.band) / (0.5 * self.fine)
        count, beta = scipy.signal.kaiserord(REJECTION, width)
        half = self.factor * math.ceil(count / 2 / self.factor)
        cutoff = 0.5 * (0.5 * self.rate + self.band)
        window = ("kaiser", beta)
        return np.asarray(scipy.signal.firwin(2 * half + 1, cutoff, window=window, fs=self.fine))

    def times(self, first: int, count: int) -> Array:
        """Times of ``count`` values from number ``first`` on, s."""
        return np.arange(first, first + count) / self.rate

    def count(self, times: Array) -> int:
        """Values of a run; times: of its first sample and of at least as many of its last ones as
        ``LATER``, s."""
        if len(times) <= LATER:
            return 0
        half = len(self.taps) // 2 + REACH
        first = -(-(_grid(float(times[0]), self.fine) + half) // self.factor)
        last = (_grid_end(float(times[-LATER]), self.fine) - 1 - half) // self.factor
        return max(0, last + 1 - first)


def _grid(time: float, rate: float) -> int:
    """Number of the first value of a grid from ``time`` on."""
    return math.ceil(time * rate * (1 - 1e-12) - 1e-9)


def _grid_end(time: float, rate: float) -> int:
    """Number behind the last value of a grid up to ``time``."""
    return math.floor(time * rate * (1 + 1e-12)) + 1


def first_column(derivative: Array, position: Array) -> Array:
    """Derivative of a position with one component."""
    return derivative[:, 0]


@dataclass(frozen=True)
class Quantity:
    """How a sensor's signal follows from n samples.

    position: makes k columns (n, k) of them; order: of the time derivative that is taken of these,
    0 to 2; part: makes the signal (n,) of derivative and position.
    """

    position: Callable[[Any], Array]
    order: int = 0
    part: Callable[[Array, Array], Array] = first_column

    def over_period(self, samples: Any, omega: float) -> Array:
        """Signal (n,) of samples spread evenly over a period 2π/ω, by their harmonics."""
        position = self.position(samples)
        if self.order == 0:
            return self.part(position, position)
        spectrum = np.fft.rfft(position, axis=0)
        rates = (1j * omega * np.arange(len(spectrum)))[:, None] ** self.order
        return self.part(np.fft.irfft(rates * spectrum, len(position), axis=0), position)


class Recorder:
    """Signals (m, s) of quantities from samples of a run, chunk by chunk."""

    def __init__(self, clock: Clock, quantities: Sequence[Quantity]) -> None:
        self.clock, self._quantities = clock, tuple(quantities)
        self._differences = [_difference(order) * clock.fine**order for order in range(3)]
        self._times, self._values = np.zeros(0), np.zeros((0, 0))
        self._fine = np.zeros((0, 0))
        self._places: list[slice] = []  # columns of every quantity
        self._first = 0  # number of the first value of ``_fine``
        self._next: int | None = None  # number of the next value of the fine grid

    def append(self, times: Array, samples: Any) -> tuple[Array, Array]:
        """Times (m,) s and signals (m, s) that samples at times (t,) more complete."""
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
        """Values (n, c) of the fine grid that have their samples; drops samples that are done."""
        times, rate = self._times, self.clock.fine
        if self._next is None:
            self._next = self._first = _grid(float(times[0]), rate)
        stop = _grid_end(float(times[-LATER]), rate)
        numbers = np.arange(self._next, max(stop, self._next))
        at = numbers / rate
        before = np.searchsorted(times, at * (1 + 1e-12), side="right") - AROUND // 2
        before = np.maximum(before, 0)
        around = before[:, None] + np.arange(AROUND)
        weights = local_weights(times[around], at)
        values = np.zeros((len(at), self._values.shape[1]))
        for weight, sample in zip(weights.T, around.T, strict=True):
            values += weight[:, None] * self._values[sample]
        self._next += len(numbers)
        done = np.searchsorted(times, self._next / rate, side="right") - AROUND
        if done > 0:
            self._times, self._values = times[done:], self._values[done:]
        return values

    def _completed(self) -> tuple[Array, Array]:
        """Signals whose filters lie in the fine grid as it is; drops what none needs any more."""
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
