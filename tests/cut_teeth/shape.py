"""Half of a cut tooth as points, and where it is as thick as ISO 6336-3 takes its root."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from cut_teeth.envelope import Points, root
from cut_teeth.gear import Gear

ON_FLANK, ON_ROOT = 160, 400
SECTION = {False: 30.0, True: 60.0}  # degrees between tangent and middle line


@dataclass(frozen=True, eq=False)
class Shape:
    """Points of the +y side: flank (ON_FLANK,) from the tip to where the involute ends, root from
    there to the root circle, as x + iy in m; section: on the root, where its tangent makes 30° (60°
    inside) with the tooth's middle line, or where the root begins if it is steeper there."""

    gear: Gear
    flank: Points
    root: Points
    section: complex

    @property
    def root_thickness(self) -> float:
        """At the section, m."""
        return 2.0 * self.section.imag

    @property
    def form_radius(self) -> float:
        """Where the involute ends, m."""
        return float(abs(self.flank[-1]))


@lru_cache(maxsize=64)
def shape(gear: Gear) -> Shape:
    """Cut by its tool in many positions."""
    line = root(gear, ON_ROOT)
    radius = np.linspace(gear.tip_radius, abs(line[0]), ON_FLANK)
    flank = radius * np.exp(1j * gear.half_angle(radius))
    flank[-1] = line[0]
    edges = np.diff(line)
    slope = np.degrees(np.arctan2(edges.imag, -gear.outward * edges.real))
    steep = int(np.argmax(slope > SECTION[gear.internal]))
    return Shape(gear, flank, line, complex(line[steep]))


def load_angle(gear: Gear, radius: float) -> float:
    """Between a load normal to the flank at a radius and the normal of the middle line, rad."""
    alpha = math.acos(gear.base_radius / radius)
    return alpha - gear.outward * float(gear.half_angle(radius))
