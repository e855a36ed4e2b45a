r"""One front of a multifrontal Cholesky factorisation, in panels of columns.

    F = [F_pp . ; F_qp F_qq] <- what the columns before took off,
    F_pp = L_pp L_pp^T,   L_qp = F_qp L_pp^{-T},

column by column block (left-looking), so that all large work is a product of matrices: LAPACK's
own factorisation is several times slower on one thread. Diagonal blocks are small and kept
inverted. Products and what is compiled here let other threads run. Matrices are lower triangles,
rows contiguous.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numba
import numpy as np
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError
from flexgear.structures.blas import add_product, subtract_square

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

PANEL = 128  # columns at most


@dataclass(frozen=True, eq=False)
class Panel:
    """Columns begin:end of a front: L_pp^{-1} (w, w) and L_qp (m, w) of all rows after them."""

    begin: int
    end: int
    inverse: Array
    below: Array

    @property
    def entries(self) -> int:
        """Numbers stored."""
        return self.inverse.size + self.below.size

    def forward(self, x: Array) -> None:
        """x (n, k) <- what L_pp^{-1} and L_qp make of it, in place."""
        mine = self.inverse @ x[self.begin : self.end]
        x[self.begin : self.end] = mine
        add_product(-1.0, self.below, mine, 1.0, x[self.end :])

    def backward(self, x: Array) -> None:
        """The transposed step."""
        mine = x[self.begin : self.end]
        add_product(-1.0, self.below.T, x[self.end :], 1.0, mine)
        mine[:] = self.inverse.T @ mine


def eliminated(front: Array, own: int) -> tuple[tuple[Panel, ...], Array | None]:
    """Panels of the first `own` columns of a front (n, n), and what is left for its border.

    The front is overwritten.
    """
    pieces = -(-own // PANEL)
    edges = [own * p // pieces for p in range(pieces + 1)]
    panels = []
    for a, b in pairwise(edges):
        if a:
            add_product(-1.0, front[a:, :a], front[a:b, :a].T, 1.0, front[a:, a:b])
        inverse = np.empty((b - a, b - a))
        if not _inverse_cholesky(front[a:b, a:b], inverse):
            raise FlexgearError(
                "the stiffness matrix is singular: the mesh falls into pieces or has cells "
                "that hang on an edge"
            )
        below = np.empty((len(front) - b, b - a))
        add_product(1.0, front[b:, a:b], inverse.T, 0.0, below)
        front[b:, a:b] = below
        panels.append(Panel(a, b, inverse, below))
    if own == len(front):
        return tuple(panels), None
    rest = front[own:, own:]
    subtract_square(front[own:, :own], rest)
    return tuple(panels), rest.copy()


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def gather(
    front: Array,
    indptr: NDArray[np.int32],
    indices: NDArray[np.int32],
    data: Array,
    rows: Ints,
    local: Ints,
) -> None:  # pragma: no cover - compiled
    """Columns of a front from the rows of a symmetric CSR matrix that it eliminates.

    local: place of every row in the front, at least what the front eliminates after those before.
    """
    for j in range(len(rows)):
        for e in range(indptr[rows[j]], indptr[rows[j] + 1]):
            i = local[indices[e]]
            if i >= j:
                front[i, j] = data[e]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def extend(front: Array, at: Ints, update: Array) -> None:  # pragma: no cover - compiled
    """front[at, at] += update, lower triangles; at rises."""
    for i in range(len(at)):
        row = at[i]
        for j in range(i + 1):
            front[row, at[j]] += update[i, j]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def add_rows(x: Array, at: Ints, more: Array) -> None:  # pragma: no cover - compiled
    """x[at] += more, without a copy of x[at]."""
    for i in range(len(at)):
        row = at[i]
        for c in range(x.shape[1]):
            x[row, c] += more[i, c]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def subtract_rows(x: Array, at: Ints, lost: Array) -> None:  # pragma: no cover - compiled
    """x[at] -= lost, likewise."""
    for i in range(len(at)):
        row = at[i]
        for c in range(x.shape[1]):
            x[row, c] -= lost[i, c]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def take_rows(x: Array, at: Ints, out: Array) -> None:  # pragma: no cover - compiled
    """out <- x[at]; numpy.take made solves an eighth to three quarters longer."""
    for i in range(len(at)):
        row = at[i]
        for c in range(x.shape[1]):
            out[i, c] = x[row, c]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def put_rows(x: Array, at: Ints, rows: Array) -> None:  # pragma: no cover - compiled
    """x[at] <- rows."""
    for i in range(len(at)):
        row = at[i]
        for c in range(x.shape[1]):
            x[row, c] = rows[i, c]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _inverse_cholesky(a: Array, inverse: Array) -> bool:  # pragma: no cover - compiled
    """L^{-1} of a = L L^T, whose lower triangle is overwritten; False where a is not definite."""
    n = len(a)
    row = np.empty(n)
    for j in range(n):  # rows of the transposed factor stand in the upper triangle of `inverse`
        pivot = a[j, j]
        if not pivot > 0.0:
            return False
        root = np.sqrt(pivot)
        for i in range(j, n):
            row[i] = a[i, j] / root
            a[i, j] = row[i]
        for i in range(j + 1, n):
            factor = row[i]
            for c in range(j + 1, i + 1):
                a[i, c] -= factor * row[c]
    for i in range(n):  # row i of the inverse from the rows above it
        for c in range(n):
            row[c] = 0.0
        for k in range(i):
            factor = a[i, k]
            for c in range(k + 1):
                row[c] -= factor * inverse[k, c]
        for c in range(i):
            inverse[i, c] = row[c] / a[i, i]
        inverse[i, i] = 1.0 / a[i, i]
        for c in range(i + 1, n):
            inverse[i, c] = 0.0
    return True
