"""The plain solution of the same equations: full matrices, one dense factorisation a step.

M q̈ + C q̇ + K q + Σ V F = e_d T − e_o T_b in physical coordinates with the average-acceleration
rule, C = M Φ diag(2ζω) Φᵀ M. Slow and simple; the fast step is compared with it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernel import BETA, GAMMA
from flexgear.analysis.modes import row_vectors
from flexgear.analysis.transient import Drive, State
from flexgear.coupling.modal import elastic_modes
from flexgear.coupling.pair_data import PER_PAIR, front_meshes, pair_rows
from flexgear.coupling.pairs import build_rows
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReferenceRun:
    """time (t,); motion q (t, d) including rolling; velocity (t, d); row forces by step."""

    time: Array
    motion: Array
    velocity: Array
    loads: tuple[Array, ...]


def damping_matrix(system: System) -> Array:
    """C = M Φ diag(2ζω) Φᵀ M over the elastic modes of the constant part, (d, d)."""
    omega, phi = elastic_modes(system)
    left = system.mass @ phi
    return (left * system.damping.rate(omega)) @ left.T


def reference_transient(
    system: System, drive: Drive, motion: Array, velocity: Array, *, time_step: float, steps: int,
    start: State,
) -> ReferenceRun:  # fmt: skip
    """Run ``steps`` steps from physical motion and velocity (d,); front flanks only.

    The state is that of a fast run (``start``) mapped to physical coordinates. The brake law is
    linearised at the extrapolated speed, as in the fast step.
    """
    h, pairs, rows = time_step, system.pairs, pair_rows(system.pairs)
    wanted = front_meshes(pairs)
    damping, mass, stiffness = damping_matrix(system), system.mass, system.stiffness
    touched = start.touched.copy()
    q, v = motion.copy(), velocity.copy()

    def pull(speed: float) -> tuple[float, float]:
        b = system.brake
        ratio = abs(speed) / b.rated_speed
        torque = np.sign(speed) * b.rated_torque * ratio**b.exponent
        slope = b.exponent * b.rated_torque / b.rated_speed * ratio ** (b.exponent - 1)
        return float(torque), float(slope)

    def rows_at(theta: Array) -> tuple[Array, Array, Array, Array]:
        n, n_pairs = build_rows(pairs, rows, theta, wanted)
        c = rows.damping[:n].copy()
        if pairs.one_sided:
            for p in range(n_pairs):
                m = rows.pair_mesh[p]
                if pairs.model[m] == PER_PAIR and not touched[m, rows.pair_index[p] % 8]:
                    c[rows.pair_row[p]] = 0.0
        vectors = row_vectors(system, rows, n)
        return vectors, rows.stiffness[:n].copy(), c, rows.offset[:n].copy()

    def remember(force: Array, n_pairs: int) -> None:
        touched[:] = 0
        for p in range(n_pairs):
            if force[rows.pair_row[p]] > 0:
                touched[rows.pair_mesh[p], rows.pair_index[p] % 8] = 1

    theta = system.angles @ q
    vectors, k, c, offset = rows_at(theta)
    force = k * (vectors @ q + offset) + c * (vectors @ v)
    if pairs.one_sided:
        force = np.where((rows.kind[: len(k)] < 0) | (force > 0), force, 0.0)
    torque = float(drive.torque(np.array([1e-9 * h]))[0])
    load = system.drive * torque - system.output * pull(float(system.output @ v))[0]
    a = np.linalg.solve(mass, load - vectors.T @ force - damping @ v - stiffness @ q)
    times, motions, speeds, loads = [0.0], [q], [v], [force]
    base = mass + GAMMA * h * damping + BETA * h * h * stiffness
    for step in range(steps):
        time = (step + 1) * h
        rigid = system.rigid @ (system.rigid.T @ (mass @ a))  # as the fast step extrapolates
        theta = system.angles @ (q + h * v + 0.5 * h * h * rigid)
        guess = float(system.output @ (v + h * rigid))
        vectors, k, c, offset = rows_at(theta)
        star = q + h * v + (0.5 - BETA) * h * h * a
        star_v = v + (1 - GAMMA) * h * a
        torque = float(drive.torque(np.array([time - 1e-9 * h]))[0])
        t0, slope = pull(guess)
        active = np.ones(len(k), dtype=bool)
        for _ in range(100):
            va = vectors[active]
            ka, ca = k[active], c[active]
            left = (
                base
                + (va.T * (BETA * h * h * ka + GAMMA * h * ca)) @ va
                + GAMMA * h * slope * np.outer(system.output, system.output)
            )
            right = (
                system.drive * torque
                - system.output * (t0 + slope * (float(system.output @ star_v) - guess))
                - damping @ star_v
                - stiffness @ star
                - va.T @ (ka * (va @ star + offset[active]) + ca * (va @ star_v))
            )
            new_a = np.linalg.solve(left, right)
            new_q, new_v = star + BETA * h * h * new_a, star_v + GAMMA * h * new_a
            force = k * (vectors @ new_q + offset) + c * (vectors @ new_v)
            if not pairs.one_sided:
                break
            carry = (rows.kind[: len(k)] < 0) | (force > 0)
            if np.array_equal(carry, active):
                break
            active = carry
        else:
            raise FlexgearError(f"reference step {step + 1}: contact did not settle")
        force = np.where(active, force, 0.0)
        q, v, a = new_q, new_v, new_a
        _, n_pairs = build_rows(pairs, rows, theta, wanted)
        remember(force, n_pairs)
        times.append(time)
        motions.append(q)
        speeds.append(v)
        loads.append(force)
    return ReferenceRun(np.array(times), np.array(motions), np.array(speeds), tuple(loads))
