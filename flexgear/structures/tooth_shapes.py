r"""Shapes along the face that a tooth of an FE ring takes beside the rigid motion of its node.

The node of an averaging tie knows the rigid motion q of the tooth's base section. What the section
does besides along the face it says by amplitudes p of shapes S: the section of the tooth at z moves
and turns as a whole, by Legendre polynomials over the face width b,

    u(x) = [e_r, e_t, e_z, e_z × (x − x_c)] P_k(2 z/b),   k = 2, 3, 4,

in axes that follow the helix through the tooth's middle x_c(z). The best rigid motion within each
is taken off, S' = S − H N with N = (∫HᵀH dA)⁻¹ ∫HᵀS dA, so that node and shapes do not share
anything and rigid motion has none of them:

    p = (∫ S'ᵀS' dA)⁻¹ ∫ S'ᵀ u dA = B_s u.

Loads B_sᵀ f are in equilibrium by themselves, on the base section alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander

from flexgear.arrays import Array
from flexgear.structures.kinematics import rigid_motion

ORDERS = (2, 3, 4)  # of Legendre polynomials along the face; lower ones are the node's
COUNT = 4 * len(ORDERS)
BOTH = 6 + COUNT  # motions of a node and its shapes
BEYOND = 2  # teeth in +θ that a tooth moves so


@dataclass(frozen=True)
class ToothLine:
    """Middle of a tooth along the face: angle rad at z = 0, radius m of its node, helix_rate rad/m,
    face_width m."""

    angle: float
    radius: float
    helix_rate: float
    face_width: float

    @property
    def place(self) -> Array:
        """(3,) m of the node."""
        return self.radius * np.array([np.cos(self.angle), np.sin(self.angle), 0.0])

    def shapes(self, points: Array) -> Array:
        """S (m, 3, COUNT) at points (m, 3) m: translations 1, turn m."""
        angle = self.angle + self.helix_rate * points[:, 2]
        zero, one = np.zeros_like(angle), np.ones_like(angle)
        radial = np.stack([np.cos(angle), np.sin(angle), zero], axis=1)
        across = np.stack([-np.sin(angle), np.cos(angle), zero], axis=1)
        along = np.stack([zero, zero, one], axis=1)
        turned = np.cross(along, points - self.radius * radial)
        motion = np.stack([radial, across, along, turned], axis=2)
        orders = legvander(2 * points[:, 2] / self.face_width, max(ORDERS))[:, ORDERS]
        return np.einsum("mci,mk->mcki", motion, orders).reshape(len(points), 3, COUNT)


@dataclass(frozen=True, eq=False)
class RimFlexibility:
    """ΔT of a tooth and of those next to it, components along the axes of each at its middle.

    tooth (BOTH, BOTH), beside (BEYOND, BOTH, BOTH): without the block of the node; less: N; line:
    of the tooth at the angle 0.
    """

    tooth: Array
    beside: Array
    less: Array
    line: ToothLine


def carried(line: ToothLine, less: Array, points: Array, normals: Array) -> Array:
    """G (k, 6 + COUNT): displacement along normals (k, 3) at points (k, 3) by unit motions of the
    node and unit amplitudes of the shapes."""
    rigid = rigid_motion(points - line.place)
    both = np.concatenate([rigid, line.shapes(points) - rigid @ less], axis=2)
    return np.einsum("ki,kij->kj", normals, both)
