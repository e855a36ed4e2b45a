"""``flexgear spectrum``: load bins of a case as a table for ``[spectrum]``, and load duration."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from typer import Option

from flexgear.arrays import Array
from flexgear.cli import options
from flexgear.cli.display import as_json_text, columns, evenly_spaced, progress
from flexgear.files.atomic import write_bytes
from flexgear.files.load_files import table_of_bins
from flexgear.gears.load_bins import LoadBin
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.model.units import RPM
from flexgear.results.report.wording import scale
from flexgear.solve.load_series import EXPONENTS, SeriesBins, bins_of_series, bins_with_series
from flexgear.views import style
from flexgear.views.study_charts import load_duration_chart

MAX_ROWS = 24  # of printed bins


def spectrum(
    case: options.CaseName,
    out: Annotated[
        Path | None,
        options.file_option("Table for [spectrum] (CSV); a picture goes beside it."),
    ] = None,
    settings: options.Settings = None,
    force: Annotated[bool, Option("--force", help="Replace files that are there.")] = False,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Load bins of a case's load cases, table and series; how long each load lasts."""
    source = load_case(case, options.settings_of(settings))
    picture = None if out is None else out.with_suffix(".png")
    for path in filter(None, (out, picture)):
        if path.suffix.lower() not in (".csv", ".png"):
            raise InputError("--out", str(path), "does not end in .csv", "use this suffix")
        options.require_new(path, "--out", force)
    with progress(quiet) as report:
        series = bins_of_series(source, report)
    bins = bins_with_series(source, series)
    ports = [port.member for port in source.ports]
    if out is not None and picture is not None:
        write_bytes(out, table_of_bins(bins, ports).encode())
        style.save_figure(load_duration_chart(bins, ports[0], series), picture, dpi=150)
    if as_json:
        typer.echo(as_json_text(_plain(source, bins, series)))
        return
    _print(bins, ports[0])
    if series is not None:
        ratios = (f"{x:.4f} (exponent {p:.3g})" for p, x in _damage(series).items())
        typer.echo(
            f"\ndamage of the bins of series over that of their samples: {', '.join(ratios)}"
        )
        typer.echo(f"torque of series changes its sense {series.changes:.4g} times in the life")
    if out is not None:
        typer.echo(f"\nwrote {out} and {picture}")


def _damage(series: SeriesBins) -> dict[float, float]:
    """Damage of bins over that of the samples, by exponent of the load."""
    return {exponent: series.damage_of_bins(exponent) for exponent in EXPONENTS}


def _plain(case: Case, bins: tuple[LoadBin, ...], series: SeriesBins | None) -> dict[str, Any]:
    """Content of ``--json``: bins in SI units with durations in hours."""
    return {
        "case": {"name": case.name, "content_hash": case.content_hash()},
        "bins": [
            {
                "name": b.name, "hours": b.hours, "extreme": b.extreme, "source": b.source,
                "torque": dict(b.torque), "speed": dict(b.speed),
                "loads": {load.member: load.first.tolist() for load in b.loads},
            }
            for b in bins
        ],
        "damage_of_bins": {} if series is None else
        {f"{exponent:.3g}": ratio for exponent, ratio in _damage(series).items()},
        "changes_of_sense": None if series is None else series.changes,
    }  # fmt: skip


def _print(bins: tuple[LoadBin, ...], first: str) -> None:
    """Print a line for each bin, of many bins for some evenly spaced ones, and the sums."""
    typer.echo(f"speed, torque and load of {first}")
    lasting, extreme = [b for b in bins if not b.extreme], [b for b in bins if b.extreme]
    lines = evenly_spaced(len(lasting), MAX_ROWS)
    turns = sum(b.turns(b.speed[first]) for b in lasting)
    total = ("all", f"{sum(b.hours for b in lasting):.6g}", f"{turns:.6g}", "", "", "", "")
    printed = [*(lasting[k] for k in lines), *extreme]
    amounts = np.array([_amounts(b, first) for b in printed])
    units = zip(amounts.T, ("N m", "N", "N m"), strict=True)
    (torque, *_), (force, *_), (moment, *_) = scales = [scale(x, unit) for x, unit in units]
    amount = (f"torque, {torque}", f"force, {force}", f"moment, {moment}")
    head = ("bin", "hours", "turns", "speed, r/min", *amount)
    amounts *= [by for _, by in scales]
    rows = (_row(b, first, x) for b, x in zip(printed, amounts, strict=True))
    columns([head, *rows, total], "<>")
    if len(lines) < len(lasting):
        typer.echo(f"  {len(lines)} of {len(lasting)} bins with a duration; --out writes all")


def _amounts(load_bin: LoadBin, first: str) -> list[float]:
    """Torque, N m, force, N, and moment, N m, of a bin on a member."""
    load = sum((x.first for x in load_bin.loads if x.member == first), np.zeros(6))
    return [load_bin.torque[first], *(float(np.linalg.norm(x)) for x in (load[:3], load[3:]))]


def _row(load_bin: LoadBin, first: str, amounts: Array) -> tuple[str, ...]:
    """Cells of a bin; first: the member whose speed and amounts (3,) are shown."""
    speed = load_bin.speed[first]
    hours, turns = f"{load_bin.hours:.6g}", f"{load_bin.turns(speed):.6g}"
    time = ("–", "–") if load_bin.extreme else (hours, turns)
    torque, *load = amounts
    size = (f"{torque:.6g}", *(f"{x:.5g}" for x in load))
    return (load_bin.name, *time, f"{speed * RPM:.5g}", *size)
