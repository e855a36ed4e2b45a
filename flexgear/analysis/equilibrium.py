"""Static equilibrium at given independent rotations (a carrier angle) under given torques.

The unknowns are the pair forces F, the amplitudes a of the rigid motions and the torques T_o of the
reaction ports:

    F = k ⟨Vᵀ u + e⟩,  u = P_r a + S f,  f = −V F + Σ e_p T_p − Σ e_o T_o,
    P_rᵀ f = 0   (rigid motions in equilibrium),   input_rows · q = 0   (given rotations),

u, f: motions of the channels and forces on them; V: columns of the pairs; e: their errors; ⟨x⟩: x
where positive, else 0; S: elastic flexibility of the channels; P_r: their rigid motions; e_p, e_o:
unit vectors of ports. Each position is one small dense problem. Nonlinear laws are linearised
repeatedly until the linearised force equals that of the law.
"""

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

CHUNK = 100  # positions between two progress reports


@dataclass(frozen=True)
class Solution:
    """Samples of equilibria and transients, with the first axis t.

    theta (t, A): angles of stages and frames, which determine the positions of pairs, rad; torques
    (t, P): external torques on the ports, N·m; eta (t, n): modal coordinates; pair_load (t, M, S):
    force of each tooth pair, N; pair_tooth: its tooth of the gear from 0, −1 without a pair;
    pair_stiffness: N/m; pair_position: path coordinate, m. For pairs in slices far_load (t, M, S):
    the part of the load on the second row, N, and pair_approach (t, M, S, 4): closing of both rows,
    then closing of both rows by the motion of bodies alone, m; else these have no length.
    support_load (t, r): forces of the rows of supports, bearings and loads, N; active_flanks
    (t, M): 1 for flanks that were included in the contact problem.
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
    """Equilibria at p positions; eta is relative to the undeflected train at each position.

    input_angles (p, F): independent rotations, rad; closure (p,): largest residual over the load.
    """

    input_angles: Array
    closure: Array


def held(modal: ModalSystem) -> Held:
    """Static flexibility and rigid motions of a train, from its modes and residual flexibility."""
    system, r = modal.system, modal.rigid_count
    elastic, omega2 = slice(r, None), modal.omega[r:] ** 2
    rigid, flexibility = modal.channel_modes[:, :r], modal.static_receptance()
    by_modes = (modal.input_rows[:, elastic] / omega2) @ modal.channel_modes[:, elastic].T
    rotations = by_modes + system.input_rows @ modal.residual_motion
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
    """External torques (count, P) on the ports, N·m, zero at reactions.

    torque: scalar or (count,) for the first port, the others in rated proportion; or (count, P).
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
    """Equilibria at p positions of a train.

    angles: of the first independent rotation, scalar or (p,), or of all, (p, F), rad; torque: on
    the first port, scalar or (p,), the others in rated proportion, or on all ports (p, P), N·m;
    theta (p, A): angles of stages and frames, rad, if they are not those of the undeflected train
    at these rotations. FlexgearError where a body is free to move or an equilibrium does not close
    within 1e-8 of the load.
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
            faulty = bool(pairs.gear_table.any() or pairs.planet_table.any())
            raise FlexgearError(_refusal(input_angles[p, 0], at_ports[p, 0], failed, faulty))
        if progress is not None and count > CHUNK:
            progress(stop / count)
    samples = positions._asdict()
    del samples["port_torques"]
    return Equilibrium(modal, input_angles=input_angles, **samples, **loads._asdict())


def _refusal(angle: float, torque: float, closure: float, faulty: bool) -> str:
    """Message for a position without equilibrium: carrier angle, rad, torque, N·m, closure; faulty:
    whether teeth have faults."""
    if faulty:
        return (
            f"no equilibrium at carrier angle {angle:.5f} rad under {torque:.6g} N·m: a faulty "
            "tooth may leave none in contact; use gear_mesh.model = 'face_load' without path_only, "
            "where tips touch"
        )
    if not np.isfinite(closure):
        return (
            f"no equilibrium at carrier angle {angle:.5f} rad under {torque:.6g} N·m: teeth that "
            "only push leave a body free, or the law of a bearing does not converge; check joints, "
            "supports and bearings, of which one row of rollers needs tilt_nm_per_rad"
        )
    return (
        f"equilibrium at carrier angle {angle:.5f} rad under {torque:.6g} N·m closes only to "
        f"{closure:.2e} of the load: stiffnesses are too far apart; check bearings and bolts"
    )
