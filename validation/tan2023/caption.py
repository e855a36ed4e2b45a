"""The paper's statement beside ours, under a picture."""

from __future__ import annotations

import re
import textwrap

import numpy as np
from matplotlib.figure import Figure

from flexgear.views.style import NEUTRAL, new_figure, styled

DPI = 160.0
MM = 25.4
LINE_MM = 3.7
COLUMN_MM = 1.42  # width of a character
VERDICT_COLOURS = {
    "met": "#117733",
    "not met": "#C5221F",
    "disagrees": "#B45309",
    "reported": NEUTRAL,
}


def wrap(text: str, width: int) -> list[str]:
    """Lines of at most ``width`` characters; a number keeps its unit, minus is a minus."""
    text = re.sub(r"(?<=\d) (?=%|µm|kN|N m|s\b|rad\b|r/min|kg m²)", "\u00a0", text)
    text = re.sub(r"(?<![\w.)])-(?=\d)", "−", text)
    return textwrap.wrap(text, width, break_on_hyphens=False)


@styled
def captioned(
    figure: Figure, title: str, rows: list[tuple[str, str, str]], footnote: str = ""
) -> Figure:
    """``figure`` with a title above and rows (published, computed, verdict) below, as pixels."""
    figure.set_dpi(DPI)
    canvas = figure.canvas
    canvas.draw()
    canvas.draw()  # the layout needs a second pass for legends outside the axes
    pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[attr-defined]
    height, width = pixels.shape[:2]
    width_mm = width / DPI * MM
    column = int((width_mm / 2 - 8) / COLUMN_MM)
    wrapped = [(wrap(paper, column), wrap(ours, column), verdict) for paper, ours, verdict in rows]
    lines = sum(max(len(p), len(o) + 1) + 0.6 for p, o, _ in wrapped)
    note = wrap(footnote, 2 * column)
    below = 9 + LINE_MM * (lines + len(note))
    above = 9.0
    total = height / DPI * MM + above + below
    page = new_figure(total, width_mm)
    page.set_layout_engine("none")
    page.set_dpi(DPI)
    image = page.add_axes((0.0, below / total, 1.0, 1.0 - (above + below) / total))
    image.imshow(pixels, aspect="auto", interpolation="none")
    image.set_axis_off()

    def at(mm_from_top: float) -> float:
        return 1.0 - mm_from_top / total

    page.text(4 / width_mm, at(6.5), title, fontsize=10.5, weight="bold")
    y = total - below + 4.5
    left, right = 4 / width_mm, 0.5 + 2 / width_mm
    page.text(left, at(y), "Tan et al. 2023, in our words", fontsize=8, weight="bold")
    page.text(right, at(y), "flexgear", fontsize=8, weight="bold")
    for paper, ours, verdict in wrapped:
        for k, line in enumerate(paper):
            page.text(left, at(y + LINE_MM * (k + 1)), line, fontsize=7.5)
        for k, line in enumerate(ours):
            page.text(right, at(y + LINE_MM * (k + 1)), line, fontsize=7.5)
        page.text(
            right,
            at(y + LINE_MM * (len(ours) + 1)),
            verdict,
            fontsize=7.5,
            weight="bold",
            color=VERDICT_COLOURS.get(verdict, NEUTRAL),
        )
        y += LINE_MM * (max(len(paper), len(ours) + 1) + 0.6)
    for k, line in enumerate(note):
        page.text(left, at(y + LINE_MM * (k + 1)), line, fontsize=7, color=NEUTRAL)
    return page
