"""The plain solution of the same equations: full matrices, one dense factorisation a step.

M q̈ + C q̇ + K q + Σ V F = e_d T − e_o T_b in physical coordinates with the average-acceleration
rule, C = M Φ diag(2ζω) Φᵀ M, and the ``law`` of tooth pairs. Slow and simple; the
fast step is compared with it.
"""

from dataclasses import dataclass

import numpy as np

from flexgear.analysis.kernels.step import BETA, GAMMA
from flexgear.analysis.transient import Drive
from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import pair_rows, row_motions
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.modal import elastic_modes
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError


@dataclass(frozen=True)
class ReferenceRun:
    """time (t,); motion q (t, d) including rolling; velocity (t, d); row forces by step."""

    time: Array
    motion: Array
    velocity: Array
    loads: tuple[Array, ...]


def damping_matrix(system: System) -> Array:
    """C = M Φ diag(2ζω) Φᵀ M over the elastic modes of the constant part, (d, d)."""
    modes = elastic_modes(system)
    omega, phi = modes.omega, modes.shapes
    left = system.mass @ phi
    return (left * system.damping.rate(omega)) @ left.T


def law(stiffness: Array, damping: Array, delta: Array, rate: Array) -> tuple[Array, Array, Array]:
    """F = min(max(0, k δ + c δ̇), 2 k ⟨δ⟩) of tooth pairs that cannot pull, N, and the stiffness and
    damping that it has there."""
    damped, limit = stiffness * delta + damping * rate, 2 * stiffness * np.maximum(delta, 0.0)
    limited = (delta > 0) & (damped > limit)
    held = (delta > 0) & (damped > 0) & ~limited
    force = np.where(limited, limit, np.where(held, damped, 0.0))
    return force, np.where(limited, 2 * stiffness, held * stiffness), held * damping


def reference_transient(
    system: System, drive: Drive, motion: Array, velocity: Array, *, time_step: float, steps: int
) -> ReferenceRun:  # fmt: skip
    """Run ``steps`` steps from physical motion and velocity (d,); the flanks that carry only.

    The brake law is linearised at the extrapolated speed, as in the fast step.
    """
    h, pairs, rows = time_step, system.pairs, pair_rows(system.pairs)
    carrying = carrying_flanks(pairs)
    damping, mass, stiffness = damping_matrix(system), system.mass, system.stiffness
    q, v = motion.copy(), velocity.copy()

    def pull(speed: float) -> tuple[float, float]:
        b = system.machines[-1]
        ratio = abs(speed) / b.rated_speed
        torque = np.sign(speed) * b.rated_torque * ratio**b.exponent
        slope = b.exponent * b.rated_torque / b.rated_speed * ratio ** (b.exponent - 1)
        return float(torque), float(slope)

    def rows_at(theta: Array) -> tuple[Array, Array, Array, Array]:
        n, _ = build_rows(pairs, rows, theta, carrying)
        vectors = row_motions(rows, n, system.blocks)
        return (
            vectors,
            rows.row["stiffness"][:n].copy(),
            rows.row["damping"][:n].copy(),
            rows.row["offset"][:n].copy(),
        )

    def forces(k: Array, c: Array, delta: Array, rate: Array) -> tuple[Array, Array, Array]:
        sided = rows.row["sided"][: len(k)] == 1
        return tuple(
            np.where(sided, a, b)
            for a, b in zip(law(k, c, delta, rate), (k * delta + c * rate, k, c), strict=True)
        )  # type: ignore[return-value]

    theta = system.angles @ q
    vectors, k, c, offset = rows_at(theta)
    force, _, _ = forces(k, c, vectors @ q + offset, vectors @ v)
    torque = float(drive.prescribed(np.array([1e-9 * h]))[0])
    driven, output = system.ports[0].row, system.ports[-1].row
    load = driven * torque - output * pull(float(output @ v))[0]
    a = np.linalg.solve(mass, load - vectors.T @ force - damping @ v - stiffness @ q)
    times, motions, speeds, loads = [0.0], [q], [v], [force]
    base = mass + GAMMA * h * damping + BETA * h * h * stiffness
    for step in range(steps):
        time = (step + 1) * h
        rigid = system.rigid @ (system.rigid.T @ (mass @ a))  # as the fast step extrapolates
        theta = system.angles @ (q + h * v + 0.5 * h * h * rigid)
        guess = float(output @ (v + h * rigid))
        vectors, k, c, offset = rows_at(theta)
        star = q + h * v + (0.5 - BETA) * h * h * a
        star_v = v + (1 - GAMMA) * h * a
        torque = float(drive.prescribed(np.array([time - 1e-9 * h]))[0])
        t0, slope = pull(guess)
        ka, ca = k, c
        for _ in range(100):
            left = (
                base
                + (vectors.T * (BETA * h * h * ka + GAMMA * h * ca)) @ vectors
                + GAMMA * h * slope * np.outer(output, output)
            )
            right = (
                driven * torque
                - output * (t0 + slope * (float(output @ star_v) - guess))
                - damping @ star_v
                - stiffness @ star
                - vectors.T @ (ka * (vectors @ star + offset) + ca * (vectors @ star_v))
            )
            new_a = np.linalg.solve(left, right)
            new_q, new_v = star + BETA * h * h * new_a, star_v + GAMMA * h * new_a
            force, kb, cb = forces(k, c, vectors @ new_q + offset, vectors @ new_v)
            if np.array_equal(ka, kb) and np.array_equal(ca, cb):
                break
            ka, ca = kb, cb
        else:
            raise FlexgearError(f"reference step {step + 1}: contact did not settle")
        q, v, a = new_q, new_v, new_a
        times.append(time)
        motions.append(q)
        speeds.append(v)
        loads.append(force)
    return ReferenceRun(np.array(times), np.array(motions), np.array(speeds), tuple(loads))
