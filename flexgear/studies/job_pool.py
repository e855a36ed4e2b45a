"""Many independent runs: in this process where they are short, else on others or a cluster."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from typing import TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.studies.outcome import Outcome, outcome_of, processors

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

STARTING = 8.0  # s that workers have to save before it pays to start them


def run_jobs(
    function: Callable[[S, J], R],
    shared: S,
    jobs: Sequence[J],
    *,
    workers: int | None = None,
    scheduler: str | None = None,
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Number of every job and outcome of function(shared, job), as they are done.

    workers: processes of this machine (1: this one alone; None: as many as there are processors,
    but none beside this one where the first job shows that starting them takes longer);
    scheduler: address of a Dask cluster instead. Linear algebra runs on one thread everywhere, so
    that results do not depend on where. All three must be picklable, of modules that workers can
    import. Closing the iterator, or an exception in it such as Ctrl-C, stops all workers at once;
    take it in ``contextlib.closing``.
    """
    here = 0  # jobs done in this process
    if scheduler is None and jobs and workers in (None, 1):
        with threadpool_limits(limits=1):
            began = time.perf_counter()
            first = outcome_of(function, shared, jobs[0])
            left = (time.perf_counter() - began) * (len(jobs) - 1)
            yield 0, first
            here = 1
            if workers == 1 or left * (1 - 1 / processors()) < STARTING:
                for here, job in enumerate(jobs[1:], 2):
                    yield here - 1, outcome_of(function, shared, job)
    if here == len(jobs):
        return
    with closing(_elsewhere(function, shared, jobs[here:], workers, scheduler)) as rest:
        for k, outcome in rest:
            yield here + k, outcome


def _elsewhere(
    function: Callable[[S, J], R],
    shared: S,
    jobs: Sequence[J],
    workers: int | None,
    scheduler: str | None,
) -> Generator[tuple[int, Outcome[R]], None, None]:
    """Runs in other processes; either library is loaded where it is needed."""
    if scheduler is not None:
        from flexgear.studies import dask_pool

        return dask_pool.completed(function, shared, jobs, scheduler)
    from flexgear.studies import local_pool

    return local_pool.completed(function, shared, jobs, workers or processors())
