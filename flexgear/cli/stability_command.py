"""Parametric instability over speed: bands of speed in which vibration grows by itself."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr

from flexgear.cli import options
from flexgear.cli.analysis_commands import put_together
from flexgear.cli.analysis_views import Output
from flexgear.cli.display import as_json_text, columns, progress
from flexgear.results.origin import origin_of_case
from flexgear.results.report.wording import with_unit, words
from flexgear.solve.stability import SPEEDS
from flexgear.solve.stability import stability as over_speed
from flexgear.views.stability_chart import bands_of, stability_chart
from flexgear.views.style import save_figure

COLUMNS = ("stage", "speeds over rated", "fastest at", "growth", "what meets")


def stability(
    case: options.CaseName,
    speeds: Annotated[
        tuple[float, float] | None,
        typer.Option("--speed-range", metavar="LOW HIGH", help="Over rated speed, e.g. 0.2 1.5."),
    ] = None,
    count: Annotated[
        int, typer.Option("--count", min=3, help="Speeds, to which expected bands add some.")
    ] = SPEEDS,
    limit_hz: Annotated[
        float | None,
        typer.Option("--limit-hz", help="Highest natural frequency of modes that are kept."),
    ] = None,
    out: options.OutFile = None,
    force: options.Force = False,
    rigid: options.Rigid = None,
    settings: options.Settings = None,
    as_json: options.AsJson = False,
    quiet: options.Quiet = False,
) -> None:
    """Parametric instability: speeds at which varying gear-mesh stiffness lets vibration grow."""
    source = options.read_case(case, settings)
    parts, output = options.rigid_parts(rigid, source), Output(as_json, out)
    output.claim(origin_of_case(source), force)
    with progress(quiet) as report:
        model = put_together(source, parts, report)
        data = over_speed(model, speeds, count=count, limit_hz=limit_hz, progress=report)
    output.keep(data)
    if output.picture is not None:
        save_figure(stability_chart(data), output.picture, dpi=150)
    if as_json:
        typer.echo(as_json_text({"bands": _plain(data)}))
    else:
        _print(model.case.name, data)
    output.wrote()


def _plain(data: xr.Dataset) -> list[dict[str, Any]]:
    """Bands of all stages as plain rows, for programs."""
    return [
        {
            "stage": stage,
            "lower_factor": band["lower_factor"],
            "upper_factor": band["upper_factor"],
            "peak_factor": band["peak_factor"],
            "growth_rate_per_s": band["growth_rate"],
            "modes": list(band["modes"]),
            "order": band["order"],
        }
        for stage in map(str, data["turning_stage"].to_numpy())
        for band in bands_of(data, stage)
    ]


def _print(name: str, data: xr.Dataset) -> None:
    """A line a band, and what was looked at."""
    factor, frequency = (data[n].to_numpy() for n in ("speed_factor", "kept_frequency"))
    typer.echo(
        f"{name}: parametric instability from {factor[0]:.4g} to {factor[-1]:.4g} times rated "
        f"speed, {len(frequency)} modes up to {with_unit(float(frequency[-1]), 'Hz')}"
    )
    of_mode = dict(zip(data["kept_mode"].values.tolist(), frequency.tolist(), strict=True))
    rows = [
        (
            words(band["stage"]),
            f"{band['lower_factor']:.5g} to {band['upper_factor']:.5g}",
            f"{band['peak_factor']:.4g}",
            with_unit(band["growth_rate_per_s"], "1/s"),
            _meets(band["modes"], band["order"], of_mode),
        )
        for band in _plain(data)
    ]
    if rows:
        typer.echo("")
        columns([COLUMNS, *rows])
    else:
        typer.echo("\nno vibration grows: damping is enough, or no stiffness varies")
    running = [float(f) for f in np.atleast_1d(data.attrs["operating_factors"])]
    inside = [
        f"{speed:g}"
        for speed in running
        if any(b["lower_factor"] <= speed <= b["upper_factor"] for b in _plain(data))
    ]
    if inside:
        typer.echo(f"\nthe case runs inside a band at {', '.join(inside)} times rated speed")


def _meets(modes: list[int], order: int, frequency: dict[int, float]) -> str:
    """ "2 × mode 3 (1234 Hz) at order 1"."""
    i, j = modes
    if i == j:
        return f"2 x mode {i} ({with_unit(frequency[i], 'Hz')}), order {order}"
    both = " + ".join(f"mode {m} ({with_unit(frequency[m], 'Hz')})" for m in modes)
    return f"{both}, order {order}"
