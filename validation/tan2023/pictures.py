"""The paper's Figures 7-25, redrawn from the shared runs."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import pi

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from rows import Drawn, Picture

from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName, MemberName
from flexgear.views import histories, star
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


def equilibria(runs: Runs) -> Figure:
    data = runs.star.isel(position=[1, 2]).copy(deep=True)
    for name in ("body_displacement", "carrier_displacement"):
        data[name][{"dof": [3, 4]}] = 0.0
    return equilibrium_positions(data, runs.outline, runs.pin_radius)


def held_carrier(runs: Runs) -> Figure:
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


def speeds(runs: Runs) -> Figure:
    named = {f"to {t / 1e6:g} MN·m": runs.drops[t] for t in (2e6, MAIN_DROP, 2e5)}
    return histories.carrier_speed(
        within_window({"from rest": runs.start_up.data, **named}, "time", (0.0, 2.2)),
        rated_rpm=runs.case.case.inputs[0].speed * RPM,
    )


@dataclass(frozen=True)
class Redrawn:
    """One of the paper's figures: number, title, how to draw it, a footnote about the drawing."""

    number: int
    title: str
    draw: Callable[[Runs], Figure]
    note: str = ""


PULL = "Linear contact, as in the paper: pairs on the path of contact may pull."
PICTURES = (
    Redrawn(
        7, "Pair stiffness and gear-mesh error",
        lambda runs: pair_stiffness_and_error(pair_curves(runs)),
        "Stiffness along the 3D line of action over the position of the contact line at mid-face.",
    ),
    Redrawn(
        8, "Equilibrium positions at rated torque", equilibria,
        "Magnifications are the paper's; equilibria without errors. Tilt is left out: 50 000 "
        "times, a planet's would leave the picture. In Y–Z the wavy line is the ring, the line "
        "above is the sun, the others are planets with their pins.",
    ),
    Redrawn(9, "Carrier held at the drive flange under clockwise pin forces", held_carrier),
    Redrawn(
        10, "Speed from rest, and in torque drops", speeds,
        "Drops begin at 1 s from steady running and last 0.2 s; the start-up begins at rest under "
        "rated torque.",
    ),
    Redrawn(
        11, "Ring teeth in contact and their pair stiffness, five planets",
        lambda runs: histories.engagement_map(runs.steady["flexible"]),
    ),
    Redrawn(
        12, "Tooth loads of ring and planet 1",
        lambda runs: numbered_pair_loads(_steady(runs)["flexible"], "ring", 1),
    ),
    Redrawn(
        13, "X displacement of all ring tooth nodes",
        lambda runs: star.tooth_displacement_map(runs.steady["flexible"]),
    ),
    Redrawn(
        14, "Sun displacement, steady",
        lambda runs: histories.displacement(_steady(runs), "sun"), CUT,
    ),
    Redrawn(
        15, "Planet 1 displacement, steady",
        lambda runs: histories.displacement(_to_drive_flange(runs, _steady(runs)), "planet"),
        "Against the carrier's drive flange, whose rotation is taken out; x radial, y tangential "
        f"(positive with the rotation), z axial. {CUT}",
    ),
    Redrawn(
        16, "Ring tooth node 1, steady",
        lambda runs: histories.displacement(runs.steady, "tooth node"),
    ),
    Redrawn(
        17, "Tooth loads of sun and planet 1, steady",
        lambda runs: histories.pair_loads(_steady(runs, 0.3), "sun"),
    ),
    Redrawn(
        18, "Tooth loads of ring and planet 1, steady",
        lambda runs: histories.pair_loads(_steady(runs, 0.3), "ring"),
    ),
    Redrawn(19, "Load sharing, steady", lambda runs: histories.load_sharing(_steady(runs)), CUT),
    Redrawn(
        20, "Sun displacement in a torque drop to 4e5 N·m",
        lambda runs: histories.displacement(_drop(runs), "sun", "time"),
    ),
    Redrawn(
        21, "Planet 1 displacement in a torque drop to 4e5 N·m",
        lambda runs: histories.displacement(
            _to_drive_flange(runs, _drop(runs)), "planet", "time"
        ),
        "Against the carrier's drive flange, as in Figure 15.",
    ),
    Redrawn(
        22, "Ring tooth node 1 in a torque drop to 4e5 N·m",
        lambda runs: histories.displacement(_drop(runs), "tooth node", "time"),
    ),
    Redrawn(
        23, "Tooth loads of sun and planet 1 in the torque drop",
        lambda runs: histories.pair_loads(_drop(runs, CLOSE), "sun", x="time"), PULL,
    ),
    Redrawn(
        24, "Tooth loads of ring and planet 1 in the torque drop",
        lambda runs: histories.pair_loads(_drop(runs, CLOSE), "ring", x="time"), PULL,
    ),
    Redrawn(
        25, "Load sharing in the torque drop",
        lambda runs: histories.load_sharing(_drop(runs), x="time", spread=True),
    ),
)  # fmt: skip


def drawn(fidelity: str) -> Iterator[Drawn]:
    """All figures."""
    for one in PICTURES:
        title = f"Figure {one.number}. {one.title}"
        picture = Picture(f"figure_{one.number:02d}.png", title, one.note)
        yield one.draw(shared_runs(fidelity)), picture
