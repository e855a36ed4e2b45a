"""A body with teeth: a node a tooth, tied to its root or flank, and the loads that judge it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.model.names import NodeName
from flexgear.model.planet import Planet
from flexgear.model.ring import Ring
from flexgear.structures.fe_mesh import PlanetMeshParameters, RingMeshParameters
from flexgear.structures.sources.fe_body import FeBody
from flexgear.structures.sources.source import TiedNode

if TYPE_CHECKING:
    from flexgear.structures.fem import FeModel
    from flexgear.structures.probe_loads import ProbeLoad

Array = NDArray[np.float64]
_PROBED_TEETH = 12  # teeth whose flanks the static error estimate loads


@dataclass(frozen=True, eq=False)
class ToothedSource(FeBody):
    """reference_radius: where tooth nodes stand, m."""

    section: Ring | Planet
    mesh: RingMeshParameters | PlanetMeshParameters
    reference_radius: float

    @property
    def repeats(self) -> int:
        """Its teeth."""
        return self.mesh.teeth

    @property
    def ties(self) -> tuple[str, str]:
        """As the case has them."""
        return self.section.tie, self.section.tie_kind

    @property
    def tooth_nodes(self) -> list[TiedNode]:
        """tooth_001.. at the reference circle and mid-face."""
        radius, teeth, tie = self.reference_radius, self.mesh.teeth, self.section.tie_kind
        angles = 2 * np.pi * np.arange(teeth) / teeth
        places = radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
        return [
            TiedNode(
                NodeName.of("tooth", j, digits=3), place, tie, f"tooth_{self.section.tie}_{j:03d}"
            )
            for j, place in enumerate(places, 1)
        ]

    def probe_loads(self, model: FeModel) -> Sequence[ProbeLoad]:
        """Lines on flanks of some teeth, where all flanks are groups of the FE mesh."""
        from flexgear.structures.probe_loads import tooth_lines

        teeth = self.mesh.teeth
        if not all(f"tooth_flank_{j + 1:03d}" in model.fe_mesh.facets for j in range(teeth)):
            return []
        probed = sorted({k * teeth // _PROBED_TEETH for k in range(_PROBED_TEETH)})
        return tooth_lines(model, probed, self.mesh.face_width, self.mesh.tooth.outward)
