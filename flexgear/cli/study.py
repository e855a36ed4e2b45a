"""Options of a study of one case that takes processes, and the folder that it writes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from typer import Option

from flexgear.cli import options
from flexgear.cli.display import Report, progress
from flexgear.files.atomic import staged_folder
from flexgear.results.origin import Origin


@dataclass(frozen=True)
class Study(options.CaseOptions):
    """Options of a study."""

    workers: options.Workers = None
    scheduler: options.Scheduler = None
    out: options.OutFolder = None
    pictures: Annotated[bool, Option(help="Draw pictures, and the report if any.")] = True

    @property
    def where(self) -> dict[str, Any]:
        """Processes, or the cluster, as functions of ``studies`` take them."""
        return {"workers": self.workers, "scheduler": self.scheduler}

    @contextmanager
    def results(
        self, folder: Path, files: Sequence[str], origin: Origin
    ) -> Iterator[tuple[Path, Report]]:
        """Where ``files`` (patterns) of the folder are written, in the place of earlier ones of the
        same case, and what reports progress."""
        options.claim_folder(folder, files, origin, self.force)
        with (
            staged_folder(folder, options.earlier(files)) as stage,
            progress(self.quiet) as report,
        ):
            yield stage, report
