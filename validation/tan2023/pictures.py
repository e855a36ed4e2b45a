"""The paper's Figures 7-25, redrawn from the shared runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import pi

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from rows import Drawn, Picture

from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName, MemberName
from flexgear.views import histories
from flexgear.views.render import require_rendering
from flexgear.views.select import Window, within_window
from flexgear.views.style import DEFORMED_COLOUR, ORIGINAL_COLOUR, panels, styled
from tan2023.measures import RPM
from tan2023.pair_pictures import numbered_pair_loads, pair_stiffness_and_error
from tan2023.positions import equilibrium_positions
from tan2023.ring_statements import carrier_under_pin_forces, pair_curves
from tan2023.runs import MAIN_DROP, Runs, shared_runs

DROP = (0.9, 1.8)  # s, what Figures 20-25 show
CLOSE = (0.98, 1.28)  # s, tooth loads in the drop
NEAR = pi / 5  # rad, where tooth loads and gear-mesh ripple in steady running are looked at
CUT = "A cut of the revolution, wide enough for six gear-mesh periods; the rest repeats it."


def _steady(runs: Runs, width: float = 0.45) -> Mapping[str, xr.Dataset]:
    """Steady running from the carrier angle ``NEAR`` on, rad."""
    return within_window(runs.steady, "stage_angle", (NEAR, NEAR + width))


def _drop(runs: Runs, window: Window = DROP) -> Mapping[str, xr.Dataset]:
    """The main torque drop within a window, s."""
    return within_window(runs.main_drop, "time", window)


def _to_drive_flange(runs: Runs, parts: Mapping[str, xr.Dataset]) -> Mapping[str, xr.Dataset]:
    """Displacements of planets less R_c θ_z of the carrier's drive flange, in tangential sense."""
    relative = {}
    for name, part in parts.items():
        node = [MemberName.parse(n).part for n in part["carrier_node"].values].index("drive")
        angle = part["carrier_displacement"].isel(carrier_node=node, dof=5, drop=True)
        planets = [BodyName.parse(n).part == "planet" for n in part["body"].values]
        motion = part["body_displacement"].copy(deep=True)
        motion[{"body": planets, "dof": 1}] -= runs.geometry.center_distance * angle
        relative[name] = part.assign(body_displacement=motion)
    return relative


@dataclass(frozen=True)
class Redrawn:
    """One of the paper's figures: number, title, how to draw it, a footnote about the drawing."""

    number: int
    title: str
    draw: Callable[[Runs], Figure]
    note: str = ""


PICTURES: list[Redrawn] = []


def picture(
    number: int, title: str, note: str = ""
) -> Callable[[Callable[[Runs], Figure]], Callable[[Runs], Figure]]:
    """Enter the decorated function into the list."""

    def enter(draw: Callable[[Runs], Figure]) -> Callable[[Runs], Figure]:
        PICTURES.append(Redrawn(number, title, draw, note))
        return draw

    return enter


def drawn(fidelity: str) -> Iterator[Drawn]:
    """All figures."""
    for one in PICTURES:
        title = f"Figure {one.number}. {one.title}"
        picture = Picture(f"figure_{one.number:02d}.png", title, one.note)
        yield one.draw(shared_runs(fidelity)), picture


@picture(7, "Pair stiffness and gear-mesh error", "Stiffness along the 3D line of action over the "
         "position of the contact line at mid-face.")  # fmt: skip
def figure_7(runs: Runs) -> Figure:
    return pair_stiffness_and_error(pair_curves(runs))


@picture(
    8,
    "Equilibrium positions at rated torque",
    "Magnifications are the paper's; equilibria without errors. Tilt is left out: 50 000 times, "
    "a planet's would leave the picture. In Y–Z the wavy line is the ring, the line above is the "
    "sun, the others are planets with their pins.",
)
def figure_8(runs: Runs) -> Figure:
    data = runs.star.isel(position=[1, 2]).copy(deep=True)
    for name in ("body_displacement", "carrier_displacement"):
        data[name][{"dof": [3, 4]}] = 0.0
    return equilibrium_positions(data, runs.outline, runs.pin_radius)


@picture(9, "Carrier held at the drive flange under clockwise pin forces")
def figure_9(runs: Runs) -> Figure:
    body = runs.carrier
    q, _ = carrier_under_pin_forces(runs)
    motion = body.recover(q)
    try:
        require_rendering()
    except FlexgearError:
        return pins_only(runs, q)
    from flexgear.views.render import render_deformed

    return render_deformed(
        body.points, body.cells, motion, title="Carrier, drive flange (below) held", view="iso",
        exaggeration=300.0,
    )  # fmt: skip


@styled
def pins_only(runs: Runs, q: np.ndarray) -> Figure:
    """Pins as circles where nothing can be rendered in 3D."""
    body, factor = runs.carrier, 300.0
    figure, axes = panels(1, 1, height_mm=120, width_mm=120)
    turn = np.linspace(0, 2 * pi, 73)
    for i in range(runs.case.stage.planets):
        node = list(body.node_names).index(f"pin_{i + 1}")
        centre, u = body.positions[node, :2], q[6 * node : 6 * node + 2]
        circle = runs.pin_radius * np.column_stack([np.cos(turn), np.sin(turn)])
        axes[0, 0].plot(*(centre + circle).T, color=ORIGINAL_COLOUR, lw=0.9)
        axes[0, 0].plot(*(centre + circle + factor * u).T, color=DEFORMED_COLOUR, lw=1.2)
    axes[0, 0].set_aspect("equal")
    axes[0, 0].set(xlabel="X (m)", ylabel="Y (m)", title=f"pins, displacement × {factor:.0f}")
    return figure


@picture(10, "Speed from rest, and in torque drops", "Drops begin at 1 s from steady running and "
         "last 0.2 s; the start-up begins at rest under rated torque.")  # fmt: skip
def figure_10(runs: Runs) -> Figure:
    named = {f"to {t / 1e6:g} MN·m": runs.drops[t] for t in (2e6, MAIN_DROP, 2e5)}
    return histories.carrier_speed(
        within_window({"from rest": runs.start_up.data, **named}, "time", (0.0, 2.2)),
        rated_rpm=runs.case.case.inputs[0].speed * RPM,
    )


@picture(11, "Ring teeth in contact and their pair stiffness, five planets")
def figure_11(runs: Runs) -> Figure:
    return histories.engagement_map(runs.steady["flexible"])


@picture(12, "Tooth loads of ring and planet 1")
def figure_12(runs: Runs) -> Figure:
    return numbered_pair_loads(_steady(runs)["flexible"], "ring", 1)


@picture(13, "X displacement of all ring tooth nodes")
def figure_13(runs: Runs) -> Figure:
    return histories.tooth_displacement_map(runs.steady["flexible"], "x")


@picture(14, "Sun displacement, steady", CUT)
def figure_14(runs: Runs) -> Figure:
    return histories.sun_displacement(_steady(runs))


@picture(
    15,
    "Planet 1 displacement, steady",
    "Against the carrier's drive flange, whose rotation is taken out; x radial, y tangential "
    f"(positive with the rotation), z axial. {CUT}",
)
def figure_15(runs: Runs) -> Figure:
    return histories.planet_displacement(_to_drive_flange(runs, _steady(runs)))


@picture(16, "Ring tooth node 1, steady")
def figure_16(runs: Runs) -> Figure:
    return histories.tooth_node_displacement(runs.steady)


@picture(17, "Tooth loads of sun and planet 1, steady")
def figure_17(runs: Runs) -> Figure:
    return histories.pair_loads(_steady(runs, 0.3), "sun")


@picture(18, "Tooth loads of ring and planet 1, steady")
def figure_18(runs: Runs) -> Figure:
    return histories.pair_loads(_steady(runs, 0.3), "ring")


@picture(19, "Load sharing, steady", CUT)
def figure_19(runs: Runs) -> Figure:
    return histories.load_sharing(_steady(runs))


@picture(20, "Sun displacement in a torque drop to 4e5 N·m")
def figure_20(runs: Runs) -> Figure:
    return histories.sun_displacement(_drop(runs), x="time")


@picture(21, "Planet 1 displacement in a torque drop to 4e5 N·m", "Against the carrier's drive "
         "flange, as in Figure 15.")  # fmt: skip
def figure_21(runs: Runs) -> Figure:
    return histories.planet_displacement(_to_drive_flange(runs, _drop(runs)), x="time")


@picture(22, "Ring tooth node 1 in a torque drop to 4e5 N·m")
def figure_22(runs: Runs) -> Figure:
    return histories.tooth_node_displacement(_drop(runs), x="time")


@picture(23, "Tooth loads of sun and planet 1 in the torque drop", "Linear contact, as in the "
         "paper: pairs on the path of contact may pull.")  # fmt: skip
def figure_23(runs: Runs) -> Figure:
    return histories.pair_loads(_drop(runs, CLOSE), "sun", x="time")


@picture(24, "Tooth loads of ring and planet 1 in the torque drop", "Linear contact, as in the "
         "paper: pairs on the path of contact may pull.")  # fmt: skip
def figure_24(runs: Runs) -> Figure:
    return histories.pair_loads(_drop(runs, CLOSE), "ring", x="time")


@picture(25, "Load sharing in the torque drop")
def figure_25(runs: Runs) -> Figure:
    return histories.load_sharing(_drop(runs), x="time", spread=True)
