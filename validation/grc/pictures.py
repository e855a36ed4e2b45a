"""Load sharing and rows over the clearance of the carrier bearings."""

from __future__ import annotations

from pathlib import Path

from rows import Picture

from flexgear.views.style import panels, save_figure, styled
from grc.runs import CLEARANCES, extreme, sharing
from grc.statements import PUBLISHED


def draw(folder: Path) -> list[Picture]:
    """One picture."""
    save_figure(clearances(), folder / "clearance.png", dpi=160)
    return [
        Picture(
            "clearance.png",
            "Load sharing over carrier bearing clearance",
            "dotted: measured, both with an unknown clearance",
        )
    ]


@styled
def clearances():  # type: ignore[no-untyped-def]
    """Left: K of pins; right: the worst row; both in pure torque and under the rotor moment."""
    figure, axes = panels(1, 2, height_mm=80)
    left, right = axes[0]
    for name, found in (
        ("pure torque", [sharing(clearance=c) for c in CLEARANCES]),
        ("rotor moment", [extreme(clearance=c) for c in CLEARANCES]),
    ):
        left.plot(CLEARANCES, [s.factor for s in found], "o-", label=name)
        right.plot(CLEARANCES, [s.worst_row for s in found], "o-", label=name)
    for quantity in ("K_gamma in pure torque", "K_gamma under extreme rotor moment"):
        left.axhline(PUBLISHED[quantity].value, ls=":", color="black", lw=1)
    right.axhline(
        PUBLISHED["largest row over the expected load"].value, ls=":", color="black", lw=1
    )
    left.set(xlabel="clearance on every side (mm)", ylabel="largest pin force over mean (–)")
    right.set(xlabel="clearance on every side (mm)", ylabel="worst row over expected (–)")
    left.legend(loc="center left")
    return figure
