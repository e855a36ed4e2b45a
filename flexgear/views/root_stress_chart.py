"""Stress in tooth roots over the turn of the lead and along the face."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexgear.results.root_stress import gears_of
from flexgear.views.face_load_charts import ALONG_FACE
from flexgear.views.style import NEUTRAL, panels, planet_colour, styled

MEGA = 1e-6  # Pa -> MPa
TOOTH = "#333333"
SIDES = {"-theta": "−θ", "+theta": "+θ"}


@styled
def root_stress_chart(data: xr.Dataset, stage: str) -> Figure:
    """Of each gear of a stage (MPa). Left: largest stress in the roots that carry in the gear
    meshes of planet 1 over the turn of the lead, thin the least in the other fillets of these
    teeth; of an FE ring the largest in both fillets of its first tooth, too. Right: along the face
    where the largest is largest, of every planet."""
    gears = dict(gears_of(data, stage))
    figure, axes = panels(len(gears), 2, height_mm=26 + 46 * len(gears), sharex="col", sharey="row")
    turn = np.degrees(data["input_angle"].to_numpy()[:, 0])
    for (left, right), (gear, of_gear) in zip(axes, gears.items(), strict=True):
        for k in range(of_gear.sizes["flank"]):
            of_flank = of_gear.isel(flank=k)
            planet, kind = int(of_flank["flank_planet"]), str(of_flank["flank_kind"].item())
            dashed = gear == "planet" and kind == "sun"
            look = {"color": planet_colour(planet), "ls": "--" if dashed else "-"}
            if planet == 1:
                title = f"planet with the {kind}" if gear == "planet" else None
                left.plot(turn, of_flank["root_stress"] * MEGA, lw=0.9, label=title, **look)
                pressed = of_flank["face_root_compression"].min("face") * MEGA
                left.plot(turn, pressed, lw=0.4, **look)
            _along(
                right, of_flank, look, f"planet {planet}" if kind == gear or kind == "ring" else ""
            )
        if gear == "ring" and "tooth_root_stress" in of_gear:
            _first_tooth(left, turn, of_gear, stage)
        left.set_title(f"{gear}: largest {float(of_gear['root_stress'].max()) * MEGA:.0f} MPa")
        left.set_ylabel("root stress (MPa)")
        for ax in (left, right):
            ax.axhline(0.0, color=NEUTRAL, lw=0.5, zorder=1)
    axes[-1, 0].set_xlabel("rotation of the lead (°)")
    axes[-1, 1].set_xlabel(ALONG_FACE)
    shown = [ax.get_legend_handles_labels() for ax in (*axes[:, 0], axes[0, 1])]
    by_label = {
        label: line for lines, title in shown for line, label in zip(lines, title, strict=True)
    }
    figure.legend(by_label.values(), by_label, loc="outside lower center", ncols=4)
    return figure


def _along(ax: Axes, of_flank: xr.Dataset, look: dict[str, Any], label: str) -> None:
    worst = int(np.nanargmax(of_flank["root_stress"].to_numpy()))
    at = of_flank.isel(position=worst)
    ax.plot(of_flank["face"], at["face_root_stress"] * MEGA, lw=0.9, label=label or None, **look)
    ax.plot(of_flank["face"], at["face_root_compression"] * MEGA, lw=0.4, **look)


def _first_tooth(ax: Axes, turn: Any, of_gear: xr.Dataset, stage: str) -> None:
    first = int(np.argmax(of_gear["tooth_stage"].to_numpy() == stage))
    for fillet, style in zip(of_gear["fillet"].to_numpy(), ("-", ":"), strict=True):
        stress = of_gear["tooth_root_stress"].isel(tooth=first).sel(fillet=fillet) * MEGA
        ax.plot(
            turn,
            stress,
            style,
            color=TOOTH,
            lw=0.8,
            label=f"ring tooth 1, fillet at {SIDES[str(fillet)]}",
        )
