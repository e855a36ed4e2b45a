"""Laws of what drives and loads a train at its ports; torques are from outside on the member.

given torque   T(t)
given speed    ω(t): a row of constraint, whose torque is whatever it takes
brake          T = −T_r sign(ω) |ω/ω_r|ⁿ
controller     T = k_p (ω_s − ω) + k_i ∫ (ω_s − ω) dt within limits, to a set speed ω_s(t)

What is prescribed to a machine over time, T, ω or ω_s, is no part of its law
(``analysis.transient.Drive``).
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class GivenTorque:
    """A machine whose torque does not depend on its speed."""


@dataclass(frozen=True)
class GivenSpeed:
    """Speed of its own, whatever the torque."""


@dataclass(frozen=True)
class Brake:
    """Torque T = rated_torque · sign(ω) |ω/rated_speed|^exponent against the motion, N·m;
    T = rated_torque, of either sign, where the rated speed is zero."""

    rated_torque: float
    rated_speed: float
    exponent: float

    def torque(self, speed: float) -> float:
        """What it takes at a speed, N·m."""
        if self.rated_speed == 0.0:
            return self.rated_torque
        ratio = abs(speed) / self.rated_speed
        return math.copysign(self.rated_torque * ratio**self.exponent, speed)

    def speed(self, torque: float) -> float | None:
        """Speed at which it takes a torque, rad/s; None where any may be."""
        if self.rated_torque == 0.0 or self.exponent == 0.0 or self.rated_speed == 0.0:
            return None
        ratio = abs(torque) / self.rated_torque
        return math.copysign(ratio ** (1 / self.exponent) * self.rated_speed, torque)


@dataclass(frozen=True)
class Controller:
    """PI speed controller: proportional k_p N·m·s/rad, integral k_i N·m/rad, torques it may give
    from least to most, N·m. The integral stands while the torque is at a limit and the error would
    push it on, so that it does not wind up (conditional integration: Åström, Hägglund 2006)."""

    proportional: float
    integral: float
    least: float = -math.inf
    most: float = math.inf


Machine = GivenTorque | GivenSpeed | Brake | Controller
