"""Drawings of a stage to scale: front view with teeth, bolts and pins, and section along the axis.

In the front view the ring's first tooth is on the X axis. Planets are rotated so that their teeth
mesh with the ring, the sun so that it meshes with planet 1. If another planet then overlaps teeth
of the sun, the stage cannot be assembled. Frames are those of docs/conventions.md.
"""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from flexgear.arrays import Array
from flexgear.gears.geometry import StageGeometry, stage_geometry
from flexgear.gears.paths import GearFlank
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.bodies import Carrier, Shaft
from flexgear.model.stage_view import StageView
from flexgear.views.style import (
    MICRO,
    MILLI,
    NEUTRAL,
    SEQUENTIAL_MAP,
    VARIANT_COLOURS,
    legend_of,
    new_figure,
    panels,
    planet_colour,
    styled,
)

POINTS = 10  # of a flank, and of a root
PLANET = planet_colour(1) + "59"
STEEL, CARRIER, SHAFT = "#D5DAE1", "#BFE3D0", "#F3D9B8"
BOLT, HIDDEN, BEARING = "#BB5566", "#009E73", "#0072B2"
LINE: dict[str, Any] = {"ec": "#30343B", "lw": 0.6}
Box = tuple[float, float, float, float, str]  # z from, z to, r from, r to, colour


@styled
def front_drawing(view: StageView) -> Figure:
    """Front view of the stage, in mm."""
    g, stage = stage_geometry(view), view.stage
    figure, axes = panels(1, 1, height_mm=170)
    ax = axes[0, 0]
    outside, (sun_name, planet_name) = _ring_radius(view, g), _gear_names(view)
    if stage.kind == "planetary":
        _circle(ax, (0.0, 0.0), outside, STEEL)
        _fill(ax, gear_outline(g.ring, 0.0), "white")
        _carrier_circles(ax, view)
        _bolts(ax, view)
    rotations = [_planet_rotation(g, angle) for angle in stage.planet_angles]
    sun = _sun_rotation(g, stage.planet_angles[0], rotations[0])
    _fill(ax, gear_outline(g.sun, sun), STEEL, label=sun_name)
    _circle(ax, (0.0, 0.0), _bore(view, "sun"), fill="white")
    for k, (angle, rotation) in enumerate(zip(stage.planet_angles, rotations, strict=True)):
        centre = g.center_distance * np.array([math.cos(angle), math.sin(angle)])
        outline, colour = centre + gear_outline(g.planet, rotation), planet_colour(k + 1)
        _fill(ax, outline, colour, alpha=0.35, label=planet_name)
        _circle(ax, centre, _bore(view, "planet"), fill="white")
        if _fe_carrier(view) is not None:
            pin = view.carrier.pin_diameter / 2
            _circle(ax, centre, pin, fill=CARRIER, label="pin of the carrier")
        if stage.kind == "planetary":
            ax.text(*(MILLI * centre), f"{k + 1}", ha="center", va="center")
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.set_xlabel("X (mm)")
    ax.set_ylabel("Y (mm)")
    ax.set_title(f"centre distance {MILLI * g.center_distance:.5g} mm")
    legend_of(figure, 4)
    return figure


@styled
def section_drawing(view: StageView) -> Figure:
    """The upper half of the stage cut along its axis, in mm; crossed boxes are bearings."""
    boxes = [*_gear_boxes(view), *_carrier_boxes(view), *_shaft_boxes(view)]
    figure, axes = panels(1, 1, height_mm=110)
    ax, (sun, planet) = axes[0, 0], _gear_names(view)
    labels = {STEEL: sun, PLANET: planet, CARRIER: "carrier and pin", SHAFT: "shaft of the sun"}
    for left, right, inner, outer, colour in boxes:
        z, r = np.array([left, right, right, left]), np.array([inner, inner, outer, outer])
        if colour == BEARING:  # its edge and its diagonals
            corners = [0, 1, 2, 3, 0, 2, 1, 3]
            look: Any = {"color": BEARING, "lw": 1.0, "label": "bearing of the carrier"}
            ax.plot(MILLI * z[corners], MILLI * r[corners], **look)
        else:
            ax.fill(MILLI * z, MILLI * r, fc=colour, label=labels[colour], **LINE)
    for circle in view.ring.bolt_circles if view.stage.form("ring") == "fe" else ():
        half, stage = view.stage.face_width / 2, view.stage
        sign = 1.0 if view.ring.bolted_end(circle) == "+z" else -1.0
        at, radius = circle.circle_diameter / 2, circle.diameter / 2
        z = sign * np.array([0.0, 1.15 * half, 1.15 * half, 0.0])
        r = MILLI * (at + radius * np.array([-1, -1, 1, 1]))
        for bolt in (
            (z - stage.half_offset, stage.half_offset - z) if stage.double_helical else (z,)
        ):
            ax.plot(MILLI * bolt, r, color=BOLT, lw=1.0, label="bolt")
    ax.axhline(0.0, color=NEUTRAL, ls="-.", lw=0.8, label="axis")
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.set_xlabel("z (mm)")
    ax.set_ylabel("distance from the axis (mm)")
    legend_of(figure, 4)
    return figure


def _gear_names(view: StageView) -> tuple[str, str]:
    """Labels of sun and ring, and of planets; of pinion and gear."""
    return ("sun and ring", "planet") if view.stage.kind == "planetary" else ("pinion", "gear")


def gear_outline(gear: ToothGeometry, rotation: float) -> Array:
    """Closed outline (n, 2), m, of a gear with its first tooth at the angle ``rotation``, rad."""
    side = gear.profile(POINTS, POINTS)
    radius, angle = np.hypot(*side.T), np.arctan2(*side.T[::-1])
    r = np.concatenate([radius[::-1], radius])
    turn = np.concatenate([-angle[::-1], angle])
    centres = rotation + gear.pitch_angle * np.arange(gear.teeth)
    theta = (centres[:, None] + turn).ravel()
    points = np.tile(r, gear.teeth)[:, None] * np.column_stack([np.cos(theta), np.sin(theta)])
    return np.vstack([points, points[:1]])


def _planet_rotation(g: StageGeometry, angle: float) -> float:
    """Rotation of the planet at an angle, rad, at which it meshes with the ring."""
    if "ring" not in g.gears:
        return angle
    past = (angle / g.ring.pitch_angle) % 1.0  # pitches from the last tooth of the ring
    return angle + (0.5 - past) * g.planet.pitch_angle


def _sun_rotation(g: StageGeometry, angle: float, planet: float) -> float:
    """Rotation of the sun, rad, at which it meshes with planet 1."""
    past = ((angle + math.pi - planet) / g.planet.pitch_angle) % 1.0
    return angle + (past + 0.5) * g.sun.pitch_angle


def _ring_radius(view: StageView, g: StageGeometry) -> float:
    """Outer radius of the ring, m; without a rim in the case three modules outside the root."""
    if view.stage.kind != "planetary":
        return 0.0
    lumped = view.ring_gear.rim_thickness
    rim = view.ring.rim_thickness if view.stage.form("ring") == "fe" else lumped
    return g.ring.root_radius + (rim or 3 * view.stage.normal_module)


def _bolts(ax: Axes, view: StageView) -> None:
    for circle in view.ring.bolt_circles if view.stage.form("ring") == "fe" else ():
        for k in range(circle.number):
            at = circle.first_angle + 2 * math.pi * k / circle.number
            centre = circle.circle_diameter / 2 * np.array([math.cos(at), math.sin(at)])
            _circle(ax, centre, circle.diameter / 2, fill=BOLT, label="bolt")


def _carrier_circles(ax: Axes, view: StageView) -> None:
    body = _fe_carrier(view)
    if body is None:
        return
    for diameter in (body.plate_diameter, body.hub_outer_diameter):
        look: Any = {"ec": HIDDEN, "ls": "--", "lw": 0.8, "label": "plates and hub of the carrier"}
        ax.add_patch(Circle((0.0, 0.0), MILLI * diameter / 2, fill=False, **look))


def _gear_boxes(view: StageView) -> Iterator[Box]:
    """Boxes of the gears above the axis, with one planet."""
    g, stage = stage_geometry(view), view.stage
    width, gap = stage.face_width, stage.half_gap
    halves = [(-width / 2, width / 2)]
    if stage.double_helical:
        halves = [(-gap / 2 - width, -gap / 2), (gap / 2, gap / 2 + width)]
    bore = _bore(view, "planet")
    for left, right in halves:
        yield left, right, _bore(view, "sun"), g.sun.tip_radius, STEEL
        yield left, right, g.center_distance + bore, g.center_distance + g.planet.tip_radius, PLANET
        yield left, right, g.center_distance - g.planet.tip_radius, g.center_distance - bore, PLANET
        if stage.kind == "planetary":
            yield left, right, g.ring.tip_radius, _ring_radius(view, g), STEEL


def _carrier_boxes(view: StageView) -> Iterator[Box]:
    """Boxes of an FE carrier above the axis: plates, seats, bearings, hub and a pin."""
    body = _fe_carrier(view)
    if body is None:
        return
    side, inner, half = (
        -1.0 if body.drive_side == "-z" else 1.0,
        body.hub_bore / 2,
        body.plate_gap / 2,
    )
    drive, far = half + body.plate_thickness_drive, half + body.plate_thickness_far
    for sign, start, seat in ((side, drive, body.seat_drive), (-side, far, body.seat_far)):
        ends, radius = (sign * start, sign * (start + seat.width)), seat.diameter / 2
        yield sign * half, sign * start, inner, body.plate_diameter / 2, CARRIER
        yield *ends, inner, radius, CARRIER
        yield *ends, radius, radius + 0.6 * seat.width, BEARING
    hub = drive + body.seat_drive.width, drive + body.hub_length
    yield side * hub[0], side * hub[1], inner, body.hub_outer_diameter / 2, CARRIER
    axis, radius, bore = (
        stage_geometry(view).center_distance,
        body.pin_diameter / 2,
        body.pin_bore / 2,
    )
    yield -half, half, axis + bore, axis + radius, CARRIER
    yield -half, half, axis - radius, axis - bore, CARRIER


def _shaft_boxes(view: StageView) -> Iterator[Box]:
    """Boxes of the sections of the sun's shaft, from the middle of the sun."""
    shaft: Shaft | None = view.stage.sun.shaft if view.stage.sun else None
    if shaft is None:
        return
    at, sign = 0.0, -1.0 if shaft.direction == "-z" else 1.0
    for section in shaft.sections:
        ends = sorted((at, at + sign * section.length))
        yield ends[0], ends[1], section.inner_diameter / 2, section.outer_diameter / 2, SHAFT
        at += sign * section.length


def _fe_carrier(view: StageView) -> Carrier | None:
    return view.stage.carrier.fe if view.stage.carrier else None


def _bore(view: StageView, role: str) -> float:
    """Radius of a gear's bore, m."""
    return float(view.stage.member(view.part(role)).bore_diameter) / 2  # type: ignore[union-attr]


def _fill(ax: Axes, points: Array, colour: str, alpha: float = 1.0, label: str = "") -> None:
    ax.fill(MILLI * points[:, 0], MILLI * points[:, 1], fc=(colour, alpha), label=label, **LINE)


def _circle(
    ax: Axes, centre: Array | tuple[float, float], radius: float, fill: str, label: str = ""
) -> None:
    if radius > 0:
        x, y = MILLI * np.asarray(centre)
        ax.add_patch(Circle((x, y), MILLI * radius, fc=fill, label=label, **LINE))


FLANK_POINTS = 201  # along each axis
LEVELS = 8
_COLOURS = (*VARIANT_COLOURS.values(), NEUTRAL)
_LINES = ("-", "--", "-")


@styled
def flank_drawing(flank: GearFlank, where: str) -> Figure:
    """Modification of a flank: missing material (µm, normal to the flank in the transverse section)
    as a map over face and roll length, tip above, with profile and helix traces. where: title of
    the stage."""
    rho, z, gap = flank.surface(FLANK_POINTS)
    gap = MICRO * gap
    figure = new_figure(110)
    grid = figure.add_gridspec(2, 2, width_ratios=(3, 1.2), height_ratios=(2.2, 1))
    surface = figure.add_subplot(grid[0, 0])
    profile = figure.add_subplot(grid[0, 1], sharey=surface)
    helix = figure.add_subplot(grid[1, 0], sharex=surface)
    _map(figure, surface, MILLI * z, MILLI * rho, gap)
    for k, (at, label) in enumerate(((0, "−z end"), (FLANK_POINTS // 2, "middle"), (-1, "+z end"))):
        profile.plot(
            gap[:, at], MILLI * rho, _LINES[k], color=_COLOURS[k], label=f"profile, {label}"
        )
    for k, (at, label) in enumerate(((0, "root"), (FLANK_POINTS // 2, "middle"), (-1, "tip"))):
        helix.plot(MILLI * z, gap[at], _LINES[k], color=_COLOURS[k], label=f"helix, {label}")
    surface.set_ylim(MILLI * rho[0], MILLI * rho[-1])  # root below, tip above
    surface.set_ylabel("roll length (mm), tip above")
    helix.set_xlabel("place along the face z (mm)")
    helix.set_ylabel("missing (µm)")
    profile.set_xlabel("missing (µm)")
    key = figure.add_subplot(grid[1, 1])
    key.axis("off")
    handles = [*profile.get_lines(), *helix.get_lines()]
    key.legend(handles=handles, loc="center left", borderpad=0.0)
    ends = " … ".join(f"{x:.3g}".replace("-", "−") for x in (gap.min(), gap.max()))
    of_planet = flank.part == "planet"
    of_flank = f"flank towards the {flank.name}" if of_planet else f"{flank.name} flank"
    surface.set_title(f"{where} {flank.part}, {of_flank}: {ends} µm missing".strip())
    return figure


def _map(figure: Figure, ax: Axes, z: Array, rho: Array, gap: Array) -> None:
    """Draw missing material as colours with contours in round micrometres, which are lines and
    ticks of the colour bar, too."""
    low, high = float(gap.min()), max(float(gap.max()), float(gap.min()) + 1e-9)
    colours = ax.pcolormesh(
        z, rho, gap, shading="nearest", vmin=low, vmax=high, cmap=SEQUENTIAL_MAP, rasterized=True
    )
    bar = figure.colorbar(colours, ax=ax, label="missing (µm)")
    if np.ptp(gap) > 1e-6 * np.abs(gap).max():
        lines = ax.contour(z, rho, gap, LEVELS, colors="white", linewidths=0.6, linestyles="solid")
        bar.add_lines(lines)
        bar.set_ticks([level for level in lines.levels if low <= level <= high])
    ax.set_xlim(z[0], z[-1])
    ax.grid(False)
