"""Frequency response with all branches: largest gear-mesh force and swing of the transmission error
over speed or torque, what is stable, where a sweep jumps and where teeth lose contact."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from flexgear.arrays import Array
from flexgear.views.style import KILO, MICRO, NEUTRAL, PLANET_COLOURS, legend_below, panels, styled

UP, DOWN, CHANGE = "#C5221F", "#2166AC", "#444444"
LOST, BACK = "#F7CFA3", "#E59C8C"
BROAD = 6.0  # points
MOST_GEAR_MESHES = len(PLANET_COLOURS)
HIGHEST = 20.0  # times the middle force of stable states: what grows beyond is cut off, and said


class Piece(NamedTuple):
    """States from ``start`` to ``stop`` − 1 of one curve that are all stable, or all unstable."""

    start: int
    stop: int
    stable: bool


@styled
def response_chart(data: xr.Dataset) -> Figure:
    """Largest and smallest gear-mesh force, and swing of the transmission error. Solid: stable,
    dashed: unstable; arrows: where a sweep jumps, and to what force; broad below: where teeth lose
    contact, and where their backs touch."""
    x = _parameter(data)
    figure, axes = panels(2, 1, height_mm=150, sharex=True, height_ratios=[1.6, 1.0])
    force, error = axes[:, 0]
    names = [str(n) for n in data["gear_mesh"].to_numpy()][:MOST_GEAR_MESHES]
    error_range = _measure(data, "response_transmission_error", "maximum")
    error_range = error_range - _measure(data, "response_transmission_error", "minimum")
    for k in range(len(names)):
        colour = PLANET_COLOURS[k]
        for measure, width in (("maximum", 1.4), ("minimum", 0.8)):
            values = KILO * _measure(data, "response_gear_mesh_force", measure)[:, k]
            _curve(force, data, x, values, colour, width)
            if measure == "maximum":
                _contact(force, data, x, values, k)
        _curve(error, data, x, MICRO * error_range[:, k], colour, 1.2)
        _contact(error, data, x, MICRO * error_range[:, k], k)
    for ax in (force, error):
        _limit(ax)
        ax.set_xlim(float(x.min()), float(x.max()))
    _jumps(force, data)
    _changes(force, data)
    force.set_ylabel("gear-mesh force, largest and smallest (kN)")
    error.set_ylabel("swing of transmission error (µm)")
    error.set_xlabel(f"{data.attrs['over']} over rated {data.attrs['over']} (–)")
    legend_below(figure, _legend(data, names), 3)
    return figure


def _parameter(data: xr.Dataset) -> Array:
    """Speed, or torque, of every steady state over its rated value (n,)."""
    return data[f"response_{data.attrs['over']}_share"].to_numpy().astype(float)


def _measure(data: xr.Dataset, name: str, measure: str) -> Array:
    """A measure of all gear meshes (n, g)."""
    return data[name].sel(measure=measure).to_numpy().astype(float)


def pieces(data: xr.Dataset) -> Iterator[Piece]:
    """Stretches of one curve and stability, in the order of the states."""
    stable, branch = data["stable"].to_numpy() == 1, data["response_branch"].to_numpy()
    cuts = np.flatnonzero((np.diff(stable.astype(int)) != 0) | (np.diff(branch) != 0)) + 1
    starts = [0, *cuts.tolist(), len(stable)]
    for start, stop in itertools.pairwise(starts):
        yield Piece(start, stop, bool(stable[start]))


def _curve(ax: Axes, data: xr.Dataset, x: Array, y: Array, colour: str, width: float) -> None:
    """Values of all curves; neighbouring stretches of a curve join where stability changes."""
    branch = data["response_branch"].to_numpy()
    for piece in pieces(data):
        joined = piece.stop < len(x) and branch[piece.stop] == branch[piece.start]
        at = slice(piece.start, piece.stop + joined)
        style = "-" if piece.stable else (0, (3, 1.6))
        faint = 1.0 if piece.stable else 0.65
        ax.plot(x[at], y[at], linestyle=style, color=colour, lw=width * faint)


def _limit(ax: Axes) -> None:
    """From zero up to the highest state, or to ``HIGHEST`` and a line that says so."""
    highest = max(float(np.max(line.get_ydata())) for line in ax.lines)
    top = HIGHEST * _middle(ax)
    if highest <= top or top <= 0.0:
        ax.set_ylim(0.0, 1.06 * highest)
        return
    ax.set_ylim(0.0, top)
    ax.text(0.99, 0.97, f"states go on up to {highest:.3g}", transform=ax.transAxes, ha="right",
            va="top", fontsize=7.5, color=NEUTRAL)  # fmt: skip


def _middle(ax: Axes) -> float:
    """Median of what solid lines show, each value by its share of the parameter."""
    values, widths = [np.zeros(0)], [np.zeros(0)]
    solid = (n for n in ax.lines if n.get_linestyle() == "-" and n.get_linewidth() < BROAD)
    for line in solid:
        x, y = (np.asarray(v, dtype=float) for v in line.get_data())
        values.append(0.5 * (y[1:] + y[:-1]))
        widths.append(np.abs(np.diff(x)))
    value, width = np.concatenate(values), np.concatenate(widths)
    if not width.sum():
        return 0.0
    order = np.argsort(value)
    return float(value[order][np.searchsorted(np.cumsum(width[order]), 0.5 * width.sum())])


def _contact(ax: Axes, data: xr.Dataset, x: Array, y: Array, mesh: int) -> None:
    """A broad line below a curve where teeth of a gear mesh part, and where their backs touch."""
    branch = data["response_branch"].to_numpy()
    for name, colour in (("lost_contact_share", LOST), ("back_contact_share", BACK)):
        at = np.flatnonzero(data[name].to_numpy()[:, mesh] > 0.0)
        apart = (np.diff(at) > 1) | (np.diff(branch[at]) != 0)
        for run in np.split(at, np.flatnonzero(apart) + 1) if len(at) else []:
            ax.plot(x[run], y[run], color=colour, lw=BROAD, solid_capstyle="butt", zorder=1)


def _jumps(ax: Axes, data: xr.Dataset) -> None:
    """An arrow from each turning point to the force that a sweep jumps to; a triangle alone where
    that is not known."""
    for k in range(data.sizes.get("turning_point", 0)):
        row = data.isel(turning_point=k)
        rising = int(row["turning_point_sense"]) > 0
        colour, marker = (UP, ">") if rising else (DOWN, "<")
        x, y = float(row["turning_point_parameter"]), KILO * float(row["turning_point_force"])
        ax.plot([x], [y], marker, color=colour, ms=4.5, zorder=4)
        target = KILO * float(row["turning_point_target_force"])
        if np.isfinite(target):
            arrow = {"arrowstyle": "-|>", "color": colour, "lw": 0.9, "shrinkA": 3, "shrinkB": 0}
            ax.annotate("", (x, target), (x, y), arrowprops=arrow, zorder=4).set_in_layout(False)


def _changes(ax: Axes, data: xr.Dataset) -> None:
    """Marks at the foot of the panel where stability changes without a turning point."""
    if "stability_change" not in data.sizes:
        return
    apart = data["stability_change_kind"].to_numpy() != 0
    if apart.any():
        at = data["stability_change_parameter"].to_numpy()[apart]
        ax.plot(at, np.zeros(len(at)), "d", color=CHANGE, ms=4, clip_on=False, zorder=4)


def _legend(data: xr.Dataset, names: list[str]) -> list[Any]:
    """What lines, marks and shades mean."""
    handles: list[Any] = []
    if len(names) > 1:
        handles += [
            Line2D([], [], color=PLANET_COLOURS[k], lw=1.4, label=name)
            for k, name in enumerate(names)
        ]
    colour = PLANET_COLOURS[0] if len(names) == 1 else NEUTRAL
    handles += [
        Line2D([], [], color=colour, lw=1.4, label="stable"),
        Line2D([], [], color=colour, lw=0.9, ls=(0, (3, 1.6)), label="unstable"),
    ]
    sense = np.asarray(data.get("turning_point_sense", 0))
    if np.any(sense > 0):
        handles.append(_mark(UP, ">", f"jump as {data.attrs['over']} rises"))
    if np.any(sense < 0):
        handles.append(_mark(DOWN, "<", f"jump as {data.attrs['over']} falls"))
    if np.any(np.asarray(data.get("stability_change_kind", 0)) != 0):
        handles.append(_mark(CHANGE, "d", "period doubles, or beats begin"))
    if np.any(data["lost_contact_share"].to_numpy() > 0.0):
        handles.append(Patch(color=LOST, label="teeth lose contact"))
    if np.any(data["back_contact_share"].to_numpy() > 0.0):
        handles.append(Patch(color=BACK, label="backs touch, too"))
    return handles


def _mark(colour: str, marker: str, label: str) -> Line2D:
    return Line2D([], [], color=colour, marker=marker, ls="none", ms=4.5, label=label)
