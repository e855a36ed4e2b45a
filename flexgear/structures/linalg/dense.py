"""Dense matrices: inverses by LAPACK, and tall products on all threads.

Tall matrices have many rows, which threads share, and few columns. A block of four columns, as the
Lanczos iteration has them, is multiplied by compiled loops: with so few columns BLAS spends its
time on packing and on calls.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray
from scipy.linalg import lapack

from flexgear.arrays import Array
from flexgear.compiled import njit
from flexgear.structures.linalg.threads import shared


def scaled_inverse(matrix: Array) -> Array:
    """Inverse of a symmetric positive definite matrix whose rows have different units.

    It is scaled to unit diagonal first. Raises numpy.linalg.LinAlgError where it is not definite.
    """
    if not len(matrix):
        return matrix
    scale = 1 / np.sqrt(np.diag(matrix))
    factor = sla.cho_factor(scale[:, None] * matrix * scale, lower=True)
    inverse = sla.cho_solve(factor, np.eye(len(matrix)))
    inverse = 0.5 * (inverse + inverse.T)
    return scale[:, None] * inverse * scale


def balanced_inverse(matrix: Array) -> Array:
    """Inverse of a symmetric regular matrix, its rows scaled to largest entries near one first."""
    scale = np.ones(len(matrix))
    for _ in range(3):
        scale /= np.sqrt(np.abs(scale[:, None] * matrix * scale).max(axis=1, initial=0.0))
    inverse = np.linalg.inv(scale[:, None] * matrix * scale)
    inverse = 0.5 * (inverse + inverse.T)
    return scale[:, None] * inverse * scale


def hermitian_inverse(matrix: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Inverse of a positive definite Hermitian matrix, its lower triangle.

    Raises numpy.linalg.LinAlgError where it is not definite.
    """
    factor = _checked(*lapack.zpotrf(matrix, lower=1))
    return _checked(*lapack.zpotri(factor, lower=1, overwrite_c=1))


def signed_hermitian_inverse(
    matrix: NDArray[np.complex128],
) -> tuple[NDArray[np.complex128], int]:
    """Inverse of a regular Hermitian matrix, its lower triangle, and how many negative eigenvalues.

    A = L D L^H has as many as D (Sylvester); of Bunch and Kaufman's 2 x 2 blocks, one each.
    Raises numpy.linalg.LinAlgError where the matrix is not regular.
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


BLOCK_OF_FOUR = 4  # columns, known to the compiler: a row is one register
_ROWS = 4096  # rows a thread takes at a time, at least
_ENTRIES = 1 << 18  # entries it takes at a time where rows are short: less would cost calls


def times(a: Array, b: Array) -> Array:
    """a b (n, p) of a tall a (n, k) and b (k, p)."""
    out = np.empty((len(a), b.shape[1]))

    def part(rows: slice) -> None:
        np.matmul(a[rows], b, out=out[rows])

    shared(len(a), part, _chunk(a))
    return out


def times_in_place(a: Array, b: Array) -> None:
    """a <- a b of a tall a (n, k) and b (k, k)."""
    square = np.ascontiguousarray(b)

    def part(rows: slice) -> None:
        if a.shape[1] == BLOCK_OF_FOUR:
            _combine(a[rows], square, a[rows], 0.0)
        else:
            a[rows] = a[rows] @ b

    shared(len(a), part, _chunk(a))


def subtract(w: Array, a: Array, b: Array) -> None:
    """w <- w - a b of tall w (n, p), a (n, k) and b (k, p)."""
    four = w.shape[1] == a.shape[1] == BLOCK_OF_FOUR
    minus = -np.ascontiguousarray(b)

    def part(rows: slice) -> None:
        if four:
            _combine(a[rows], minus, w[rows], 1.0)
        else:
            w[rows] += a[rows] @ minus

    shared(len(w), part, _chunk(w))


def dot(a: Array, b: Array) -> Array:
    """a^T b (k, p) of tall a (n, k) and b (n, p); summed in a fixed order."""
    parts: dict[int, Array] = {}
    four = a.shape[1] == b.shape[1] == BLOCK_OF_FOUR

    def part(rows: slice) -> None:
        parts[rows.start] = _gram(a[rows], b[rows]) if four else a[rows].T @ b[rows]

    shared(len(a), part, _chunk(a))
    total = np.zeros((a.shape[1], b.shape[1]))
    for start in sorted(parts):
        total += parts[start]
    return total


def _chunk(tall: Array) -> int:
    """Rows a thread takes at a time."""
    return max(_ROWS, _ENTRIES // max(tall.shape[1], 1))


@njit(nogil=True, fastmath={"contract"})
def _gram(a: Array, b: Array) -> Array:  # pragma: no cover - compiled
    """a^T b (4, 4) of a, b (n, 4)."""
    out = np.zeros((BLOCK_OF_FOUR, BLOCK_OF_FOUR))
    for i in range(len(a)):
        for k in range(BLOCK_OF_FOUR):
            factor = a[i, k]
            for c in range(BLOCK_OF_FOUR):
                out[k, c] += factor * b[i, c]
    return out


@njit(nogil=True, fastmath={"contract"})
def _combine(a: Array, b: Array, out: Array, keep: float) -> None:  # pragma: no cover - compiled
    """out <- keep out + a b of a, out (n, 4) and b (4, 4); out may be a."""
    row = np.empty(BLOCK_OF_FOUR)
    for i in range(len(a)):
        for c in range(BLOCK_OF_FOUR):
            row[c] = keep * out[i, c]
        for k in range(BLOCK_OF_FOUR):
            factor = a[i, k]
            for c in range(BLOCK_OF_FOUR):
                row[c] += factor * b[k, c]
        for c in range(BLOCK_OF_FOUR):
            out[i, c] = row[c]
