"""Static equilibrium at given independent rotations (a carrier angle) under given torques.

Unknown are the pair forces F, the amplitudes a of the rigid motions and the torques T_o of the
reaction ports, which hold the train:

    F = k ⟨Vᵀ u + e⟩,  u = P_r a + S f,  f = −V F + Σ e_p T_p − Σ e_o T_o,
    P_rᵀ f = 0   (every rigid motion in balance),   input_rows · q = 0   (the rotations are given),

with S the elastic flexibility of the channels. One small dense problem a position; laws that are
not linear where they carry are linearised anew until they agree with their answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.samples import empty_pair_loads
from flexgear.analysis.kernels.static_position import (
    Held,
    Positions,
    position_work,
    solve_positions,
)
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import law_functions
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

CHUNK = 100  # positions between two reports of progress


@dataclass(frozen=True)
class Solution:
    """What equilibria and transients give, sample by sample (first axis t).

    theta (t, A) rad, angles of stages and frames by which pairs are placed; torques (t, P) from
    outside on every port, N·m; eta (t, n) modal coordinates; pair_load (t, M, S) N with pair_tooth
    (0-based, −1 none), pair_stiffness N/m, pair_position (path coordinate, m); of pairs in slices
    far_load (t, M, S) N, what of the load the second row carries, and pair_approach (t, M, S, 4) m:
    by how much both rows close, then what the bodies' motion does of it, else of no length;
    support_load (t, extra rows) N; active_flanks (t, M) gear meshes that were looked at.
    """

    modal: ModalSystem
    theta: Array
    torques: Array
    eta: Array
    pair_load: Array
    pair_tooth: NDArray[np.int16]
    pair_stiffness: Array
    pair_position: Array
    far_load: Array
    pair_approach: Array
    support_load: Array
    active_flanks: NDArray[np.int64]


@dataclass(frozen=True)
class Equilibrium(Solution):
    """Equilibria over positions; eta is measured from the undeflected train at that position.

    input_angles (p, F) independent rotations, rad; closure (p,) largest imbalance over the load.
    """

    input_angles: Array
    closure: Array


def held(modal: ModalSystem) -> Held:
    """The train's answer at rest from its modes and residual flexibility."""
    system, r = modal.system, modal.rigid_count
    elastic, omega2 = slice(r, None), modal.omega[r:] ** 2
    rigid, flexibility = modal.channel_modes[:, :r], modal.static_receptance()
    follow = (modal.input_rows[:, elastic] / omega2) @ modal.channel_modes[:, elastic].T
    rotations = follow + system.input_rows @ modal.residual_motion
    at = len(rigid) - len(system.ports) + system.reactions
    balance = np.hstack([rigid, -rotations.T])
    corner = np.zeros((balance.shape[1], balance.shape[1]))
    corner[r:, :r] = modal.input_rows[:, :r]
    corner[:, r:] = balance[at].T
    return Held(
        flexibility=np.ascontiguousarray(flexibility),
        motions=np.hstack([rigid, -flexibility[:, at]]),
        balance=balance,
        corner=corner,
        reactions=system.reactions,
    )


def port_torques(system: System, torque: Array | float, count: int) -> Array:
    """(count, P) external torques: given ports from ``torque``, reactions zero.

    torque: scalar or (count,) for the first port (others then as rated), or (count, P).
    """
    external = np.asarray(torque, dtype=float)
    if external.ndim == 2:
        out = np.broadcast_to(external, (count, len(system.ports))).copy()
    else:
        out = system.proportional_torques(np.broadcast_to(external, (count,)))
    out[:, system.reactions] = 0.0
    return out


def revolution(
    modal: ModalSystem,
    angles: Array | float,
    torque: Array | float,
    progress: Callable[[float], None] | None = None,
    theta: Array | None = None,
) -> Equilibrium:
    """Equilibria at independent rotations under a torque, N·m.

    angles: of the first rotation, scalar or (p,), or (p, F) of all, rad;
    torque: of the first port, scalar or (p,), the other given ports in their rated proportion; or
    (p, P) for all ports. theta: angles (p, A) rad of stages and frames, of the rolling train at
    these rotations unless given. Raises FlexgearError where nothing holds the train or the closure
    is worse than 1e-8 of the load.
    """
    system, pairs = modal.system, modal.system.pairs
    free, r = len(modal.input_rows), modal.rigid_count
    input_angles = np.atleast_1d(np.asarray(angles, dtype=float))
    if input_angles.ndim == 1:
        input_angles = np.column_stack([input_angles, *[np.zeros_like(input_angles)] * (free - 1)])
    count = len(input_angles)
    at_ports = port_torques(system, torque, count)
    theta = np.ascontiguousarray(system.theta(input_angles) if theta is None else theta)
    train = held(modal)
    work = position_work(pairs, train, len(system.ports), system.rolling_rates)
    modes = (np.ascontiguousarray(modal.channel_modes[:, r:]), modal.omega[r:] ** 2)
    out = np.zeros(len(work.contact.right))
    loads = empty_pair_loads(pairs, count)
    positions = Positions(
        theta=theta,
        port_torques=at_ports,
        torques=at_ports.copy(),
        eta=np.zeros((count, modal.modes.shape[1])),
        active_flanks=np.zeros((count, len(pairs.s0)), dtype=np.int64),
        closure=np.zeros(count),
    )
    forward = np.ascontiguousarray(at_ports @ system.rated_port_torques >= 0.0)
    laws = law_functions(pairs)
    for start in range(0, count, CHUNK):
        stop = min(start + CHUNK, count)
        p, failed = solve_positions(
            laws, (start, stop), forward, train, modes, work, out, positions, loads
        )
        if p < stop:
            raise FlexgearError(_refusal(input_angles[p, 0], at_ports[p, 0], failed))
        if progress is not None and count > CHUNK:
            progress(stop / count)
    samples = positions._asdict()
    del samples["port_torques"]
    return Equilibrium(modal, input_angles=input_angles, **samples, **loads._asdict())


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
