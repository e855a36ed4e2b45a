"""Options of studies of one case on several processes, and the folder of their results."""

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
        """Arguments ``workers`` and ``scheduler`` of the functions of ``studies``."""
        return {"workers": self.workers, "scheduler": self.scheduler}

    @contextmanager
    def results(
        self, folder: Path, files: Sequence[str], origin: Origin
    ) -> Iterator[tuple[Path, Report]]:
        """Context with a temporary folder, whose files replace those of earlier results of the same
        case in ``folder`` (patterns ``files``), and a function that reports progress."""
        options.claim_folder(folder, files, origin, self.force)
        with (
            staged_folder(folder, options.earlier(files)) as stage,
            progress(self.quiet) as report,
        ):
            yield stage, report
