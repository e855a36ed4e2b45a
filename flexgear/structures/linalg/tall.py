"""Products of tall matrices, their rows shared out among threads.

BLAS itself runs on one thread here: several processes on one machine, each with a threaded BLAS,
wait for one another far longer than they compute.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.structures.linalg.narrow import WIDTH, combine, gram

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
_ROWS = 4096  # rows a thread takes at a time, at least
_ENTRIES = 1 << 18  # entries it takes at a time where rows are short: less would cost calls


@contextmanager
def single_threaded_blas() -> Iterator[None]:
    """Inside, BLAS uses one thread."""
    with threadpool_limits(1, "blas"):
        yield


def times(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """a b (n, p) of a tall a (n, k) and b (k, p)."""
    out = np.empty((len(a), b.shape[1]))

    def part(rows: slice) -> None:
        np.matmul(a[rows], b, out=out[rows])

    _share(a, part)
    return out


def times_in_place(a: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    """a <- a b of a tall a (n, k) and b (k, k)."""
    square = np.ascontiguousarray(b)

    def part(rows: slice) -> None:
        if a.shape[1] == WIDTH:
            combine(a[rows], square, a[rows], 0.0)
        else:
            a[rows] = a[rows] @ b

    _share(a, part)


def subtract(w: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]) -> None:
    """w <- w - a b of tall w (n, p), a (n, k) and b (k, p)."""
    narrow = w.shape[1] == a.shape[1] == WIDTH
    minus = -np.ascontiguousarray(b)

    def part(rows: slice) -> None:
        if narrow:
            combine(a[rows], minus, w[rows], 1.0)
        else:
            w[rows] += a[rows] @ minus

    _share(w, part)


def dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """a^T b (k, p) of tall a (n, k) and b (n, p); summed in a fixed order."""
    parts: dict[int, NDArray[np.float64]] = {}
    narrow = a.shape[1] == b.shape[1] == WIDTH

    def part(rows: slice) -> None:
        parts[rows.start] = gram(a[rows], b[rows]) if narrow else a[rows].T @ b[rows]

    _share(a, part)
    total = np.zeros((a.shape[1], b.shape[1]))
    for start in sorted(parts):
        total += parts[start]
    return total


def _share(tall: NDArray[np.float64], part: Callable[[slice], None]) -> None:
    """Call part(rows) for all rows of a matrix, on all threads where there are many rows."""
    count, width = tall.shape
    step = max(_ROWS, _ENTRIES // max(width, 1))
    slices = [slice(a, min(a + step, count)) for a in range(0, count, step)]
    if THREADS == 1 or len(slices) < 4:
        for rows in slices:
            part(rows)
        return
    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(part, slices))
