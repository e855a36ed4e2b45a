"""Tolerance study: load sharing of many sets of parts with random manufacturing errors."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr

from flexgear.cli import options
from flexgear.cli.display import as_json_text, progress, resumable, table
from flexgear.files.atomic import staged_folder, write_json
from flexgear.model.case import Case
from flexgear.results.dataset_file import write_netcdf
from flexgear.results.origin import origin_of_case
from flexgear.results.report.study_tables import TOLERANCE, tolerance_tables, tolerance_verdicts
from flexgear.results.report.tables import case_tables
from flexgear.results.tolerance_dataset import tolerance_summary
from flexgear.studies.tolerance import finished, forget
from flexgear.studies.tolerance import tolerance as run_tolerance
from flexgear.views.interactive import panels_of
from flexgear.views.report import Picture, Side, write_report
from flexgear.views.style import save_figure
from flexgear.views.tolerance_charts import tolerance_chart

PICTURES = {  # by their figures in the summary: name of the statistics, file
    "load_sharing": ("load_sharing", "tolerance.png"),
    "k_h_beta": ("k_h_beta", "face_load_factor.png"),
    "largest_line_load_n_per_mm": ("largest_line_load", "largest_line_load.png"),
}

SENTENCE = "Sets of parts by what they got: left how many, right what share stays below."


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
        resumable(lambda: finished(model), f"{model.tolerance.samples} samples"),
        staged_folder(folder, options.earlier(options.TOLERANCE)) as stage,
        progress(quiet) as report,
    ):
        data = run_tolerance(
            model, workers=workers, scheduler=scheduler, progress=report, keep_batches=True
        )
        summary = tolerance_summary(data)
        write_netcdf(data, stage / "tolerance.nc")
        write_json(stage / "summary.json", summary)
        drawn = list(_drawn(data, summary, stage)) if pictures else []
        _write_page(model, summary, drawn, stage)
    forget(model)
    if as_json:
        typer.echo(as_json_text(summary))
    else:
        _print(data, summary)
        typer.echo(f"\nwrote {folder}")
    if summary["failed"]:
        typer.echo(
            f"flexgear: {summary['failed']} of {summary['samples']} samples have no equilibrium "
            "somewhere; they are left out",
            err=True,
        )


def _drawn(data: xr.Dataset, summary: dict[str, Any], folder: Path) -> Iterator[Picture]:
    """Histogram and distribution of every figure that the study has."""
    for figures, (name, file) in PICTURES.items():
        if figures in summary:
            figure = tolerance_chart(data, name)
            path = save_figure(figure, folder / file, dpi=150)
            caption = path.stem.replace("_", " ").capitalize()
            yield Picture(path.stem, TOLERANCE, caption, SENTENCE, path, panels_of(figure))


def _write_page(case: Case, summary: dict[str, Any], drawn: list[Picture], folder: Path) -> None:
    """The study as a page of its own."""
    side = Side(
        name=case.title or case.name,
        lead=f"{summary['samples']} sets of parts with random errors. Bodies: "
        f"{summary['variant']}.",
        verdicts=tolerance_verdicts(summary),
        tables=[*tolerance_tables(summary), *case_tables(case)],
        pictures=drawn,
        version=summary["version"],
        content_hash=summary["content_hash"],
    )
    title = f"{case.name}: tolerance study"
    write_report(folder / "report.html", title, case.name, [side])


def _print(data: xr.Dataset, summary: dict[str, Any]) -> None:
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
