"""Over time or carrier angle: speed, load sharing, torque drops, displacements of tooth nodes, sun
and planets (Tan 2023, Figures 10, 13 to 16, 19 to 22, 25).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from flexgear.model.errors import FlexgearError
from flexgear.model.names import MemberName
from flexgear.model.units import RPM
from flexgear.results.stage_part import displacement_of, of_kind, ring_force_spread, ring_sharing
from flexgear.views.dense import draw, say_envelope
from flexgear.views.loads import finish_x
from flexgear.views.select import (
    Runs,
    Window,
    abscissa,
    as_runs,
    leading_dim,
    planet_count,
    thinned,
    variable,
    windowed,
)
from flexgear.views.style import (
    DIVERGING_MAP,
    KILO,
    MICRO,
    NEUTRAL,
    FloatArray,
    panels,
    styled,
    unit_of_torque,
    variant_colours,
)


def variant_handles(colours: Mapping[str, str]) -> list[Line2D]:
    """Legend entries of the variants."""
    return [Line2D([], [], color=c, lw=1.5, label=name) for name, c in colours.items()]


def layer(index: int) -> dict[str, Any]:
    """Line style of the index-th run: later ones wider and beneath, so equal curves both show."""
    return {"lw": 1.1 if index == 0 else 2.0, "zorder": 3.0 - 0.1 * index}


def over_runs(
    axes: Axes,
    runs: Mapping[str, xr.Dataset],
    x: str,
    pick: Callable[[xr.Dataset], xr.DataArray],
    factor: float,
    envelope: bool = True,
) -> None:
    """Draw what ``pick`` takes of each run (one value a sample) in its colour; NaN leaves a gap.

    envelope: in its place, where there are more oscillations than a picture shows.
    """
    colours, dense = variant_colours(runs), False
    for i, (run, dataset) in enumerate(runs.items()):
        values = np.asarray(pick(dataset), dtype=float) * factor
        if envelope:
            dense |= draw(axes, abscissa(dataset, x), values, colours[run], **layer(i))
        else:
            axes.plot(abscissa(dataset, x), values, color=colours[run], **layer(i))
    if dense:
        say_envelope(axes)


def span(runs: Mapping[str, xr.Dataset], x: str) -> tuple[float, float]:
    """Smallest and largest x of all runs."""
    values = [abscissa(d, x) for d in runs.values()]
    return min(float(v[0]) for v in values), max(float(v[-1]) for v in values)


def finish(
    figure: Figure,
    last: Axes,
    runs: Mapping[str, xr.Dataset],
    x: str,
    extra: list[Line2D] | None = None,
) -> None:
    finish_x(last, x, planet_count(next(iter(runs.values()))), *span(runs, x))
    handles = [*variant_handles(variant_colours(runs)), *(extra or [])]
    if len(handles) > 1:
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 5))


@styled
def carrier_speed(
    runs: Runs, x: str = "time", window: Window | None = None, rated_rpm: float | None = None
) -> Figure:
    """Input torque and carrier speed (r/min) of one or several runs (Figure 10)."""
    chosen = {name: windowed(d, x, window) for name, d in as_runs(runs).items()}
    figure, axes = panels(2, 1, height_mm=96, sharex=True, height_ratios=[1, 2])
    top, bottom = axes[:, 0]
    torque_panel(top, chosen, x)
    over_runs(bottom, chosen, x, itemgetter("stage_speed"), RPM)
    extra = []
    if rated_rpm is not None:
        bottom.axhline(rated_rpm, color="black", ls=":", lw=1.2, zorder=4)
        extra = [Line2D([], [], color="black", ls=":", label=f"rated {rated_rpm:g} r/min")]
    bottom.set_ylabel("carrier speed (r/min)")
    widen(bottom, 0.02)
    finish(figure, bottom, chosen, x, extra)
    return figure


def _input_torque(part: xr.Dataset) -> xr.DataArray:
    return part["port_torque"].isel(port=0)


def _mean_force(gear_mesh: str, part: xr.Dataset) -> xr.DataArray:
    return of_kind(part, gear_mesh)["gear_mesh_force"].mean("gear_mesh")


def torque_panel(axes: Axes, runs: dict[str, xr.Dataset], x: str) -> None:
    """Input torque in a unit that reads well; zero in view, air above."""
    largest = max(float(abs(_input_torque(d)).max()) for d in runs.values())
    unit, factor = unit_of_torque(largest)
    over_runs(axes, runs, x, _input_torque, factor)
    axes.set_ylabel(f"input torque\n({unit})")
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), 1.12 * high if high > 0 else high)


def widen(axes: Axes, share: float) -> None:
    """Keep a nearly constant quantity from filling the panel with its noise."""
    low, high = axes.get_ylim()
    middle = 0.5 * (low + high)
    least = share * abs(middle)
    if high - low < least:
        axes.set_ylim(middle - least / 2, middle + least / 2)


@styled
def load_sharing(
    runs: Runs, x: str = "stage_angle", window: Window | None = None, spread: bool = False
) -> Figure:
    """Load sharing factor K_γ = N max F / Σ F, with gaps where it is undefined (Figures 19, 25).

    ``spread`` adds (max − min)/rated mean of the planets' gear-mesh forces, defined everywhere.
    """
    chosen = {name: windowed(d, x, window) for name, d in as_runs(runs).items()}
    figure, axes = panels(2 if spread else 1, 1, height_mm=110 if spread else 70, sharex=True)
    top = axes[0, 0]
    over_runs(top, chosen, x, ring_sharing, 1.0)
    top.axhline(1.0, color=NEUTRAL, lw=0.7)
    top.set_ylabel("load sharing factor $K_γ$ (–)")
    missing = any(bool(ring_sharing(d).isnull().any()) for d in chosen.values())
    if missing:
        top.set_title("gaps: gear-mesh force below 3 % of rated", fontsize=8, weight="normal")
    if spread:
        over_runs(axes[1, 0], chosen, x, ring_force_spread, 1.0)
        axes[1, 0].set_ylabel("(max − min) / rated mean\nof the planets' forces (–)")
    finish(figure, axes[-1, 0], chosen, x)
    return figure


@styled
def torque_drop(runs: Runs, window: Window | None = None, gear_mesh: str = "ring") -> Figure:
    """A torque drop over time: torque, speed, mean mesh force, load sharing, force spread."""
    chosen = {name: windowed(d, "time", window) for name, d in as_runs(runs).items()}
    figure, axes = panels(5, 1, height_mm=190, sharex=True, height_ratios=[0.7, 1, 1, 1, 1])
    torque, speed, force, sharing, spread = axes[:, 0]
    torque_panel(torque, chosen, "time")
    over_runs(speed, chosen, "time", itemgetter("stage_speed"), RPM, False)
    speed.set_ylabel("carrier speed\n(r/min)")
    over_runs(force, chosen, "time", partial(_mean_force, gear_mesh), KILO, False)
    force.axhline(0, color=NEUTRAL, lw=0.7)
    force.set_ylabel(f"mean {gear_mesh} gear-\nmesh force (kN)")
    over_runs(sharing, chosen, "time", ring_sharing, 1.0, False)
    sharing.set_ylabel("load sharing\nfactor $K_γ$ (–)")
    over_runs(spread, chosen, "time", ring_force_spread, 1.0, False)
    spread.set_ylabel("force spread /\nrated mean (–)")
    figure.align_ylabels(axes[:, 0])
    finish(figure, spread, chosen, "time")
    return figure


AXES = ("x", "y", "z")


@styled
def three_directions(
    runs: Mapping[str, xr.Dataset],
    pick: Callable[[xr.Dataset], FloatArray],
    title: str,
    directions: tuple[str, str, str],
    x: str,
    mark_peaks: bool,
) -> Figure:
    """One panel a direction (µm) with every variant; ``pick`` gives (n, 3) in m."""
    colours = variant_colours(runs)
    figure, axes = panels(3, 1, height_mm=132, sharex=True)
    for i, (name, dataset) in enumerate(runs.items()):
        at, values = abscissa(dataset, x), pick(dataset) * MICRO
        for k, ax in enumerate(axes[:, 0]):
            if draw(ax, at, values[:, k], colours[name], **layer(i)):
                say_envelope(ax)
            if mark_peaks and i == 0 and np.isfinite(values[:, k]).any():
                peak = float(values[np.nanargmax(np.abs(values[:, k])), k])
                ax.set_title(
                    f"{directions[k]}: largest {signed(peak)} µm ({name})",
                    weight="normal",
                    fontsize=8,
                )
    for k, ax in enumerate(axes[:, 0]):
        ax.axhline(0, color=NEUTRAL, lw=0.6, zorder=1)
        ax.set_ylabel(f"{directions[k]} (µm)")
    figure.suptitle(title, fontsize=9.5, weight="bold")
    figure.align_ylabels(axes[:, 0])
    finish(figure, axes[-1, 0], runs, x)
    return figure


def signed(value: float) -> str:
    return f"{value:.3g}".replace("-", "−")


def cut(runs: Runs, x: str, window: Window | None) -> dict[str, xr.Dataset]:
    return {name: windowed(d, x, window) for name, d in as_runs(runs).items()}


def tooth_node_displacement(
    runs: Runs, tooth: int = 1, x: str = "stage_angle", window: Window | None = None
) -> Figure:
    """X, Y, Z displacement of ring tooth node ``tooth`` (1-based), global (Figures 16, 22)."""

    def pick(dataset: xr.Dataset) -> FloatArray:
        field = variable(dataset, "tooth_displacement")
        if not 1 <= tooth <= field.sizes["tooth"]:
            raise FlexgearError(f"cannot draw tooth {tooth}: there are {field.sizes['tooth']}")
        of_tooth = field.isel(tooth=tooth - 1).transpose(leading_dim(dataset), "axis")
        return np.asarray(of_tooth, dtype=float)

    title = f"Displacement of ring tooth node {tooth}"
    return three_directions(cut(runs, x, window), pick, title, ("X", "Y", "Z"), x, True)


def sun_displacement(runs: Runs, x: str = "stage_angle", window: Window | None = None) -> Figure:
    """x, y, z displacement of the sun, carrier axes (Figures 14, 20)."""

    def pick(dataset: xr.Dataset) -> FloatArray:
        field = displacement_of(dataset, "sun").transpose(leading_dim(dataset), "dof")
        return np.asarray(field, dtype=float)[:, :3]

    return three_directions(
        cut(runs, x, window), pick, "Displacement of the sun, axes of the carrier", AXES, x, True
    )


def relative_planet_motion(
    dataset: xr.Dataset, planet: int, center_distance: float | None
) -> FloatArray:
    """(n, 3) motion of a planet, its axes; less R_c θ_z of the drive node if R_c is given."""
    dim = leading_dim(dataset)
    field = displacement_of(dataset, "planet")
    if not 1 <= planet <= field.sizes["body"]:
        raise FlexgearError(f"cannot draw planet {planet}: there are {field.sizes['body']}")
    motion = np.array(field.isel(body=planet - 1).transpose(dim, "dof"), dtype=float)[:, :3]
    if center_distance is not None:
        nodes = [MemberName.parse(n).part for n in variable(dataset, "carrier_node").values]
        if "drive" not in nodes:
            raise FlexgearError("cannot draw: carrier_displacement has no node 'drive'")
        carrier = variable(dataset, "carrier_displacement").isel(carrier_node=nodes.index("drive"))
        motion[:, 1] -= center_distance * np.asarray(carrier.transpose(dim, "dof"))[:, 5]
    return motion


def planet_displacement(
    runs: Runs,
    planet: int = 1,
    x: str = "stage_angle",
    window: Window | None = None,
    center_distance: float | None = None,
) -> Figure:
    """Radial, tangential and axial displacement of a planet (Figures 15, 21).

    Give ``center_distance`` (m) where the dataset's displacements are absolute: the tangential
    motion R_c θ_z that comes from the rotation of the carrier's drive node is then taken out.
    """
    return three_directions(
        cut(runs, x, window),
        lambda dataset: relative_planet_motion(dataset, planet, center_distance),
        f"Displacement of planet {planet}, its own axes",
        ("x, radial", "y, tangential", "z, axial"),
        x,
        True,
    )


@styled
def tooth_displacement_map(
    dataset: xr.Dataset,
    axis: str = "x",
    x: str = "stage_angle",
    window: Window | None = None,
    samples: int = 1500,
) -> Figure:
    """Displacement of all tooth nodes along ``axis`` as a map over carrier angle (Figure 13)."""
    if axis not in AXES:
        raise FlexgearError(f"cannot draw axis '{axis}': choose x, y or z")
    dataset = thinned(windowed(dataset, x, window), samples)
    field = variable(dataset, "tooth_displacement").isel(axis=AXES.index(axis))
    image = np.asarray(field.transpose("tooth", leading_dim(dataset)), dtype=float) * MICRO
    at = abscissa(dataset, x)
    limit = float(np.nanmax(np.abs(image), initial=1e-12))
    figure, axes = panels(1, 1, height_mm=92)
    ax = axes[0, 0]
    mapped = ax.pcolormesh(
        at,
        np.arange(1, image.shape[0] + 1),
        image,
        cmap=DIVERGING_MAP,
        vmin=-limit,
        vmax=limit,
        shading="nearest",
        rasterized=True,
    )
    ax.grid(False)
    ax.set_ylabel("ring tooth number")
    ax.set_title(f"{axis.upper()} displacement of the {image.shape[0]} ring tooth nodes")
    figure.colorbar(mapped, ax=ax, label=f"{axis.upper()} displacement (µm)", pad=0.01)
    finish_x(ax, x, planet_count(dataset), at[0], at[-1])
    return figure
