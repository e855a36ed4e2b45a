"""Life curves, Miner's sum over a load spectrum (ISO 6336-6) and at places of a tooth, reliability.

A curve of stress σ_G over cycles N is straight between its knees in logarithms. Below the first
knee it is the static stress, which a stress above does not survive once; beyond the last one it
goes on as its last part does, for ever where that is level. Miner's sum over bins of n_i cycles

    D = Σ n_i/N_i(σ_i),

and the safety of a spectrum is the factor S on all its stresses with D(S) = 1, which of one bin is
σ_G(n)/σ. Bins may have curves of their own, as speed is in Z_L Z_v Z_R.

Miner's sum at every place of a tooth, from computed stresses: beyond ISO 6336.

A place of a tooth sees n cycles in a bin, spread evenly over P passes of stress σ_p; its sum is
that of ``damage`` with every pass as a bin,

    D = Σ_bins n/P Σ_p 1/N(σ_p),

and a tooth lives as long as its worst place. A fillet that is stretched to σ_max and pressed to
σ_min < 0 counts as one under the pulsating stress of the same damage,

    σ = σ_max − σ_min (1 − M)/(1 + M),

which is Y_M of ISO 6336-3, annex B, with the computed R = σ_min/σ_max in its place.

Reliability of a gearbox from the lives of its parts.

The life of a part has a Weibull law of three parameters, here by its life B_10 at a reliability of
0.9, the shape b and the share f of B_10 that is free of failures:

    R(t) = exp(ln 0.9 ((t/B_10 − f)/(1 − f))^b) for t > f B_10, else 1
    B_1 = B_10 [f + (1 − f) (ln 0.99/ln 0.9)^(1/b)]

The gearbox lives while all parts do: R = Π R_i over every flank, root and bearing of every planet.
Source: Bertsche 2008, Reliability in Automotive and Mechanical Engineering, ch. 6.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Self

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
        return float(_strength(np.log(self.cycles), np.array(self.stress), np.log(cycles)))

    def cycles_at(self, stress: ArrayLike) -> Array:
        """N that the curve bears at stresses of any shape, Pa; 0 above the static one, ∞ on a level
        last part or below it."""
        return _cycles(np.log(self.cycles), np.array(self.stress), np.asarray(stress, dtype=float))


def _strength(log_cycles: Array, curve: Array, at: Array) -> Array:
    """σ_G, Pa, at the logarithm of cycles (…); log_cycles (K,), curve (…, K) Pa."""
    k = np.clip(np.searchsorted(log_cycles, at), 1, len(log_cycles) - 1)
    upper, lower = (np.take_along_axis(curve, i[..., None], -1)[..., 0] for i in (k - 1, k))
    share = np.maximum((at - log_cycles[k - 1]) / (log_cycles[k] - log_cycles[k - 1]), 0.0)
    return np.asarray(upper * (lower / upper) ** share)


def _cycles(log_cycles: Array, curve: Array, stress: Array) -> Array:
    """N at stress (…), Pa; log_cycles (K,), curve (…, K) Pa, falling or level."""
    with np.errstate(divide="ignore"):
        x, heights = np.log(stress), np.log(curve)
    life = np.zeros_like(x)
    for k in range(1, len(log_cycles)):
        upper, lower = heights[..., k - 1], heights[..., k]
        fall = upper - lower
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            share = np.where(fall > 0.0, (upper - x) / fall, np.inf)
            interpolated = np.exp(log_cycles[k - 1] + share * (log_cycles[k] - log_cycles[k - 1]))
        life = np.where(x <= upper, interpolated, life)
    return life


@dataclass(frozen=True)
class Spectrum:
    """A flank or root, or many places of it, over B bins. log_cycles: of the knees (K,);
    curves: σ_G there by bin (B, K), Pa; stress: σ (B, …), Pa; cycles: (B,)."""

    log_cycles: Array
    curves: Array
    stress: Array
    cycles: Array

    @classmethod
    def of(cls, curves: Sequence[LifeCurve], stress: ArrayLike, cycles: ArrayLike) -> Spectrum:
        """curves: of each bin, at least one. ValueError where they have different knees or numbers
        of bins differ."""
        sigma, n = np.asarray(stress, dtype=float), np.asarray(cycles, dtype=float)
        if len({len(curves), len(sigma), *n.shape}) != 1:
            raise ValueError(f"{len(curves)} curves, {sigma.shape} stresses, {n.shape} cycles")
        knees = {curve.cycles for curve in curves}
        if len(knees) > 1:
            raise ValueError("the curves of a spectrum have different knees")
        return cls(np.log(knees.pop()), np.array([curve.stress for curve in curves]), sigma, n)

    def damages(self, factor: Array | float = 1.0) -> Array:
        """n_i/N_i (B, …) with all stresses multiplied; ∞ where a stress is above the static one."""
        shape = (-1, *[1] * (self.stress.ndim - 1))
        curves = self.curves.reshape(*shape, len(self.log_cycles))
        life, n = _cycles(self.log_cycles, curves, factor * self.stress), self.cycles.reshape(shape)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(n > 0.0, n / life, 0.0)

    @property
    def safety(self) -> Array:
        """Largest factor (…) on all stresses with D ≤ 1; ∞ without load.

        Between that of the worst bin alone and its B-th part, as curves are steeper than 1/σ.
        """
        with np.errstate(divide="ignore"):
            alone = _strength(self.log_cycles, self.curves, np.log(self.cycles))
            alone = alone.reshape(-1, *[1] * (self.stress.ndim - 1)) / self.stress
        worst = alone[self.cycles > 0.0].min(axis=0, initial=math.inf)
        high = np.where(np.isfinite(worst), worst, 1.0)
        low = np.where(self.damages(high).sum(axis=0) > 1.0, high / len(self.cycles), high)
        for _ in range(_HALVINGS):
            middle = np.sqrt(low * high)
            if not ((low < middle) & (middle < high)).any():
                break
            over = self.damages(middle).sum(axis=0) > 1.0
            low, high = np.where(over, low, middle), np.where(over, middle, high)
        return np.where(np.isfinite(worst), low, math.inf)


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

    def damage(self, factor: Array | float = 1.0) -> Array:
        """Damage D (places,) under all bins together; factor: on the stresses, one for all places
        or one for each."""
        total: Array | float = 0.0
        for b, curve in enumerate(self.curves):
            lives = curve.cycles_at(factor * self.stress(b))
            with np.errstate(divide="ignore"):
                total = total + self.cycles[b] * (1.0 / lives).mean(axis=0)
        return np.asarray(total)

    def spectrum(self, places: Array) -> Spectrum:
        """Spectrum of some places, with every pass as a bin."""
        stresses = [self.stress(b)[:, places] for b in range(len(self.curves))]
        passes = np.array([len(stress) for stress in stresses])
        of_bins = Spectrum.of(self.curves, passes, self.cycles / passes)
        return replace(
            of_bins,
            curves=np.repeat(of_bins.curves, passes, axis=0),
            stress=np.concatenate(stresses),
            cycles=np.repeat(of_bins.cycles, passes),
        )

    def weakest(self, teeth: int = 1) -> tuple[Array, Array]:
        """Places (teeth,) with the least safety of each tooth, and that: the factor on all stresses
        with D = 1. Places of a tooth follow each other, equally many of each.

        D of every place rises with the factor, so that from one place of a tooth to another with
        more than one at its safety the factor only falls.
        """
        largest = np.max([self.stress(b).max(axis=0) for b in range(len(self.curves))], axis=0)
        each = largest.size // teeth
        place = np.arange(teeth) * each + largest.reshape(teeth, each).argmax(axis=1)
        worst, safety, left = place.copy(), np.full(teeth, np.inf), np.arange(teeth)
        while left.size:
            of_left = self.spectrum(worst[left]).safety
            falls = of_left < safety[left]
            left = left[falls]
            place[left], safety[left] = worst[left], of_left[falls]
            damage = self.damage(np.repeat(np.where(np.isfinite(safety), safety, 1.0), each))
            worst = np.arange(teeth) * each + damage.reshape(teeth, each).argmax(axis=1)
            left = left[damage[worst[left]] > 1.0 + 1e-9]
        return place, safety


WeibullKind = Literal["pitting", "breakage", "ball", "roller"]
# b and f: middles of the ranges that Bertsche 2008 prints; what a life is a life at by its standard
TYPICAL: dict[WeibullKind, tuple[float, float, float]] = {
    "pitting": (1.3, 0.6, 0.99),
    "breakage": (1.7, 0.875, 0.99),
    "ball": (1.1, 0.2, 0.9),
    "roller": (1.35, 0.2, 0.9),
}


@dataclass(frozen=True)
class PartLife:
    """life: B_10, any unit; shape: b; failure_free: f."""

    life: float
    shape: float
    failure_free: float

    @classmethod
    def typical(cls, kind: WeibullKind, life: float) -> Self:
        """Law of a part from its rated life, B_1 of flanks and roots, B_10 of bearings, with
        typical b and f."""
        shape, free, level = TYPICAL[kind]
        return cls(life / cls(1.0, shape, free).at(level), shape, free)

    def at(self, reliability: float) -> float:
        """Life at a reliability, in the unit of ``life``."""
        spread = (math.log(reliability) / math.log(0.9)) ** (1 / self.shape)
        return self.life * (self.failure_free + (1 - self.failure_free) * spread)

    def reliability(self, time: float) -> float:
        """R(t), t in the unit of ``life``."""
        past = (time / self.life - self.failure_free) / (1 - self.failure_free)
        return 0.9 ** (past**self.shape) if past > 0 else 1.0


def system_reliability(parts: Sequence[PartLife], time: float) -> float:
    """Π R_i(t)."""
    return math.prod(part.reliability(time) for part in parts)
