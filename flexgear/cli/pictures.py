"""Which pictures a run gets; how they are drawn is the views' business."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexgear.cli.display import Report
from flexgear.cli.planned_pictures import drawings_plan, stages_plan
from flexgear.cli.report_page import place_of, side_of
from flexgear.cli.run_folder import Folder, RingFolder, prefix_of, read_folder
from flexgear.gears.geometry import stage_geometry
from flexgear.model.errors import FlexgearError
from flexgear.model.names import BodyName
from flexgear.results.report.wording import of_stage, window_words, with_unit
from flexgear.results.settling import settled, window_of
from flexgear.results.stage_part import with_spread
from flexgear.studies.early_workers import EarlyWorkers
from flexgear.views import charts, displacements, histories, loads, star, style
from flexgear.views.interactive import panels_of
from flexgear.views.report import Picture as Shown
from flexgear.views.report import Side, write_report
from flexgear.views.select import thinned

ANIMATION = "ring_star_turning"
DPI = 150  # of pictures, which are as wide as a page
MOST_SHOWN = 50_000  # samples of a torque drop in a picture
TITLE = 85  # characters in a line of a title
TEETH_SHOWN = 5  # tooth pitches in a picture of pair loads


Draw = Callable[[], Any]


@dataclass(frozen=True)
class Picture:
    """One picture, or why there is none; panels: the same for a screen, in plotly's terms."""

    path: Path | None
    caption: str
    panels: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True)
class Sheet:
    """Where what is drawn lies, the folder of a run, and where pictures go."""

    source: Path
    folder: Path


def draw(
    content: Folder, sheet: Sheet, report: Report, workers: EarlyWorkers, interactive: bool = True
) -> list[str]:
    """Draw the pictures and write the report; returns what was left out and why."""
    side, notes = drawn_side(content, sheet, report, workers)
    title = content.case.title or content.case.name
    write_report(sheet.folder / "report.html", title, content.case.name, [side], interactive)
    report("pictures", 1.0)
    return notes


def drawn_side(
    content: Folder, sheet: Sheet, report: Report, workers: EarlyWorkers
) -> tuple[Side, list[str]]:
    """Draw the pictures: their side of the report, and what was left out and why."""
    report("pictures", 0.0)
    made: dict[str, Picture] = {}
    _known[sheet] = drawn = Pictures(content, sheet.folder)
    try:
        for k, outcome in workers.completed(_picture, sheet, drawn.names):
            # what another process could not draw fails here again, with its own error
            made[drawn.names[k]] = outcome.value or drawn.picture(drawn.names[k])
            report("pictures", len(made) / (len(drawn.names) + 1))
    finally:
        del _known[sheet]
    ordered = [(name, made[name]) for name in (*drawn.plan, *drawn.bodies)]
    notes = [p.caption for _, p in ordered if p.path is None][:1]
    if content.rings and not drawn.renders:
        notes = ["no 3D renders: ring and carrier are rigid"]
    shown = [_shown(name, picture) for name, picture in ordered if picture.path is not None]
    return side_of(content.case, content.flow, content.summary, shown, notes), notes


def _shown(name: str, picture: Picture) -> Shown:
    section, sentence = place_of(name)
    return Shown(name, section, picture.caption, sentence, picture.path, picture.panels)


@dataclass(frozen=True)
class Pictures:
    """All pictures of a run, by file name. place: the folder that gets them below "pictures"."""

    content: Folder
    place: Path

    @property
    def names(self) -> list[str]:
        """Of all, those that take longest first."""
        return [*self.bodies, *self.plan]

    @property
    def bodies(self) -> list[str]:
        """Of those that are more than one figure."""
        return [*self.renders, *self.swings, *self.animations]

    @cached_property
    def plan(self) -> dict[str, tuple[str, Draw]]:
        """Figures: caption and how to make them."""
        content = self.content
        plan: dict[str, tuple[str, Draw]] = {}
        for ring in content.rings:
            made = {f"{ring.prefix}{name}": figure for name, figure in _ring_plan(ring).items()}
            prefix = f"{ring.name}: " if ring.prefix else ""
            prefix += "left half: " if ring.stage.stage.double_helical else ""
            plan |= {name: (f"{prefix}{caption}", make) for name, (caption, make) in made.items()}
        drawings = drawings_plan(content.case, content.flow)
        return drawings | plan | stages_plan(content.flow, content.datasets)

    @cached_property
    def renders(self) -> dict[str, BodyName]:
        """Bodies by the names of their 3D renders."""
        return _rendered(self.content)

    @cached_property
    def swings(self) -> dict[str, BodyName]:
        """Bodies by the names of the pictures of their mode shapes."""
        return _swinging(self.content)

    @cached_property
    def animations(self) -> dict[str, RingFolder]:
        """Flexible stages whose turning star is animated, by the name of the picture."""
        return _animated(self.content)

    def picture(self, name: str) -> Picture:
        """Draw one."""
        folder = self.place / "pictures"
        folder.mkdir(parents=True, exist_ok=True)
        if name in self.animations:
            return _animate(self.animations[name], folder, name)
        if name in self.renders:
            return _render(self.content, folder, name)
        if name in self.swings:
            return _swing(self.content, folder, name)
        caption, make = self.plan[name]
        figure = make()
        _title(figure, caption)
        path = style.save_figure(figure, folder / f"{name}.png", dpi=DPI)
        return Picture(path, caption, panels_of(figure))


_known: dict[Sheet, Pictures] = {}  # runs that this process draws


def _picture(sheet: Sheet, name: str) -> Picture:
    """The picture of a name, in whatever process; it reads the run once."""
    if sheet not in _known:
        _known[sheet] = Pictures(read_folder(sheet.source), sheet.folder)
    return _known[sheet].picture(name)


def imported() -> None:
    """What a worker does before there is anything to draw: this module is there, and so is all that
    3D renders need."""
    from flexgear.views import animation, render, scenes  # noqa: F401

    render.load_renderer()


def _title(figure: Any, caption: str) -> None:
    """The caption above a picture that is looked at alone, with what the picture says itself."""
    title = figure.get_suptitle()
    lines = [*textwrap.wrap(caption, TITLE), *([title] if title and title not in caption else [])]
    figure.suptitle("\n".join(lines), fontsize=9, weight="bold")


def _ring_plan(content: RingFolder) -> dict[str, tuple[str, Draw]]:
    """Figures of one flexible stage by name."""
    runs, equilibria, outline = content.runs("transient"), content.equilibria, _outline(content)
    window = window_words(window_of(next(iter(runs.values()))).figures)
    steady = {label: settled(data) for label, data in runs.items()}
    name, first = next(iter(steady.items()))
    planets = content.stage.stage.planets
    teeth = content.stage.ring_gear.teeth
    angle = float(first["carrier_angle"][first.sizes["time"] // 2])
    close = (angle, angle + TEETH_SHOWN * 2 * np.pi / teeth)
    two = equilibria.isel(position=_nearest(equilibria, [0.0, np.pi / planets]))
    at = two["carrier_angle"].to_numpy()
    orders = content.figures["radial_harmonics_um"]
    plan: dict[str, tuple[str, Draw]] = {
        "ring_star": (
            "Ring at two carrier angles, equilibrium without errors",
            lambda: star.ring_star(two["tooth_displacement"], at, outline),
        ),
        "ring_profile": (
            "Radial displacement of the tooth nodes",
            lambda: star.radial_profile(two["tooth_displacement"], at, outline),
        ),
        "radial_harmonics": (
            "Radial harmonics of the ring at rated torque",
            lambda: charts.radial_harmonics([1e-6 * v for v in orders], planets),
        ),
        "tooth_node_1": (
            f"Displacement of ring tooth node 1, {window}",
            lambda: displacements.tooth_node_displacement(steady),
        ),
        "tooth_displacement_map": (
            f"x displacement of all tooth nodes, {window}",
            lambda: displacements.tooth_displacement_map(first),
        ),
        "ring_tooth_loads": (
            f"Load of the ring's tooth pairs, {TEETH_SHOWN} pitches; dashed: by stiffness alone",
            lambda: loads.pair_loads(steady, "ring", window=close, split=name),
        ),
        "sun_tooth_loads": (
            f"Load of the sun's tooth pairs, {TEETH_SHOWN} pitches; dashed: by stiffness alone",
            lambda: loads.pair_loads(steady, "sun", window=close, split=name),
        ),
        "engagement_map": (
            f"Engaged ring teeth and their pair stiffness, {window}",
            lambda: loads.engagement_map(first),
        ),
        "sun_displacement": (
            f"Displacement of the sun, axes of the carrier, {window}",
            lambda: displacements.sun_displacement(steady),
        ),
        "planet_displacement": (
            f"Displacement of planet 1, its own axes, {window}",
            lambda: displacements.planet_displacement(steady),
        ),
        "load_sharing": (
            f"Load sharing in time, {window}",
            lambda: histories.load_sharing(_spread(steady)),
        ),
    }
    for depth in content.run.summary["torque_steps"]:
        runs = content.runs(f"torque_step_{depth}")
        drop = _spread({n: thinned(d, MOST_SHOWN) for n, d in runs.items()})
        plan[f"torque_step_{depth}"] = (
            f"Torque drop to {with_unit(float(depth), 'N m')}",
            partial(histories.torque_drop, drop),
        )
        plan[f"torque_step_{depth}_speed"] = (
            f"Carrier speed, torque drop to {with_unit(float(depth), 'N m')}",
            partial(histories.carrier_speed, drop),
        )
        account = next(iter(drop.values()))
        if "energy_kinetic" in account:
            plan[f"torque_step_{depth}_energy"] = (
                f"Energy balance, torque drop to {with_unit(float(depth), 'N m')}",
                partial(charts.energy_balance, account),
            )
    return plan


def _outline(content: RingFolder) -> star.StageOutline:
    """Circles that stand for the gears."""
    g = stage_geometry(content.run.case.view(content.name))
    fe_carrier = content.stage.stage.form("carrier") == "fe"
    return star.StageOutline(
        ring_radius=g.ring.reference_radius,
        sun_radius=g.sun.reference_radius,
        planet_radius=g.planet.reference_radius,
        center_distance=g.center_distance,
        planet_angles=tuple(content.stage.stage.planet_angles),
        pin_radius=content.stage.carrier.pin_diameter / 2 if fe_carrier else None,
    )


def _spread(runs: Mapping[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    return {name: with_spread(data) for name, data in runs.items()}


def _nearest(equilibria: xr.Dataset, angles: list[float]) -> list[int]:
    values = equilibria["carrier_angle"].to_numpy()
    return [int(np.argmin(np.abs(values - a))) for a in angles]


def _rendered(content: Folder) -> dict[str, BodyName]:
    """Bodies by the names of their 3D renders."""
    return {f"{prefix_of(body.stage)}{body.part}_3d": body for body in content.fields}


def _animated(content: Folder) -> dict[str, RingFolder]:
    """Flexible stages whose turning star is animated, by the name of the picture."""
    return {f"{ring.prefix}{ANIMATION}": ring for ring in content.rings}


def _render(content: Folder, folder: Path, name: str) -> Picture:
    """3D render of a deformed body, or why there is none."""
    from flexgear.views.probe import require_rendering
    from flexgear.views.render import render_deformed
    from flexgear.views.scenes import body_scene, triangles_of_each

    try:
        require_rendering()
    except FlexgearError as error:
        return Picture(None, f"no 3D renders: {error}")
    body = _rendered(content)[name]
    field = content.fields[body]
    torque = field.attrs["input_torque"]
    unit, factor = style.unit_of_torque(torque)
    figure = render_deformed(
        field["point"].to_numpy(),
        field["cell"].to_numpy(),
        field["displacement"].to_numpy(),
        title=f"{_body(body)}, equilibrium at {torque * factor:g} {unit}",
    )
    path = style.save_figure(figure, folder / f"{name}.png", dpi=DPI)
    scene = body_scene(
        field["point"].to_numpy(),
        field["cell"].to_numpy(),
        field["displacement"].to_numpy(),
        field["von_mises_stress"].to_numpy() if "von_mises_stress" in field else None,
        triangles_of_each(len(content.fields))[0],
    )
    return Picture(path, f"Deformed {_body(body).lower()}, exaggerated as stated", scene)


def _swinging(content: Folder) -> dict[str, BodyName]:
    """Bodies by the names of the pictures of their mode shapes, where there are any."""
    return {
        f"{prefix_of(body.stage)}{body.part}_mode_shapes": body
        for body, field in content.fields.items()
        if field.sizes.get("mode", 0)  # earlier runs kept none
    }


def _swing(content: Folder, folder: Path, name: str) -> Picture:
    """Lowest natural modes of a body: the first in the picture, all of them on the screen."""
    from flexgear.views.probe import require_rendering
    from flexgear.views.render import render_deformed
    from flexgear.views.scenes import mode_scene, triangles_of_each

    try:
        require_rendering()
    except FlexgearError as error:
        return Picture(None, f"no 3D renders: {error}")
    body = _swinging(content)[name]
    field = content.fields[body]
    points, cells, shapes = (field[n].to_numpy() for n in ("point", "cell", "mode_displacement"))
    labels = [
        f"mode {int(mode)}, {with_unit(float(hz), 'Hz')}"
        for mode, hz in zip(field["mode"], field["frequency"], strict=True)
    ]
    title = f"{_body(body)} in {labels[0]}"
    figure = render_deformed(points, cells, shapes[0], title=title, relative=True)
    path = style.save_figure(figure, folder / f"{name}.png", dpi=DPI)
    scene = mode_scene(points, cells, shapes, labels, triangles_of_each(len(content.fields))[1])
    return Picture(path, f"{_body(body)} in the lowest natural modes that move it", scene)


def _body(body: BodyName) -> str:
    """ "Ring", "Ring of stage_1"."""
    return body.part.capitalize() + of_stage(body.stage)


def _animate(content: RingFolder, folder: Path, name: str) -> Picture:
    """The star turning with the carrier until planets stand alike, which closes the loop."""
    from flexgear.views.animation import animate_star
    from flexgear.views.scenes import star_scene

    equilibria, period = content.equilibria, content.stage.stage.planet_period
    angles = equilibria["carrier_angle"].to_numpy()
    turn = equilibria.isel(position=np.flatnonzero(angles < period - 1e-9))
    path = animate_star(
        turn["tooth_displacement"],
        turn["carrier_angle"].to_numpy(),
        _outline(content),
        folder / f"{name}.gif",
        dpi=90,
        frames_per_second=12,
    )
    shown = turn["tooth_displacement"].to_numpy(), turn["carrier_angle"].to_numpy()
    return Picture(path, "The star turns with the carrier", star_scene(*shown, _outline(content)))
