r"""Lowest modes by block Lanczos with full orthogonalisation and thick restart.

    T M v = theta v,   theta = 1/(omega^2 - sigma),   V^T M V = I,

T a solution operator (symmetric), M the mass. A step computes W = T M Q of the last block Q and
makes it orthogonal to the last two blocks, then to the whole basis,

    W <- W - V C,   C = V^T M W,   W = Q_next R;

C are the columns of V^T M T M V that Q adds; R, the coupling of the basis to the next block, bounds
the residuals. A full basis is reduced to its best Ritz vectors.
Source: Grimes, Lewis, Simon 1994, SIAM J. Matrix Anal. Appl. 15:228; thick restart: Wu, Simon 2000,
SIAM J. Matrix Anal. Appl. 22:602. ARPACK (scipy.sparse.linalg.eigsh), one vector a step, takes
three to five times as long for the modes of a ring or a carrier.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sla

from flexgear.arrays import Array
from flexgear.structures.linalg.dense import dot, subtract, times_in_place

Operator = Callable[[Array], Array]

RESIDUAL = 1e-8  # largest residual over 1/omega^2, whose square is the order of omega^2's error
_CHECK_INTERVAL = 8  # least number of new vectors between two checks of convergence
_CHECKS = 25  # vectors of the basis over those between checks, which solve a dense problem
_MANY = 200  # modes
DEPENDENT = 1e-8  # eigenvalue ratio of a block's Gram matrix below which it is normalised again
_MAX_VECTORS = 5000
_BASIS_BYTES = 2.0e9  # size of the basis, larger only where the modes need it


@dataclass(frozen=True, eq=False)
class Eigenpairs:
    """Modes of a body: values nu = 1/omega^2 (k,) falling, s²/rad²; vectors (n, k) with
    V^T M V = I; residuals: estimates (k,) of |A v - nu v|_M, A = K^{-1} M."""

    values: Array
    vectors: Array
    residuals: Array

    @property
    def omega(self) -> Array:
        """Angular frequencies (k,) rad/s, rising."""
        return np.asarray(1 / np.sqrt(self.values))

    def lowest(self, count: int) -> Eigenpairs:
        """The first ``count`` of the modes."""
        return Eigenpairs(self.values[:count], self.vectors[:, :count], self.residuals[:count])


class NotConverged(RuntimeError):
    """The iteration did not find all modes that were requested."""


def vectors_a_step(count: int) -> int:
    """Vectors that a step adds to the basis when ``count`` modes are sought. Few at a time need
    the smallest basis; for many modes time goes into reading the basis in every step, and steps
    with more vectors are fewer. Calibrated: 300 modes of 60 000 dofs take 37 s with 4, 24 with 12,
    26 with 24; 120 modes of 133 000 dofs 16, 18 and more."""
    return 4 if count <= _MANY else 12


def most_vectors(count: int, block: int, n: int = 1) -> int:
    """Size of the basis for the `count` lowest modes of n dofs: enough for few restarts, where that
    takes no more than ``_BASIS_BYTES``."""
    least, roomy = 3 * count // 2 + 4 * block, 4 * count + 8 * block
    return min(roomy, max(least, int(_BASIS_BYTES / (8 * n))))


def all_modes(solve: Operator, mass: Operator, n: int, count: int) -> Eigenpairs:
    """The `count` lowest modes from dense matrices, for n hardly larger than `count`."""
    identity = np.eye(n)
    m = mass(identity)
    image = mass(solve(m))
    values, vectors = sla.eigh(0.5 * (image + image.T), 0.5 * (m + m.T))
    return Eigenpairs(values[::-1][:count], vectors[:, ::-1][:, :count], np.zeros(count))


def lowest_modes(
    solve: Operator,
    mass: Operator,
    start: Array,
    count: int,
    most: int,
    progress: Callable[[float], None] | None = None,
    shift: float = 0.0,
) -> Eigenpairs:
    """The `count` modes of lowest omega.

    solve: function x -> T x, (n, p); mass: x -> M x; start: first block (n, p); most: vectors of
    the basis; progress: takes the fraction of converged modes; shift: sigma, rad²/s²; the values
    returned are those without it. NotConverged where the basis or the steps do not suffice.
    """
    n, block = start.shape
    if not count + 3 * block <= most <= n - block:
        raise NotConverged("the eigenvalue iteration wants a larger basis: ask for fewer modes")
    rows = np.empty((most + block, n))  # vectors as rows: only filled ones take memory
    projected = np.zeros((most + block, most + block))  # V^T M T M V
    filled = unchecked = 0
    q, p, _ = _normalised(solve(mass(start)), mass, rows[:0].T)
    for _ in range(_MAX_VECTORS // block):
        new = slice(filled, filled + block)
        rows[new] = q.T
        filled, unchecked, basis = new.stop, unchecked + block, rows[: new.stop].T
        w, last = solve(p), slice(max(filled - 2 * block, 0), filled)
        near, p = _without(basis[:, last], w, mass(w), mass)
        column, p = _without(basis, w, p, mass)
        column[last] += near
        projected[:filled, new] = column
        projected[new, :filled] = column.T
        q, p, coupling = _normalised(w, mass, basis, p)
        full = filled + block > most
        few = unchecked < max(_CHECK_INTERVAL, filled // _CHECKS)
        if not full and (few or filled < count + block):
            continue
        unchecked = 0
        ritz = _Ritz(projected[:filled, :filled], coupling, shift)
        good = ritz.residuals[:count] <= RESIDUAL
        if progress is not None:
            progress(float(good.sum()) / count)
        if good.all():
            times_in_place(basis, ritz.vectors[:, :count])
            del basis
            rows.resize((count, n), refcheck=False)  # frees the rest of the memory
            nu = ritz.unshifted[:count]
            return Eigenpairs(nu, rows.T, nu * ritz.residuals[:count])
        if full:
            filled = (count + most) // 2
            times_in_place(basis, ritz.vectors[:, :filled])
            projected[:] = np.diag(np.pad(ritz.values[:filled], (0, most + block - filled)))
    raise NotConverged("the eigenvalue iteration did not converge: ask for fewer modes")


class _Ritz:
    """Ritz pairs of T, those of the lowest omega^2 > 0 first.

    unshifted: nu = 1/omega^2 = theta/(1 + sigma theta); residuals: bounds, over nu, of those
    without a shift, whose part along a mode of omega_j^2 is that with the shift times 1 -
    sigma/omega_j^2.
    """

    def __init__(self, projected: Array, coupling: Array, shift: float) -> None:
        values, vectors = np.linalg.eigh(projected)
        unshifted = values / (1 + shift * values)
        order = np.argsort(-unshifted, kind="stable")
        self.values, self.vectors = values[order], vectors[:, order]
        self.unshifted = unshifted[order]
        last = self.vectors[len(projected) - len(coupling) :]
        growth = max(1.0, shift * self.unshifted[0] - 1.0)
        self.residuals = growth * np.linalg.norm(coupling @ last, axis=0) / np.abs(self.values)


def _without(basis: Array, w: Array, p: Array, mass: Operator) -> tuple[Array, Array]:
    """Make w (n, p) M-orthogonal to a basis V in place; p: M w before. Returns C = V^T p and the
    new M w."""
    column = dot(basis, p)
    subtract(w, basis, column)
    return column, mass(w)


def _normalised(
    w: Array, mass: Operator, basis: Array, p: Array | None = None
) -> tuple[Array, Array, Array]:
    """Q, P = M Q and R with w = Q R, Q^T M Q = I, for w that is orthogonal to the basis.

    w and p = M w are overwritten. Where directions of w are rounding errors, Q gets arbitrary ones
    in their place, which are made orthogonal to the basis again.
    """
    p = mass(w) if p is None else p
    r = np.eye(w.shape[1])
    for _ in range(4):
        gram = dot(w, p)
        values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
        root = np.sqrt(np.maximum(values, 1e-14 * values[-1]))
        times_in_place(w, vectors / root)
        times_in_place(p, vectors / root)
        r = (vectors * root).T @ r
        if values[0] > DEPENDENT * values[-1]:
            break
        p = _without(basis, w, mass(w), mass)[1]
    return w, p, r
