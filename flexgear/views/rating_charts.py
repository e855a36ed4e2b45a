"""A rating in pictures: damage by bin, safeties beside their limits and about a ring."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from flexgear.results.report.wording import words
from flexgear.views.style import (
    DEFORMED_COLOUR,
    NEUTRAL,
    PLANET_COLOURS,
    panels,
    styled,
    text_only,
)

MOST_PARTS = 6  # in the picture of damage
MOST_SHOWN = 24  # parts beside their limits, the weakest
NAMED_BINS = 24  # more have no room for their names
LEAST = 1e-6  # of the largest damage: less is not shown


@styled
def damage_chart(data: xr.Dataset) -> Figure:
    """Damage (share of the life) that every bin takes, of the flank, root and bearing of each stage
    that are damaged most."""
    damage = data["damage"].transpose("part", "bin").to_numpy()
    total = np.where(np.isfinite(damage), damage, 0.0).sum(axis=1)
    of_stage = list(zip(data["part_stage"].to_numpy(), data["part_kind"].to_numpy(), strict=True))
    worst = {of_stage[k]: int(k) for k in np.argsort(total) if total[k] > LEAST * total.max()}
    order = sorted(worst.values(), key=lambda k: -total[k])[:MOST_PARTS]
    if not total.any():
        return text_only("No bin damages any part that is assessed")
    names, count = data["bin"].to_numpy(), data.sizes["bin"]
    figure, axes = panels(1, 1, height_mm=95)
    ax, at = axes[0, 0], np.arange(count)
    width = 0.8 / len(order)
    for place, k in enumerate(order):
        label = f"{words(str(data['part'].to_numpy()[k]))}: {total[k]:.3g}"
        colour = PLANET_COLOURS[place]
        if count <= NAMED_BINS:
            ax.bar(at + (place - (len(order) - 1) / 2) * width, damage[k], width, color=colour,
                   label=label)  # fmt: skip
        else:
            ax.step(at + 1, damage[k], where="mid", color=colour, lw=1.0, label=label)
    ax.set_yscale("log")
    ax.set_ylim(LEAST * damage[order].max(), 2 * damage[order].max())
    ax.yaxis.set_major_locator(LogLocator(numticks=8))
    ax.set_ylabel("damage in the bin (–)")
    ax.set_title("Damage by load bin; extreme loads have no duration")
    if count <= NAMED_BINS:
        ax.set_xticks(at, [str(name) for name in names], rotation=60, ha="right")
    else:
        ax.set_xlabel("number of the bin (–)")
    ax.grid(axis="x", visible=False)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


@styled
def safety_chart(data: xr.Dataset) -> Figure:
    """Factor on all loads that each part would bear within its limits; 1 is the limit."""
    reserve = data["load_reserve"].to_numpy()
    finite = [k for k in np.argsort(reserve) if np.isfinite(reserve[k]) and reserve[k] > 0.0]
    weakest = finite[:MOST_SHOWN]
    if not weakest:
        return text_only("No part is assessed")
    figure, axes = panels(1, 1, height_mm=24 + 6.5 * len(weakest))
    ax, at = axes[0, 0], np.arange(len(weakest))
    sizes = reserve[weakest]
    colours = [DEFORMED_COLOUR if size < 1.0 else PLANET_COLOURS[0] for size in sizes]
    drawn = ax.barh(at, sizes, 0.7, color=colours)
    ax.set_xscale("log")
    ax.set_xlim(min(0.5, 0.7 * sizes.min()), max(2.0, 1.5 * sizes.max()))
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.xaxis.set_minor_locator(NullLocator())
    ax.bar_label(drawn, [f"{size:.3g}" for size in sizes], padding=2, fontsize=7.5)
    ax.axvline(1.0, color=NEUTRAL, lw=1.2, ls="--")
    ax.set_yticks(at, [words(str(data["part"].to_numpy()[k])) for k in weakest])
    ax.invert_yaxis()
    ax.set_title("Factor on all loads that parts bear within their limits")
    ax.set_xlabel("factor on all loads within the limits (–)")
    ax.grid(axis="y", visible=False)
    return figure


@styled
def ring_safety_chart(data: xr.Dataset) -> Figure:
    """Safety of the teeth of rings that stand by computed stresses, over their azimuth, beside that
    by ISO 6336 (dashed); a panel of each ring."""
    part = data["ring_tooth_part"].to_numpy()
    stages = list(dict.fromkeys(data["part_stage"].sel(part=part).to_numpy()))
    figure, axes = panels(len(stages), 1, height_mm=25 + 65 * len(stages))
    for ax, stage in zip(axes[:, 0], stages, strict=True):
        of_stage = [p for p in dict.fromkeys(part) if data["part_stage"].sel(part=p) == stage]
        for name, colour in zip(of_stage, PLANET_COLOURS, strict=False):
            azimuth = np.degrees(data["ring_tooth_azimuth"].to_numpy()[part == name])
            safety = data["direct_tooth_safety"].to_numpy()[part == name]
            norm, text = float(data["safety"].sel(part=name)), words(str(name))
            label = f"{text}: least {safety.min():.3g} at {azimuth[safety.argmin()]:.0f} deg"
            ax.plot(azimuth, safety, marker=".", ms=3, lw=1.0, color=colour, label=label)
            if np.isfinite(norm):
                label = f"{text} by ISO 6336: {norm:.3g}"
                ax.plot([0.0, 360.0], [norm, norm], ls="--", lw=1.2, color=colour, label=label)
        ax.set_xlim(0.0, 360.0)
        ax.set_xticks(np.arange(0, 361, 45))
        ax.set_ylim(bottom=0.0)
        ax.set_ylabel("safety (–)")
        ax.set_title(f"{words(str(stage))}: teeth of the standing ring, by computed stresses")
    axes[-1, 0].set_xlabel("azimuth of the tooth (deg)")
    figure.legend(loc="outside lower center", ncols=2)
    return figure
