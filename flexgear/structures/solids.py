r"""Volume and moments of solids in closed form, and the mass of a rigid body made of them.

    V = \int dV,   s = \int x dV,   S = \int x x^T dV,

of prisms along z over polygons (Green's theorem) and circles. A rigid motion u + theta x x of such
a body has

    M = rho [V I, -[s]x; [s]x, tr(S) I - S],   [s]x v = s x v.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Solid:
    """volume: V, m³; first: s (3,) m⁴; second: S (3, 3) m⁵, about the origin."""

    volume: float
    first: Array
    second: Array

    def __add__(self, other: Solid) -> Solid:
        return Solid(
            self.volume + other.volume, self.first + other.first, self.second + other.second
        )

    def __sub__(self, other: Solid) -> Solid:
        return Solid(
            self.volume - other.volume, self.first - other.first, self.second - other.second
        )

    def shifted(self, by: Array) -> Solid:
        """The same solid moved by (3,) m."""
        mixed = np.outer(by, self.first)
        return Solid(
            self.volume,
            self.first + self.volume * by,
            self.second + mixed + mixed.T + self.volume * np.outer(by, by),
        )

    def mirrored(self) -> Solid:
        """Its image in the plane z = 0."""
        image = np.array([1.0, 1.0, -1.0])
        return Solid(self.volume, image * self.first, np.outer(image, image) * self.second)

    def rigid_mass(self, density: float) -> Array:
        """M (6, 6) for ux, uy, uz, rx, ry, rz of the origin; density in kg/m³."""
        x, y, z = self.first
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        out = np.empty((6, 6))
        out[:3, :3] = self.volume * np.eye(3)
        out[:3, 3:], out[3:, :3] = -cross, cross
        out[3:, 3:] = np.trace(self.second) * np.eye(3) - self.second
        return density * out


EMPTY = Solid(0.0, np.zeros(3), np.zeros((3, 3)))


def cylinder(
    radius: float, low: float, high: float, centre: tuple[float, float] = (0.0, 0.0)
) -> Solid:
    """Solid cylinder between the heights low and high; m."""
    x, y = centre
    area = pi * radius**2
    inertia = area * radius**2 / 4
    plane = area * np.outer((x, y), (x, y)) + inertia * np.eye(2)
    return _prism(area, area * np.array([x, y]), plane, low, high)


def prism(corners: Array, low: float, high: float) -> Solid:
    """Over a polygon (n, 2) m with its corners counter-clockwise."""
    p, q = corners, np.roll(corners, -1, axis=0)
    twice = p[:, 0] * q[:, 1] - q[:, 0] * p[:, 1]
    mid = p + q
    plane = np.einsum("k,ki,kj->ij", twice, mid, mid)
    plane += np.einsum("k,ki,kj->ij", twice, p, p) + np.einsum("k,ki,kj->ij", twice, q, q)
    return _prism(float(twice.sum() / 2), twice @ mid / 6, plane / 24, low, high)


def _prism(area: float, first: Array, second: Array, low: float, high: float) -> Solid:
    """From the plane moments ∫dA, ∫x dA (2,), ∫x xᵀ dA (2, 2)."""
    long, squared, cubed = high - low, (high**2 - low**2) / 2, (high**3 - low**3) / 3
    out = np.empty((3, 3))
    out[:2, :2] = long * second
    out[:2, 2] = out[2, :2] = squared * first
    out[2, 2] = cubed * area
    return Solid(long * area, np.array([*(long * first), squared * area]), out)
