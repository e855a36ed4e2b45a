"""Output of commands: progress on stderr, tables or JSON on stdout."""

import json
import math
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import typer

from flexgear.files.atomic import plain
from flexgear.model.errors import FlexgearError
from flexgear.results.report.parts import MARKS, Table, Verdict, titled
from flexgear.results.report.wording import with_unit, words

Report = Callable[[str, float], None]
MAX_FIGURES = 6  # of a name, in a line of a table
COMPILED = "loops are compiled, once for this kind of case: up to a minute"
PLAIN_INTERVAL = 3.0  # s between lines about one stage of the work
LEAST_SHARE = 0.005  # finished share below which the time that is left is not known


@contextmanager
def progress(quiet: bool = False) -> Iterator[Report]:
    """Context with a function report(stage, share), share 0 … 1, that shows progress: by bars on a
    terminal, else by single lines."""
    if quiet:
        yield lambda stage, share: None
    elif sys.stderr.isatty():
        with _bars() as report, _compilation(report, report):
            yield report
    else:
        plain_lines = PlainProgress()
        with _compilation(plain_lines, lambda stage, share: None), plain_lines.never_silent():
            yield plain_lines


@contextmanager
def _compilation(begun: Report, after: Report) -> Iterator[None]:
    """Context that reports the compilation of loops: its begin by ``begun``, the rest by ``after``.

    It takes up to a minute in the first command with a case of such laws, and no time afterwards.
    """
    if "numba" not in sys.modules:
        yield
        return
    from numba.core import event

    class Compilation(event.Listener):
        def __init__(self) -> None:
            self.report, self.depth = begun, 0

        def on_start(self, event: Any) -> None:
            self.depth += 1
            self.report(COMPILED, 0.0)
            self.report = after

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            self.report(COMPILED, 0.0 if self.depth else 1.0)

    with event.install_listener("numba:compile", Compilation()):
        yield


@contextmanager
def _bars() -> Iterator[Report]:
    """Context with a function that shows progress by bars on the terminal."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        Task,
        TaskID,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class Remaining(TimeRemainingColumn):
        def render(self, task: Task) -> Text:
            return super().render(task) if task.completed >= LEAST_SHARE else Text("-:--:--")

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), Remaining())
    with Progress(*columns, console=Console(stderr=True)) as bars:
        tasks: dict[str, TaskID] = {}
        lock = threading.Lock()

        def report(stage: str, share: float) -> None:
            with lock:
                if stage not in tasks:
                    tasks[stage] = bars.add_task(stage, total=1.0)
            bars.update(tasks[stage], completed=min(share, 1.0))

        yield report


class PlainProgress:
    """Shows progress by lines: when a stage of the work starts, every few seconds, at its end."""

    def __init__(self) -> None:
        self._latest = ""
        self._started: dict[str, float] = {}
        self._shown: dict[str, float] = {}
        self._done: set[str] = set()
        self._repeated: set[str] = set()
        self._lock = threading.Lock()

    def __call__(self, stage: str, share: float) -> None:
        """Report the finished share of a stage of the work."""
        now = time.monotonic()
        with self._lock:
            self._latest = self._latest if stage == COMPILED else stage
            if stage not in self._started:
                self._started[stage] = self._shown[stage] = now
                if share < 1.0:
                    self._print(stage)
                    return
            if stage in self._done:
                if share > 0.0:
                    return
                self._done.remove(stage)  # again, as with more modes: shown only if it takes long
                self._started[stage] = self._shown[stage] = now
                self._repeated.add(stage)
            if share >= 1.0:
                self._done.add(stage)
                took = now - self._started[stage]
                if took >= PLAIN_INTERVAL or stage not in self._repeated:
                    self._print(f"{stage}: done in {took:.1f} s")
            elif share > 0.0 and now - self._shown[stage] >= PLAIN_INTERVAL:
                self._shown[stage] = now
                left = time_text((now - self._started[stage]) * (1.0 - share) / share)
                remaining = f", about {left} left" if share >= LEAST_SHARE else ""
                self._print(f"{stage}: {100 * share:.0f} %{remaining}")

    @contextmanager
    def never_silent(self) -> Iterator[None]:
        """Context in which a thread prints how long a stage of the work lasts without reports."""
        end = threading.Event()

        def watch() -> None:
            while not end.wait(0.1 * PLAIN_INTERVAL):
                now, stage = time.monotonic(), self._latest
                with self._lock:
                    is_open = stage in self._started and stage not in self._done
                    if is_open and now - max(self._shown.values()) >= PLAIN_INTERVAL:
                        self._shown[stage] = now
                        self._print(f"{stage}: {time_text(now - self._started[stage])} so far")

        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        try:
            yield
        finally:
            end.set()
            thread.join()

    @staticmethod
    def _print(line: str) -> None:
        print(line, file=sys.stderr, flush=True)


@contextmanager
def resumable(finished: Callable[[], int], parts: str) -> Iterator[None]:
    """Context in which Ctrl-C raises FlexgearError with the number of stored parts of a study, if
    there are any; parts: number of all parts, in words."""
    try:
        yield
    except KeyboardInterrupt:
        done = finished()
        if not done:
            raise
        problem = f"stopped with {done} of {parts} done; the same command goes on from there"
        raise FlexgearError(problem) from None


def warn(lines: Iterable[str]) -> None:
    """Print warnings to stderr, one line each."""
    for line in lines:
        typer.echo(f"flexgear: {line}", err=True)


def table(title: str, rows: Mapping[str, Any], indent: str = "") -> None:
    """Print labels and values in two columns under a heading."""
    typer.echo(indent + title)
    width = max((len(name) for name in rows), default=0)
    for name, value in rows.items():
        typer.echo(f"{indent}  {name:<{width}}  {value_text(value)}")


def show_table(rows: Table) -> None:
    """Print a table of a report, its figures with units."""
    table(rows.heading, {row.label: with_unit(row.value, row.unit) for row in rows.rows})


def show_verdicts(verdicts: Sequence[Verdict]) -> None:
    """Print a line for the figure of each verdict, with a mark if it needs attention, and a line
    for its sentence."""
    width = max(len(v.subject) for v in verdicts)
    for verdict in verdicts:
        first, *rest = filter(None, (verdict.figure, verdict.sentence))
        mark = f"  [{MARKS[verdict.level]}]" if verdict.level != "note" else ""
        typer.echo(f"  {verdict.subject:<{width}}  {first}{mark}")
        for text in rest:
            typer.echo(f"  {'':<{width}}    {text}")


def columns(rows: Iterable[Sequence[str]], sides: str = "<") -> None:
    """Print rows of cells in aligned columns; sides: alignment of each column, "<" left or ">"
    right, the last for all further columns."""
    cells = [list(row) for row in rows]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    sides = sides.ljust(len(widths), sides[-1])
    for row in cells:
        texts = (f"{c:{side}{w}}" for c, side, w in zip(row, sides, widths, strict=True))
        typer.echo(f"  {'  '.join(texts)}".rstrip())


def evenly_spaced(count: int, limit: int) -> list[int]:
    """Indices of at most ``limit`` of ``count`` rows, evenly spaced and with both ends."""
    return np.unique(np.linspace(0, count - 1, min(count, limit)).astype(int)).tolist()


def key_table(key: str, figures: Mapping[str, Any], indent: str = "") -> None:
    """Print the section ``key`` of figures, with words and units in place of keys."""
    table(*titled(key, by_figure(figures)), indent)


def as_json_text(figures: Any) -> str:
    """Figures as JSON, with null for NaN and infinity."""
    return json.dumps(without_nan(plain(figures)), indent=2, ensure_ascii=False, allow_nan=False)


def show(
    figures: Any, words: Callable[[], None], as_json: bool, written: Path | None = None
) -> None:
    """Print figures as JSON, or by the function ``words`` with the path of written results."""
    if as_json:
        typer.echo(as_json_text(figures))
        return
    words()
    if written is not None:
        typer.echo(f"\nwrote {written}")


def without_nan(value: Any) -> Any:
    """The value with None for every number that is infinite or not a number."""
    if isinstance(value, dict):
        return {k: without_nan(v) for k, v in value.items()}
    if isinstance(value, list):
        return [without_nan(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def value_text(value: Any) -> str:
    """A number with six digits, a list in one line, a dash for a missing value."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return ", ".join(value_text(v) for v in value)
    if isinstance(value, Mapping):
        return ", ".join(f"{k}: {value_text(v)}" for k, v in value.items())
    return str(value)


def time_text(seconds: float) -> str:
    """A duration in a suitable unit, to two digits: "3.5 min"."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            number = seconds / size
            return f"{number:.2g} {unit}" if number < 99.5 else f"{number:.0f} {unit}"
    return f"{max(seconds, 1.0):.0f} s"


def present(title: str, sections: Mapping[str, Mapping[str, Any]], as_json: bool = False) -> None:
    """Print sections of figures as tables, without empty ones, or all as JSON."""
    if as_json:
        typer.echo(as_json_text(sections))
        return
    typer.echo(title)
    for name, rows in sections.items():
        if rows:
            typer.echo("")
            key_table(name, rows)


def by_figure(rows: Mapping[str, Any]) -> Mapping[str, Any]:
    """A table with many figures for each name, transposed: names in the first row, one figure of
    all names in each other row. Other tables are returned unchanged."""
    flat = {name: flattened(row) for name, row in rows.items() if isinstance(row, Mapping)}
    if not flat or len(flat) < len(rows) or min(map(len, flat.values())) <= MAX_FIGURES:
        return rows
    figures = dict.fromkeys(key for row in flat.values() for key in row)
    by_key = {key: [row.get(key) for row in flat.values()] for key in figures}
    return {"of": [words(name) for name in rows], **by_key}


def flattened(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Nested figures in one level, by key "outer, inner"."""
    out: dict[str, Any] = {}
    for key, value in figures.items():
        if isinstance(value, Mapping):
            out |= {f"{key}, {inner}": inner_value for inner, inner_value in value.items()}
        else:
            out[key] = value
    return out
