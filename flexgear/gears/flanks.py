"""Modified flanks of a stage: which flank of a gear meets which, and the gaps of its pairs.

A gear with one gear mesh has a drive flank, which carries the rated torque, and a coast flank. A
planet's flanks have the names of the mates that they meet under the rated torque, "sun" and "ring";
under a torque of the other sense each meets the other mate. A flank is ground once: its active
profile is the path of contact with the mate of its name, whichever it meets.

In a double-helical stage the left half (−z) is the mirror image of the right one: z of a
modification counts from the middle of a half towards its outer end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.contact import GearMeshKind, GearMeshPath
from flexgear.gears.geometry import PER_PAIR_MODELS
from flexgear.gears.modifications import Flank, Gap, gaps_of
from flexgear.gears.profile_contact import FlankPair
from flexgear.model.section import Refusal

if TYPE_CHECKING:
    from flexgear.model.stage_view import StageView

_OTHER = {"sun": "ring", "ring": "sun"}


@dataclass(frozen=True)
class GearFlank:
    """One flank of a gear as it is ground.

    part: the gear as the stage calls it; name: of the flank; gaps: what it lacks, one function a
    modification, none where it is an involute.
    """

    part: str
    name: str
    flank: Flank
    gaps: tuple[Gap, ...]

    def surface(self, points: int) -> tuple[Array, Array, Array]:
        """ρ from the root end to the tip, z from −z to +z (points,), and the gap there (points,
        points), m."""
        rho = np.linspace(self.flank.root, self.flank.tip, points)
        z = self.flank.half_face * np.linspace(-1.0, 1.0, points)
        return rho, z, self.gap(rho[:, None], z)

    def gap(self, rho: Array, z: Array) -> Array:
        """What it lacks at ρ and z (any shapes that broadcast), m, in the transverse section."""
        total = np.zeros(np.broadcast_shapes(np.shape(rho), np.shape(z)))
        for missing in self.gaps:
            total += missing(rho, z)
        return total


def flank_name(part: str, path: GearMeshPath) -> str:
    """Name of the flank of ``part`` that a gear mesh uses."""
    if part == "planet":
        return path.kind.gear if path.carries else _OTHER[path.kind.gear]
    return "drive" if path.carries else "coast"


def tooth_sides(kind: str, forward: bool) -> dict[tuple[str, str], int]:
    """Side of its tooth that each (part, flank) is on: +1 towards +θ about +z, −1 the other.

    A gear mesh loads the side that its torque on the gear turns away from. kind: of the stage;
    forward: whether the carrier drives its stage towards +z under the rated torque (the gear its
    pinion), or is driven towards −z: forces of gear meshes ≥ 0 (``stage_flow``).
    """
    sense = 1 if forward else -1
    if kind == "parallel":  # pinion and gear turn each other's way back
        parts, side = ("pinion", "gear"), sense
    else:
        parts, side = ("sun", "ring"), -sense
    out = {(part, "drive"): side for part in parts} | {(part, "coast"): -side for part in parts}
    return (
        out if kind == "parallel" else out | {("planet", "sun"): -sense, ("planet", "ring"): sense}
    )


def gear_flanks(view: StageView, paths: Mapping[GearMeshKind, GearMeshPath]) -> list[GearFlank]:
    """Both flanks of every gear; paths: by kind, of a stage or of a half. InputError for
    modifications that leave a flank."""
    out = []
    for kind in [kind for kind in paths if not kind.coast]:
        parts = (view.part("planet"), view.part(kind.gear))
        for part, flank in zip(parts, _active(paths[kind], kind.gear), strict=True):
            names = (kind.gear,) if part == "planet" else ("drive", "coast")
            out += [GearFlank(part, name, flank, _gaps(view, part, name, flank)) for name in names]
    return out


def modified_flanks(
    view: StageView, paths: Mapping[tuple[GearMeshKind, str], GearMeshPath]
) -> list[GearFlank]:
    """Flanks that are no involutes, of the right half if there are two; paths: by kind and side
    (``stage_paths``)."""
    side = "right" if view.stage.double_helical else ""
    half = {kind: path for (kind, of), path in paths.items() if of == side}
    return [flank for flank in gear_flanks(view, half) if flank.gaps]


def flank_pairs(
    view: StageView, paths: Mapping[GearMeshKind, GearMeshPath], mirrored: bool
) -> dict[GearMeshKind, FlankPair | None]:
    """Flanks that meet in every kind of gear mesh, None where both are involutes.

    mirrored: whether the half is the mirror image of what the case
    says. Raises InputError where the model of the gear mesh follows no pair along its path.
    """
    flanks = {(flank.part, flank.name): flank for flank in gear_flanks(view, paths)}
    out: dict[GearMeshKind, FlankPair | None] = {}
    for kind, path in paths.items():
        planet, gear = (
            flanks[part, flank_name(part, path)]
            for part in (view.part("planet"), view.part(kind.gear))
        )
        out[kind] = _of_pair(path, planet, gear, mirrored) if planet.gaps or gear.gaps else None
    if view.gear_mesh.model not in PER_PAIR_MODELS and any(out.values()):
        raise view.refuse(
            "gear_mesh.model",
            f"{view.gear_mesh.model!r} follows no pair along its path, so modified flanks have no "
            "place",
            'use "per_pair", "face_load" or "lumped", or take the modifications out',
        )
    return out


def _of_pair(path: GearMeshPath, planet: GearFlank, gear: GearFlank, mirrored: bool) -> FlankPair:
    sign = -1.0 if mirrored else 1.0
    return FlankPair(
        lambda rho, z: planet.gap(rho, sign * z),
        lambda rho, z: gear.gap(rho, sign * z),
        path.off_path,
    )


def _active(path: GearMeshPath, role: str) -> tuple[Flank, Flank]:
    """Flanks of the planet and of its mate over the path of contact."""
    reach = path.center_distance * math.sin(path.alpha)
    ends = [s + reach if role == "ring" else reach - s for s in (path.s_lo, path.s_hi)]
    return (
        Flank(path.s_hi, path.s_lo, path.half_face, path.base_radius_planet),
        Flank(ends[0], ends[1], path.half_face, path.base_radius_gear),
    )


def _gaps(view: StageView, part: str, name: str, flank: Flank) -> tuple[Gap, ...]:
    modifications = getattr(view.stage, part).modifications
    try:
        return tuple(gaps_of(modifications.of(name), flank))
    except Refusal as r:
        key = f"{part}.modifications.{modifications.key(name, r.key)}"
        raise view.refuse(key, r.problem, r.remedy) from None
