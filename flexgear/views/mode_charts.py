"""Charts of natural modes by frequency, type and energy, and the Campbell diagram."""

import math
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import NullFormatter

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.views.select import variable
from flexgear.views.style import NEUTRAL, PLANET_COLOURS, legend_of, panels, styled

TYPE_COLOURS = {
    "rotational": "#D55E00",
    "translational": "#0072B2",
    "planet": "#009E73",
    "axial": "#E69F00",
    "tilting": "#CC79A7",
    "rotational-axial": "#8C6D1F",
    "translational-tilting": "#56B4E9",
    "elastic": "#444444",
    "mixed": NEUTRAL,
    "rigid": "#B7BCC4",
}
OTHER_COLOUR = "#D8DBE0"
MAX_MODES = 40  # rows of the chart
MAX_SPRINGS = 7  # kinds with a colour
LEAST_SHARE = 1e-3  # of an energy, that has a visible bar


@styled
def modes_chart(data: xr.Dataset) -> Figure:
    """Frequency by type, kinetic energy by motion and strain energy by spring of the lowest modes.

    Modes of equal frequency and type have one row.
    """
    frequency = np.asarray(variable(data, "frequency"), dtype=float)
    kinds = [str(k) for k in variable(data, "type").to_numpy()]
    distinct = _distinct(frequency, kinds)
    rows = distinct[:MAX_MODES]
    if not rows:
        raise FlexgearError("cannot draw: the dataset has no modes")
    shares = [
        (title, part)
        for title, part in (
            ("kinetic energy", _shares(data, "motion_energy", rows)),
            ("strain energy", _summed_springs(_shares(data, "strain_energy", rows), _stages(data))),
        )
        if part
    ]
    figure, axes = panels(
        1, 1 + len(shares), height_mm=34 + 4.2 * len(rows), sharey=True,
        width_ratios=[1.3, *[1.0, 1.25][: len(shares)]],
    )  # fmt: skip
    at = np.arange(len(rows))
    _frequencies(axes[0, 0], frequency, kinds, rows)
    for ax, (title, part) in zip(axes[0, 1:], shares, strict=True):
        start = np.zeros(len(rows))
        colours = _share_colours(part)
        for name, share in part.items():
            seen = share >= min(LEAST_SHARE, share.max())
            ax.barh(
                at[seen], 100 * share[seen], 0.75, left=start[seen], color=colours[name], label=name
            )
            start = start + 100 * share
        ax.set(xlim=(0, 100), xlabel=f"share of {title} (%)")
        ax.grid(axis="y", visible=False)
        ax.legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=7, handlelength=1.0,
            columnspacing=1.0,
        )  # fmt: skip
    used = dict.fromkeys(kinds[r[0]] for r in rows)
    axes[0, 0].legend(
        handles=[Patch(color=_type_colour(k), label=k) for k in used],
        loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=7, handlelength=1.0,
    )  # fmt: skip
    axes[0, 0].set_ylim(len(rows) - 0.4, -0.6)
    if len(distinct) > len(rows):
        last, count = frequency[distinct[-1][0]], len(distinct)
        text = f"the lowest {len(rows)} of {count} frequencies (up to {last:.5g} Hz)"
        figure.suptitle(text, fontsize=8.5)
    return figure


def _distinct(frequency: Array, kinds: list[str]) -> list[list[int]]:
    """Indices of the modes of each row, those of one frequency and type."""
    rows: dict[tuple[int, str], list[int]] = {}
    for k, modes in enumerate(_repeated(frequency, 1e-6)):
        for i in modes.tolist():
            rows.setdefault((k, kinds[i]), []).append(i)
    return list(rows.values())


def _repeated(frequency: Array, share: float) -> list[np.ndarray]:
    """Groups of modes with equal frequency, within ``share``; frequencies rise."""
    separated = np.diff(frequency) > share * frequency[:-1]
    return np.split(np.arange(len(frequency)), np.flatnonzero(separated) + 1)


def _frequencies(ax: Axes, frequency: Array, kinds: list[str], rows: list[list[int]]) -> None:
    """Draw a line to each frequency on a logarithmic axis, with its value at the end."""
    elastic = [frequency[r[0]] for r in rows if frequency[r[0]] > 0]
    low = 0.5 * min(elastic, default=1.0)
    high = max(elastic, default=10.0)
    ends = np.maximum(frequency[[r[0] for r in rows]], low)
    types = np.array([kinds[r[0]] for r in rows])
    for kind in dict.fromkeys(types.tolist()):
        at = np.flatnonzero(types == kind)
        ax.hlines(at, low, ends[at], colors=_type_colour(kind), lw=1.6, label=kind)
        ax.scatter(ends[at], at, 3.5**2, _type_colour(kind), label=kind)
    for k, row in enumerate(rows):
        f = frequency[row[0]]
        times = f" ×{len(row)}" if len(row) > 1 else ""
        ax.annotate(
            f"{f:.5g}{times}", (max(f, low), k), xytext=(5, 0), textcoords="offset points",
            va="center", fontsize=7,
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_xlim(low, last := high * (high / low) ** 0.35)
    if math.ceil(math.log10(low)) <= math.log10(last):  # decades alone have room for labels
        ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_yticks(range(len(rows)), [str(row[0] + 1) for row in rows])
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("natural frequency (Hz)")
    ax.set_ylabel("number of the mode")


def _stages(data: xr.Dataset) -> set[str]:
    """Names of the stages of all bodies."""
    if "body" not in data.coords:
        return set()
    return {BodyName.parse(n).stage for n in data["body"].to_numpy()}


def _shares(data: xr.Dataset, name: str, rows: list[list[int]]) -> dict[str, Array]:
    """Mean share of an energy in each row by part, without parts that have none in all rows."""
    if name not in data:
        return {}
    field = data[name].transpose("mode", ...)
    values = np.asarray(field, dtype=float)
    parts = [str(p) for p in field[str(field.dims[1])].to_numpy()]
    means = np.array([values[row].mean(axis=0) for row in rows])
    return {p: means[:, k] for k, p in enumerate(parts) if np.nanmax(means[:, k]) > 5e-3}


def _summed_springs(shares: Mapping[str, Array], stages: set[str]) -> dict[str, Array]:
    """Shares of springs summed by kind over planets and stages; kinds of small shares as
    "others"."""
    kinds: dict[str, Array] = {}
    for name, share in shares.items():
        kind = _spring_kind(name, stages)
        kinds[kind] = kinds.get(kind, 0.0) + share
    order = sorted(kinds, key=lambda k: -float(np.nanmax(kinds[k])))
    out = {k: kinds[k] for k in order[:MAX_SPRINGS]}
    rest = [kinds[k] for k in order[MAX_SPRINGS:]]
    return {**out, "others": np.sum(rest, axis=0)} if rest else out


def _spring_kind(name: str, stages: set[str]) -> str:
    """Kind of a spring: stage_1.planet_bearing_2 -> planet bearing; stage_2.sun-stage_3.gear ->
    joint."""
    if any(f"-{s}." in name for s in stages):
        return "joint"
    for stage in stages:
        name = re.sub(rf"^{re.escape(stage)}[. ]", "", name)
    name = re.sub(r"[ _]?\d+$", "", name).replace("_", " ").replace(".", " ")
    return re.sub(r" (left|right)\b", "", name)


def _share_colours(parts: Mapping[str, Array]) -> dict[str, str]:
    if all(p in TYPE_COLOURS for p in parts):
        return {p: TYPE_COLOURS[p] for p in parts}
    colours = {p: PLANET_COLOURS[k % len(PLANET_COLOURS)] for k, p in enumerate(parts)}
    return {**colours, "others": OTHER_COLOUR}


def _type_colour(kind: str) -> str:
    return TYPE_COLOURS.get(kind, NEUTRAL)


MOTIONS = {0: "turning, axial", 1: "sideways, tilting"}  # of modes by nodal index
FORWARD, BACKWARD, STRAIGHT = "#004488", "#BB5566", "#444444"
PALE = "#D8DBE0"
CIRCULAR = 0.05  # least |whirl| of a forward or backward mode
RIGID = 1e-6  # of the highest frequency: a mode below is rigid
LABEL_HEIGHT = 0.028  # of the height of a panel
MAX_LABELS = 10  # of meetings in a panel
ABSENT = -2  # nodal index of modes without motion of a stage
MAX_WIDE_LINES = 60  # in a panel at full width
LEAST_MODES = 3  # elastic ones in a panel
ABOVE: Any = {"xytext": (0, 2), "ha": "center", "va": "bottom"}  # types of matplotlib change
BESIDE: Any = {"xytext": (3, 0), "va": "center"}
ON_WHITE: Any = {"boxstyle": "square,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.8}


@styled
def campbell_chart(data: xr.Dataset) -> Figure:
    """Campbell diagram with a panel for each stage: natural frequencies and orders of excitation
    over speed; dots where an order is within the margin of a mode at an operating speed, filled if
    it excites the mode even in a stage with equal planets."""
    stages = list(dict.fromkeys(map(str, data["excitation_stage"].to_numpy()))) or [""]
    figure, axes = panels(len(stages), 1, height_mm=30 + 95 * len(stages))
    whirls = bool(np.any(np.abs(np.nan_to_num(data["whirl"].to_numpy())) >= CIRCULAR))
    for ax, stage in zip(axes[:, 0], stages, strict=True):
        _panel(ax, data, stage, whirls)
        if len(stages) > 1:
            ax.set_title(stage.replace("_", " "))
    axes[-1, 0].set_xlabel("speed over rated speed (–)")
    legend_of(figure, 3)
    return figure


def _panel(ax: Axes, data: xr.Dataset, stage: str, whirls: bool) -> None:
    """Draw the panel of one stage."""
    factor = np.asarray(data["speed_factor"], dtype=float)
    values, whirl = (data[n].to_numpy().astype(float) for n in ("campbell_frequency", "whirl"))
    index = np.zeros(data.sizes["mode"], dtype=int)
    if stage:
        index = data["campbell_nodal_index"].sel(turning_stage=stage).to_numpy()
    lines = np.flatnonzero(data["excitation_stage"].to_numpy() == stage)
    slopes = data["excitation_slope"].to_numpy()[lines]
    top = _top(values, float(slopes.max(initial=0.0)) * factor[-1])
    margin = float(data.attrs["margin"])
    for speed in np.atleast_1d(data.attrs["operating_factors"]):
        ax.axvspan((1.0 - margin) * speed, (1.0 + margin) * speed, color="#F3F4F6", zorder=0)
        ax.axvline(speed, color=NEUTRAL, lw=0.8)
    width = 0.8 * min(1.0, MAX_WIDE_LINES / (1.0 + float((values.min(axis=0) <= top).sum())))
    for m in range(values.shape[1]):
        colour, label = _mode_look(index[m], whirl[:, m], whirls)
        label = label if values[:, m].min() <= top else ""
        ax.plot(factor, values[:, m], color=colour, lw=width, label=label)
    _orders(ax, data, lines, factor, top, whirls)
    _number_modes(ax, values, index, top, factor[0])
    _meetings(ax, data, stage, top)
    ax.set(xlim=(factor[0], factor[-1]), ylim=(0, top))
    ax.set_ylabel("frequency (Hz)")


def _top(values: Array, excited: float) -> float:
    """Upper limit of a panel, Hz: covers the highest order and the lowest elastic modes."""
    elastic = np.sort(values[-1][values[-1] > RIGID * np.nanmax(values[-1], initial=0.0)])
    least = float(elastic[: min(LEAST_MODES, elastic.size)].max(initial=1.0))
    return 1.04 * max(least, excited)


def index_colour(index: int) -> str:
    """Colour of a nodal index; grey for a mixed or unknown index."""
    if index == ABSENT:
        return PALE
    return PLANET_COLOURS[index % len(PLANET_COLOURS)] if index >= 0 else NEUTRAL


def _mode_look(index: int, whirl: Array, whirls: bool) -> tuple[str, str]:
    """Colour and label of a mode: by its direction of whirl if modes of the case whirl, else by its
    index; without a label for a mixed or unknown index."""
    if index == ABSENT:
        return PALE, "without motion of the stage"
    if not whirls:
        label = f"k = {index}: {MOTIONS.get(index, 'planets alone')}" if index >= 0 else ""
        return index_colour(index), label
    sense = whirl[np.isfinite(whirl)]
    mean = float(sense[-1]) if sense.size else 0.0
    if abs(mean) < CIRCULAR:
        return STRAIGHT, "mode"
    return (FORWARD, "forward whirl") if mean > 0 else (BACKWARD, "backward whirl")


def _orders(
    ax: Axes, data: xr.Dataset, lines: np.ndarray, factor: Array, top: float, whirls: bool
) -> None:
    """Draw excitations as rays with their order at the end, in the colour of the modes that they
    excite."""
    labelled = list[float]()
    slopes, kinds = (data[f"excitation_{name}"].to_numpy() for name in ("slope", "kind"))
    for k in lines[np.argsort(-slopes[lines])]:
        slope, gear_mesh = float(slopes[k]), kinds[k] == "gear mesh"
        index = _order_index(data, int(k))
        colour = NEUTRAL if whirls or not gear_mesh else index_colour(index)
        label = "shafts, passing planets"
        if gear_mesh:
            label = "orders of gear meshes" + ("" if whirls else f", k = {index}")
        ax.plot(
            factor, slope * factor, "--" if gear_mesh else ":", color=colour, zorder=2,
            lw=1.0 if gear_mesh else 0.7, label=label,
        )  # fmt: skip
        if not gear_mesh:
            continue
        over = slope * factor[-1] >= top
        at = (top / slope, top) if over else (factor[-1], slope * factor[-1])
        if not over and any(abs(at[1] - y) < LABEL_HEIGHT * top for y in labelled):
            continue
        labelled.append(at[1] if not over else -top)
        ax.annotate(
            f"{float(data['excitation_order'][k]):g}×", at, textcoords="offset points", fontsize=7,
            color=colour, annotation_clip=False, **(ABOVE if over else BESIDE),
        )  # fmt: skip


def _order_index(data: xr.Dataset, number: int) -> int:
    """Nodal index min(k, N − k) that an order excites."""
    k = int(data["excitation_index"][number])
    stages = [str(s) for s in data["turning_stage"].to_numpy()]
    planets = np.atleast_1d(data.attrs["planets"])
    count = int(planets[stages.index(str(data["excitation_stage"][number].item()))])
    return min(k % count, -k % count)


def _number_modes(ax: Axes, values: Array, index: np.ndarray, top: float, start: float) -> None:
    """Write the numbers of the modes at zero speed, one text for each distinct frequency if it has
    room."""
    free = LABEL_HEIGHT * top
    for modes in _repeated(values[0], 1e-3):
        first, last = int(modes[0]), int(modes[-1])
        f = float(values[0, first])
        if free <= f < 0.99 * top and index[first] != ABSENT:
            text = f"{first + 1}" + (f"–{last + 1}" if last > first else "")
            ax.annotate(
                text, (start, f), textcoords="offset points", xytext=(2, 1), fontsize=6,
                color=NEUTRAL, va="bottom", bbox=ON_WHITE,
            )  # fmt: skip
            free = f + LABEL_HEIGHT * top


def _meetings(ax: Axes, data: xr.Dataset, stage: str, top: float) -> None:
    """Draw dots where orders meet modes at an operating speed, the first ones with labels."""
    place_of = {str(n): k for k, n in enumerate(data["excitation"].to_numpy())}
    of_stage = data["excitation_stage"].to_numpy()
    groups: dict[tuple[str, float, float], list[int]] = {}
    for i in range(data.sizes["meeting"]):
        label = str(data["meeting_excitation"][i].item())
        if str(of_stage[place_of[label]]) == stage:
            factor, detuning = (float(data[f"meeting_{n}"][i]) for n in ("factor", "away"))
            groups.setdefault((label, factor, detuning), []).append(i)
    labelled, within = list[float](), f"within {100 * float(data.attrs['margin']):.0f} %"
    for (label, factor, detuning), meetings in sorted(
        groups.items(), key=lambda item: (not _is_ideal(data, item[1][0]), abs(item[0][2]))
    ):
        natural = float(data["meeting_frequency"][meetings[0]]) / (1.0 + detuning)
        x, ideal = factor / (1.0 + detuning), _is_ideal(data, meetings[0])
        cause = "excited by perfect gears" if ideal else "only by errors"
        ax.plot(
            x, natural, "o", ms=3.6, zorder=5 + ideal, color="black" if ideal else "white",
            markeredgecolor="black", markeredgewidth=0.7, label=f"{within}, {cause}",
        )  # fmt: skip
        has_room = all(abs(natural - y) >= LABEL_HEIGHT * top for y in labelled)
        if natural < top and has_room and len(labelled) < MAX_LABELS:
            labelled.append(natural)
            numbers = [int(data["meeting_mode"][i]) for i in meetings]
            modes = f"{numbers[0]}" + (f"–{numbers[-1]}" if len(numbers) > 1 else "")
            order = float(data["excitation_order"][place_of[label]])
            ax.annotate(
                f"{order:g}× at {modes}", (x, natural), fontsize=6.5, textcoords="offset points",
                xytext=(-4, 0), ha="right", va="center", zorder=6,
                bbox=ON_WHITE,
            )  # fmt: skip


def _is_ideal(data: xr.Dataset, meeting: int) -> bool:
    return str(data["meeting_cause"][meeting].item()) == "ideal"
