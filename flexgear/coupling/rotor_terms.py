"""What bodies in turning frames feel: constant axes, centrifugal and gyroscopic forces."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.members import Member
from flexgear.model.stage import Stage

Array = NDArray[np.float64]


def planet_axes(stage: Stage, m: Member) -> float:
    """Constant angle of a body's axes in its stage's frame, rad."""
    if m.planet >= 0:
        return stage.planet_angles[m.planet]
    return m.port("gear").axes


def orbit_force(stage: Stage, m: Member, radius: float, speed: float) -> Array:
    """Centrifugal force (6,) on a planet in its own axes, N."""
    out = np.zeros(6)
    if m.planet >= 0:
        out[0] = m.mass * radius * speed**2
    return out


def frame_matrices(m: Member, frame_speed: float, spin: float) -> tuple[Array, Array]:
    """G and C (d, d) of a lumped body in a frame that turns at ``frame_speed``, rad/s.

    M q̈ + G q̇ + (K − C) q with E = [[0, −1], [1, 0]]: translations G = 2 m ω E, C = m ω²; tilts of
    a body of polar inertia J_p that spins at Ω (absolute) G = (2 J_t ω − J_p Ω) E and
    C = J_t ω² − J_p Ω ω (Genta 2005, Dynamics of Rotating Systems, §2.6, in rotating axes).
    """
    turning, centripetal = np.zeros((6, 6)), np.zeros((6, 6))
    e = np.array([[0.0, -1.0], [1.0, 0.0]])
    w = frame_speed
    turning[:2, :2], centripetal[:2, :2] = 2 * m.mass * w * e, m.mass * w**2 * np.eye(2)
    turning[3:5, 3:5] = (2 * m.tilt * w - m.inertia * spin) * e
    centripetal[3:5, 3:5] = (m.tilt * w**2 - m.inertia * spin * w) * np.eye(2)
    dofs = m.body.node_map
    return dofs.T @ turning @ dofs, dofs.T @ centripetal @ dofs
