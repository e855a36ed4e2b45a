"""Trains with constant, two-sided gear-mesh stiffness, which are linear in their errors.

With rows V of the gear meshes, stiffness k, errors e(θ) and torques on ports, an equilibrium is

    (K + Vᵀ k V) q = f − Vᵀ k e,   input_rows · q = 0,   F = k (V q + e),

so that F = F_0 + S e with one influence matrix S for all positions: error cycles of hundreds of
thousands of positions need one small linear system.
"""

import math
from dataclasses import dataclass

import numpy as np

from flexgear.analysis.kernels.samples import read_offsets
from flexgear.analysis.modes import rows_at
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import packed, pair_rows, row_motions
from flexgear.coupling.machines import Controller, GivenSpeed
from flexgear.coupling.pair_data import WAVE
from flexgear.coupling.system import System
from flexgear.structures.bodies import turn


def why_not_linear(system: System) -> str | None:
    """Reason why the train is not linear in its errors; None for a linear train."""
    pairs = system.pairs
    if pairs.one_sided:
        return "its gear meshes are one-sided"
    if np.any(pairs.model != WAVE) or np.any(np.ptp(pairs.k_table[pairs.table], axis=1) > 0):
        return "the stiffness of its gear meshes changes as they turn"
    if len(pairs.support_stiffness) or np.any(pairs.turns >= 0):
        return "supports or joints change direction as it turns"
    if len(pairs.bearing_law):
        return "a bearing has clearance or another law of its own, or dampers"
    if any(isinstance(machine, (GivenSpeed, Controller)) for machine in system.machines):
        return "a speed is given or controlled at a port"
    return None


@dataclass(frozen=True)
class LinearTrain:
    """A train with linear gear meshes.

    rows (M, d): of the gear meshes; k (M,): N/m; load (d,): constant forces, and rated torques on
    ports of given torque; turning: forces fixed in space, as index of the angle θ of their frame
    and vectors (d,) of f_cos cos θ + f_sin sin θ."""

    system: System
    rows: Array
    k: Array
    load: Array
    turning: tuple[tuple[int, Array, Array], ...]

    def influence(self) -> Array:
        """Gear-mesh forces (M, 1 + 2 n_l + M) of equilibria: under the constant load and under both
        components of each of n_l forces fixed in space, N, and per error of each gear mesh, N/m."""
        s, free = self.system, len(self.system.input_rows)
        reactions = np.array([p.row for p in s.ports if p.reaction])
        stiffness = s.stiffness + (self.rows.T * self.k) @ self.rows
        matrix = np.block([[stiffness, -reactions.T], [s.input_rows, np.zeros((free, free))]])
        loads = [self.load, *(f for _, *vectors in self.turning for f in vectors)]
        right = np.column_stack([*loads, -self.rows.T * self.k])
        right = np.vstack([right, np.zeros((free, right.shape[1]))])
        scale = np.sqrt(np.abs(np.diag(stiffness)))
        scale = np.concatenate([np.where(scale > 0, scale, 1.0), np.ones(free)])
        solved = np.linalg.solve(matrix / np.outer(scale, scale), right / scale[:, None])
        motion = (solved / scale[:, None])[: s.size]
        force = self.k[:, None] * (self.rows @ motion)
        force[:, len(loads) :] += np.diag(self.k)
        return force

    def forces(self, input_angles: Array) -> Array:
        """Gear-mesh forces (p, M) of equilibria at independent rotations (p, F), rad; N."""
        pairs, theta = self.system.pairs, np.ascontiguousarray(self.system.theta(input_angles))
        weights = [w for a, *_ in self.turning for w in (np.cos(theta[:, a]), np.sin(theta[:, a]))]
        errors = np.zeros((len(theta), len(pairs.s0)))  # minus gaps
        all_flanks = np.ones(len(pairs.s0), dtype=np.int64)
        read_offsets(packed(pairs), theta, all_flanks, pair_rows(pairs), errors)
        return np.column_stack([np.ones(len(theta)), *weights, errors]) @ self.influence().T


def linear_train(system: System) -> LinearTrain:
    """Matrices of a linear train, for which ``why_not_linear`` is None."""
    rows, n = rows_at(system)
    at = np.flatnonzero(rows.row["kind"][:n] >= 0)
    owner = rows.row["owner"][at]
    order = np.argsort(owner)
    load = np.zeros(system.size)
    for port in system.ports:
        if not port.reaction:
            load = load + port.rated_torque * port.row
    turning = []
    pairs = system.pairs
    for block, vector, angle in zip(
        pairs.load_block,
        pairs.load_size[:, None] * pairs.load_vector,
        pairs.load_angle,
        strict=True,
    ):
        motion = system.blocks[6 * block : 6 * block + 6]
        if angle < 0:
            load = load + vector @ motion
            continue
        after_quarter_turn = turn(-math.pi / 2) @ vector  # in the turning frame
        axial = np.array([0, 0, vector[2], 0, 0, vector[5]])
        load = load + axial @ motion
        f_cos, f_sin = vector - axial, after_quarter_turn - axial
        turning.append((int(angle), f_cos @ motion, f_sin @ motion))
    k = rows.row["stiffness"][at][order]
    vectors = row_motions(rows, n, system.blocks)[at][order]
    return LinearTrain(system, vectors, k, load, tuple(turning))
