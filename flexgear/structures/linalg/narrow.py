"""Products of tall matrices of one Lanczos block's width, compiled.

BLAS is made for more columns: with so few it spends its time on packing and on calls.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDTH = 4  # columns, known to the compiler: a row is one register


@numba.njit(cache=True, nogil=True, fastmath={"contract"})  # type: ignore[untyped-decorator]
def gram(a: Array, b: Array) -> Array:  # pragma: no cover - compiled
    """a^T b (WIDTH, WIDTH) of a, b (n, WIDTH)."""
    out = np.zeros((WIDTH, WIDTH))
    for i in range(len(a)):
        for k in range(WIDTH):
            factor = a[i, k]
            for c in range(WIDTH):
                out[k, c] += factor * b[i, c]
    return out


@numba.njit(cache=True, nogil=True, fastmath={"contract"})  # type: ignore[untyped-decorator]
def combine(a: Array, b: Array, out: Array, keep: float) -> None:  # pragma: no cover - compiled
    """out <- keep out + a b of a, out (n, WIDTH) and b (WIDTH, WIDTH); out may be a."""
    row = np.empty(WIDTH)
    for i in range(len(a)):
        for c in range(WIDTH):
            row[c] = keep * out[i, c]
        for k in range(WIDTH):
            factor = a[i, k]
            for c in range(WIDTH):
                row[c] += factor * b[k, c]
        for c in range(WIDTH):
            out[i, c] = row[c]
