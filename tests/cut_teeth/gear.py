"""One spur or helical gear as numbers, and its involute; nothing of flexgear is used.

A string of length t r_b unrolled from the base circle ends on the involute, at the angle
t − arctan t from where the involute begins.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from flexgear.arrays import Array


def involute(angle: float) -> float:
    """inv α, rad."""
    return math.tan(angle) - angle


def inverse(value: float) -> float:
    """α with inv α = value, rad."""
    return float(brentq(lambda angle: involute(angle) - value, 1e-3, 1.4, xtol=1e-15))


@dataclass(frozen=True)
class Gear:
    """Normal module m (m), angles rad, coefficients over the module; shift: thickens the tooth of a
    ring, too. cutter_teeth: 0 for a rack. protuberance, allowance: of the tool, m; ramp: angle of
    the protuberance's flank, rad."""

    teeth: int
    module: float
    internal: bool = False
    shift: float = 0.0
    alpha: float = math.radians(20.0)
    helix: float = 0.0
    addendum: float = 1.0
    dedendum: float = 1.25
    rounding: float = 0.38
    cutter_teeth: int = 0
    cutter_shift: float = 0.0
    protuberance: float = 0.0
    allowance: float = 0.0
    ramp: float = math.radians(8.0)

    @property
    def outward(self) -> int:
        """1, −1 of a ring."""
        return -1 if self.internal else 1

    @property
    def transverse(self) -> float:
        """Pressure angle in the transverse section, rad."""
        return math.atan2(math.tan(self.alpha), math.cos(self.helix))

    @property
    def pitch(self) -> float:
        """Along the reference circle, transverse, m."""
        return math.pi * self.module / math.cos(self.helix)

    @property
    def pitch_angle(self) -> float:
        """Of one tooth, rad."""
        return 2 * math.pi / self.teeth

    @property
    def reference_radius(self) -> float:
        """m."""
        return self.pitch * self.teeth / (2 * math.pi)

    @property
    def base_radius(self) -> float:
        """m."""
        return self.reference_radius * math.cos(self.transverse)

    @property
    def tip_radius(self) -> float:
        """m."""
        return self.reference_radius + self.outward * self.module * (self.addendum + self.shift)

    @property
    def root_radius(self) -> float:
        """m."""
        return self.reference_radius - self.outward * self.module * (self.dedendum - self.shift)

    @property
    def base_pitch(self) -> float:
        """m."""
        return self.pitch * math.cos(self.transverse)

    @property
    def thickness(self) -> float:
        """Of the tooth along the reference circle, m."""
        more = 2 * self.shift * self.module * math.tan(self.alpha) / math.cos(self.helix)
        return self.pitch / 2 + more

    def roll_length(self, radius: float) -> float:
        """Length of the unrolled string at a radius, m."""
        return math.sqrt(max(radius**2 - self.base_radius**2, 0.0))

    def half_angle(self, radius: Array | float) -> Array:
        """Of the involute tooth, rad; below the base circle that at the base circle."""
        t = np.sqrt(np.maximum((np.asarray(radius) / self.base_radius) ** 2 - 1.0, 0.0))
        at_reference = self.thickness / (2 * self.reference_radius)
        unrolled = t - np.arctan(t) - involute(self.transverse)
        return np.asarray(at_reference - self.outward * unrolled)

    def tangent_distance(self, mate: Gear, working: float) -> float:
        """Between both base tangent points on the line of action, m."""
        return (mate.base_radius + mate.outward * self.base_radius) * math.tan(working)

    def path_of_contact(self, mate: Gear, working: float) -> tuple[float, float]:
        """Its ends at both tips, from this gear's base tangent point, m."""
        between = self.tangent_distance(mate, working)
        mate_tip = mate.roll_length(mate.tip_radius)
        start = mate_tip - between if mate.internal else between - mate_tip
        return start, self.roll_length(self.tip_radius)


def working(gear: Gear, mate: Gear) -> tuple[float, float]:
    """Distance of the axes (m) without play, and transverse working angle (rad); mate: may be a
    ring, or gear where it is cut by ``gear``."""
    shifts = 2 * math.tan(gear.alpha) * (gear.shift + mate.shift)
    angle = involute(gear.transverse) + shifts / (gear.teeth + mate.outward * mate.teeth)
    working_angle = inverse(angle)
    arm = gear.base_radius + mate.outward * mate.base_radius
    return abs(arm) / math.cos(working_angle), working_angle
