"""Dense matrices: inverses by LAPACK, and products of tall matrices by several threads.

Tall matrices have many rows, which are divided among the threads, and few columns; a piece fits the
processor's cache. BLAS itself uses one thread here: several processes on one machine, each with a
threaded BLAS, would wait for one another far longer than they compute.
"""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import pairwise

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray
from scipy.linalg import lapack
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.arrays import Array

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
CHUNK = 384  # columns that a thread processes together


@contextmanager
def single_threaded_blas() -> Iterator[None]:
    """Context in which BLAS uses one thread."""
    with threadpool_limits(1, "blas"):
        yield


def blocks(count: int, step: int) -> Iterator[slice]:
    """Slices that divide ``count`` rows or columns into blocks of ``step``; the last is shorter."""
    for start in range(0, count, step):
        yield slice(start, min(start + step, count))


def shared(count: int, part: Callable[[slice], None], chunk: int = CHUNK) -> None:
    """Call part(slice) in several threads for slices that cover ``count`` rows or columns, about
    ``chunk`` each; every thread has the same number of slices."""
    pieces = 1 if count <= chunk // 2 else THREADS * max(1, round(count / chunk / THREADS))
    pieces = min(pieces, count) or 1
    borders = [count * p // pieces for p in range(pieces + 1)]
    slices = [slice(a, b) for a, b in pairwise(borders)]
    if THREADS == 1 or pieces == 1:
        for piece in slices:
            part(piece)
        return
    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(part, slices))


def scaled_inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix whose rows have different units. The matrix
    is scaled to unit diagonal. numpy.linalg.LinAlgError where it is not definite."""
    if not len(matrix):
        return matrix
    scale = 1 / np.sqrt(np.diag(matrix))
    factor = sla.cho_factor(scale[:, None] * matrix * scale, lower=True)
    inverse = sla.cho_solve(factor, np.eye(len(matrix)))
    inverse = 0.5 * (inverse + inverse.T)
    return scale[:, None] * inverse * scale


def balanced_inverse(matrix: Array) -> Array:
    """Inverse of a symmetric regular matrix, scaled to largest entries near one in each row."""
    scale = np.ones(len(matrix))
    for _ in range(3):
        scale /= np.sqrt(np.abs(scale[:, None] * matrix * scale).max(axis=1, initial=0.0))
    inverse = np.linalg.inv(scale[:, None] * matrix * scale)
    inverse = 0.5 * (inverse + inverse.T)
    return scale[:, None] * inverse * scale


def hermitian_inverse(matrix: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Lower triangle of the inverse of a positive definite Hermitian matrix.
    numpy.linalg.LinAlgError where the matrix is not definite."""
    factor = _checked(*lapack.zpotrf(matrix, lower=1))
    return _checked(*lapack.zpotri(factor, lower=1, overwrite_c=1))


def signed_hermitian_inverse(
    matrix: NDArray[np.complex128],
) -> tuple[NDArray[np.complex128], int]:
    """Lower triangle of the inverse of a regular Hermitian matrix, and the number of the matrix's
    negative eigenvalues.

    A = L D L^H has as many as D (Sylvester's law of inertia), one for each 2 x 2 block of Bunch and
    Kaufman's D. Raises numpy.linalg.LinAlgError where the matrix is not regular.
    """
    room = int(lapack.zhetrf_lwork(len(matrix), lower=1)[0].real)
    factor, pivots, info = lapack.zhetrf(matrix, lower=1, lwork=room)
    _checked(factor, info)
    single = pivots > 0
    negative = int((factor.diagonal().real[single] < 0).sum() + (~single).sum() // 2)
    return _checked(*lapack.zhetri(factor, pivots, lower=1, overwrite_a=1)), negative


def _checked(result: NDArray[np.complex128], info: int) -> NDArray[np.complex128]:
    if info:
        raise np.linalg.LinAlgError(f"LAPACK stopped at row {info}")
    return result


_ROWS = 4096  # least rows that a thread processes together
_ENTRIES = 1 << 18  # least entries, where rows are short: fewer would cost calls


def times(a: Array, b: Array) -> Array:
    """a b (n, p) of a tall a (n, k) and b (k, p)."""
    out = np.empty((len(a), b.shape[1]))

    def part(rows: slice) -> None:
        np.matmul(a[rows], b, out=out[rows])

    shared(len(a), part, _chunk(a))
    return out


def times_in_place(a: Array, b: Array) -> None:
    """Replace the first p columns of a tall a (n, k) by a b, b (k, p)."""

    def part(rows: slice) -> None:
        a[rows, : b.shape[1]] = a[rows] @ b

    shared(len(a), part, _chunk(a))


def subtract(w: Array, a: Array, b: Array) -> None:
    """Subtract a b from a tall w (n, p) in place; a (n, k), b (k, p)."""

    def part(rows: slice) -> None:
        w[rows] -= a[rows] @ b

    shared(len(w), part, _chunk(w))


def dot(a: Array, b: Array) -> Array:
    """a^T b (k, p) of tall a (n, k) and b (n, p); summed in a fixed order."""
    parts: dict[int, Array] = {}

    def part(rows: slice) -> None:
        parts[rows.start] = a[rows].T @ b[rows]

    shared(len(a), part, _chunk(a))
    return np.asarray(
        sum((parts[start] for start in sorted(parts)), np.zeros((a.shape[1], b.shape[1])))
    )


def _chunk(tall: Array) -> int:
    """Number of rows of a tall matrix that a thread processes together."""
    return max(_ROWS, _ENTRIES // max(tall.shape[1], 1))
