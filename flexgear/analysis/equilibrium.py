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

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.analysis.backs import look_at_backs
from flexgear.analysis.contact import look_along
from flexgear.analysis.lines import dot, fill, put
from flexgear.analysis.position import CLOSURE, held, position_work, solve_position
from flexgear.coupling.compiled import FAST, INNER, UNCOUNTED, ZERO
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import SLOTS, extra_rows, pair_rows
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
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


def port_torques(system: System, torque: Array | float, count: int) -> Array:
    """(count, P) external torques: given ports from ``torque``, reactions zero.

    torque: scalar or (count,) for the first port (others then as rated), or (count, P).
    """
    given = np.asarray(torque, dtype=float)
    if given.ndim == 2:
        out = np.broadcast_to(given, (count, len(system.ports))).copy()
    else:
        out = system.proportional_torques(np.broadcast_to(given, (count,)))
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
    (p, P) for all ports. Raises FlexgearError where nothing holds the train or the closure is worse
    than 1e-8 of the load.
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
    train, rows = held(modal), pair_rows(pairs)
    work = position_work(rows, train, len(system.ports))
    elastic, omega2 = np.ascontiguousarray(modal.channel_modes[:, r:]), modal.omega[r:] ** 2
    shape = (count, len(pairs.s0), SLOTS)
    out = np.zeros(len(rows.kind) + r + free + 1)
    load, stiffness, position = np.zeros(shape), np.zeros(shape), np.zeros(shape)
    tooth = np.full(shape, -1, dtype=np.int16)
    supports = np.zeros((count, extra_rows(pairs)))
    direction = np.zeros((count, *rows.direction.shape))
    eta = np.zeros((count, modal.modes.shape[1]))
    torques, closure = known.copy(), np.zeros(count)
    watched = np.zeros((count, len(pairs.s0)), dtype=np.int64)
    wanted, seen = (np.zeros(len(pairs.s0), dtype=np.int64) for _ in range(2))
    places = (eta, load, tooth, stiffness, position, supports, direction, watched, closure, torques)
    for start in range(0, count, CHUNK):
        stop = min(start + CHUNK, count)
        p, failed = _solve_positions(
            pairs, rows, theta, known, system.rated_port_torques, train, elastic, omega2, work, out,
            wanted, seen, start, stop, places,
        )  # fmt: skip
        if p < stop:
            raise FlexgearError(_refusal(masters[p, 0], known[p, 0], failed))
        if progress is not None and count > CHUNK:
            progress(stop / count)
    return Equilibrium(
        modal, masters, theta, torques, eta, load, tooth, stiffness, position, supports, direction,
        watched, closure,
    )  # fmt: skip


def _refusal(angle: float, torque: float, closure: float) -> str:
    """Why there is no equilibrium at a carrier angle, rad, under a torque, N·m."""
    if not np.isfinite(closure):
        return (
            f"no equilibrium at carrier angle {angle:.5f} rad under {torque:.6g} N·m: teeth that "
            "only push leave a body free; give it a bearing, a joint or a support"
        )
    return (
        f"equilibrium at carrier angle {angle:.5f} rad under {torque:.6g} N·m closes only to "
        f"{closure:.2e} of the load: stiffnesses are too far apart; check bearings and bolts"
    )


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
    pairs, rows, theta, known, rated, train, elastic, omega2, work, out, wanted, seen, start, stop,
    places,
):  # fmt: skip
    """Positions start … stop − 1 into the arrays of ``places``; the position that failed, or stop,
    and its closure.

    wanted, seen (M,): work space, gear meshes to look at.
    """
    eta, load, tooth, stiffness, position, supports, direction, watched, closure, torques = places
    r, reactions, motion = train.rigid.shape[1], train.reactions, work.motion
    for p in range(start, stop):
        forward = dot(known[p], rated) >= 0.0
        for m in range(wanted.shape[0]):
            wanted[m] = pairs.front[m] if forward else 1
        n, n_pairs, error = ZERO, ZERO, 0.0
        for _ in range(LOOKS):
            n, n_pairs, error = solve_position(
                pairs, rows, theta[p], known[p], forward, wanted, train, work, out
            )
            if not error <= CLOSURE:
                return p, error
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
        for f in range(reactions.shape[0]):
            torques[p, reactions[f]] = -out[n + r + f]
        for e in range(r):
            eta[p, e] = out[n + e]
        modal_part(elastic, work.forces, omega2, r, eta[p])
        _store(rows, n, n_pairs, out, load[p], tooth[p], stiffness[p], position[p], supports[p])
    return stop, 0.0


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
