"""``flexgear sweep``: parameter studies of one or two keys of a case."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
import xarray as xr
from numpy.typing import NDArray
from typer import Argument, Option

from flexgear.cli import options
from flexgear.cli.display import Report, columns, evenly_spaced, resumable, show, value_text, warn
from flexgear.files.atomic import file_target
from flexgear.model.errors import InputError
from flexgear.results.dataset_file import write_netcdf
from flexgear.results.origin import origin_of_case
from flexgear.results.report.wording import number, words
from flexgear.studies.measures import MEASURES, WARNING
from flexgear.studies.sweep import failures, finished, planned, run_sweep
from flexgear.studies.sweep_keys import FORMS, WHERE, Values, parse_setting
from flexgear.views import style
from flexgear.views.sweep_charts import (
    SAMPLE,
    drawn_variables,
    keys_of,
    label_at,
    parts_of,
    scale_of,
    sweep_chart,
)

MAX_COLUMNS = 8  # of a printed table
MAX_ROWS = 24  # of a printed table
MAX_MESSAGES = 3  # of failed points that are printed


def sweep(
    study: options.Study,
    keys: Annotated[
        list[str],
        Argument(
            metavar="KEY=VALUES [KEY2=VALUES2]",
            help="One or two keys of the case; values as 1,2,3 or start:stop:count or "
            "start:stop:count:log. A number at the end of a key selects an element of a list. "
            "Where a key takes a list, 0.1,0.2 are two points with lists of one element, and "
            "'[0.1,0.2],[0.2,0.1]' two points with lists of two.",
        ),
    ],
    measure: Annotated[
        list[str] | None,
        Option(metavar="NAME", help=f"Measure to record; repeatable: {', '.join(MEASURES)}."),
    ] = None,
    modes: Annotated[int, Option(min=1, help="Natural modes to list.")] = 10,
) -> None:
    """Parameter study over one key or a grid of two, in parallel; dataset and pictures.

    --out names a folder, or a .nc file beside which pictures go.
    """
    swept, settings = _keys(keys), options.settings_of(study.settings)
    names = [n.strip() for text in measure or [] for n in text.split(",") if n.strip()]
    target = study.out or Path("results") / f"sweep-{Path(study.case).stem}"
    plan = planned(study.case, swept, settings=settings, measures=names, modes=modes)
    parent, start = _files_of(target)
    files = (f"{start}.nc", f"{start}_*.png")
    with (
        resumable(lambda: finished(plan), f"{len(plan.grid)} points"),
        study.results(parent, files, origin_of_case(plan.base)) as (folder, report),
    ):
        data = run_sweep(plan, **study.where, progress=report, keep_points=True)
        write_netcdf(data, folder / f"{start}.nc")
        if study.pictures:
            _draw(data, folder, start, report)
    plan.store.clear()
    show(plain(data), lambda: _tables(data), study.as_json, target)
    _print_problems(data)


def _keys(settings: list[str]) -> dict[str, Values]:
    """One or two swept keys with their values; InputError for more, or a repeated key."""
    swept: dict[str, Values] = {}
    for setting in settings:
        key, values = parse_setting(setting)
        if key in swept:
            raise InputError(WHERE, key, "is given twice", f"give all its values at once; {FORMS}")
        swept[key] = values
    if len(swept) > 2:
        raise InputError(
            WHERE, list(swept)[2], "is a third key", "sweep one or two, set others with --set"
        )
    return swept


def _files_of(target: Path) -> tuple[Path, str]:
    """Folder and stem of the output files: those of ``target`` if it is a .nc file, else ``target``
    and "sweep"."""
    if target.suffix.lower() in (".png", ".svg", ".pdf", ".csv", ".json"):
        problem = "is no folder or dataset"
        raise InputError("--out", str(target), problem, "name a folder or a file that ends in .nc")
    if target.suffix.lower() != ".nc":
        return target, "sweep"
    file = file_target(target)
    return file.parent, file.stem


def _draw(data: xr.Dataset, folder: Path, start: str, report: Report) -> None:
    """Write a picture of each variable."""
    names = drawn_variables(data)
    for k, name in enumerate(names):
        report("pictures", k / len(names))
        style.save_figure(sweep_chart(data, name), folder / f"{start}_{name}.png", dpi=150)
    report("pictures", 1.0)


def plain(data: xr.Dataset) -> dict[str, Any]:
    """Content of ``--json``: keys, measures, failed points; SI units."""
    keys = keys_of(data["message"])
    return {
        "case": data.attrs["case"],
        "keys": [
            {"key": k, "units": data[k].attrs["units"], "values": data[k].to_numpy().tolist()}
            for k in keys
        ],
        "measures": {
            str(name): {
                "units": field.attrs["units"],
                "meaning": field.attrs["long_name"],
                "dims": list(field.dims),
                "labels": {str(d): field[d].to_numpy().tolist() for d in field.dims},
                "values": field.to_numpy().tolist(),
            }
            for name, field in data.data_vars.items()
            if name not in ("message", WARNING)
        },
        "warnings": [{"point": where, "message": text} for where, text in failures(data, WARNING)],
        "failed": [{"point": where, "message": text} for where, text in failures(data)],
    }


def _tables(data: xr.Dataset) -> None:
    """Print a table for each measure with a line for each point."""
    typer.echo(f"{data.attrs['case']}: {data.attrs['variant']}, {data.attrs['points']} points")
    for name in drawn_variables(data):
        field = data[name]
        factor, unit = scale_of(field)
        for title, part in parts_of(field, keys_of(field), keep=1):
            heading = ", ".join(filter(None, (name.replace("_", " "), title)))
            heading += f" ({unit})" if unit else ""
            titles, values = _columns(part, factor)
            printed = ({f"{value:.6g}" for value in column} for column in values.T)
            if len(values) > 1 and all(len(texts) == 1 for texts in printed):
                pairs = [f"{c} {value_text(v)}" for c, v in zip(titles, values[0], strict=True)]
                more = len(pairs) - MAX_COLUMNS
                texts = ", ".join(pairs[:MAX_COLUMNS]) + (f" … {more} more" if more > 0 else "")
                typer.echo(f"\n{heading}: the same at every point, {texts}")
            else:
                typer.echo(f"\n{heading}")
                _table(part, titles, values)
    for history in (str(n) for n, field in data.data_vars.items() if SAMPLE in field.dims):
        count = number(data.sizes[SAMPLE])
        typer.echo(f"\n{words(history)}: {count} samples a point, in the dataset")


def _columns(part: xr.DataArray, factor: float) -> tuple[list[str], NDArray[np.float64]]:
    """Titles of the c columns of a part, and its values (points, c) times ``factor``."""
    keys = keys_of(part)
    inner = [str(d) for d in part.dims if d not in keys]
    titles = [label_at(part[{d: k}], d) for d in inner for k in range(part.sizes[d])] or ["value"]
    return titles, part.transpose(*keys, *inner).to_numpy().reshape(-1, len(titles)) * factor


def _table(part: xr.DataArray, titles: list[str], values: NDArray[np.float64]) -> None:
    """Print a line for each point, of many points for some evenly spaced ones."""
    keys = keys_of(part)
    points = list(np.ndindex(*(part.sizes[k] for k in keys)))
    lines = evenly_spaced(len(points), MAX_ROWS)
    rows = [
        [*(part[k][i].item() for k, i in zip(keys, points[p], strict=True)),
         *values[p, :MAX_COLUMNS].tolist()]
        for p in lines
    ]  # fmt: skip
    head = [*(_headed(part[k]) for k in keys), *titles[:MAX_COLUMNS]]
    columns([head, *([*map(value_text, row)] for row in rows)], ">")
    counts = {"points": (len(lines), len(points)), "columns": (MAX_COLUMNS, len(titles))}
    cut = [f"{some} of {count} {what}" for what, (some, count) in counts.items() if some < count]
    if cut:
        typer.echo(f"  {' and '.join(cut)}; the dataset has all")


def _headed(ticks: xr.DataArray) -> str:
    """Heading of a swept key: its name without suffix, and its unit."""
    name, unit = str(ticks.attrs["long_name"]), str(ticks.attrs["units"])
    return f"{name}, {unit}" if unit else name


def _print_problems(data: xr.Dataset) -> None:
    """Print failed points and warnings to stderr."""
    for name, how in (("message", "failed"), (WARNING, "have a warning")):
        lines = failures(data, name)
        if not lines:
            continue
        warn([f"{len(lines)} of {data.attrs['points']} points {how}:"])
        texts = [f"{where}: {message}" for where, message in lines[:MAX_MESSAGES]]
        if len(lines) > MAX_MESSAGES:
            texts.append(f"… and {len(lines) - MAX_MESSAGES} more in the dataset")
        typer.echo("\n".join(f"  {text}" for text in texts), err=True)
