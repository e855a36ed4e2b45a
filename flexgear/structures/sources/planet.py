"""A planet as an FE body, which is reduced once for all equal planets of a stage.

Nodes, in order: tooth_001.. (``sources.gears``), bore on the axis at mid-face.
"""

from dataclasses import dataclass

import numpy as np

from flexgear.model.bodies import Planet
from flexgear.model.member import PlanetBearing
from flexgear.model.names import NodeName
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Spring
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import PlanetFeMeshParameters, planet_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups, planet_groups
from flexgear.structures.fe_mesh.solids import planet_solid
from flexgear.structures.sources.fe_body import TiedNode
from flexgear.structures.sources.gears import (
    ToothedSource,
    tooth_parameters,
    toothed_source_parameters,
)

BORE = "bore"


@dataclass(frozen=True, eq=False)
class PlanetSource(ToothedSource):
    """A planet as an FE body; bearing: in its bore."""

    meshed = staticmethod(planet_fe_mesh)
    as_solid = staticmethod(planet_solid)
    turning = BORE

    section: Planet
    parameters: PlanetFeMeshParameters
    bearing: PlanetBearing

    @property
    def groups(self) -> Groups:
        """Teeth for either tie, and the bore."""
        return planet_groups(self.parameters, self.section.tie)

    def nodes(self, fe_mesh: FeMesh | None = None) -> list[TiedNode]:
        """Nodes of teeth, then of the bore, which has a seat tie for the bearing."""
        return [*self.tooth_nodes, TiedNode(NodeName.parse(BORE), np.zeros(3), "seat", BORE)]

    @property
    def springs(self) -> list[Spring]:
        """Its bearing on a fixed pin."""
        return [Spring(NodeName.parse(BORE), np.asarray(self.bearing.matrix))]


def source(view: StageView) -> PlanetSource:
    """Source of the FE body of the planets of a stage, which are equal."""
    gear = view.stage.planet
    assert gear is not None
    return PlanetSource(
        parameters=PlanetFeMeshParameters(
            bore_diameter=gear.bore_diameter, **tooth_parameters(view, gear)
        ),
        bearing=view.stage.planet_bearing,
        **toothed_source_parameters(view, "planet", gear),
    )
