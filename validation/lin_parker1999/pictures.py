"""Printed against computed frequencies, and how they go on with more planets."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from rows import Drawn, Picture, reference

from flexgear.views.style import PLANET_COLOURS, panels, styled
from lin_parker1999.package import KINDS, by_package
from lin_parker1999.statements import NUMBERS, PAPER, PRINTED, frequency

COLOURS = dict(zip(KINDS, PLANET_COLOURS, strict=False))


def drawn() -> Iterator[Drawn]:
    """One picture."""
    note = (
        "Left: lines are computed, dots printed (N = 3 and 4). Right: difference of every printed "
        "frequency against the band of 0.05 %."
    )
    title = "Natural frequencies by type and number of planets"
    yield frequencies(), Picture("frequencies.png", title, note)


@styled
def frequencies() -> Figure:
    """Left: frequencies over N by type; right: differences from the print."""
    figure, axes = panels(1, 2, height_mm=95, width_ratios=(1.2, 1))
    left, right = axes[0]
    for kind in KINDS:
        numbers = [n for n in NUMBERS if by_package(n).different(kind)]
        values = np.array([by_package(n).different(kind) for n in numbers])
        values[values < 1] = np.nan  # the rigid mode has no place on this axis
        lines = left.semilogy(numbers, values, "-", color=COLOURS[kind], lw=1.2)
        lines[-1].set_label(kind)
    for quantity, line in reference(PAPER).items():
        planets = int(quantity.removeprefix("N = ").partition(",")[0])
        kind = quantity.split()[-2]
        left.plot(planets, line.value, "o", color=COLOURS[kind], ms=4, mfc="white")
        off = frequency(by_package(planets), quantity) / line.value - 1
        marker = {PRINTED[0]: "o", PRINTED[1]: "s"}[planets]
        right.semilogx(line.value, 100 * off, marker, color=COLOURS[kind], ms=4)
    left.set(xlabel="number of planets", ylabel="frequency (Hz)", title="computed and printed")
    left.legend(loc="center left", bbox_to_anchor=(0.0, 0.55))
    right.axhspan(-0.05, 0.05, color="#E3E5E8", zorder=0)
    right.set(xlabel="printed frequency (Hz)", ylabel="computed against printed (%)",
              title="difference (○ 3, □ 4 planets)", ylim=(-0.1, 0.1))  # fmt: skip
    return figure
