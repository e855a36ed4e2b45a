"""Pictures of the deformed ring, whose largest deflections at the planets form a star.

A tooth node at angle φ_j on the pitch circle R is drawn at

    x_j = R (cos φ_j, sin φ_j) + f (u_x, u_y)_j ,

with the exaggeration f printed in the picture. Displacements are global and in metres, teeth are
counted from the X axis, the carrier turns counter-clockwise (docs/conventions.md).
"""

import math
import os
from dataclasses import dataclass, replace
from math import pi
from pathlib import Path
from typing import Any, Self

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch
from matplotlib.ticker import MultipleLocator
from PIL import Image

from flexgear.arrays import Array
from flexgear.files.atomic import atomic_file
from flexgear.results.report.wording import number
from flexgear.results.time_figures import radial
from flexgear.views.histories import finish_x, tooth_map
from flexgear.views.select import abscissa, leading_dim, planet_count, thinned, variable
from flexgear.views.style import (
    DEFORMED_COLOUR,
    DIVERGING_MAP,
    MICRO,
    NEUTRAL,
    ORIGINAL_COLOUR,
    factor_text,
    legend_of,
    nice_number,
    panels,
    pi_label,
    planet_colour,
    styled,
)

MAP_SAMPLES = 1500  # of a map over the carrier angle


@dataclass(frozen=True)
class StageOutline:
    """Pitch circles of the gears of a stage: radii and centre distance in m, angles in rad."""

    ring_radius: float
    sun_radius: float
    planet_radius: float
    center_distance: float
    planet_angles: tuple[float, ...]

    def planet_centre(self, planet: int, carrier_angle: float) -> Array:
        """(x, y) of planet ``planet`` (0-based) with the carrier at ``carrier_angle``."""
        angle = carrier_angle + self.planet_angles[planet]
        return self.center_distance * np.array([np.cos(angle), np.sin(angle)])

    def in_millimetres(self) -> Self:
        """The same outline with its lengths converted from m to mm, as pictures show them."""
        sizes = ("ring_radius", "sun_radius", "planet_radius", "center_distance")
        return replace(self, **{name: 1e3 * getattr(self, name) for name in sizes})


def ring_points(displacement: Array, radius: float, factor: float) -> Array:
    """Drawn tooth nodes (z, 2) for ``displacement`` (z, 2 or 3), in the unit of both."""
    angles = 2 * pi * np.arange(displacement.shape[0]) / displacement.shape[0]
    circle = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return circle + factor * displacement[:, :2]


def _largest(displacement: Array) -> float:
    """Largest displacement in the plane."""
    return float(np.nanmax(np.hypot(displacement[..., 0], displacement[..., 1]), initial=0.0))


def star_exaggeration(displacement: Array, radius: float) -> float:
    """Round factor that draws the largest in-plane displacement as at most 0.16 of the radius."""
    largest = _largest(displacement)
    return nice_number(0.16 * radius / largest) if largest > 0 else 1.0


def star_reach(displacement: Array, outline: StageOutline, factor: float) -> float:
    """Half the side of the square that is drawn, in the unit of outline and displacement."""
    return outline.ring_radius + 1.15 * max(
        factor * _largest(displacement), 0.03 * outline.ring_radius
    )


def angle_text(angle: float, planets: int) -> str:
    """Carrier angle within a turn in rad, also as a fraction of π if it is one."""
    unit, angle = pi / (2 * planets), math.fmod(angle, 2 * pi)
    text = f"{angle:.3f} rad".replace("-", "−")
    if abs(angle / unit - round(angle / unit)) < 1e-6 and round(angle / unit) != 0:
        text = f"{pi_label(angle, 2 * planets)} = {text}"
    return f"$θ_c$ = {text}"


def draw_gears(axes: Axes, outline: StageOutline, carrier_angle: float) -> None:
    """Draw sun and planets as circles, planets with colours and numbers."""
    look: Any = {"fc": "#F3F4F6", "ec": NEUTRAL, "lw": 0.8, "label": "undeformed planets, sun"}
    axes.add_patch(Circle((0, 0), outline.sun_radius, zorder=1.5, **look))
    axes.text(0, 0, "sun", ha="center", va="center", color=NEUTRAL, fontsize=8)
    for i in range(len(outline.planet_angles)):
        x, y = outline.planet_centre(i, carrier_angle)
        colour = planet_colour(i + 1)
        face = (colour, 0.16)
        axes.add_patch(
            Circle((x, y), outline.planet_radius, fc=face, ec=colour, lw=1.0, zorder=1.6)
        )
        axes.text(x, y, f"{i + 1}", ha="center", va="center", color=colour, weight="bold")


def draw_rotation_arrow(axes: Axes, outline: StageOutline, sense: float) -> None:
    """Draw an arrow of the carrier's rotation relative to the ring, counter-clockwise if
    sense > 0."""
    r = 0.72 * outline.sun_radius
    start, end = sense * np.radians(-35), sense * np.radians(35)
    axes.add_patch(
        FancyArrowPatch(
            (r * np.cos(start), r * np.sin(start)),
            (r * np.cos(end), r * np.sin(end)),
            connectionstyle=f"arc3,rad={0.35 * sense}",
            arrowstyle="-|>",
            mutation_scale=9,
            color=NEUTRAL,
            lw=0.9,
            zorder=2,
        )
    )


def square(axes: Axes, reach: float) -> None:
    """Set equal scales from −reach to reach, mm."""
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    step = nice_number(0.7 * reach)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(step))
    axes.set_xlabel("X (mm)")
    axes.set_ylabel("Y (mm)")


@styled
def ring_star(
    displacement: xr.DataArray | Array,
    angles: Array,
    outline: StageOutline,
) -> Figure:
    """The deformed ring at one or more carrier angles, side by side.

    displacement: (p, z, 3) of tooth nodes, global, m, at carrier angles ``angles`` (p,), rad. All
    panels have the same exaggeration, stated in the picture.
    """
    field, outline = 1e3 * np.asarray(displacement, dtype=float), outline.in_millimetres()
    factor = star_exaggeration(field, outline.ring_radius)
    columns = min(angles.size, 3)
    rows = -(-angles.size // columns)
    width = {1: 105.0, 2: 183.0, 3: 240.0}[columns]
    figure, axes = panels(
        rows, columns, height_mm=rows * (width / columns + 1) + 13, width_mm=width
    )
    reach = star_reach(field, outline, factor)
    for ax in axes.ravel()[angles.size :]:
        ax.set_visible(False)
    for ax, u, angle in zip(axes.ravel(), field, angles, strict=False):
        draw_star(ax, u, angle, outline, factor, np.sign(angles[-1] - angles[0]))
        square(ax, reach)
    peak = float(np.nanmax(np.abs(radial(field)))) * 1e3
    gap = " " if columns > 1 else "\n"
    size = f"displacement {factor_text(factor)}{gap}(largest radial {number(peak)} µm)"
    legend_of(figure, min(columns + 1, 3))
    figure.suptitle(f"Ring tooth nodes, {size}", fontsize=9.5)
    return figure


def draw_star(
    axes: Axes,
    displacement: Array,
    angle: float,
    outline: StageOutline,
    factor: float,
    sense: float,
) -> None:
    """Draw the deformed ring. sense: ±1 of the carrier's rotation relative to the ring, 0 for no
    arrow."""
    draw_gears(axes, outline, angle)
    if sense:
        draw_rotation_arrow(axes, outline, sense)
    look: Any = {"ec": ORIGINAL_COLOUR, "ls": "--", "lw": 1.0, "label": "undeformed pitch circle"}
    axes.add_patch(Circle((0, 0), outline.ring_radius, fill=False, zorder=2, **look))
    points = ring_points(displacement, outline.ring_radius, factor)
    closed = np.vstack([points, points[:1]])
    axes.plot(
        *closed.T,
        color=DEFORMED_COLOUR,
        marker="o",
        ms=1.8,
        lw=1.3,
        zorder=3,
        label="deformed ring",
    )
    axes.set_title(angle_text(angle, len(outline.planet_angles)))


@styled
def radial_profile(
    displacement: xr.DataArray | Array,
    angles: Array,
    outline: StageOutline,
) -> Figure:
    """Radial displacement (µm) of the tooth nodes over the ring angle, planets marked."""
    field = np.asarray(displacement, dtype=float)
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


@styled
def animate_star(
    displacement: xr.DataArray | Array,
    angles: Array,
    outline: StageOutline,
    path: str | os.PathLike[str],
    frames_per_second: float = 20.0,
    dpi: float = 120.0,
) -> Path:
    """Write the animated ring atomically as .gif, with one palette for all frames (no flicker);
    returns the path.

    displacement: (p, z, 3), m, at carrier angles ``angles`` (p,), rad, one frame each. The
    animation loops, so the last position must not repeat the first.
    """
    field, outline = 1e3 * np.asarray(displacement, dtype=float), outline.in_millimetres()
    factor = star_exaggeration(field, outline.ring_radius)
    figure, axes = panels(1, 1, height_mm=121, width_mm=105)
    ax, canvas = axes[0, 0], FigureCanvasAgg(figure)
    figure.set_dpi(dpi)
    figure.suptitle(f"Ring tooth nodes, displacement {factor_text(factor)}", fontsize=9)
    square(ax, star_reach(field, outline, factor))
    frames: list[Image.Image] = []
    for u, angle in zip(field, angles, strict=True):
        for artist in (*ax.patches, *ax.lines, *ax.texts):
            artist.remove()
        draw_star(ax, u, angle, outline, factor, np.sign(angles[-1] - angles[0]))
        ax.set_title(f"$θ_c$ = {np.degrees(angle):.1f}°")
        if not frames:
            legend_of(figure, 2)
        canvas.draw()
        figure.set_layout_engine("none")  # the axes stay where the first frame has them
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
        palette = frames[0] if frames else None
        frames.append(picture.quantize(128, palette=palette, dither=Image.Dither.NONE))
    with atomic_file(path) as temporary:
        frames[0].save(
            temporary, format="GIF", save_all=True, append_images=frames[1:], loop=0,
            duration=round(1000 / frames_per_second), optimize=False,
        )  # fmt: skip
    return Path(path)


@styled
def radial_harmonics(harmonics: Array, planets: int) -> Figure:
    """Amplitudes (m) of the ring's radial displacement by order 0, 1, 2, …

    Multiples of the number of planets are red: equal planets without errors cause no other order.
    """
    figure, axes = panels(1, 1, height_mm=66)
    ax, micrometres = axes[0, 0], np.abs(harmonics) * MICRO
    order = np.arange(micrometres.size)
    multiple = order % planets == 0
    ax.bar(order, micrometres, 0.8, color=np.where(multiple, DEFORMED_COLOUR, "#9CA3AF").tolist())
    above: Any = {"xytext": (0, 2), "textcoords": "offset points", "ha": "center"}
    for n in order[multiple & (micrometres > 0)]:
        ax.annotate(f"{micrometres[n]:.3g}", (n, micrometres[n]), fontsize=7.5, **above)
    ax.set_xticks(order)
    ax.grid(axis="x", visible=False)
    ax.set_xlabel("order around the ring (–)")
    ax.set_ylabel("radial amplitude (µm)")
    ax.margins(y=0.1)
    ax.set_title(f"red: multiples of {planets} planets", fontsize=8, weight="normal")
    return figure


@styled
def tooth_displacement_map(dataset: xr.Dataset) -> Figure:
    """X displacement of all tooth nodes as a map over carrier angle (Tan 2023, Figure 13)."""
    dataset = thinned(dataset, MAP_SAMPLES)
    field = variable(dataset, "tooth_displacement").isel(axis=0)
    image = np.asarray(field.transpose(leading_dim(dataset), "tooth"), dtype=float).T * MICRO
    at = abscissa(dataset, "stage_angle")
    limit = float(np.nanmax(np.abs(image), initial=1e-12))
    figure, axes = panels(1, 1, height_mm=92)
    ax = axes[0, 0]
    mapped = tooth_map(ax, at, image, cmap=DIVERGING_MAP, vmin=-limit, vmax=limit)
    ax.set_ylabel("ring tooth number")
    ax.set_title(f"X displacement of the {len(image)} ring tooth nodes")
    figure.colorbar(mapped, ax=ax, label="X displacement (µm)", pad=0.01)
    finish_x(ax, "stage_angle", planet_count(dataset), at[0], at[-1])
    return figure
