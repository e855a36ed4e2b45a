"""Gear meshes of one stage, whatever its members are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.gear_meshes import GearMeshSet, model_number
from flexgear.coupling.members import can_turn, mass_properties
from flexgear.coupling.system import StageFrame
from flexgear.gears.errors import stage_errors
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.laws import line_load
from flexgear.gears.paths import stage_paths
from flexgear.gears.radii import stage_radii
from flexgear.gears.slices import Nominal, bent
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.case import Case
from flexgear.model.stage_view import StageView
from flexgear.structures.tooth_shapes import RimFlexibility

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GearBlocks:
    """Contact blocks of a stage's gears.

    planets: (N,), the gear's of a parallel stage; gears: of sun, pinion and ring by part and side,
    of the first tooth where each tooth of the ring is a block; teeth: then their positions (z, 3)
    m by side.
    """

    planets: Sequence[int]
    gears: Mapping[tuple[str, str], int]
    teeth: Mapping[str, Array] = field(default_factory=dict)


def stage_sets(
    case: Case,
    number: int,
    flow: StageFlow,
    frame: StageFrame,
    blocks: GearBlocks,
    bending: bool = True,
    rim: RimFlexibility | None = None,
    rigid_ring: bool = False,
) -> list[GearMeshSet]:
    """Gear meshes of stage ``number`` of a train; bending: slices bend each other where the case
    says so, by influences from the cache or made (half a minute each); rim: what the teeth of its
    ring yield besides; rigid_ring: of an FE ring, whose teeth then have all their compliance in the
    gear mesh, as those of a lumped ring.

    With the linear law only the flank that carries the rated torque is there. Pair damping takes
    the equivalent mass on the line of action, 1/m = r_bp²/J_p + r_b²/J, without the second term
    where the gear is held.
    """
    stage, out = case.stages[number], []
    options, view = stage.gear_mesh, case.view(stage.name)
    view = view.with_rigid_ring() if rigid_ring else view
    paths, radii = stage_paths(view, flow.gear_mesh_forces), stage_radii(view)
    errors = stage_errors(view, paths)
    first, second = ("pinion", "gear") if stage.kind == "parallel" else ("sun", "planet")
    for (kind, side), path in paths.items():
        if not path.carries and options.contact_law == "linear":
            continue
        part = "ring" if kind.internal else first
        inverse = path.base_radius_planet**2 / mass_properties(view, second, radii)[1]
        if can_turn(case, stage, part):
            inverse += path.base_radius_gear**2 / mass_properties(view, part, radii)[1]
        if bending and bend_each_other(view):
            # half of the package, for cases that ask for it alone
            from flexgear.structures.tooth_influence import pair_bending, rim_bending

            assert path.slices is not None
            force = flow.gear_mesh_forces[kind.gear]
            load = line_load(view, stage_geometry(view), kind.gear, force)
            compliance = pair_bending(view, path, path.slices, force)
            if rim is not None and kind.internal:
                compliance = compliance.with_rim(*rim_bending(rim, path, path.slices))
            nominal = Nominal(load / path.cos_base_helix, path.base_pitch)
            contact = (compliance.scale, compliance.limit)
            lines = bent(path.slices, compliance.flexibility, compliance.beside, contact, nominal)
            path = replace(path, slices=lines)
        positions = blocks.teeth.get(side) if part == "ring" else None
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
                carries=path.carries,
                one_sided=options.contact_law != "linear",
                equivalent_mass=1.0 / inverse,
                damping_ratio=options.damping_ratio,
                model=model_number(options.model),
            )
        )
    return out


def bend_each_other(view: StageView) -> bool:
    """Whether the slices of a stage's tooth pairs do, by FE influences."""
    options = view.gear_mesh
    return options.model == "face_load" and options.tooth_compliance == "fe"


def blocks_anywhere(case: Case, number: int) -> GearBlocks:
    """Blocks of a stage of which only the gear meshes' own properties are asked."""
    stage = case.stages[number]
    fe_ring = stage.form("ring") == "fe"
    sides, teeth = ("", "left", "right"), {}
    if fe_ring and stage.ring is not None:
        teeth = {side: np.zeros((stage.ring.teeth, 3)) for side in sides}
    gears = [(p, s) for p in ("sun", "pinion", "ring") for s in sides]
    return GearBlocks([0] * len(stage.planet_angles), dict.fromkeys(gears, 0), teeth)
