"""A planet: teeth outside, carried by its bearing in the bore. All planets of a stage are the same
body, reduced once.

Nodes, in order: tooth_001.. at the reference circle and mid-face, bore on the axis at mid-face.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexgear.model.member import PlanetBearing
from flexgear.model.names import NodeName
from flexgear.model.planet import Planet
from flexgear.structures.fe_mesh import (
    FeMesh,
    Groups,
    PlanetMeshParameters,
    planet_fe_mesh,
    planet_groups,
)
from flexgear.structures.fe_mesh.body_solids import planet_solid
from flexgear.structures.solids import Solid
from flexgear.structures.sources.source import TiedNode
from flexgear.structures.sources.toothed import ToothedSource
from flexgear.structures.springs import Spring, stiffness_at

if TYPE_CHECKING:
    from flexgear.structures.fem.elements import FeMeshLike

Array = NDArray[np.float64]
BORE = "bore"


@dataclass(frozen=True, eq=False)
class PlanetSource(ToothedSource):
    """bearing: in its bore."""

    section: Planet
    mesh: PlanetMeshParameters
    bearing: PlanetBearing

    @property
    def groups(self) -> Groups:
        """Teeth for either tie, and the bore."""
        return planet_groups(self.mesh, self.section.tie)

    def nodes(self, fe_mesh: FeMeshLike | None = None) -> list[TiedNode]:
        """Teeth, then the bore, a seat of the bearing about the axis."""
        return [*self.tooth_nodes, TiedNode(NodeName.parse(BORE), np.zeros(3), "seat", BORE)]

    def supports(self, node_names: tuple[str, ...], stiffness: Array) -> Array:
        """Its bearing on a pin that stands still, and its bore held against rotation."""
        spring = Spring(NodeName.parse(BORE), np.asarray(self.bearing.matrix))
        supports = stiffness_at([spring], node_names)
        held = 6 * node_names.index(BORE) + 5
        supports[held, held] += 1e3 * stiffness[held, held]
        return supports

    def solid(self) -> Solid:
        """About its centre."""
        return planet_solid(self.mesh)

    def _generated(self) -> FeMesh:
        return planet_fe_mesh(self.mesh)

    def _content(self) -> Mapping[str, Any]:
        return {
            "ties": [self.section.tie, self.section.tie_kind],
            "teeth": [self.mesh.teeth, self.reference_radius],
        }
