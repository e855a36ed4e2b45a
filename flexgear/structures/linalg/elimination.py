r"""Elimination of the first rows of a sparse matrix, for many columns at a time.

With inner rows i, outer rows b and constraint rows c,

    [K_ii K_ib C_i^T]   [L   0]   [I 0]   [L^T W]
    [K_bi K_bb C_b^T] = [W^T I] x [0 S] x [0   I],   W = L^{-1} [K_ib C_i^T],
    [C_i  C_b  0    ]

S the Schur complement of the inner rows. CHOLMOD factors [K_ii K_ib; K_bi K_bb + D] in the order
given, D large enough that it is definite; its factor holds L, W^T of the outer rows, and S + D.
CHOLMOD solves one column at a time, so solutions are sweeps of our own through its columns: they
take all columns of a right side together, and up to four columns of the factor that have the same
rows. Source of the order: Amestoy, Davis, Duff 1996, SIAM J. Matrix Anal. Appl. 17:886.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from cvxopt import amd
from numpy.typing import NDArray

from flexgear.compiled import njit
from flexgear.structures.linalg.cholesky import factor_in_order, to_cvxopt

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_TOGETHER = 4  # columns of the factor, known to the compiler


def minimum_degree_order(graph: sp.csr_matrix) -> Ints:
    """Order (n,) of a symmetric graph's nodes in which elimination fills little."""
    return np.array(amd.order(to_cvxopt(sp.tril(graph)))).ravel()


class Elimination:
    """Factor of the inner rows of a symmetric matrix [K C^T; C 0].

    size: number of inner rows i; rest: S (b + c, b + c).
    """

    def __init__(
        self, stiffness: sp.csr_matrix, constraints: sp.csr_matrix, size: int, shift: Array
    ) -> None:
        """stiffness: K (i + b, i + b); constraints: C (c, i + b); shift: D (b, b), see above.

        Raises numpy.linalg.LinAlgError where [K_ii K_ib; K_bi K_bb + D] is not definite.
        """
        self.size = size
        outer = stiffness.shape[0] - size
        lifted = stiffness + sp.block_diag([sp.csr_matrix((size, size)), sp.csr_matrix(shift)])
        factor = factor_in_order(lifted)
        remainder = factor[size:, size:].toarray()
        self._set_sweeps(factor[:, :size])
        transposed = constraints.T.toarray()
        forward(*self._sweeps, transposed)
        self._constraints = transposed[:size]  # L^{-1} C_i^T (i, c)
        self.rest = np.zeros((outer + transposed.shape[1],) * 2)
        self.rest[:outer, :outer] = remainder @ remainder.T - shift
        self.rest[:outer, outer:] = transposed[size:]
        self.rest[outer:, :outer] = transposed[size:].T
        self.rest[outer:, outer:] = -self._constraints.T @ self._constraints

    @property
    def entries(self) -> int:
        """Numbers stored in the factor."""
        return len(self._sweeps[3]) + self._constraints.size

    def forward(self, x: Array) -> None:
        """x = [g_i; g_bc] (i + b + c, k) becomes [L^{-1} g_i; g_bc - W^T L^{-1} g_i]."""
        forward(*self._sweeps, x)
        x[self._reach :] -= self._constraints.T @ x[: self.size]

    def backward(self, x: Array) -> None:
        """x = [f; x_bc] (i + b + c, k) becomes [L^{-T} (f - W x_bc); x_bc]."""
        x[: self.size] -= self._constraints @ x[self._reach :]
        backward(*self._sweeps, x)

    def _set_sweeps(self, columns: sp.csc_matrix) -> None:
        self._reach = columns.shape[0]
        pointers, rows = columns.indptr.astype(np.int64), columns.indices.astype(np.int64)
        self._sweeps = _alike(pointers, rows), pointers, rows, columns.data


def _alike(pointers: Ints, rows: Ints) -> Ints:
    """Where groups of columns begin that have the same rows below them, and where the last ends."""
    count = np.diff(pointers)
    follows = np.zeros(len(count), dtype=bool)  # the rows of the column before but its diagonal
    follows[1:] = (count[:-1] == count[1:] + 1) & (
        rows[np.minimum(pointers[:-2] + 1, len(rows) - 1)] == np.arange(1, len(count))
    )
    begins, length = [], 0
    for column, same in enumerate(follows):
        length = length + 1 if same and length < _TOGETHER else 1
        if length == 1:
            begins.append(column)
    return np.array([*begins, len(count)], dtype=np.int64)


@njit(nogil=True, fastmath={"contract"})
def forward(
    groups: Ints, pointers: Ints, rows: Ints, data: Array, x: Array
) -> None:  # pragma: no cover - compiled
    """x (n, k) <- [L 0; W^T I]^{-1} x; columns of the factor by their diagonal, then the rest."""
    k = x.shape[1]
    for g in range(len(groups) - 1):
        j, end = groups[g], groups[g + 1]
        for a in range(j, end):
            first = pointers[a]
            inverse = 1 / data[first]
            for c in range(k):
                x[a, c] *= inverse
            for b in range(a + 1, end):
                entry = data[first + b - a]
                for c in range(k):
                    x[b, c] -= entry * x[a, c]
        if end - j == _TOGETHER:
            p0, p1, p2, p3 = (
                pointers[j] + 4,
                pointers[j + 1] + 3,
                pointers[j + 2] + 2,
                pointers[end - 1] + 1,
            )
            for e in range(pointers[end] - p3):
                row = rows[p3 + e]
                d0, d1, d2, d3 = data[p0 + e], data[p1 + e], data[p2 + e], data[p3 + e]
                for c in range(k):
                    x[row, c] -= (d0 * x[j, c] + d1 * x[j + 1, c]) + (
                        d2 * x[j + 2, c] + d3 * x[j + 3, c]
                    )
        else:
            for a in range(j, end):
                for e in range(pointers[a] + end - a, pointers[a + 1]):
                    row, entry = rows[e], data[e]
                    for c in range(k):
                        x[row, c] -= entry * x[a, c]


@njit(nogil=True, fastmath={"contract"})
def backward(
    groups: Ints, pointers: Ints, rows: Ints, data: Array, x: Array
) -> None:  # pragma: no cover - compiled
    """x (n, k) <- [L 0; W^T I]^{-T} x."""
    k = x.shape[1]
    for g in range(len(groups) - 2, -1, -1):
        j, end = groups[g], groups[g + 1]
        if end - j == _TOGETHER:
            p0, p1, p2, p3 = (
                pointers[j] + 4,
                pointers[j + 1] + 3,
                pointers[j + 2] + 2,
                pointers[end - 1] + 1,
            )
            for e in range(pointers[end] - p3):
                row = rows[p3 + e]
                d0, d1, d2, d3 = data[p0 + e], data[p1 + e], data[p2 + e], data[p3 + e]
                for c in range(k):
                    y = x[row, c]
                    x[j, c] -= d0 * y
                    x[j + 1, c] -= d1 * y
                    x[j + 2, c] -= d2 * y
                    x[j + 3, c] -= d3 * y
        else:
            for a in range(j, end):
                for e in range(pointers[a] + end - a, pointers[a + 1]):
                    row, entry = rows[e], data[e]
                    for c in range(k):
                        x[a, c] -= entry * x[row, c]
        for a in range(end - 1, j - 1, -1):
            first = pointers[a]
            for b in range(a + 1, end):
                entry = data[first + b - a]
                for c in range(k):
                    x[a, c] -= entry * x[b, c]
            inverse = 1 / data[first]
            for c in range(k):
                x[a, c] *= inverse
