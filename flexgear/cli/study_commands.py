"""Studies of one case with a page of their own: ratings under load cases, and tolerance studies."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr

from flexgear.cli import options
from flexgear.cli.display import as_json_text, progress, resumable, show_verdicts, table
from flexgear.files.atomic import staged_folder, write_json
from flexgear.model.case import Case
from flexgear.results.dataset_file import write_netcdf
from flexgear.results.origin import origin_of_case
from flexgear.results.rating import COLUMNS, Rating, rating_rows, rating_summary
from flexgear.results.report.study_tables import (
    TOLERANCE,
    in_words,
    rating_tables,
    rating_verdicts,
    spelled,
    tolerance_tables,
    tolerance_verdicts,
)
from flexgear.results.report.wording import number, with_unit, words
from flexgear.results.tolerance_dataset import tolerance_summary
from flexgear.studies import rating as ratings
from flexgear.studies import tolerance as tolerances
from flexgear.views.report import saved_picture, write_study
from flexgear.views.study_charts import rating_charts, tolerance_chart

PICTURES = {  # by their figures in the summary: name of the statistics, file
    "load_sharing": ("load_sharing", "tolerance"),
    "k_h_beta": ("k_h_beta", "face_load_factor"),
    "largest_line_load_n_per_mm": ("largest_line_load", "largest_line_load"),
}
SAMPLES_SENTENCE = "Sets of parts by what they got: left how many, right what share stays below."


def rate(
    case: options.CaseName,
    settings: options.Settings = None,
    workers: options.Workers = None,
    scheduler: options.Scheduler = None,
    out: options.OutFolder = None,
    pictures: Annotated[bool, typer.Option(help="Draw pictures and the report.")] = True,
    force: options.Force = False,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Safety, damage and life of gears and bearings under the load cases of a case."""
    model = options.read_case(case, settings)
    folder = Path("results") / f"rating-{model.name}" if out is None else out
    options.claim_folder(folder, options.RATING, origin_of_case(model, "rating"), force)
    with staged_folder(folder, options.earlier(options.RATING)) as stage, progress(quiet) as report:
        bins = ratings.bins_of(model, report)
        with resumable(lambda: ratings.finished(model), f"{len(bins)} load bins"):
            rating = ratings.rate(
                model,
                bins,
                workers=workers,
                scheduler=scheduler,
                progress=report,
                keep_bins=True,
            )
            save_rating(rating, stage, pictures)
    ratings.forget(model)
    if as_json:
        typer.echo(as_json_text(rating_summary(rating)))
        return
    _show_rating(rating)
    typer.echo(f"\nwrote {folder}")


def save_rating(rating: Rating, folder: Path, pictures: bool = True) -> None:
    """Figures, dataset, table and, with pictures, the page of a rating into a folder."""
    write_json(folder / "rating.json", rating_summary(rating))
    write_netcdf(rating.dataset(), folder / "rating.nc")
    with open(folder / "rating.csv", "w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        rows.writerows(rating_rows(rating))
    if pictures:
        verdicts = [replace(v, sentence=spelled(v.sentence)) for v in rating_verdicts(rating)]
        tables = list(map(in_words, rating_tables(rating)))
        drawn = [
            saved_picture(figure, folder, name, section, caption, spelled(sentence))
            for name, (section, caption, figure, sentence) in rating_charts(rating).items()
        ]
        write_study(folder, rating.case, "rating", spelled(_lead(rating)), drawn, verdicts, tables)


def _lead(rating: Rating) -> str:
    positions = ", ".join(
        f"{count} positions of {words(stage)}" for stage, count in rating.positions.items()
    )
    count = "1 load bin" if len(rating.bins) == 1 else f"{len(rating.bins)} load bins"
    where = positions or "one position"
    return f"{count}, {number(rating.hours)} h; in each equilibria at {where}."


def _show_rating(rating: Rating) -> None:
    """First screen, then tables; those of single parts are in the files."""
    typer.echo(f"{rating.case.name}: {_lead(rating)}")
    show_verdicts(rating_verdicts(rating))
    for each in rating_tables(rating, parts=False):
        typer.echo("")
        table(each.title, {row.label: with_unit(row.value, row.unit) for row in each.rows})
    typer.echo("\nEvery factor of every part is in rating.csv, by load bin, and in report.html.")


def tolerance(
    case: options.CaseName,
    samples: Annotated[
        int | None, typer.Option("--samples", min=2, help="Sets of parts; tolerance.samples.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, help="The same gives the same samples.")
    ] = None,
    settings: options.Settings = None,
    workers: options.Workers = None,
    scheduler: options.Scheduler = None,
    out: options.OutFolder = None,
    pictures: Annotated[bool, typer.Option(help="Draw a picture.")] = True,
    force: options.Force = False,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Monte Carlo study of manufacturing errors: distribution of K over one carrier turn."""
    study = {"tolerance.samples": samples, "tolerance.seed": seed}
    more = [f"{key}={value}" for key, value in study.items() if value is not None]
    model = options.read_case(case, [*(settings or []), *more])
    folder = Path("results") / f"tolerance-{model.name}" if out is None else out
    options.claim_folder(folder, options.TOLERANCE, origin_of_case(model, "tolerance"), force)
    with (
        resumable(lambda: tolerances.finished(model), f"{model.tolerance.samples} samples"),
        staged_folder(folder, options.earlier(options.TOLERANCE)) as stage,
        progress(quiet) as report,
    ):
        data = tolerances.tolerance(
            model, workers=workers, scheduler=scheduler, progress=report, keep_batches=True
        )
        summary = tolerance_summary(data)
        write_netcdf(data, stage / "tolerance.nc")
        write_json(stage / "summary.json", summary)
        _write_tolerance_page(model, data, summary, stage, pictures)
    tolerances.forget(model)
    if as_json:
        typer.echo(as_json_text(summary))
    else:
        _show_tolerance(summary)
        typer.echo(f"\nwrote {folder}")
    if summary["failed"]:
        typer.echo(
            f"flexgear: {summary['failed']} of {summary['samples']} samples have no equilibrium "
            "somewhere; they are left out",
            err=True,
        )


def _write_tolerance_page(
    case: Case, data: xr.Dataset, summary: dict[str, Any], folder: Path, pictures: bool
) -> None:
    """The study as a page, with histogram and distribution of every figure that it has."""
    drawn = [
        saved_picture(
            tolerance_chart(data, name), folder, file, TOLERANCE,
            file.replace("_", " ").capitalize(), SAMPLES_SENTENCE,
        )
        for figures, (name, file) in PICTURES.items()
        if pictures and figures in summary
    ]  # fmt: skip
    lead = f"{summary['samples']} sets of parts with random errors. Bodies: {summary['variant']}."
    verdicts = tolerance_verdicts(summary)
    tables = tolerance_tables(summary)
    write_study(folder, case, "tolerance study", lead, drawn, verdicts, tables)


def _show_tolerance(summary: dict[str, Any]) -> None:
    percent = f"{100 * summary['confidence']:g} % interval"
    typer.echo(
        f"{summary['case']}, {summary['variant']}: {summary['samples']} samples, largest K over "
        f"one turn of the carrier ({percent})"
    )
    for group, figures in summary["load_sharing"].items():
        typer.echo("")
        rows = _spread_rows(figures, 4)
        if figures["iec_61400_4"] is not None:
            rows["IEC 61400-4"] = f"{figures['iec_61400_4']:g}, exceeded by {_share_text(figures)}"
        table(group.replace("_", " "), rows)
    for name, text, digits in (
        ("k_h_beta", "largest face load factor K_Hbeta", 3),
        ("largest_line_load_n_per_mm", "largest line load (N/mm)", 0),
    ):
        for group, figures in summary.get(name, {}).items():
            typer.echo("")
            table(f"{group.replace('_', ' ')}: {text}", _spread_rows(figures, digits))


def _spread_rows(figures: dict[str, Any], digits: int) -> dict[str, str]:
    rows = {"mean": _interval_text(figures["mean"], digits)}
    rows |= {f"{p} %": _interval_text(value, digits) for p, value in figures["quantiles"].items()}
    return rows | {"errors as stated": _number(figures["as_stated"], digits)}


def _interval_text(interval: dict[str, float | None] | None, digits: int) -> str:
    if interval is None:
        return "–"
    low, high = (_number(interval[end], digits) for end in ("low", "high"))
    return f"{_number(interval['value'], digits)}  ({low} … {high})"


def _share_text(figures: dict[str, Any]) -> str:
    share = figures["share_above_iec_61400_4"]
    if share is None:
        return "–"
    low, high = (100 * share[end] for end in ("low", "high"))
    return f"{100 * share['value']:.3g} % of samples  ({low:.3g} … {high:.3g} %)"


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
