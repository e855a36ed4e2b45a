"""Motion of the whole train over the period of a steady state, in the form of equilibria."""

from __future__ import annotations

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.harmonic_balance import Balance, Orbit, in_time
from flexgear.analysis.kernels.samples import empty_pair_loads
from flexgear.analysis.orbit_receptance import CondensedTrain
from flexgear.analysis.recovery import Output, Recovery
from flexgear.arrays import Array, Complex


def recovery_of(
    train: CondensedTrain, balance: Balance, orbit: Orbit, outputs: dict[str, Output]
) -> Recovery:
    """Elastic motions and forces over the N samples of a steady state's period, with all frames at
    angle zero; without loads of single tooth pairs."""
    elements, modal = train.elements, train.modal
    f, a = balance.parts(orbit.unknown)
    eta, on_linear = _harmonics(train, orbit, f, a)
    constant, count, q = train.given_forces(orbit.point), elements.samples, f.shape[1]
    forces = in_time(np.hstack([f, on_linear]), count) @ train.rows + constant
    system, pairs = modal.system, modal.system.pairs
    ports = len(system.ports)
    loads = empty_pair_loads(pairs, count)
    bearings = elements.bearing_rows
    first = q - len(bearings)
    loads.support_load[:, bearings] = -in_time(f[:, first:], count)
    result = Equilibrium(
        modal=modal,
        theta=np.zeros((count, len(system.angles))),
        torques=forces[:, -ports:].copy(),
        eta=in_time(eta, count),
        active_flanks=np.broadcast_to(elements.flanks, (count, len(elements.flanks))),
        input_angles=np.zeros((count, len(system.input_rows))),
        closure=np.zeros(count),
        **loads._asdict(),
    )
    return Recovery(result, outputs, forces)


def _harmonics(
    train: CondensedTrain, orbit: Orbit, f: Complex, a: Array
) -> tuple[Complex, Complex]:
    """Modal coordinates (H + 1, n) and forces (H + 1, s) on the linear rows of a steady state."""
    modal, point, q = train.modal, orbit.point, f.shape[1]
    r, harmonics = modal.rigid_count, len(f) - 1
    w = 2 * np.pi * train.elements.frequency * point.speed * np.arange(1.0, harmonics + 1)
    answers = train.answers(w, point.speed)
    whole = train.modes @ answers + train.residual
    on_linear = np.zeros((harmonics + 1, len(train.linear)), dtype=complex)
    on_linear[1:] = np.einsum("hsq,hq->hs", train.follow(whole, w, point), f[1:])
    constant = train.given_forces(point)
    flexibility, under_load = train.still_motions(point, constant)
    free = train.modes[q:, :r] @ train.free @ a
    motion = flexibility[q:, :q] @ f[0].real + free + under_load[q:]
    k, eye = train.steady, np.eye(len(train.steady))
    on_linear[0] = -np.linalg.solve(eye + k[:, None] * flexibility[q:, q:], k * motion)
    every = np.hstack([f, on_linear])
    eta = np.zeros((harmonics + 1, len(modal.omega)), dtype=complex)
    eta[1:] = np.einsum("hnq,hq->hn", answers, every[1:])
    push = train.modes.T @ every[0].real + modal.channel_modes.T @ constant
    a_still = train.operator(np.zeros(1), point.speed)[0].real
    elastic = a_still[r:] if a_still.ndim == 1 else a_still[r:, r:]
    eta[0, r:] = push[r:] / elastic if elastic.ndim == 1 else np.linalg.solve(elastic, push[r:])
    eta[0, :r] = train.free @ a
    return eta, on_linear
