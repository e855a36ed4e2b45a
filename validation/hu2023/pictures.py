"""The paper's Figures 4, 5, 9 to 12 and Table 5, printed figures beside ours."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rows import Drawn, Picture

from flexgear.views.style import (
    MICRO,
    NEUTRAL,
    OTHER_VARIANTS,
    VARIANT_COLOURS,
    panels,
    styled,
)
from hu2023 import comparison, studies
from hu2023.cases import drive
from hu2023.comparison import KINDS, STAGES, bundled, quasi_static, sharing
from hu2023.equations import matrices
from hu2023.errors import harmonics
from hu2023.sharing import cycle_times
from hu2023.statements import MM, PACKAGE_POINTS, published

COLOURS = dict(zip(KINDS, ("#0072B2", "#E69F00"), strict=True))
PRINTED, OURS = VARIANT_COLOURS["rigid"], VARIANT_COLOURS["flexible"]
FITTED = "Stage 1 with planet bearings fitted to the printed K outside."


def drawn() -> list[Drawn]:
    """All pictures of this paper."""
    return [
        (figure_4(), Picture("figure_04.png", "Figure 4: load sharing of the stages",
         "Left: stage 1 over the unprinted stiffness of its planet bearings, quasi-static; the "
         "linear law lets teeth pull above K = 3. Right: stages 2 and 3, whose suns float.")),
        (figure_5(), Picture("figure_05.png", "Figure 5: where the floating suns go",
         "Quasi-static over the period of the stage; circles have the printed radii.")),
        (table_5(), Picture("table_05.png", "Table 5: displacement of the third carrier",
         "Amplitude of the vertical displacement; ours is zero at any torque.")),
        (figure_10(), Picture("figure_10.png", "Figure 10: load sharing over gear-mesh stiffness",
         f"Harmonic steady state, errors of Table 4. {FITTED}")),
        (figure_11(), Picture("figure_11.png", "Figure 11: load sharing over eccentricities",
         f"Stage 1, the other errors of Table 4, quasi-static: outside and inside coincide. "
         f"Dots: the package. {FITTED}")),
        (figure_12(), Picture("figure_12.png", "Figure 12: load sharing over tooth errors",
         f"Harmonic steady state; the scales of stages 2 and 3 are millionths. {FITTED}")),
    ]  # fmt: skip


@styled
def figure_4() -> Figure:
    """K of stage 1 over planet bearings, of stages 2 and 3 beside the print."""
    figure, axes = panels(1, 2, height_mm=80, width_ratios=(1.3, 1))
    left, right = axes[0]
    bearings = np.geomspace(5e5, 2e9, 19)
    for signs, style in (("geometry", "-"), ("equation 1", "--")):
        base = [studies.with_stage(drive(), 0, bearing=float(k)) for k in bearings]
        k = [studies.of(one, 0, quasi_static=True, signs=signs).outside for one in base]
        left.loglog(bearings, np.array(k) - 1, style, color=OURS, label=f"signs: {signs}")
    for side, style in (("outside", "-"), ("inside", ":")):
        value = published()[f"K of stage 1 {side}"].value
        left.axhline(value - 1, color=PRINTED, ls=style, lw=0.9, label=f"printed, {side}")
    left.axhline(2.0, color=NEUTRAL, lw=0.9, label="one planet carries all")
    left.axvline(drive().stages[0].bearing, color=NEUTRAL, lw=0.9, ls="--", label="bundled case")
    left.set(xlabel="stiffness of a planet bearing (N/m)", ylabel="K − 1", title="stage 1")
    left.set_ylim(3e-4, 50)
    left.legend(fontsize=7, loc="lower center", bbox_to_anchor=(0.57, 0.0))
    names = []
    for place, (j, side) in enumerate((j, side) for j in STAGES[1:] for side in KINDS):
        names.append(f"stage {j + 1}\n{side}")
        right.plot(place, published()[f"K of stage {j + 1} {side}"].value, "s", color=PRINTED,
                   label="printed" if place == 0 else None)  # fmt: skip
        right.plot(place, sharing(bundled(), quasi_static(j), j, side), "o", color=OURS,
                   label="computed" if place == 0 else None)  # fmt: skip
    right.set(xticks=range(len(names)), xticklabels=names, ylabel="K", title="stages 2 and 3")
    right.set_ylim(0.99, 1.1)
    right.legend()
    return figure


@styled
def figure_5() -> Figure:
    """Orbits of the suns of stages 2 and 3."""
    figure, axes = panels(1, 2, height_mm=90)
    base = drive()
    for one, j in zip(axes[0], STAGES[1:], strict=True):
        orbit = MM * comparison.orbit(j)
        one.plot(*orbit.T, ".", ms=1.5, color=OURS, label="errors by geometry")
        time = comparison.orbit_times(j)
        motion = matrices(base).motion(harmonics(base, signs="equation 1"), time, True)
        first = base.first(j)
        one.plot(MM * motion[:, first + 1], MM * motion[:, first + 2], ".", ms=1.5,
                 color=OTHER_VARIANTS[1], label="signs of eq. 1")  # fmt: skip
        radius = published()[f"sun float of stage {j + 1}"].value
        turn = np.linspace(0, 2 * np.pi, 121)
        one.plot(radius * np.cos(turn), radius * np.sin(turn), color=PRINTED, label="printed")
        one.set_aspect("equal")
        one.set(title=f"stage {j + 1}", xlabel="x in carrier axes (mm)")
    axes[0, 0].set_ylabel("y (mm)")
    lines, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(lines, labels, loc="outside lower center", ncols=3, markerscale=4)
    return figure


@styled
def table_5() -> Figure:
    """Displacement over torque."""
    figure, axes = panels(1, 1, height_mm=70, width_mm=110)
    one = axes[0, 0]
    torques = (50, 100, 150)
    for what, marker in (("amplitude", "s"), ("measured", "^")):
        values = [published()[f"carrier 3 {what}, {t} % torque"].value for t in torques]
        label = "printed, calculated" if what == "amplitude" else "printed, measured"
        one.plot(torques, values, marker, ls="--", lw=0.8, color=PRINTED, label=label)
    rated = bundled().modal.system.rated_torque
    time = cycle_times(drive(), 2, 20)
    equilibria = [bundled().at(drive().speed * time, 0.01 * t * rated) for t in torques]
    y = [comparison.displacement(bundled(), f, "stage_3.carrier")[:, 1] for f in equilibria]
    one.plot(torques, [MM * np.ptp(v) / 2 for v in y], "o-", color=OURS, label="computed")
    one.set(xlabel="torque (%)", ylabel="amplitude (mm)", xticks=torques)
    one.set_ylim(-0.005, 0.07)
    one.legend(loc="center right")
    return figure


@styled
def figure_10() -> Figure:
    """K over outer and inner gear-mesh stiffness of every stage."""
    figure, axes = panels(2, 3, height_mm=110, sharex=True)
    for row, (kind, name) in zip(axes, (("sun", "external"), ("ring", "internal")), strict=True):
        for one, j in zip(row, STAGES, strict=True):
            results = studies.over_stiffness(j, kind)
            both_sides(one, studies.STIFFNESSES, results, j)
            one.set_xscale("log")
            one.set_title(f"stage {j + 1}, {name}")
    for one in axes[-1]:
        one.set_xlabel("gear-mesh stiffness (N/m)")
    axes[0, 0].legend()
    return figure


def both_sides(axes: Axes, x: np.ndarray, results: tuple, j: int) -> None:
    """K outside and inside; in stages 2 and 3 as K − 1 in millionths."""
    for side, colour in COLOURS.items():
        k = studies.values(results, side)
        style = "-" if side == "outside" else "--"
        axes.plot(x, k if j == 0 else 1e6 * (k - 1), style, color=colour, label=side)
    axes.set_ylabel("K" if j == 0 else "(K − 1) · 10⁶")
    if j:
        axes.set_ylim(0, max(25.0, 1.1 * axes.get_ylim()[1]))


@styled
def figure_11() -> Figure:
    """K of stage 1 over eccentricities."""
    figure, axes = panels(1, 4, height_mm=70, sharey=True)
    for one, part in zip(axes[0], studies.PARTS, strict=True):
        for side, style in (("outside", "-"), ("inside", "--")):
            k = studies.values(studies.over_eccentricity(part, True), side)
            one.plot(MICRO * studies.SIZES, k, style, color=COLOURS[side], label=side)
        sizes = [float(studies.SIZES[i]) for i in PACKAGE_POINTS]
        dots = [comparison.over_eccentricity(part, e)["outside"] for e in sizes]
        one.plot(MICRO * np.array(sizes), dots, "o", color=OURS, ms=4, label="package")
        one.set(title=part, xlabel="eccentricity (µm)")
    axes[0, 0].set_ylabel("K of stage 1")
    axes[0, 0].legend()
    return figure


@styled
def figure_12() -> Figure:
    """K over tooth errors of every stage."""
    figure, axes = panels(2, 3, height_mm=110, sharex=True)
    for row, (kind, name) in zip(axes, (("sun", "external"), ("ring", "internal")), strict=True):
        for one, j in zip(row, STAGES, strict=True):
            both_sides(one, MICRO * studies.SIZES, studies.over_tooth_error(j, kind), j)
            one.set_title(f"stage {j + 1}, {name}")
    for one in axes[-1]:
        one.set_xlabel("tooth error (µm)")
    axes[0, 0].legend()
    return figure
