"""Differences from the printed figures."""

from collections.abc import Iterator

from matplotlib.figure import Figure
from rows import Drawn, Picture, reference

from flexgear.views.style import panels, styled
from reboucas2020.statements import PAPER, figures


def drawn() -> Iterator[Drawn]:
    """One picture."""
    note = "Computed over printed less one, of every line of reference.csv, by stage."
    yield differences(), Picture("differences.png", "Factors, stresses and safeties", note)


@styled
def differences() -> Figure:
    """One dot for each line, by stage."""
    figure, axes = panels(1, 1, height_mm=90)
    values, axis = figures(), axes[0][0]
    for stage in ("stage 1", "stage 2", "stage 3"):
        lines = [line for line in reference(PAPER).values() if line.where == stage]
        off = [100 * (values[line.quantity] / line.value - 1) for line in lines]
        axis.plot(range(len(off)), off, ".", label=stage)
    axis.set(xlabel="line of its stage", ylabel="computed against printed (%)")
    axis.legend()
    return figure
