"""Life curves, Miner's sum of load spectra (ISO 6336-6) and of points of a tooth, reliability.

A curve of stress σ_G over cycles N is straight in logarithms between its knees. The first and last
segments extend beyond their knees, the first up to the static strength: a higher stress fails at
once. Without a static strength that is the stress at the first knee. Miner's sum over bins of n_i
cycles is

    D = Σ n_i/N_i(σ_i),

and the safety of a spectrum is the factor S on all stresses with D(S) = 1, for one bin σ_G(n)/σ.
Bins may have different curves, as Z_L Z_v Z_R depend on speed.

Beyond ISO 6336: Miner's sum at every point of a tooth from computed stresses. A point has n cycles
in a bin, in equal numbers in P passes of stress σ_p, so that

    D = Σ_bins n/P Σ_p 1/N(σ_p),

and the life of a tooth is that of its worst point. A fillet with the largest stress σ_max and the
least stress σ_min < 0 counts with the pulsating stress of the same damage,

    σ = σ_max − σ_min (1 − M)/(1 + M),

which is Y_M of ISO 6336-3, annex B, with the computed R = σ_min/σ_max.

Reliability of a gearbox from the lives of its parts: a part has a Weibull distribution of three
parameters, the life B_10 at a reliability of 0.9, the shape b and the failure-free share f of B_10:

    R(t) = exp(ln 0.9 ((t/B_10 − f)/(1 − f))^b) for t > f B_10, else 1
    B_1 = B_10 [f + (1 − f) (ln 0.99/ln 0.9)^(1/b)]

The gearbox survives if all parts do: R = Π R_i over every flank, root and bearing of every planet.
Source: Bertsche 2008, Reliability in Automotive and Mechanical Engineering, ch. 6.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy  # loads a subpackage at its first use
from numpy.typing import ArrayLike

from flexgear.arrays import Array

_HALVINGS = 100


@dataclass(frozen=True)
class LifeCurve:
    """Curve of strength over cycles: rising ``cycles`` (K,) of the knees, and σ_G there, ``stress``
    (K,), Pa, falling or constant; static: strength for any number of cycles, Pa, None for σ_G at
    the first knee."""

    cycles: tuple[float, ...]
    stress: tuple[float, ...]
    static: float | None = None

    @property
    def limit(self) -> float:
        """Static strength, Pa."""
        return self.stress[0] if self.static is None else self.static

    def stress_at(self, cycles: float) -> float:
        """Strength σ_G at a number of cycles, Pa."""
        knees, stress = np.log(self.cycles), np.array(self.stress)
        return float(_strength(knees, stress, np.array(self.limit), np.log(cycles)))

    def cycles_at(self, stress: ArrayLike) -> Array:
        """Cycles N to failure at stresses of any shape, Pa; 0 above static strength, ∞ on or below
        a constant last segment."""
        sigma, limit = np.asarray(stress, dtype=float), np.array(self.limit)
        return _cycles(np.log(self.cycles), np.array(self.stress), limit, sigma)


def _strength(log_cycles: Array, curve: Array, limit: Array, at: Array) -> Array:
    """Strength (…), Pa, at logarithms of cycles ``at`` (…); log_cycles: of the knees (K,); curve:
    strength there (…, K), Pa; limit: static strength (…), Pa."""
    k = np.clip(np.searchsorted(log_cycles, at), 1, len(log_cycles) - 1)
    upper, lower = (np.take_along_axis(curve, i[..., None], -1)[..., 0] for i in (k - 1, k))
    share = (at - log_cycles[k - 1]) / (log_cycles[k] - log_cycles[k - 1])
    return np.minimum(upper * (lower / upper) ** share, limit)


def _cycles(log_cycles: Array, curve: Array, limit: Array, stress: Array) -> Array:
    """Cycles to failure at stresses (…), Pa; log_cycles, curve, limit: as in ``_strength``."""
    with np.errstate(divide="ignore"):
        x, heights = np.log(stress), np.log(curve)
    life = np.zeros_like(x)
    for k in range(1, len(log_cycles)):
        upper, lower = heights[..., k - 1], heights[..., k]
        fall = upper - lower
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            share = np.where(fall > 0.0, (upper - x) / fall, np.inf)
            interpolated = np.exp(log_cycles[k - 1] + share * (log_cycles[k] - log_cycles[k - 1]))
        life = np.where(x <= (np.log(limit) if k == 1 else upper), interpolated, life)
    return life


@dataclass(frozen=True)
class Spectrum:
    """Stress of a flank or root, or of many points, in B bins. log_cycles: of the knees (K,);
    curves, limits: σ_G there (B, K) and static strength (B,) by bin, Pa; stress: σ (B, …), Pa;
    cycles: (B,)."""

    log_cycles: Array
    curves: Array
    limits: Array
    stress: Array
    cycles: Array

    @classmethod
    def of(cls, curves: Sequence[LifeCurve], stress: ArrayLike, cycles: ArrayLike) -> Self:
        """Spectrum of B ≥ 1 bins with the life curve, stress (…), Pa, and cycles of each. Raises
        ValueError if knees or numbers of bins differ."""
        sigma, n = np.asarray(stress, dtype=float), np.asarray(cycles, dtype=float)
        if len({len(curves), len(sigma), *n.shape}) != 1:
            raise ValueError(f"{len(curves)} curves, {sigma.shape} stresses, {n.shape} cycles")
        knees = {curve.cycles for curve in curves}
        if len(knees) > 1:
            raise ValueError("the curves of a spectrum have different knees")
        stresses = np.array([curve.stress for curve in curves])
        limits = np.array([curve.limit for curve in curves])
        return cls(np.log(knees.pop()), stresses, limits, sigma, n)

    def damages(self, factor: Array | float = 1.0) -> Array:
        """Damage n_i/N_i (B, …) of each bin with all stresses times ``factor``; ∞ above static
        strength."""
        shape = (-1, *[1] * (self.stress.ndim - 1))
        curves = self.curves.reshape(*shape, len(self.log_cycles))
        limits, n = self.limits.reshape(shape), self.cycles.reshape(shape)
        life = _cycles(self.log_cycles, curves, limits, factor * self.stress)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(n > 0.0, n / life, 0.0)

    @property
    def safety(self) -> Array:
        """Largest factor (…) on all stresses with D ≤ 1; ∞ without load. It is between 1/B and 1
        times the factor of the worst bin, as N falls faster than 1/σ."""
        with np.errstate(divide="ignore"):
            by_bin = _strength(self.log_cycles, self.curves, self.limits, np.log(self.cycles))
            by_bin = by_bin.reshape(-1, *[1] * (self.stress.ndim - 1)) / self.stress
        worst = by_bin[self.cycles > 0.0].min(axis=0, initial=math.inf)
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
    """Pulsating stress of the same damage as stress between ``least`` and ``largest``, Pa;
    influence: (1 − M)/(1 + M)."""
    return largest - np.minimum(least, 0.0) * influence


def around_axis(angles: Array, values: Array, at: Array) -> Array:
    """Periodic linear interpolation: values (z, …) at angles ``at`` (z,), rad, from values (C, …)
    at ``angles`` (C,) in [0, 2π)."""
    turn, order = 2.0 * np.pi, np.argsort(angles)
    order = np.append(order, order[0])
    rising = np.append(angles[order[:-1]], angles[order[0]] + turn)
    curve = scipy.interpolate.make_interp_spline(rising, values[order], k=1)
    return np.asarray(curve(rising[0] + np.mod(at - rising[0], turn)))


@dataclass(frozen=True)
class Places:
    """Points of a flank or root in B load bins. stress: function that returns the stress (passes,
    points), Pa, in a bin by its index; curves: life curve of each bin; cycles: (B,)."""

    stress: Callable[[int], Array]
    curves: tuple[LifeCurve, ...]
    cycles: Array

    def damage(self, factor: Array | float = 1.0) -> Array:
        """Miner's sum D (points,) of all bins; factor: on the stresses, one for all or one for each
        point."""
        total: Array | float = 0.0
        for b, curve in enumerate(self.curves):
            lives = curve.cycles_at(factor * self.stress(b))
            with np.errstate(divide="ignore"):
                total = total + self.cycles[b] * (1.0 / lives).mean(axis=0)
        return np.asarray(total)

    def spectrum(self, places: Array) -> Spectrum:
        """Spectrum of the points with indices ``places``; every pass is a bin."""
        stresses = [self.stress(b)[:, places] for b in range(len(self.curves))]
        passes = np.array([len(stress) for stress in stresses])
        by_bin = Spectrum.of(self.curves, passes, self.cycles / passes)
        return replace(
            by_bin,
            curves=np.repeat(by_bin.curves, passes, axis=0),
            limits=np.repeat(by_bin.limits, passes),
            stress=np.concatenate(stresses),
            cycles=np.repeat(by_bin.cycles, passes),
        )

    def weakest(self, teeth: int = 1) -> tuple[Array, Array]:
        """Index of the point with the least safety on each tooth, and that safety, (teeth,) each.

        Points are ordered tooth by tooth, equally many on each. As D of every point rises with the
        factor on stresses, moving on from a point to one with D > 1 at its safety only lowers the
        factor.
        """
        largest = np.max([self.stress(b).max(axis=0) for b in range(len(self.curves))], axis=0)
        count = largest.size // teeth
        first = np.arange(teeth) * count
        place = first + largest.reshape(teeth, count).argmax(axis=1)
        worst, safety, active = place.copy(), np.full(teeth, np.inf), np.arange(teeth)
        while active.size:
            candidates = self.spectrum(worst[active]).safety
            lower = candidates < safety[active]
            active = active[lower]
            place[active], safety[active] = worst[active], candidates[lower]
            damage = self.damage(np.repeat(np.where(np.isfinite(safety), safety, 1.0), count))
            worst = first + damage.reshape(teeth, count).argmax(axis=1)
            active = active[damage[worst[active]] > 1.0 + 1e-9]
        return place, safety


# of pitting, breakage, and bearings by their elements: b and f, middles of the ranges in Bertsche
# 2008, and the reliability at which standards rate lives
TYPICAL = {
    "flank": (1.3, 0.6, 0.99),
    "root": (1.7, 0.875, 0.99),
    "ball": (1.1, 0.2, 0.9),
    "roller": (1.35, 0.2, 0.9),
}


@dataclass(frozen=True)
class PartLife:
    """Weibull distribution of a part: ``life`` B_10, ``shape`` b, ``failure_free`` share f."""

    life: float
    shape: float
    failure_free: float

    @classmethod
    def typical(cls, kind: str, life: float) -> Self:
        """Distribution with typical b and f from the rated life: B_1 of flanks and roots, B_10 of
        bearings."""
        shape, free, level = TYPICAL[kind]
        return cls(life / cls(1.0, shape, free).at(level), shape, free)

    def at(self, reliability: float) -> float:
        """Life at a reliability, in the unit of ``life``."""
        spread = (math.log(reliability) / math.log(0.9)) ** (1 / self.shape)
        return self.life * (self.failure_free + (1 - self.failure_free) * spread)

    def reliability(self, time: float) -> float:
        """Reliability R at a time, in the unit of ``life``."""
        past = (time / self.life - self.failure_free) / (1 - self.failure_free)
        return 0.9 ** (past**self.shape) if past > 0 else 1.0


def system_reliability(parts: Sequence[PartLife], time: float) -> float:
    """Reliability Π R_i of a system that fails with its first part, at a time."""
    return math.prod(part.reliability(time) for part in parts)
