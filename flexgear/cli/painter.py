"""Pictures drawn by two processes: a helper begins while results are still being saved.

matplotlib draws on one core at a time, so a run would end with the other core idle. The helper is
a process of its own, told what to draw one picture at a time; this process draws what is left when
it has time, and whatever the helper could not.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

Content = TypeVar("Content")
Result = TypeVar("Result")
LOST = (OSError, EOFError)  # of a helper that is no more


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class Painter(Generic[Content, Result]):
    """Work by name on a content, shared with a helper process.

    pieces, build: what the helper makes its content of; pieces travel one by one, as a run is
    hundreds of megabytes. work: does one name. Both functions stand in a module.
    """

    def __init__(
        self,
        content: Content,
        pieces: Iterable[Any],
        build: Callable[[list[Any]], Content],
        work: Callable[[Content, str], Result],
        names: Iterable[str],
    ) -> None:
        self.work, self.content, self.results = work, content, dict[str, Result]()
        self._pieces, self._build = pieces, build
        self._left = deque(names)
        self._helper: multiprocessing.process.BaseProcess | None = None
        self._thread: threading.Thread | None = None

    def begin(self) -> None:
        """Start the helper."""
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        helper = context.Process(target=_serve, args=(there, self._build, self.work), daemon=True)
        with there, _deaf():
            helper.start()
        self._helper = helper
        self._thread = threading.Thread(target=self._lead, args=(here,), daemon=True)
        self._thread.start()

    def _lead(self, helper: Connection) -> None:
        """Hand names to the helper, the first ones first, until none is left."""
        name, trouble = None, []
        try:
            for piece in self._pieces:
                helper.send(("piece", piece))
            while self._left:
                name = self._left.popleft()
                helper.send(("name", name))
                done, answer = helper.recv()
                if done:
                    self.results[name] = answer
                else:
                    trouble.append(name)
                name = None
        except (*LOST, IndexError):
            if name is not None:
                self._left.append(name)  # for this process
        finally:
            self._left.extend(trouble)  # fails here again, where its error is understood
            helper.close()

    def finish(self, drawn: Callable[[int], None] = lambda count: None) -> dict[str, Result]:
        """Do what is left, the last ones first, beside the helper; everything by name."""
        while True:
            try:
                name = self._left.pop()
            except IndexError:
                if self._thread is None or not self._thread.is_alive():
                    if not self._left:
                        break
                    continue
                self._thread.join(0.1)
                drawn(len(self.results))
                continue
            self.results[name] = self.work(self.content, name)
            drawn(len(self.results))
        drawn(len(self.results))
        return self.results

    def end(self) -> None:
        """Stop the helper, whatever it does."""
        self._left.clear()
        if self._helper is not None:
            self._helper.kill()
            self._helper.join()


@contextmanager
def beside(painter: Painter[Content, Result]) -> Iterator[Painter[Content, Result]]:
    """Run the helper for the block, where there is a core for it; it never outlives the block."""
    try:
        if cores() > 1:
            painter.begin()
        yield painter
    finally:
        painter.end()


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


def _serve(
    leader: Connection, build: Callable[[list[Any]], Any], work: Callable[[Any, str], Any]
) -> None:
    """What the helper does until its leader is gone; that one hears Ctrl-C and ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    pieces: list[Any] = []
    content = None
    try:
        while True:
            kind, given = leader.recv()
            if kind == "piece":
                pieces.append(given)
                continue
            if content is None:
                content = build(pieces)
            try:
                answer = True, work(content, given)
            except Exception:
                answer = False, None
            leader.send(answer)
    except LOST:
        return
