"""A figure of the stages in a summary as bars, by its declaration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import figure as canvas
from matplotlib.ticker import MaxNLocator

from flexgear.results.figure import Figure
from flexgear.results.report.figure_rows import row
from flexgear.results.report.wording import number, scale, words
from flexgear.views.style import PLANET_COLOURS, panels, styled


@styled
def figure_bars(figure: Figure, stages: Mapping[str, Any]) -> canvas.Figure:
    """A bar for the value of every stage, or for each of its values by name; a colour a stage."""
    bars = [
        (stage, name, row(figure, value))
        for stage, of_stage in stages.items()
        for name, value in (of_stage if isinstance(of_stage, Mapping) else {"": of_stage}).items()
    ]
    unit, by = scale([float(bar.value or 0.0) for *_, bar in bars], bars[0][2].unit)
    sizes = [by * float(bar.value or 0.0) for *_, bar in bars]
    colours = [
        PLANET_COLOURS[list(stages).index(stage) % len(PLANET_COLOURS)] for stage, *_ in bars
    ]
    labels = [words(f"{stage} {name}") or words(stage) for stage, name, _ in bars]
    drawing, axes = panels(1, 1, height_mm=26 + 7.0 * len(bars))
    ax, at = axes[0, 0], np.arange(len(bars))
    drawn = ax.barh(at, sizes, 0.7, color=colours)
    ax.bar_label(drawn, [number(size) for size in sizes], padding=2, fontsize=7.5)
    ax.set_yticks(at, labels)
    ax.invert_yaxis()
    ax.set_xlabel(f"{figure.bars.label if figure.bars else figure.meaning} ({unit})")
    ax.xaxis.set_major_locator(MaxNLocator(5))
    ax.xaxis.set_major_formatter(lambda value, _: number(value))
    ax.grid(axis="y", visible=False)
    ax.margins(x=0.15)
    ax.tick_params(axis="y", length=0)
    return drawing
