"""Tooth loads and gear-mesh states over the carrier angle (Tan 2023, Figures 7, 11, 12, 17, 18).

Stiffness split (eq. 23): F_l = k_l / Σ k · Σ F over the pairs l of one planet's gear mesh.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from flexgear.arrays import Array
from flexgear.results.stage_part import carrying_flank, carrying_pairs, stiffness_split
from flexgear.views.select import (
    Runs,
    Window,
    abscissa,
    leading_dim,
    planet_count,
    thinned,
    windowed,
)
from flexgear.views.style import (
    KILO,
    N_PER_M_TO_N_PER_UM,
    NEUTRAL,
    SEQUENTIAL_MAP,
    SPLIT_COLOUR,
    angle_axis,
    legend_below,
    legend_lines,
    panels,
    planet_colour,
    styled,
    variant_colours,
)

LABELS = {"ring": "ring–planet", "sun": "sun–planet"}
MOST_SAMPLES = 4000  # of a map over the carrier angle


def pair_curves(x: Array, tooth: Array, value: Array) -> dict[int, tuple[Array, Array]]:
    """Curve of each engaged tooth from (n, slots) arrays, broken (NaN) between engagements.

    ``tooth`` is 1-based, 0 = empty slot. A tooth may change its slot from sample to sample.
    """
    curves = {}
    for number in np.unique(tooth[tooth > 0]).tolist():
        here = tooth == number
        rows = np.flatnonzero(here.any(axis=1))
        y = np.where(here, value, 0.0).sum(axis=1)[rows]
        breaks = np.flatnonzero(np.diff(rows) > 1) + 1
        curves[int(number)] = (
            np.insert(x[rows], breaks, np.nan),
            np.insert(y, breaks, np.nan),
        )
    return curves


def engagements(x: Array, tooth: Array) -> Array:
    """(m, 3) rows: tooth number, first and last x of each stretch of contact."""
    spans = []
    for number in np.unique(tooth[tooth > 0]).tolist():
        rows = np.flatnonzero((tooth == number).any(axis=1))
        for piece in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            spans.append((number, x[piece[0]], x[piece[-1]]))
    return np.array(spans, dtype=float).reshape(-1, 3)


def pair_arrays(dataset: xr.Dataset, gear_mesh: str, planet: int) -> tuple[Array, Array, Array]:
    """Load (N), tooth number and stiffness (N/m), each (n, slots), of one planet's gear mesh, on
    whichever flank carries."""
    dim = leading_dim(dataset)
    pairs = carrying_pairs(dataset, gear_mesh, planet).isel(planet=0)
    load, tooth, stiffness = (
        np.asarray(pairs[name].transpose(dim, "slot"), dtype=float)
        for name in ("load", "tooth", "stiffness")
    )
    return load, tooth, stiffness


def flank_label(datasets: Iterable[xr.Dataset], gear_mesh: str) -> str:
    """Which flank of planet 1 a picture shows, for its title: nothing where it is the drive
    flank."""
    flanks = {carrying_flank(d, gear_mesh, 1) for d in datasets} - {"none"}
    if flanks <= {"drive"}:
        return ""
    return ", coast flank" if flanks == {"coast"} else ", flank that carries"


def draw_pairs(
    axes: Axes, x: Array, tooth: Array, load: Array, colour: str, **line: object
) -> None:
    for at, value in pair_curves(x, tooth, load).values():
        axes.plot(at, value * KILO, color=colour, **line)  # type: ignore[arg-type]


def finish_x(axes: Axes, x: str, planets: int, low: float, high: float) -> None:
    axes.set_xlim(low, high)
    if x == "stage_angle":
        angle_axis(axes, planets)
    else:
        axes.set_xlabel("time (s)")


@styled
def pair_loads(
    runs: Runs,
    gear_mesh: str = "ring",
    x: str = "stage_angle",
    split: str = "flexible",
) -> Figure:
    """Load of every tooth pair of planet 1, one line style a variant (Figures 17, 18, 23, 24).

    ``split`` names the run whose total is also split by stiffness (eq. 23, dashed).
    A whole revolution is not legible: give part of the runs (``within_window``).
    """
    colours = variant_colours(runs)
    figure, axes = panels(1, 1, height_mm=78)
    ax, handles, ends = axes[0, 0], legend_lines(colours), list[float]()
    for i, (name, dataset) in enumerate(runs.items()):
        at = abscissa(dataset, x)
        load, tooth, stiffness = pair_arrays(dataset, gear_mesh, 1)
        width = 1.3 if i == 0 else 2.1
        draw_pairs(ax, at, tooth, load, colours[name], lw=width, zorder=3 - 0.1 * i)
        if name == split:
            parts = stiffness_split(load, stiffness)
            draw_pairs(ax, at, tooth, parts, SPLIT_COLOUR, lw=1.3, ls=(0, (4, 1.6)), zorder=3.5)
            text = f"{name}, split by stiffness"
            handles.append(Line2D([], [], color=SPLIT_COLOUR, lw=1.5, ls="--", label=text))
        ends += [at[0], at[-1]]
    ax.axhline(0, color=NEUTRAL, lw=0.7)
    ax.set_ylabel("load of a tooth pair (kN)")
    flank = flank_label(runs.values(), gear_mesh)
    ax.set_title(f"Tooth-pair loads, {LABELS[gear_mesh]} 1{flank}")
    finish_x(ax, x, planet_count(next(iter(runs.values()))), min(ends), max(ends))
    legend_below(figure, handles)
    return figure


@styled
def engagement_map(whole: xr.Dataset) -> Figure:
    """Engaged tooth number, and pair stiffness, over carrier angle, all planets (Figure 11).

    The right column shows planet 1 closer, over a few teeth in the middle.
    """
    dataset = thinned(whole, MOST_SAMPLES)
    at = abscissa(dataset, "stage_angle")
    planets = planet_count(dataset)
    states = [pair_arrays(dataset, "ring", i + 1) for i in range(planets)]
    last = int(max(tooth.max() for _, tooth, _ in states))
    figure, axes = panels(2, 2, height_mm=150, width_mm=215, sharex="col", width_ratios=[2.2, 1])
    draw_engagements(axes[0, 0], at, states, last)
    axes[0, 0].set_title("(a) engaged ring teeth")
    mapped = draw_stiffness_map(axes[1, 0], at, states, last)
    axes[1, 0].set_title("(b) stiffness of the engaged pairs")
    for ax in axes[:, 0]:
        ax.set_ylabel("ring tooth number")
    figure.colorbar(mapped, ax=axes[1, 0], label="pair stiffness (N/µm)", pad=0.01)
    finish_x(axes[1, 0], "stage_angle", planets, at[0], at[-1])
    close = windowed(whole, "stage_angle", zoom_window(at, states[0][1]))
    near = abscissa(close, "stage_angle")
    _, tooth, stiffness = pair_arrays(close, "ring", 1)
    top, bottom = axes[:, 1]
    top.hlines(*engagements(near, tooth).T, color=planet_colour(1), lw=4)
    top.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    top.set_title("(c) planet 1, closer")
    for theta, value in pair_curves(near, tooth, stiffness).values():
        bottom.plot(theta, value * N_PER_M_TO_N_PER_UM, color=planet_colour(1))
    bottom.set_ylim(bottom=0)
    bottom.set_title("(d) planet 1, closer")
    bottom.set_ylabel("pair stiffness (N/µm)")
    finish_x(bottom, "stage_angle", planets, near[0], near[-1])
    bottom.xaxis.set_major_locator(MaxNLocator(4))
    numbers = range(1, planets + 1)
    legend_below(figure, legend_lines({f"planet {n}": planet_colour(n) for n in numbers}), planets)
    return figure


States = list[tuple[Array, Array, Array]]


def zoom_window(x: Array, tooth: Array) -> Window:
    """A stretch near the middle of x over which about four new teeth come into contact, away from
    the first and the last tooth, so that numbers do not jump in it."""
    newest = tooth.max(axis=1)
    low, high = sorted((float(x[0]), float(x[-1])))  # x falls where the carrier turns backwards
    each = (high - low) / max(int((np.diff(newest) > 0).sum()), 1)
    middle = 0.5 * (low + high)
    halfway = x[newest == newest.max() // 2]
    if halfway.size:
        nearest = float(halfway[np.argmin(np.abs(halfway - middle))])
        middle = min(max(nearest, low + 2.5 * each), high - 2.5 * each)
    return max(low, middle - 2.5 * each), min(high, middle + 2.5 * each)


def draw_engagements(axes: Axes, at: Array, states: States, last: int) -> None:
    thickness = max(0.8, min(3.0, 180.0 / last))
    for i, (_, tooth, _) in enumerate(states):
        axes.hlines(*engagements(at, tooth).T, color=planet_colour(i + 1), lw=thickness)
    axes.set_ylim(0, last + 1)


def draw_stiffness_map(axes: Axes, at: Array, states: States, last: int) -> QuadMesh:
    image = np.full((last, at.size), np.nan)
    for _, tooth, stiffness in states:
        row, slot = np.nonzero((tooth > 0) & (stiffness > 0))
        image[tooth[row, slot].astype(int) - 1, row] = stiffness[row, slot] * N_PER_M_TO_N_PER_UM
    numbers = np.arange(1, last + 1)
    mapped = axes.pcolormesh(
        at, numbers, image, cmap=SEQUENTIAL_MAP, shading="nearest", rasterized=True
    )
    axes.grid(False)
    axes.set_ylim(0, last + 1)
    return mapped
