"""Where ring, pins, planets and sun go at equilibrium, in X–Y and Y–Z (Tan 2023, Figure 8).

A point r of a rigid component is drawn at r + f (u + θ × r) with the component's own magnification
f; θ_z is left out (spin does not show), and so is the rotation of the carrier's drive node.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import pi

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator

from flexgear.arrays import Array
from flexgear.results.stage_part import displacement_of
from flexgear.structures.bodies import turn
from flexgear.views.select import leading_dim, variable
from flexgear.views.star import StageOutline, angle_text, ring_points
from flexgear.views.style import (
    DEFORMED_COLOUR,
    NEUTRAL,
    ORIGINAL_COLOUR,
    factor_text,
    nice_number,
    panels,
    styled,
)
from tan2023.measures import pins

MAGNIFICATION_XY = {"ring": 2000.0, "carrier": 500.0, "sun": 10000.0}
MAGNIFICATION_YZ = {"ring": 50000.0, "carrier": 50000.0, "sun": 5000.0}


@dataclass(frozen=True)
class Disc:
    """A rigid circle of ``radius`` about ``centre`` (3,), moved by u + θ × r (global, small)."""

    centre: Array
    radius: float
    motion: Array  # (6,) global; spin about Z is not drawn

    def curves(self) -> tuple[Array, Array]:
        """Original points (n, 3) and their displacements (n, 3)."""
        angle = np.linspace(0, 2 * pi, 97)
        arm = self.radius * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        tilt = np.array([self.motion[3], self.motion[4], 0.0])
        return self.centre + arm, self.motion[:3] + np.cross(tilt, arm)


def turned(motion: Array, angle: float) -> Array:
    """(6,) motion from axes turned by ``angle`` about Z into global axes."""
    return turn(angle) @ motion


def drive_rotation(position: xr.Dataset) -> float:
    """Rotation of the carrier's drive node about Z (rad)."""
    return float(position["carrier_displacement"].sel(carrier_node="stage.drive").isel(dof=5))


def stage_discs(
    position: xr.Dataset, outline: StageOutline, pin_radius: float
) -> dict[str, list[Disc]]:
    """Pins, planets and sun of one position, relative to the carrier's drive node."""
    angle = float(position["stage_angle"])
    spin = drive_rotation(position)
    parts: dict[str, list[Disc]] = {"pin": [], "planet": [], "sun": []}
    for i, offset in enumerate(outline.planet_angles):
        centre = np.append(outline.planet_centre(i, angle), 0.0)
        carried = spin * outline.center_distance
        planet = np.array(displacement_of(position, "planet").isel(body=i), dtype=float)
        planet[1] -= carried
        parts["planet"].append(Disc(centre, outline.planet_radius, turned(planet, angle + offset)))
        pin = np.array(pins(position).isel(carrier_node=i), dtype=float)
        pin[:2] -= carried * np.array([-np.sin(offset), np.cos(offset)])
        parts["pin"].append(Disc(centre, pin_radius, turned(pin, angle)))
    sun = np.array(displacement_of(position, "sun"), dtype=float)
    parts["sun"].append(Disc(np.zeros(3), outline.sun_radius, turned(sun, angle)))
    return parts


@styled
def equilibrium_positions(
    dataset: xr.Dataset,
    outline: StageOutline,
    pin_radius: float,
    magnification_xy: Mapping[str, float] = MAGNIFICATION_XY,
    magnification_yz: Mapping[str, float] = MAGNIFICATION_YZ,
) -> Figure:
    """Ring, pins, planets and sun at equilibrium: X–Y and Y–Z, one row a position (Tan, Fig. 8).

    ``dataset``: the part of equilibria that belongs to the stage; the rotation of the carrier's
    drive node is taken out. "carrier" magnifies pins and planets. In Y–Z only z is magnified.
    """
    dim = leading_dim(dataset)
    count = int(dataset.sizes[dim])
    figure, axes = panels(
        count, 2, height_mm=24 + 84 * count, width_mm=200, width_ratios=[1.0, 1.12]
    )
    for row in range(count):
        position = dataset.isel({dim: row})
        left, right = axes[row]
        draw_plane(left, position, outline, pin_radius, magnification_xy, (0, 1))
        draw_plane(right, position, outline, pin_radius, magnification_yz, (1, 2))
        text = angle_text(float(position["stage_angle"]), len(outline.planet_angles))
        left.set_title(f"X–Y, {text}")
        right.set_title(f"Y–Z, {text}")
        left.set(xlabel="X (m)", ylabel="Y (m)")
        right.set(xlabel="Y (m)", ylabel="Z (m)")
    handles = [
        Line2D([], [], color=ORIGINAL_COLOUR, lw=1.0, label="original"),
        Line2D([], [], color=DEFORMED_COLOUR, lw=1.2, label="deformed"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)
    figure.suptitle(
        "Equilibrium positions (relative to the carrier's drive node)\n"
        f"X–Y: {magnification_text(magnification_xy)}\n"
        f"Y–Z (axial only): {magnification_text(magnification_yz)}",
        fontsize=9,
    )
    return figure


def magnification_text(factors: Mapping[str, float]) -> str:
    names = {"ring": "ring", "carrier": "pins, planets", "sun": "sun"}
    return ", ".join(f"{names.get(k, k)} {factor_text(v)}" for k, v in factors.items())


def draw_plane(
    axes: Axes,
    position: xr.Dataset,
    outline: StageOutline,
    pin_radius: float,
    factors: Mapping[str, float],
    plane: tuple[int, int],
) -> None:
    """All components of one position, projected on ``plane`` (0, 1) = X–Y or (1, 2) = Y–Z."""
    teeth = np.asarray(variable(position, "tooth_displacement"), dtype=float)
    flat = ring_points(np.zeros_like(teeth), outline.ring_radius, 0.0)
    ring = np.column_stack([flat, np.zeros(len(flat))])
    drawn = [(np.vstack([ring, ring[:1]]), np.vstack([teeth, teeth[:1]]), factors["ring"], 1.3)]
    for name, discs in stage_discs(position, outline, pin_radius).items():
        factor = factors["sun" if name == "sun" else "carrier"]
        width = 0.8 if name == "pin" else 1.1
        drawn += [(*disc.curves(), factor, width) for disc in discs]
    shown = np.array([1.0, 1.0, 0.0]) if plane == (0, 1) else np.array([0.0, 0.0, 1.0])
    for original, moved, factor, width in drawn:
        deformed = original + factor * moved * shown
        axes.plot(*original[:, plane].T, color=ORIGINAL_COLOUR, lw=0.8, zorder=2)
        axes.plot(*deformed[:, plane].T, color=DEFORMED_COLOUR, lw=width, zorder=3)
    axes.set_aspect("equal", adjustable="datalim")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(nice_number(0.6 * outline.ring_radius)))
    for i in range(len(outline.planet_angles)):
        x, y = outline.planet_centre(i, float(position["stage_angle"]))
        if plane == (0, 1):
            axes.text(x, y, f"{i + 1}", ha="center", va="center", fontsize=8, color=NEUTRAL)
