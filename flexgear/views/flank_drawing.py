"""Topography of a modified flank: what it lacks over roll length and face."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexgear.gears.flanks import GearFlank
from flexgear.views.style import (
    MICRO,
    NEUTRAL,
    SEQUENTIAL_MAP,
    VARIANT_COLOURS,
    FloatArray,
    new_figure,
    styled,
)

MILLI = 1e3
POINTS = 201  # along each axis
LEVELS = 8
_COLOURS = (*VARIANT_COLOURS.values(), NEUTRAL)
_LINES = ("-", "--", "-")


@styled
def flank_drawing(flank: GearFlank, where: str = "") -> Figure:
    """What a flank lacks (µm, normal to it in the transverse section) as a map over the face and
    the roll length, the tip above, with traces of the profile and of the helix beside it.

    where: the stage, in the title.
    """
    rho, z, gap = flank.surface(POINTS)
    gap = MICRO * gap
    figure = new_figure(110)
    grid = figure.add_gridspec(2, 2, width_ratios=(3, 1.2), height_ratios=(2.2, 1))
    surface = figure.add_subplot(grid[0, 0])
    profile = figure.add_subplot(grid[0, 1], sharey=surface)
    helix = figure.add_subplot(grid[1, 0], sharex=surface)
    _map(figure, surface, MILLI * z, MILLI * rho, gap)
    for k, (at, label) in enumerate(((0, "−z end"), (POINTS // 2, "middle"), (-1, "+z end"))):
        profile.plot(
            gap[:, at], MILLI * rho, _LINES[k], color=_COLOURS[k], label=f"profile, {label}"
        )
    for k, (at, label) in enumerate(((0, "root"), (POINTS // 2, "middle"), (-1, "tip"))):
        helix.plot(MILLI * z, gap[at], _LINES[k], color=_COLOURS[k], label=f"helix, {label}")
    surface.set_ylim(MILLI * rho[0], MILLI * rho[-1])  # root below, tip above
    surface.set_ylabel("roll length (mm), tip above")
    helix.set_xlabel("place along the face z (mm)")
    helix.set_ylabel("missing (µm)")
    profile.set_xlabel("missing (µm)")
    key = figure.add_subplot(grid[1, 1])
    key.axis("off")
    shown = [*profile.get_lines(), *helix.get_lines()]
    key.legend(handles=shown, loc="center left", borderpad=0.0)
    ends = " … ".join(f"{x:.3g}".replace("-", "−") for x in (gap.min(), gap.max()))
    surface.set_title(f"{where} {_title_of(flank)}: {ends} µm missing".strip())
    return figure


def _title_of(flank: GearFlank) -> str:
    if flank.part == "planet":
        return f"planet, flank towards the {flank.name}"
    return f"{flank.part}, {flank.name} flank"


def _map(figure: Figure, ax: Axes, z: FloatArray, rho: FloatArray, gap: FloatArray) -> None:
    """Colours with contours in round micrometres."""
    low, high = float(gap.min()), max(float(gap.max()), float(gap.min()) + 1e-9)
    colours = ax.pcolormesh(
        z, rho, gap, shading="nearest", vmin=low, vmax=high, cmap=SEQUENTIAL_MAP, rasterized=True
    )
    if np.ptp(gap) > 1e-6 * np.abs(gap).max():
        lines = ax.contour(z, rho, gap, LEVELS, colors="white", linewidths=0.6, linestyles="solid")
        ax.clabel(lines, fontsize=7, fmt="%g")
    ax.set_xlim(z[0], z[-1])
    ax.grid(False)
    figure.colorbar(colours, ax=ax, label="missing (µm)")
