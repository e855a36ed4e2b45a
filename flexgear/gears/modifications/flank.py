"""One flank of a gear, as functions of modifications see it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array

Gap = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class Flank:
    """The active profile of a gear's flank, which is the path of contact with its mate, and its
    face; m.

    tip, root: radii of curvature ρ at its ends; half_face; base_radius. ρ rises towards the tip of
    an external gear and falls towards that of an internal one.
    """

    tip: float
    root: float
    half_face: float
    base_radius: float

    @property
    def path(self) -> float:
        """Length of the active profile on the path of contact, m."""
        return abs(self.tip - self.root)

    def height(self, rho: Array) -> Array:
        """ξ: 0 at the root end of the active profile, 1 at the tip; linear in ρ."""
        return np.asarray((rho - self.root) / (self.tip - self.root))

    def width(self, z: Array) -> Array:
        """ζ = z/b: −1/2 at the −z end of the face, +1/2 at its +z end."""
        return np.asarray(0.5 * z / self.half_face)

    def roll_length(self, diameter: float) -> float:
        """ρ = √(d²/4 − r_b²) at a diameter, m; 0 within the base circle."""
        return math.sqrt(max(0.25 * diameter**2 - self.base_radius**2, 0.0))
