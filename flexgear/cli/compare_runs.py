"""Two finished runs in one report, side by side."""

from __future__ import annotations

import tempfile
from pathlib import Path

import typer

from flexgear.cli.display import progress
from flexgear.cli.outputs import claim_file
from flexgear.cli.pictures import Sheet, drawn_side, imported
from flexgear.model.errors import InputError
from flexgear.results.origin import Origin
from flexgear.results.run_folder import Folder, complete, read_folder
from flexgear.studies.early_workers import EarlyWorkers
from flexgear.views.report import Side, write_report

PAGE = Path("comparison.html")


def compare_runs(
    first: str, second: str, out: Path | None, interactive: bool, force: bool, quiet: bool
) -> None:
    """Write the report of two folders of runs and say where it is."""
    folders = [_folder(name) for name in (first, second)]
    runs = [read_folder(folder) for folder in folders]
    target = PAGE if out is None else out
    if target.suffix != ".html":
        raise InputError("--out", str(target), "is no page", "name a file that ends in .html")
    names = " against ".join(run.case.name for run in runs)
    claim_file(target, Origin(names), force)
    with (
        EarlyWorkers(True, imported) as workers,
        tempfile.TemporaryDirectory(prefix="flexgear-") as place,
    ):
        sides = [
            _side(run, Sheet(folder, Path(place) / str(k)), workers, quiet)
            for k, (run, folder) in enumerate(zip(runs, folders, strict=True))
        ]
        write_report(target, names, names, sides, interactive)
    typer.echo(f"compared {first} (A) with {second} (B) in {target}")


def _folder(name: str) -> Path:
    """The folder of a run; InputError where it is none."""
    if not Path(name).is_dir():
        problem = "is no folder of a run"
        remedy = "name two folders that `flexgear run` wrote, or a case alone"
        raise InputError("compare", name, problem, remedy)
    return Path(name)


def _side(content: Folder, sheet: Sheet, workers: EarlyWorkers, quiet: bool) -> Side:
    """One run's side of the page."""
    with complete(sheet.source), progress(quiet) as report:
        return drawn_side(content, sheet, report, workers)[0]
