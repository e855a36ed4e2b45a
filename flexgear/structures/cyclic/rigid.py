r"""Rigid motion of one sector, which its condensed matrices keep to the last digit.

Where a large body bends softly, its sectors move nearly as rigid pieces, and rounding of the size
of a sector's own stiffness would outweigh what strain there is. Of a free sector condensed to its
borders, S x_b, with B^ the motion its ties take from them and R rigid motion (R_b on the borders),

    S R_b = 0,   B^ R_b = B R

hold exactly, if what both of its neighbours add at a border is shared out rightly; only the sum
of the two shares counts. With R_b^T R_b = I these are restored by the smallest changes that do so,

    S <- (I - R_b R_b^T) S (I - R_b R_b^T),   B^ <- B^ + (B R - B^ R_b) R_b^T.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.structures.cyclic.sectors import Sectors
from flexgear.structures.kinematics import rigid_motion, rotation

Array = NDArray[np.float64]


def rigid_fields(nodes: Array, sectors: Sectors) -> Array:
    """R (3n + 3b, 6) on own nodes and the next border, each in its axes; nodes (N, 3)."""
    sector_nodes, ahead = sectors.nodes[:, 0], sectors.nodes[sectors.interior :, 1]
    points = nodes[np.concatenate([sector_nodes, ahead])]
    fields = rigid_motion(points - points[sectors.interior :].mean(axis=0))
    fields[len(sector_nodes) :] = rotation(sectors.pitch).T @ fields[len(sector_nodes) :]
    flat = fields.reshape(-1, 6)
    _, triangle = np.linalg.qr(flat[3 * sectors.interior :])
    return np.linalg.solve(triangle.T, flat.T).T


def without_rigid(stiffness: Array, rigid: Array) -> Array:
    """S (2b, 2b) with S R_b = 0."""
    stiffness = _balanced(stiffness, rigid)
    half = stiffness - rigid @ (rigid.T @ stiffness)
    return half - (half @ rigid) @ rigid.T


def _balanced(stiffness: Array, rigid: Array) -> Array:
    """S with its share X in S_00 + S_11 moved between the two so that S_00 R_0 + S_01 R_1 = 0."""
    b = len(stiffness) // 2
    q, triangle = np.linalg.qr(rigid[:b])
    y = np.linalg.solve(triangle.T, (stiffness[:b] @ rigid).T).T
    across = q.T @ y
    share = y @ q.T + q @ y.T - q @ (0.5 * (across + across.T)) @ q.T
    out = stiffness.copy()
    out[:b, :b] -= share
    out[b:, b:] += share
    return out


def with_rigid(ties: Array, rigid: Array, motion: Array) -> Array:
    """B^ (r, 2b) with B^ R_b = B R (r, 6)."""
    return ties + (motion - ties @ rigid) @ rigid.T
