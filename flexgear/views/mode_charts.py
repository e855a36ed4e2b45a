"""Natural modes by frequency, type and energy."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.views.select import variable
from flexgear.views.style import (
    NEUTRAL,
    PLANET_COLOURS,
    FloatArray,
    panels,
    styled,
)

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
MOST_MODES = 40
MOST_SPRINGS = 7
LEAST_SHARE = 1e-3  # of an energy: a thinner bar would not be seen


@styled
def modes_chart(data: xr.Dataset, most: int = MOST_MODES) -> Figure:
    """Modes from the lowest up: frequency by type, kinetic energy by motion, strain energy.

    Repeated frequencies of one type are one row.
    """
    frequency = np.asarray(variable(data, "frequency"), dtype=float)
    kinds = [str(k) for k in variable(data, "type").to_numpy()]
    every = _distinct(frequency, kinds)
    rows = every[:most]
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
    if len(every) > len(rows):
        last = frequency[every[-1][0]]
        figure.suptitle(f"the lowest {len(rows)} of {len(every)} frequencies (up to {last:.5g} Hz)",
                        fontsize=8.5)  # fmt: skip
    return figure


def _distinct(frequency: FloatArray, kinds: list[str]) -> list[list[int]]:
    """Modes by row: those of one frequency and type together."""
    rows: list[list[int]] = []
    for i, f in enumerate(frequency):
        same = [r for r in rows if kinds[r[0]] == kinds[i]
                and abs(f - frequency[r[0]]) <= 1e-6 * max(f, 1e-9)]  # fmt: skip
        if same:
            same[-1].append(i)
        else:
            rows.append([i])
    return rows


def _frequencies(ax: Axes, frequency: FloatArray, kinds: list[str], rows: list[list[int]]) -> None:
    """A line from the axis to each frequency, its value beside it; logarithmic."""
    elastic = [frequency[r[0]] for r in rows if frequency[r[0]] > 0]
    low = 0.5 * min(elastic, default=1.0)
    high = max(elastic, default=10.0)
    ends = np.maximum(frequency[[r[0] for r in rows]], low)
    types = np.array([kinds[r[0]] for r in rows])
    for kind in dict.fromkeys(types.tolist()):
        at = np.flatnonzero(types == kind)
        ax.hlines(at, low, ends[at], colors=_type_colour(kind), lw=1.6)
        ax.scatter(ends[at], at, 3.5**2, _type_colour(kind))
    for k, row in enumerate(rows):
        f = frequency[row[0]]
        times = f" ×{len(row)}" if len(row) > 1 else ""
        ax.annotate(
            f"{f:.5g}{times}", (max(f, low), k), xytext=(5, 0), textcoords="offset points",
            va="center", fontsize=7,
        )  # fmt: skip
    ax.set_xscale("log")
    ax.set_xlim(low, high * (high / low) ** 0.35)
    ax.set_yticks(range(len(rows)), [str(row[0] + 1) for row in rows])
    ax.grid(axis="y", visible=False)
    ax.set_xlabel("natural frequency (Hz)")
    ax.set_ylabel("number of the mode")


def _stages(data: xr.Dataset) -> set[str]:
    """Names of the stages, which stand before the names of bodies."""
    if "body" not in data.coords:
        return set()
    return {BodyName.parse(n).stage for n in data["body"].to_numpy()}


def _shares(data: xr.Dataset, name: str, rows: list[list[int]]) -> dict[str, FloatArray]:
    """Mean shares of energy by part in each row, parts that are nowhere left out."""
    if name not in data:
        return {}
    field = data[name].transpose("mode", ...)
    values = np.asarray(field, dtype=float)
    parts = [str(p) for p in field[str(field.dims[1])].to_numpy()]
    means = np.array([values[row].mean(axis=0) for row in rows])
    return {p: means[:, k] for k, p in enumerate(parts) if np.nanmax(means[:, k]) > 5e-3}


def _summed_springs(shares: Mapping[str, FloatArray], stages: set[str]) -> dict[str, FloatArray]:
    """Springs of the same kind together, over planets and stages; rare kinds as "others"."""
    kinds: dict[str, FloatArray] = {}
    for name, share in shares.items():
        kind = _spring_kind(name, stages)
        kinds[kind] = kinds.get(kind, 0.0) + share
    order = sorted(kinds, key=lambda k: -float(np.nanmax(kinds[k])))
    out = {k: kinds[k] for k in order[:MOST_SPRINGS]}
    rest = [kinds[k] for k in order[MOST_SPRINGS:]]
    return {**out, "others": np.sum(rest, axis=0)} if rest else out


def _spring_kind(name: str, stages: set[str]) -> str:
    """stage_1.planet_bearing_2 -> planet bearing; stage_2.sun-stage_3.gear -> joint."""
    if any(f"-{s}." in name for s in stages):
        return "joint"
    for stage in stages:
        name = re.sub(rf"^{re.escape(stage)}[. ]", "", name)
    name = re.sub(r"[ _]?\d+$", "", name).replace("_", " ").replace(".", " ")
    return re.sub(r" (left|right)\b", "", name)


def _share_colours(parts: Mapping[str, FloatArray]) -> dict[str, str]:
    if all(p in TYPE_COLOURS for p in parts):
        return {p: TYPE_COLOURS[p] for p in parts}
    colours = {p: PLANET_COLOURS[k % len(PLANET_COLOURS)] for k, p in enumerate(parts)}
    return {**colours, "others": OTHER_COLOUR}


def _type_colour(kind: str) -> str:
    return TYPE_COLOURS.get(kind, NEUTRAL)
