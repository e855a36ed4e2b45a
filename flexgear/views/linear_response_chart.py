"""Linear forced response to the static transmission error: gear-mesh force over speed by order."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexgear.views.style import KILO, PLANET_COLOURS, legend_below, legend_lines, panels, styled

DECADES = 3.0  # below the highest value that a panel shows
MOST_LABELS = 8  # of peaks in a panel
ROOM = 0.07  # of the width that a label takes


@styled
def linear_response_chart(data: xr.Dataset) -> Figure:
    """Amplitude of the largest gear-mesh force of each stage by order of its gear-mesh frequency,
    with the mode that has most of each peak."""
    stages = list(dict.fromkeys(map(str, data["stage"].to_numpy())))
    figure, axes = panels(len(stages), 1, height_mm=22 + 68 * len(stages), sharex=True)
    for ax, stage in zip(axes[:, 0], stages, strict=True):
        _panel(ax, data, stage)
        if len(stages) > 1:
            ax.set_title(stage.replace("_", " "))
    axes[-1, 0].set_xlabel("speed over rated speed (–)")
    orders = data["gear_mesh_order"].to_numpy().tolist()
    colours = {f"order {o}": PLANET_COLOURS[(o - 1) % len(PLANET_COLOURS)] for o in orders}
    legend_below(figure, legend_lines(colours), 5)
    return figure


def _panel(ax: Axes, data: xr.Dataset, stage: str) -> None:
    """One stage."""
    of_stage = np.flatnonzero(data["stage"].to_numpy() == stage)
    force = KILO * data["linear_force_amplitude"].to_numpy()[:, of_stage].max(axis=1)
    factor = data["speed_factor"].to_numpy()
    for k, order in enumerate(data["gear_mesh_order"].to_numpy().tolist()):
        ax.semilogy(factor, force[:, k], color=PLANET_COLOURS[(order - 1) % len(PLANET_COLOURS)])
    top = float(force.max(initial=0.0)) or 1.0
    ax.set(xlim=(factor[0], factor[-1]), ylim=(top * 10**-DECADES, 3.0 * top))
    ax.set_ylabel("amplitude of gear-mesh force (kN)")
    names = set(data["gear_mesh"].to_numpy()[of_stage].tolist())
    labelled = set[tuple[float, int]]()
    for k in range(data.sizes.get("peak", 0)):
        row = data.isel(peak=k)
        at, order = float(row["peak_factor"]), int(row["peak_order"])
        height = KILO * float(row["peak_force"])
        beside = any(abs(at - x) < ROOM * np.ptp(factor) for x, _ in labelled)
        hidden = height < 0.99 * force[:, order - 1][np.argmin(np.abs(factor - at))]
        if str(row["peak_gear_mesh"].values) not in names or beside or hidden:
            continue
        labelled.add((at, order))
        share = row["peak_mode_share"]
        mode = int(data["kept_mode"][int(np.argmax(share.to_numpy()))])
        ax.annotate(f"mode {mode}", (at, height), xytext=(0, 3), textcoords="offset points",
                    fontsize=7, ha="center")  # fmt: skip
        if len(labelled) == MOST_LABELS:
            break
