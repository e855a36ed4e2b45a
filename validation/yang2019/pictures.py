"""The paper's Figures 7 to 11: published points against power flow, single rotor beside double."""

from collections.abc import Callable, Iterator

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rows import Drawn, Picture

from flexgear.gears.power_flow import PowerFlow
from flexgear.views.style import (
    KILO,
    NEUTRAL,
    OTHER_VARIANTS,
    VARIANT_COLOURS,
    panels,
    styled,
)
from yang2019.lives import consistent_life, printed_life
from yang2019.trains import RATIOS, consistent, published, single_rotor

PLACES = range(len(RATIOS))
OURS = VARIANT_COLOURS["flexible"]
SECOND = OTHER_VARIANTS[0]
PAPER_COLOUR = VARIANT_COLOURS["rigid"]
STAGES = ("stage_1", "stage_2")
TITLES = ("(a) first stage", "(b) second stage")
Measure = Callable[[PowerFlow, str], float]
BALANCED = "Ring speeds are those of the torque balance, not rounded."


def drawn() -> Iterator[Drawn]:
    """Five figures."""
    for number, unit, names, measure, what in (
        (7, "torque (kN m)", ("T_x1", "T_x2"), carrier_torque, "torque of the planet carriers"),
        (8, "torque (kN m)", ("T_b1", "T_b2"), ring_torque, "torque of the ring gears"),
        (9, "tangential force (kN)", ("F_tc1", "F_tc2"), tangential_force,
         "tangential force on a planet, on the sun's reference circle"),
    ):  # fmt: skip
        title = f"Figure {number}: {what}"
        figure = compared_with_single(unit, names, measure)
        yield figure, Picture(f"figure_{number:02d}.png", title, BALANCED)
    title = "Figure 10: life of planet bearings over the single rotor's"
    note = (
        "The paper mixes two rules for the bearing's speed (first stage) and two radii (second "
        "stage): crosses. The line has one rule for both turbines."
    )
    yield lives_by_stage(), Picture("figure_10.png", title, note)
    title = "Figure 11: forces and lives of both stages over the power ratio"
    note = "With one radius the second stage gains more life than the first, not less."
    yield forces_and_lives(), Picture("figure_11.png", title, note)


def carrier_torque(flow: PowerFlow, stage: str) -> float:
    """kN m."""
    return flow.stage(stage).carrier_torque * KILO


def ring_torque(flow: PowerFlow, stage: str) -> float:
    """kN m, size."""
    return abs(flow.stage(stage).ring_torque) * KILO


def tangential_force(flow: PowerFlow, stage: str) -> float:
    """kN."""
    return flow.stage(stage).tangential_force * KILO


@styled
def compared_with_single(label: str, names: tuple[str, str], measure: Measure) -> Figure:
    """One quantity of both stages, with the single rotor's as a level."""
    figure, axes = panels(1, 2, height_mm=78)
    for ax, stage, name, title in zip(axes[0], STAGES, names, TITLES, strict=True):
        level = measure(single_rotor(), stage)
        ax.axhline(level, color=NEUTRAL, ls="--", label="single rotor, power flow")
        ax.plot(
            PLACES,
            [measure(consistent(t), stage) for t in RATIOS],
            color=OURS,
            label="double rotor, power flow",
        )
        points(ax, name)
        ax.set_ylim(0, 1.12 * level)
        finish(ax, title, label)
    axes[0, 0].legend(loc="lower left")
    return figure


@styled
def lives_by_stage() -> Figure:
    """Life ratios of both stages."""
    figure, axes = panels(1, 2, height_mm=78, sharey=True)
    for k, (ax, title) in enumerate(zip(axes[0], TITLES, strict=True), 1):
        ax.axhline(1.0, color=NEUTRAL, ls="--", label="single rotor")
        ax.plot(PLACES, life_ratios(k), color=OURS, label="double rotor, one rule for both")
        points(ax, f"L_{k}")
        mixed = [printed_life(t, k) for t in RATIOS]
        ax.plot(PLACES, mixed, "+", color="black", ms=6, label="double rotor, printed rule")
        ax.set_ylim(0, 5.8)
        finish(ax, title, "life over the single rotor's" if k == 1 else "")
    axes[0, 0].legend(loc="lower left", bbox_to_anchor=(0.0, 0.18))
    return figure


@styled
def forces_and_lives() -> Figure:
    """Both stages in one panel for forces, one for lives."""
    figure, axes = panels(1, 2, height_mm=78)
    force, life = axes[0]
    for k, (stage, colour) in enumerate(zip(STAGES, (OURS, SECOND), strict=True), 1):
        name = f"stage {k}, computed"
        forces = [tangential_force(consistent(t), stage) for t in RATIOS]
        force.plot(PLACES, forces, color=colour, label=name)
        points(force, f"F_tc{k}", f"stage {k}, published", colour)
        life.plot(PLACES, life_ratios(k), color=colour, label=name)
        points(life, f"L_{k}", f"stage {k}, published", colour)
    force.set_ylim(0, 500)
    life.set_ylim(0, 5.8)
    finish(force, "(a) tangential force on a planet", "tangential force (kN)")
    finish(life, "(b) life of planet bearings", "life over the single rotor's")
    life.legend(loc="lower left")
    return figure


def life_ratios(stage: int) -> list[float]:
    """Over the single rotor's, at every power ratio."""
    return [consistent_life(t, stage) for t in RATIOS]


def points(
    ax: Axes, name: str, label: str = "double rotor, published", colour: str = PAPER_COLOUR
) -> None:
    """Published values as open circles."""
    values = [published()[f"{name} at {t}"].value for t in RATIOS]
    ax.plot(PLACES, values, "o", mfc="white", mec=colour, ms=5, mew=1.2, label=label)


def finish(ax: Axes, title: str, label: str) -> None:
    """Axes of a panel over the power ratio."""
    ax.set(title=title, ylabel=label, xlabel="power ratio φ (upwind / downwind rotor)")
    ax.set_xticks(list(PLACES), RATIOS)
