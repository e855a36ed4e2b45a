"""Static equilibrium at given independent rotations (a carrier angle) under given torques.

Unknown are the pair forces F, the amplitudes a of the rigid motions and the torques T_o of the
reaction ports, which hold the train:

    F = k ⟨Vᵀ u + e⟩,  u = P_r a + S f,  f = −V F + Σ e_p T_p − Σ e_o T_o,
    P_rᵀ f = 0   (every rigid motion in balance),   masters · q = 0   (the rotations are given),

with S the elastic flexibility of the channels. One small dense problem a position; bearings with
clearance look along their displacement, which is repeated until they agree.
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
    look_along,
    refine_set,
    release,
    right_side,
    row_products,
    row_values,
    solve_set,
)
from flexgear.analysis.lines import dot, fill, put
from flexgear.coupling.compiled import FAST, INNER, UNCOUNTED, ZERO
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import SLOTS, PairRows, extra_rows, pair_rows
from flexgear.coupling.pairs import build_rows
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
CLOSURE = 1e-8
CHUNK = 100  # positions between two reports of progress
LOOKS = 60  # tries to agree on back flanks and on directions of clearance bearings


@dataclass(frozen=True)
class Equilibrium:
    """Equilibria over positions (first axis p).

    masters (p, F) independent rotations, rad; theta (p, A) angles of the stages; torques (p, P)
    external torque on every port, N·m; eta (p, n) modal coordinates measured from the undeflected
    train at that position; pair_load (p, M, S) N with pair_tooth (0-based, −1 none),
    pair_stiffness N/m, pair_position (path coordinate, m); support_load (p, extra rows) N;
    direction (p, n_c, 3) of clearance bearings; wanted (p, M); closure (p,) largest imbalance over
    the load.
    """

    modal: ModalSystem
    masters: Array
    theta: Array
    torques: Array
    eta: Array
    pair_load: Array
    pair_tooth: NDArray[np.int16]
    pair_stiffness: Array
    pair_position: Array
    support_load: Array
    direction: Array
    wanted: NDArray[np.int64]
    closure: Array

    @property
    def carrier_angle(self) -> Array:
        """First independent rotation (p,), rad: the carrier's in a single stage."""
        return np.asarray(self.masters[:, 0])

    @property
    def input_torque(self) -> Array:
        """Torque on the first port (p,), N·m."""
        return np.asarray(self.torques[:, 0])

    @property
    def output_torque(self) -> Array:
        """Torque (p,) that the last port gives off, N·m."""
        return np.asarray(-self.torques[:, -1])


@njit(inline="always")
def _solve_position(
    pairs, rows, theta, known, reactions, forward, wanted, rigid, flex, master_rigid, master_flex,
    work, out,
):  # fmt: skip
    """One position; returns (status, rows, pairs, closure). out: x (n + r + F).

    known (P,): given torques on the ports; reactions (F,): ports whose torque is sought.
    """
    matrix, small, wide, right, delta, motion, place, blocks, active, forces = work
    nc = flex.shape[0]
    r, ports, free = rigid.shape[1], known.shape[0], reactions.shape[0]
    first = nc - ports
    n, n_pairs = build_rows(pairs, rows, theta, wanted)
    m = local_blocks(rows, n, place, blocks)
    row_products(rows, n, flex, place, blocks, wide, matrix)
    extra = r + free
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
        pushed = 0.0
        for f in range(free):
            matrix[i, n + r + f] = 0.0
            matrix[n + r + f, i] = 0.0
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                c = rows.coef[i, a, p]
                for q in range(ports):
                    pushed += c * flex[first + q, base + p] * known[q]
                for f in range(free):
                    matrix[i, n + r + f] += k * c * flex[first + reactions[f], base + p]
                    matrix[n + r + f, i] -= c * master_flex[f, base + p]
        right[i] = right_side(rows, i, pushed, 0.0, 0.0)
        active[i] = 1
        if rows.sided[i] == 1 and rows.kind[i] >= 0:
            active[i] = 1 if (pairs.front[rows.owner[i]] == 1) == forward else 0
    for e in range(r):
        for f in range(r):
            matrix[n + e, n + f] = 0.0
        right[n + e] = 0.0
        for q in range(ports):
            right[n + e] += rigid[first + q, e] * known[q]
        for f in range(free):
            matrix[n + e, n + r + f] = rigid[first + reactions[f], e]
            matrix[n + r + f, n + e] = master_rigid[f, e]
    for f in range(free):
        right[n + r + f] = 0.0
        for q in range(ports):
            right[n + r + f] -= master_flex[f, first + q] * known[q]
        for g in range(free):
            matrix[n + r + f, n + r + g] = -master_flex[f, first + reactions[g]]
    status = solve_set(matrix, right, rows.sided, n, extra, active, small, out)
    release(place, blocks, m)
    if status < 0:
        return status, n, n_pairs, 0.0
    refine_set(matrix, right, n, extra, active, small, delta, out)
    # check by substitution: channel forces, motion, pair law and balance
    fill(forces, 0.0)
    for i in range(n):
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                forces[base + p] -= out[i] * rows.coef[i, a, p]
    for q in range(ports):
        forces[first + q] = known[q]
    for f in range(free):
        forces[first + reactions[f]] -= out[n + r + f]
    for c in range(nc):
        motion[c] = dot(flex[c], forces)
        for e in range(r):
            motion[c] += rigid[c, e] * out[n + e]
    row_values(rows, n, motion, delta)
    largest, worst = 1e-300, 0.0
    for i in range(n):
        force = right_side(rows, i, delta[i], 0.0, 0.0)
        if rows.sided[i] == 1 and force < 0.0:
            force = 0.0
        largest = max(largest, abs(out[i]))
        worst = max(worst, abs(force - out[i]))
    closure = worst / largest
    left, scale = 0.0, 1e-300
    for e in range(r):
        balance, size = 0.0, 0.0
        for c in range(nc):
            balance += rigid[c, e] * forces[c]
            size += abs(rigid[c, e] * forces[c])
        left, scale = max(left, abs(balance)), max(scale, size)
    closure = max(closure, left / scale)
    return status, n, n_pairs, closure


def _work(modal: ModalSystem) -> tuple[PairRows, tuple[NDArray[Any], ...]]:
    rows = pair_rows(modal.system.pairs)
    size = len(rows.kind) + modal.rigid_count + len(modal.masters) + 1
    size += -size % 8  # whole blocks of 8
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
        np.zeros(nc),
    )
    return rows, work


def port_torques(system: System, torque: Array | float, count: int) -> Array:
    """(count, P) external torques: given ports from ``torque``, reactions zero.

    torque: scalar or (count,) for the first port (others then as rated), or (count, P).
    """
    given = np.asarray(torque, dtype=float)
    if given.ndim == 2:
        out = np.broadcast_to(given, (count, len(system.ports))).copy()
    else:
        out = np.tile(system.rated_port_torques, (count, 1))
        share = np.broadcast_to(given, (count,)) / system.rated_torque
        out *= share[:, None]
    out[:, system.reactions] = 0.0
    return out


def revolution(
    modal: ModalSystem,
    angles: Array,
    torque: Array | float,
    progress: Callable[[float], None] | None = None,
) -> Equilibrium:
    """Equilibria at independent rotations (p,) or (p, F) rad under a torque, N·m.

    torque: of the first port, scalar or (p,), the other given ports in their rated proportion; or
    (p, P) for all ports. Raises FlexgearError where nothing holds the train (no load, one-sided
    contact) or the closure is worse than 1e-8 of the load.
    """
    system, pairs = modal.system, modal.system.pairs
    free, r = len(modal.masters), modal.rigid_count
    masters = np.asarray(angles, dtype=float)
    masters = np.atleast_1d(masters)
    if masters.ndim == 1:
        masters = np.column_stack([masters, *[np.zeros_like(masters)] * (free - 1)])
    count = len(masters)
    known = port_torques(system, torque, count)
    theta = np.ascontiguousarray(system.theta(masters))
    rigid = np.ascontiguousarray(modal.channel_modes[:, :r])
    flex = np.ascontiguousarray(modal.static_receptance())
    e = slice(r, None)
    omega2 = modal.omega[e] ** 2
    master_flex = (modal.masters[:, e] / omega2) @ modal.channel_modes[:, e].T
    master_flex = np.ascontiguousarray(master_flex + system.masters @ modal.residual_motion)
    master_rigid = np.ascontiguousarray(modal.masters[:, :r])
    rows, work = _work(modal)
    reactions = system.reactions
    shape = (count, len(pairs.s0), SLOTS)
    out = np.zeros(len(rows.kind) + r + free + 1)
    load, stiffness, position = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    tooth = np.full(shape, -1, dtype=np.int16)
    supports = np.zeros((count, extra_rows(pairs)))
    direction = np.zeros((count, *rows.direction.shape))
    eta = np.zeros((count, modal.modes.shape[1]))
    torques, closure = known.copy(), np.zeros(count)
    watched = np.zeros((count, len(pairs.s0)), dtype=np.int64)
    elastic = np.ascontiguousarray(modal.channel_modes[:, e])
    wanted, seen = (np.zeros(len(pairs.s0), dtype=np.int64) for _ in range(2))
    places = (eta, load, tooth, stiffness, position, supports, direction, watched, closure, torques)
    for start in range(0, count, CHUNK):
        stop = min(start + CHUNK, count)
        status, p = _solve_positions(
            pairs, rows, theta, known, reactions, system.rated_port_torques, rigid, flex,
            master_rigid, master_flex, elastic, omega2, work, out, wanted, seen, start, stop,
            places,
        )  # fmt: skip
        if status < 0:
            raise FlexgearError(
                f"no equilibrium at carrier angle {masters[p, 0]:.5f} rad under "
                f"{known[p, 0]:.6g} N·m: with one-sided contact every planet needs a loaded "
                'tooth pair; use a larger torque or contact_law = "linear"'
            )
        worst = start + int(np.argmax(closure[start:stop]))
        if closure[worst] > CLOSURE:
            raise FlexgearError(
                f"equilibrium at carrier angle {masters[worst, 0]:.5f} rad closes only to "
                f"{closure[worst]:.2e} of the load: stiffnesses are too far apart; check bearings "
                "and bolts"
            )
        if progress is not None and count > CHUNK:
            progress(stop / count)
    return Equilibrium(
        modal, masters, theta, torques, eta, load, tooth, stiffness, position, supports, direction,
        watched, closure,
    )  # fmt: skip


@njit(**INNER, fastmath=FAST)
def modal_part(elastic, forces, omega2, first, eta):
    """eta[first:] = Φᵀ f / ω² from the channels' elastic modes (n_c, n)."""
    part = eta[first:]
    fill(part, 0.0)
    for c in range(forces.shape[0]):
        f = forces[c]
        if f != 0.0:
            for j in range(part.shape[0]):
                part[j] += f * elastic[c, j]
    for j in range(part.shape[0]):
        part[j] /= omega2[j]


@njit(**UNCOUNTED, nogil=True)
def _solve_positions(
    pairs, rows, theta, known, reactions, rated, rigid, flex, master_rigid, master_flex, elastic,
    omega2, work, out, wanted, seen, start, stop, places,
):  # fmt: skip
    """Positions start … stop − 1 into the arrays of ``places``; (status, position that failed).

    wanted, seen (M,): work space, gear meshes to look at.
    """
    eta, load, tooth, stiffness, position, supports, direction, watched, closure, torques = places
    r, free = rigid.shape[1], reactions.shape[0]
    motion, forces = work[5], work[9]
    for p in range(start, stop):
        forward = dot(known[p], rated) >= 0.0
        for m in range(wanted.shape[0]):
            wanted[m] = pairs.front[m] if forward else 1
        n, n_pairs, error = ZERO, ZERO, 0.0
        for _ in range(LOOKS):
            status, n, n_pairs, error = _solve_position(
                pairs, rows, theta[p], known[p], reactions, forward, wanted, rigid, flex,
                master_rigid, master_flex, work, out,
            )  # fmt: skip
            if status < 0:
                return status, p
            agreed = True
            if pairs.one_sided:
                put(seen, wanted)
                look_at_backs(pairs, rows, n_pairs, theta[p], motion, wanted)
                for m in range(wanted.shape[0]):
                    wanted[m] = max(wanted[m], seen[m])
                    agreed = agreed and wanted[m] == seen[m]
            if look_along(pairs, rows, motion) < 1e-10 and agreed:
                break
        put(watched[p], wanted)
        closure[p] = error
        for c in range(direction.shape[1]):
            put(direction[p, c], rows.direction[c])
        for f in range(free):
            torques[p, reactions[f]] = -out[n + r + f]
        for e in range(r):
            eta[p, e] = out[n + e]
        modal_part(elastic, forces, omega2, r, eta[p])
        _store(rows, n, n_pairs, out, load[p], tooth[p], stiffness[p], position[p], supports[p])
    return 0, stop


@njit(**INNER)
def _store(rows, n, n_pairs, x, load, tooth, stiffness, position, supports):
    for q in range(n_pairs):
        m, slot = rows.pair_mesh[q], rows.pair_slot[q]
        load[m, slot] = rows.pair_share[q] * x[rows.pair_row[q]]
        tooth[m, slot] = rows.pair_tooth[q]
        stiffness[m, slot] = rows.pair_stiffness[q]
        position[m, slot] = rows.pair_s[q]
    for i in range(n):
        if rows.kind[i] < 0:
            supports[rows.owner[i]] = x[i]


def equilibrium(modal: ModalSystem, carrier_angle: float, torque: float) -> Equilibrium:
    """One equilibrium; the same arrays with a first axis of length 1."""
    return revolution(modal, np.array([carrier_angle]), torque)
