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

Kind = Literal["pitting", "breakage", "ball", "roller"]
# b and f: middles of the ranges that Bertsche 2008 prints; what a life is a life at by its standard
TYPICAL: dict[Kind, tuple[float, float, float]] = {
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
