"""Worker processes that start before there are jobs, and outcomes of jobs in any process.

On Linux early workers are forked while this process has a single thread: forks start at once, with
all modules that this process has imported. Elsewhere they start as new processes during the work of
this one. Workers ignore Ctrl-C, print nothing, and end when this process ends for any reason.
"""

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Generic, Self, TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.model.errors import FlexgearError

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

DIED = "its process died, most likely out of memory; take fewer --workers or a coarser case"


@dataclass(frozen=True)
class Outcome(Generic[R]):
    """Result of a job; of a failed job None, with the reason in one line in ``message``."""

    value: R | None
    message: str = ""


def outcome_of(function: Callable[[S, J], R], shared: S, job: J) -> Outcome[R]:
    """Outcome of function(shared, job)."""
    try:
        return Outcome(function(shared, job))
    except FlexgearError as error:
        return Outcome(None, " ".join(str(error).split()))
    except MemoryError:
        return Outcome(None, "out of memory; choose a coarser case")
    except Exception as error:  # a failed job must not stop the others
        text = " ".join(str(error).split()) or "no message"
        return Outcome(
            None, f"an internal error, please report it ({type(error).__name__}: {text})"
        )


_of_thread = threading.local()


def unpickled(common: bytes) -> Any:
    """The pickled function and shared object of a study, unpickled once in each thread, so that
    results which the shared object caches (such as an assembled train) serve all jobs."""
    if getattr(_of_thread, "common", None) != common:
        _of_thread.common, _of_thread.value = common, pickle.loads(common)
    return _of_thread.value


def on_one_thread(function: Callable[[S, J], R], shared: S, job: J) -> Outcome[R]:
    """``outcome_of`` with linear algebra on one thread, so that rounding is the same everywhere."""
    with threadpool_limits(limits=1):
        return outcome_of(function, shared, job)


def processors() -> int:
    """Number of processors that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


MAX_WORKERS = 3  # more would not draw faster, as each reads the results


class EarlyWorkers:
    """Context of worker processes, which end with the block.

    needed: whether to start any; initialise: called by each at its start, to import modules.
    """

    def __init__(self, needed: bool, initialise: Callable[[], object]) -> None:
        self._count = min(processors() - 1, MAX_WORKERS) if needed else 0
        self._initialise = initialise
        self._ended = contextlib.ExitStack()
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> Self:
        # a fork has no other threads, but has the locks that they hold
        if self._count > 0 and threading.active_count() == 1:
            method = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
            child_end, parent_end = method.Pipe(duplex=False)
            arguments = (self._initialise, child_end, parent_end)
            self._pool = ProcessPoolExecutor(self._count, method, _start_worker, arguments)
            self._ended.callback(self._pool.shutdown)
            self._ended.callback(parent_end.close)
            with block_interrupts_in_children():
                self._pool.submit(bool)  # the first job starts all processes
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.close()

    def ahead(self, function: Callable[[J], R], argument: J) -> Future[R] | None:
        """Call function(argument) in a worker and return its future; None, without a call, if
        there are no workers. The function is called for the files that it adds to the cache."""
        return None if self._pool is None else self._pool.submit(function, argument)

    def completed(
        self, function: Callable[[S, J], R], shared: S, jobs: Sequence[J]
    ) -> Iterator[tuple[int, Outcome[R]]]:
        """Number and outcome of function(shared, job) for every job, in the order of completion.

        Workers take jobs from the first on, this process from the last; it also repeats jobs whose
        worker died. Arguments and results must be picklable, of modules that workers can import.
        """
        futures: list[Future[Outcome[R]]] = []
        if self._pool is not None:
            with contextlib.suppress(RuntimeError):  # a worker has died before
                for job in jobs:
                    futures.append(self._pool.submit(on_one_thread, function, shared, job))
        begun: dict[Future[Outcome[R]], int] = {}
        for k in reversed(range(len(jobs))):
            if k < len(futures) and not futures[k].cancel():
                begun[futures[k]] = k
            else:
                yield k, on_one_thread(function, shared, jobs[k])
        for future in as_completed(begun):
            try:
                outcome = future.result()
            except Exception:  # its worker died, or its result could not be sent
                outcome = on_one_thread(function, shared, jobs[begun[future]])
            yield begun[future], outcome


@contextlib.contextmanager
def block_interrupts_in_children() -> Iterator[None]:
    """Context in which SIGINT is blocked, so that processes started in it ignore Ctrl-C from their
    first instruction on; this process handles a blocked signal at the end of the context."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start_worker(
    initialise: Callable[[], object], child_end: Connection, parent_end: Connection
) -> None:
    """Set a new worker up: tie it to its parent by their pipe, and call ``initialise``."""
    parent_end.close()  # the copy in a fork would keep the pipe open
    end_with_parent(child_end)
    initialise()


def end_with_parent(child_end: Connection) -> None:
    """Silence this worker, and exit as soon as its parent ends or closes its end of the pipe."""

    def wait() -> None:
        with contextlib.suppress(OSError, EOFError):
            child_end.poll(None)
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    with open(os.devnull, "r+b") as null:
        for stream in range(3):
            os.dup2(null.fileno(), stream)
    threading.Thread(target=wait, daemon=True).start()
