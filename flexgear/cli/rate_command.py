"""From load cases to safety, damage and life of gears and bearings."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from flexgear.cli import options
from flexgear.cli.display import as_json_text, progress, resumable, table
from flexgear.files.atomic import staged_folder, write_json
from flexgear.results.dataset_file import write_netcdf
from flexgear.results.origin import origin_of_case
from flexgear.results.rating import COLUMNS, Rating, rating_rows, rating_summary
from flexgear.results.report.parts import MARKS
from flexgear.results.report.study_tables import (
    GEARS,
    RATING,
    SPECTRUM,
    in_words,
    rating_tables,
    rating_verdicts,
    spelled,
)
from flexgear.results.report.tables import case_tables
from flexgear.results.report.wording import number, with_unit, words
from flexgear.results.version import version
from flexgear.studies.rating import bins_of, finished, forget
from flexgear.studies.rating import rate as rate_case
from flexgear.views.interactive import panels_of
from flexgear.views.load_duration import load_duration_chart
from flexgear.views.rating_charts import damage_chart, ring_safety_chart, safety_chart
from flexgear.views.report import Picture, Side, write_report
from flexgear.views.style import save_figure


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
        bins = bins_of(model, report)
        with resumable(lambda: finished(model), f"{len(bins)} load bins"):
            rating = rate_case(
                model,
                bins,
                workers=workers,
                scheduler=scheduler,
                progress=report,
                keep_bins=True,
            )
            save_rating(rating, stage, pictures)
    forget(model)
    if as_json:
        typer.echo(as_json_text(rating_summary(rating)))
        return
    _show(rating)
    typer.echo(f"\nwrote {folder}")


def save_rating(rating: Rating, folder: Path, pictures: bool = True) -> None:
    """Figures, dataset, table and, with pictures, the page of a rating into a folder."""
    write_json(folder / "rating.json", rating_summary(rating))
    write_netcdf(rating.dataset(), folder / "rating.nc")
    _write_csv(rating, folder / "rating.csv")
    if pictures:
        _write_page(rating, folder)


def _write_csv(rating: Rating, path: Path) -> None:
    with open(path, "w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS)
        rows.writerows(rating_rows(rating))


def _write_page(rating: Rating, folder: Path) -> None:
    """The rating as a page of its own."""
    case = rating.case
    side = Side(
        name=case.title or case.name,
        lead=spelled(_lead(rating)),
        verdicts=[replace(v, sentence=spelled(v.sentence)) for v in rating_verdicts(rating)],
        tables=[*map(in_words, rating_tables(rating)), *case_tables(case)],
        pictures=list(_drawn(rating, folder)),
        version=version(),
        content_hash=case.content_hash(),
    )
    write_report(folder / "report.html", f"{case.name}: rating", case.name, [side])


def _lead(rating: Rating) -> str:
    positions = ", ".join(f"{count} of {stage}" for stage, count in rating.positions.items())
    count = "1 load bin" if len(rating.bins) == 1 else f"{len(rating.bins)} load bins"
    where = positions or "one position"
    return f"{count}, {number(rating.hours)} h; in each equilibria at {where}."


def _drawn(rating: Rating, folder: Path) -> Iterator[Picture]:
    data, first = rating.dataset(), rating.case.inputs[0].member
    figures = {
        "reserves": (RATING, "Load that parts bear", safety_chart(data),
                     "Factor on all loads within the limits; below one the part fails them."),
        "damage": (RATING, "Damage by bin", damage_chart(data),
                   "Share of the life that each bin takes, of the most damaged of each stage."),
    }  # fmt: skip
    if data.sizes["ring_tooth"]:
        figures["ring"] = (
            RATING, "Safety of the ring's teeth", ring_safety_chart(data),
            "Computed stresses against the norm's life curves, beyond ISO 6336, tooth by tooth; "
            "what a load that stands does to a sector of a standing ring, it does for ever.",
        )  # fmt: skip
    if any(b.hours and b.speed[first] for b in rating.bins):
        figures["duration"] = (
            SPECTRUM, "Load duration", load_duration_chart(rating.bins, first),
            f"For how many turns of {words(first)} each torque lasts, by load bins.",
        )  # fmt: skip
    for name, (section, caption, figure, sentence) in figures.items():
        path = save_figure(figure, folder / f"{name}.png", dpi=150)
        yield Picture(path.stem, section, caption, spelled(sentence), path, panels_of(figure))


def _show(rating: Rating) -> None:
    """First screen, then tables; those of single parts are in the files."""
    typer.echo(f"{rating.case.name}: {_lead(rating)}")
    verdicts = rating_verdicts(rating)
    width = max(len(v.subject) for v in verdicts)
    for verdict in verdicts:
        mark = f"  [{MARKS[verdict.level]}]" if verdict.level != "note" else ""
        typer.echo(f"  {verdict.subject:<{width}}  {verdict.figure}{mark}")
        typer.echo(f"  {'':<{width}}    {verdict.sentence}")
    for each in rating_tables(rating):
        if " load factors in " in f" {each.title} " or each.section not in (GEARS, "bearings"):
            typer.echo("")
            table(each.title, {row.label: with_unit(row.value, row.unit) for row in each.rows})
    typer.echo("\nEvery factor of every part is in rating.csv, by load bin, and in report.html.")
