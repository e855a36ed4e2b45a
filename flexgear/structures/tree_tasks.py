"""Work on a tree of fronts, shared out among threads: subtrees, then the fronts above them.

Fronts stand in postorder, so that a subtree is a range. A task starts when all it waits for are
done; who runs it, and when, changes nothing in what it computes.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from threading import Condition

import numpy as np
from numpy.typing import NDArray

_PIECES = 8  # tasks a thread, at least: the last ones leave little to wait for


@dataclass(frozen=True, eq=False)
class TreeTasks:
    """Ranges of fronts in postorder, and the task above each (-1 for none)."""

    fronts: tuple[range, ...]
    parents: tuple[int, ...]

    def climb(self, run: Callable[[range], None], threads: int) -> None:
        """run(fronts) of every task after those below it."""
        needs: list[list[int]] = [[] for _ in self.fronts]
        for task, parent in enumerate(self.parents):
            if parent >= 0:
                needs[parent].append(task)
        _run(needs, lambda task: run(self.fronts[task]), threads)

    def descend(self, run: Callable[[range], None], threads: int) -> None:
        """run(fronts, last first) of every task after the one above it."""
        last = len(self.fronts) - 1
        needs = [[last - p] if p >= 0 else [] for p in reversed(self.parents)]
        _run(needs, lambda task: run(self.fronts[last - task][::-1]), threads)


def tree_tasks(parents: NDArray[np.int64], work: NDArray[np.float64], threads: int) -> TreeTasks:
    """Tasks of a tree: subtrees of little work each, and every front above them by itself."""
    count = len(parents)
    total, first = work.astype(float), np.arange(count)
    for k, parent in enumerate(parents):
        if parent >= 0:
            total[parent] += total[k]
            first[parent] = min(first[parent], first[k])
    little = total <= work.sum() / (_PIECES * threads) if threads > 1 else total >= 0.0
    task_of = np.full(count, -1)
    fronts: list[range] = []
    for k in range(count):
        parent = parents[k]
        if little[k] and parent >= 0 and little[parent]:
            continue  # goes with its parent
        begin = int(first[k]) if little[k] else k
        task_of[begin : k + 1] = len(fronts)
        fronts.append(range(begin, k + 1))
    above = [parents[f[-1]] for f in fronts]
    return TreeTasks(tuple(fronts), tuple(int(task_of[p]) if p >= 0 else -1 for p in above))


def _run(needs: Sequence[Sequence[int]], run: Callable[[int], None], threads: int) -> None:
    """run(t) for all t, each after those it needs; of what may start, the first does."""
    if threads == 1:
        for task in range(len(needs)):  # postorder
            run(task)
        return
    left = [len(n) for n in needs]
    then: list[list[int]] = [[] for _ in needs]
    for task, before in enumerate(needs):
        for other in before:
            then[other].append(task)
    ready = [task for task, count in enumerate(left) if not count]
    open_tasks = len(needs)
    failed: list[BaseException] = []
    changed = Condition()

    def next_task() -> int:
        """-1: nothing is left."""
        with changed:
            while not ready and open_tasks and not failed:
                changed.wait()
            return heapq.heappop(ready) if ready and not failed else -1

    def work() -> None:
        nonlocal open_tasks
        while (task := next_task()) >= 0:
            try:
                run(task)
            except BaseException as error:
                failed.append(error)
            with changed:
                open_tasks -= 1
                for other in then[task]:
                    left[other] -= 1
                    if not left[other]:
                        heapq.heappush(ready, other)
                changed.notify_all()

    with ThreadPoolExecutor(threads) as pool:
        for future in [pool.submit(work) for _ in range(threads)]:
            future.result()
    if failed:
        raise failed[0]
