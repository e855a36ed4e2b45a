"""Strain of virtual gauges over time or the turn of the lead."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from flexgear.views.select import variable
from flexgear.views.style import MICRO, panels, styled


@styled
def gauges_chart(data: xr.Dataset) -> Figure:
    """Strain (µm/m) of every gauge, a panel each, over time in a transient and over the rotation of
    the lead in equilibria."""
    strain = variable(data, "gauge_strain") * MICRO
    if "time" in data.dims:
        at, label = data["time"].to_numpy(), "time (s)"
    else:
        at, label = np.degrees(data["input_angle"].to_numpy()[:, 0]), "rotation of the lead (°)"
    names = [str(name) for name in data["gauge"].to_numpy()]
    figure, axes = panels(len(names), 1, height_mm=16 + 34 * len(names), sharex=True)
    for ax, name in zip(axes[:, 0], names, strict=True):
        values = strain.sel(gauge=name).to_numpy()
        ax.plot(at, values, lw=0.9)
        ax.set_title(f"{name}: {values.min():.1f} … {values.max():.1f} µm/m")
        ax.set_ylabel("strain (µm/m)")
    axes[-1, 0].set_xlabel(label)
    figure.align_ylabels(axes[:, 0])
    return figure
