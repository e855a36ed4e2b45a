"""Planet with its teeth as hexahedra: teeth outside, rim inwards down to the bore, helix.

Frame, helix and patches of teeth and ends: ``toothed``. f = 1: the rim is a body of revolution.
``bore`` is the wall of the bore.
"""

from __future__ import annotations

from dataclasses import dataclass

from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.toothed import (
    DIVISIONS,
    GROWTH,
    ToothedMeshParameters,
    extruded,
    layer_positions,
)
from flexgear.structures.fe_mesh.toothed_section import toothed_section


@dataclass(frozen=True)
class PlanetMeshParameters(ToothedMeshParameters):
    """Everything the planet's FE mesh depends on; m and rad. Defaults are those of a planet of the
    default ring."""

    part = "planet"

    teeth: int = 33
    dedendum: float = 1.4
    root_fillet: float = 0.39
    bore_diameter: float = 0.42

    @property
    def size(self) -> float:
        """Largest dimension, m."""
        return 2.0 * self.tooth.tip_radius

    @property
    def bore_radius(self) -> float:
        """m."""
        return self.bore_diameter / 2.0

    def check(self) -> None:
        """Raise InputError, naming the key and the remedy, if no planet can be made."""
        super().check()
        rim = self.tooth.root_radius - self.bore_radius
        if self.bore_diameter <= 0.0:
            problem = "is missing: an FE planet is carried at its bore"
            self.reject("bore_diameter_mm", problem, "give the diameter of the bearing's seat")
        if rim < self.normal_module:
            problem = f"leaves a rim of {rim * 1e3:.2f} mm below the teeth, less than one module"
            self.reject("bore_diameter_mm", problem, "lower it")


def planet_fe_mesh(p: PlanetMeshParameters) -> FeMesh:
    """Hexahedra of the planet with its teeth and the patches listed in the module's head."""
    p.check()
    section = toothed_section(p.tooth, p.bore_radius, DIVISIONS[p.fidelity][0], GROWTH[p.fidelity])
    z = layer_positions(p.face_width, (), p.least_layers)
    return extruded(section, p.helix_rate, z, [("bore", section.rim, None)])
