"""What becomes of one of many independent runs: its result, or one line that says why not."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

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
