"""Small rigid motion and axes turned about z: motions in the order ux, uy, uz, rx, ry, rz."""

from __future__ import annotations

import numpy as np

from flexgear.arrays import Array


def rotation(angle: Array | float) -> Array:
    """(..., 3, 3) that takes components along axes turned by ``angle`` (...) about z to fixed axes.

    rad; row vectors turn by its transpose.
    """
    angle = np.asarray(angle, dtype=float)
    out = np.zeros((*angle.shape, 3, 3))
    out[..., 0, 0] = out[..., 1, 1] = np.cos(angle)
    out[..., 1, 0] = np.sin(angle)
    out[..., 0, 1] = -out[..., 1, 0]
    out[..., 2, 2] = 1.0
    return out


def turn(angle: float) -> Array:
    """The same (6, 6) for the six components of a node's motion or of a wrench."""
    return six(rotation(angle))


def six(turn3: Array) -> Array:
    """A turn (3, 3) of translations and rotations alike, (6, 6)."""
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = turn3
    return out


def rigid_motion(arms: Array) -> Array:
    """H (m, 3, 6) with u = t + θ x arm = H [t, θ]; arms (m, 3) in m."""
    h = np.zeros((len(arms), 3, 6))
    h[:, [0, 1, 2], [0, 1, 2]] = 1.0
    x, y, z = arms.T
    h[:, 0, 4], h[:, 0, 5] = z, -y
    h[:, 1, 3], h[:, 1, 5] = -z, x
    h[:, 2, 3], h[:, 2, 4] = y, -x
    return h


def rigid_rows(positions: Array, centre: Array | None = None) -> Array:
    """Motion (6 n, 6) of nodes under rigid motion of ``centre``: u = t + θ x (x − x0), and θ."""
    arms = np.atleast_2d(positions) - (0.0 if centre is None else centre)
    rows = np.zeros((len(arms), 6, 6))
    rows[:, :3] = rigid_motion(arms)
    rows[:, 3:, 3:] = np.eye(3)
    return rows.reshape(-1, 6)
