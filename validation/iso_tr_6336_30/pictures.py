"""Differences from the printed figures, and the curves of permissible stress."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from rows import Drawn, Picture, reference

from flexgear.gears.rating.damage import LifeCurve
from flexgear.gears.rating.steels import flank_knees, root_knees
from flexgear.views.style import panels, styled
from iso_tr_6336_30.statements import PAPER, figures

CYCLES = np.geomspace(1e2, 1e11, 400)


def drawn() -> Iterator[Drawn]:
    """One picture."""
    note = (
        "Left: computed over printed less one, of every line; grey: 0.3 %. Right: life factors of "
        "case-hardened steel, dots: the knees of ISO 6336-2 and -3."
    )
    yield differences(), Picture("differences.png", "Example 1, and the life factors it uses", note)


@styled
def differences() -> Figure:
    """Left: by quantity; right: Z_NT and Y_NT."""
    figure, axes = panels(1, 2, height_mm=130)
    left, right = axes[0]
    lines = list(reference(PAPER).values())
    off = [100 * (figures()[line.quantity] / line.value - 1) for line in lines]
    left.axvspan(-0.3, 0.3, color="#E3E5E8", zorder=0)
    left.barh(range(len(lines)), off, height=0.6)
    left.set_yticks(range(len(lines)), [line.quantity for line in lines], fontsize=6)
    left.invert_yaxis()
    left.set(xlabel="computed against printed (%)", title="printed figures")
    for name, knees in (
        ("Z_NT", flank_knees("case_hardened", 0.85, limited_pitting=False)),
        ("Y_NT", root_knees("case_hardened", 0.85)),
    ):
        cycles, factors = zip(*knees, strict=True)
        curve = LifeCurve(cycles, factors)
        drawn = right.loglog(CYCLES, [curve.stress_at(float(n)) for n in CYCLES], label=name)
        right.plot(cycles, factors, "o", color=drawn[0].get_color(), ms=4)
    right.set(xlabel="load cycles", ylabel="life factor", title="case-hardened steel")
    right.legend()
    return figure
