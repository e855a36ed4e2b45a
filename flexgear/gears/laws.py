"""Which single-pair stiffness law a case asks for."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flexgear.gears.geometry import ExternalPair, StageGeometry
from flexgear.gears.kinematics import stage_kinematics
from flexgear.gears.stiffness import Law, iso_single_stiffness, parabola, table_law
from flexgear.gears.weber_banaschek import PairCompliance, pair_compliance

if TYPE_CHECKING:
    from flexgear.model.flexible_stage import FlexibleStage
    from flexgear.model.stage import Stage


def iso_peak(case: FlexibleStage, gear: str) -> float:
    """ISO 6336-1 peak of the planet against "ring" or "sun", N/m² along the 3D normal."""
    return iso_pair_peak(case.stage, gear, case.material.young_modulus)


def iso_pair_peak(stage: Stage | ExternalPair, gear: str, young_modulus: float) -> float:
    """The same of a stage, or of a pair of external gears ("sun"); young_modulus Pa."""
    other = getattr(stage, gear)
    # index 1 of ISO is the pinion, the smaller of two external gears
    first, second = stage.planet, other
    if gear != "ring" and other.teeth < stage.planet.teeth:
        first, second = other, stage.planet
    return iso_single_stiffness(
        teeth=(first.teeth, second.teeth),
        internal=gear == "ring",
        shifts=(first.profile_shift, 0.0 if gear == "ring" else second.profile_shift),
        dedendum=0.5 * (first.dedendum + second.dedendum),
        pressure_angle=stage.pressure_angle,
        helix_angle=stage.helix_angle,
        young_modulus=young_modulus,
    )


def compliance(case: FlexibleStage, geometry: StageGeometry, gear: str) -> PairCompliance:
    """Weber–Banaschek split of the planet with "ring" or "sun" at the rated line load."""
    material = case.material
    return pair_compliance(
        geometry.planet,
        geometry.ring if gear == "ring" else geometry.sun,
        geometry.ring_mesh if gear == "ring" else geometry.sun_mesh,
        young=material.young_modulus,
        poisson=material.poisson_ratio,
        line_load=rated_line_load(case, geometry, gear),
    )


def rated_line_load(case: FlexibleStage, geometry: StageGeometry, gear: str) -> float:
    """w = F cosβ_b/(ε_α b), N/m: the rated gear-mesh force over the mean length of contact."""
    motion = stage_kinematics(case)
    gear_mesh = geometry.ring_mesh if gear == "ring" else geometry.sun_mesh
    force = motion.ring_mesh_force if gear == "ring" else motion.sun_mesh_force
    length = gear_mesh.transverse_contact_ratio * case.stage.face_width
    return force * math.cos(geometry.base_helix_angle) / length


def pair_law(case: FlexibleStage, geometry: StageGeometry, gear: str) -> Law:
    """k'(ξ) of the gear mesh of the planet with "ring" or "sun", N/m² along the 3D normal.

    What the ring's FE mesh holds is not counted again. With the tie "flank" that is the ring's
    tooth and its foundation: their Weber–Banaschek share is taken out of every law. With the tie
    "root" it is the foundation (the rim below the tooth), which is taken out of the law
    "weber-banaschek"; ISO's c' and tables stay as they are.
    """
    options, flank = case.gear_mesh, gear == "ring" and case.ring.tie == "flank"
    if options.pair_stiffness == "weber-banaschek":
        part = compliance(case, geometry, gear)
        left = part.total
        if gear == "ring":
            left = left - part.gear.foundation - (part.gear.bending if flank else 0.0)
        return table_law(part.xi, 1.0 / (left * math.cos(geometry.base_helix_angle) ** 2))
    if options.pair_stiffness == "table":
        assert options.table is not None  # the model refuses a table law without tables
        table = getattr(options.table, gear)
        law = table_law(np.asarray(table.position), np.asarray(table.stiffness))
    else:
        law = parabola(iso_peak(case, gear), options.end_ratio)
    if not flank:
        return law
    part = compliance(case, geometry, gear)
    return table_law(part.xi, law(part.xi) / (1.0 - part.gear_share))
