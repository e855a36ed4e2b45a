"""Load sharing coefficients of forces that come piece by piece: no history is kept.

Of the definitions of ``load_sharing`` only largest values over samples and gear-mesh cycles are
needed, and of the samples only those of the cycle that is not whole yet. Which sense the load has,
positive or reversed, is known in the end: both are followed.
"""

from __future__ import annotations

import math
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexgear.results.load_sharing import (
    Definition,
    carry_together,
    cycle_starts,
    planet_figures,
    shares,
)

Array = NDArray[np.float64]
DEFINITIONS: tuple[Definition, ...] = get_args(Definition)
FEWEST = 4.0  # samples a gear-mesh cycle whose maximum is to be seen


class RunningSharing:
    """Coefficients of N planets that share a load. samples_per_cycle: of their gear mesh.

    Windows that are closed are kept apart, so that coefficients can be of the later ones alone.
    """

    def __init__(self, planets: int, samples_per_cycle: float) -> None:
        self._per_cycle = samples_per_cycle
        self._senses = [_Sense(planets, sense, samples_per_cycle) for sense in (1.0, -1.0)]
        self._sum, self._samples = 0.0, 0

    def append(self, force: ArrayLike) -> None:
        """Some samples more of the gear-mesh forces (t, N), N."""
        f = np.asarray(force, dtype=float)
        if not len(f):
            return
        self._sum += float(f.sum())
        for sense in self._senses:
            sense.append(f, self._samples)
        self._samples += len(f)

    def close_window(self) -> None:
        """What comes is of the next window; a gear-mesh cycle in both counts in the later one."""
        for sense in self._senses:
            sense.windows.append(_Largest(sense.open.shape[1]))

    def planets(self, definition: Definition, first: int = 0) -> Array:
        """Coefficients (N,) of the planets from the window ``first`` on; NaN where there are
        none."""
        windows = self._senses[0 if self._sum >= 0 else 1].windows[first:]
        largest = np.max([window.figures[definition] for window in windows], axis=0)
        enough = definition == "instantaneous" or (
            self._per_cycle >= FEWEST and self._samples >= self._per_cycle
        )
        if not (enough and all(window.loaded for window in windows) and np.isfinite(largest).all()):
            return np.full_like(largest, math.nan)
        return np.asarray(largest)


class _Largest:
    """Coefficients of one window. loaded: whether the load has the sense in every sample."""

    def __init__(self, planets: int) -> None:
        self.loaded = True
        self.figures = {d: np.full(planets, -math.inf) for d in DEFINITIONS}

    def take(self, definition: Definition, largest: Array) -> None:
        """Look at shares of the forces (k, N) of samples or cycles."""
        figure = planet_figures(definition, shares(largest)).max(axis=0)
        self.figures[definition] = np.maximum(self.figures[definition], figure)


class _Sense:
    """Coefficients by window if the load has one sense."""

    def __init__(self, planets: int, sense: float, per_cycle: float) -> None:
        self._sense, self._per_cycle = sense, per_cycle
        self._cycles, self.open = 0, np.zeros((0, planets))
        self.windows = [_Largest(planets)]

    def append(self, force: Array, before: int) -> None:
        """Some samples more, of which there were some before."""
        force, window = self._sense * force, self.windows[-1]
        carried = carry_together(force) & (force.sum(axis=1) > 0)
        window.loaded = window.loaded and bool(np.all(carried))
        if window.loaded:
            window.take("instantaneous", force)
        if self._per_cycle < FEWEST:
            return
        first, held = before - len(self.open), np.concatenate([self.open, force])
        starts = cycle_starts(before + len(force), self._per_cycle, self._cycles) - first
        self.open = held[starts[-1] :]
        self._cycles += len(starts) - 1
        if window.loaded and len(starts) > 1:
            largest = np.maximum.reduceat(held[: starts[-1]], starts[:-1], axis=0)
            for definition in DEFINITIONS[1:]:
                window.take(definition, largest)
