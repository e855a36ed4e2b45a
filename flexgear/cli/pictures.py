"""Which pictures a run gets; how they are drawn is the views' business."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexgear.cli.display import Report
from flexgear.cli.painter import Painter, beside
from flexgear.gears.geometry import stage_geometry
from flexgear.model.errors import FlexgearError
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.results.version import version
from flexgear.views import charts, displacements, histories, loads, star, style
from flexgear.views.report import write_report
from flexgear.views.select import thinned

ANIMATION = "ring_star_turning"
MOST_SHOWN = 50_000  # samples of a torque drop in a picture
TEETH_SHOWN = 5  # tooth pitches in a picture of pair loads


@dataclass(frozen=True)
class Folder:
    """What a run left: datasets by name, displacement fields by body, the summary."""

    case: FlexibleStage
    datasets: Mapping[str, xr.Dataset]
    fields: Mapping[str, xr.Dataset]
    summary: Mapping[str, Any]

    def runs(self, start: str) -> dict[str, xr.Dataset]:
        """Datasets "start_variant" by variant, the flexible one first."""
        found = {
            n.removeprefix(f"{start}_"): d
            for n, d in self.datasets.items()
            if n.startswith(f"{start}_") and "without_errors" not in n
        }
        return dict(sorted(found.items(), key=lambda item: item[0] == "rigid"))

    @property
    def equilibria(self) -> xr.Dataset:
        """Equilibria over one revolution without manufacturing errors."""
        return next(d for n, d in self.datasets.items() if n.endswith("without_errors"))

    @property
    def outline(self) -> star.StageOutline:
        """Circles that stand for the gears."""
        g = stage_geometry(self.case.view())
        return star.StageOutline(
            ring_radius=g.ring.reference_radius,
            sun_radius=g.sun.reference_radius,
            planet_radius=g.planet.reference_radius,
            center_distance=g.center_distance,
            planet_angles=tuple(self.case.stage.planet_angles),
            pin_radius=self.case.carrier.pin_diameter / 2,
        )


Draw = Callable[[], Any]


@dataclass(frozen=True)
class Picture:
    """One picture in the report, or why there is none."""

    path: Path | None
    caption: str


@dataclass(frozen=True)
class Sheet:
    """What is drawn, and where to."""

    content: Folder
    folder: Path


@contextmanager
def drawing(content: Folder, folder: Path) -> Iterator[Painter[Sheet, Picture]]:
    """Begin to draw into ``folder`` with a helper process; ``draw`` finishes within the block."""
    rest = (content.case, content.fields, content.summary, folder)
    names = [*_rendered(content), ANIMATION, *_plan(content)]
    pieces = [rest, *content.datasets.items()]
    with beside(Sheet(content, folder), pieces, _sheet, _picture, names) as painter:
        yield painter


def _sheet(pieces: list[Any]) -> Sheet:
    """The sheet in the helper process."""
    (case, fields, summary, folder), *datasets = pieces
    return Sheet(Folder(case, dict(datasets), fields, summary), folder)


def draw(sheet: Painter[Sheet, Picture], report: Report) -> list[str]:
    """Finish the pictures and write the report; returns what was left out and why."""
    content, folder = sheet.content.content, sheet.content.folder
    plan, renders = _plan(content), _rendered(content)
    count = len(plan) + len(renders) + 1
    report("pictures", 0.0)
    made = sheet.finish(lambda done: report("pictures", done / (count + 1)))
    ordered = [made[name] for name in (*plan, *renders, ANIMATION)]
    notes = [p.caption for p in ordered if p.path is None][:1]
    if not renders:
        notes = ["no 3D renders: ring and carrier are rigid"]
    write_report(
        folder / "report.html",
        content.case.title or content.case.name,
        content.summary,
        [(p.path, p.caption) for p in ordered if p.path is not None],
        content.case.to_dict(),
        version(),
        content.case.content_hash(),
        notes,
    )
    report("pictures", 1.0)
    return notes


def _picture(sheet: Sheet, name: str) -> Picture:
    """Draw the picture of a name."""
    folder = sheet.folder / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    if name == ANIMATION:
        return _animate(sheet.content, folder)
    if name in _rendered(sheet.content):
        return _render(sheet.content, folder, name)
    caption, make = _plan(sheet.content)[name]
    return Picture(style.save_figure(make(), folder / f"{name}.png", dpi=150), caption)


def _plan(content: Folder) -> dict[str, tuple[str, Draw]]:
    """Figures by file name: caption and how to make them."""
    steady, still, outline = content.runs("steady"), content.equilibria, content.outline
    name, first = next(iter(steady.items()))
    planets = content.case.stage.planets
    teeth = content.case.stage.ring.teeth
    angle = float(first["carrier_angle"][first.sizes["time"] // 2])
    window = (angle, angle + TEETH_SHOWN * 2 * np.pi / teeth)
    two = still.isel(position=_nearest(still, [0.0, np.pi / planets]))
    at = two["carrier_angle"].to_numpy()
    orders = content.summary["steady"]["radial_harmonics_um"]
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
            "Displacement of ring tooth node 1",
            lambda: displacements.tooth_node_displacement(steady),
        ),
        "tooth_displacement_map": (
            "x displacement of all tooth nodes",
            lambda: displacements.tooth_displacement_map(first),
        ),
        "ring_tooth_loads": (
            "Load of the ring's tooth pairs against the stiffness split (dashed)",
            lambda: loads.pair_loads(steady, "ring", window=window, split=name),
        ),
        "sun_tooth_loads": (
            "Load of the sun's tooth pairs against the stiffness split (dashed)",
            lambda: loads.pair_loads(steady, "sun", window=window, split=name),
        ),
        "engagement_map": (
            "Engaged ring teeth and their pair stiffness",
            lambda: loads.engagement_map(first),
        ),
        "sun_displacement": (
            "Displacement of the sun",
            lambda: displacements.sun_displacement(steady),
        ),
        "planet_displacement": (
            "Displacement of planet 1",
            lambda: displacements.planet_displacement(steady),
        ),
        "load_sharing": ("Load sharing in steady running", lambda: histories.load_sharing(steady)),
    }
    for depth in content.summary["torque_steps"]:
        drop = {n: thinned(d, MOST_SHOWN) for n, d in content.runs(f"torque_step_{depth}").items()}
        plan[f"torque_step_{depth}"] = (
            f"Torque drop to {depth} N m",
            partial(histories.torque_drop, drop),
        )
        plan[f"torque_step_{depth}_speed"] = (
            f"Carrier speed, torque drop to {depth} N m",
            partial(histories.carrier_speed, drop),
        )
        account = next(iter(drop.values()))
        if "energy_kinetic" in account:
            plan[f"torque_step_{depth}_energy"] = (
                f"Energy account, torque drop to {depth} N m",
                partial(charts.energy_balance, account),
            )
    return plan


def _nearest(still: xr.Dataset, angles: list[float]) -> list[int]:
    values = still["carrier_angle"].to_numpy()
    return [int(np.argmin(np.abs(values - a))) for a in angles]


def _rendered(content: Folder) -> dict[str, str]:
    """Bodies by the names of their 3D renders."""
    return {f"{body}_3d": body for body in content.fields}


def _render(content: Folder, folder: Path, name: str) -> Picture:
    """3D render of a deformed body, or why there is none."""
    from flexgear.views.probe import require_rendering
    from flexgear.views.render import render_deformed

    try:
        require_rendering()
    except FlexgearError as error:
        return Picture(None, f"no 3D renders: {error}")
    body = _rendered(content)[name]
    field = content.fields[body]
    figure = render_deformed(
        field["point"].to_numpy(),
        field["cell"].to_numpy(),
        field["displacement"].to_numpy(),
        title=f"{body.capitalize()}, equilibrium at {field.attrs['input_torque'] / 1e6:g} MN m",
    )
    path = style.save_figure(figure, folder / f"{name}.png", dpi=150)
    return Picture(path, f"Deformed {body}, exaggerated as stated")


def _animate(content: Folder, folder: Path) -> Picture:
    """The star turning with the carrier until planets stand alike, which closes the loop."""
    from flexgear.views.animation import animate_star

    still, period = content.equilibria, content.case.stage.planet_period
    angles = still["carrier_angle"].to_numpy()
    turn = still.isel(position=np.flatnonzero(angles < period - 1e-9))
    path = animate_star(
        turn["tooth_displacement"],
        turn["carrier_angle"].to_numpy(),
        content.outline,
        folder / f"{ANIMATION}.gif",
        dpi=90,
        frames_per_second=12,
    )
    return Picture(path, "The star turns with the carrier")
