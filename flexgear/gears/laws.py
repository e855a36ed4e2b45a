"""Which single-pair stiffness law a case asks for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flexgear.gears.geometry import StageGeometry
from flexgear.gears.stiffness import Law, iso_single_stiffness, parabola, table_law

if TYPE_CHECKING:
    from flexgear.model.case import Case


def iso_peak(case: Case, gear: str) -> float:
    """ISO 6336-1 peak of the planet against "ring" or "sun", N/m² along the 3D normal."""
    stage = case.stage
    other = getattr(stage, gear)
    return iso_single_stiffness(
        teeth=(stage.planet.teeth, other.teeth),
        internal=gear == "ring",
        shifts=(stage.planet.profile_shift, 0.0 if gear == "ring" else other.profile_shift),
        dedendum=stage.planet.dedendum,
        pressure_angle=stage.pressure_angle,
        helix_angle=stage.helix_angle,
        young_modulus=case.material.young_modulus,
    )


def pair_law(case: Case, geometry: StageGeometry, gear: str) -> Law:
    """k'(ξ) of the gear mesh of the planet with "ring" or "sun", N/m²."""
    options = case.gear_mesh
    if options.pair_stiffness == "table":
        table = getattr(options.table, gear)
        return table_law(np.asarray(table.position), np.asarray(table.stiffness))
    return parabola(iso_peak(case, gear), options.end_ratio)
