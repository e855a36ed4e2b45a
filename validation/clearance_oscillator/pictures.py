"""Resonances of a pair with clearance over the free motion and the first-order balance."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from rows import Drawn, Picture

from clearance_oscillator.equations import backbone, forced
from clearance_oscillator.statements import (
    amplitude,
    by_one_harmonic,
    free,
    largest_force,
)
from flexgear.views.style import PLANET_COLOURS, panels, styled

ERROR, DAMPING = 0.1, 0.02  # of the case, the error over x_s


def drawn() -> Iterator[Drawn]:
    """One picture."""
    note = (
        "Lines are computed, dots closed forms. Left: hardly damped, the tongue stands about the "
        "free motion. Right: one harmonic, damped always, the error a tenth of x_s."
    )
    yield resonances(), Picture("resonances.png", "Resonances of a pair with clearance", note)


@styled
def resonances() -> Figure:
    """Left: largest force over frequency; right: amplitude of x of one harmonic."""
    figure, axes = panels(1, 2, height_mm=90)
    left, right = axes[0]
    cases = (("one flank", np.inf, 4.8), ("both flanks", 2.0, 7.0))
    for (flanks, clearance, most), colour in zip(cases, PLANET_COLOURS, strict=False):
        data, forces = free(flanks), np.linspace(1.5, most, 20)
        x = data["response_speed_share"]
        left.plot(x, np.where(largest_force(data) < 8.0, largest_force(data), np.nan), color=colour)
        closed = [backbone(float(p), clearance) for p in forces]
        left.plot(closed, forces, "o", color=colour, ms=4, mfc="white", label=flanks)
    left.set(xlabel="frequency ω/ω₀", ylabel="largest force over F₀", title="free motion")
    left.legend(title="teeth touch on")
    data = by_one_harmonic()
    right.plot(data["response_speed_share"], amplitude(data), color=PLANET_COLOURS[0])
    points = [p for a in np.linspace(0.15, 2.4, 24) for p in forced(float(a), ERROR, DAMPING)]
    right.plot(*np.array(points).T, "o", color=PLANET_COLOURS[0], ms=4, mfc="white")
    right.set(xlim=(0.7, 1.3), xlabel="frequency ω/ω₀", ylabel="amplitude of x over x_s")
    right.set_title("first-order harmonic balance")
    return figure
