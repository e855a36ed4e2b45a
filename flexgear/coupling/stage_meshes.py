"""Gear meshes of one stage, whatever its members are."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.gear_meshes import GearMeshSet, model_number
from flexgear.coupling.members import body_names, can_turn, mass_properties
from flexgear.coupling.system import StageFrame
from flexgear.gears.errors import stage_errors
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.laws import line_load
from flexgear.gears.paths import stage_paths
from flexgear.gears.radii import stage_radii
from flexgear.gears.slices import Nominal, bent
from flexgear.gears.stage_flow import StageFlow
from flexgear.model.case import Case
from flexgear.model.member import GearMember
from flexgear.model.stage_view import StageView
from flexgear.structures.tooth_shapes import RimFlexibility

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class GearBlock:
    """Contact block of a gear, or of its first tooth where each tooth is one: then their positions
    (z, 3) m, and the block of the rigid motion beside which they have elastic displacements."""

    first: int
    teeth: Array | None = None
    rigid: int | None = None


@dataclass(frozen=True)
class GearBlocks:
    """Contact blocks of a stage's gears by part, planet (−1: none) and side, "" for both sides."""

    blocks: Mapping[tuple[str, int, str], GearBlock]

    def of(self, part: str, side: str, planet: int = -1) -> GearBlock:
        """That of a gear, of one of the planets, on a side."""
        return self.blocks.get((part, planet, side)) or self.blocks[part, planet, ""]


def stage_sets(
    case: Case,
    number: int,
    flow: StageFlow,
    frame: StageFrame,
    blocks: GearBlocks,
    bending: bool = True,
    rim: RimFlexibility | None = None,
    rigid: Collection[str] = (),
) -> list[GearMeshSet]:
    """Gear meshes of stage ``number`` of a train; bending: slices bend each other where the case
    says so, by influences from the cache or made (half a minute each); rim: what the teeth of its
    ring yield besides; rigid: FE members whose teeth have all their compliance in the gear mesh,
    as those of lumped ones.

    With the linear law only the flank that carries the rated torque is there. Pair damping takes
    the equivalent mass on the line of action, 1/m = r_bp²/J_p + r_b²/J, without the second term
    where the gear is held.
    """
    stage, out = case.stages[number], []
    options, view = stage.gear_mesh, case.view(stage.name)
    view = view.with_rigid(rigid)
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
        gear = blocks.of(part, side)
        numbers = range(stage.planets) if second == "planet" else [-1]
        planets = [blocks.of(second, side, i) for i in numbers]
        floating = [p for p in planets if p.rigid is not None]
        out.append(
            GearMeshSet(
                path=path,
                errors=errors[kind, side],
                stage=number,
                angle=frame.theta,
                carrier_angle=frame.carrier,
                phi=np.asarray(stage.planet_angles, dtype=float),
                planet_blocks=[p.first if p.rigid is None else p.rigid for p in planets],
                gear_block=gear.first,
                tooth_positions=gear.teeth,
                turns=-1 if gear.teeth is None else frame.theta,
                carries=path.carries,
                one_sided=options.contact_law != "linear",
                equivalent_mass=1.0 / inverse,
                damping_ratio=options.damping_ratio,
                model=model_number(options.model),
                planet_teeth=[p.first for p in floating],
                planet_tooth_positions=[p.teeth for p in floating if p.teeth is not None],
                planet_turns=frame.planets if floating else -1,
            )
        )
    return out


def bend_each_other(view: StageView) -> bool:
    """Whether the slices of a stage's tooth pairs do, by FE influences."""
    options = view.gear_mesh
    return options.model == "face_load" and options.tooth_compliance == "fe"


def blocks_anywhere(case: Case, number: int) -> GearBlocks:
    """Blocks of a stage of which only the gear meshes' own properties are asked."""
    stage, blocks = case.stages[number], dict[tuple[str, int, str], GearBlock]()
    for part in (*stage.members, "planet"):
        fe = part != "planet" and stage.form(part) == "fe"
        member = stage.member(part) if fe else None
        teeth = np.zeros((member.teeth, 3)) if isinstance(member, GearMember) else None
        for name in body_names(stage, part):
            blocks[part, name.planet, name.side] = GearBlock(0, teeth)
    return GearBlocks(blocks)
