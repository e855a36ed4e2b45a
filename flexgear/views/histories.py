"""Over time or carrier angle: speed, load sharing, torque drops, displacements of tooth nodes, sun
and planets (Tan 2023, Figures 10, 13 to 16, 19 to 22, 25).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flexgear.arrays import Array
from flexgear.model.units import RPM
from flexgear.results.report.wording import scale
from flexgear.results.stage_part import displacement_of, of_kind, ring_force_spread, ring_sharing
from flexgear.views.loads import finish_x
from flexgear.views.select import (
    Runs,
    abscissa,
    draw,
    leading_dim,
    planet_count,
    say_envelope,
    thinned,
    variable,
)
from flexgear.views.style import (
    DIVERGING_MAP,
    KILO,
    MICRO,
    NEUTRAL,
    least_span,
    legend_below,
    legend_lines,
    panels,
    styled,
    variant_colours,
)

AXES = ("x", "y", "z")
MAP_SAMPLES = 1500  # of a map over the carrier angle
ROUNDING = 1e-6  # of the largest displacement: a direction with less does not move
Drawn = tuple[str, Callable[[xr.Dataset], xr.DataArray], float]  # label, of one run, factor
SPEED: Drawn = ("carrier speed\n(r/min)", itemgetter("stage_speed"), RPM)
SHARING: Drawn = ("load sharing\nfactor $K_γ$ (–)", ring_sharing, 1.0)
SPREAD: Drawn = ("force spread /\nrated mean (–)", ring_force_spread, 1.0)
FORCE: Drawn = (
    "mean ring gear-\nmesh force (kN)",
    lambda part: of_kind(part, "ring")["gear_mesh_force"].mean("gear_mesh"),
    KILO,
)


def layer(index: int) -> dict[str, Any]:
    """Line style of the index-th run: later ones wider and beneath, so equal curves both show."""
    return {"lw": 1.1 if index == 0 else 2.0, "zorder": 3.0 - 0.1 * index}


def over_runs(axes: Axes, runs: Runs, x: str, drawn: Drawn, envelope: bool = True) -> None:
    """Draw a value of each run (one a sample) in its colour; NaN leaves a gap.

    envelope: in its place, where there are more oscillations than a picture shows.
    """
    colours, dense = variant_colours(runs), False
    label, pick, factor = drawn
    for i, (run, dataset) in enumerate(runs.items()):
        values = np.asarray(pick(dataset), dtype=float) * factor
        if envelope:
            dense |= draw(axes, abscissa(dataset, x), values, colours[run], **layer(i))
        else:
            axes.plot(abscissa(dataset, x), values, color=colours[run], **layer(i))
    axes.set_ylabel(label)
    if dense:
        say_envelope(axes)


def finish(
    figure: Figure, axes: Any, runs: Runs, x: str, more_lines: Sequence[Line2D] = ()
) -> Figure:
    """The figure with its abscissa, labels in line, and a legend where there are several lines."""
    figure.align_ylabels(axes[:, 0])
    at = [abscissa(d, x) for d in runs.values()]
    ends = min(float(v[0]) for v in at), max(float(v[-1]) for v in at)
    finish_x(axes[-1, 0], x, planet_count(next(iter(runs.values()))), *ends)
    lines = [*legend_lines(variant_colours(runs)), *more_lines]
    if len(lines) > 1:
        legend_below(figure, lines)
    return figure


@styled
def carrier_speed(runs: Runs, rated_rpm: float | None = None) -> Figure:
    """Input torque and carrier speed (r/min) of one or several runs over time (Figure 10)."""
    figure, axes = panels(2, 1, height_mm=96, sharex=True, height_ratios=[1, 2])
    top, bottom = axes[:, 0]
    torque_panel(top, runs, "time")
    over_runs(bottom, runs, "time", SPEED)
    rated = []
    if rated_rpm is not None:
        rated = [bottom.axhline(rated_rpm, color="black", ls=":", lw=1.2, zorder=4)]
        rated[0].set_label(f"rated {rated_rpm:g} r/min")
    least_span(bottom, 0.02)
    return finish(figure, axes, runs, "time", rated)


def _input_torque(part: xr.Dataset) -> xr.DataArray:
    return part["port_torque"].isel(port=0)


def torque_panel(axes: Axes, runs: Runs, x: str) -> None:
    """Input torque in a unit that reads well; zero in view, air above."""
    unit, factor = scale([float(abs(_input_torque(d)).max()) for d in runs.values()], "N m")
    over_runs(axes, runs, x, (f"input torque\n({unit})", _input_torque, factor))
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), 1.12 * high if high > 0 else high)


@styled
def load_sharing(runs: Runs, x: str = "stage_angle", spread: bool = False) -> Figure:
    """Load sharing factor K_γ = N max F / Σ F, with gaps where it is undefined (Figures 19, 25).

    ``spread`` adds (max − min)/rated mean of the planets' gear-mesh forces, defined everywhere.
    """
    figure, axes = panels(2 if spread else 1, 1, height_mm=110 if spread else 70, sharex=True)
    top = axes[0, 0]
    over_runs(top, runs, x, SHARING)
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
    torque_panel(axes[0, 0], runs, "time")
    for ax, drawn in zip(axes[1:, 0], (SPEED, FORCE, SHARING, SPREAD), strict=True):
        over_runs(ax, runs, "time", drawn, envelope=False)
    axes[2, 0].axhline(0, color=NEUTRAL, lw=0.7)
    return finish(figure, axes, runs, "time")


@styled
def three_directions(
    runs: Runs,
    pick: Callable[[xr.Dataset], Array],
    title: str,
    directions: tuple[str, str, str],
    x: str,
) -> Figure:
    """One panel a direction (µm) with every variant; ``pick`` gives (n, 3) in m."""
    colours = variant_colours(runs)
    figure, axes = panels(3, 1, height_mm=132, sharex=True)
    picked = {name: pick(dataset) * MICRO for name, dataset in runs.items()}
    largest = np.max([np.nanmax(np.abs(v), axis=0, initial=0.0) for v in picked.values()], axis=0)
    is_noise = largest < ROUNDING * largest.max(initial=0.0)
    for i, (name, dataset) in enumerate(runs.items()):
        at, values = abscissa(dataset, x), picked[name]
        for k, ax in enumerate(axes[:, 0]):
            if draw(ax, at, values[:, k], colours[name], **layer(i)):
                say_envelope(ax)
            if i == 0 and np.isfinite(values[:, k]).any():
                peak = f"{values[np.nanargmax(np.abs(values[:, k])), k]:.3g}".replace("-", "−")
                text = "zero, to rounding" if is_noise[k] else f"largest {peak} µm ({name})"
                ax.set_title(f"{directions[k]}: {text}", weight="normal", fontsize=8)
    for k, ax in enumerate(axes[:, 0]):
        if is_noise[k]:
            ax.set_ylim(-0.1 * largest.max(), 0.1 * largest.max())
        ax.axhline(0, color=NEUTRAL, lw=0.6, zorder=1)
        ax.set_ylabel(f"{directions[k]} (µm)")
    figure.suptitle(title, fontsize=9.5, weight="bold")
    return finish(figure, axes, runs, x)


def tooth_node_displacement(runs: Runs, x: str = "stage_angle") -> Figure:
    """X, Y, Z displacement of ring tooth node 1, global (Figures 16, 22)."""

    def pick(dataset: xr.Dataset) -> Array:
        field = variable(dataset, "tooth_displacement").isel(tooth=0)
        return np.asarray(field.transpose(leading_dim(dataset), "axis"), dtype=float)

    title = "Displacement of ring tooth node 1"
    return three_directions(runs, pick, title, ("X", "Y", "Z"), x)


def sun_displacement(runs: Runs, x: str = "stage_angle") -> Figure:
    """x, y, z displacement of the sun, carrier axes (Figures 14, 20)."""

    def pick(dataset: xr.Dataset) -> Array:
        field = displacement_of(dataset, "sun").transpose(leading_dim(dataset), "dof")
        return np.asarray(field, dtype=float)[:, :3]

    title = "Displacement of the sun, axes of the carrier"
    return three_directions(runs, pick, title, AXES, x)


def planet_displacement(runs: Runs, x: str = "stage_angle") -> Figure:
    """Radial, tangential and axial displacement of planet 1 (Figures 15, 21)."""

    def pick(dataset: xr.Dataset) -> Array:
        field = displacement_of(dataset, "planet").isel(body=0)
        return np.asarray(field.transpose(leading_dim(dataset), "dof"), dtype=float)[:, :3]

    title = "Displacement of planet 1, its own axes"
    names = ("x, radial", "y, tangential", "z, axial")
    return three_directions(runs, pick, title, names, x)


@styled
def tooth_displacement_map(dataset: xr.Dataset, axis: str = "x") -> Figure:
    """Displacement of all tooth nodes along ``axis`` as a map over carrier angle (Figure 13)."""
    dataset = thinned(dataset, MAP_SAMPLES)
    field = variable(dataset, "tooth_displacement").isel(axis=AXES.index(axis))
    image = np.asarray(field.transpose("tooth", leading_dim(dataset)), dtype=float) * MICRO
    at, teeth = abscissa(dataset, "stage_angle"), len(image)
    limit = float(np.nanmax(np.abs(image), initial=1e-12))
    figure, axes = panels(1, 1, height_mm=92)
    ax = axes[0, 0]
    look: dict[str, Any] = {"cmap": DIVERGING_MAP, "shading": "nearest", "rasterized": True}
    mapped = ax.pcolormesh(at, np.arange(1, teeth + 1), image, vmin=-limit, vmax=limit, **look)
    ax.grid(False)
    ax.set_ylabel("ring tooth number")
    ax.set_title(f"{axis.upper()} displacement of the {teeth} ring tooth nodes")
    figure.colorbar(mapped, ax=ax, label=f"{axis.upper()} displacement (µm)", pad=0.01)
    finish_x(ax, "stage_angle", planet_count(dataset), at[0], at[-1])
    return figure
