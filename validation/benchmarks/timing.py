"""Interleaved repetitions: all candidates once, then all again, so that load strikes all alike."""

from __future__ import annotations

import gc
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Seconds:
    """By repetition: wall time, and processor time of all threads and child processes."""

    wall: list[float] = field(default_factory=list)
    work: list[float] = field(default_factory=list)

    def over(self, units: float) -> Seconds:
        """Divided by how many steps, positions or simulated seconds each run took."""
        return Seconds([s / units for s in self.wall], [s / units for s in self.work])


def processor_time() -> float:
    """Of this process and its finished children, s."""
    children = os.times()
    return time.process_time() + children.children_user + children.children_system


def interleaved(
    candidates: Mapping[str, Callable[[], Any]], repeats: int
) -> tuple[dict[str, Seconds], dict[str, Any]]:
    """Times of every candidate and what each returned last."""
    seconds = {name: Seconds() for name in candidates}
    answers: dict[str, Any] = {}
    for _ in range(repeats):
        for name, run in candidates.items():
            answers.pop(name, None)  # a large answer must not be held twice
            gc.collect()
            start, work = time.perf_counter(), processor_time()
            answers[name] = run()
            seconds[name].work.append(processor_time() - work)
            seconds[name].wall.append(time.perf_counter() - start)
    return seconds, answers
