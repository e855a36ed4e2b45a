"""Columns shared out among threads in chunks that fit the processor's cache."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise

from flexgear.structures.linalg.tall import THREADS

CHUNK = 384  # columns a thread takes at a time


def shared(count: int, part: Callable[[slice], None], chunk: int = CHUNK) -> None:
    """Call part(columns) for all of count columns; BLAS is expected to run on one thread.

    Every thread gets as many pieces as the others, of about chunk columns each.
    """
    pieces = 1 if count <= chunk // 2 else THREADS * max(1, round(count / chunk / THREADS))
    pieces = min(pieces, count) or 1
    borders = [count * p // pieces for p in range(pieces + 1)]
    slices = [slice(a, b) for a, b in pairwise(borders)]
    if THREADS == 1 or pieces == 1:
        for columns in slices:
            part(columns)
        return
    with ThreadPoolExecutor(THREADS) as pool:
        list(pool.map(part, slices))
