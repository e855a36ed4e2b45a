"""Motions beside what the linear frame takes them to be small against.

Paths of contact, pressure angles and which teeth touch are those of gears in their places. A member
that moves by u changes a centre distance by up to u, and the play between flanks by up to
2 u sin α cos β_b. So u is compared with a tenth of the module, with the room between tips and roots
and, where contact is linear and so has no coast flanks, with j/(2 sin α cos β_b) of the backlash j:
the case's, or the least recommended one. Teeth of an FE ring count as a member; planets are
compared with the module alone, as tooth forces move them along their circle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from flexgear.gears.backlash import least_backlash
from flexgear.gears.geometry import bottom_clearance, stage_geometry
from flexgear.model.case import Case
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.results.report.wording import with_unit, words
from flexgear.results.time_figures import axis_distance

SMALL = 0.1  # of the module: paths of contact are then a twentieth off
CONSEQUENCE = (
    "Paths of contact, pressure angles and which teeth touch are those of gears in their places; "
    "stiffen what holds them, or take figures as a rough guide."
)


def motion_histories(data: xr.Dataset) -> xr.Dataset:
    """axis_distance of bodies and, of FE rings, tooth_distance of teeth from their places, m."""
    histories = xr.Dataset({"axis_distance": axis_distance(data)})
    if "tooth_displacement" in data:
        x, y = (data["tooth_displacement"].sel(axis=k, drop=True) for k in "xy")
        histories["tooth_distance"] = np.hypot(x, y)
    return histories


def largest_motions(histories: xr.Dataset) -> dict[str, float]:
    """The largest of ``motion_histories``, or of their largest values, by body, m; of FE rings that
    of their teeth, too, as "stage.ring teeth"."""
    far = histories["axis_distance"]
    most = far.max([d for d in far.dims if d != "body"])
    motions = dict(zip(map(str, most["body"].to_numpy()), most.to_numpy().tolist(), strict=True))
    if "tooth_distance" in histories:
        stages = histories["tooth_stage"].to_numpy()
        for stage in dict.fromkeys(stages.tolist()):
            teeth = histories["tooth_distance"].isel(tooth=stages == stage)
            motions[f"{stage}.ring teeth"] = float(teeth.max())
    return motions


def motions_of_summary(summary: Mapping[str, Any]) -> dict[str, float]:
    """The same of a run by its summary; of runs before 0.3 those of central members in time."""
    motions_um = summary.get("motion_um_max", summary["transient"]["displacement_um_max"])
    return {name: 1e-6 * size for name, size in motions_um.items()}


@dataclass(frozen=True)
class MotionShare:
    """Motion of a body, m, beside the largest that is small, m, and what that is a part of."""

    body: str
    size: float
    beside: str
    limit: float


def motion_shares(case: Case, motions: Mapping[str, float]) -> dict[str, list[MotionShare]]:
    """By stage the motions of its bodies, m, beside everything that they are to be small against;
    of bodies of a kind, as planets, the largest stands for all."""
    by_stage: dict[str, list[MotionShare]] = {}
    for stage in case.stages:
        limits = small_against(case.view(stage.name))
        bodies: dict[str, tuple[float, str]] = {}
        for name, size in motions.items():
            at = BodyName.parse(name)
            if at.stage == stage.name:
                bodies[at.part] = max((size, name), bodies.get(at.part, (0.0, "")))
        shares = [
            MotionShare(name, size, beside, limit)
            for kind, (size, name) in sorted(bodies.items(), key=lambda item: -item[1][0])
            for beside, limit in limits.items()
            if name and (kind != "planet" or beside == next(iter(limits)))
        ]
        if shares:
            by_stage[stage.name] = shares
    return by_stage


def large_motions(case: Case, motions: Mapping[str, float]) -> list[str]:
    """A line for each stage in which motions of bodies, m, are not small."""
    lines = []
    for shares in motion_shares(case, motions).values():
        large = [s for s in shares if s.size > s.limit]
        if large:
            beside = " and ".join(dict.fromkeys(s.beside for s in large))
            bodies = ", ".join(
                dict.fromkeys(f"{words(s.body)} by {with_unit(s.size, 'm')}" for s in large)
            )
            lines.append(f"Motion that is not small beside {beside}: {bodies}. {CONSEQUENCE}")
    return lines


def small_against(view: StageView) -> dict[str, float]:
    """By what a motion is compared with, in words, the module first, the largest that is small, m;
    of all gear meshes the least."""
    g, module = stage_geometry(view), view.stage.normal_module
    limits = {f"the module of {with_unit(module, 'm')}": SMALL * module}
    if not g.overridden:
        room = min(
            min(bottom_clearance(g.gears[role], g.planet, g.center_distance))
            for role in g.gear_meshes
        )
        limits[f"the room of {with_unit(room, 'm')} between tips and roots"] = room
    if view.gear_mesh.contact_law == "linear":
        closed = []
        for gear_mesh in g.gear_meshes.values():
            play = gear_mesh.backlash or least_backlash(g.center_distance, module)
            rate = 2.0 * math.sin(gear_mesh.working_angle) * math.cos(g.base_helix_angle)
            closed.append((play / rate, play))
        most, play = min(closed)
        limits[f"the backlash of {with_unit(play, 'm')}, which linear contact has not"] = most
    return limits
