"""Charts of radial harmonics, the energy balance, and figures of stages as bars."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from flexgear.arrays import Array
from flexgear.results import quantities as declared
from flexgear.results import time_figures
from flexgear.results.report.parts import row
from flexgear.results.report.wording import number, scale, words
from flexgear.views.select import variable
from flexgear.views.style import (
    DEFORMED_COLOUR,
    MICRO,
    NEUTRAL,
    PLANET_COLOURS,
    labelled_bars,
    panels,
    styled,
)

ENERGY_LABELS = {  # label and colour by term
    "input_work": ("work of the input torque", "#0072B2"),
    "brake_work": ("work of the brake", "#D55E00"),
    "damping_work": ("work of structural damping", "#009E73"),
    "pair_damping_work": ("work of tooth-pair damping", "#CC79A7"),
    "parametric_work": ("work of varying tooth stiffness", "#8C6D1F"),
    "load_work": ("work of weight and loads", "#6A51A3"),
    "kinetic": ("kinetic energy", "#56B4E9"),
    "elastic": ("elastic energy, bodies", "#E69F00"),
    "pair_elastic": ("elastic energy, tooth pairs", "#444444"),
}
BALANCED = 1e-4  # of the peak elastic energy: a smaller residual is not drawn
OUTGOING = ("brake_work", "damping_work", "pair_damping_work")
STORED = ("kinetic", "elastic", "pair_elastic")


@styled
def radial_harmonics(harmonics: Array, planets: int) -> Figure:
    """Amplitudes (m) of the ring's radial displacement by order 0, 1, 2, …

    Multiples of the number of planets are red: equal planets without errors cause no other order.
    """
    figure, axes = panels(1, 1, height_mm=66)
    ax, micrometres = axes[0, 0], np.abs(harmonics) * MICRO
    order = np.arange(micrometres.size)
    multiple = order % planets == 0
    ax.bar(order, micrometres, 0.8, color=np.where(multiple, DEFORMED_COLOUR, "#9CA3AF").tolist())
    above: Any = {"xytext": (0, 2), "textcoords": "offset points", "ha": "center"}
    for n in order[multiple & (micrometres > 0)]:
        ax.annotate(f"{micrometres[n]:.3g}", (n, micrometres[n]), fontsize=7.5, **above)
    ax.set_xticks(order)
    ax.grid(axis="x", visible=False)
    ax.set_xlabel("order around the ring (–)")
    ax.set_ylabel("radial amplitude (µm)")
    ax.margins(y=0.1)
    ax.set_title(f"red: multiples of {planets} planets", fontsize=8, weight="normal")
    return figure


@styled
def energy_balance(dataset: xr.Dataset) -> Figure:
    """Changes of energy and work since the start over time, and the residual of their balance.

    The residual is that of ``time_figures.energy_balance``, in percent of the peak elastic energy
    in the lowest panel. Brake and damping work are positive in the dataset where energy leaves the
    system, and drawn negative.
    """
    balance, outer = time_figures.energy_balance(dataset), ("input_work", "brake_work")
    left = balance["left"].to_numpy()
    residual = (left - left[0]) / float(balance["elastic"].max())
    time = np.asarray(variable(dataset, "time"), dtype=float)
    energies = {t: np.asarray(dataset[f"energy_{t}"], dtype=float) for t in ENERGY_LABELS}
    changes = {t: (-1 if t in OUTGOING else 1) * (v - v[0]) for t, v in energies.items()}
    balanced = float(np.abs(residual).max()) <= BALANCED
    rows = 2 + int(not balanced)
    figure, axes = panels(rows, 1, height_mm=26 + 42 * rows, sharex=True)
    for ax, group in zip(axes[:, 0], (outer, [t for t in changes if t not in outer]), strict=False):
        unit, factor = scale([float(np.max(np.abs(changes[t]))) for t in group], "J")
        for term in group:
            line = "-" if term in STORED else "--"
            label, colour = ENERGY_LABELS[term]
            ax.plot(time, changes[term] * factor, line, color=colour, label=label)
        ax.set_ylabel(f"change since\nthe start ({unit})")
    last = axes[-1, 0]
    if balanced:
        text = f"balanced to {100 * BALANCED:g} % of the largest elastic energy"
        last.set_title(text, weight="normal", fontsize=8)
    else:
        last.plot(time, 100 * residual, color=DEFORMED_COLOUR, lw=1)
        last.set_ylabel("residual (% of\npeak elastic)")
    for ax in axes[:, 0]:
        ax.axhline(0, color=NEUTRAL, lw=0.7)
    last.set_xlabel("time (s)")
    last.set_xlim(time[0], time[-1])
    figure.align_ylabels(axes[:, 0])
    figure.legend(loc="outside lower center", ncols=3)
    return figure


FAR_APART = 50.0  # largest over smallest of some bars above which the axis is logarithmic


@styled
def figure_bars(figure: declared.Figure, stages: Mapping[str, Any]) -> Figure:
    """Bars of a figure: a value of each stage, or its values by name; a colour for each stage."""
    bars = [
        (stage, name, row(figure, value))
        for stage, of_stage in stages.items()
        for name, value in (of_stage if isinstance(of_stage, Mapping) else {"": of_stage}).items()
    ]
    unit, by = scale([float(bar.value or 0.0) for *_, bar in bars], bars[0][2].unit)
    sizes = [by * float(bar.value or 0.0) for *_, bar in bars]
    colours = [
        PLANET_COLOURS[list(stages).index(stage) % len(PLANET_COLOURS)] for stage, *_ in bars
    ]
    labels = [words(f"{stage} {name}") or words(stage) for stage, name, _ in bars]
    drawing, axes = panels(1, 1, height_mm=26 + 7.0 * len(bars))
    ax = axes[0, 0]
    labelled_bars(ax, sizes, labels, list(map(number, sizes)), colours)
    ax.set_xlabel(f"{figure.bars.label if figure.bars else figure.meaning} ({unit})")
    if max(sizes) > FAR_APART * min(sizes) > 0.0:
        ax.set_xscale("log")
        ax.set_xlim(0.3 * min(sizes), 10.0 * max(sizes))
        ax.xaxis.set_major_locator(LogLocator(numticks=6))
        ax.xaxis.set_minor_locator(NullLocator())
    else:
        ax.xaxis.set_major_locator(MaxNLocator(5))
        ax.margins(x=0.15)
    ax.xaxis.set_major_formatter(lambda value, _: number(value))
    return drawing
