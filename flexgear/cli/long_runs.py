"""A run whose samples go to a file as they come: what is kept, and what is said before."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

from flexgear.cli.display import size_text
from flexgear.model.errors import InputError
from flexgear.results.dataset_file import chosen, dataset_file
from flexgear.results.result_quantities import RESULT_QUANTITIES
from flexgear.results.sinks import Coming, DatasetSink

Save = Annotated[
    list[str] | None,
    typer.Option(
        "--save", metavar="NAME", help="Variable to write to --out; repeatable. All if left out."
    ),
]
Say = Callable[[str], None]


def saved_names(save: Sequence[str] | None, out: Path | None) -> list[str]:
    """Names of ``--save``; InputError for one that no run has, and where nothing is written."""
    names = [n.strip() for text in save or [] for n in text.split(",") if n.strip()]
    if names and out is None:
        raise InputError("--save", names[0], "has no file to go to", "add --out FILE")
    for name in names:
        if name not in RESULT_QUANTITIES:
            raise InputError("--save", name, "is not a variable", "e.g. gear_mesh_force")
    return names


@contextlib.contextmanager
def run_sinks(out: Path | None, names: Sequence[str], quiet: bool) -> Iterator[list[DatasetSink]]:
    """Sinks that say what is coming and write it to ``out``, which is there when the block ends."""
    watchers: list[DatasetSink] = [] if quiet else [Forecast(out, names)]
    if out is None:
        yield watchers
        return
    with dataset_file(out, names) as file:
        yield [*watchers, file]


class Forecast:
    """A sink that says how much is coming, on stderr, and keeps nothing."""

    def __init__(self, out: Path | None, names: Sequence[str]) -> None:
        self._out, self._names = out, names

    def begin(self, coming: Coming) -> None:
        """Say it."""
        typer.echo(f"transient: {self._size_text(coming)}", err=True)

    def append(self, data: object) -> None:
        """It was said before."""

    def finish(self, last: object) -> None:
        """It was said before."""

    def _size_text(self, coming: Coming) -> str:
        parts = [f"{coming.samples} samples"]
        if self._out is not None:
            written = Coming(chosen(coming.pattern, self._names), coming.samples)
            parts.append(f"{size_text(written.size)} in {self._out} before compression")
        return ", ".join(parts)
