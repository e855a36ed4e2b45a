"""A train whose gear meshes neither part nor change their stiffness is linear in its errors.

With rows V of the gear meshes, stiffness k, errors e(θ) and torques on ports, an equilibrium is

    (K + Vᵀ k V) q = f − Vᵀ k e,   input_rows · q = 0,   F = k (V q + e),

so that F = F_0 + S e with one influence matrix S for all positions: whole error cycles of hundreds
of thousands of positions cost one small solve. Over time every error is a sum of harmonics, of the
gears' turns and of gear-mesh frequency, from which the steady state follows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.contact_springs import row_vectors, rows_at
from flexgear.analysis.gear_mesh_errors import gear_mesh_errors
from flexgear.analysis.harmonic import GearMeshRows, SteadyState, steady_state
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import WAVE
from flexgear.coupling.system import System
from flexgear.structures.kinematics import turn

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def why_not_linear(system: System) -> str | None:
    """What makes the train depend on its errors other than linearly, or None."""
    pairs = system.pairs
    if pairs.one_sided:
        return "its gear meshes are one-sided"
    if np.any(pairs.model != WAVE) or np.any(np.ptp(pairs.k_table[pairs.table], axis=1) > 0):
        return "the stiffness of its gear meshes changes as they turn"
    if len(pairs.support_stiffness) or np.any(pairs.turns >= 0):
        return "supports or joints change direction as it turns"
    if len(pairs.bearing_law):
        return "bearings have clearance"
    if any(isinstance(machine, (GivenSpeed, Controller)) for machine in system.machines):
        return "a speed is given or controlled at a port"
    return None


@dataclass(frozen=True)
class LinearTrain:
    """rows (M, d) of the gear meshes, k (M,) N/m, c (M,) N s/m; load (d,): constant forces and
    rated torques on the given ports; turning: (angle, f_cos, f_sin) of forces that stand in space,
    f_cos cos θ + f_sin sin θ in the frames that turn."""

    system: System
    rows: Array
    k: Array
    c: Array
    load: Array
    turning: tuple[tuple[int, Array, Array], ...]

    def influence(self) -> Influence:
        """Forces and motion of equilibria in the errors and loads."""
        s, free = self.system, len(self.system.input_rows)
        held = np.array([p.row for p in s.ports if p.reaction])
        stiffness = s.stiffness + (self.rows.T * self.k) @ self.rows
        matrix = np.block([[stiffness, -held.T], [s.input_rows, np.zeros((free, free))]])
        loads = [self.load, *(f for _, *both in self.turning for f in both)]
        right = np.column_stack([*loads, -self.rows.T * self.k])
        right = np.vstack([right, np.zeros((free, right.shape[1]))])
        scale = np.sqrt(np.abs(np.diag(stiffness)))
        scale = np.concatenate([np.where(scale > 0, scale, 1.0), np.ones(free)])
        solved = np.linalg.solve(matrix / np.outer(scale, scale), right / scale[:, None])
        motion = (solved / scale[:, None])[: s.size]
        force = self.k[:, None] * (self.rows @ motion)
        n = len(loads)
        force[:, n:] += np.diag(self.k)
        return Influence(force[:, :n], force[:, n:])

    def forces(self, input_angles: Array) -> Array:
        """Gear-mesh forces (p, M) of equilibria at independent rotations (p, F), N."""
        influence = self.influence()
        theta = self.system.theta(input_angles)
        waves = self._load_waves(theta)
        return (
            waves @ influence.force_of_loads.T
            + gear_mesh_errors(self.system.pairs, theta) @ influence.force.T
        )

    def _load_waves(self, theta: Array) -> Array:
        """Factors (p, 1 + 2 n_l) of the constant load and of those that stand in space."""
        both = [w for a, *_ in self.turning for w in (np.cos(theta[:, a]), np.sin(theta[:, a]))]
        return np.column_stack([np.ones(len(theta)), *both])


@dataclass(frozen=True)
class Influence:
    """Forces of all M gear meshes. force_of_loads: N, under the constant load and under each part
    of those that stand in space, (M, 1 + 2 n_l); force: N/m, per metre of error of each gear mesh.
    """

    force_of_loads: Array
    force: Array


def linear_train(system: System, share: float = 1.0) -> LinearTrain:
    """Matrices of a train for which ``why_not_linear`` has no reason; share: of rated torques."""
    rows, n = rows_at(system)
    vectors, at = row_vectors(system, rows, n), np.flatnonzero(rows.kind[:n] >= 0)
    owner = rows.owner[at]
    order = np.argsort(owner)
    k, c = rows.stiffness[at][order], rows.damping[at][order]
    load = np.zeros(system.size)
    for port in system.ports:
        if not port.reaction:
            load = load + share * port.rated_torque * port.row
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
        across = turn(-math.pi / 2) @ vector  # in the frame a quarter turn on
        along = vector.copy()
        steady = np.array([0, 0, vector[2], 0, 0, vector[5]])
        load = load + steady @ motion
        turning.append((int(angle), (along - steady) @ motion, (across - steady) @ motion))
    return LinearTrain(system, vectors[at][order], k, c, load, tuple(turning))


def error_harmonics(system: System) -> tuple[Array, Complex]:
    """ω (K,) rad/s rising, the first 0, and E (M, K) with e(t) = Σ Re(E e^{iωt}) at rated speed.

    Random deviations of single teeth, which jump, are left out.
    """
    pairs = system.pairs
    speed = system.angles @ system.rolling @ system.rated_input_speeds
    waves: list[tuple[int, float, complex]] = [
        (m, 0.0, complex(v)) for m, v in enumerate(pairs.error_offset - pairs.gap)
    ]
    for m in range(len(pairs.s0)):
        if pairs.error_amplitude[m]:
            turns = 2 * math.pi / pairs.pitch[m]
            phase = turns * pairs.s0[m] + pairs.error_phase[m]
            rate = turns * pairs.rate[m] * speed[pairs.angle[m]]
            waves.append(_sine(m, rate, pairs.error_amplitude[m], phase))
        for h in np.flatnonzero(pairs.runout_amplitude[m]):
            rate = pairs.runout_rate[m, h] * speed[pairs.runout_angle[m, h]]
            waves.append(_sine(m, rate, pairs.runout_amplitude[m, h], pairs.runout_phase[m, h]))
    return _gathered(waves, len(pairs.s0))


def _sine(m: int, rate: float, amplitude: float, phase: float) -> tuple[int, float, complex]:
    """A sin(rate t + phase) as (m, |rate|, E)."""
    if rate == 0:
        return m, 0.0, complex(amplitude * math.sin(phase))
    value = -1j * amplitude * np.exp(1j * phase)
    return m, abs(rate), complex(value if rate > 0 else np.conj(value))


def _gathered(waves: list[tuple[int, float, complex]], count: int) -> tuple[Array, Complex]:
    omega: list[float] = [0.0]
    for _, w, _ in sorted(waves, key=lambda x: x[1]):
        if w > omega[-1] * (1 + 1e-9) and w > 0:
            omega.append(w)
    out = np.zeros((count, len(omega)), dtype=complex)
    for m, w, value in waves:
        out[m, int(np.argmin(np.abs(np.array(omega) - w)))] += value
    return np.array(omega), out


def steady_harmonics(modal: ModalSystem, share: float = 1.0) -> SteadyState:
    """Steady state of a linear train at rated speed under its errors and ``share`` of its torques.

    As in the time stepping, damping of gear meshes acts on the motion and not on the errors' own
    rate, structural damping on the modes of the constant part, and the brake's torque follows its
    law, linearised at rated speed.
    """
    system = modal.system
    train = linear_train(system, share)
    damping = _damping(modal, share)
    stiffness = system.stiffness.copy()
    if system.gyroscopic is not None and system.centripetal is not None:
        damping = damping + system.gyroscopic
        stiffness = stiffness - system.centripetal
    omega, errors = error_harmonics(system)
    omega, loads = _loads_in_time(train, omega, share)
    errors = np.hstack([errors, np.zeros((len(errors), len(omega) - errors.shape[1]))])
    complex_stiffness = train.k[:, None] + 1j * np.multiply.outer(train.c, omega)
    return steady_state(
        system.mass,
        damping,
        stiffness,
        GearMeshRows(train.rows, train.k, train.c),
        omega,
        errors * train.k[:, None] / complex_stiffness,
        loads,
        rigid=system.rolling,
    )


def _damping(modal: ModalSystem, share: float) -> Array:
    """Modal damping of the structure, and the slopes of brakes at rated speed, (d, d)."""
    system = modal.system
    momentum = system.mass @ modal.modes
    out = (momentum * modal.damping) @ momentum.T
    for port, brake in zip(system.ports, system.machines, strict=True):
        if isinstance(brake, Brake) and brake.rated_speed > 0:
            slope = share * brake.exponent * brake.rated_torque / brake.rated_speed
            out = out + slope * np.outer(port.row, port.row)
    return np.asarray(out)


def _loads_in_time(train: LinearTrain, omega: Array, share: float) -> tuple[Array, Complex]:
    """Frequencies with those of loads that stand in space behind, and f (d, K)."""
    system = train.system
    mean = train.load.copy()
    for port in system.ports:
        if port.reaction:
            mean += share * port.rated_torque * port.row
    columns = [mean.astype(complex), *[np.zeros(system.size, complex)] * (len(omega) - 1)]
    speed = system.angles @ system.rolling @ system.rated_input_speeds
    rates = list(omega)
    for angle, cosine, sine in train.turning:
        rates.append(abs(float(speed[angle])))
        columns.append(cosine - 1j * np.sign(speed[angle]) * sine)
    return np.array(rates), np.column_stack(columns)
