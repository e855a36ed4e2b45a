"""Charts of parameter studies: lines over one key; lines by the second key, or maps, over two keys.

Keys are the dimensions whose coordinate has the attribute "logarithmic". Of the other dimensions of
a variable the last labels lines, all before it label panels.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.results.report.wording import scale, words
from flexgear.views.mode_charts import TYPE_COLOURS
from flexgear.views.select import variable
from flexgear.views.style import (
    MICRO,
    NEUTRAL,
    PLANET_COLOURS,
    SEQUENTIAL_MAP,
    cell_edges,
    least_span,
    legend_of,
    panels,
    styled,
    text_only,
)

LINES_BY_KEY = 6  # values of a second key that label lines; more make a map
MAX_PANELS = 8
MAX_MARKERS = 40  # points of a line with markers
WIDE = 50.0  # ratio of the ends of a logarithmic axis; a shorter axis has ticks at its points
SPREAD = 12.0  # ratio of the ends of positive values on a logarithmic axis, at least
LEAST_SPAN = 0.01  # of the middle value: range of a nearly constant quantity
WIDE_LABEL, NARROW_LABEL = 80, 30  # characters of a key in one line
STYLES = ("-", "--", "-.", ":")
SCALES = {"m": (MICRO, "µm"), "1": (1.0, "–"), "Hz": (1.0, "Hz")}  # for values of any size
SAMPLE = "sample"  # dimension of the histories of sensors
NEGLIGIBLE = 1e-9  # of the largest value: smaller lines are omitted


@dataclass(frozen=True)
class Curve:
    """A line of a panel: its label, values along the key, colour and style."""

    label: str
    values: Array
    colour: str
    style: str = "-"


def drawn_variables(data: xr.Dataset) -> list[str]:
    """Names of the variables with a picture: numbers over at least one key, without histories."""
    floats = ((str(n), v) for n, v in data.data_vars.items() if v.dtype.kind == "f")
    return [n for n, v in floats if keys_of(v) and SAMPLE not in v.dims]


def keys_of(field: xr.DataArray) -> list[str]:
    """Dimensions that are swept keys."""
    return [str(d) for d in field.dims if "logarithmic" in field[d].attrs]


@styled
def sweep_chart(data: xr.Dataset, name: str) -> Figure:
    """One variable of a parameter study over its one or two keys."""
    field = variable(data, name)
    keys = keys_of(field)
    if len(keys) not in (1, 2):
        raise FlexgearError(f"cannot draw '{name}': it has {len(keys)} keys, pictures one or two")
    for key in keys:
        if field[key].dtype.kind in "if":
            field = field.sortby(key)
    factor, unit = scale_of(field)
    field = field.copy(data=field.to_numpy() * factor)  # with its attributes
    label = f"{words(name)} ({unit})" if unit else words(name)
    field = _first_definition(field) if len(keys) == 2 else field
    if not field.notnull().any():
        return text_only(f"{label}: no point has a value")
    if len(keys) == 1 or field.sizes[keys[1]] <= LINES_BY_KEY:
        figure = _lines(data, field, keys, label)
    else:
        figure = _maps(field, keys, label)
    failed = int((data["message"] != "").sum()) if "message" in data else 0
    notes = [str(field.attrs.get("long_name", ""))]
    if failed:
        notes.append(f"{failed} of {data['message'].size} points failed")
    figure.suptitle("; ".join(filter(None, notes)), fontsize=9, weight="bold")
    return figure


def _lines(data: xr.Dataset, field: xr.DataArray, keys: list[str], label: str) -> Figure:
    """Lines over the first key, by the labels of the last dimension or the values of a second key;
    a panel for each label of the other dimensions. Modes always share a panel, sensors never."""
    by_key = len(keys) == 2
    bundled = any(d in field.dims for d in ("mode", "number"))
    keep = bundled + (not by_key and not {"mode", "sensor"} & {*field.dims})
    parts = _panels(field, keys, keep)
    height = 30 + (62 if len(parts) == 1 else 42 * len(parts))
    figure, axes = panels(len(parts), 1, height_mm=height, sharex=True)
    whole = list[Line2D]()  # for the legend, beside lines dashed over others
    for ax, (title, part) in zip(axes[:, 0], parts, strict=True):
        curves = _curves(part, *keys)
        whole += [Line2D([], [], color=c.colour, ls=c.style, label=c.label) for c in curves]
        _draw(ax, part[keys[0]], curves, field)
        ax.set_title(title)
        ax.set_ylabel(label)
    if not by_key and "mode" in field.dims and "mode_type" in data:
        _mark_types(axes[-1, 0], data, field, keys[0])
    axes[-1, 0].set_xlabel(_key_label(field[keys[0]]))
    legend = legend_of(figure, LINES_BY_KEY if by_key else 4, filter(Line2D.get_label, whole))
    if legend is not None and by_key:
        legend.set_title(_key_label(field[keys[1]]))
    return figure


def _maps(field: xr.DataArray, keys: list[str], label: str) -> Figure:
    """Maps over both keys, the second upwards, a panel for each label in two columns; white where a
    point failed."""
    parts = _panels(field, keys, keep=0)
    columns = min(len(parts), 2)
    rows = -(-len(parts) // columns)
    figure, axes = panels(rows, columns, height_mm=30 + 62 * rows)
    for ax in axes.flat[len(parts) :]:
        ax.set_axis_off()
    for ax, (title, part) in zip(axes.flat, parts, strict=False):
        x, y = (
            np.exp(cell_edges(np.log(at))) if _logarithmic(part[key]) else cell_edges(at)
            for key in keys
            for at in [_positions(part[key])]
        )
        image = np.ma.masked_invalid(part.transpose(keys[1], keys[0]).to_numpy())
        low, high = float(image.min()), float(image.max())
        room = max(0.0, LEAST_SPAN * max(abs(low), abs(high)) - (high - low)) / 2
        drawn = ax.pcolormesh(
            x, y, image, cmap=SEQUENTIAL_MAP, rasterized=True,
            vmin=low - room, vmax=high + room,
        )  # fmt: skip
        figure.colorbar(drawn, ax=ax, label=label, pad=0.01)
        ax.grid(False)
        ax.set_title(title)
        _axis(ax, part[keys[0]], "x")
        _axis(ax, part[keys[1]], "y")
        ax.set_xlabel(_key_label(field[keys[0]], NARROW_LABEL))
        ax.set_ylabel(_key_label(field[keys[1]], NARROW_LABEL))
    return figure


def parts_of(field: xr.DataArray, keys: list[str], keep: int) -> Iterator[tuple[str, xr.DataArray]]:
    """Titles and parts of a variable by labels of its dimensions without the keys and the last
    ``keep`` ones."""
    inner = [str(d) for d in field.dims if d not in keys]
    inner = inner[: len(inner) - keep] if keep else inner
    if not inner:
        yield "", field
        return
    for at in np.ndindex(*(field.sizes[d] for d in inner)):
        part = field.isel(dict(zip(inner, at, strict=True)))
        yield ", ".join(label_at(part, d) for d in inner), part


def _panels(field: xr.DataArray, keys: list[str], keep: int) -> list[tuple[str, xr.DataArray]]:
    """Titles and values of the first ``MAX_PANELS`` parts of a variable that are neither empty nor
    rounding beside the largest; keep: see ``parts_of``."""
    largest, alike = float(np.abs(field).max()), "sensor_unit" not in field.coords
    sized = [(title, part, np.abs(part).max()) for title, part in parts_of(field, keys, keep)]
    least = NEGLIGIBLE * largest * alike if largest > 0 else -1.0
    return [(title, part) for title, part, size in sized if size > least][:MAX_PANELS]


def _curves(part: xr.DataArray, key: str, other: str = "") -> list[Curve]:
    """Lines of a variable over ``key``, with a colour for each label or value of the key ``other``;
    modes of one type have one colour."""
    inner = [str(d) for d in part.dims if d != key]
    if not inner:
        return [Curve("", np.asarray(part, dtype=float), PLANET_COLOURS[0])]
    out, largest = [], float(np.nanmax(np.abs(part.to_numpy()), initial=0.0))
    for k, at in enumerate(np.ndindex(*(part.sizes[d] for d in inner))):
        curve = part.isel(dict(zip(inner, at, strict=True)))
        values = np.asarray(curve, dtype=float)
        size = float(np.nanmax(np.abs(values), initial=0.0))
        least = NEGLIGIBLE * largest * ("sensor_unit" not in part.coords)
        if not np.isfinite(values).any() or (largest > 0 and size <= least):
            continue
        if other:
            k = at[inner.index(other)]
            tick, unit = curve[other].item(), part[other].attrs.get("units", "")
            label = f"{f'{tick:g}' if isinstance(tick, float) else tick} {unit}".strip()
        elif inner[-1] == "number":
            kind = str(curve[inner[0]].item())
            out.append(Curve(kind, values, TYPE_COLOURS.get(kind, NEUTRAL)))
            continue
        elif inner[-1] == "mode":
            out.append(Curve("", values, NEUTRAL))
            continue
        else:
            label = ", ".join(label_at(curve, d) for d in inner)
        style = STYLES[(k // len(PLANET_COLOURS)) % len(STYLES)]
        out.append(Curve(label, values, PLANET_COLOURS[k % len(PLANET_COLOURS)], style))
    return out


def _draw(ax: Axes, ticks: xr.DataArray, curves: list[Curve], field: xr.DataArray) -> None:
    """Draw lines of a variable, equal lines with alternating dashes; frequencies and lives, whose
    ratios are more important than differences, on a logarithmic scale where they spread widely."""
    x = _positions(ticks)
    marker = "o" if len(x) <= MAX_MARKERS else ""
    for k, curve in enumerate(curves):
        under = sum(
            np.allclose(curve.values, other.values, rtol=1e-3, atol=0, equal_nan=True)
            for other in curves[:k]
        )
        dashes: Any = (0, (12 / (under + 1), 12 - 12 / (under + 1))) if under else curve.style
        ax.plot(
            x, curve.values, ls=dashes, color=curve.colour, marker="" if under else marker,
            ms=3, lw=1.4, zorder=3 + 0.1 * under, label=curve.label,
        )  # fmt: skip
    _axis(ax, ticks, "x")
    values = np.concatenate([c.values[np.isfinite(c.values)] for c in curves] or [np.ones(1)])
    spread = field.attrs.get("units") == "Hz" or "life" in str(field.name)
    if spread and values.size and values.min() > 0 and values.max() > SPREAD * values.min():
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())
    else:
        least_span(ax, LEAST_SPAN)


def _mark_types(ax: Axes, data: xr.Dataset, field: xr.DataArray, key: str) -> None:
    """Draw markers of modes in the colour of their type."""
    kinds = data["mode_type"].sel({key: field[key]}).transpose(*field.dims).to_numpy()
    values = field.to_numpy()
    x = np.broadcast_to(_positions(field[key])[:, None], values.shape)
    if field.dims[0] != key:
        x = x.T
    for kind in [k for k in TYPE_COLOURS if np.any(kinds == k)]:
        at = kinds == kind
        ax.plot(x[at], values[at], "o", ms=4, color=TYPE_COLOURS[kind], zorder=4, label=kind)


def _axis(ax: Axes, ticks: xr.DataArray, which: str) -> None:
    """Set scale and ticks of the axis of a key: logarithmic, integers, or words."""
    axis = ax.xaxis if which == "x" else ax.yaxis
    if ticks.dtype.kind not in "if":
        axis.set_ticks(range(ticks.size), map(str, ticks.to_numpy()))
        axis.set_minor_locator(NullLocator())
        return
    values = ticks.to_numpy()
    if _logarithmic(ticks):
        (ax.set_xscale if which == "x" else ax.set_yscale)("log")
        if values.max() < WIDE * values.min():  # too few decades for usual ticks
            some = values[:: max(1, len(values) // 6)]
            axis.set_ticks(some, [f"{v:.3g}" for v in some])
            axis.set_minor_formatter(NullFormatter())
    elif np.all(values == np.round(values)) and np.ptp(values) < 20:
        axis.set_major_locator(MaxNLocator(integer=True))


def _logarithmic(ticks: xr.DataArray) -> bool:
    if ticks.dtype.kind not in "if" or ticks.size < 2 or float(ticks.min()) <= 0:
        return False
    return bool(ticks.attrs.get("logarithmic")) or float(ticks.max() / ticks.min()) > 2 * WIDE


def _positions(ticks: xr.DataArray) -> Array:
    if ticks.dtype.kind in "if":
        return np.asarray(ticks, dtype=float)
    return np.arange(ticks.size, dtype=float)


def _first_definition(field: xr.DataArray) -> xr.DataArray:
    """The variable for one definition of load sharing and one statistic, for few panels."""
    for dim, chosen in (("definition", "instantaneous"), ("statistic", "largest")):
        if dim in field.dims:
            field = field.sel({dim: chosen if chosen in field[dim] else field[dim][0]})
    return field


def scale_of(field: xr.DataArray) -> tuple[float, str]:
    """Factor and unit in which a variable is shown."""
    unit = str(field.attrs.get("units", ""))
    if unit in SCALES:
        return SCALES[unit]
    printed, factor = scale(field.to_numpy().ravel(), unit)
    return factor, printed


def _key_label(ticks: xr.DataArray, room: int = WIDE_LABEL) -> str:
    """Label of a key with its unit, in two lines if it has more than ``room`` characters."""
    unit, name = str(ticks.attrs.get("units", "")), str(ticks.attrs.get("long_name", ticks.name))
    if len(name) > room and "." in name:
        start, _, end = name.rpartition(".")
        name = f"{start}.\n{end}"
    return f"{name} ({unit})" if unit else name


def label_at(part: xr.DataArray, dim: str) -> str:
    """Label of a part at one place along a dimension: "mode 3", "stage 1 sun"; of a sensor with its
    SI unit."""
    tick = part[dim].item()
    label = f"{dim} {tick}" if isinstance(tick, int) else words(str(tick))
    if dim != "sensor" or "sensor_unit" not in part.coords:
        return label
    unit = str(part.coords["sensor_unit"].item())
    unit = {"m/s2": "m/s²", "1": "m/m"}.get(unit, unit)
    return f"{label} ({unit})"
