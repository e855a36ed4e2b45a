r"""Lowest modes by block Lanczos with few passes over a long basis.

    T M v = theta v,   theta = 1/(omega^2 - sigma),   V^T M V = I,

T a solution operator (symmetric), M the mass. P = M Q is carried along, so that a step costs one T
and one M,

    W = T P_j - Q_j A_j - Q_{j-1} B_j^T,   A_j = P_j^T T P_j,   W = Q_{j+1} B_{j+1},

and older vectors, which rounding lets in again little by little, are taken off Q_j and W together
every few steps, in one sweep through the basis: as often as what is found there asks for. When
the basis is full it is cut to the best Ritz vectors. Vectors are rows of the basis, so that only
what is filled takes memory. What T gives beside its image (reactions) is linear in P and follows
the vectors.
Source: Grimes, Lewis, Simon 1994, SIAM J. Matrix Anal. Appl. 15:228; partial
reorthogonalisation: Simon 1984, Math. Comput. 42:115; thick restart: Wu, Simon 2000, SIAM J.
Matrix Anal. Appl. 22:602.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as sla

from flexgear.arrays import Array
from flexgear.structures.linalg.dense import dot, subtract, times_in_place
from flexgear.structures.linalg.threads import shared

Operator = Callable[[Array], Array]
Solve = Callable[[Array], tuple[Array, Array]]

_CHECKED = 8  # new vectors between looks at convergence
_LEVEL = 1e-9  # share of older vectors in a new one that calls for passes more often
_SELDOM = 8  # steps between passes at most
_DEPENDENT = 1e-8  # condition of a block's Gram matrix below which it is made anew
_CHUNK = 16384  # entries of a vector a thread takes at a time
_STEPS = 5000
_BASIS_BYTES = 2.0e9  # of the basis, where that is enough for the modes


@dataclass(frozen=True, eq=False)
class Eigenpairs:
    """nu = 1/omega^2 (k,) falling, vectors (n, k) with V^T M V = I, residual estimates (k,).

    residuals: |A v - nu v|_M of A = K^{-1} M; beside (r, k): what the solver gave beside its image
    of M V, where it gives something.
    """

    values: Array
    vectors: Array
    residuals: Array
    beside: Array | None = None

    @property
    def omega(self) -> Array:
        """(k,) rad/s rising."""
        return np.asarray(1 / np.sqrt(self.values))

    def lowest(self, count: int) -> Eigenpairs:
        """The first of them."""
        beside = None if self.beside is None else self.beside[:, :count]
        vectors = self.vectors[:, :count]
        return replace(
            self,
            values=self.values[:count],
            vectors=vectors,
            residuals=self.residuals[:count],
            beside=beside,
        )


class NotConverged(RuntimeError):
    """The iteration found fewer modes than it was asked for."""


def most_rows(count: int, block: int, n: int = 1) -> int:
    """Rows of the basis for the `count` lowest modes of n dofs: room for few restarts, where that
    takes no more than ``_BASIS_BYTES``."""
    least, roomy = 3 * count // 2 + 4 * block, 4 * count + 8 * block
    return min(roomy, max(least, int(_BASIS_BYTES / (8 * n))))


def all_modes(solve: Operator, mass: Operator, n: int, count: int) -> Eigenpairs:
    """The `count` lowest modes from all n, for problems hardly larger than that."""
    identity = np.eye(n)
    m = mass(identity)
    image = mass(solve(m))
    values, vectors = sla.eigh(0.5 * (image + image.T), 0.5 * (m + m.T))
    return Eigenpairs(values[::-1][:count], vectors[:, ::-1][:, :count], np.zeros(count))


def lowest_modes(
    solve: Solve,
    mass: Operator,
    start: Array,
    count: int,
    most: int,
    tolerance: float = 1e-8,
    progress: Callable[[float], None] | None = None,
    shift: float = 0.0,
    unshifted: Operator | None = None,
) -> Eigenpairs:
    """The `count` lowest omega; start (n, p) gives block size and seed, most: rows of the basis.

    solve: T x (n, p) and something beside it (r, p), both linear in x (n, p); values and what is
    beside them are returned as without the shift sigma, for which unshifted gives what is beside.
    tolerance: residual over 1/omega^2; the error of omega^2 is of the order of its square.
    """
    n, block = start.shape
    if not count + 3 * block <= most <= n - block:
        raise NotConverged("the eigenvalue iteration wants a larger basis: ask for fewer modes")
    basis = _Basis(most + block, n, mass)
    q, p, _ = basis.normalised(solve(mass(start))[0])
    square = np.zeros((most + block, most + block))
    before: tuple[Array, Array] | None = None  # Q_{j-1}, B_j
    passes = _Passes(1)
    unchecked = applied = 0
    while applied < _STEPS:
        at = slice(basis.filled, basis.filled + block)
        basis.append(q)
        w, beside = solve(p)
        basis.note(beside)
        applied += block
        projection = dot(p, w)
        subtract(w, q, projection)
        if before is not None:
            subtract(w, before[0], before[1].T)
            square[at.start - block : at.start, at] = before[1].T
        square[at, at] = projection
        if before is None and at.start:  # just cut: all Ritz vectors that were kept are neighbours
            overlap, p = basis.freed(w)
            square[: at.start, at] = overlap[: at.start]
            _, p = basis.freed(w)
        elif passes.due():
            p = basis.freed_two(q, p, w, passes)
        else:
            p = mass(w)
        q_next, p, coupling = basis.normalised(w, p)
        square[at, : at.start] = square[: at.start, at].T
        before = (q, coupling)
        q = q_next
        unchecked += block
        full = basis.filled + block > most
        if not full and (basis.filled < count + block or unchecked < _CHECKED):
            continue
        unchecked = 0
        ritz = _Ritz(square[: at.stop, : at.stop], coupling, shift)
        good = ritz.residuals[:count] <= tolerance
        if progress is not None:
            progress(float(good.sum()) / count)
        if good.all():
            shapes = ritz.vectors[:, :count]
            basis.recombine(shapes)
            vectors, beside = basis.taken()
            if unshifted is not None:
                ahead = unshifted(p) @ (coupling @ shapes[at])
                beside = (beside - shift * ahead) / (1 + shift * ritz.values[:count])
            nu = ritz.unshifted[:count]
            return Eigenpairs(nu, vectors.T, nu * ritz.residuals[:count], beside)
        if full:
            keep = (count + most) // 2
            basis.recombine(ritz.vectors[:, :keep])
            square[:] = 0.0
            square[range(keep), range(keep)] = ritz.values[:keep]
            before = None
            passes = _Passes(0)  # converged vectors come back faster
    raise NotConverged("the eigenvalue iteration did not converge: ask for fewer modes")


class _Ritz:
    """Ritz pairs of T, those of the lowest omega^2 > 0 first.

    unshifted: nu = 1/omega^2 = theta/(1 + sigma theta); residuals: bounds of those without a shift
    over nu. A part of the residual along a mode of omega_j^2 is 1 - sigma/omega_j^2 times what it
    is with the shift.
    """

    def __init__(self, square: Array, coupling: Array, shift: float) -> None:
        values, vectors = np.linalg.eigh(square)
        unshifted = values / (1 + shift * values)
        order = np.argsort(-unshifted, kind="stable")
        self.values, self.vectors = values[order], vectors[:, order]
        self.unshifted = unshifted[order]
        last = self.vectors[len(square) - len(coupling) :]
        growth = max(1.0, shift * self.unshifted[0] - 1.0)
        self.residuals = growth * np.linalg.norm(coupling @ last, axis=0) / np.abs(self.values)


class _Passes:
    """When to take older vectors off: at one step, then at none for a few."""

    def __init__(self, free: int) -> None:
        """free: steps without at first."""
        self._free = free
        self._left = free

    def due(self) -> bool:
        """Whether this step takes a pass."""
        self._left -= 1
        return self._left < 0

    def record(self, level: float) -> None:
        """Largest share of an older vector in a new one of unit length."""
        if level > _LEVEL:
            self._free = self._free // 2
        elif level < 1e-2 * _LEVEL:
            self._free = min(_SELDOM, self._free + 1)
        self._left = self._free


class _Basis:
    """Vectors (filled, n) with V M V^T = I."""

    def __init__(self, rows: int, n: int, mass: Operator) -> None:
        self._vectors = np.empty((rows, n))
        self._mass = mass
        self._beside = np.empty((0, rows))
        self.filled = 0

    def append(self, q: Array) -> None:
        """Columns of q (n, p) as the next vectors."""
        end = self.filled + q.shape[1]
        self._put(q, slice(self.filled, end))
        self.filled = end

    def note(self, beside: Array) -> None:
        """What came beside the images of the vectors last appended (r, p)."""
        if not len(self._beside):
            self._beside = np.empty((len(beside), self._beside.shape[1]))
        self._beside[:, self.filled - beside.shape[1] : self.filled] = beside

    def freed(self, w: Array) -> tuple[Array, Array]:
        """C (filled, p) and M w of w <- w - V^T C with V M w = 0."""
        column = self._dot(self._mass(w))
        self._take(column, w)
        return column, self._mass(w)

    def freed_two(self, q: Array, p: Array, w: Array, passes: _Passes) -> Array:
        """M w of w <- w - V^T C with V M w = 0, where the last vectors q are freed likewise first.

        p: M q. Both blocks go through the basis together.
        """
        block, p_w = q.shape[1], self._mass(w)
        length = np.sqrt(max(float(np.diag(dot(w, p_w)).min()), 1e-300))
        last = slice(self.filled - block, self.filled)
        column = self._dot(p, p_w)
        column[last, :block] = 0.0  # q itself
        self._take(column, q, w)
        self._put(q, last)
        self._beside[:, last] -= self._beside[:, : self.filled] @ column[:, :block]
        passes.record(float(np.abs(column[:, block:]).max()) / length)
        return self._mass(w)

    def normalised(self, w: Array, p: Array | None = None) -> tuple[Array, Array, Array]:
        """Q, P = M Q, R with w = Q R, Q^T M Q = I, orthogonal to the basis as w is.

        w and p are overwritten. Directions of rounding size become arbitrary ones, freed of the
        basis again.
        """
        p = self._mass(w) if p is None else p
        r = np.eye(w.shape[1])
        for _ in range(4):
            gram = dot(w, p)
            values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
            root = np.sqrt(np.maximum(values, 1e-14 * values[-1]))
            times_in_place(w, vectors / root)
            times_in_place(p, vectors / root)
            r = (vectors * root).T @ r
            if values[0] > _DEPENDENT * values[-1]:
                break
            p = self.freed(w)[1] if self.filled else self._mass(w)
        return w, p, r

    def recombine(self, vectors: Array) -> None:
        """Keep only the combinations (filled, k) of the vectors."""
        count = vectors.shape[1]
        transposed = np.ascontiguousarray(vectors.T)

        def part(at: slice) -> None:
            self._vectors[:count, at] = transposed @ self._vectors[: self.filled, at]

        shared(self._vectors.shape[1], part, _CHUNK)
        self._beside[:, :count] = self._beside[:, : self.filled] @ vectors
        self.filled = count

    def taken(self) -> tuple[Array, Array]:
        """The vectors (filled, n) and what came beside; the rest of the memory is given back."""
        vectors = self._vectors
        del self._vectors
        vectors.resize((self.filled, vectors.shape[1]), refcheck=False)
        return vectors, self._beside[:, : self.filled]

    def _put(self, q: Array, rows: slice) -> None:
        def part(at: slice) -> None:
            self._vectors[rows, at] = q[at].T

        shared(len(q), part, _CHUNK)

    def _dot(self, *p: Array) -> Array:
        """V [p_1 p_2 ...] (filled, k), summed in a fixed order."""
        parts: dict[int, Array] = {}

        def part(at: slice) -> None:
            side_by_side = np.hstack([block[at] for block in p])
            parts[at.start] = self._vectors[: self.filled, at] @ side_by_side

        shared(len(p[0]), part, _CHUNK)
        total = np.zeros((self.filled, sum(block.shape[1] for block in p)))
        for start in sorted(parts):
            total += parts[start]
        return total

    def _take(self, column: Array, *w: Array) -> None:
        """[w_1 w_2 ...] <- [w_1 w_2 ...] - V^T C."""

        rows = np.ascontiguousarray(column.T)

        def part(at: slice) -> None:
            share = (rows @ self._vectors[: self.filled, at]).T
            begin = 0
            for block in w:
                block[at] -= share[:, begin : begin + block.shape[1]]
                begin += block.shape[1]

        shared(len(w[0]), part, _CHUNK)
