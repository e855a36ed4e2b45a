"""Teeth as point sets, written down from the definition of the involute and nothing else.

Independent of ``flexgear.gears.contact``: angles of tooth centres, half angles at a radius, helix.
"""

import math

import numpy as np


def inv(angle):
    return np.tan(angle) - angle


def half_angle(gear, radius, at):
    """Half angle of a tooth at a radius: thinner outward outside, thicker outward inside."""
    local = np.arccos(gear.base_radius / radius)
    sign = 1.0 if gear.internal else -1.0
    return gear.thickness / (2 * gear.reference_radius) + sign * (inv(local) - inv(at))


class Teeth:
    """Flank points of one gear: centre of tooth n at first + 2πn/z + twist·z."""

    def __init__(self, gear, at, twist, first, centre=(0.0, 0.0)):
        self.gear, self.at, self.twist, self.first = gear, at, twist, first
        self.centre = np.asarray(centre, dtype=float)
        self.removed = {-1: 0.0, 1: 0.0}

    def thin(self, depth, side):
        """Move the flanks of one side back by ``depth`` along the transverse line of action."""
        self.removed[side] = depth / self.gear.base_radius

    def half(self, radius, side):
        return half_angle(self.gear, radius, self.at) - self.removed[side]

    def point(self, number, side, radius, z):
        """Point (3,) on the flank at side·(half angle) of a tooth."""
        angle = (
            self.first
            + 2 * math.pi * number / self.gear.teeth
            + self.twist * z
            + side * self.half(radius, side)
        )
        x = self.centre + radius * np.array([math.cos(angle), math.sin(angle)])
        return np.array([*x, z])

    def tooth_direction(self, number, z):
        """Point on the middle line of a tooth at its reference radius."""
        angle = self.first + 2 * math.pi * number / self.gear.teeth + self.twist * z
        return self.centre + self.gear.reference_radius * np.array(
            [math.cos(angle), math.sin(angle)]
        )

    def locate(self, point, side):
        """Tooth number (real) whose flank on ``side`` passes through a point (3,)."""
        r = np.asarray(point[:2]) - self.centre
        radius = float(np.hypot(*r))
        angle = math.atan2(r[1], r[0]) - side * self.half(radius, side)
        return (angle - self.first - self.twist * point[2]) * self.gear.teeth / (2 * math.pi)

    def normal(self, number, side, radius, z, h=1e-6):
        """Unit normal (3,) of a flank from two tangents by central differences."""
        d = h * self.gear.reference_radius
        along = self.point(number, side, radius + d, z) - self.point(number, side, radius - d, z)
        lead = self.point(number, side, radius, z + d) - self.point(number, side, radius, z - d)
        n = np.cross(along, lead)
        return n / np.linalg.norm(n)
