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
    published = reference(PAPER).values()
    for stage in dict.fromkeys(line.where for line in published):
        lines = [line for line in published if line.where == stage]
        off = [100 * (values[line.quantity] / line.value - 1) for line in lines]
        axis.plot(range(len(off)), off, ".", label=stage)
    axis.set(xlabel="line of its stage", ylabel="computed against printed (%)")
    axis.legend()
    return figure
