"""Static equilibrium at a carrier angle under a drive torque.

Unknown are the pair forces F, the amplitudes a of the rigid motions and the output torque T_o that
holds the train:

    F = k ⟨Vᵀ u + e⟩,  u = P_r a + S f,  f = −V F + e_d T − e_o T_o,
    P_rᵀ f = 0   (every rigid motion in balance),   mean pin rotation = 0   (the angle is given),

with S the elastic flexibility of the channels. One small dense problem a position.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.analysis.backs import look_at_backs
from flexgear.analysis.contact import (
    local_blocks,
    release,
    row_products,
    row_values,
    solve_active,
)
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pairs import SLOTS, PairRows, build_rows, pair_rows
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
CLOSURE = 1e-8


@dataclass(frozen=True)
class Equilibrium:
    """Equilibria over positions (first axis p).

    carrier_angle (p,) rad; input_torque, output_torque (p,) N·m; eta (p, n) modal coordinates
    measured from the undeflected train at that angle; pair_load (p, G, N, S) N with pair_tooth
    (0-based, −1 none), pair_stiffness N/m, pair_position (path coordinate, m); support_load
    (p, n_s) N; wanted (p, G, N); closure (p,) largest imbalance over the load.
    """

    modal: ModalSystem
    carrier_angle: Array
    input_torque: Array
    output_torque: Array
    eta: Array
    pair_load: Array
    pair_tooth: NDArray[np.int16]
    pair_stiffness: Array
    pair_position: Array
    support_load: Array
    wanted: NDArray[np.int64]
    closure: Array


@njit(cache=True, nogil=True)
def _solve_position(
    pairs, rows, theta, torque, wanted, rigid, flex, angle_rigid, angle_flex, work, out
):
    """One position; returns (status, rows, pairs, closure). out: x (n + r + 1)."""
    matrix, small, wide, right, delta, motion, place, blocks, active = work
    nc = flex.shape[0]
    r = rigid.shape[1]
    drive, brake = nc - 2, nc - 1
    n, n_pairs = build_rows(pairs, rows, theta, wanted)
    m = local_blocks(rows, n, place, blocks)
    row_products(rows, n, flex, place, blocks, wide, matrix)
    extra = r + 1
    for i in range(n):
        k = rows.stiffness[i]
        for j in range(n):
            matrix[i, j] *= k
        matrix[i, i] += 1.0
        for e in range(r):
            total = 0.0
            for a in range(rows.width[i]):
                base = 6 * rows.blocks[i, a]
                for p in range(6):
                    total += rows.coef[i, a, p] * rigid[base + p, e]
            matrix[i, n + e] = -k * total
            matrix[n + e, i] = total
        d, o, g = 0.0, 0.0, 0.0
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                c = rows.coef[i, a, p]
                d += c * flex[drive, base + p]
                o += c * flex[brake, base + p]
                g += c * angle_flex[base + p]
        matrix[i, n + r] = k * o
        matrix[n + r, i] = -g
        right[i] = k * (d * torque + rows.offset[i])
        active[i] = 1
        if rows.kind[i] >= 0 and pairs.one_sided:
            front = rows.kind[i] < 2
            active[i] = 1 if front == (torque >= 0.0) else 0
    for e in range(r):
        for f in range(r):
            matrix[n + e, n + f] = 0.0
        matrix[n + e, n + r] = rigid[brake, e]
        matrix[n + r, n + e] = angle_rigid[e]
        right[n + e] = rigid[drive, e] * torque
    matrix[n + r, n + r] = -angle_flex[brake]
    right[n + r] = -angle_flex[drive] * torque
    status = solve_active(matrix, right, rows, n, extra, pairs.one_sided, active, small, out)
    release(place, blocks, m)
    if status < 0:
        return status, n, n_pairs, 0.0
    # check by substitution: channel forces, motion, pair law and balance
    forces = np.zeros(nc)
    for i in range(n):
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                forces[base + p] -= out[i] * rows.coef[i, a, p]
    forces[drive] = torque
    forces[brake] = -out[n + r]
    motion[:] = flex @ forces + rigid @ out[n : n + r].copy()
    row_values(rows, n, motion, delta)
    largest, worst = 1e-300, 0.0
    for i in range(n):
        force = rows.stiffness[i] * (delta[i] + rows.offset[i])
        if pairs.one_sided and rows.kind[i] >= 0 and force < 0.0:
            force = 0.0
        largest = max(largest, abs(out[i]))
        worst = max(worst, abs(force - out[i]))
    balance = rigid.T @ forces
    scale = np.abs(rigid.T) @ np.abs(forces)
    closure = worst / largest
    closure = max(closure, np.abs(balance).max() / max(scale.max(), 1e-300))
    return status, n, n_pairs, closure


def _work(modal: ModalSystem) -> tuple[PairRows, tuple[NDArray[Any], ...]]:
    rows = pair_rows(modal.system.pairs)
    size = len(rows.kind) + modal.rigid_count + 2
    nb = len(modal.system.blocks) // 6
    nc = len(modal.channels)
    work = (
        np.zeros((size, size)),
        np.zeros((size, size)),
        np.zeros(6 * nb),
        np.zeros(size),
        np.zeros(size),
        np.zeros(nc),
        np.full(nb, -1, dtype=np.int64),
        np.zeros(nb, dtype=np.int64),
        np.zeros(size, dtype=np.int64),
    )
    return rows, work


def revolution(
    modal: ModalSystem,
    angles: Array,
    torque: Array | float,
    progress: Callable[[float], None] | None = None,
) -> Equilibrium:
    """Equilibria at carrier angles (p,) rad under a drive torque, N·m, scalar or (p,).

    Raises FlexgearError where nothing holds the train (no load, one-sided contact) or the
    closure is worse than 1e-8 of the load.
    """
    system, pairs = modal.system, modal.system.pairs
    angles = np.atleast_1d(np.asarray(angles, dtype=float))
    torques = np.broadcast_to(np.asarray(torque, dtype=float), angles.shape).copy()
    r = modal.rigid_count
    rigid = np.ascontiguousarray(modal.channel_modes[:, :r])
    flex = np.ascontiguousarray(modal.static_receptance())
    e = slice(r, None)
    angle_flex = (modal.angle[e] / modal.omega[e] ** 2) @ modal.channel_modes[:, e].T
    angle_flex = angle_flex + system.carrier_angle @ modal.residual_motion
    rows, work = _work(modal)
    count, kinds, planets = len(angles), pairs.s0.shape[0], pairs.planets
    shape = (count, kinds, planets, SLOTS)
    out = np.zeros(len(rows.kind) + r + 2)
    load, stiffness, position = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    tooth = np.full(shape, -1, dtype=np.int16)
    supports = np.zeros((count, len(pairs.support_stiffness)))
    eta = np.zeros((count, modal.modes.shape[1]))
    output, closure = np.zeros(count), np.zeros(count)
    watched = np.zeros((count, kinds, planets), dtype=np.int64)
    omega2 = modal.omega[e] ** 2
    for p in range(count):
        wanted = np.zeros((kinds, planets), dtype=np.int64)
        wanted[:2] = 1
        if torques[p] < 0:
            wanted[:] = 1
        for _ in range(4):
            status, n, n_pairs, error = _solve_position(
                pairs, rows, angles[p], torques[p], wanted, rigid, flex, modal.angle[:r],
                angle_flex, work, out,
            )  # fmt: skip
            if status < 0:
                raise FlexgearError(
                    f"no equilibrium at carrier angle {angles[p]:.5f} rad under "
                    f"{torques[p]:.6g} N·m: with one-sided contact every planet needs a loaded "
                    'tooth pair; use a larger torque or contact_law = "linear"'
                )
            seen = wanted.copy()
            if pairs.one_sided:
                look_at_backs(pairs, rows, n_pairs, angles[p], work[5], wanted)
                wanted = np.maximum(seen, wanted)
            if np.array_equal(seen, wanted):
                break
        if error > CLOSURE:
            raise FlexgearError(
                f"equilibrium at carrier angle {angles[p]:.5f} rad closes only to {error:.2e} of "
                "the load: stiffnesses are too far apart; check bearings and bolts"
            )
        watched[p], closure[p], output[p] = wanted, error, out[n + r]
        forces = np.zeros(len(modal.channels))
        for i in range(n):
            for a in range(rows.width[i]):
                base = 6 * rows.blocks[i, a]
                forces[base : base + 6] -= out[i] * rows.coef[i, a]
        forces[-2], forces[-1] = torques[p], -out[n + r]
        eta[p, :r] = out[n : n + r]
        eta[p, r:] = (forces @ modal.channel_modes[:, e]) / omega2
        _store(rows, n, n_pairs, out, load[p], tooth[p], stiffness[p], position[p], supports[p])
        if progress is not None and (p + 1) % 50 == 0:
            progress((p + 1) / count)
    return Equilibrium(
        modal, angles, torques, output, eta, load, tooth, stiffness, position, supports, watched,
        closure,
    )  # fmt: skip


def _store(rows, n, n_pairs, x, load, tooth, stiffness, position, supports) -> None:  # type: ignore[no-untyped-def]
    for q in range(n_pairs):
        at = (rows.pair_kind[q], rows.pair_planet[q], rows.pair_slot[q])
        load[at] = rows.pair_share[q] * x[rows.pair_row[q]]
        tooth[at] = rows.pair_tooth[q]
        stiffness[at] = rows.pair_stiffness[q]
        position[at] = rows.pair_s[q]
    for i in range(n):
        if rows.kind[i] < 0:
            supports[rows.planet[i]] = x[i]


def equilibrium(modal: ModalSystem, carrier_angle: float, torque: float) -> Equilibrium:
    """One equilibrium; the same arrays with a first axis of length 1."""
    return revolution(modal, np.array([carrier_angle]), torque)
