"""Notebook output: progress bars of analyses, and HTML tables of objects."""

import inspect
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from html import escape
from typing import Any, TypeVar, cast

from flexgear.results.report.parts import MARKS, Verdict
from flexgear.structures.reduced import silent

Progress = Callable[[str, float], None]  # stage of the work, share of it that is done
F = TypeVar("F", bound=Callable[..., Any])
INTERVAL = 0.2  # s between updates of a bar


def progress_or_bars(progress: Progress | None) -> Progress:
    """The caller's progress function; without one bars in a notebook, nothing elsewhere."""
    if progress is not None:
        return progress
    return NotebookBars() if _in_notebook() else silent


def with_bars(function: F) -> F:
    """A function whose ``progress`` is ``progress_or_bars`` of the argument."""

    @wraps(function)
    def called(*args: Any, progress: Progress | None = None, **kwargs: Any) -> Any:
        return function(*args, progress=progress_or_bars(progress), **kwargs)

    signature = inspect.signature(function)
    default = signature.parameters["progress"].replace(default=None, annotation="Progress | None")
    parameters = {**signature.parameters, "progress": default}.values()
    called.__signature__ = signature.replace(parameters=[*parameters])  # type: ignore[attr-defined]
    return cast(F, called)


def _in_notebook() -> bool:
    """Whether the code runs in a Jupyter kernel, which shows HTML."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return getattr(shell, "kernel", None) is not None


def html_table(facts: Mapping[str, str]) -> str:
    """An HTML table of names and values."""
    return _table(facts.items())


def verdict_table(verdicts: Iterable[Verdict]) -> str:
    """An HTML table of verdicts: subject, figure or, without one, sentence, and level in words."""
    return _table((v.subject, v.figure or v.sentence, MARKS[v.level]) for v in verdicts)


def _table(rows: Iterable[tuple[str, ...]]) -> str:
    lines = []
    for first, *more in rows:
        cells = "".join(f"<td>{escape(cell)}</td>" for cell in more)
        lines.append(f"<tr><th>{escape(first)}</th>{cells}</tr>")
    return f"<table>{''.join(lines)}</table>"


class NotebookBars:
    """Progress bars below the cell, one for each stage of the work until it is done."""

    def __init__(self) -> None:
        self._shares: dict[str, float] = {}
        self._drawn = 0.0
        self._handle: Any = None
        self._lock = threading.Lock()

    def __call__(self, stage: str, share: float) -> None:
        """Show that ``share`` of a stage is done."""
        with self._lock:
            self._shares[stage] = share
            now, finished = time.monotonic(), share >= 1.0
            if finished or now - self._drawn >= INTERVAL:
                self._drawn = now
                self._draw()

    def _draw(self) -> None:
        from IPython.display import HTML, display  # type: ignore[import-not-found]

        running = {stage: share for stage, share in self._shares.items() if share < 1.0}
        rows = (
            f"<div><progress value='{share:.3f}' max='1'></progress> {escape(stage)}</div>"
            for stage, share in running.items()
        )
        page = HTML("".join(rows))
        if self._handle is None:
            self._handle = display(page, display_id=True)
        else:
            self._handle.update(page)
