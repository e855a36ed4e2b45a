"""Over time or carrier angle: speed, load sharing, torque drops (Figures 10, 19, 25)."""

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

from flexgear.model.units import RPM
from flexgear.results.stage_part import of_kind, ring_force_spread, ring_sharing
from flexgear.views.dense import draw, say_envelope
from flexgear.views.loads import finish_x
from flexgear.views.select import Runs, Window, abscissa, as_runs, planet_count, windowed
from flexgear.views.style import (
    KILO,
    NEUTRAL,
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
