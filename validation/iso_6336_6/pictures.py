"""The life curve, and the bins of the spectrum beside it."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from rows import Drawn, Picture

from flexgear.views.style import panels, styled
from iso_6336_6.statements import CURVE, spectrum


def drawn() -> Iterator[Drawn]:
    """One picture."""
    note = "Line: strength of the flank; steps: stresses of the bins over their cumulated cycles."
    yield curve(), Picture("curve.png", "Spectrum and life curve", note)


@styled
def curve() -> Figure:
    """Stress over cycles."""
    figure, axes = panels(1, 1, height_mm=90)
    axis, cycles = axes[0][0], np.geomspace(1e3, 1e11, 400)
    axis.loglog(cycles, [CURVE.stress_at(float(n)) for n in cycles], label="strength")
    loads = spectrum()[1]
    axis.step(np.cumsum(loads.cycles), loads.stress, where="pre", label="spectrum")
    axis.set(xlabel="load cycles", ylabel="contact stress (N/mm²)")
    axis.legend()
    return figure
