"""From a case and its bodies to one ``System``."""

from __future__ import annotations

import numpy as np

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.determinacy import holding_rows, rolling_motions
from flexgear.coupling.gear_meshes import labels, pair_data
from flexgear.coupling.stage_parts import (
    Stiffening,
    pin_rotation,
    stage_components,
    stage_nodes,
    stage_sets,
    tie_stage,
)
from flexgear.coupling.system import (
    Brake,
    Damping,
    Port,
    System,
    Variant,
    orthonormal_rigid,
    without_rigid_forces,
)
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.kinematics import rated_flow
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.structures.reduced import ReducedBody


def build_system(
    case: FlexibleStage,
    ring: ReducedBody,
    carrier: ReducedBody,
    variant: Variant | None = None,
    stiffening: Stiffening | None = None,
) -> System:
    """Couple all bodies of a case; ``variant`` says which components bend.

    ring, carrier: reduced bodies (also used, as rigid bodies with the same mass, by rigid
    variants). Raises InputError where a support would hold the rotation.
    """
    variant = variant or Variant(case.ring.flexible, case.carrier.flexible, case.shaft.flexible)
    geometry = stage_geometry(case.view())
    motion = rated_flow(case)
    bodies = stage_components(case, geometry, ring, carrier, variant, stiffening)
    a = Assembly(bodies, case.source)
    tie_stage(a, case)
    if a.has("housing"):
        a.link("housing_mount", a.rows("housing", "housing"), np.diag(case.housing.stiffness))
    drive = a.rows("carrier", "drive")[5]
    a.add_inertia(drive, case.inertia.drive)
    radius, n = geometry.center_distance, case.stage.planets
    orbit, spins = a.rotation("carrier"), []
    for i in range(n):
        orbit[a.starts[f"planet_{i + 1}"] + 1] = radius
        spins.append(a.rotation(f"planet_{i + 1}"))
    turning = a.rotation("shaft") + a.rotation("output")
    z_s, z_p, z_r = (getattr(case.stage, g).teeth for g in ("sun", "planet", "ring"))
    rolling = orbit - (z_r - z_p) / z_p * sum(spins) + (z_s + z_r) / z_s * turning
    loose, known = a.loose_motions(), np.column_stack([orbit, *spins, turning])
    # more where the sun floats without spring; those known in closed form have no round-off
    rigid = orthonormal_rigid(a.mass, known if loose.shape == known.shape else loose)
    pin_angle = pin_rotation(a, case, radius)
    blocks, teeth = stage_nodes(a, case)
    sets = stage_sets(case, case.view(), motion, tooth_positions=teeth)
    extra = a.extra_rows(len(blocks))
    blocks += a.contact_nodes
    pairs = pair_data(sets, len(blocks), extra)
    contact = holding_rows(pairs, np.vstack(blocks), 1, a.bearing_rows())
    rolling_motions(a.bodies, case.source, rigid, contact, pin_angle[None])  # nothing else is free
    d = case.damping
    modal = d.kind == "modal"
    output_torque = case.brake.rated_torque or -motion.sun_torque
    return System(
        variant=variant,
        bodies=tuple(bodies),
        mass=a.mass,
        stiffness=without_rigid_forces(a.stiffness, a.mass, rigid),
        rigid=rigid,
        rolling=rolling[:, None],
        masters=pin_angle[None],
        angles=pin_angle[None],
        blocks=np.vstack(blocks),
        ports=(
            Port("carrier", drive, case.drive.rated_torque),
            Port("output", a.rows("output", "output")[5], -output_torque, reaction=True),
        ),
        pairs=pairs,
        gear_meshes=labels(sets),
        links=tuple(a.links),
        bearings=tuple(a.bearings),
        turning=tuple(a.turning),
        damping=Damping(
            d.ratio if modal else 0.0, 0.0 if modal else d.alpha, 0.0 if modal else d.beta
        ),
        brake=Brake(output_torque, motion.sun_speed, case.brake.exponent),
        rated_torque=case.drive.rated_torque,
        rated_speed=case.drive.rated_speed,
        master_speeds=(case.drive.rated_speed,),
        planets=n,
        header={
            "drive_inertia_kg_m2": case.inertia.drive,
            "output_inertia_kg_m2": case.inertia.output,
            "brake_exponent": case.brake.exponent,
        },
    )
