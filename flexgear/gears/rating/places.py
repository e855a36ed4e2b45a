"""Miner's sum at every place of a tooth, from computed stresses: beyond ISO 6336.

A place of a tooth sees n cycles in a bin, spread evenly over P passes of stress σ_p; its sum is
that of ``damage`` with every pass as a bin,

    D = Σ_bins n/P Σ_p 1/N(σ_p),

and a tooth lives as long as its worst place. A fillet that is stretched to σ_max and pressed to
σ_min < 0 counts as one under the pulsating stress of the same damage,

    σ = σ_max − σ_min (1 − M)/(1 + M),

which is Y_M of ISO 6336-3, annex B, with the computed R = σ_min/σ_max in its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.rating.damage import LifeCurve, Spectrum


def pulsating_stress(largest: Array, least: Array | float, influence: float) -> Array:
    """Pa; influence: (1 − M)/(1 + M)."""
    return largest - np.minimum(least, 0.0) * influence


def around_axis(angles: Array, values: Array, at: Array) -> Array:
    """Values (z, …) at angles (z,), rad, of values (C, …) at angles (C,), 0 … 2π: linear between
    neighbours and from the last to the first."""
    order = np.argsort(angles)
    turn, rising = 2.0 * np.pi, angles[order]
    above = np.searchsorted(rising, np.mod(at, turn)) % len(order)
    below = above - 1
    step = np.mod(rising[above] - rising[below], turn)
    share = np.divide(
        np.mod(at - rising[below], turn), step, out=np.zeros_like(at), where=step > 0.0
    ).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[order[below]] + share * values[order[above]])


@dataclass(frozen=True)
class Places:
    """Places of a flank or a root over bins that last. stress: (passes, places) Pa in a bin by its
    place in ``curves``, of what a place bears, and ``cycles`` (B,)."""

    stress: Callable[[int], Array]
    curves: tuple[LifeCurve, ...]
    cycles: Array

    def damage(self, factor: float = 1.0) -> Array:
        """D (places,) with all stresses multiplied."""
        total: Array | float = 0.0
        for b, curve in enumerate(self.curves):
            lives = curve.cycles_at_all(factor * self.stress(b))
            with np.errstate(divide="ignore"):
                total = total + self.cycles[b] * (1.0 / lives).mean(axis=0)
        return np.asarray(total)

    def spectrum(self, place: int) -> Spectrum:
        """Of one place, with every pass as a bin."""
        stresses = [self.stress(b)[:, place] for b in range(len(self.curves))]
        passes = [len(stress) for stress in stresses]
        curves = [c for c, count in zip(self.curves, passes, strict=True) for _ in range(count)]
        cycles = np.repeat(self.cycles / passes, passes)
        return Spectrum.of(curves, np.concatenate(stresses), cycles)

    def weakest(self) -> tuple[int, float]:
        """The place with the least safety, and that: the factor on all stresses with D = 1.

        D of every place rises with the factor, so that from one place to another with more than
        one at its safety the factor only falls.
        """
        largest = np.max([self.stress(b).max(axis=0) for b in range(len(self.curves))], axis=0)
        place = int(np.argmax(largest))
        tried: set[int] = set()
        while True:
            safety = self.spectrum(place).safety
            tried.add(place)
            damages = self.damage(safety) if np.isfinite(safety) else self.damage()
            worst = int(np.argmax(damages))
            if damages[worst] <= 1.0 + 1e-9 or worst in tried:
                return place, safety
            place = worst
