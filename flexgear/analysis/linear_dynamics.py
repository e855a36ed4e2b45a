"""Linear dynamics of given matrices: whirl modes of turning systems, steady states.

Whirl modes of a turning system and its Campbell diagram.

M q̈ + s G q̇ + (K − s² C) q = 0 at a share s of the speed for which G = −Gᵀ and C were formed.
While K_s = K − s² C = LᵀL (L = Λ^½Uᵀ, K_s = UΛUᵀ in coordinates with M = I) stays without negative
eigenvalues, the state y = (L q, q̇) obeys

    ẏ = B y,   B = [[0, L], [−Lᵀ, −s G]] = −Bᵀ,

so that the frequencies are the eigenvalues of the Hermitian matrix −iB and are real to rounding.
Above, where the centrifugal term has taken all stiffness of some direction away, the general
eigenvalue problem of (q, q̇) is solved; a real part is then the growth of an unstable motion.
Frequencies are those seen in the frame in which a body's coordinates are described.

Steady state under harmonic loads, M q̈ + C q̇ + K q = Σ_k Re(f_k e^{iω_k t}), C with gyroscopic
terms: one linear solve a frequency, (K − ω² M + iω C) Q = f. Free rolling R (K R = 0) is split off,
q = R a + N b with Rᵀ M N = 0: it carries no stiffness at all, so that slow excitation of a train
that can roll loses no digits, and at ω = 0, where only balanced loads have a steady state, a = 0.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg
from scipy.optimize import linear_sum_assignment

from flexgear.arrays import Array, Complex
from flexgear.model.errors import FlexgearError

SOFT = 1e-13  # of the largest stiffness over mass: below it a direction is free, not stiff
ZERO = 1e-6  # of the largest |eigenvalue| of the general problem, where zeros are ill-conditioned


@dataclass(frozen=True)
class WhirlModes:
    """Modes q = Re(x e^{(g + iω) t}) at one speed.

    frequencies: (m,) Hz rising; shapes: (d, m) complex, xᴴ M x = 1; growth: (m,) 1/s, 0 while
    stable.
    """

    frequencies: Array
    shapes: Complex
    growth: Array


@dataclass(frozen=True)
class Campbell:
    """Frequencies over speed, each column one tracked mode.

    factors: (f,) rising; frequencies: (f, m) Hz; sense: (f, m) in [−1, 1], +1 circular forward,
    NaN without plane.
    """

    factors: Array
    frequencies: Array
    sense: Array


@dataclass(frozen=True)
class Crossing:
    """Where an excitation line meets a mode: speed factor and frequency in Hz."""

    line: int
    mode: int
    factor: float
    frequency: float


def whirl_modes(
    mass: Array,
    stiffness: Array,
    gyroscopic: Array,
    centripetal: Array,
    factor: float = 1.0,
    count: int | None = None,
) -> WhirlModes:
    """The lowest ``count`` (None: all d) whirl modes; rigid motions come first with 0 Hz.

    mass, stiffness, gyroscopic, centripetal: (d, d), the last two at factor 1. FlexgearError if
    the gyroscopic matrix is not skew-symmetric.
    """
    _check_skew(gyroscopic)
    lower = linalg.cholesky(mass, lower=True)

    def scaled(a: Array) -> Array:
        half = linalg.solve_triangular(lower, a, lower=True)
        return np.asarray(linalg.solve_triangular(lower, half.T, lower=True).T)

    turning = factor * scaled(gyroscopic)
    k = scaled(stiffness - factor**2 * centripetal)
    values, vectors = linalg.eigh(0.5 * (k + k.T))
    size = len(values) if count is None else min(count, len(values))
    least = SOFT * np.abs(values).max(initial=0.0)
    soft, growth = values <= least, np.zeros(size)
    if np.any(values < -least):
        omega, x, growth = _general(k, turning, size)
    elif not np.any(turning):
        omega, x = np.sqrt(np.where(soft, 0.0, values))[:size], vectors[:, :size].astype(complex)
    else:
        spring = np.sqrt(values[~soft])[:, None] * vectors[:, ~soft].T
        omega, x = _skew(spring, turning, size)
    shapes = linalg.solve_triangular(lower, x, lower=True, trans="T")
    norm = np.sqrt(np.einsum("dm,de,em->m", shapes.conj(), mass, shapes).real)
    return WhirlModes(omega / (2 * np.pi), shapes / norm, growth)


def _skew(spring: Array, turning: Array, size: int) -> tuple[Array, Complex]:
    """ω (size,) and shapes from the Hermitian problem −iB y = ω y."""
    elastic, d = spring.shape
    b = np.zeros((elastic + d, elastic + d))
    b[:elastic, elastic:], b[elastic:, :elastic] = spring, -spring.T
    b[elastic:, elastic:] = -turning
    # eigenvalues stand in pairs ±ω round one zero for each rigid motion: the upper d are the modes
    omega, y = linalg.eigh(-1j * b, subset_by_index=[elastic, elastic + size - 1])
    omega = np.where(omega <= 1e-12 * np.abs(b).sum(axis=1).max(), 0.0, omega)
    return omega, y[elastic:]  # q̇ is proportional to q


def _general(k: Array, turning: Array, size: int) -> tuple[Array, Complex, Array]:
    """ω, shapes and growth from q̇ = v, v̇ = −K q − G v, one of each conjugate or real pair."""
    d = len(k)
    state = np.block([[np.zeros((d, d)), np.eye(d)], [-k, -turning]])
    values, vectors = linalg.eig(state)
    least = ZERO * np.abs(values).max()
    values = np.where(np.abs(values.imag) > least, values.imag * 1j, 0) + np.where(
        np.abs(values.real) > least, values.real, 0
    )
    order = np.lexsort((-values.real, np.abs(values.imag), values.imag < 0))
    real = int(np.sum(values.imag == 0))  # real pairs: growing and decaying, or twice zero
    keep = np.concatenate([order[: real // 2], order[real : d + real // 2]])[:size]
    return values[keep].imag, vectors[:d, keep], values[keep].real


def _check_skew(gyroscopic: Array) -> None:
    if not np.allclose(gyroscopic, -gyroscopic.T, atol=1e-9 * np.abs(gyroscopic).max(initial=0.0)):
        raise FlexgearError("the gyroscopic matrix is not skew-symmetric: it would do work")


def whirl_sense(shapes: Complex, planes: Array, weights: ArrayLike | None = None) -> Array:
    """Sense of whirl (m,) in [−1, 1]: −2 Σ w Im(X* Y) / Σ w (|X|² + |Y|²).

    planes: (n, 2, d) rows of the motion x, y of n points; weights: (n,), e.g. masses. +1 is a
    circle counter-clockwise, −1 clockwise, 0 a line; NaN where no point moves in its plane.
    """
    w = np.ones(len(planes)) if weights is None else np.asarray(weights, dtype=float)
    x, y = np.moveaxis(planes @ shapes, 1, 0)
    swept = -2 * w @ np.imag(np.conj(x) * y)
    size = w @ (np.abs(x) ** 2 + np.abs(y) ** 2)
    moves = size > 1e-9 * max(float(np.max(size, initial=0.0)), np.finfo(float).tiny)
    return np.divide(swept, size, out=np.full(len(size), np.nan), where=moves)


def campbell(
    mass: Array,
    stiffness: Array,
    gyroscopic: Array,
    centripetal: Array,
    factors: ArrayLike,
    *,
    count: int | None = None,
    planes: Array | None = None,
    weights: ArrayLike | None = None,
) -> Campbell:
    """Whirl modes over speed factors (f,), tracked from each factor to the next.

    Modes are paired for the largest sum of MAC = |xᴴ M x'|²; where shapes cannot tell (turned
    bases of one frequency) the nearer frequency decides. planes, weights: see ``whirl_sense``.
    """
    s = np.asarray(factors, dtype=float)
    runs = [whirl_modes(mass, stiffness, gyroscopic, centripetal, f, count) for f in s]
    width = runs[0].shapes.shape[1]
    frequencies = np.zeros((len(s), width))
    sense = np.full((len(s), width), np.nan)
    before: Complex | None = None
    last = np.zeros(width)
    for i, run in enumerate(runs):
        order = np.arange(width)
        if before is not None:
            like = np.abs(before.conj().T @ mass @ run.shapes) ** 2
            distances = np.abs(last[:, None] - run.frequencies[None]) / max(last.max(), 1e-300)
            order = linear_sum_assignment(like - 1e-3 * distances, maximize=True)[1]
        before, last = run.shapes[:, order], run.frequencies[order]
        frequencies[i] = last
        if planes is not None:
            sense[i] = whirl_sense(before, planes, weights)
    return Campbell(s, frequencies, sense)


def crossings(campbell: Campbell, slopes: Sequence[float]) -> tuple[Crossing, ...]:
    """All crossings of lines with modes within the factors, rising in factor; where several meet at
    one, to nine digits, in the order of modes. slopes: Hz per unit of the speed factor.

    Frequencies are taken as straight between factors: the error falls with the square of the
    spacing. Rigid motions, which every line meets at rest, do not count.
    """
    s, met = campbell.factors, []
    for line, slope in enumerate(slopes):
        gap = campbell.frequencies - slope * s[:, None]
        for mode in range(gap.shape[1]):
            g, f = gap[:, mode], campbell.frequencies[:, mode]
            for i in np.flatnonzero(g[:-1] * g[1:] < 0):
                share = g[i] / (g[i] - g[i + 1])
                at = s[i] + share * (s[i + 1] - s[i])
                met.append(Crossing(line, mode, float(at), float(slope * at)))
            for i in np.flatnonzero((g == 0) & (f > 0)):
                met.append(Crossing(line, mode, float(s[i]), float(f[i])))
    return tuple(sorted(met, key=lambda c: (float(f"{c.factor:.9g}"), c.mode)))


UNBALANCED = 1e-6  # of the load: what may drive the rigid motion at ω = 0
LOST = 1e12  # amplification in scaled coordinates that leaves no digits
RESISTED = 1e-6  # of the largest stiffness: what may resist it


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


def _split(mass: Array, stiffness: Array, rigid: Array | None) -> tuple[Array, int]:
    """Basis [R, N] of all coordinates, M-orthonormal within each part and RᵀMN = 0."""
    if rigid is None or rigid.shape[1] == 0:
        return np.eye(len(mass)), 0
    resisted = np.abs(stiffness @ rigid).max(axis=0)
    if np.any(resisted > RESISTED * np.abs(stiffness).max() * np.abs(rigid).max(axis=0)):
        raise FlexgearError("a stiffness resists a motion that is stated as rigid")
    lower = linalg.cholesky(mass, lower=True)
    y, _ = linalg.qr(lower.T @ rigid)  # columns after the first r span the complement
    basis = linalg.solve_triangular(lower, y, lower=True, trans="T")
    return basis, rigid.shape[1]


def _check_balance(rigid: Array, load: Complex, drive: Complex) -> None:
    """Mean loads do no work on rigid motions; ``drive`` = Rᵀ f."""
    allowed = UNBALANCED * (np.abs(rigid).T @ np.abs(load))
    if np.any(np.abs(drive) > allowed):
        raise FlexgearError(
            "the mean load is not balanced: it would accelerate the train without end; give "
            "input and output torques that agree with the power flow"
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
            "without damping; state its rigid motions or give damping"
        )
    return np.asarray(x / size)
