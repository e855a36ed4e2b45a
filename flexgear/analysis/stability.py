r"""Stability of steady states over a gear-mesh period: Floquet multipliers of the monodromy matrix.

A small change of a steady state obeys

    ξ̈ + D ξ̇ + K ξ + Pᵀ [K_j (P ξ + R f) + C_j P ξ̇] = 0,   f = −[K_j (P ξ + R f) + C_j P ξ̇],

in the kept modes, without rigid rotation of the train and without the motion that machines of given
speed prevent. K_j and C_j (q, q) are the tangents of the channel forces at sample j, P (q, x) the
motion of the channels, R (q, q) their residual flexibility. The monodromy matrix is integrated in
steps of average acceleration, which have no numerical damping, so that |μ| > 1 means growth. A real
multiplier that passes +1 is a turning point, one that passes −1 a period doubling, a complex pair
that leaves the unit circle a second frequency. (Hill's determinant, truncated, would give several
copies of each multiplier.)

Modes above the gear-mesh frequency whose frequency the tangents hardly change, S_i = max_j p_iᵀ K_j
p_i below a small share of ω_i², can only follow where their decay rate γ_i keeps them from growing:
a stiffness between 0 and S_i has harmonics up to 2 S_i/π, which feed σ ≤ S_i/(2π ω_i) < γ_i/2 (see
``excitation``). Their flexibility p_i p_iᵀ / ω_i² is added to R (``without_following_modes``).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from flexgear.analysis.orbit_receptance import CondensedTrain, OperatingPoint
from flexgear.arrays import Array, Complex, Ints

MAX_PRODUCT_SIZE = 8  # coordinates up to which the matrix of every step is formed
FOLLOWING = 0.02  # S_i / ω_i² below which a mode only follows: 1 % of its frequency


@dataclass(frozen=True)
class VibrationMatrices:
    """Linear part of a train for vibration about a steady state, in x coordinates of unit mass:
    stiffness and damping (x, x) without the channels; motion of the channels (q, x) and residual
    flexibility (q, q) m/N between them; groups (G, p): of the channels, see ``OrbitElements``."""

    stiffness: Array
    damping: Array
    channels: Array
    residual: Array
    groups: Ints


def vibration_matrices(train: CondensedTrain, point: OperatingPoint) -> VibrationMatrices:
    """The linear part of a train for small changes of its steady state at an operating point."""
    modal, q = train.modal, len(train.elements.channels)
    free = _free_coordinates(train)
    damping, stiffness = np.diag(modal.damping), np.diag(modal.omega**2)
    if modal.gyroscopic.size:
        damping = damping + point.speed * modal.gyroscopic
        stiffness = stiffness - point.speed**2 * modal.centripetal
    moves = ~train.fixed
    rows, k, c = train.modes[q:][moves], train.stiffness[moves], train.damping_at(point)[moves]
    residual = train.residual[q:, q:][np.ix_(moves, moves)]
    flexible = np.linalg.solve(np.eye(len(k)) + k[:, None] * residual, k[:, None] * rows)
    stiffness = free.T @ (stiffness + rows.T @ flexible) @ free
    damping = free.T @ (damping + rows.T @ (c[:, None] * rows)) @ free
    channels, residual = train.modes[:q] @ free, train.residual[:q, :q]
    return VibrationMatrices(stiffness, damping, channels, residual, train.elements.groups)


def _free_coordinates(train: CondensedTrain) -> Array:
    """Orthonormal basis (n, x) of the modal coordinates without rigid rotation of the train and
    without motion of ports of given speed."""
    modal, q = train.modal, len(train.elements.channels)
    fixed = np.vstack([modal.rolling.T, train.modes[q:][train.fixed]])
    if not fixed[:, modal.rigid_count :].any():  # a diagonal basis for the elastic modes
        rigid = linalg.null_space(fixed[:, : modal.rigid_count])
        return linalg.block_diag(rigid, np.eye(len(modal.omega) - modal.rigid_count))
    return np.asarray(linalg.null_space(fixed))


def without_following_modes(
    part: VibrationMatrices, period: float, tangents: Array
) -> VibrationMatrices:
    """The linear part with modes that only follow as residual flexibility; tangents: see
    ``monodromy``. Unchanged where the train has gyroscopic terms, which couple modes."""
    if not np.allclose(part.stiffness, part.stiffness.T) or not tangents.any():
        return part
    squares, vectors = np.linalg.eigh(part.stiffness)
    rows = part.channels @ vectors
    loaded, stiffness, _ = _of_channels(part, tangents)
    loaded_rows = loaded.channels @ vectors
    shifts = np.einsum("jai,ai->ji", stiffness @ loaded_rows, loaded_rows).max(axis=0)
    decay = np.einsum("im,ij,jm->m", vectors, part.damping, vectors)
    bound = np.minimum(FOLLOWING * squares, np.pi * decay * np.sqrt(np.abs(squares)))
    follow = (shifts < bound) & (squares > (2 * np.pi / period) ** 2)
    remain, stiff = vectors[:, ~follow], rows[:, follow]
    return replace(
        part,
        stiffness=np.diag(squares[~follow]),
        damping=remain.T @ part.damping @ remain,
        channels=rows[:, ~follow],
        residual=part.residual + (stiff / squares[follow]) @ stiff.T,
    )


def monodromy(part: VibrationMatrices, period: float, tangents: Array) -> Array:
    """Monodromy matrix (2x, 2x) of displacements and velocities over a period, s; tangents
    (2, N, G, p, p): of the channel forces to motion, N/m, and to rate, N s/m, at the N steps."""
    part, stiffness, damping = _of_channels(part, tangents)
    x, h = len(part.stiffness), period / len(stiffness)
    if x <= MAX_PRODUCT_SIZE:
        return _product(part, h, stiffness, damping)
    # average acceleration: v⁺ = v + h/2 (a + a⁺), ξ⁺ = ξ + h/2 (v + v⁺). With ξ⁺ and v⁺ predicted
    # without a⁺, the channel forces g follow from the motion of the channels, a problem of low rank
    p, answer = part.channels, np.eye(x) + 0.5 * h * part.damping + 0.25 * h * h * part.stiffness
    constant = np.linalg.inv(answer)
    onto, by_motion, by_rate = constant @ p.T, constant @ part.stiffness, constant @ part.damping
    added = 0.5 * h * damping + 0.25 * h * h * stiffness
    whole = np.concatenate([added, stiffness, damping], axis=2)
    onto_channels = np.linalg.solve(np.eye(len(p)) + added @ (p @ onto), whole)
    motion, rate = np.eye(x, 2 * x), np.eye(x, 2 * x, x)
    acceleration = -part.stiffness @ motion - part.damping @ rate
    acceleration -= p.T @ (stiffness[0] @ (p @ motion) + damping[0] @ (p @ rate))
    for j in np.r_[1 : len(stiffness), 0]:
        predicted = motion + h * rate + 0.25 * h * h * acceleration
        faster = rate + 0.5 * h * acceleration
        free = -(by_motion @ predicted + by_rate @ faster)
        seen = (p @ np.hstack([free, predicted, faster])).reshape(len(p), 3, -1)
        g = onto_channels[j] @ seen.transpose(1, 0, 2).reshape(3 * len(p), -1)
        acceleration = free - onto @ g
        motion = predicted + 0.25 * h * h * acceleration
        rate = faster + 0.5 * h * acceleration
    return np.vstack([motion, rate])


def _product(part: VibrationMatrices, h: float, stiffness: Array, damping: Array) -> Array:
    """Monodromy matrix as the product of the steps' (1 − h/2 A⁺)⁻¹ (1 + h/2 A), for ẏ = A y."""
    x, p = len(part.stiffness), part.channels
    rates = np.zeros((len(stiffness), 2 * x, 2 * x))
    rates[:, :x, x:] = np.eye(x)
    rates[:, x:, :x] = -part.stiffness - p.T @ stiffness @ p
    rates[:, x:, x:] = -part.damping - p.T @ damping @ p
    eye = np.eye(2 * x)
    steps = np.linalg.solve(eye - 0.5 * h * np.roll(rates, -1, axis=0), eye + 0.5 * h * rates)
    while len(steps) > 1:
        last = steps[2 * (len(steps) // 2) :]
        steps = np.concatenate([steps[1::2] @ steps[: len(steps) - len(last) : 2], last])
    return np.asarray(steps[0])


def fewer_steps(tangents: Array, least: int) -> Array:
    """Tangents of N' ≥ ``least`` steps, each the mean over as many of N samples."""
    count = tangents.shape[1]
    each = max(k for k in range(1, max(count // least, 1) + 1) if count % k == 0)
    return np.asarray(tangents.reshape(2, count // each, each, *tangents.shape[2:]).mean(axis=2))


def _of_channels(
    part: VibrationMatrices, tangents: Array
) -> tuple[VibrationMatrices, Array, Array]:
    """The part with loaded channels alone, and their stiffness and damping (N, q, q) in series with
    their residual flexibility, (1 + K R)⁻¹ K and (1 + K R)⁻¹ C."""
    at = np.flatnonzero(tangents.any(axis=(0, 1, 3, 4)))
    used = np.unique(part.groups[at])
    used = used[used < len(part.channels)]
    groups, q = np.searchsorted(used, part.groups[at]), len(used)
    full = np.zeros((*tangents.shape[:2], q + 1, q + 1))
    full[:, :, groups[:, :, None], groups[:, None, :]] = tangents[:, :, at]
    stiffness, damping = full[:, :, :q, :q]
    part = replace(
        part, channels=part.channels[used], residual=part.residual[np.ix_(used, used)],
        groups=groups,
    )  # fmt: skip
    if not part.residual.any():
        return part, stiffness, damping
    both = np.concatenate([stiffness, damping], axis=2)
    solved = np.linalg.solve(np.eye(q) + stiffness @ part.residual, both)
    return part, solved[:, :, :q], solved[:, :, q:]


def multipliers(matrix: Array) -> Complex:
    """Floquet multipliers (2x,), the largest first."""
    values = np.linalg.eigvals(matrix)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])
