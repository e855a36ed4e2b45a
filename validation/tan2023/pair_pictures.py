"""Loads of numbered tooth pairs, stiffness and error of a pair: the paper's Figures 7, 12."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from flexgear.arrays import Array
from flexgear.views.histories import LABELS, engagements, finish_x, flank_label, pair_arrays
from flexgear.views.select import abscissa, planet_count
from flexgear.views.style import (
    KILO,
    MICRO,
    N_PER_M_TO_N_PER_UM,
    NEUTRAL,
    PLANET_COLOURS,
    panels,
    planet_colour,
    styled,
)


@styled
def numbered_pair_loads(dataset: xr.Dataset, gear_mesh: str = "ring", planet: int = 1) -> Figure:
    """Load of each tooth pair with its tooth number, and pairs in contact below (Figure 12)."""
    at = abscissa(dataset, "stage_angle")
    load, tooth, _ = pair_arrays(dataset, gear_mesh, planet)
    figure, axes = panels(2, 1, height_mm=98, sharex=True, height_ratios=[4, 1])
    top, bottom = axes[:, 0]
    low, high = sorted((float(at[0]), float(at[-1])))
    edge = 0.01 * (high - low)
    for number, rows in engagements(tooth):
        value = KILO * np.where(tooth[rows] == number, load[rows], 0.0).sum(axis=1)
        colour, peak = PLANET_COLOURS[number % 5], int(np.argmax(value))
        top.plot(at[rows], value, color=colour)
        if low + edge < at[rows][peak] < high - edge:
            top.annotate(
                f"{number}",
                (at[rows][peak], value[peak]),
                xytext=(0, 3),
                textcoords="offset points",
                ha="center",
                color=colour,
                fontsize=8,
            )
    top.margins(y=0.1)
    top.axhline(0, color=NEUTRAL, lw=0.7)
    top.set_ylabel("load of a tooth pair (kN)")
    teeth = "ring" if gear_mesh == "ring" else "sun"
    flank = flank_label([dataset], gear_mesh)
    top.set_title(f"Tooth-pair loads, {LABELS[gear_mesh]} {planet}{flank} (numbers: {teeth} teeth)")
    bottom.step(at, (tooth > 0).sum(axis=1), where="mid", color=planet_colour(planet))
    bottom.yaxis.set_major_locator(MaxNLocator(integer=True))
    bottom.set_ylabel("pairs in\ncontact")
    bottom.margins(y=0.25)
    finish_x(bottom, "stage_angle", planet_count(dataset), at[0], at[-1])
    return figure


@styled
def pair_stiffness_and_error(
    curves: Mapping[str, Mapping[str, Array]],
    x_label: str = "position on the line of action s (mm)",
    x_factor: float = 1e3,
) -> Figure:
    """Single-pair stiffness and error over the path, sun and ring (Figure 7).

    ``curves[gear_mesh]`` holds arrays "position" (m), "stiffness" (N/m) and, if there is one,
    "error" (m), all (n,).
    """
    with_error = any("error" in c for c in curves.values())
    figure, axes = panels(1, 2 if with_error else 1, height_mm=66)
    colours = {"sun": "#D55E00", "ring": "#0072B2"}
    for name, curve in curves.items():
        colour, label = colours.get(name, NEUTRAL), LABELS.get(name, name)
        at = np.asarray(curve["position"]) * x_factor
        pair = np.asarray(curve["stiffness"]) * N_PER_M_TO_N_PER_UM
        axes[0, 0].plot(at, pair, color=colour, label=label)
        if "error" in curve:
            axes[0, 1].plot(at, np.asarray(curve["error"]) * MICRO, color=colour, label=label)
    axes[0, 0].set_title("(a) single-pair stiffness")
    axes[0, 0].set_ylabel("pair stiffness (N/µm)")
    axes[0, 0].set_ylim(bottom=0)
    if with_error:
        axes[0, 1].set_title("(b) gear-mesh error")
        axes[0, 1].set_ylabel("error along the line of action (µm)")
    for ax in axes[0]:
        ax.set_xlabel(x_label)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure
