"""Load zones over their extent, and loads of the balls of the worked example."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from rows import Drawn, Picture, published

from flexgear.gears.bearings.rows import LINE, POINT
from flexgear.views.style import PLANET_COLOURS, panels, styled
from iso_16281.example import LOADS, bearing, rated
from iso_16281.statements import PAPER, load_zone_integral


def drawn() -> Iterator[Drawn]:
    """One picture."""
    note = (
        "Left: lines are computed, dots printed. Right: loads of the seven balls, 1000 N each way."
    )
    yield loads(), Picture("loads.png", "Load zone and loads of balls", note)


@styled
def loads() -> Figure:
    """Left: J_r over ε; right: loads of balls over their angle."""
    figure, axes = panels(1, 2, height_mm=90)
    left, right = axes[0]
    extents = np.geomspace(0.05, 8, 120)
    for kind, exponent, colour in zip(
        ("ball", "roller"), (POINT, LINE), PLANET_COLOURS, strict=False
    ):
        values = [load_zone_integral(float(e), exponent) for e in extents]
        left.semilogx(extents, values, color=colour, label=kind)
        dots = [line for line in published(PAPER, "load zone") if f"J_r of {kind}" in line.quantity]
        places = [float(line.quantity.partition("= ")[2]) for line in dots]
        left.plot(places, [line.value for line in dots], "o", color=colour, ms=4, mfc="white")
    left.set(xlabel="extent ε of the load zone", ylabel="J_r(ε)", title="load zone")
    left.legend()
    for name, (gap, _) in LOADS.items():
        state = bearing(gap).states(rated(name).motion)[0]
        order = np.argsort(np.angle(np.exp(1j * state.angles)))
        angles = np.degrees(np.angle(np.exp(1j * state.angles)))[order]
        right.plot(angles, state.element_loads[order], "o-", ms=3, lw=1, label=name)
    right.set(
        xlabel="angle of the ball from the load (°)",
        ylabel="load (N)",
        title="balls",
        ylim=(0, 1500),
    )
    right.legend(fontsize=6)
    return figure
