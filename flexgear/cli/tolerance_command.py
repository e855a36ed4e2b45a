"""Tolerance study: load sharing of many sets of parts with random manufacturing errors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
import xarray as xr

from flexgear.cli.display import as_json_text, progress, table
from flexgear.cli.options import (
    AsJson,
    CaseName,
    Quiet,
    Scheduler,
    Settings,
    Workers,
    read_case,
)
from flexgear.cli.outputs import TOLERANCE, Force, OutFolder, claim_folder
from flexgear.files.atomic import staged_folder, write_json
from flexgear.model.errors import FlexgearError
from flexgear.results.origin import origin_of_case
from flexgear.results.tolerance_dataset import save_tolerance, tolerance_summary
from flexgear.studies.tolerance import finished, forget
from flexgear.studies.tolerance import tolerance as run_tolerance
from flexgear.views.style import save_figure
from flexgear.views.tolerance_charts import tolerance_chart


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(tolerance)


def tolerance(
    case: CaseName,
    samples: Annotated[
        int | None, typer.Option("--samples", min=2, help="Sets of parts; tolerance.samples.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, help="The same gives the same samples.")
    ] = None,
    settings: Settings = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    out: OutFolder = None,
    pictures: Annotated[bool, typer.Option(help="Draw a picture.")] = True,
    force: Force = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Monte Carlo study of manufacturing errors: distribution of K over one carrier turn."""
    given = {"tolerance.samples": samples, "tolerance.seed": seed}
    more = [f"{key}={value}" for key, value in given.items() if value is not None]
    model = read_case(case, [*(settings or []), *more])
    folder = Path("results") / f"tolerance-{model.name}" if out is None else out
    claim_folder(folder, TOLERANCE, origin_of_case(model, "tolerance"), force)
    try:
        with staged_folder(folder) as stage, progress(quiet) as report:
            data = run_tolerance(
                model, workers=workers, scheduler=scheduler, progress=report, keep_batches=True
            )
            summary = tolerance_summary(data)
            save_tolerance(data, stage / "tolerance.nc")
            write_json(stage / "summary.json", summary)
            if pictures:
                save_figure(tolerance_chart(data), stage / "tolerance.png", dpi=150)
    except KeyboardInterrupt:
        done = finished(model)
        if not done:
            raise
        raise FlexgearError(
            f"stopped with {done} of {model.tolerance.samples} samples done; the same command goes "
            "on from there"
        ) from None
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


def _print(data: xr.Dataset, summary: dict[str, Any]) -> None:
    percent = f"{100 * summary['confidence']:g} % interval"
    typer.echo(
        f"{summary['case']}, {summary['variant']}: {summary['samples']} samples, largest K over "
        f"one turn of the carrier ({percent})"
    )
    for group, figures in summary["load_sharing"].items():
        typer.echo("")
        rows = {"mean": _said(figures["mean"])}
        rows |= {f"{p} %": _said(found) for p, found in figures["quantiles"].items()}
        rows["errors as stated"] = _number(figures["as_stated"])
        if figures["iec_61400_4"] is not None:
            rows["IEC 61400-4"] = f"{figures['iec_61400_4']:g}, exceeded by {_said_share(figures)}"
        table(group.replace("_", " "), rows)


def _said(found: dict[str, float | None] | None) -> str:
    if found is None:
        return "–"
    return f"{_number(found['value'])}  ({_number(found['low'])} … {_number(found['high'])})"


def _said_share(figures: dict[str, Any]) -> str:
    found = figures["share_above_iec_61400_4"]
    if found is None:
        return "–"
    low, high = (100 * found[end] for end in ("low", "high"))
    return f"{100 * found['value']:.3g} % of samples  ({low:.3g} … {high:.3g} %)"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.4f}"
