"""Independent jobs in processes of their own: results in order, failures as messages.

Every process runs its linear algebra on one thread, so that the results do not depend on how many
processes there are. Processes are started afresh ("spawn"), never forked from one with threads.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import connection
from typing import Any, Generic, TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.model.errors import FlexgearError

J = TypeVar("J")
R = TypeVar("R")
Done = Callable[[int], None]  # called with the number of jobs that are done

STARTING = 4.0  # s of work left below which starting processes does not pay
DIED = "its process died, most likely out of memory; take fewer --workers or a coarser case"


@dataclass(frozen=True)
class Outcome(Generic[R]):
    """What a job returned, or in ``message`` why it did not (one line)."""

    value: R | None
    message: str = ""


def processors() -> int:
    """Processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


def run_jobs(
    function: Callable[[J], R],
    jobs: Sequence[J],
    workers: int | None = None,
    done: Done = lambda count: None,
) -> list[Outcome[R]]:
    """function(job) of every job, in the order of the jobs.

    function and jobs must be picklable. workers: processes; None: as many as there are processors,
    but none beside this one where the first job shows that starting them takes longer. Ctrl-C
    stops all of them at once. New processes import the calling script, which therefore has to
    start its work under ``if __name__ == "__main__":``.
    """
    outcomes: list[Outcome[R] | None] = [None] * len(jobs)
    alone = workers == 1
    with threadpool_limits(limits=1):
        if workers is None and jobs:
            began = time.perf_counter()
            outcomes[0] = _outcome(function, jobs[0])
            done(1)
            alone = (time.perf_counter() - began) * (len(jobs) - 1) < STARTING
        if alone:
            for k, job in enumerate(jobs):
                if outcomes[k] is None:
                    outcomes[k] = _outcome(function, job)
                    done(k + 1)
    left = [k for k, o in enumerate(outcomes) if o is None]
    if left:
        _in_processes(function, jobs, left, outcomes, workers or processors(), done)
    return [o if o is not None else Outcome(None, DIED) for o in outcomes]


def _outcome(function: Callable[[J], R], job: J) -> Outcome[R]:
    """The job's result, or its error in one line."""
    try:
        return Outcome(function(job))
    except FlexgearError as error:
        return Outcome(None, " ".join(str(error).split()))
    except MemoryError:
        return Outcome(None, "out of memory; choose a coarser case")
    except Exception as error:  # one bad point must not cost the others
        text = " ".join(str(error).split()) or "no message"
        return Outcome(
            None, f"an internal error, please report it ({type(error).__name__}: {text})"
        )


def _on_one_thread(function: Callable[[J], R], job: J) -> Outcome[R]:
    """The outcome of a job in a process of its own; its libraries were loaded with ``function``."""
    with threadpool_limits(limits=1):
        return _outcome(function, job)


def _in_processes(
    function: Callable[[J], R],
    jobs: Sequence[J],
    left: list[int],
    outcomes: list[Outcome[R] | None],
    workers: int,
    done: Done,
) -> None:
    """Jobs ``left`` in processes. Those that die with a process are tried again, each alone."""
    try:
        _pool(function, jobs, left, outcomes, workers, done)
    except BrokenProcessPool:
        for k in [k for k in left if outcomes[k] is None]:
            try:
                _pool(function, jobs, [k], outcomes, 1, done)
            except BrokenProcessPool:
                outcomes[k] = Outcome(None, DIED)


def _pool(
    function: Callable[[J], R],
    jobs: Sequence[J],
    left: list[int],
    outcomes: list[Outcome[R] | None],
    workers: int,
    done: Done,
) -> None:
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(
        min(workers, len(left)), multiprocessing.get_context("spawn"), initializer=_start
    )
    try:
        places = {pool.submit(_on_one_thread, function, jobs[k]): k for k in left}
        waiting: set[Future[Any]] = set(places)
        while waiting:
            finished, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in finished:
                outcomes[places[future]] = future.result()
            done(sum(o is not None for o in outcomes))
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
        raise
    pool.shutdown()


def _start() -> None:
    """In a new process: Ctrl-C is left to the parent, and it ends when the parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)
