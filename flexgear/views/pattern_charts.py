"""Contact pattern of every tooth of a gear, side by side as rows of flanks."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from flexgear.results.tooth_pattern import ToothPattern
from flexgear.views.style import NEUTRAL, SEQUENTIAL_MAP, new_figure, styled

COLUMNS = 8
GAP = 0.12  # between flanks, of their size
N_PER_MM = 1e-3  # N/m -> N/mm
MILLI = 1e3  # m -> mm


@styled
def tooth_rows_chart(pattern: ToothPattern) -> Figure:
    """One flank a tooth, numbered, rows from above: largest line load (N/mm) over face (across)
    and diameter (upwards); scales stand at the first flank of the last row."""
    teeth = len(pattern.line_load)
    columns = min(COLUMNS, teeth)
    rows = math.ceil(teeth / columns)
    figure = new_figure(28 + 14 * rows)
    ax = figure.subplots()
    load = pattern.line_load * N_PER_MM
    largest = float(np.nanmax(load))
    across, upward = (
        (edges - edges[0]) / (edges[-1] - edges[0]) for edges in (pattern.face, pattern.diameter)
    )
    for tooth, cells in enumerate(load):
        x, y = (tooth % columns) * (1 + GAP), (rows - 1 - tooth // columns) * (1 + 3 * GAP)
        shown = ax.pcolormesh(
            x + across, y + upward, cells, cmap=SEQUENTIAL_MAP, vmin=0.0, vmax=largest
        )
        ax.text(x, y + 1.01, str(tooth + 1), fontsize=5.5, color=NEUTRAL, va="bottom")
    ends = [f"{MILLI * edge:.4g}".replace("-", "−") for edge in (pattern.face[0], pattern.face[-1])]
    ax.set_xticks([0.0, 1.0], ends)
    ax.set_yticks([0.0, 1.0], [f"{MILLI * d:.4g}" for d in pattern.diameter[[0, -1]]])
    ax.set_xlabel("along the face, −z to +z (mm)", loc="left")
    ax.set_ylabel("diameter (mm)", loc="bottom")
    ax.set_xlim(-GAP, columns * (1 + GAP))
    ax.set_ylim(-GAP, rows * (1 + 3 * GAP))
    ax.grid(visible=False)
    for spine in ax.spines.values():
        spine.set_visible(False)
    ax.set_title(f"{pattern.title}, {teeth} teeth: largest {largest:.4g} N/mm")
    figure.colorbar(shown, ax=ax, label="largest line load (N/mm)", pad=0.01)
    return figure
