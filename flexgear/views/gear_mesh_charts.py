"""Transmission error, loaded and unloaded, with its orders, and gear-mesh stiffness, over cycles.

Datasets are those of ``gear_mesh_cycles``; where it looks at several cycles curves show the
first, orders come from all.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from flexgear.views.face_load_charts import carrying, legend
from flexgear.views.style import (
    MICRO,
    N_PER_M_TO_N_PER_UM,
    ORIGINAL_COLOUR,
    SPLIT_COLOUR,
    panels,
    planet_colour,
    styled,
)

PHASE = "gear-mesh cycle (–)"
STATES = (
    ("transmission_error", "under load", ORIGINAL_COLOUR),
    ("unloaded_transmission_error", "unloaded", SPLIT_COLOUR),
)


@styled
def transmission_error_chart(data: xr.Dataset) -> Figure:
    """Transmission error of planet 1 over a gear-mesh cycle less its mean, µm along the line of
    action, and its amplitudes by order of the gear mesh, under load and unloaded."""
    groups = {title: flanks[0] for title, flanks in carrying(data)}
    height = 14 + 52 * len(groups)
    figure, axes = panels(len(groups), 2, height_mm=height, width_ratios=[3, 2])
    first = data.isel(position=data["gear_mesh_phase"].to_numpy() < 1.0 - 1e-9)
    for (left, right), (title, name) in zip(axes, groups.items(), strict=True):
        notes = []
        for k, (error, state, colour) in enumerate(STATES):
            values = first[error].sel(flank=name).to_numpy() * MICRO
            notes.append(f"{values.mean():.4g} ± {0.5 * np.ptp(values):.3g} µm {state}")
            phase = first["gear_mesh_phase"].to_numpy()
            left.plot(phase, values - values.mean(), color=colour, label=state)
            orders = data["gear_mesh_order"].to_numpy()
            amplitude = data[f"{error}_order"].sel(flank=name).to_numpy() * MICRO
            right.bar(orders + 0.4 * (k - 0.5), amplitude, 0.4, color=colour)
        planet = int(data["flank_planet"].sel(flank=name))
        left.set_title(f"{title}, planet {planet}: mean " + "; ".join(notes))
        left.set(xlabel=PHASE, ylabel="less its mean (µm)", xlim=(0.0, 1.0))
        right.set(xlabel="order of the gear mesh (–)", ylabel="amplitude (µm)")
        right.set_xticks(orders[:: max(1, len(orders) // 10)])
    legend(figure, axes)
    return figure


@styled
def stiffness_chart(data: xr.Dataset) -> Figure:
    """Stiffness of every gear mesh (N/µm along the line of action) over a gear-mesh cycle."""
    groups = dict(carrying(data))
    figure, axes = panels(len(groups), 1, height_mm=14 + 48 * len(groups), sharex=True)
    first = data.isel(position=data["gear_mesh_phase"].to_numpy() < 1.0 - 1e-9)
    for ax, (title, flanks) in zip(axes[:, 0], groups.items(), strict=True):
        for name in flanks:
            planet = int(data["flank_planet"].sel(flank=name))
            stiffness = first["gear_mesh_stiffness"].sel(flank=name) * N_PER_M_TO_N_PER_UM
            label = f"planet {planet}"
            ax.plot(first["gear_mesh_phase"], stiffness, color=planet_colour(planet), label=label)
        mean = float(data["gear_mesh_stiffness"].sel(flank=flanks).mean()) * N_PER_M_TO_N_PER_UM
        ax.set_title(f"{title}: mean {mean:,.0f} N/µm".replace(",", "\u2009"))
        ax.set(ylabel="N/µm", xlim=(0.0, 1.0))
    axes[-1, 0].set_xlabel(PHASE)
    legend(figure, axes)
    return figure
