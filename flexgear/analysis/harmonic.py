"""Steady state under harmonic loads and gear-mesh errors at constant stiffness.

    M q̈ + (C + G) q̇ + K q + Vᵀ F = Σ_k Re(f_k e^{iω_k t}),   F = k (V q + e) + c (V q̇ + ė),

with e = Σ_k Re(E_k e^{iω_k t}). One linear solve per frequency gives the amplitudes

    (K_t − ω² M + iω C_t) Q = f − Vᵀ (k + iωc) E,   F = (k + iωc)(V Q + E),
    K_t = K + Vᵀ k V,   C_t = C + G + Vᵀ c V.

Free rolling R (K_t R = 0) is split off, q = R a + N b with Rᵀ M N = 0: it carries no stiffness at
all, so that slow excitation of a train that can roll loses no digits, and at ω = 0, where only
balanced loads have a steady state, a = 0.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from flexgear.arrays import Array, Complex
from flexgear.model.errors import FlexgearError

UNBALANCED = 1e-6  # of the load: what may drive the rigid motion at ω = 0
LOST = 1e12  # amplification in scaled coordinates that leaves no digits
RESISTED = 1e-6  # of the largest stiffness: what may resist it


@dataclass(frozen=True)
class GearMeshRows:
    """Gear meshes of constant stiffness: rows V (n, d), k (n,) N/m, c (n,) N s/m."""

    rows: Array
    stiffness: Array
    damping: Array


@dataclass(frozen=True)
class SteadyState:
    """Amplitudes of a steady state: x(t) = Σ_k Re(x_k e^{iω_k t}).

    omega: (K,) rad/s; motion: (d, K) complex; forces: (n, K) complex, gear-mesh forces, N,
    positive when they compress.
    """

    omega: Array
    motion: Complex
    forces: Complex

    def forces_at(self, time: ArrayLike) -> Array:
        """Gear-mesh forces (t, n) in N at times (t,) in s."""
        turn = np.exp(1j * np.multiply.outer(np.asarray(time, dtype=float), self.omega))
        return np.asarray((turn @ self.forces.T).real)


def harmonic_response(
    mass: Array,
    damping: Array,
    stiffness: Array,
    omega: ArrayLike,
    loads: Complex,
    rigid: Array | None = None,
) -> Complex:
    """Q (d, K) of M q̈ + C q̇ + K q = Re(f_k e^{iω_k t}) for ω (K,) rad/s and f (d, K).

    damping: (d, d), gyroscopic terms included; rigid: (d, r) free rigid motions, K R = 0. At ω = 0
    the motion is M-orthogonal to them. FlexgearError where a load at ω = 0 is not balanced, where
    stiffness resists a rigid motion, or where an undamped frequency meets a resonance.
    """
    basis, r = _split(mass, stiffness, rigid)
    m, c, k = (basis.T @ a @ basis for a in (mass, damping, stiffness))
    k[:r], k[:, :r], m[:r, r:], m[r:, :r] = 0.0, 0.0, 0.0, 0.0
    forces = basis.T @ loads
    out = np.zeros(loads.shape, dtype=complex)
    for i, w in enumerate(np.atleast_1d(np.asarray(omega, dtype=float))):
        if w == 0:
            _check_balance(basis[:, :r], loads[:, i], forces[:r, i])
            b = _solve(k[r:, r:].astype(complex), forces[r:, i], w)
            out[:, i] = basis[:, r:] @ b
        else:
            out[:, i] = basis @ _solve(k - w**2 * m + 1j * w * c, forces[:, i], w)
    return out


def steady_state(
    mass: Array,
    damping: Array,
    stiffness: Array,
    gear_meshes: GearMeshRows,
    omega: ArrayLike,
    errors: ArrayLike,
    loads: ArrayLike | None = None,
    rigid: Array | None = None,
) -> SteadyState:
    """Motion and gear-mesh forces under errors E (n, K) in m and loads f (d, K) in N, N m.

    mass, damping (C + G), stiffness: (d, d) without the gear meshes; rigid: (d, r) motions that
    strain neither springs nor gear meshes. A mean load or a mean error is the column of ω = 0,
    a real number; at ω = 0 the loads must balance along the rigid motions.
    """
    w = np.atleast_1d(np.asarray(omega, dtype=float))
    v, k, c = gear_meshes.rows, gear_meshes.stiffness, gear_meshes.damping
    error = np.asarray(errors, dtype=complex).reshape(len(k), len(w))
    shape = (len(mass), len(w))
    external = np.zeros(shape, dtype=complex) if loads is None else np.asarray(loads, dtype=complex)
    complex_stiffness = k[:, None] + 1j * np.multiply.outer(c, w)
    motion = harmonic_response(
        mass,
        damping + (v.T * c) @ v,
        stiffness + (v.T * k) @ v,
        w,
        external.reshape(shape) - v.T @ (complex_stiffness * error),
        rigid,
    )
    return SteadyState(w, motion, complex_stiffness * (v @ motion + error))


def _split(mass: Array, stiffness: Array, rigid: Array | None) -> tuple[Array, int]:
    """Basis [R, N] of all coordinates, M-orthonormal within each part and RᵀMN = 0."""
    if rigid is None or rigid.shape[1] == 0:
        return np.eye(len(mass)), 0
    resisted = np.abs(stiffness @ rigid).max(axis=0)
    if np.any(resisted > RESISTED * np.abs(stiffness).max() * np.abs(rigid).max(axis=0)):
        raise FlexgearError("a stiffness resists a motion that is said to be rigid")
    lower = linalg.cholesky(mass, lower=True)
    y, _ = linalg.qr(lower.T @ rigid)  # columns after the first r span the complement
    basis = linalg.solve_triangular(lower, y, lower=True, trans="T")
    return basis, rigid.shape[1]


def _check_balance(rigid: Array, load: Complex, drive: Complex) -> None:
    """Mean loads do no work on rigid motions; ``drive`` = Rᵀ f."""
    allowed = UNBALANCED * (np.abs(rigid).T @ np.abs(load))
    if np.any(np.abs(drive) > allowed):
        raise FlexgearError(
            "the mean load is not balanced: it would speed the train up for ever; give input and "
            "output torques that agree with the power flow"
        )


def _solve(matrix: Complex, load: Complex, omega: float) -> Complex:
    """Solution with rows and columns scaled by the diagonal; FlexgearError where singular."""
    if not len(load):
        return np.zeros(0, dtype=complex)
    size = np.sqrt(np.abs(matrix).max(axis=1))
    size = np.where(size > 0, size, 1.0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", linalg.LinAlgWarning)
            x = linalg.solve(matrix / np.multiply.outer(size, size), load / size)
    except (linalg.LinAlgError, linalg.LinAlgWarning):
        x = np.full(len(load), np.nan)
    if not np.abs(x).max() <= LOST * np.abs(load / size).max():
        raise FlexgearError(
            f"no steady state at {omega:.6g} rad/s: the system is free to move or resonates "
            "without damping; name its rigid motions or give damping"
        )
    return np.asarray(x / size)
