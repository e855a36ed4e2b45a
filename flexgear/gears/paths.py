"""Paths of contact of one stage of a train, by kind of gear mesh and side.

Planetary stages have the paths of ``contact``; halves of a double-helical stage have those of a
helical stage each, the left one (−z) with ``planet_hand`` and the right one with the other hand, in
phase at their mid-planes. Both flanks are given always. Which carries, follows from the torque: the
front one where the carrier is driven for θ̇ > 0 (or drives for θ̇ < 0), the back one otherwise.

Parallel stage: the pinion is the sun and the gear the planet of one gear mesh "sun", θ is the
rotation of the gear, and its axes are x from the pinion's axis to the gear's. The front flank
carries where the gear drives the pinion for θ̇ > 0, as the planet drives the sun of a planetary
stage, but the gear turns the other way: its force is n = (sin α, cos α), which turns it backwards,
T_p = r_b (−cos α, sin α), and the pair goes from the gear's root to its tip, ds/dθ = +r_b,gear. All
of that is the back flank of a sun gear mesh, under the name of what it does. At θ = 0 pinion tooth
0 and gear tooth 0 touch at the pitch point.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.contact import (
    ASSEMBLY_TOLERANCE,
    GearMeshPath,
    assembly_mismatch,
    gear_mesh_path,
    gear_mesh_paths,
    planetary_paths,
)
from flexgear.gears.messages import stage_key
from flexgear.gears.train_geometry import PER_PAIR_MODELS, TrainGeometry, train_geometry
from flexgear.gears.train_laws import mean_stiffness, train_pair_law
from flexgear.gears.waves import stiffness_wave
from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.train_stage import TrainStage

PathKey = tuple[str, str]
OTHER_HAND = {"right": "left", "left": "right"}


def stage_paths(train: Case, stage: TrainStage) -> dict[PathKey, GearMeshPath]:
    """Paths by (kind, side): kind "ring", "sun", "ring_back", "sun_back"; side "", or "left" and
    "right" halves. A parallel stage has "sun" and "sun_back" only.

    Raises InputError, with the stage named, for gears that cannot mesh and planets that do not
    assemble.
    """
    if stage.flexible is not None:
        return {(kind, ""): path for kind, path in gear_mesh_paths(stage.flexible).items()}
    g = train_geometry(stage, train.source)
    if stage.kind == "planetary":
        _require_assembly(train, stage, g)
    if not stage.double_helical:
        return {(kind, ""): path for kind, path in _half_paths(train, stage, g).items()}
    offset = 0.5 * (stage.half_gap + stage.face_width)
    halves = {
        "left": (stage.planet_hand, -offset),
        "right": (OTHER_HAND[stage.planet_hand], offset),
    }
    paths = {}
    for side, (hand, z) in halves.items():
        half = stage.model_copy(update={"planet_hand": hand})
        for kind, path in _half_paths(train, half, g).items():
            paths[kind, side] = replace(path, side=side, z_offset=z)
    return paths


def assembly_misfit(stage: TrainStage, g: TrainGeometry) -> float:
    """How far a planet's sun tooth is at most from where planet 1 puts it, in sun pitches."""
    return float(np.abs(assembly_mismatch(g.planetary, np.asarray(stage.planet_angles))).max())


def _require_assembly(train: Case, stage: TrainStage, g: TrainGeometry) -> None:
    if stage.allow_unassemblable or assembly_misfit(stage, g) <= ASSEMBLY_TOLERANCE:
        return
    raise InputError(
        train.source,
        stage_key(stage, "planets"),
        f"the planets do not assemble: (z_s + z_r)/N = {g.assembly:.4g}",
        "choose tooth numbers with (z_s + z_r)/N whole, or planet_positions that assemble, "
        "or set allow_unassemblable = true",
    )


def _half_paths(train: Case, stage: TrainStage, g: TrainGeometry) -> dict[str, GearMeshPath]:
    """Paths of a stage with one helix, or of one half."""
    if stage.kind == "parallel":
        paths = _parallel_paths(train, stage, g)
    else:
        paths = planetary_paths(
            g.planetary, stage.stage, lambda slot: train_pair_law(train, stage, g, slot)
        )
    out = {}
    for kind, path in paths.items():
        slot = kind.removesuffix("_back")
        arms = {"base_radius_planet": g.radii.planet, "base_radius_gear": getattr(g.radii, slot)}
        out[kind] = replace(path, **arms, wave=_wave(train, stage, g, slot))
    return out


def _wave(
    train: Case, stage: TrainStage, g: TrainGeometry, slot: str
) -> NDArray[np.float64] | None:
    if stage.gear_mesh.model in PER_PAIR_MODELS:
        return None
    gear_mesh = g.gear_meshes[slot]
    return stiffness_wave(
        stage.gear_mesh.model,
        mean_stiffness(train, stage, g, slot),
        gear_mesh.transverse_contact_ratio,
        gear_mesh.overlap_ratio,
        stage.gear_mesh.harmonics,
    )


def _parallel_paths(train: Case, stage: TrainStage, g: TrainGeometry) -> dict[str, GearMeshPath]:
    """Front and back path of pinion and gear."""
    pinion, gear, gear_mesh = g.gears["sun"], g.gears["planet"], g.gear_meshes["sun"]
    law, zero = train_pair_law(train, stage, g, "sun"), np.zeros(1, np.int64)
    pitch_point = gear.base_radius * math.tan(gear_mesh.working_angle)
    back, gear_tooth, pinion_tooth = _back_of_parallel(g, pitch_point)
    starts = {
        "sun": (np.array([pitch_point]), zero, zero),
        "sun_back": (np.array([back]), zero + pinion_tooth, zero + gear_tooth),
    }
    hand = 1.0 if stage.planet_hand == "right" else -1.0
    return {
        kind: gear_mesh_path(
            kind,
            start,
            gear=pinion,
            planet=gear,
            gear_mesh=gear_mesh,
            center_distance=g.radii.center_distance,
            rolling_radius=-gear.base_radius,  # a gear turns by +θ, a planet by −(r_b,ring/r_b) θ
            tan_base_helix=hand * math.tan(g.radii.base_helix_angle),
            half_face=stage.face_width / 2,
            mirrored=kind == "sun",
            law=law,
        )
        for kind, start in starts.items()
    }


def _back_of_parallel(g: TrainGeometry, front: float) -> tuple[float, int, int]:
    """Back flanks when tooth 0 of both gears touches at s = front: s of the pair that is nearest to
    ``front``, and its teeth of gear and pinion.

    From ``contact``: s = r_b,gear (π + α + Δ − γ) with the half angle Δ at the base circle and the
    place γ of the gear's tooth; on the front flank, mirrored, −γ. So s_front + s_back of one tooth
    of the gear is 2 r_b,gear (π + α + Δ). Likewise for the pinion with σ = α + Δ − ρ/r_b,pinion.
    """
    pinion, gear, gear_mesh = g.gears["sun"], g.gears["planet"], g.gear_meshes["sun"]
    angle, pitch = gear_mesh.working_angle, gear_mesh.base_pitch
    same_tooth = 2 * gear.base_radius * (math.pi + angle + gear.base_half_angle) - front
    steps = round((same_tooth - front) / pitch)
    back = same_tooth - steps * pitch
    reach = (pinion.base_radius + gear.base_radius) * math.tan(angle)
    turned = 2 * (angle + pinion.base_half_angle) - (2 * reach - front - back) / pinion.base_radius
    return back, steps, round(turned * pinion.teeth / (2 * math.pi))
