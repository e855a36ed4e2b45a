"""Whole runs and ratings: every analysis of a case, its folder, and its report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flexgear.cli import options
from flexgear.cli.run_commands import draw_again, save_run
from flexgear.cli.study_commands import save_rating
from flexgear.face import accessor as accessor  # datasets have ``.fg`` from here on
from flexgear.face.notebook import Progress, progress_or_bars, verdict_table
from flexgear.files.atomic import staged_folder
from flexgear.model.case import Case
from flexgear.results import rating, run_folder
from flexgear.results.origin import origin_of_case
from flexgear.results.report.study_tables import rating_verdicts
from flexgear.solve import run
from flexgear.solve.headlines import verdicts
from flexgear.studies.rating import rate


@dataclass(frozen=True, repr=False, eq=False)
class Run(run_folder.Run):
    """Results of a run: case, power flow, datasets by file name, fields of bodies, summary."""

    def __repr__(self) -> str:
        return f"<flexgear run of {self.case.name}: {', '.join(self.datasets)}>"

    def _repr_html_(self) -> str:
        return verdict_table(verdicts(self.case, self.summary))


def run_case(case: Case, out: str | Path | None, force: bool, progress: Progress) -> Run:
    """All analyses of a case; the results are saved in the folder ``out`` unless it is None."""
    case.require_load()
    if out is None:
        return Run(**vars(run.run(case, progress)))
    folder = Path(out)
    options.claim_folder(folder, options.RUN, origin_of_case(case, "run"), force)
    with staged_folder(folder, options.earlier(options.RUN)) as stage:
        result = run.run(case, progress, folder=stage)
        options.save_or_rescue(lambda target: save_run(result, target, progress), stage)
    return read_run(folder)


@dataclass(frozen=True, repr=False, eq=False)
class Rating(rating.Rating):
    """Safety, damage and life of flanks, roots and bearings; ``dataset`` has all figures."""

    def _repr_html_(self) -> str:
        return verdict_table(rating_verdicts(self))


def rate_case(
    case: Case, out: str | Path | None, force: bool, workers: int | None, progress: Progress
) -> Rating:
    """The rating of a case; the results are saved in the folder ``out`` unless it is None."""
    case.require_load()
    if out is None:
        return Rating(**vars(rate(case, workers=workers, progress=progress)))
    folder = Path(out)
    options.claim_folder(folder, options.RATING, origin_of_case(case, "rating"), force)
    with staged_folder(folder, options.earlier(options.RATING)) as stage:
        rated = rate(case, workers=workers, progress=progress)
        options.save_or_rescue(lambda target: save_rating(rated, target), stage)
    return Rating(**vars(rated))


def read_run(folder: str | Path) -> Run:
    """The run that ``Case.run`` or ``flexgear run`` saved in a folder; InputError without one."""
    return Run(**vars(run_folder.read_folder(Path(folder))))


def report(
    folder: str | Path, *, interactive: bool = True, progress: Progress | None = None
) -> Path:
    """Draw the pictures and the page of a run into its folder; the path of the page.

    interactive: plots that zoom and bodies that turn, else static pictures. InputError for a folder
    without a finished run.
    """
    at = Path(folder)
    draw_again(run_folder.read_folder(at), at, at, interactive, progress_or_bars(progress))
    return at / "report.html"
