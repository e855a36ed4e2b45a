"""Pictures drawn by two processes: a helper begins while results are still being saved.

matplotlib draws on one core at a time, so a run would end with the other core idle. The helper is
a process pool of one, given one picture at a time; this process draws what is left when it has
time, and whatever the helper could not.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from typing import Any, Generic, TypeVar

Content = TypeVar("Content")
Result = TypeVar("Result")


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Painter(Generic[Content, Result]):
    """Work by name on a content; the first names are for a helper, the last ones for this process.

    submit: gives the helper one name, None where there is no helper.
    """

    def __init__(
        self,
        content: Content,
        work: Callable[[Content, str], Result],
        names: Iterable[str],
        submit: Callable[[str], Future[Result]] | None = None,
    ) -> None:
        self.content, self._work, self._submit = content, work, submit
        self._left, self._lock = deque(names), threading.Lock()
        self._given: dict[str, Future[Result]] = {}
        self._give()

    def _give(self, done: Future[Result] | None = None) -> None:
        """Give the helper the next name, and one more when it has done that."""
        with self._lock:
            if self._submit is None or not self._left or (done and done.exception()):
                return
            name = self._left.popleft()
            try:
                self._given[name] = given = self._submit(name)
            except BrokenProcessPool:
                self._left.appendleft(name)
                return
        given.add_done_callback(self._give)

    def finish(self, drawn: Callable[[int], None] = lambda count: None) -> dict[str, Result]:
        """Do what the helper has not begun, wait for the rest; everything by name."""
        results: dict[str, Result] = {}
        while name := self._taken():
            results[name] = self._work(self.content, name)
            drawn(len(results))
        for name, future in self._given.items():
            if future.exception() is None:
                results[name] = future.result()
            else:  # fails here again, where its error is understood
                results[name] = self._work(self.content, name)
            drawn(len(results))
        return results

    def _taken(self) -> str | None:
        """The last name that nobody has begun."""
        with self._lock:
            return self._left.pop() if self._left else None


@contextmanager
def beside(
    content: Content,
    pieces: Iterable[Any],
    build: Callable[[list[Any]], Content],
    work: Callable[[Content, str], Result],
    names: Iterable[str],
) -> Iterator[Painter[Content, Result]]:
    """A painter whose helper works during the block, where there is a core for it.

    pieces, build: what the helper makes its content of; pieces travel one by one, as a run is
    hundreds of megabytes. work: does one name. Both functions stand in a module.
    """
    if cores() < 2:
        yield Painter(content, work, names)
        return
    with _helper() as pool:
        for piece in pieces:
            pool.submit(_keep, piece)
        yield Painter(content, work, names, lambda name: pool.submit(_do, build, work, name))


@contextmanager
def _helper() -> Iterator[ProcessPoolExecutor]:
    """A process that does not hear Ctrl-C and never outlives the block, whatever it does."""
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(1, context, initializer=_prepare)
    with _deaf():
        number = pool.submit(os.getpid)
    try:
        yield pool
    finally:
        with suppress(BrokenProcessPool):  # it is gone, and its number may be another's
            for child in multiprocessing.active_children():
                if child.pid == number.result():
                    child.kill()
        pool.shutdown(wait=False)


@contextmanager
def _deaf() -> Iterator[None]:
    """Processes started in the block do not hear Ctrl-C; this one hears it afterwards."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # else it starts within the block and lets signals in again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


# --- in the helper -------------------------------------------------------------------------------

_pieces: list[Any] = []
_content: list[Any] = []  # one, once it was built


def _prepare() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)


def _keep(piece: Any) -> None:
    _pieces.append(piece)


def _do(
    build: Callable[[list[Any]], Content], work: Callable[[Content, str], Result], name: str
) -> Result:
    if not _content:
        _content.append(build(_pieces))
    return work(_content[0], name)
