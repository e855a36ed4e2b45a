r"""Sparse Cholesky factorisation, used many times, by CHOLMOD.

    P A P^T = L L^T

with P the fill-reducing order that CHOLMOD finds (approximate minimum degree). Both halves of a
solve are open: W = L^{-1} P B^T has few entries where B^T has few.
Source: Chen, Davis, Hager, Rajamanickam 2008, ACM TOMS 35:22; Python interface: CVXOPT.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import scipy.sparse as sp
from cvxopt import cholmod, spmatrix
from cvxopt import matrix as dense_of
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SOLVE, _FORWARD, _BACKWARD, _PERMUTE, _PERMUTE_BACK = 0, 4, 5, 7, 8  # CHOLMOD's `sys`


class Factor:
    """L of a symmetric positive definite matrix (n, n), CSR.

    Raises numpy.linalg.LinAlgError where the matrix is not positive definite.
    """

    name = "cholmod"

    def __init__(self, matrix: sp.csr_matrix, order: NDArray[np.int64] | None = None) -> None:
        """order: of elimination (n,), rows of the matrix; found by CHOLMOD if left out."""
        lower = to_cvxopt(sp.tril(matrix))
        if order is None:
            self._factor = _factored(lower)
        else:
            with _options(nmethods=1):  # no other order is tried
                self._factor = _factored(lower, dense_of(np.asarray(order, dtype=np.int64)))

    def solve(self, right: Array) -> Array:
        """x (n, k) with A x = right (n, k)."""
        return self._each(right, _SOLVE)

    def forward(self, right: Array) -> Array:
        """f = L^{-1} P right (n, k)."""
        return self._each(right, _PERMUTE, _FORWARD)

    def forward_sparse(self, right: sp.csr_matrix) -> sp.csr_matrix:
        """The same of a sparse right (n, k): only what its entries reach is computed."""
        solution = to_cvxopt(right)
        for step in (_PERMUTE, _FORWARD):
            solution = cholmod.spsolve(self._factor, solution, sys=step)
        return _to_scipy(solution).tocsr()

    def backward(self, f: Array) -> Array:
        """x = P^T L^{-T} f (n, k)."""
        return self._each(f, _BACKWARD, _PERMUTE_BACK)

    def _each(self, right: Array, *steps: int) -> Array:
        """right (n, k) or (n,) after some of CHOLMOD's steps."""
        room = dense_of(0.0, (len(right), right.size // len(right)))
        view = np.asarray(room)  # the same memory, columns contiguous
        view[:] = right.reshape(view.shape)
        for step in steps:
            cholmod.solve(self._factor, room, sys=step)
        return np.ascontiguousarray(view).reshape(right.shape)


def factor_in_order(matrix: sp.csr_matrix) -> sp.csc_matrix:
    """L (n, n) with matrix = L L^T, rows of a column rising, without another order of the rows.

    Raises numpy.linalg.LinAlgError where the matrix is not positive definite.
    """
    with _options(nmethods=1, postorder=False):  # the order given, and no other
        order = dense_of(np.arange(matrix.shape[0]))
        factor = _factored(to_cvxopt(sp.tril(matrix)), order)
        return _to_scipy(cholmod.getfactor(factor))


@contextmanager
def _options(**chosen: Any) -> Iterator[None]:
    """CHOLMOD's options inside the block."""
    before = dict(cholmod.options)
    cholmod.options.update(chosen)
    try:
        yield
    finally:
        cholmod.options.clear()
        cholmod.options.update(before)


def to_cvxopt(matrix: sp.sparray) -> spmatrix:
    """The same matrix for CVXOPT."""
    entries = sp.coo_matrix(matrix)
    rows, columns = (dense_of(i.astype(np.int64)) for i in (entries.row, entries.col))
    return spmatrix(dense_of(entries.data.astype(float)), rows, columns, matrix.shape)


def _to_scipy(matrix: spmatrix) -> sp.csc_matrix:
    begins, rows, data = (np.array(part).ravel() for part in matrix.CCS)
    return sp.csc_matrix((data, rows, begins), matrix.size)


def _factored(lower: spmatrix, order: Any = None) -> Any:
    """CHOLMOD's factor of a symmetric matrix of which the lower triangle is given."""
    factor = cholmod.symbolic(lower) if order is None else cholmod.symbolic(lower, p=order)
    try:
        cholmod.numeric(lower, factor)
    except ArithmeticError:
        raise np.linalg.LinAlgError("the matrix is not positive definite") from None
    return factor
