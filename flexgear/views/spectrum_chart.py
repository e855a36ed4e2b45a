"""Spectra of gear-mesh forces by order of the gear mesh."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from flexgear.views.style import KILO, panels, planet_colour, styled, text_only

CONSTANT = 1e-7  # of the mean force, rounding of what is kept in single precision
DECADES = 5  # below the largest amplitude that are shown


@styled
def spectrum_chart(spectra: xr.Dataset) -> Figure:
    """Amplitude (N) over order, a line for each kind of gear mesh; whole orders are dotted."""
    figure, axes = panels(1, 1, height_mm=75)
    ax = axes[0, 0]
    order, amplitude = spectra["order"].to_numpy(), spectra["amplitude"].to_numpy()
    mean = float(spectra.attrs["mean_n"])
    if float(np.max(amplitude, initial=0.0)) <= CONSTANT * mean:
        return text_only(f"The forces are constant, {KILO * mean:.4g} kN: no amplitudes to show")
    for k, name in enumerate(spectra["gear_mesh"].to_numpy()):
        ax.plot(order, amplitude[k], color=planet_colour(k + 1), lw=0.9, label=str(name))
    top = float(np.max(amplitude, initial=0.0))
    ax.set_yscale("log")
    ax.set_ylim(top * 10.0**-DECADES, 2 * top)
    for n in range(1, int(order.max(initial=0.0)) + 1):
        ax.axvline(n, color="#9CA3AF", ls=":", lw=0.8)
    ax.set_xlabel("order of the gear mesh (–)")
    ax.set_ylabel("amplitude of the force (N)")
    if len(amplitude) > 1:
        ax.legend(loc="upper right")
    return figure
