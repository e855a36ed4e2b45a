"""Motion of the whole train over the period of a steady state, in the form of equilibria."""

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
    """Elastic motions and forces at the N samples of a steady state's period, with all frames at
    angle zero and without loads of single tooth pairs."""
    elements, modal = train.elements, train.modal
    f, a = balance.parts(orbit.unknown)
    eta, linear_forces = _harmonics(train, orbit, f, a)
    constant, count, q = train.constant_forces(orbit.point), elements.samples, f.shape[1]
    forces = in_time(np.hstack([f, linear_forces]), count) @ train.rows + constant
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
    response = train.modal_response(w, point.speed)
    receptance = train.modes @ response + train.residual
    linear_forces = np.zeros((harmonics + 1, len(train.linear)), dtype=complex)
    by_unit_forces = train.linear_row_forces(receptance, w, point)
    linear_forces[1:] = np.einsum("hsq,hq->hs", by_unit_forces, f[1:])
    constant = train.constant_forces(point)
    flexibility, under_load = train.static_motions(point, constant)
    rigid = train.modes[q:, :r] @ train.rigid_basis @ a
    motion = flexibility[q:, :q] @ f[0].real + rigid + under_load[q:]
    k, eye = train.static_stiffness, np.eye(len(train.static_stiffness))
    linear_forces[0] = -np.linalg.solve(eye + k[:, None] * flexibility[q:, q:], k * motion)
    forces = np.hstack([f, linear_forces])
    eta = np.zeros((harmonics + 1, len(modal.omega)), dtype=complex)
    eta[1:] = np.einsum("hnq,hq->hn", response, forces[1:])
    mean = train.modes.T @ forces[0].real + modal.channel_modes.T @ constant
    operator = train.operator(np.zeros(1), point.speed)[0].real
    elastic = operator[r:] if operator.ndim == 1 else operator[r:, r:]
    eta[0, r:] = mean[r:] / elastic if elastic.ndim == 1 else np.linalg.solve(elastic, mean[r:])
    eta[0, :r] = train.rigid_basis @ a
    return eta, linear_forces
