"""The ring as a five-pointed star, and where every component goes at equilibrium.

A tooth node at angle φ_j on the pitch circle R is drawn at

    x_j = R (cos φ_j, sin φ_j) + f (u_x, u_y)_j ,

with the exaggeration f printed in the picture. Displacements are global and in metres, teeth are
counted from the X axis, the carrier turns counter-clockwise (docs/conventions.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch
from matplotlib.ticker import MultipleLocator

from flexgear.model.errors import FlexgearError
from flexgear.views.select import leading_dim, variable
from flexgear.views.style import (
    DEFORMED_COLOUR,
    MICRO,
    NEUTRAL,
    ORIGINAL_COLOUR,
    FloatArray,
    factor_text,
    nice_number,
    panels,
    pi_label,
    planet_colour,
    styled,
)


@dataclass(frozen=True)
class StageOutline:
    """Circles that stand for the gears: pitch radii and centre distance in m, angles in rad."""

    ring_radius: float
    sun_radius: float
    planet_radius: float
    center_distance: float
    planet_angles: tuple[float, ...]
    pin_radius: float | None = None

    @property
    def pin_circle(self) -> float:
        """Radius at which a pin is drawn."""
        return 0.45 * self.planet_radius if self.pin_radius is None else self.pin_radius

    def planet_centre(self, planet: int, carrier_angle: float) -> FloatArray:
        """(x, y) of planet ``planet`` (0-based) with the carrier at ``carrier_angle``."""
        angle = carrier_angle + self.planet_angles[planet]
        return self.center_distance * np.array([np.cos(angle), np.sin(angle)])


def ring_points(displacement: FloatArray, radius: float, factor: float) -> FloatArray:
    """Drawn tooth nodes (z, 2) for ``displacement`` (z, 2 or 3) in m."""
    angles = 2 * pi * np.arange(displacement.shape[0]) / displacement.shape[0]
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return circle + factor * displacement[:, :2]


def radial(displacement: FloatArray) -> FloatArray:
    """Radial part u_x cos φ + u_y sin φ of (…, z, 2 or 3) tooth displacements."""
    angles = 2 * pi * np.arange(displacement.shape[-2]) / displacement.shape[-2]
    return displacement[..., 0] * np.cos(angles) + displacement[..., 1] * np.sin(angles)


def as_positions(
    displacement: xr.DataArray | FloatArray, carrier_angles: Sequence[float] | FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(p, z, 3) displacements and (p,) angles, from one position or several."""
    field = np.asarray(displacement, dtype=float)
    angles = np.atleast_1d(np.asarray(carrier_angles, dtype=float))
    if field.ndim == 2:
        field = field[None]
    if field.ndim != 3 or field.shape[0] != angles.size or field.shape[2] not in (2, 3):
        raise FlexgearError(
            f"cannot draw the ring: {angles.size} carrier angles need displacements of shape "
            f"({angles.size}, teeth, 3), got {field.shape}"
        )
    return field, angles


def star_exaggeration(displacement: FloatArray, radius: float, share: float = 0.16) -> float:
    """Round factor that draws the largest in-plane displacement as at most share × radius."""
    largest = float(np.nanmax(np.hypot(displacement[..., 0], displacement[..., 1]), initial=0.0))
    return nice_number(share * radius / largest) if largest > 0 else 1.0


def angle_text(angle: float, planets: int) -> str:
    """Carrier angle in rad, as a fraction of π too where it is one."""
    unit = pi / (2 * planets)
    text = f"{angle:.3f} rad"
    if abs(angle / unit - round(angle / unit)) < 1e-6 and round(angle / unit) != 0:
        text = f"{pi_label(angle, 2 * planets)} = {text}"
    return f"$θ_c$ = {text}"


def draw_gears(axes: Axes, outline: StageOutline, carrier_angle: float) -> None:
    """Sun and planets as circles, planets in their colours with their numbers."""
    axes.add_patch(Circle((0, 0), outline.sun_radius, fc="#F3F4F6", ec=NEUTRAL, lw=0.8, zorder=1.5))
    axes.text(0, 0, "sun", ha="center", va="center", color=NEUTRAL, fontsize=8)
    for i in range(len(outline.planet_angles)):
        x, y = outline.planet_centre(i, carrier_angle)
        colour = planet_colour(i + 1)
        face = Circle((x, y), outline.planet_radius, fc=colour, ec="none", alpha=0.16, zorder=1.5)
        axes.add_patch(face)
        edge = Circle((x, y), outline.planet_radius, fill=False, ec=colour, lw=1.0, zorder=1.6)
        axes.add_patch(edge)
        axes.text(x, y, f"{i + 1}", ha="center", va="center", color=colour, weight="bold")


def draw_rotation_arrow(axes: Axes, outline: StageOutline) -> None:
    """Sense of the carrier's rotation (counter-clockwise)."""
    r = 0.72 * outline.sun_radius
    start, end = np.radians(-35), np.radians(35)
    axes.add_patch(
        FancyArrowPatch(
            (r * np.cos(start), r * np.sin(start)),
            (r * np.cos(end), r * np.sin(end)),
            connectionstyle="arc3,rad=0.35",
            arrowstyle="-|>",
            mutation_scale=9,
            color=NEUTRAL,
            lw=0.9,
            zorder=2,
        )
    )


def square(axes: Axes, reach: float) -> None:
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    step = nice_number(0.7 * reach)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    axes.set_xlabel("X (m)")
    axes.set_ylabel("Y (m)")


@styled
def ring_star(
    displacement: xr.DataArray | FloatArray,
    carrier_angles: Sequence[float] | FloatArray,
    outline: StageOutline,
    exaggeration: float | None = None,
) -> Figure:
    """The deformed ring at one or more carrier angles, side by side.

    ``displacement`` (p, z, 3) or (z, 3): tooth nodes, global, m. The exaggeration is the same in
    all panels, chosen round unless given, and stated.
    """
    field, angles = as_positions(displacement, carrier_angles)
    factor = exaggeration or star_exaggeration(field, outline.ring_radius)
    columns = min(angles.size, 3)
    rows = -(-angles.size // columns)
    width = {1: 105.0, 2: 183.0, 3: 240.0}[columns]
    figure, axes = panels(
        rows, columns, height_mm=rows * (width / columns + 1) + 13, width_mm=width
    )
    largest = factor * float(np.nanmax(np.hypot(field[..., 0], field[..., 1]), initial=0.0))
    reach = outline.ring_radius + max(largest, 0.03 * outline.ring_radius) * 1.15
    for ax in axes.ravel()[angles.size :]:
        ax.set_visible(False)
    for ax, u, angle in zip(axes.ravel(), field, angles, strict=False):
        draw_star(ax, u, angle, outline, factor)
        square(ax, reach)
    peak = float(np.nanmax(np.abs(radial(field)))) * MICRO
    figure.legend(handles=star_handles(), loc="outside lower center", ncols=3)
    figure.suptitle(
        f"Ring tooth nodes, displacement {factor_text(factor)} (largest radial {peak:.1f} µm)",
        fontsize=9.5,
    )
    return figure


def star_handles() -> list[Line2D]:
    return [
        Line2D([], [], color=ORIGINAL_COLOUR, ls="--", lw=1.0, label="undeformed pitch circle"),
        Line2D([], [], color=DEFORMED_COLOUR, marker="o", ms=2.4, lw=1.2, label="deformed ring"),
        Line2D([], [], color=NEUTRAL, lw=1.0, label="planets 1…N and sun (undeformed)"),
    ]


def draw_star(
    axes: Axes, displacement: FloatArray, angle: float, outline: StageOutline, factor: float
) -> tuple[Line2D, FloatArray]:
    """One star into ``axes``; returns the deformed line and its points (z, 2)."""
    draw_gears(axes, outline, angle)
    draw_rotation_arrow(axes, outline)
    circle = Circle(
        (0, 0), outline.ring_radius, fill=False, ec=ORIGINAL_COLOUR, ls="--", lw=1.0, zorder=2
    )
    axes.add_patch(circle)
    points = ring_points(displacement, outline.ring_radius, factor)
    closed = np.vstack([points, points[:1]])
    (line,) = axes.plot(
        *closed.T, color=DEFORMED_COLOUR, marker="o", ms=1.8, lw=1.3, zorder=3, label="deformed"
    )
    axes.set_title(angle_text(angle, len(outline.planet_angles)))
    return line, points


@styled
def radial_profile(
    displacement: xr.DataArray | FloatArray,
    carrier_angles: Sequence[float] | FloatArray,
    outline: StageOutline,
) -> Figure:
    """Radial displacement (µm) of the tooth nodes over the ring angle, planets marked."""
    field, angles = as_positions(displacement, carrier_angles)
    profile = radial(field) * MICRO
    planets = len(outline.planet_angles)
    figure, axes = panels(angles.size, 1, height_mm=18 + 42 * angles.size, sharex=True, sharey=True)
    ring_angles = 2 * pi * np.arange(profile.shape[1]) / profile.shape[1]
    for ax, values, angle in zip(axes[:, 0], profile, angles, strict=True):
        ax.plot(ring_angles, values, "o-", ms=2.2, color=DEFORMED_COLOUR)
        ax.axhline(0, color=ORIGINAL_COLOUR, ls="--", lw=0.9)
        for i, offset in enumerate(outline.planet_angles):
            at = (angle + offset) % (2 * pi)
            ax.axvline(at, color=planet_colour(i + 1), lw=1.0, ls=":")
            ax.annotate(
                f"{i + 1}",
                (at, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(3, -2),
                textcoords="offset points",
                va="top",
                color=planet_colour(i + 1),
                weight="bold",
            )
        ax.margins(y=0.16)
        ax.set_title(angle_text(angle, planets))
        ax.set_ylabel("radial\ndisplacement (µm)")
    last = axes[-1, 0]
    last.set_xlim(0, 2 * pi)
    last.set_xticks([2 * pi * k / planets for k in range(planets + 1)])
    last.set_xticklabels([pi_label(2 * pi * k / planets, planets) for k in range(planets + 1)])
    last.set_xlabel("angle on the ring φ (rad); dotted: planets 1…N")
    return figure


MAGNIFICATION_XY = {"ring": 2000.0, "carrier": 500.0, "sun": 10000.0}
MAGNIFICATION_YZ = {"ring": 50000.0, "carrier": 50000.0, "sun": 5000.0}


@dataclass(frozen=True)
class Disc:
    """A rigid circle of ``radius`` about ``centre`` (3,), moved by u + θ × r (global, small)."""

    centre: FloatArray
    radius: float
    motion: FloatArray  # (6,) global; spin about Z is not drawn

    def curves(self) -> tuple[FloatArray, FloatArray]:
        """Original points (n, 3) and their displacements (n, 3)."""
        turn = np.linspace(0, 2 * pi, 97)
        arm = self.radius * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
        tilt = np.array([self.motion[3], self.motion[4], 0.0])
        return self.centre + arm, self.motion[:3] + np.cross(tilt, arm)


def turned(motion: FloatArray, angle: float) -> FloatArray:
    """(6,) motion from axes turned by ``angle`` about Z into global axes."""
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    return np.concatenate([rotation @ motion[:3], rotation @ motion[3:]])


def drive_rotation(position: xr.Dataset) -> float:
    """Rotation of the carrier's drive node about Z (rad), 0 where it is not in the dataset."""
    if "carrier_displacement" not in position:
        return 0.0
    nodes = [str(n) for n in position["carrier_node"].values]
    row = position["carrier_displacement"].isel(carrier_node=nodes.index("drive"))
    return float(row.isel(dof=5)) if "drive" in nodes else 0.0


def stage_discs(position: xr.Dataset, outline: StageOutline) -> dict[str, list[Disc]]:
    """Pins, planets and sun of one position, relative to the carrier's drive node."""
    angle = float(position["carrier_angle"])
    spin = drive_rotation(position)
    parts: dict[str, list[Disc]] = {"pin": [], "planet": [], "sun": []}
    for i, offset in enumerate(outline.planet_angles):
        centre = np.append(outline.planet_centre(i, angle), 0.0)
        carried = spin * outline.center_distance
        planet = np.array(variable(position, "planet_displacement").isel(planet=i), dtype=float)
        planet[1] -= carried
        parts["planet"].append(Disc(centre, outline.planet_radius, turned(planet, angle + offset)))
        if "pin_displacement" in position:
            pin = np.array(position["pin_displacement"].isel(planet=i), dtype=float)
            pin[:2] -= carried * np.array([-np.sin(offset), np.cos(offset)])
            parts["pin"].append(Disc(centre, outline.pin_circle, turned(pin, angle)))
    sun = np.array(variable(position, "sun_displacement"), dtype=float)
    parts["sun"].append(Disc(np.zeros(3), outline.sun_radius, turned(sun, angle)))
    return parts


@styled
def equilibrium_positions(
    dataset: xr.Dataset,
    outline: StageOutline,
    magnification_xy: Mapping[str, float] = MAGNIFICATION_XY,
    magnification_yz: Mapping[str, float] = MAGNIFICATION_YZ,
) -> Figure:
    """Ring, pins, planets and sun at equilibrium: X–Y and Y–Z, one row a position (Tan, Fig. 8).

    ``dataset``: carrier_angle, tooth_displacement (p, tooth, axis), planet_displacement
    (p, planet, dof; planet axes), pin_displacement (p, planet, dof; carrier axes),
    sun_displacement (p, dof; carrier axes), carrier_displacement for the drive node's rotation,
    which is taken out. "carrier" magnifies pins and planets. In Y–Z only z is magnified.
    """
    dim = leading_dim(dataset)
    count = int(dataset.sizes[dim])
    figure, axes = panels(
        count, 2, height_mm=24 + 84 * count, width_mm=200, width_ratios=[1.0, 1.12]
    )
    for row in range(count):
        position = dataset.isel({dim: row})
        left, right = axes[row]
        draw_plane(left, position, outline, magnification_xy, (0, 1))
        draw_plane(right, position, outline, magnification_yz, (1, 2))
        text = angle_text(float(position["carrier_angle"]), len(outline.planet_angles))
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
    factors: Mapping[str, float],
    plane: tuple[int, int],
) -> None:
    """All components of one position, projected on ``plane`` (0, 1) = X–Y or (1, 2) = Y–Z."""
    teeth = np.asarray(variable(position, "tooth_displacement"), dtype=float)
    flat = ring_points(np.zeros_like(teeth), outline.ring_radius, 0.0)
    ring = np.column_stack([flat, np.zeros(len(flat))])
    drawn = [(np.vstack([ring, ring[:1]]), np.vstack([teeth, teeth[:1]]), factors["ring"], 1.3)]
    for name, discs in stage_discs(position, outline).items():
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
        x, y = outline.planet_centre(i, float(position["carrier_angle"]))
        if plane == (0, 1):
            axes.text(x, y, f"{i + 1}", ha="center", va="center", fontsize=8, color=NEUTRAL)
