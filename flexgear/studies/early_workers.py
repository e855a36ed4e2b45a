"""Worker processes that are made before they are needed, while this process has one thread.

On Linux they are copies of this process, which cost nothing and have imported what it has;
elsewhere they start anew, while this process works. They wait at a pipe and end when this process
does, however it does. They do not hear Ctrl-C, and print nothing.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from flexgear.model.errors import FlexgearError

S = TypeVar("S")
J = TypeVar("J")
R = TypeVar("R")

DIED = "its process died, most likely out of memory; take fewer --workers or a coarser case"


@dataclass(frozen=True)
class Outcome(Generic[R]):
    """What a run returned, or in ``message`` why it did not (one line)."""

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
        self._processes: list[Any] = []
        self._pipes: list[Connection] = []

    def __enter__(self) -> EarlyWorkers:
        if threading.active_count() > 1:  # which a copy would lack, with what they hold
            return self
        method: Any = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
        for _ in range(self._count):
            ours, theirs = multiprocessing.Pipe()
            parent_ends = [*self._pipes, ours] if sys.platform == "linux" else []
            process = method.Process(
                target=_serve, args=(theirs, self._ready, parent_ends), daemon=True
            )
            with deaf_children():
                process.start()
            theirs.close()
            self._pipes.append(ours)
            self._processes.append(process)
        return self

    def __exit__(self, *_: object) -> None:
        for process in self._processes:
            process.kill()
        for process in self._processes:
            process.join()
        for pipe in self._pipes:
            pipe.close()

    def completed(
        self, function: Callable[[S, J], R], shared: S, jobs: Sequence[J]
    ) -> Iterator[tuple[int, Outcome[R]]]:
        """Number and outcome of every job as it is done: function(shared, job), by the workers from
        the first on, by this process from the last. What a worker died of is done here.

        All must be picklable, of modules that workers can import.
        """
        waiting, lock = deque(range(len(jobs))), threading.Lock()
        done: queue.SimpleQueue[tuple[int, Outcome[R]] | None] = queue.SimpleQueue()

        def drive(pipe: Connection) -> None:
            while True:
                with lock:
                    if not waiting:
                        break
                    k = waiting.popleft()
                try:
                    pipe.send_bytes(pickle.dumps((function, shared, jobs[k])))
                    done.put((k, pipe.recv()))
                except (EOFError, OSError):  # the worker is no more
                    with lock:
                        waiting.append(k)
                    break
            done.put(None)

        threads = [threading.Thread(target=drive, args=(p,), daemon=True) for p in self._pipes]
        for thread in threads:
            thread.start()
        driving = len(threads)
        while True:
            with contextlib.suppress(queue.Empty):
                while True:
                    outcome = done.get(block=driving > 0 and not waiting)
                    if outcome is None:
                        driving -= 1
                    else:
                        yield outcome
            with lock:
                mine = waiting.pop() if waiting else None
            if mine is not None:
                yield mine, on_one_thread(function, shared, jobs[mine])
            elif driving == 0:
                return


@contextlib.contextmanager
def deaf_children() -> Iterator[None]:
    """Processes that start meanwhile do not hear Ctrl-C, from their first instruction on; this one
    hears it afterwards."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def silenced() -> None:
    """A worker prints nothing and leaves Ctrl-C to its parent; other signals end it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in ("SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
    with open(os.devnull, "r+b") as nowhere:  # what libraries print; outcomes say what went wrong
        for stream in range(3):
            os.dup2(nowhere.fileno(), stream)


def _serve(
    pipe: Connection, ready: Callable[[], object], parent_ends: Sequence[Connection]
) -> None:
    """A worker: answers jobs until its pipe ends; parent_ends: the parent's ends of pipes."""
    silenced()
    for connection in parent_ends:
        connection.close()
    with contextlib.suppress(EOFError, OSError):
        ready()
        while True:
            function, shared, job = pickle.loads(pipe.recv_bytes())
            pipe.send(on_one_thread(function, shared, job))
