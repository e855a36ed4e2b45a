"""Life curves and Miner's sum over a load spectrum, ISO 6336-6.

A curve of stress σ_G over cycles N is straight between its knees in logarithms. Below the first
knee it is the static stress, which a stress above does not survive once; beyond the last one it
goes on as its last part does, for ever where that is level. Miner's sum over bins of n_i cycles

    D = Σ n_i/N_i(σ_i),

and the safety of a spectrum is the factor S on all its stresses with D(S) = 1, which of one bin is
σ_G(n)/σ. Bins may have curves of their own, as speed is in Z_L Z_v Z_R.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from flexgear.arrays import Array

_HALVINGS = 100


@dataclass(frozen=True)
class LifeCurve:
    """cycles: (K,) of the knees, rising; stress: σ_G there (K,), Pa, falling or level."""

    cycles: tuple[float, ...]
    stress: tuple[float, ...]

    def stress_at(self, cycles: float) -> float:
        """σ_G, Pa."""
        n, s = np.log(self.cycles), np.log(self.stress)
        if cycles <= self.cycles[0]:
            return self.stress[0]
        x = math.log(cycles)
        k = min(int(np.searchsorted(n, x)), len(n) - 1)
        slope = (s[k] - s[k - 1]) / (n[k] - n[k - 1])
        return float(np.exp(s[k] + slope * (x - n[k])))

    def cycles_at(self, stress: float) -> float:
        """N that the curve bears at a stress, Pa; 0 above the static one, ∞ on a level last part
        or below it."""
        return float(self.cycles_at_all(np.array([stress]))[0])

    def cycles_at_all(self, stress: Array) -> Array:
        """``cycles_at`` of stresses of any shape, Pa."""
        return _cycles(np.log(self.cycles), np.log([self.stress]), stress.ravel()).reshape(
            stress.shape
        )


def _cycles(log_cycles: Array, log_stress: Array, stress: Array) -> Array:
    """N (B,) at stress (B,), Pa; log_cycles (K,), log_stress (B, K) falling or level."""
    with np.errstate(divide="ignore"):
        x = np.log(stress)
    life = np.zeros_like(x)
    for k in range(1, len(log_cycles)):
        upper, lower = log_stress[:, k - 1], log_stress[:, k]
        fall = upper - lower
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(fall > 0.0, (upper - x) / fall, np.inf)
        with np.errstate(over="ignore", invalid="ignore"):
            here = np.exp(log_cycles[k - 1] + share * (log_cycles[k] - log_cycles[k - 1]))
        life = np.where(x <= upper, here, life)
    return life


@dataclass(frozen=True)
class Spectrum:
    """One flank or root over B bins. curves: of each bin; stress: σ (B,), Pa; cycles: (B,)."""

    curves: tuple[LifeCurve, ...]
    stress: Array
    cycles: Array

    @classmethod
    def of(cls, curves: Sequence[LifeCurve], stress: ArrayLike, cycles: ArrayLike) -> Spectrum:
        """ValueError where curves have different knees or numbers of bins differ."""
        sigma, n = np.asarray(stress, dtype=float), np.asarray(cycles, dtype=float)
        if len({len(curves), *sigma.shape, *n.shape}) != 1:
            raise ValueError(f"{len(curves)} curves, {sigma.shape} stresses, {n.shape} cycles")
        if len({curve.cycles for curve in curves}) > 1:
            raise ValueError("the curves of a spectrum have different knees")
        return cls(tuple(curves), sigma, n)

    def _damages(self, factor: float) -> Array:
        """n_i/N_i (B,) with all stresses multiplied."""
        if not self.curves:
            return np.zeros(0)
        stress = np.log([curve.stress for curve in self.curves])
        life = _cycles(np.log(self.curves[0].cycles), stress, factor * self.stress)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.cycles > 0.0, self.cycles / life, 0.0)

    @property
    def damages(self) -> Array:
        """n_i/N_i (B,)."""
        return self._damages(1.0)

    @property
    def damage(self) -> float:
        """D; ∞ where a stress is above the static one."""
        return math.fsum(self.damages)

    @property
    def safety(self) -> float:
        """Largest factor on all stresses with D ≤ 1; ∞ without load."""
        alone = [
            curve.stress_at(n) / sigma
            for curve, sigma, n in zip(self.curves, self.stress, self.cycles, strict=True)
            if n > 0.0 and sigma > 0.0
        ]
        if not alone:
            return math.inf
        high = min(alone)
        low = high
        while math.fsum(self._damages(low)) > 1.0:
            low /= 2.0
        for _ in range(_HALVINGS):
            middle = math.sqrt(low * high)
            if not low < middle < high:
                break
            if math.fsum(self._damages(middle)) > 1.0:
                high = middle
            else:
                low = middle
        return low

    def life(self, duration: float) -> float:
        """Time until D = 1 where the spectrum lasts ``duration``, in its unit; ∞ without damage."""
        damage = self.damage
        return duration / damage if damage > 0.0 else math.inf
