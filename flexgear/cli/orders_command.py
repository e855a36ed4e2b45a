"""``flexgear orders``: order spectra, run-up maps and averages over the turns of a member."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr
from scipy.signal import find_peaks
from typer import Argument, Option

from flexgear.cli import options
from flexgear.cli.display import as_json_text, progress, show, table, warn
from flexgear.files.atomic import staged_folder
from flexgear.gears.expected_lines import (
    ALIAS,
    BEARING,
    CANCELLED,
    GEAR_MESH,
    HARMONICS,
    SAME_TEETH,
    SIDEBAND,
    TOOTH_FAULT,
    ExpectedLine,
)
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import SHAFT
from flexgear.model.units import RPM
from flexgear.results.dataset_file import reopened, write_netcdf
from flexgear.results.orders import PADDING, SOURCE, order_map, order_spectrum, side_lobes
from flexgear.results.origin import origin_of_case
from flexgear.results.report.wording import number, words
from flexgear.results.run_folder import complete, transient_file
from flexgear.results.run_orders import (
    RESOLUTION,
    Lines,
    aliases,
    case_of,
    column_words,
    expected_orders,
    first_input,
    history_over_turns,
    over_time,
    planet_averages,
    scale_of,
    speed_change,
    synchronous_average,
    warn_of_aliases,
)
from flexgear.results.settling import settled
from flexgear.results.sinks import between

FILES = ("orders.nc", "orders.png", "report.html")
USUAL = "gear_mesh_force"
MAX_CURVES = 12  # of a picture
MAX_LINES = 12  # that are printed, the strongest
MAX_PEAKS = 400  # that are examined, the highest
LOBE_FACTOR = 1.5  # of a line over the side lobes of all higher lines, at least
RUN_UP = 0.05  # change of speed, over it, above which a warning names what a run-up does to lines
TREND_PERIODS = 3.0  # of a sine, from which on a trend takes nothing of it
TREND_REST = 0.3  # least share that a trend leaves of a sine of two periods
MULTIPLE_TOLERANCE = 0.25  # lines of the transform between a peak and a multiple of a fault's line
PASSES = {"+1 carrier turn": 1, "−1 carrier turn": -1}  # beside multiples of a fault's line
# lines of the transform between multiples, of which 1 peak in 20 is at one by chance
MULTIPLE_SPACING = 10.0


@dataclass(frozen=True)
class OrderAnalysis:
    """Options of ``flexgear orders``: history, samples, member, kind of analysis, output."""

    file: Annotated[
        Path, Argument(metavar="FILE", help="A transient (.nc), or the folder of a run.")
    ]
    of: Annotated[str, Option(metavar="NAME", help="Variable over time.")] = USUAL
    only: Annotated[str, Option(metavar="LABEL", help="Columns whose labels contain this.")] = ""
    member: Annotated[str, Option(help="Orders of its rotation; the first input if left out.")] = ""
    against: Annotated[str, Option(metavar="MEMBER", help="Rotation relative to this member.")] = ""
    highest: Annotated[float | None, Option(help="Highest order; by the samples if left out.")] = (
        None
    )
    block_turns: Annotated[
        float | None,
        Option("--map", metavar="TURNS", help="Orders over speed, in blocks of so many turns."),
    ] = None
    average: Annotated[bool, Option("--average", help="Mean over turns.")] = False
    planets: Annotated[str, Option(metavar="STAGE", help="Mean over turns, planet by planet.")] = ""
    sensor_angle_deg: Annotated[float, Option(help="Where planets pass the sensor.")] = 0.0
    envelope_hz: Annotated[
        tuple[float, float] | None,
        Option(metavar="LOW HIGH", help="Envelope of this band."),
    ] = None
    window: Annotated[str, Option(help="Of scipy.signal.windows.")] = "hann"
    from_s: Annotated[float | None, Option(help="The settled part if left out; all of a map.")] = (
        None
    )
    to_s: Annotated[float | None, Option(help="The end if left out.")] = None
    out: options.OutFolder = None
    force: options.Force = False
    as_json: options.AsJson = False
    quiet: options.Quiet = False

    def refuse_unused(self) -> None:
        """InputError for an option that the chosen kind of analysis does not use."""
        unused = {"--map": self.block_turns, "--window": self.window != "hann"}
        if self.planets:
            options.refuse_beside("--planets", unused | {
                "--average": self.average, "--member": self.member, "--against": self.against,
                "--highest": self.highest, "--envelope-hz": self.envelope_hz,
            })  # fmt: skip
            return
        options.refuse_without("--planets", {"--sensor-angle-deg": self.sensor_angle_deg})
        if self.average:
            options.refuse_beside("--average", unused)

    def part(self, data: xr.Dataset) -> xr.Dataset:
        """The history and the rotation of the inputs from ``--from-s`` to ``--to-s``; without these
        options over the settled samples, or for a map over all."""
        history = over_time(data, self.of)
        if self.from_s is None and self.to_s is None:
            part = history if self.block_turns is not None else settled(history)
        else:
            start = self.from_s or 0.0
            part = between(history, start, self.to_s)
            if part.sizes["time"] < 16:
                end = float(history.variables["time"][-1])
                stop = end if self.to_s is None else self.to_s
                remedy = f"the transient ends at {end:.4g} s"
                raise InputError(SOURCE, f"{start:g} to {stop:g} s", "holds no samples", remedy)
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
    """Order analysis of a transient at any speed: spectrum over the turns of a member with expected
    lines, run-up maps, envelopes, averages over turns."""
    analysis.refuse_unused()
    data, out = reopened(transient_file(analysis.file)), analysis.out
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
        change = speed_change(part)
        if change > RUN_UP and not {"phase", "block"} & {*result.dims}:
            warn([
                f"the speed changes by {number(100 * change, 2)} % in this part: resonances that "
                "are passed spread lines and leave others beside them, see --map"
            ])  # fmt: skip
        expected, rows = list[tuple[ExpectedLine, float]](), list[dict[str, Any]]()
        if "phase" not in result.dims:
            expected = _expected(case, result, member, against)
            folded = aliases(part, analysis.of, expected, member, against)
            rows = list(strongest(result, faults_first([*expected, *folded])))
        if out is not None:
            _write(out, case, result, expected)
        figures = {"of": analysis.of, "member": member, "against": against or None,
                   "turns": result.attrs["turns"], "lines": rows}  # fmt: skip
        show(figures, lambda: _print(case, result, rows), analysis.as_json, out)


def columns_of(history: xr.DataArray, text: str) -> xr.DataArray:
    """Columns (time, column) of a variable whose labels contain a text; only their part of the file
    is read. InputError for no columns, more than a picture shows, or columns of several units."""
    others = [str(d) for d in history.dims if d != "time"]
    if not others:
        return history
    labels = product(*(history[d].to_numpy() for d in others))
    names = np.array([" ".join(map(str, label)) for label in labels], dtype=str)
    shown = np.array([column_words(history, name) for name in names], dtype=str)
    chosen = np.flatnonzero((np.char.find(names, text) >= 0) | (np.char.find(shown, text) >= 0))
    at = dict(
        zip(others, np.unravel_index(chosen, [history.sizes[d] for d in others]), strict=True)
    )
    units = {str(history.attrs["units"])}
    if "sensor_unit" in history.coords:
        units = set(map(str, history["sensor_unit"].to_numpy()[at["sensor"]]))
    elif "dof" in others:  # "N, N m": of forces and moments, of displacements and rotations
        of_dofs = next(iter(units)).split(", ")
        units = {of_dofs[d.startswith("r")] for d in history["dof"].to_numpy()[at["dof"]].tolist()}
    problem, remedy = "", f"name up to {MAX_CURVES} with --only, e.g. of {', '.join(names[:4])}"
    if not 0 < len(chosen) <= MAX_CURVES:
        problem = f"are {len(chosen)} columns" if len(chosen) else "is no label"
    elif len(units) > 1:
        problem = f"is in {' and '.join(sorted(units))}"
        what = "sensors" if "sensor" in others else "columns"
        remedy = f"name {what} of one unit with --only, e.g. {names[chosen[0]]}"
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
    """Expected lines up to the highest order of a spectrum, with their orders."""
    highest = float(result["order"][-1])
    sensors = np.atleast_1d(result["column"]) if result.name == "sensor_signal" else ()
    lines_at = partial(expected_orders, case, member, against, sensors=tuple(map(str, sensors)))
    first = lines_at()
    gear_meshes = [order / line.harmonic for line, order in first if line.kind == GEAR_MESH]
    harmonics = math.ceil(highest / min(gear_meshes)) if gear_meshes else HARMONICS
    lines = lines_at(harmonics=max(HARMONICS, min(harmonics, 100)))
    return [(line, order) for line, order in lines if order <= highest]


def faults_first(lines: Lines) -> Lines:
    """The lines, those of faults that the case has before those of sound gears and bearings."""
    return sorted(lines, key=lambda entry: not entry[0].faulty)


def strongest(result: xr.DataArray, expected: Lines) -> Iterator[dict[str, Any]]:
    """Rows of the highest peaks of all columns, without side lobes of higher peaks and the skirt of
    a slow trend (``results.orders``). Each has the expected lines at its order, else the tooth
    faults of which it is a multiple or, of a sensor, a sideband of a multiple, else the nearest
    expected line within the resolution of the window."""
    order, turns = result["order"].to_numpy(), float(result.attrs["turns"])
    rest = result["without_trend"]
    slow = (rest < TREND_REST * result) | (result["order"] * turns >= TREND_PERIODS)
    result = rest.where(slow, result).assign_attrs(result.attrs).rename(result.name)
    others = [d for d in result.dims if d != "order"]
    largest = result.max(others).to_numpy()
    spacing = max(1, int(RESOLUTION / turns / (order[1] - order[0])))
    peaks, _ = find_peaks(largest, distance=spacing)
    peaks = peaks[largest[peaks] > result.attrs.get("rounding", 0.0)]
    lines, lobes = list[int](), side_lobes(result.attrs["window"])
    for k in sorted(peaks, key=lambda k: -largest[k])[:MAX_PEAKS]:
        distance = turns * np.abs([order[lines] - order[k], order[lines] + order[k]])
        place = np.minimum(distance * PADDING, len(lobes) - 1).astype(int)  # with the mirror image
        if largest[k] > LOBE_FACTOR * np.sum(largest[lines] * lobes[place]):
            lines.append(k)
    for k in lines[:MAX_LINES]:
        row: dict[str, Any] = {"order": float(order[k]), "amplitude": float(largest[k])}
        at = result[{"order": k}]
        at = at[at.argmax(others)] if others else at
        if "column" in others:
            row["column"] = str(at["column"].item())
        if "block" in others:
            row["speed_rpm"] = float(at["speed"]) * RPM
        passes = PASSES if result.name == "sensor_signal" else {}
        yield row | {"expected": _labels(float(order[k]), expected, turns, passes)}


def _labels(order: float, expected: Lines, turns: float, passes: Mapping[str, int]) -> list[str]:
    """Labels of the nearest expected lines at an order in a spectrum of so many turns, else of
    aliases, else of the nearest multiples of lines of faults, or sidebands of those of the case,
    and of a carrier's turn of the same order, else of other sidebands, at turns of a bearing's
    defect and carrier turns by name in ``passes``; empty where none is near."""
    gear_meshes = [at for x, at in expected if x.kind == GEAR_MESH and x.share > CANCELLED]
    width = RESOLUTION / turns  # sidebands that are nearer to a gear mesh are one line with it
    folded = [(words(f"{x.stage} {x.label}"), at) for x, at in expected if x.kind == ALIAS]
    expected = [
        (x, at)
        for x, at in expected
        if x.kind != ALIAS
        if x.kind != SAME_TEETH or at >= width  # in a run of at least two meetings
        if x.kind != SIDEBAND or all(abs(at - g) >= width for g in gear_meshes)
    ]
    named = [(words(f"{x.stage} {x.label}"), at) for x, at in expected]
    carriers = {
        line.stage: (name, at)
        for (line, at), (name, _) in zip(expected, named, strict=True)
        if (line.kind, line.label) == (SHAFT, "carrier")
    }
    faults, beside = list[tuple[str, float]](), list[tuple[str, float]]()
    for (line, at), (name, _) in zip(expected, named, strict=True):
        if line.kind not in (TOOTH_FAULT, BEARING) or at < MULTIPLE_SPACING / turns:
            continue
        carrier, turn = carriers.get(line.stage, ("", 0.0))
        times = round(order / at)
        if math.isclose(at, turn):
            faults.append((f"{times} × {carrier}", times * at))
        faults.append((f"{times} × {name}", times * at))
        most = 2 * at * turns / MULTIPLE_SPACING  # sides; of more, some are near peaks by chance
        candidates = (list(_sides(line, at, turn, passes, far)) for far in (2, 1))
        for text, side in next((sides for sides in candidates if len(sides) <= most), ()):
            times = round((order - side) / at)
            if times > 0:
                near = faults if line.faulty else beside
                near.append((f"{times} × {name}{text}", times * at + side))
    for lines, within in (
        (named, MULTIPLE_TOLERANCE), (folded, MULTIPLE_TOLERANCE), (faults, MULTIPLE_TOLERANCE),
        (beside, MULTIPLE_TOLERANCE), (named, 1.0),
    ):  # fmt: skip
        least = min((abs(at - order) for _, at in lines), default=np.inf)
        if least <= within / turns:
            return [name for name, at in lines if abs(at - order) <= least + 1e-9]
    return []


def _sides(
    line: ExpectedLine, order: float, carrier: float, passes: Mapping[str, int], far: int
) -> Iterator[tuple[str, float]]:
    """Names and distances, in orders, of the sidebands of the multiples of a fault's line at
    ``order``: at up to ``far`` turns of a bearing's defect, and at one of the carrier that
    modulates the line."""
    turns, turn = {"": 0.0}, line.turn * order / line.frequency
    for n in (1, -1, 2, -2)[: 2 * far] if turn else ():
        turns[f" {'+−'[n < 0]}{abs(n)} {line.turn_label}{'s' * (abs(n) > 1)}"] = n * turn
    carried = passes if line.carrier_modulates and carrier else {}
    carriers = {"": 0.0} | {f" {name}": s * carrier for name, s in carried.items()}
    for (first, x), (second, y) in product(turns.items(), carriers.items()):
        if first or second:
            yield first + second, x + y


def _print(case: Case, result: xr.DataArray, rows: list[dict[str, Any]]) -> None:
    turns = float(result.attrs["turns"])
    of = words(str(result.attrs["of"]))
    title = f"{case.name}: {words(str(result.name))} over {number(turns)} "
    title += f"{'turn' if turns == 1 else 'turns'} of {of}"
    if not rows:
        quiet = "" if "phase" in result.dims else ": nothing but rounding varies"
        typer.echo(title + quiet)
        return
    resolution, window = number(RESOLUTION / turns, 2), result.attrs["window"]
    title += f", {window} window; lines less than {resolution} orders apart are one"
    unit, by = scale_of(result, rows[0]["amplitude"])
    lines = {}
    for row in rows:
        column = column_words(result, row.get("column", ""))
        texts = [f"{number(by * row['amplitude'])} {unit}", column]
        if "speed_rpm" in row:
            relative = "".join(result.attrs["of"].partition(" against ")[1:])
            texts.append(f"at {number(row['speed_rpm'])} r/min{relative}")
        texts.append(f"({', '.join(row['expected'][:2])})" if row["expected"] else "")
        lines[f"order {number(row['order'], 6)}"] = "  ".join(filter(None, texts))
    table(title, lines)


def _write(folder: Path, case: Case, result: xr.DataArray, expected: Lines) -> None:
    """Write the dataset, its picture, and a page with the picture."""
    from flexgear.views.order_charts import average_chart, order_chart, order_map_chart
    from flexgear.views.report import saved_picture, write_study

    if "phase" in result.dims:
        figure = average_chart(result)
    elif "block" in result.dims:
        largest = int(result.max(["block", "order"]).to_numpy().argmax())
        figure = order_map_chart(result.isel(column=largest, missing_dims="ignore"), expected)
    else:
        figure = order_chart(result, expected)
    about = {
        "title": f"flexgear {case.name}", "case": case.name,
        "parameters": as_json_text(case.to_dict()), "content_hash": case.content_hash(),
    }  # fmt: skip
    caption = f"{words(str(result.name)).capitalize()} over turns of {words(result.attrs['of'])}"
    text = f"{str(result.attrs.get('long_name', '')).capitalize()}."
    with staged_folder(folder, options.earlier(FILES)) as stage:
        data = result.to_dataset(name=str(result.name)).assign_attrs(about)
        write_netcdf(data, stage / "orders.nc")
        picture = saved_picture(figure, stage, "orders", "dynamics", caption, text)
        write_study(stage, case, "orders", caption, [picture])
