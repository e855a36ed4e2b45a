"""Worker processes that are made before they are needed, while this process has one thread.

On Linux they are copies of this process, which cost nothing and have imported what it has;
elsewhere they start anew, while this process works. They end when this process does, however it
does. They do not hear Ctrl-C, and print nothing.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.model.errors import FlexgearError

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

DIED = "its process died, most likely out of memory; take fewer --workers or a coarser case"


@dataclass(frozen=True)
class Outcome(Generic[R]):
    """Result of a run, or in ``message`` one line with the reason of its failure."""

    value: R | None
    message: str = ""


def outcome_of(function: Callable[[S, J], R], shared: S, job: J) -> Outcome[R]:
    """function(shared, job), or its error in one line."""
    try:
        return Outcome(function(shared, job))
    except FlexgearError as error:
        return Outcome(None, " ".join(str(error).split()))
    except MemoryError:
        return Outcome(None, "out of memory; choose a coarser case")
    except Exception as error:  # one bad run must not cost the others
        text = " ".join(str(error).split()) or "no message"
        return Outcome(
            None, f"an internal error, please report it ({type(error).__name__}: {text})"
        )


_of_thread = threading.local()


def unpickled(common: bytes) -> Any:
    """Function and what all runs of a study share: in each thread one object, which keeps what it
    works out (such as an assembled train) from one run to the next."""
    if getattr(_of_thread, "common", None) != common:
        _of_thread.common, _of_thread.value = common, pickle.loads(common)
    return _of_thread.value


def on_one_thread(function: Callable[[S, J], R], shared: S, job: J) -> Outcome[R]:
    """``outcome_of`` with linear algebra on one thread: the same digits in any process."""
    with threadpool_limits(limits=1):
        return outcome_of(function, shared, job)


def processors() -> int:
    """Processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


MOST = 3  # that pay beside this process


class EarlyWorkers:
    """Workers that wait for jobs; they end with the block.

    needed: whether there are any; ready: what each does at its start, such as importing modules.
    """

    def __init__(self, needed: bool, ready: Callable[[], object]) -> None:
        self._count = min(processors() - 1, MOST) if needed else 0
        self._ready = ready
        self._ended = contextlib.ExitStack()
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> EarlyWorkers:
        # a copy would lack other threads, with the locks that they hold
        if self._count > 0 and threading.active_count() == 1:
            method = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
            theirs, ours = method.Pipe(duplex=False)
            arguments = (self._ready, theirs, ours)
            self._pool = ProcessPoolExecutor(self._count, method, _prepare, arguments)
            self._ended.callback(self._pool.shutdown)
            self._ended.callback(ours.close)
            with deaf_children():
                self._pool.submit(bool)  # which starts all of them
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.close()

    def completed(
        self, function: Callable[[S, J], R], shared: S, jobs: Sequence[J]
    ) -> Iterator[tuple[int, Outcome[R]]]:
        """Number and outcome of every job: function(shared, job), by the workers from the first on,
        by this process from the last. A job whose worker died is done by this process.

        All must be picklable, of modules that workers can import.
        """
        waiting = deque(range(len(jobs)))
        answers: SimpleQueue[tuple[int, Outcome[R] | None]] = SimpleQueue()

        def feed(pool: ProcessPoolExecutor) -> None:
            """Keep one worker busy while jobs wait."""
            outcome: Outcome[R] | None = Outcome(None)
            with contextlib.suppress(IndexError):  # no job waits
                while outcome is not None:
                    k = waiting.popleft()
                    try:
                        outcome = pool.submit(on_one_thread, function, shared, jobs[k]).result()
                    except RuntimeError:  # its worker died
                        outcome = None
                    answers.put((k, outcome))

        if self._pool is not None:
            for _ in range(self._count):
                threading.Thread(target=feed, args=(self._pool,), daemon=True).start()
        for _ in jobs:
            with contextlib.suppress(IndexError):
                k = waiting.pop()
                answers.put((k, on_one_thread(function, shared, jobs[k])))
            k, outcome = answers.get()
            yield k, outcome or on_one_thread(function, shared, jobs[k])


@contextlib.contextmanager
def deaf_children() -> Iterator[None]:
    """Block Ctrl-C inside the block, so that processes started there ignore it from the first
    instruction on; this process takes it afterwards."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _silence() -> None:
    """A worker prints nothing and leaves Ctrl-C to its parent; other signals end it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    with open(os.devnull, "r+b") as nowhere:  # what libraries print; outcomes say what went wrong
        for stream in range(3):
            os.dup2(nowhere.fileno(), stream)


def _prepare(ready: Callable[[], object], parent: Connection, parents_end: Connection) -> None:
    """Start of a worker: ties it to its parent by both ends of ``end_with``'s pipe, and calls
    ``ready``."""
    parents_end.close()
    end_with(parent)
    ready()


def end_with(parent: Connection) -> None:
    """Make this worker silent, and let it end, whatever it does, when its parent ends or closes the
    other end of the pipe."""

    def wait() -> None:
        with contextlib.suppress(OSError, EOFError):
            parent.poll(None)
        os._exit(1)

    _silence()
    threading.Thread(target=wait, daemon=True).start()
