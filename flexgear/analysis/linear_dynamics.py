"""Whirl modes of turning systems from their matrices, and Campbell diagrams of them.

M q̈ + s G q̇ + (K − s² C) q = 0 at a share s of the speed for which the gyroscopic
matrix G = −Gᵀ and the centripetal matrix C were formed. While K_s = K − s² C = LᵀL (L = Λ^½Uᵀ,
K_s = UΛUᵀ in coordinates with M = I) has no negative eigenvalues, the state y = (L q, q̇) obeys

    ẏ = B y,   B = [[0, L], [−Lᵀ, −s G]] = −Bᵀ,

so that the frequencies are the eigenvalues of the Hermitian matrix −iB and are exactly real. At
higher speeds, where the centrifugal term exceeds the stiffness in some direction, the general
eigenvalue problem of (q, q̇) is solved; a real part is then the growth rate of an unstable motion.
Frequencies are those in the frame in which the coordinates of a body are defined.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg
from scipy.optimize import linear_sum_assignment

from flexgear.arrays import Array, Complex
from flexgear.model.errors import FlexgearError

FREE = 1e-13  # eigenvalue of K over the largest one below which a motion has no stiffness
ZERO = 1e-6  # |eigenvalue| over the largest one, taken as zero in the general problem


@dataclass(frozen=True)
class WhirlModes:
    """Modes q = Re(x e^{(g + iω) t}) at one speed.

    frequencies (m,): ω/2π, Hz, rising; shapes (d, m): x, complex, xᴴ M x = 1; growth (m,): g, 1/s,
    0 while stable.
    """

    frequencies: Array
    shapes: Complex
    growth: Array


@dataclass(frozen=True)
class Campbell:
    """Frequencies over speed, with one tracked mode per column.

    factors (f,): speeds over rated speed, rising; frequencies (f, m): Hz; sense (f, m): sense of
    whirl in [−1, 1] (``whirl_sense``), NaN without planes.
    """

    factors: Array
    frequencies: Array
    sense: Array


@dataclass(frozen=True)
class Crossing:
    """Intersection of an excitation line and a mode: their indices, speed factor, frequency, Hz."""

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
    """The lowest ``count`` whirl modes (None: all d) at a speed factor; rigid motions come first,
    with 0 Hz.

    mass, stiffness, gyroscopic, centripetal: (d, d), the last two at factor 1. FlexgearError if
    the gyroscopic matrix is not skew-symmetric.
    """
    if not np.allclose(gyroscopic, -gyroscopic.T, atol=1e-9 * np.abs(gyroscopic).max(initial=0.0)):
        raise FlexgearError("the gyroscopic matrix is not skew-symmetric: it would do work")
    lower = linalg.cholesky(mass, lower=True)

    def scaled(a: Array) -> Array:
        half = linalg.solve_triangular(lower, a, lower=True)
        return np.asarray(linalg.solve_triangular(lower, half.T, lower=True).T)

    turning = factor * scaled(gyroscopic)
    k = scaled(stiffness - factor**2 * centripetal)
    values, vectors = linalg.eigh(0.5 * (k + k.T))
    size = len(values) if count is None else min(count, len(values))
    least = FREE * np.abs(values).max(initial=0.0)
    free, growth = values <= least, np.zeros(size)
    if np.any(values < -least):
        omega, x, growth = _general(k, turning, size)
    elif not np.any(turning):
        omega, x = np.sqrt(np.where(free, 0.0, values))[:size], vectors[:, :size].astype(complex)
    else:
        spring = np.sqrt(values[~free])[:, None] * vectors[:, ~free].T
        omega, x = _skew(spring, turning, size)
    shapes = linalg.solve_triangular(lower, x, lower=True, trans="T")
    norm = np.sqrt(np.einsum("dm,de,em->m", shapes.conj(), mass, shapes).real)
    return WhirlModes(omega / (2 * np.pi), shapes / norm, growth)


def _skew(spring: Array, turning: Array, size: int) -> tuple[Array, Complex]:
    """ω (size,) and shapes (d, size) from −iB y = ω y; spring: L, turning: s G."""
    elastic, d = spring.shape
    b = np.zeros((elastic + d, elastic + d))
    b[:elastic, elastic:], b[elastic:, :elastic] = spring, -spring.T
    b[elastic:, elastic:] = -turning
    # eigenvalues are pairs ±ω and a zero for each rigid motion: the upper d are the modes
    omega, y = linalg.eigh(-1j * b, subset_by_index=[elastic, elastic + size - 1])
    omega = np.where(omega <= 1e-12 * np.abs(b).sum(axis=1).max(), 0.0, omega)
    return omega, y[elastic:]  # q̇ is proportional to q


def _general(k: Array, turning: Array, size: int) -> tuple[Array, Complex, Array]:
    """ω, shapes and growth rates of q̈ + s G q̇ + K q = 0, one of each pair; turning: s G."""
    d = len(k)
    state = np.block([[np.zeros((d, d)), np.eye(d)], [-k, -turning]])
    values, vectors = linalg.eig(state)
    least = ZERO * np.abs(values).max()
    values = np.where(np.abs(values.imag) > least, values.imag * 1j, 0) + np.where(
        np.abs(values.real) > least, values.real, 0
    )
    order = np.lexsort((-values.real, np.abs(values.imag), values.imag < 0))
    real = int(np.sum(values.imag == 0))  # in pairs: growth and decay, or twice zero
    keep = np.concatenate([order[: real // 2], order[real : d + real // 2]])[:size]
    return values[keep].imag, vectors[:d, keep], values[keep].real


def whirl_sense(shapes: Complex, planes: Array, weights: ArrayLike | None = None) -> Array:
    """Sense of whirl (m,) in [−1, 1]: −2 Σ w Im(X* Y) / Σ w (|X|² + |Y|²).

    planes (n, 2, d): rows of the motions x, y of n points; weights (n,): e.g. masses. +1 is
    counter-clockwise motion on a circle, −1 clockwise, 0 motion on a line; NaN where no point moves
    in the plane.
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

    Modes are paired for the largest sum of MAC = |xᴴ M x'|²; where shapes do not decide (modes of
    equal frequency) the nearer frequency does. count: see ``whirl_modes``; planes, weights: see
    ``whirl_sense``.
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
            mac = np.abs(before.conj().T @ mass @ run.shapes) ** 2
            distances = np.abs(last[:, None] - run.frequencies[None]) / max(last.max(), 1e-300)
            order = linear_sum_assignment(mac - 1e-3 * distances, maximize=True)[1]
        before, last = run.shapes[:, order], run.frequencies[order]
        frequencies[i] = last
        if planes is not None:
            sense[i] = whirl_sense(before, planes, weights)
    return Campbell(s, frequencies, sense)


def crossings(campbell: Campbell, slopes: Sequence[float]) -> tuple[Crossing, ...]:
    """All crossings of lines with modes within the factors, sorted by factor (to nine digits), then
    by mode. slopes: of the lines, Hz per unit of the speed factor.

    Frequencies are interpolated linearly between factors, with an error proportional to the square
    of the spacing. Crossings with rigid motions at zero speed are not counted.
    """
    s, found_crossings = campbell.factors, []
    for line, slope in enumerate(slopes):
        gap = campbell.frequencies - slope * s[:, None]
        for mode in range(gap.shape[1]):
            g, f = gap[:, mode], campbell.frequencies[:, mode]
            for i in np.flatnonzero(g[:-1] * g[1:] < 0):
                share = g[i] / (g[i] - g[i + 1])
                factor = s[i] + share * (s[i + 1] - s[i])
                found_crossings.append(Crossing(line, mode, float(factor), float(slope * factor)))
            for i in np.flatnonzero((g == 0) & (f > 0)):
                found_crossings.append(Crossing(line, mode, float(s[i]), float(f[i])))
    return tuple(sorted(found_crossings, key=lambda c: (float(f"{c.factor:.9g}"), c.mode)))
