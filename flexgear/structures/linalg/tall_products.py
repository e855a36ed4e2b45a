"""Tall products: of matrices with many rows and few columns, their rows shared out among threads.

A block of four columns, as the Lanczos iteration has them, is multiplied by compiled loops: with
so few columns BLAS spends its time on packing and on calls.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.compiled import njit
from flexgear.structures.linalg.threads import shared

Array = NDArray[np.float64]

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
