"""Runs or equilibria side by side: largest gear-mesh force and load sharing of every stage."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from flexgear.model.errors import FlexgearError
from flexgear.views.dense import draw, say_envelope
from flexgear.views.histories import layer, variant_handles
from flexgear.views.sharing_charts import gear_mesh_groups, sample_axis
from flexgear.views.style import KILO, NEUTRAL, panels, styled, variant_colours


@styled
def comparison_chart(runs: Mapping[str, xr.Dataset]) -> Figure:
    """Largest force of the planets (kN) and load sharing K_γ = N max F / Σ F, a row a gear mesh.

    runs: transients, or equilibria, by label, of cases with the same stages.
    """
    forces = {label: gear_mesh_groups(data, "gear_mesh_force") for label, data in runs.items()}
    first = next(iter(forces.values()))
    if any(set(groups) != set(first) for groups in forces.values()):
        raise FlexgearError("cannot draw: the runs are of different stages")
    if len({"time" in data.dims for data in runs.values()}) > 1:
        raise FlexgearError("cannot draw: some are transients and some are equilibria")
    colours, axis_label = variant_colours(runs), ""
    figure, axes = panels(len(first), 2, height_mm=24 + 46 * len(first), sharex=True)
    for k, (label, groups) in enumerate(forces.items()):
        x, axis_label = sample_axis(runs[label], None)
        for row, (title, force) in zip(axes, groups.items(), strict=True):
            factor = runs[label]["planet_load_factor"].sel(gear_mesh=force["gear_mesh"])
            largest = (KILO * force.max("gear_mesh"), factor.max("gear_mesh"))
            row[0].set_title(title)
            for ax, values in zip(row, largest, strict=True):
                if draw(ax, x, values.to_numpy(), colours[label], **layer(k)):
                    say_envelope(ax)
    for row in axes:
        row[0].set_ylabel("largest force (kN)")
        row[1].set_ylabel("load sharing $K_γ$ (–)")
        row[1].axhline(1.0, color=NEUTRAL, lw=0.7)
    for ax in axes[-1]:
        ax.set_xlabel(axis_label)
    handles = variant_handles(colours)
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 5))
    return figure
