"""Linear lumped train with constant stiffness, independent of the package: statics and harmonics.

    M q¨ + C q˙ + K q = f − B' (k e + c e˙),   F = k (B q + e) + c (B q˙ + e˙)

B (m, d) gives the compressions of the gear meshes, e (m,) their errors (excess of material is
positive); K and C hold the gear meshes' own B' k B and B' c B. One rigid rolling motion is allowed;
the loads f must balance on it. Papers' equations, corrected, are assembled into this form.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import null_space

from flexgear.arrays import Array, Complex


@dataclass(frozen=True)
class Harmonic:
    """e_m(t) = amplitude_m sin(rate t + phase_m); rate in rad/s, 0 for an error that stands."""

    rate: float
    amplitude: Array  # (m,) m
    phase: Array  # (m,) rad

    @property
    def complex(self) -> Complex:
        """A exp(i phase), of which e is the imaginary part times exp(i rate t)."""
        return np.asarray(self.amplitude * np.exp(1j * self.phase), dtype=complex)


@dataclass(frozen=True)
class Linear:
    """Matrices of a train: mass, damping (with gyroscopic terms), stiffness (d, d), rows B (m, d),
    k and c of the gear meshes (m,), constant load f (d,)."""

    mass: Array
    damping: Array
    stiffness: Array
    rows: Array
    k: Array
    c: Array
    load: Array

    def statics(self) -> tuple[Array, Array, Array, Array]:
        """q0 (d,), F0 (m,), Q (d, m), S (m, m) of q = q0 + Q e and F = F0 + S e."""
        rigid = null_space(self.stiffness, rcond=1e-11)
        size, free = rigid.shape
        bordered = np.block([[self.stiffness, rigid], [rigid.T, np.zeros((free, free))]])
        right = np.column_stack([self.load, -self.rows.T * self.k])
        solved = np.linalg.solve(bordered, np.vstack([right, np.zeros((free, right.shape[1]))]))
        q = solved[:size]
        if np.abs(solved[size:]).max(initial=0.0) > 1e-6 * np.abs(right).max():
            raise ValueError("loads do not balance on the rigid motion")
        q0, shifts = q[:, 0], q[:, 1:]
        force = self.k[:, None] * (self.rows @ shifts + np.eye(len(self.k)))
        return q0, self.k * (self.rows @ q0), shifts, force

    def response(self, rate: float) -> tuple[Complex, Complex]:
        """Q (d, m) and S (m, m) at ``rate`` rad/s: amplitudes of q and F for those of e."""
        if rate == 0.0:
            _, _, shifts, force = self.statics()
            return shifts.astype(complex), force.astype(complex)
        pair = self.k + 1j * rate * self.c
        dynamic = self.stiffness + 1j * rate * self.damping - rate**2 * self.mass
        shifts = np.linalg.solve(dynamic, -self.rows.T * pair)
        return shifts, pair[:, None] * (self.rows @ shifts + np.eye(len(self.k)))

    def forces(self, errors: Sequence[Harmonic], time: Array, quasi_static: bool) -> Array:
        """Gear-mesh forces (len(time), m) in the steady state under ``errors``."""
        _, mean, _, static = self.statics()
        total = np.tile(mean, (len(time), 1))
        for one in errors:
            matrix = static.astype(complex) if quasi_static else self.response(one.rate)[1]
            total += _waves(matrix @ one.complex, one.rate, time)
        return total

    def motion(self, errors: Sequence[Harmonic], time: Array, quasi_static: bool) -> Array:
        """Coordinates (len(time), d) in the steady state under ``errors``."""
        mean, _, shifts, _ = self.statics()
        total = np.tile(mean, (len(time), 1))
        for one in errors:
            matrix = shifts.astype(complex) if quasi_static else self.response(one.rate)[0]
            total += _waves(matrix @ one.complex, one.rate, time)
        return total

    def stepped(self, errors: Sequence[Harmonic], time: Array) -> Array:
        """Gear-mesh forces (len(time), m) by Runge–Kutta from the error-free equilibrium at time 0.

        The rigid motion is left out (its amplitude does not enter F), as coordinates without it.
        """
        values, vectors = np.linalg.eigh(self.mass)
        scale = vectors / np.sqrt(values)
        mean = self.statics()[0]
        d = len(mean)
        inverse = scale @ scale.T
        state = np.block(
            [[np.zeros((d, d)), np.eye(d)], [-inverse @ self.stiffness, -inverse @ self.damping]]
        )
        push = -inverse @ self.rows.T

        def error(t: float) -> tuple[Array, Array]:
            turning = [one.complex * np.exp(1j * one.rate * t) for one in errors]
            e = np.sum([z.imag for z in turning], axis=0)
            speed = np.sum([o.rate * z.real for o, z in zip(errors, turning, strict=True)], axis=0)
            return e, speed

        def slope(t: float, y: Array) -> Array:
            e, speed = error(t)
            rate = state @ y
            rate[d:] += push @ (self.k * e + self.c * speed)
            return rate

        solution = solve_ivp(
            slope, (0.0, time[-1]), np.zeros(2 * d), "DOP853", time, rtol=1e-6, atol=1e-10
        )
        q = solution.y[:d].T + mean
        e, speed = (np.array(part) for part in zip(*(error(t) for t in time), strict=True))
        return (q @ self.rows.T + e) * self.k + (solution.y[d:].T @ self.rows.T + speed) * self.c


def cycle_shares(forces: Array, cycles: int) -> Array:
    """N max F_i/Σ max F_i of every gear-mesh cycle, (cycles, N).

    ``forces`` (cycles × samples, N) of one gear mesh, cycle by cycle.
    """
    planets = forces.shape[1]
    peaks = forces.reshape(cycles, -1, planets).max(axis=1)
    return np.asarray(planets * peaks / peaks.sum(axis=1, keepdims=True))


def modal_damping(mass: Array, stiffness: Array, ratio: float) -> Array:
    """(d, d) matrix that damps every elastic mode by ``ratio``, the rigid one not at all."""
    root = np.sqrt(np.diag(mass))
    squares, shapes = np.linalg.eigh(stiffness / np.outer(root, root))
    omega = np.sqrt(np.where(squares > 1e-9 * squares[-1], squares, 0.0))
    return np.asarray(root[:, None] * (shapes * (2 * ratio * omega)) @ shapes.T * root[None, :])


def _waves(amplitude: Complex, rate: float, time: Array) -> Array:
    """Im(a exp(i rate t)), (len(time), len(a))."""
    angle = rate * time
    return np.outer(np.sin(angle), amplitude.real) + np.outer(np.cos(angle), amplitude.imag)
