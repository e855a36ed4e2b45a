"""Sums into rows: products of CSR matrices with a few columns, and rows taken off in place."""

from __future__ import annotations

import numba
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.linalg.threads import shared

Array = NDArray[np.float64]
Index = NDArray[np.int32]
Ints = NDArray[np.int64]

_CHUNK = 8192  # rows a thread takes at a time


def csr_times(matrix: sp.csr_matrix, x: Array) -> Array:
    """A x (n, k) of a CSR matrix A (n, m) and x (m, k)."""
    out = np.zeros((matrix.shape[0], x.shape[1]))
    add_csr_times(matrix, x, out)
    return out


def add_csr_times(matrix: sp.csr_matrix, x: Array, out: Array) -> None:
    """out (n, k) += A x; every row is summed in the order it is stored in."""
    x = np.ascontiguousarray(x)

    def part(rows: slice) -> None:
        _add(matrix.indptr, matrix.indices, matrix.data, x, out, rows.start, rows.stop)

    shared(len(out), part, min(_CHUNK, max(1, len(out) // 16)))


@numba.njit(cache=True, nogil=True, fastmath={"contract"})  # type: ignore[untyped-decorator]
def _add(
    indptr: Index, indices: Index, data: Array, x: Array, out: Array, begin: int, end: int
) -> None:  # pragma: no cover - compiled
    """Four entries of a row at a time: its sums are read and written less often."""
    columns = x.shape[1]
    for i in range(begin, end):
        e, last = indptr[i], indptr[i + 1]
        while e + 4 <= last:
            p, q, r, s = indices[e], indices[e + 1], indices[e + 2], indices[e + 3]
            a, b, c, d = data[e], data[e + 1], data[e + 2], data[e + 3]
            for k in range(columns):
                out[i, k] += a * x[p, k] + b * x[q, k] + c * x[r, k] + d * x[s, k]
            e += 4
        while e < last:
            p, a = indices[e], data[e]
            for k in range(columns):
                out[i, k] += a * x[p, k]
            e += 1


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def subtract_rows(x: Array, at: Ints, lost: Array) -> None:  # pragma: no cover - compiled
    """x[at] -= lost, without a copy of x[at]; other threads may run."""
    for i in range(len(at)):
        row = at[i]
        for c in range(x.shape[1]):
            x[row, c] -= lost[i, c]
