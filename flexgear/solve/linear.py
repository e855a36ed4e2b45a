"""Trains with constant, two-sided gear-mesh stiffness, which are linear in their errors.

With rows V of the gear meshes, stiffness k, errors e(θ) and torques on ports, an equilibrium is

    (K + Vᵀ k V) q = f − Vᵀ k e,   input_rows · q = 0,   F = k (V q + e),

so that F = F_0 + S e with one influence matrix S for all positions: error cycles of hundreds of
thousands of positions need one small linear system. Over time every error is a sum of harmonics of
the gears' rotations and of the gear-mesh frequency, from which the steady state follows. It is used
to check the time stepping.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.analysis.kernels.samples import read_offsets
from flexgear.analysis.linear_dynamics import harmonic_response
from flexgear.analysis.modes import row_vectors, rows_at
from flexgear.arrays import Array, Complex
from flexgear.coupling.kernels.elements import packed, pair_rows
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import WAVE
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError
from flexgear.results.labelled_dataset import groups_of, labelled_dataset, variable
from flexgear.results.load_sharing import sharing_coefficients
from flexgear.results.settling import settled
from flexgear.results.summary import sharing_summary_of
from flexgear.solve.angles import lead_speed, samples_of_stage, stage_motions
from flexgear.solve.dataset import body_rows, result_attrs, result_labels
from flexgear.solve.model import Model
from flexgear.structures.bodies import turn

CHUNK = 20_000  # times evaluated together
SAME = 12  # decimals, relative to the highest frequency, to which equal frequencies agree
COMPARED = 100_000  # largest number of samples of a transient compared with the harmonic solution


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

    rows (M, d): of the gear meshes; k (M,): N/m; c (M,): N s/m; load (d,): constant forces, and
    rated torques on ports of given torque; turning: forces fixed in space, as index of the angle θ
    of their frame and vectors (d,) of f_cos cos θ + f_sin sin θ."""

    system: System
    rows: Array
    k: Array
    c: Array
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
    vectors, at = row_vectors(system, rows, n), np.flatnonzero(rows.row["kind"][:n] >= 0)
    owner = rows.row["owner"][at]
    order = np.argsort(owner)
    k, c = rows.row["stiffness"][at][order], rows.row["damping"][at][order]
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
    return LinearTrain(system, vectors[at][order], k, c, load, tuple(turning))


@dataclass(frozen=True)
class SteadyState:
    """Amplitudes of a steady state: x(t) = Σ_k Re(x_k e^{iω_k t}).

    omega (K,): rad/s; motion (d, K): complex; forces (M, K): complex gear-mesh forces, N, positive
    in compression.
    """

    omega: Array
    motion: Complex
    forces: Complex

    def forces_at(self, time: ArrayLike) -> Array:
        """Gear-mesh forces (t, M), N, at times (t,), s."""
        phases = np.exp(1j * np.multiply.outer(np.asarray(time, dtype=float), self.omega))
        return np.asarray((phases @ self.forces.T).real)


def error_harmonics(system: System) -> tuple[Array, Complex]:
    """Frequencies ω (K,), rad/s, rising from 0, and amplitudes E (M, K), m, of the errors at rated
    speed, e(t) = Σ Re(E e^{iωt}), without random deviations of single teeth, which are not smooth.
    """
    pairs = system.pairs
    speed = system.angles @ system.rolling @ system.rated_input_speeds
    waves: list[tuple[int, float, complex]] = [
        (m, 0.0, complex(v)) for m, v in enumerate(pairs.error_offset - pairs.gap)
    ]
    for m in range(len(pairs.s0)):
        for h in np.flatnonzero(pairs.error_amplitude[m]):
            wave_number = 2 * math.pi * (h + 1) / pairs.pitch[m]
            phase = wave_number * pairs.s0[m] + pairs.error_phase[m, h]
            rate = wave_number * pairs.rate[m] * speed[pairs.angle[m]]
            waves.append(_sine(m, rate, pairs.error_amplitude[m, h], phase))
        for h in np.flatnonzero(pairs.runout_amplitude[m]):
            rate = pairs.runout_rate[m, h] * speed[pairs.runout_angle[m, h]]
            waves.append(_sine(m, rate, pairs.runout_amplitude[m, h], pairs.runout_phase[m, h]))
    values = np.zeros((len(waves), len(pairs.s0)), dtype=complex)
    for row, (m, _, value) in zip(values, waves, strict=True):
        row[m] = value
    omega, errors = _merged(np.array([w for _, w, _ in waves]), values)
    return omega, errors.T


def _sine(m: int, rate: float, amplitude: float, phase: float) -> tuple[int, float, complex]:
    """(m, ω, E) with Re(E e^{iωt}) = A sin(rate t + phase), ω = |rate|, for gear mesh m."""
    if rate == 0:
        return m, 0.0, complex(amplitude * math.sin(phase))
    value = -1j * amplitude * np.exp(1j * phase)
    return m, abs(rate), complex(value if rate > 0 else np.conj(value))


def train_harmonic(model: Model) -> SteadyState:
    """Steady state of a train at rated speed under its errors and rated torques.

    F = (k + iωc) (V Q + E): as in the time stepping, damping of gear meshes acts on the rates of
    motion and errors, structural damping on the modes without gear meshes, and the brake's law is
    linearised at rated speed. FlexgearError, with the reason, for a train that is not linear.
    """
    system, reason = model.system, why_not_linear(model.system)
    if reason is not None:
        raise FlexgearError(f"there is no harmonic steady state: {reason}")
    train = linear_train(system)
    v, k, c = train.rows, train.k[:, None], train.c[:, None]
    damping = structural_damping(model.modal) + v.T @ (c * v)
    stiffness = system.stiffness + v.T @ (k * v)
    if system.gyroscopic is not None and system.centripetal is not None:
        damping = damping + system.gyroscopic
        stiffness = stiffness - system.centripetal
    omega, errors = error_harmonics(system)
    omega, loads = _loads_in_time(train, omega)
    by_errors = k + 1j * omega * c  # gear-mesh forces by errors alone
    by_errors[:, : errors.shape[1]] *= errors
    by_errors[:, errors.shape[1] :] = 0.0
    motion = harmonic_response(
        system.mass, damping, stiffness, omega, loads - v.T @ by_errors, system.rolling
    )
    return SteadyState(omega, motion, (k + 1j * omega * c) * (v @ motion) + by_errors)


def structural_damping(modal: ModalSystem) -> Array:
    """Damping matrix (d, d): modal damping, dampers, and brakes linearised at rated speed."""
    system = modal.system
    momentum = system.mass @ modal.modes
    out = (momentum * modal.damping) @ momentum.T + system.dampers
    for port, brake in zip(system.ports, system.machines, strict=True):
        if isinstance(brake, Brake) and brake.rated_speed > 0:
            slope = brake.exponent * brake.rated_torque / brake.rated_speed
            out = out + slope * np.outer(port.row, port.row)
    return np.asarray(out)


def _loads_in_time(train: LinearTrain, omega: Array) -> tuple[Array, Complex]:
    """Frequencies (K,) of the errors (``omega``) and then of forces fixed in space, rad/s, and the
    amplitudes (d, K) of loads at these."""
    system = train.system
    mean = train.load.copy()
    for port in system.ports:
        if port.reaction:
            mean += port.rated_torque * port.row
    columns = [mean.astype(complex), *[np.zeros(system.size, complex)] * (len(omega) - 1)]
    speed = system.angles @ system.rolling @ system.rated_input_speeds
    rates = list(omega)
    for angle, cosine, sine in train.turning:
        rates.append(abs(float(speed[angle])))
        columns.append(cosine - 1j * np.sign(speed[angle]) * sine)
    return np.array(rates), np.column_stack(columns)


def harmonic_data(
    model: Model, state: SteadyState, transient: xr.Dataset | None = None
) -> xr.Dataset:
    """Dataset of the amplitudes of gear-mesh forces and displacements over the frequencies.

    transient: a transient for comparison. Its settled part, at most the last ``COMPARED`` samples,
    is fitted with the same frequencies, and compared at each sample; attribute
    ``largest_difference_of_stage``: largest difference over the stage's largest force.
    """
    names, rows = body_rows(model.system)
    omega, forces = _merged(state.omega, state.forces.T @ model.gear_meshes.sign)
    _, motion = _merged(state.omega, (rows @ state.motion).T)
    data = labelled_dataset(
        "harmonic",
        omega / (2 * np.pi),
        {
            "force_amplitude": np.abs(forces),
            "displacement_amplitude": np.abs(motion).reshape(len(omega), len(names), 6),
            "rated_gear_mesh_force": model.rated,
            **_coefficients(model, state),
        },
        result_attrs(model),
        {**result_labels(model), "body": names},
        model.gear_meshes.names,
    )
    if transient is None:
        return data
    rest = settled(transient, COMPARED)
    time, stepped = rest["time"].to_numpy(), rest["gear_mesh_force"].to_numpy()
    fitted = fitted_amplitudes(time, stepped, omega)
    data["stepped_force_amplitude"] = variable("stepped_force_amplitude", fitted, "harmonic")
    difference = np.abs(stepped - state.forces_at(time) @ model.gear_meshes.sign)
    by_stage = [
        _share(float(difference[:, at].max()), float(np.abs(stepped[:, at]).max()))
        for at in (model.gear_meshes.of_stage(s.name) for s in model.case.stages)
    ]
    data.attrs["largest_difference_of_stage"] = by_stage
    data.attrs["largest_difference"] = max(by_stage)
    return data


def _share(part: float, whole: float) -> float:
    """part / whole; for whole = 0: 0 if part is 0, else 1."""
    return part / whole if whole else float(part > 0)


def _merged(omega: Array, values: Complex) -> tuple[Array, Complex]:
    """Distinct frequencies, rising, with the sums of the amplitudes (K, n) of equal frequencies."""
    largest = omega.max(initial=0.0) or 1.0
    _, first, place = np.unique(
        np.round(omega / largest, SAME), return_index=True, return_inverse=True
    )
    unique = omega[first]
    out = np.zeros((len(unique), values.shape[1]), dtype=complex)
    np.add.at(out, place, values)
    return unique, out


def fitted_amplitudes(time: Array, values: Array, omega: Array) -> Array:
    """Amplitudes |X_k| (K, n) of the least-squares fit Σ Re(X_k e^{iω_k t}) of values (t, n) at
    times (t,), s; the mean at ω = 0."""
    angle = np.multiply.outer(time, omega[omega > 0])
    columns = np.column_stack([np.ones(len(time)), np.cos(angle), np.sin(angle)])
    mean, *coefficients = np.linalg.lstsq(columns, values, rcond=None)[0]
    cosine, sine = np.split(np.reshape(coefficients, (-1, values.shape[1])), 2)
    out = np.zeros((len(omega), values.shape[1]))
    out[omega > 0], out[omega == 0] = np.hypot(cosine, sine), np.abs(mean)
    return out


def _coefficients(model: Model, state: SteadyState) -> dict[str, Array]:
    """Load sharing coefficients of every stage over its gear-mesh cycles in the error cycle."""
    names, out = model.gear_meshes.names, dict[str, Array]()
    stages = {
        "planet_coefficient": np.array([n.stage for n in names]),
        "load_sharing_coefficient": np.array([g.stage for g in groups_of(names)]),
    }
    motions = stage_motions(model.case, model.flow)
    for number, stage in enumerate(model.case.stages):
        if motions[number].theta == 0 or stage.planets < 2:
            continue
        samples = samples_of_stage(model.case, motions, number, None, linear=True)
        times = samples.angles / abs(lead_speed(model.case, model.flow))
        parts = [
            state.forces_at(times[first : first + CHUNK]) @ model.gear_meshes.sign
            for first in range(0, len(times), CHUNK)
        ]
        per_cycle = {s.name: 0.0 for s in model.case.stages}
        per_cycle[stage.name] = float(samples.per_gear_mesh)
        values = sharing_coefficients(np.concatenate(parts), names, per_cycle)
        for name, column_stages in stages.items():
            every = out.setdefault(name, np.full_like(values[name], np.nan))
            np.copyto(every, values[name], where=column_stages == stage.name)
        out = {**values, **out}
    return out


def harmonic_figures(data: xr.Dataset) -> dict[str, Any]:
    """Section of a summary: frequencies, largest difference to time stepping, load sharing."""
    return {
        "frequencies_hz": [float(f) for f in data["harmonic"].to_numpy() if f > 0],
        "largest_difference": data.attrs.get("largest_difference"),
        "load_sharing": sharing_summary_of(data),
    }
