"""``flexgear orders``: spectra over the turn of a member, run-up maps, averages over turns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr
from scipy.signal import find_peaks

from flexgear.cli import options
from flexgear.cli.display import as_json_text, progress, show, table
from flexgear.files.atomic import staged_folder
from flexgear.gears.expected_lines import HARMONICS, TOOTH_FAULT, ExpectedLine
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.units import RPM
from flexgear.results.dataset_file import reopened, write_netcdf
from flexgear.results.orders import PADDING, SOURCE, order_map, order_spectrum, side_lobes
from flexgear.results.origin import origin_of_case
from flexgear.results.report.wording import number, scale, words
from flexgear.results.run_folder import complete
from flexgear.results.run_orders import (
    case_of,
    expected_orders,
    first_input,
    history_over_turns,
    over_time,
    warn_of_aliases,
)
from flexgear.results.settling import settled
from flexgear.results.sinks import between
from flexgear.results.synchronous_average import planet_averages, synchronous_average

FILES = ("orders.nc", "orders.png", "report.html")
TRANSIENT = "transient.nc"
USUAL = "gear_mesh_force"
MOST_CURVES, LINES = 12, 12  # in a picture; strongest that are printed
CANDIDATES, ABOVE = 400, 1.5  # peaks, and how far lines stand above the lobes of higher ones
RESOLVED = 2.0  # lines of the transform between neighbours that Hann's window tells apart
MULTIPLE = 0.25  # of a line of the transform: how near multiples of a fault's line are to a peak
APART = 10.0  # lines between multiples: a peak then meets one by chance in one of 20 cases


@dataclass(frozen=True)
class OrderAnalysis:
    """Options: the history and its samples, over whose turn, what is made of it, and where that
    goes."""

    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="A transient (.nc), or the folder of a run.")
    ]
    of: Annotated[str, typer.Option("--of", metavar="NAME", help="Variable over time.")] = USUAL
    only: Annotated[
        str, typer.Option("--only", metavar="LABEL", help="Columns whose labels contain this.")
    ] = ""
    member: Annotated[
        str, typer.Option("--member", help="Orders of its rotation; the first input if left out.")
    ] = ""
    against: Annotated[
        str, typer.Option("--against", metavar="MEMBER", help="Rotation relative to this member.")
    ] = ""
    highest: Annotated[
        float | None, typer.Option("--highest", help="Highest order; all that samples allow.")
    ] = None
    block_turns: Annotated[
        float | None,
        typer.Option("--map", metavar="TURNS", help="Orders over speed, in blocks of so many."),
    ] = None
    average: Annotated[bool, typer.Option("--average", help="Mean over turns.")] = False
    planets: Annotated[
        str, typer.Option("--planets", metavar="STAGE", help="Mean over turns, planet by planet.")
    ] = ""
    sensor_angle_deg: Annotated[
        float, typer.Option("--sensor-angle-deg", help="Where planets pass the sensor.")
    ] = 0.0
    envelope_hz: Annotated[
        tuple[float, float] | None,
        typer.Option("--envelope-hz", metavar="LOW HIGH", help="Envelope of this band."),
    ] = None
    window: Annotated[str, typer.Option("--window", help="Of scipy.signal.windows.")] = "hann"
    from_s: Annotated[
        float | None, typer.Option("--from-s", help="The settled part if left out; all of a map.")
    ] = None
    to_s: Annotated[float | None, typer.Option("--to-s", help="The end if left out.")] = None
    out: options.OutFolder = None
    force: options.Force = False
    as_json: options.AsJson = False
    quiet: options.Quiet = False

    def part(self, data: xr.Dataset) -> xr.Dataset:
        """The history and the rotation of the inputs, over the samples that are looked at: named
        ones, or settled ones, or all of a map."""
        history = over_time(data, self.of)
        if self.from_s is None and self.to_s is None:
            part = history if self.block_turns is not None else settled(history)
        else:
            start = self.from_s or 0.0
            part = between(history, start, self.to_s)
            if part.sizes["time"] < 16:
                end = float(history.variables["time"][-1])
                stop = end if self.to_s is None else self.to_s
                raise InputError(
                    SOURCE, f"{start:g} to {stop:g} s", "holds no samples",
                    f"the transient ends at {end:.4g} s",
                )  # fmt: skip
        return part.assign({self.of: columns_of(part[self.of], self.only)})

    def result(self, part: xr.Dataset) -> xr.DataArray:
        """Amplitudes by order, (block,) order and column, or means over a turn."""
        if self.planets:
            angle = np.radians(self.sensor_angle_deg)
            return planet_averages(part, self.of, self.planets, sensor_angle=angle)
        history = history_over_turns(
            part, self.of, self.member, self.against,
            highest=self.highest, band_hz=self.envelope_hz,
        )  # fmt: skip
        if self.average:
            return synchronous_average(history)
        if self.block_turns is not None:
            return order_map(history, self.block_turns, self.window)
        return order_spectrum(history, self.window)


def orders(analysis: OrderAnalysis) -> None:
    """Order analysis of a transient: spectrum over the turn of a member, whatever its speed does,
    lines that are expected there, run-up maps, envelopes and averages over turns."""
    data, out = _opened(analysis.file), analysis.out
    with complete(analysis.file):
        case, against = case_of(data), analysis.against
        if out is not None:
            options.claim_folder(out, FILES, origin_of_case(case), analysis.force)
        part = analysis.part(data)
        member = analysis.member or first_input(part)
        with progress(analysis.quiet) as report:
            report("orders", 0.0)
            result = analysis.result(part)
            report("orders", 1.0)
        warn_of_aliases(data, part[analysis.of])
        expected, rows = list[tuple[ExpectedLine, float]](), list[dict[str, Any]]()
        if "phase" not in result.dims:
            expected = _expected(case, result, member, against)
            rows = list(strongest(result, expected))
        if out is not None:
            _write(out, case, result, expected)
        figures = {"of": analysis.of, "member": member, "against": against or None,
                   "turns": result.attrs["turns"], "lines": rows}  # fmt: skip
        show(figures, lambda: _print(case, result, rows), analysis.as_json, out)


def _opened(file: Path) -> xr.Dataset:
    """The transient of a file, or of the folder of a run."""
    path = file / TRANSIENT if file.is_dir() else file
    if not path.is_file():
        raise InputError(
            SOURCE, str(path), "is no file", "name a transient, or the folder of a run"
        )
    return reopened(path)


def columns_of(history: xr.DataArray, text: str) -> xr.DataArray:
    """Columns (time, column) of a variable, those with a text in their labels, of which the part of
    a file is read that holds them. InputError where there are none, more than a picture shows, or
    of several units."""
    others = [str(d) for d in history.dims if d != "time"]
    if not others:
        return history
    labels = product(*(history[d].to_numpy() for d in others))
    names = np.array([" ".join(map(str, label)) for label in labels], dtype=str)
    chosen = np.flatnonzero(np.char.find(names, text) >= 0)
    at = dict(
        zip(others, np.unravel_index(chosen, [history.sizes[d] for d in others]), strict=True)
    )
    units = {str(history.attrs["units"])}
    if "sensor_unit" in history.coords:
        units = set(map(str, history["sensor_unit"].to_numpy()[at["sensor"]]))
    problem, remedy = "", f"name up to {MOST_CURVES} with --only, e.g. of {', '.join(names[:4])}"
    if not 0 < len(chosen) <= MOST_CURVES:
        problem = f"are {len(chosen)} columns" if len(chosen) else "is no label"
    elif len(units) > 1:
        problem = f"is in {' and '.join(sorted(units))}"
        remedy = "name sensors of one unit with --only"
    if problem:
        raise InputError(SOURCE, f"{history.name} {text}".strip(), problem, remedy)
    inside = {d: slice(k.min(), k.max() + 1) for d, k in at.items()}
    values = history.isel(inside).transpose("time", *others).to_numpy()
    columns = values[:, *(k - k.min() for k in at.values())]
    coords = {"time": history["time"], "column": names[chosen]}
    attrs = {**history.attrs, "units": units.pop()}
    return xr.DataArray(columns, coords, ("time", "column"), history.name, attrs)


def _expected(
    case: Case, result: xr.DataArray, member: str, against: str
) -> list[tuple[ExpectedLine, float]]:
    """Lines up to the highest order of a spectrum."""
    highest = float(result["order"][-1])
    first = expected_orders(case, member, against)
    gear_meshes = [order / line.harmonic for line, order in first if line.kind == "gear mesh"]
    harmonics = int(highest / min(gear_meshes)) if gear_meshes else HARMONICS
    every = expected_orders(case, member, against, harmonics=max(HARMONICS, min(harmonics, 100)))
    return [(line, order) for line, order in every if order <= highest]


def strongest(
    result: xr.DataArray, expected: list[tuple[ExpectedLine, float]]
) -> Iterator[dict[str, Any]]:
    """The highest peaks of all columns except side lobes of higher ones, and the expected
    line at it, else the tooth faults of which it is a multiple, else the nearest expected line
    within the resolution of the window."""
    order, turns = result["order"].to_numpy(), float(result.attrs["turns"])
    others = [d for d in result.dims if d != "order"]
    largest = result.max(others).to_numpy()
    spacing = max(1, int(RESOLVED / turns / (order[1] - order[0])))
    peaks, _ = find_peaks(largest, distance=spacing)
    peaks = peaks[largest[peaks] > result.attrs.get("rounding", 0.0)]
    lines, lobes = list[int](), side_lobes(result.attrs["window"])
    for k in sorted(peaks, key=lambda k: -largest[k])[:CANDIDATES]:
        away = turns * np.abs([order[lines] - order[k], order[lines] + order[k]])
        place = np.minimum(away * PADDING, len(lobes) - 1).astype(int)  # mirror image, too
        if largest[k] > ABOVE * np.sum(largest[lines] * lobes[place]):
            lines.append(k)
    for k in lines[:LINES]:
        row: dict[str, Any] = {"order": float(order[k]), "amplitude": float(largest[k])}
        at = result[{"order": k}]
        at = at[at.argmax(others)] if others else at
        if "column" in others:
            row["column"] = str(at["column"].item())
        if "block" in others:
            row["speed_rpm"] = float(at["speed"]) * RPM
        yield row | {"expected": _labels(float(order[k]), expected, turns)}


def _labels(order: float, expected: list[tuple[ExpectedLine, float]], turns: float) -> list[str]:
    """Labels of the lines at an order in a spectrum of so many turns, or of tooth faults of which
    it is a multiple: those that are equally near."""
    named = [(f"{words(x.stage)} {x.label}".removeprefix("stage "), at) for x, at in expected]
    faults = [
        (f"{round(order / at)} × {name}", round(order / at) * at)
        for (line, at), (name, _) in zip(expected, named, strict=True)
        if line.kind == TOOTH_FAULT and at >= APART / turns
    ]
    for lines, within in ((named, MULTIPLE), (faults, MULTIPLE), (named, 1.0)):
        least = min((abs(at - order) for _, at in lines), default=np.inf)
        if least <= within / turns:
            return [name for name, at in lines if abs(at - order) <= least + 1e-9]
    return []


def _print(case: Case, result: xr.DataArray, rows: list[dict[str, Any]]) -> None:
    turns = float(result.attrs["turns"])
    title = f"{case.name}: {result.name} over {number(turns)} turns of {result.attrs['of']}"
    if not rows:
        quiet = "" if "phase" in result.dims else ": nothing but rounding varies"
        typer.echo(title + quiet)
        return
    resolution, window = number(RESOLVED / turns, 2), result.attrs["window"]
    title += f", {window} window; lines less than {resolution} orders apart are one"
    unit, by = scale([rows[0]["amplitude"]], str(result.attrs["units"]))
    lines = {}
    for row in rows:
        texts = [f"{number(by * row['amplitude'])} {unit}", row.get("column", "")]
        if "speed_rpm" in row:
            texts.append(f"at {number(row['speed_rpm'])} r/min")
        texts.append(f"({', '.join(row['expected'][:2])})" if row["expected"] else "")
        lines[f"order {number(row['order'], 6)}"] = "  ".join(filter(None, texts))
    table(title, lines)


def _write(
    folder: Path, case: Case, result: xr.DataArray, expected: list[tuple[ExpectedLine, float]]
) -> None:
    """Dataset, picture, and the page on which it zooms."""
    from flexgear.views.order_charts import average_chart, order_chart, order_map_chart
    from flexgear.views.report import saved_picture, write_study

    if "phase" in result.dims:
        figure = average_chart(result)
    elif "block" in result.dims:
        figure = order_map_chart(_loudest(result), expected)
    else:
        figure = order_chart(result, expected)
    about = {
        "title": f"flexgear {case.name}", "case": case.name,
        "parameters": as_json_text(case.to_dict()), "content_hash": case.content_hash(),
    }  # fmt: skip
    caption = f"{words(str(result.name)).capitalize()} over turns of {result.attrs['of']}"
    text = f"{str(result.attrs.get('long_name', '')).capitalize()}."
    with staged_folder(folder, options.earlier(FILES)) as stage:
        data = result.to_dataset(name=str(result.name)).assign_attrs(about)
        write_netcdf(data, stage / "orders.nc")
        picture = saved_picture(figure, stage, "orders", "dynamics", caption, text)
        write_study(stage, case, "orders", caption, [picture])


def _loudest(mapped: xr.DataArray) -> xr.DataArray:
    """The column of a map with the largest amplitude."""
    if "column" not in mapped.dims:
        return mapped
    return mapped.isel(column=int(mapped.max(["block", "order"]).to_numpy().argmax()))
