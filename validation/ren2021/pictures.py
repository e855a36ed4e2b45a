"""The paper's Figures 9 to 12 from its corrected equations, printed coefficients beside them."""

from typing import Any

import numpy as np
from linear import cycle_shares
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rows import Drawn, Picture, reference

from flexgear.views.style import (
    MICRO,
    NEUTRAL,
    OTHER_VARIANTS,
    PLANET_COLOURS,
    panels,
    planet_colour,
    styled,
)
from ren2021 import comparison, studies
from ren2021.errors import harmonics
from ren2021.sharing import CASES, SAMPLES
from ren2021.statements import over_period, stage_and_system

CYCLES = 57  # gear-mesh cycles of Figures 10 and 11: one turn of the carrier
LINES = {"geometry": "-", "equation 20": "--", "equation 16": ":"}


def drawn() -> list[Drawn]:
    """All pictures of this paper."""
    return [
        (figure_9(), Picture("figure_09.png", "Figure 9: load sharing over the carrier's error",
         "All other errors 20 µm. The paper has the same order and growth; its curves have no "
         "numbers in the text. With the signs of eqs. 15 and 16 (dotted) nothing grows.")),
        (figure_10_11(), Picture("figure_10_11.png", "Figures 10, 11: sharing by gear-mesh cycle",
         "External gear meshes of the right side, Table 2's supports. Printed coefficients (text) "
         "as grey lines: they are not reached with these supports. With planet 1 alone, planets 2 "
         "and 3 coincide.")),
        (figure_12(), Picture("figure_12.png", "Figure 12: load sharing over support stiffness",
         "The other two supports as in Table 2. Printed order at equal stiffness: sun lowest, "
         "carrier highest; that holds for the carrier at high stiffness only.")),
        (stiffer(), Picture("all_supports.png", "All supports stiffer than Table 2",
         "Which factor gives the printed coefficients (grey lines): a fit, not a validation.")),
        *comparison.pictures(),
    ]  # fmt: skip


def printed() -> dict[str, float]:
    """Printed coefficient by error case."""
    return dict(zip(CASES, (p.value for p in reference(comparison.PAPER).values()), strict=True))


@styled
def figure_9() -> Figure:
    """LSC over E_c by floating form and signs."""
    figure, axes = panels(1, 1, height_mm=90, width_mm=130)
    one = axes[0, 0]
    for form, colour in zip(studies.FLOATING, PLANET_COLOURS, strict=False):
        for signs, style in LINES.items():
            label = form if signs == "geometry" else None
            values = studies.over_carrier_error(form, signs)
            one.plot(MICRO * studies.CARRIER_ERRORS, values, style, color=colour, label=label)
    sign_legend(one)
    one.set(xlabel="carrier eccentricity $E_c$ (µm)", ylabel="system load sharing coefficient LSC")
    return figure


def sign_legend(axes: Axes) -> None:
    """Legend of what is drawn and of the line styles of signs."""
    for signs, style in LINES.items():
        axes.plot([], [], style, color=NEUTRAL, label=f"signs: {signs}")
    axes.legend(loc="upper left")


@styled
def figure_10_11() -> Figure:
    """Share of every planet in every gear-mesh cycle, by error case and signs."""
    shown = ("geometry", "equation 20")
    figure, axes = panels(len(shown), 3, height_mm=110, sharex=True, sharey="col")
    stage, system = stage_and_system()
    positions = np.arange(CYCLES * SAMPLES) / SAMPLES
    time = positions * 2 * np.pi / stage.gear_mesh_rate
    for row, signs in zip(axes, shown, strict=True):
        for one, case in zip(row, CASES, strict=True):
            forces = system.forces(harmonics(stage, CASES[case], signs), time, True)
            shares = cycle_shares(forces[:, stage.planets : 2 * stage.planets], CYCLES)
            for i in range(stage.planets):
                one.plot(np.arange(CYCLES) + 0.5, shares[:, i], color=planet_colour(i + 1),
                         label=f"planet {i + 1}")  # fmt: skip
            one.axhline(printed()[case], color=NEUTRAL, lw=0.9, ls="--")
            one.set_title(f"{case}\n{signs}: LSC {over_period(case, signs).system:.4f}")
    for one in axes[-1]:
        one.set_xlabel("gear-mesh cycle")
    for one in axes[:, 0]:
        one.set_ylabel("$N\\,F_i/\\Sigma F$, cycle maxima")
    axes[0, 0].legend(loc="upper left", bbox_to_anchor=(0.0, 0.95), fontsize=7)
    return figure


@styled
def figure_12() -> Figure:
    """LSC over each central support."""
    figure, axes = panels(1, 1, height_mm=90, width_mm=130)
    one = axes[0, 0]
    for member, colour in zip(studies.MEMBERS, PLANET_COLOURS, strict=False):
        for signs, style in LINES.items():
            one.semilogx(studies.STIFFNESSES, studies.over_support(member, signs), style,
                         color=colour, label=member if signs == "geometry" else None)  # fmt: skip
    one.axvline(1.5e10, color=NEUTRAL, lw=0.9)
    one.text(1.6e10, 1.003, "1.5e10", color=NEUTRAL, fontsize=7.5)
    sign_legend(one)
    one.set(xlabel="radial support stiffness (N/m)", ylabel="system load sharing coefficient LSC")
    return figure


@styled
def stiffer() -> Figure:
    """LSC of the three error cases over a factor on all supports."""
    figure, axes = panels(1, 3, height_mm=75)
    for one, case in zip(axes[0], CASES, strict=True):
        for signs, style in LINES.items():
            options: dict[str, Any] = {"color": OTHER_VARIANTS[list(LINES).index(signs)]}
            values = studies.over_all_supports(signs)[case]
            one.plot(studies.FACTORS, values, style, label=signs, **options)
        one.axhline(printed()[case], color=NEUTRAL, lw=0.9)
        one.text(15, printed()[case], f"printed {printed()[case]:g}", color=NEUTRAL, fontsize=7.5,
                 ha="right", va="bottom")  # fmt: skip
        one.set(title=case, xlabel="supports, times Table 2")
    axes[0, 0].set_ylabel("system LSC")
    axes[0, 0].legend(title="signs")
    return figure
