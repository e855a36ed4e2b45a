"""Campbell diagram: frequencies over speed, orders of gear meshes and shafts, and where they meet.

A panel for each stage reaches to the highest of its orders at the highest speed. Modes and orders
have the colour of their nodal index k: a stage of equal planets excites only what has the colour of
the order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flexgear.views.select import variable
from flexgear.views.style import NEUTRAL, PLANET_COLOURS, FloatArray, panels, styled

FORWARD, BACKWARD, STRAIGHT = "#004488", "#BB5566", "#444444"
PALE = "#D8DBE0"
CIRCULAR = 0.05  # least |whirl| that is called a direction
RIGID = 1e-6  # of the highest frequency: below it nothing is strained
LABEL_ROOM = 0.028  # of the picture's height that a label needs
MOST_LABELS = 10  # of meetings in a panel
ABSENT = -2  # nodal index of modes that leave a stage at rest
LEAST_MODES = 3  # elastic ones that a panel shows
ABOVE: Any = {"xytext": (0, 2), "ha": "center", "va": "bottom"}  # matplotlib's own types change
BESIDE: Any = {"xytext": (3, 0), "va": "center"}


@styled
def campbell_chart(data: xr.Dataset, highest: float | None = None) -> Figure:
    """Frequencies over speed with the orders that excite them, a panel a stage; dots where an order
    lies within the margin of a mode at an operating speed, filled where a stage of equal planets is
    excited.

    highest: Hz at the top of all panels (None: a little above the highest order of each).
    """
    stages = _stages(data)
    figure, axes = panels(len(stages), 1, height_mm=30 + 95 * len(stages))
    whirls = bool(np.any(np.abs(np.nan_to_num(_whirl(data))) >= CIRCULAR))
    kinds: set[int] = set()
    for ax, stage in zip(axes[:, 0], stages, strict=True):
        kinds |= _panel(ax, data, stage, highest, whirls)
        if len(stages) > 1:
            ax.set_title(stage.replace("_", " "))
    axes[-1, 0].set_xlabel("speed over rated speed (–)")
    figure.legend(handles=_legend(data, sorted(kinds), whirls), loc="outside lower center", ncols=3)
    return figure


def _stages(data: xr.Dataset) -> list[str]:
    """Stages that something excites, in their order; "" where nothing does."""
    if "excitation" not in data.dims:
        return [""]
    return list(dict.fromkeys(str(s) for s in data["excitation_stage"].to_numpy()))


def _whirl(data: xr.Dataset) -> FloatArray:
    shape = (data.sizes["speed_factor"], data.sizes["mode"])
    return np.asarray(data["whirl"], dtype=float) if "whirl" in data else np.full(shape, np.nan)


def _panel(ax: Axes, data: xr.Dataset, stage: str, highest: float | None, whirls: bool) -> set[int]:
    """One stage; the nodal indices that are drawn."""
    modes = variable(data, "campbell_frequency").transpose("speed_factor", "mode")
    factor = np.asarray(data["speed_factor"], dtype=float)
    values, index = np.asarray(modes, dtype=float), _index(data, stage)
    lines = _of_stage(data, stage)
    slopes = np.asarray(data["excitation_slope"], dtype=float)[lines] if lines.size else np.zeros(0)
    top = highest or _top(values, float(slopes.max(initial=0.0)) * factor[-1])
    margin = float(data.attrs.get("margin", 0.1))
    for speed in np.atleast_1d(data.attrs.get("operating_factors", [1.0])):
        ax.axvspan((1.0 - margin) * speed, (1.0 + margin) * speed, color="#F3F4F6", zorder=0)
        ax.axvline(speed, color=NEUTRAL, lw=0.8)
    whirl = _whirl(data)
    drawn = set[int]()
    for m in range(values.shape[1]):
        ax.plot(factor, values[:, m], color=_mode_colour(index[m], whirl[:, m], whirls), lw=0.8)
        if index[m] >= 0 and values[:, m].min() <= top:
            drawn.add(int(index[m]))
    drawn |= _orders(ax, data, lines, factor, top, whirls)
    _number_modes(ax, values, index, top, factor[0])
    _meetings(ax, data, stage, top)
    ax.set(xlim=(factor[0], factor[-1]), ylim=(0, top))
    ax.set_ylabel("frequency (Hz)")
    return drawn


def _index(data: xr.Dataset, stage: str) -> np.ndarray:
    """Nodal index of every mode in a stage; 0 where none is known."""
    if "campbell_nodal_index" not in data or not stage:
        return np.zeros(data.sizes["mode"], dtype=int)
    return np.asarray(data["campbell_nodal_index"].sel(turning_stage=stage), dtype=int)


def _of_stage(data: xr.Dataset, stage: str) -> np.ndarray:
    """Numbers of the excitations of a stage."""
    if "excitation" not in data.dims:
        return np.zeros(0, dtype=int)
    return np.flatnonzero(data["excitation_stage"].to_numpy() == stage)


def _top(values: FloatArray, excited: float) -> float:
    """Top of a panel: the highest order at the highest speed, or the lowest elastic modes."""
    elastic = np.sort(values[-1][values[-1] > RIGID * np.nanmax(values[-1], initial=0.0)])
    least = float(elastic[: min(LEAST_MODES, elastic.size)].max(initial=1.0))
    return 1.04 * max(least, excited)


def index_colour(index: int) -> str:
    """Colour of a nodal index; of one that is mixed or unknown grey."""
    if index == ABSENT:
        return PALE
    return PLANET_COLOURS[index % len(PLANET_COLOURS)] if index >= 0 else NEUTRAL


def _mode_colour(index: int, whirl: FloatArray, whirls: bool) -> str:
    if not whirls or index == ABSENT:
        return index_colour(index)
    sense = whirl[np.isfinite(whirl)]
    mean = float(sense[-1]) if sense.size else 0.0
    return STRAIGHT if abs(mean) < CIRCULAR else FORWARD if mean > 0 else BACKWARD


def _orders(
    ax: Axes, data: xr.Dataset, lines: np.ndarray, factor: FloatArray, top: float, whirls: bool
) -> set[int]:
    """Rays with their order at the end; the nodal indices that they drive."""
    drawn, labelled = set[int](), list[float]()
    slopes = np.asarray(data["excitation_slope"], dtype=float) if lines.size else np.zeros(0)
    kinds = data["excitation_kind"].to_numpy() if "excitation_kind" in data.coords else None
    for k in lines[np.argsort(-slopes[lines])] if lines.size else ():
        slope, gear_mesh = float(slopes[k]), kinds is None or kinds[k] == "gear mesh"
        index = _order_index(data, int(k))
        colour = NEUTRAL if whirls or not gear_mesh else index_colour(index)
        ax.plot(
            factor, slope * factor, "--" if gear_mesh else ":", color=colour, zorder=2,
            lw=1.0 if gear_mesh else 0.7,
        )  # fmt: skip
        if not gear_mesh:
            continue
        drawn.add(index)
        over = slope * factor[-1] >= top
        at = (top / slope, top) if over else (factor[-1], slope * factor[-1])
        if not over and any(abs(at[1] - y) < LABEL_ROOM * top for y in labelled):
            continue
        labelled.append(at[1] if not over else -top)
        ax.annotate(
            f"{float(data['excitation_order'][k]):g}×", at, textcoords="offset points", fontsize=7,
            color=colour, annotation_clip=False, **(ABOVE if over else BESIDE),
        )  # fmt: skip
    return {k for k in drawn if k >= 0}


def _order_index(data: xr.Dataset, number: int) -> int:
    """min(k, N − k) that an order drives, 0 where none is known."""
    if "excitation_index" not in data:
        return 0
    k = int(data["excitation_index"][number])
    stages = [str(s) for s in data["turning_stage"].to_numpy()]
    planets = np.atleast_1d(data.attrs["planets"])
    count = int(planets[stages.index(str(data["excitation_stage"][number].item()))])
    return min(k % count, -k % count)


def _number_modes(
    ax: Axes, values: FloatArray, index: np.ndarray, top: float, start: float
) -> None:
    """Numbers of the modes at rest, those of one frequency together, where there is room."""
    at_rest = values[0]
    free, i = -np.inf, 0
    while i < len(at_rest):
        last = i
        while last + 1 < len(at_rest) and at_rest[last + 1] - at_rest[i] <= 1e-3 * at_rest[i]:
            last += 1
        f = float(at_rest[i])
        if LABEL_ROOM * top <= f < 0.99 * top and index[i] != ABSENT and f >= free:
            text = f"{i + 1}" + (f"–{last + 1}" if last > i else "")
            ax.annotate(
                text, (start, f), textcoords="offset points", xytext=(2, 1), fontsize=6,
                color=NEUTRAL, va="bottom",
            )  # fmt: skip
            free = f + LABEL_ROOM * top
        i = last + 1


def _meetings(ax: Axes, data: xr.Dataset, stage: str, top: float) -> None:
    """Dots where an order crosses the modes that it meets at an operating speed, names beside."""
    if "meeting" not in data.dims or not data.sizes["meeting"]:
        return
    place_of = {str(n): k for k, n in enumerate(data["excitation"].to_numpy())}
    of_stage = data["excitation_stage"].to_numpy()
    groups: dict[tuple[str, float, float], list[int]] = {}
    for i in range(data.sizes["meeting"]):
        label = str(data["meeting_excitation"][i].item())
        if str(of_stage[place_of[label]]) == stage:
            factor, away = (float(data[f"meeting_{n}"][i]) for n in ("factor", "away"))
            groups.setdefault((label, factor, away), []).append(i)
    labelled = list[tuple[float, float]]()
    for (label, factor, away), meetings in sorted(
        groups.items(), key=lambda item: (not _is_ideal(data, item[1][0]), abs(item[0][2]))
    ):
        natural = float(data["meeting_frequency"][meetings[0]]) / (1.0 + away)
        x, ideal = factor / (1.0 + away), _is_ideal(data, meetings[0])
        ax.plot(
            x, natural, "o", ms=3.6, zorder=5, color="black" if ideal else "white",
            markeredgecolor="black", markeredgewidth=0.7,
        )  # fmt: skip
        room = all(abs(natural - y) >= LABEL_ROOM * top for _, y in labelled)
        if natural < top and room and len(labelled) < MOST_LABELS:
            labelled.append((x, natural))
            numbers = [int(data["meeting_mode"][i]) for i in meetings]
            modes = f"{numbers[0]}" + (f"–{numbers[-1]}" if len(numbers) > 1 else "")
            order = float(data["excitation_order"][place_of[label]])
            ax.annotate(
                f"{order:g}× at {modes}", (x, natural), fontsize=6.5, textcoords="offset points",
                xytext=(-4, 0), ha="right", va="center", zorder=6,
                bbox={"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8},
            )  # fmt: skip


def _is_ideal(data: xr.Dataset, meeting: int) -> bool:
    return str(data["meeting_cause"][meeting].item()) == "ideal"


def _legend(data: xr.Dataset, kinds: list[int], whirls: bool) -> list[Line2D]:
    """What lines, colours and dots are."""
    out = [Line2D([], [], color=NEUTRAL, ls="--", lw=1.0, label="orders of gear meshes")]
    if "excitation_kind" in data.coords:
        out.append(Line2D([], [], color=NEUTRAL, ls=":", lw=0.9, label="shafts, passing planets"))
    if whirls:
        out += [
            Line2D([], [], color=STRAIGHT, label="mode"),
            Line2D([], [], color=FORWARD, label="forward whirl"),
            Line2D([], [], color=BACKWARD, label="backward whirl"),
        ]
    elif "campbell_nodal_index" in data:
        out += [Line2D([], [], color=index_colour(k), label=f"k = {k}: {_kind(k)}") for k in kinds]
    else:
        out.append(Line2D([], [], color=index_colour(0), label="mode"))
    if "meeting" in data.dims and data.sizes["meeting"]:
        within = f"within {100 * float(data.attrs.get('margin', 0.1)):.0f} %"
        for fill, cause in (("black", "equal planets excite it"), ("white", "errors alone do")):
            dot = Line2D([], [], color="black", ls="", marker="o", ms=3.6)
            dot.set_markerfacecolor(fill)
            dot.set_label(f"{within}, {cause}")
            out.append(dot)
    return out


def _kind(index: int) -> str:
    """How modes of an index move."""
    return {0: "turning, axial", 1: "sideways, tilting"}.get(index, "planets alone")
