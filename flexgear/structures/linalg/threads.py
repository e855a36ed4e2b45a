"""Work on many rows or columns, shared out among threads in pieces that fit the processor's cache.

BLAS itself runs on one thread here: several processes on one machine, each with a threaded BLAS,
wait for one another far longer than they compute.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import pairwise

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
CHUNK = 384  # columns a thread takes at a time


@contextmanager
def single_threaded_blas() -> Iterator[None]:
    """Inside, BLAS uses one thread."""
    with threadpool_limits(1, "blas"):
        yield


def blocks(count: int, step: int) -> Iterator[slice]:
    """Slices of count rows or columns, of step each but the last."""
    for start in range(0, count, step):
        yield slice(start, min(start + step, count))


def shared(count: int, part: Callable[[slice], None], chunk: int = CHUNK) -> None:
    """Call part(slice) for all of count rows or columns.

    Every thread gets as many pieces as the others, of about chunk each.
    """
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
