"""Dense matrices: inverses by LAPACK, and tall products on all threads.

Tall matrices have many rows, which threads share, and few columns.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray
from scipy.linalg import lapack

from flexgear.arrays import Array
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


def hermitian_inverse(matrix: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Inverse of a positive definite Hermitian matrix, its lower triangle.

    Raises numpy.linalg.LinAlgError where it is not definite.
    """
    factor = _checked(*lapack.zpotrf(matrix, lower=1))
    return _checked(*lapack.zpotri(factor, lower=1, overwrite_c=1))


def _checked(result: NDArray[np.complex128], info: int) -> NDArray[np.complex128]:
    if info:
        raise np.linalg.LinAlgError(f"LAPACK stopped at row {info}")
    return result


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
    """The first p columns of a tall a (n, k) become those of a b, b (k, p)."""

    def part(rows: slice) -> None:
        a[rows, : b.shape[1]] = a[rows] @ b

    shared(len(a), part, _chunk(a))


def subtract(w: Array, a: Array, b: Array) -> None:
    """w <- w - a b of tall w (n, p), a (n, k) and b (k, p)."""

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
    """Rows a thread takes at a time."""
    return max(_ROWS, _ENTRIES // max(tall.shape[1], 1))
