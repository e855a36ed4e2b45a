"""Commands ``flexgear rate``, under load cases, and ``flexgear tolerance``, with random errors."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Option

from flexgear.cli import options
from flexgear.cli.display import resumable, show, show_table, show_verdicts, warn
from flexgear.files.atomic import write_bytes, write_json
from flexgear.files.rexs.from_case import model_of_case
from flexgear.model.errors import InputError
from flexgear.results.dataset_file import write_netcdf
from flexgear.results.origin import origin_of_case
from flexgear.results.rating import Rating
from flexgear.results.rating_files import COLUMNS, rating_rows, rating_summary, rexs_results
from flexgear.results.report.study_tables import (
    TOLERANCE,
    in_words,
    rating_tables,
    rating_verdicts,
    spelled,
    tolerance_tables,
    tolerance_verdicts,
)
from flexgear.results.report.wording import number, words
from flexgear.results.tolerance_dataset import SPREADS, tolerance_summary
from flexgear.results.version import version
from flexgear.solve.result_warnings import beyond_all_planets, pulling_teeth
from flexgear.studies import rating as ratings
from flexgear.studies import tolerance as tolerances
from flexgear.views.report import saved_picture, write_study
from flexgear.views.study_charts import rating_charts, tolerance_chart

LEAST_CHANGE = 1e-4  # of load factors with half of the positions, that has a digit
SAMPLES_SENTENCE = "Distribution over sets of parts. Left: number; right: share up to a value."


def rate(study: options.Study) -> None:
    """Safety, damage and life of gears and bearings under the load cases of a case."""
    case = study.read_case()
    folder = study.out or Path("results") / f"rating-{case.name}"
    origin = origin_of_case(case, "rating")
    with study.results(folder, options.RATING, origin) as (stage, report):
        bins = ratings.bins_of(case, report)
        with resumable(lambda: ratings.finished(case), f"{len(bins)} load bins"):
            rating = ratings.rate(case, bins, **study.where, progress=report, keep_bins=True)
            save_rating(rating, stage, study.pictures)
    ratings.forget(case)
    show(rating_summary(rating), lambda: _show_rating(rating), study.as_json, folder)


def save_rating(rating: Rating, folder: Path, pictures: bool = True) -> None:
    """Write figures, dataset, table, REXS model and, with pictures, the page of a rating into a
    folder."""
    write_json(folder / "rating.json", rating_summary(rating))
    write_netcdf(rating.dataset(), folder / "rating.nc")
    with open(folder / "rating.csv", "w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        rows.writerows(rating_rows(rating))
    model = model_of_case(rating.case, rexs_results(rating))
    write_bytes(folder / "rating.rexs", model.xml(version()))
    if pictures:
        verdicts = [replace(v, sentence=spelled(v.sentence)) for v in rating_verdicts(rating)]
        tables = list(map(in_words, rating_tables(rating)))
        drawn = [
            saved_picture(figure, folder, name, section, caption, spelled(sentence))
            for name, (section, caption, figure, sentence) in rating_charts(rating).items()
        ]
        write_study(folder, rating.case, "rating", spelled(_lead(rating)), drawn, verdicts, tables)


def _lead(rating: Rating) -> str:
    """Sentence on the numbers of load bins, hours and positions."""
    positions = ", ".join(
        f"{count} positions of {words(stage)}" for stage, count in rating.positions.items()
    )
    count = "1 load bin" if len(rating.bins) == 1 else f"{len(rating.bins)} load bins"
    where = positions or "one position"
    hours = f", {number(rating.hours)} h" if rating.hours else ""
    rules = rating.case.rating
    worst = {"worst": 5, "drawn": rules.deviation_samples}
    trains = f" of {worst[rules.deviations]} trains" if rules.deviations in worst else ""
    halves = ""
    if positions:
        size, group, worst_bin = rating.halving
        change = f"{100.0 * size:.2g} % at most, of {words(group)} in {worst_bin}"
        change = change if size > LEAST_CHANGE else f"less than {100.0 * LEAST_CHANGE:g} %"
        halves = f"; half of them, or of gear-mesh cycles, changes K_γ K_Hβ by {change}"
    return f"{count}{hours}; in each equilibria{trains} at {where}{halves}."


def _show_rating(rating: Rating) -> None:
    """Print the verdicts and the tables, without those of single parts."""
    typer.echo(f"{rating.case.name}: {_lead(rating)}")
    show_verdicts(rating_verdicts(rating))
    for each in rating_tables(rating, parts=False):
        typer.echo("")
        show_table(each)
    typer.echo("\nEvery factor of every part is in rating.csv, by load bin, and in report.html.")


def tolerance(
    study: options.Study,
    samples: Annotated[int | None, Option(min=2, help="Sets of parts; tolerance.samples.")] = None,
    seed: Annotated[int | None, Option(min=0, help="A seed always gives the same samples.")] = None,
) -> None:
    """Monte Carlo study of manufacturing errors: distribution of K over one carrier turn."""
    keys = {"tolerance.samples": samples, "tolerance.seed": seed}
    more = [f"{key}={value}" for key, value in keys.items() if value is not None]
    case = options.read_case(study.case, [*(study.settings or []), *more])
    folder = study.out or Path("results") / f"tolerance-{case.name}"
    origin = origin_of_case(case, "tolerance")
    with (
        resumable(lambda: tolerances.finished(case), f"{case.tolerance.samples} samples"),
        study.results(folder, options.TOLERANCE, origin) as (stage, report),
    ):
        data = tolerances.tolerance(case, **study.where, progress=report, keep_batches=True)
        summary = tolerance_summary(data)
        if summary["failed"] == summary["samples"]:
            problem = "leave no set of parts with an equilibrium at every position"
            raise InputError(case.source, "tolerance.errors", problem, "draw smaller ones")
        write_netcdf(data, stage / "tolerance.nc")
        write_json(stage / "summary.json", summary)
        largest = data["load_sharing_max"].max("sample").to_series().to_dict()
        pulled = pulling_teeth(case, beyond_all_planets(case, largest))
        drawn = [
            saved_picture(
                tolerance_chart(data, name), stage, spread.file, TOLERANCE,
                spread.file.replace("_", " ").capitalize(), SAMPLES_SENTENCE,
            )
            for name, spread in SPREADS.items()
            if study.pictures and spread.key in summary
        ]  # fmt: skip
        lead = (
            f"{summary['samples']} sets of parts with random errors. Bodies: {summary['variant']}."
        )
        lead = " ".join([lead, *pulled])
        verdicts = tolerance_verdicts(summary)
        tables = tolerance_tables(summary)
        write_study(stage, case, "tolerance study", lead, drawn, verdicts, tables)
    tolerances.batch_store(case).clear()
    show(summary, lambda: _show_tolerance(summary), study.as_json, folder)
    warn(pulled)
    if summary["failed"]:
        count = f"{summary['failed']} of {summary['samples']} samples"
        warn([f"{count} have no equilibrium somewhere; they are left out"])


def _show_tolerance(summary: dict[str, Any]) -> None:
    """Print the verdicts, with the share of samples above the value of IEC 61400-4, and tables."""
    samples = (
        f"{summary['samples']} samples, largest K over one turn of the carrier against the ring"
    )
    typer.echo(f"{summary['case']}, {summary['variant']}: {samples}")
    show_verdicts(tolerance_verdicts(summary))
    for each in tolerance_tables(summary):
        typer.echo("")
        show_table(each)
