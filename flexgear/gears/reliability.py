"""Reliability of a gearbox from the lives of its parts.

The life of a part has a Weibull law of three parameters, here by its life B_10 at a reliability of
0.9, the shape b and the share f of B_10 that is free of failures:

    R(t) = exp(ln 0.9 ((t/B_10 − f)/(1 − f))^b) for t > f B_10, else 1
    B_1 = B_10 [f + (1 − f) (ln 0.99/ln 0.9)^(1/b)]

The gearbox lives while all parts do: R = Π R_i over every flank, root and bearing of every planet.
Source: Bertsche 2008, Reliability in Automotive and Mechanical Engineering, ch. 6.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
import scipy

Kind = Literal["pitting", "breakage", "ball", "roller"]
# b and f: middles of the ranges that Bertsche 2008 prints; what a life is a life at by its standard
TYPICAL: dict[Kind, tuple[float, float, float]] = {
    "pitting": (1.3, 0.6, 0.99),
    "breakage": (1.7, 0.875, 0.99),
    "ball": (1.1, 0.2, 0.9),
    "roller": (1.35, 0.2, 0.9),
}
_LEVELS = (90, 95, 96, 97, 98, 99, 99.2, 99.4, 99.6, 99.8, 99.9, 99.92, 99.94, 99.95)  # per cent
_FACTORS = (1, 0.64, 0.55, 0.47, 0.37, 0.25, 0.22, 0.19, 0.16, 0.12, 0.093, 0.087, 0.08, 0.077)


@dataclass(frozen=True)
class PartLife:
    """life: B_10, any unit; shape: b; failure_free: f."""

    life: float
    shape: float
    failure_free: float

    @classmethod
    def typical(cls, kind: Kind, life: float) -> Self:
        """Of a rated life: B_1 of flanks and roots, B_10 of bearings, with typical b and f."""
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


def system_life(parts: Sequence[PartLife], reliability: float = 0.9) -> float:
    """Time at which the product has fallen to a reliability in (0, 1); inf where nothing fails."""
    lasting = [part for part in parts if math.isfinite(part.life)]
    if not lasting:
        return math.inf
    upper = min(part.at(reliability) for part in lasting)  # of the weakest part alone
    lower = min(part.at(reliability ** (1 / len(lasting))) for part in lasting)

    def excess(time: float) -> float:
        return system_reliability(lasting, time) - reliability

    if excess(upper) >= 0:
        return upper
    if excess(lower) <= 0:
        return lower
    return float(scipy.optimize.brentq(excess, lower, upper, rtol=1e-12))


def reliability_factor(reliability: float) -> float:
    """a_1 of ISO 281:2007, table 12, from 0.9 to 0.9995; between its rows ln a_1 is linear over
    ln(−ln R)."""
    if not 0.9 <= reliability <= 0.9995:
        raise ValueError("a_1 is stated for reliabilities from 0.9 to 0.9995")
    levels = -np.log(-np.log(np.array(_LEVELS) / 100))
    place = -math.log(-math.log(reliability))
    return float(np.exp(np.interp(place, levels, np.log(_FACTORS))))
