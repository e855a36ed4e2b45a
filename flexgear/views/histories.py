"""Histories of a stage over time or carrier angle: tooth loads, engagements, speed, load sharing,
torque drops, displacements of tooth nodes, sun and planets (Tan 2023, Figures 7 and 10 to 25).

Stiffness split (eq. 23): F_l = k_l / Σ k · Σ F over the pairs l of one planet's gear mesh.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from operator import itemgetter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from flexgear.arrays import Array, Ints
from flexgear.model.units import RPM
from flexgear.results.quantities import AXES
from flexgear.results.report.wording import scale
from flexgear.results.stage_part import (
    carrying_pairs,
    displacement_of,
    flank_histories,
    flank_names,
    of_kind,
    ring_force_spread,
    ring_sharing,
    stiffness_split,
)
from flexgear.views.select import (
    Runs,
    Window,
    abscissa,
    draw,
    leading_dim,
    planet_count,
    thinned,
    variable,
    windowed,
)
from flexgear.views.style import (
    MICRO,
    N_PER_M_TO_N_PER_UM,
    NEUTRAL,
    SEQUENTIAL_MAP,
    SPLIT_COLOUR,
    angle_axis,
    force_scale,
    least_span,
    legend_of,
    panels,
    planet_colour,
    styled,
    variant_colours,
)

LABELS = {"ring": "ring–planet", "sun": "sun–planet"}
MOST_SAMPLES = 4000  # of a map over the carrier angle


def engagements(tooth: Array) -> Iterator[tuple[int, Ints]]:
    """Tooth number (1-based) and sample indices of each engagement. tooth: (n, slots) numbers of
    engaged teeth, 0 in an empty slot; a tooth may change its slot between samples."""
    for number in np.unique(tooth[tooth > 0]).tolist():
        rows = np.flatnonzero((tooth == number).any(axis=1))
        for piece in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            yield int(number), piece


def pair_curve(x: Array, tooth: Array, value: Array) -> tuple[Array, Array]:
    """Curve of a value (n, slots) of the engaged teeth over x (n,), with NaN after each
    engagement."""
    at, curve = [], []
    for number, rows in engagements(tooth):
        at += [x[rows], [np.nan]]
        curve += [np.where(tooth[rows] == number, value[rows], 0.0).sum(axis=1), [np.nan]]
    return np.concatenate([[], *at]), np.concatenate([[], *curve])


def engagement_spans(x: Array, tooth: Array) -> Array:
    """Tooth number, first and last x of each of m engagements, (m, 3)."""
    spans = [(number, x[rows[0]], x[rows[-1]]) for number, rows in engagements(tooth)]
    return np.array(spans, dtype=float).reshape(-1, 3)


def pair_arrays(dataset: xr.Dataset, gear_mesh: str, planet: int) -> tuple[Array, Array, Array]:
    """Load (N), tooth number and stiffness (N/m), each (n, slots), of one planet's gear mesh on its
    loaded flank."""
    dim = leading_dim(dataset)
    parts = ("load", "tooth", "stiffness")
    pairs = carrying_pairs(dataset, gear_mesh, planet, parts).isel(planet=0)
    load, tooth, stiffness = (
        np.asarray(pairs[name].transpose(dim, "slot"), dtype=float) for name in parts
    )
    return load, tooth, stiffness


def flank_label(datasets: Iterable[xr.Dataset], gear_mesh: str) -> str:
    """Loaded flank of planet 1 for the title of a picture; empty for the drive flank."""
    flanks = {flank_names(flank_histories(d, gear_mesh, 1)) for d in datasets} - {"none"}
    if flanks <= {"drive"}:
        return ""
    return ", coast flank" if flanks == {"coast"} else ", loaded flank"


def finish_x(axes: Axes, x: str, planets: int, low: float, high: float) -> None:
    """Set limits and label of the horizontal axis x, "stage_angle" or "time"."""
    axes.set_xlim(low, high)
    if x == "stage_angle":
        angle_axis(axes, planets)
    else:
        axes.set_xlabel("time (s)")


@styled
def pair_loads(
    runs: Runs, gear_mesh: str = "ring", x: str = "stage_angle", split: str = "flexible"
) -> Figure:
    """Load of every tooth pair of planet 1, by variant (Figures 17, 18, 23, 24).

    split: the run whose total is also split by stiffness (eq. 23, dashed). Runs should be short
    (``within_window``), as a whole revolution is not legible.
    """
    colours = variant_colours(runs)
    figure, axes = panels(1, 1, height_mm=78)
    ax = axes[0, 0]
    pairs = {name: pair_arrays(dataset, gear_mesh, 1) for name, dataset in runs.items()}
    unit, by = force_scale([np.max(load, initial=0.0) for load, _, _ in pairs.values()])
    for i, (name, dataset) in enumerate(runs.items()):
        at = abscissa(dataset, x)
        load, tooth, stiffness = pairs[name]
        ax.plot(*pair_curve(at, tooth, load * by), color=colours[name], label=name, **layer(i))
        if name == split:
            look: dict[str, Any] = {"lw": 1.3, "ls": (0, (4, 1.6)), "zorder": 3.5}
            look["label"] = f"{name}, split by stiffness"
            parts = by * stiffness_split(load, stiffness)
            ax.plot(*pair_curve(at, tooth, parts), color=SPLIT_COLOUR, **look)
    ax.axhline(0, color=NEUTRAL, lw=0.7)
    ax.set_ylabel(f"load of a tooth pair ({unit})")
    flank = flank_label(runs.values(), gear_mesh)
    ax.set_title(f"Tooth-pair loads, {LABELS[gear_mesh]} 1{flank}")
    return finish(figure, axes, runs, x)


@styled
def engagement_map(whole: xr.Dataset) -> Figure:
    """Engaged tooth number, and pair stiffness, over carrier angle, all planets (Figure 11).

    The right column shows planet 1 over a few teeth in the middle.
    """
    names = ["stage_angle", "pair_load", "pair_tooth", "pair_stiffness"]
    dataset = thinned(whole[names], MOST_SAMPLES).load()
    at = abscissa(dataset, "stage_angle")
    planets = planet_count(whole)
    states = [pair_arrays(dataset, "ring", i + 1) for i in range(planets)]
    last = int(max(tooth.max() for _, tooth, _ in states))
    figure, axes = panels(2, 2, height_mm=150, width_mm=215, sharex="col", width_ratios=[2.2, 1])
    thickness = max(0.8, min(3.0, 180.0 / last))
    for i, (_, tooth, _) in enumerate(states):
        spans = engagement_spans(at, tooth).T
        label = f"planet {i + 1}"
        axes[0, 0].hlines(*spans, color=planet_colour(i + 1), lw=thickness, label=label)
    axes[0, 0].set_title("(a) engaged ring teeth")
    mapped = draw_stiffness_map(axes[1, 0], at, states, last)
    axes[1, 0].set_title("(b) stiffness of the engaged pairs")
    for ax in axes[:, 0]:
        ax.set_ylabel("ring tooth number")
        ax.set_ylim(0, last + 1)
    figure.colorbar(mapped, ax=axes[1, 0], label="pair stiffness (N/µm)", pad=0.01)
    finish_x(axes[1, 0], "stage_angle", planets, at[0], at[-1])
    close = windowed(whole, "stage_angle", zoom_window(at, states[0][1]))
    near = abscissa(close, "stage_angle")
    _, tooth, stiffness = pair_arrays(close, "ring", 1)
    top, bottom = axes[:, 1]
    first: Any = {"color": planet_colour(1), "label": "planet 1"}
    top.hlines(*engagement_spans(near, tooth).T, lw=4, **first)
    top.yaxis.set_major_locator(MaxNLocator(8, integer=True))
    top.set_title("(c) planet 1, closer")
    top.set_ylabel("ring tooth number")
    curve = pair_curve(near, tooth, stiffness * N_PER_M_TO_N_PER_UM)
    bottom.plot(*curve, **first)
    bottom.set_ylim(bottom=0)
    bottom.set_title("(d) planet 1, closer")
    bottom.set_ylabel("pair stiffness (N/µm)")
    finish_x(bottom, "stage_angle", planets, near[0], near[-1])
    bottom.xaxis.set_major_locator(MaxNLocator(4))
    legend_of(figure, planets)
    return figure


States = list[tuple[Array, Array, Array]]


def zoom_window(x: Array, tooth: Array) -> Window:
    """A window near the middle of x in which about four teeth come into contact, without the
    transition between the last tooth number and the first."""
    newest = tooth.max(axis=1)
    low, high = sorted((float(x[0]), float(x[-1])))  # x falls where the carrier turns backwards
    each = (high - low) / max(int((np.diff(newest) != 0).sum()), 1)
    middle = 0.5 * (low + high)
    halfway = x[newest == newest.max() // 2]
    if halfway.size:
        nearest = float(halfway[np.argmin(np.abs(halfway - middle))])
        middle = min(max(nearest, low + 2.5 * each), high - 2.5 * each)
    return max(low, middle - 2.5 * each), min(high, middle + 2.5 * each)


def draw_stiffness_map(axes: Axes, at: Array, states: States, last: int) -> QuadMesh:
    """Draw the pair stiffness of all planets by tooth number over the carrier angle."""
    image = np.full((last, at.size), np.nan)
    for _, tooth, stiffness in states:
        row, slot = np.nonzero((tooth > 0) & (stiffness > 0))
        image[tooth[row, slot].astype(int) - 1, row] = stiffness[row, slot] * N_PER_M_TO_N_PER_UM
    return tooth_map(axes, at, image, cmap=SEQUENTIAL_MAP)


def tooth_map(axes: Axes, at: Array, image: Array, **look: Any) -> QuadMesh:
    """Draw values (teeth, n) by tooth number over the carrier angle (n,)."""
    axes.grid(False)
    numbers = np.arange(1, len(image) + 1)
    return axes.pcolormesh(at, numbers, image, shading="nearest", rasterized=True, **look)


ROUNDING = 1e-6  # of the largest displacement: a direction with less does not move
Pick = Callable[[xr.Dataset], xr.DataArray]
Drawn = tuple[str, Pick, float]  # label, function of a run for the values, factor
SPEED: Drawn = ("carrier speed to\nring (r/min)", itemgetter("stage_speed"), RPM)
SHARING: Drawn = ("load sharing\nfactor $K_γ$ (–)", ring_sharing, 1.0)
SPREAD: Drawn = ("force spread /\nrated mean (–)", ring_force_spread, 1.0)


def layer(index: int) -> dict[str, Any]:
    """Line style of a run by its index: later runs wider and below, so that equal curves show."""
    return {"lw": 1.1 if index == 0 else 2.0, "zorder": 3.0 - 0.1 * index}


def over_runs(axes: Axes, runs: Runs, x: str, drawn: Drawn, envelope: bool = True) -> None:
    """Draw a history of each run in its colour, with gaps for NaN.

    envelope: whether the envelope replaces a history with too many oscillations.
    """
    colours, (label, pick, factor) = variant_colours(runs), drawn
    for i, (run, dataset) in enumerate(runs.items()):
        values = np.asarray(pick(dataset), dtype=float) * factor
        if envelope:
            draw(axes, abscissa(dataset, x), values, colours[run], label=run, **layer(i))
        else:
            axes.plot(abscissa(dataset, x), values, color=colours[run], label=run, **layer(i))
    axes.set_ylabel(label)


def finish(figure: Figure, axes: Any, runs: Runs, x: str) -> Figure:
    """The figure with horizontal axis, aligned labels, and a legend if there are several lines."""
    figure.align_ylabels(axes[:, 0])
    at = [abscissa(d, x) for d in runs.values()]
    ends = min(float(v[0]) for v in at), max(float(v[-1]) for v in at)
    finish_x(axes[-1, 0], x, planet_count(next(iter(runs.values()))), *ends)
    legend_of(figure, least=2)
    return figure


@styled
def carrier_speed(runs: Runs, rated_rpm: float | None = None) -> Figure:
    """Input torque and speed of the carrier against the ring of runs over time (Figure 10)."""
    figure, axes = panels(2, 1, height_mm=96, sharex=True, height_ratios=[1, 2])
    top, bottom = axes[:, 0]
    torque_panel(top, runs)
    over_runs(bottom, runs, "time", SPEED)
    if rated_rpm is not None:
        label = f"rated {rated_rpm:g} r/min"
        bottom.axhline(rated_rpm, color="black", ls=":", lw=1.2, zorder=4, label=label)
    least_span(bottom, 0.02)
    return finish(figure, axes, runs, "time")


def input_torque(part: xr.Dataset) -> xr.DataArray:
    """Torque of the first port, N m."""
    return part["port_torque"].isel(port=0)


def ring_force(part: xr.Dataset) -> xr.DataArray:
    """Mean force of the ring gear meshes, N."""
    return of_kind(part, "ring")["gear_mesh_force"].mean("gear_mesh")


def torque_panel(axes: Axes, runs: Runs) -> None:
    """Draw the input torque over time in a suitable unit, with zero in view."""
    unit, factor = scale([float(abs(input_torque(d)).max()) for d in runs.values()], "N m")
    over_runs(axes, runs, "time", (f"input torque\n({unit})", input_torque, factor))
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), 1.12 * high if high > 0 else high)


@styled
def load_sharing(runs: Runs, x: str = "stage_angle", spread: bool = False) -> Figure:
    """Load sharing factor K_γ = N max F / Σ F, with gaps where it is undefined (Figures 19, 25).

    spread: adds (max − min)/rated mean of the planets' gear-mesh forces, defined everywhere.
    """
    figure, axes = panels(2 if spread else 1, 1, height_mm=110 if spread else 70, sharex=True)
    top = axes[0, 0]
    over_runs(top, runs, x, SHARING)
    least_span(top, 0.01)
    top.axhline(1.0, color=NEUTRAL, lw=0.7)
    if any(bool(ring_sharing(d).isnull().any()) for d in runs.values()):
        top.set_title("gaps: gear-mesh force below 3 % of rated", fontsize=8, weight="normal")
    if spread:
        over_runs(axes[1, 0], runs, x, SPREAD)
    return finish(figure, axes, runs, x)


@styled
def torque_drop(runs: Runs) -> Figure:
    """A torque drop over time: torque, speed, mean mesh force, load sharing, force spread."""
    figure, axes = panels(5, 1, height_mm=190, sharex=True, height_ratios=[0.7, 1, 1, 1, 1])
    torque_panel(axes[0, 0], runs)
    unit, by = force_scale([float(abs(ring_force(d)).max()) for d in runs.values()])
    force = (f"mean ring gear-\nmesh force ({unit})", ring_force, by)
    for ax, drawn in zip(axes[1:, 0], (SPEED, force, SHARING, SPREAD), strict=True):
        over_runs(ax, runs, "time", drawn, envelope=False)
    axes[2, 0].axhline(0, color=NEUTRAL, lw=0.7)
    return finish(figure, axes, runs, "time")


DISPLACEMENTS: dict[str, tuple[str, Pick, Sequence[str]]] = {
    # title, function of a run that returns the displacement (n, ≥ 3), m, and its directions
    "tooth node": (
        "ring tooth node 1",
        lambda run: variable(run, "tooth_displacement").isel(tooth=0),
        ("X", "Y", "Z"),
    ),
    "sun": ("the sun, axes of the carrier", lambda run: displacement_of(run, "sun"), AXES),
    "planet": (
        "planet 1, its own axes",
        lambda run: displacement_of(run, "planet").isel(body=0),
        ("x, radial", "y, tangential", "z, axial"),
    ),
}


@styled
def displacement(runs: Runs, of: str, x: str = "stage_angle") -> Figure:
    """Displacement (µm) of the "sun" (Figures 14, 20), "planet" 1 (15, 21), or "tooth node" 1 of
    the ring (16, 22): a panel for each direction with every variant."""
    title, pick, directions = DISPLACEMENTS[of]
    colours = variant_colours(runs)
    figure, axes = panels(3, 1, height_mm=132, sharex=True)
    fields = {name: pick(d).transpose(leading_dim(d), ...)[:, :3] for name, d in runs.items()}
    picked = {name: np.asarray(field, dtype=float) * MICRO for name, field in fields.items()}
    largest = np.max([np.nanmax(np.abs(v), axis=0, initial=0.0) for v in picked.values()], axis=0)
    of_all = max([largest.max(), *(MICRO * _last_displacement(d) for d in runs.values())])
    is_noise = largest < ROUNDING * of_all
    for i, (name, dataset) in enumerate(runs.items()):
        at, values = abscissa(dataset, x), picked[name]
        for k, ax in enumerate(axes[:, 0]):
            draw(ax, at, values[:, k], colours[name], label=name, **layer(i))
            if i == 0 and np.isfinite(values[:, k]).any():
                peak = f"{values[np.nanargmax(np.abs(values[:, k])), k]:.3g}".replace("-", "−")
                text = "zero, to rounding" if is_noise[k] else f"largest {peak} µm ({name})"
                ax.set_title(f"{directions[k]}: {text}", weight="normal", fontsize=8)
    for k, ax in enumerate(axes[:, 0]):
        if is_noise[k]:
            ax.set_ylim(-0.1 * of_all, 0.1 * of_all)
        ax.axhline(0, color=NEUTRAL, lw=0.6, zorder=1)
        ax.set_ylabel(f"{directions[k]} (µm)")
    figure.suptitle(f"Displacement of {title}", fontsize=9.5, weight="bold")
    return finish(figure, axes, runs, x)


def _last_displacement(data: xr.Dataset) -> float:
    """Largest displacement of a body in the last sample, m."""
    last = data["body_displacement"].isel({leading_dim(data): -1, "dof": slice(3)})
    return float(abs(last).max())
