r"""Sparse Cholesky factorisation, used many times, by CHOLMOD.

    P A P^T = L L^T

with P the fill-reducing order that CHOLMOD finds (approximate minimum degree). Both halves of a
solve are open: W = L^{-1} P B^T has few entries where B^T has few.
Source: Chen, Davis, Hager, Rajamanickam 2008, ACM TOMS 35:22; Python interface: CVXOPT.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from cvxopt import cholmod, spmatrix
from cvxopt import matrix as dense_of
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]

_SOLVE, _FORWARD, _BACKWARD, _PERMUTE, _PERMUTE_BACK = 0, 4, 5, 7, 8  # CHOLMOD's `sys`


class Factor:
    """L of a symmetric positive definite matrix (n, n), CSR.

    Raises FlexgearError where the matrix is not positive definite.
    """

    name = "cholmod"

    def __init__(self, matrix: sp.csr_matrix) -> None:
        lower = sp.tril(matrix, format="coo")
        rows, columns = (dense_of(i.astype(np.int64)) for i in (lower.row, lower.col))
        given = spmatrix(dense_of(lower.data), rows, columns, matrix.shape)
        self._factor = cholmod.symbolic(given)
        try:
            cholmod.numeric(given, self._factor)
        except ArithmeticError:
            raise FlexgearError(
                "the stiffness matrix is singular: the mesh falls into pieces or has cells "
                "that hang on an edge"
            ) from None

    def solve(self, right: Array) -> Array:
        """x (n, k) with A x = right (n, k)."""
        return self._each(right, _SOLVE)

    def forward(self, right: Array) -> Array:
        """f = L^{-1} P right (n, k)."""
        return self._each(right, _PERMUTE, _FORWARD)

    def forward_sparse(self, right: sp.csr_matrix) -> sp.csr_matrix:
        """The same of a sparse right (n, k): only what its entries reach is computed."""
        entries = sp.coo_matrix(right)
        found = spmatrix(
            entries.data, entries.row.astype(np.int64), entries.col.astype(np.int64), right.shape
        )
        for step in (_PERMUTE, _FORWARD):
            found = cholmod.spsolve(self._factor, found, sys=step)
        begins, rows, data = (np.array(part).ravel() for part in found.CCS)
        return sp.csc_matrix((data, rows, begins), right.shape).tocsr()

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
