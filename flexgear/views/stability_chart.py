"""Parametric instability over speed: growth rates, with the bands and the modes that act."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flexgear.views.style import (
    NEUTRAL,
    PLANET_COLOURS,
    least_span,
    legend_below,
    legend_lines,
    panels,
    styled,
)

MOST_LABELS = 8  # of bands in a panel, the fastest
ROOM = 0.06  # of the width that a label takes
UNSTABLE, SHADE = PLANET_COLOURS[4], "#FBE9DF"


@styled
def stability_chart(data: xr.Dataset) -> Figure:
    """Growth rate over speed, a panel a stage; shaded bands where vibration grows, with the modes i
    and j and the order l of l f_z = f_i + f_j at the fastest; grey: where the case runs."""
    stages = [str(s) for s in data["turning_stage"].to_numpy()]
    figure, axes = panels(len(stages), 1, height_mm=22 + 58 * len(stages), sharex=True)
    for ax, stage in zip(axes[:, 0], stages, strict=True):
        _panel(ax, data, stage)
        if len(stages) > 1:
            ax.set_title(stage.replace("_", " "))
    axes[-1, 0].set_xlabel("speed over rated speed (–)")
    legend_below(
        figure,
        legend_lines(
            {"growth of free vibration": UNSTABLE, "speeds at which the case runs": NEUTRAL}
        ),
        2,
    )
    return figure


def _panel(ax: Axes, data: xr.Dataset, stage: str) -> None:
    """One stage."""
    factor, growth = with_edges(data, stage)
    for speed in np.atleast_1d(data.attrs["operating_factors"]):
        if factor[0] <= speed <= factor[-1]:
            ax.axvline(speed, color=NEUTRAL, lw=0.8)
    bands = bands_of(data, stage)
    for band in bands:
        ax.axvspan(band["lower_factor"], band["upper_factor"], color=SHADE, zorder=0)
    ax.plot(factor, growth, color=UNSTABLE)
    ax.set(xlim=(factor[0], factor[-1]), ylabel="growth rate (1/s)")
    if not bands:
        ax.set_ylim(-0.05, 1.0)
        ax.text(0.5, 0.5, "no vibration grows in this range", transform=ax.transAxes, ha="center",
                color=NEUTRAL)  # fmt: skip
        return
    least_span(ax, 1e-3)
    ax.set_ylim(0.0, 1.18 * float(growth.max()))
    _labels(ax, bands, factor[-1] - factor[0])


def _labels(ax: Axes, bands: list[dict[str, Any]], width: float) -> None:
    """Modes and order above the fastest bands that have room."""
    placed: list[float] = []
    for band in sorted(bands, key=lambda b: -b["growth_rate"])[:MOST_LABELS]:
        at = band["peak_factor"]
        if any(abs(at - other) < ROOM * width for other in placed):
            continue
        placed.append(at)
        ax.annotate(
            combination(band["modes"], band["order"]), (at, band["growth_rate"]), xytext=(0, 3),
            textcoords="offset points", fontsize=7, ha="center", va="bottom",
        )  # fmt: skip


def combination(modes: tuple[int, int], order: int) -> str:
    """ "2 f₃ = f_z", "f₂ + f₅ = 3 f_z" of modes i, j and order l."""
    i, j = (f"f$_{{{k}}}$" for k in modes)
    left = f"2 {i}" if modes[0] == modes[1] else f"{i} + {j}"
    return f"{left} = {'' if order == 1 else f'{order} '}f$_z$"


def bands_of(data: xr.Dataset, stage: str) -> list[dict[str, Any]]:
    """Bands of a stage as plain rows, rising in speed."""
    names = ("lower_factor", "upper_factor", "peak_factor", "growth_rate", "order")
    return [
        {name: data[f"band_{name}"].values[k].item() for name in names}
        | {"modes": tuple(int(m) for m in data["band_modes"].values[k])}
        for k in range(data.sizes.get("band", 0))
        if str(data["band_stage"].values[k]) == stage
    ]


def with_edges(data: xr.Dataset, stage: str) -> tuple[np.ndarray, np.ndarray]:
    """Speed factors and growth rates of a stage, with zeros at the edges of its bands."""
    factor = data["speed_factor"].to_numpy().astype(float)
    growth = data["growth_rate"].sel(turning_stage=stage).to_numpy().astype(float)
    edges = np.array(
        [band[end] for band in bands_of(data, stage) for end in ("lower_factor", "upper_factor")]
    )
    edges = edges[(edges > factor[0]) & (edges < factor[-1])]
    both = np.concatenate([factor, edges])
    order = np.argsort(both, kind="stable")
    return both[order], np.concatenate([growth, np.zeros(len(edges))])[order]
