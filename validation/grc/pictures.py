"""Load sharing and rows over the clearance of the carrier bearings, and by cause."""

from collections.abc import Iterator

import numpy as np
from rows import Drawn, Picture

from flexgear.views.style import new_figure, panels, styled
from grc.by_cause import computed
from grc.statements import PUBLISHED, with_clearance

CLEARANCES = (0.0, 0.1, 0.2, 0.3)  # mm on every side of the carrier bearings


def drawn() -> Iterator[Drawn]:
    """Two pictures."""
    note = "by grc/by_cause.py; dotted: measured, both with an unknown clearance"
    yield (
        clearances(),
        Picture("clearance.png", "Load sharing over carrier bearing clearance", note),
    )
    note = "by grc/by_cause.py; dotted: measured without and with rotor moment"
    yield causes(), Picture("causes.png", "Load sharing by cause", note)


@styled
def clearances():  # type: ignore[no-untyped-def]
    """Left: K of pins; right: the worst row; both in pure torque and under the rotor moment."""
    figure, axes = panels(1, 2, height_mm=80)
    left, right = axes[0]
    by_clearance = [computed()[with_clearance(c)] for c in CLEARANCES]
    for name, load in (("pure torque", "torque"), ("rotor moment", "moment")):
        of_load = [getattr(one, load) for one in by_clearance]
        left.plot(CLEARANCES, [one.factor for one in of_load], "o-", label=name)
        right.plot(CLEARANCES, [one.row for one in of_load], "o-", label=name)
    for quantity in ("K_gamma in pure torque", "K_gamma under extreme rotor moment"):
        left.axhline(PUBLISHED[quantity].value, ls=":", color="black", lw=1)
    right.axhline(
        PUBLISHED["largest row over the expected load"].value, ls=":", color="black", lw=1
    )
    left.set(xlabel="clearance on every side (mm)", ylabel="largest pin force over mean (–)")
    right.set(xlabel="clearance on every side (mm)", ylabel="worst row over expected (–)")
    left.legend(loc="center left")
    return figure


@styled
def causes():  # type: ignore[no-untyped-def]
    """Bars of K of pins for every cause, in pure torque and under the rotor moment."""
    every = list(computed().values())
    figure = new_figure(height_mm=8.0 * len(every) + 20.0)
    axes = figure.add_subplot()
    place = np.arange(len(every))
    for shift, load, label in ((-0.2, "torque", "pure torque"), (0.2, "moment", "rotor moment")):
        factors = [getattr(one, load).factor for one in every]
        axes.barh(place + shift, np.array(factors) - 1.0, 0.4, left=1.0, label=label)
    for quantity in ("K_gamma in pure torque", "K_gamma under extreme rotor moment"):
        axes.axvline(PUBLISHED[quantity].value, ls=":", color="black", lw=1)
    axes.set(xlabel="largest pin force over mean (–)", yticks=place)
    axes.set_yticklabels([one.name for one in every])
    axes.margins(y=0.01)
    axes.invert_yaxis()
    axes.legend(loc="lower right")
    return figure
