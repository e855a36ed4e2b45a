"""Gear meshes of one stage, whatever its members are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.gear_meshes import GearMeshSet, model_number
from flexgear.coupling.members import can_turn, mass_properties
from flexgear.coupling.system import StageFrame
from flexgear.coupling.tooth_bending import with_bending
from flexgear.gears.errors import stage_errors
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.laws import line_load
from flexgear.gears.paths import stage_paths
from flexgear.gears.radii import stage_radii
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.case import Case
from flexgear.model.stage_view import StageView
from flexgear.structures.tooth_influence import ToothInfluence, tooth_influence

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GearBlocks:
    """Contact blocks of a stage's gears.

    planets: (N,), the gear's of a parallel stage; gears: of sun, pinion and ring by part and side,
    of the first tooth where each tooth of the ring is a block; teeth: then their positions (z, 3)
    m, else None.
    """

    planets: Sequence[int]
    gears: Mapping[tuple[str, str], int]
    teeth: Array | None = None


def stage_sets(
    train: Case,
    number: int,
    flow: StageFlow,
    frame: StageFrame,
    blocks: GearBlocks,
    teeth: Mapping[str, ToothInfluence | None] | None = None,
) -> list[GearMeshSet]:
    """Gear meshes of stage ``number`` of a train; teeth: influence of those of "sun", "planet" and
    "ring" where slices bend each other.

    With the linear law only the flank that carries the rated torque is there. Pair damping takes
    the equivalent mass on the line of action, 1/m = r_bp²/J_p + r_b²/J, without the second term
    where the gear is held.
    """
    stage, out = train.stages[number], []
    options, view = stage.gear_mesh, train.view(stage.name)
    paths, radii = stage_paths(view, flow.gear_mesh_forces), stage_radii(view)
    errors = stage_errors(view, paths)
    driven_forward = (flow.planet_torque if stage.kind == "parallel" else -flow.sun_torque) >= 0
    first, second = ("pinion", "gear") if stage.kind == "parallel" else ("sun", "planet")
    for (kind, side), path in paths.items():
        front = kind.endswith("_back") != driven_forward
        if not front and options.contact_law == "linear":
            continue
        part = "ring" if kind.startswith("ring") else first
        inverse = path.base_radius_planet**2 / mass_properties(view, second, radii)[1]
        if can_turn(train, stage, part):
            inverse += path.base_radius_gear**2 / mass_properties(view, part, radii)[1]
        if teeth is not None:
            slot = kind.removesuffix("_back")
            both = {"planet": teeth["planet"], "gear": teeth[slot]}
            load = line_load(view, stage_geometry(view), slot, flow.gear_mesh_forces[slot])
            path = with_bending(path, both, view.material, load)
        positions = blocks.teeth if part == "ring" else None
        out.append(
            GearMeshSet(
                path=path,
                errors=errors[kind, side],
                stage=number,
                angle=frame.theta,
                carrier_angle=frame.carrier,
                phi=np.asarray(stage.planet_angles, dtype=float),
                planet_blocks=blocks.planets,
                gear_block=blocks.gears[part, side if part == "ring" else ""],
                tooth_positions=positions,
                turns=-1 if positions is None else frame.theta,
                front=front,
                one_sided=options.contact_law != "linear",
                equivalent_mass=1.0 / inverse,
                damping_ratio=options.damping_ratio,
                model=model_number(options.model),
            )
        )
    return out


def tooth_influences(
    view: StageView, progress: Callable[[str, float], None] | None = None
) -> dict[str, ToothInfluence | None] | None:
    """Influence of the teeth of a stage by "planet", "sun", "ring", from the cache or made (half a
    minute each); None where its slices do not bend each other."""
    options = view.gear_mesh
    if options.model != "face_load" or options.tooth_compliance != "fe":
        return None
    found = {}
    for slot in ("planet", *stage_geometry(view).gear_meshes):
        if progress is not None:
            progress(f"{slot}: influence of a tooth", 0.0)
        found[slot] = tooth_influence(view, slot)
        if progress is not None:
            progress(f"{slot}: influence of a tooth", 1.0)
    return found


def blocks_anywhere(train: Case, number: int) -> GearBlocks:
    """Blocks of a stage of which only the gear meshes' own properties are asked."""
    stage = train.stages[number]
    fe_ring = stage.form("ring") == "fe"
    teeth = np.zeros((stage.ring.teeth, 3)) if fe_ring and stage.ring is not None else None
    gears = [(p, s) for p in ("sun", "pinion", "ring") for s in ("", "left", "right")]
    return GearBlocks([0] * len(stage.planet_angles), dict.fromkeys(gears, 0), teeth)
