"""Teeth of gears as FE bodies, which ring and planet have in common.

Nodes tooth_001.. come first, at the reference circle and mid-face, tied to root or flank.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgear.gears.tool import plain_tool
from flexgear.model.bodies import Planet
from flexgear.model.member import Gear
from flexgear.model.names import NodeName
from flexgear.model.ring import Ring
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.gears import PlanetFeMeshParameters, RingFeMeshParameters
from flexgear.structures.sources.fe_body import FeBody, TiedNode

if TYPE_CHECKING:
    from flexgear.structures.estimate import ProbeLoad
    from flexgear.structures.fem.assembly import FeModel


_PROBED_TEETH = 12  # teeth whose flanks the static error estimate loads


@dataclass(frozen=True, eq=False)
class ToothedSource(FeBody):
    """A ring or planet as an FE body; reference_radius: of the circle of its tooth nodes, m."""

    section: Ring | Planet
    parameters: RingFeMeshParameters | PlanetFeMeshParameters
    reference_radius: float

    @property
    def repeats(self) -> int:
        """Number of its teeth."""
        return self.parameters.teeth

    @property
    def ties(self) -> tuple[str, str]:
        """Tied surface and kind of tie, as stated in the case."""
        return self.section.tie, self.section.tie_kind

    @property
    def tooth_nodes(self) -> list[TiedNode]:
        """Nodes tooth_001.. at the reference circle and mid-face."""
        radius, teeth, tie = self.reference_radius, self.parameters.teeth, self.section.tie_kind
        angles = 2 * np.pi * np.arange(teeth) / teeth
        places = radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
        return [
            TiedNode(
                NodeName.of("tooth", j, digits=3), place, tie, f"tooth_{self.section.tie}_{j:03d}"
            )
            for j, place in enumerate(places, 1)
        ]

    def _content(self) -> Mapping[str, Any]:
        return {
            "ties": [self.section.tie, self.section.tie_kind],
            "teeth": [self.parameters.teeth, self.reference_radius],
        }

    def probe_loads(self, model: FeModel) -> Sequence[ProbeLoad]:
        """Line loads on the flanks of some teeth; none where the FE mesh lacks flanks as groups."""
        from flexgear.structures.estimate import tooth_lines

        teeth = self.parameters.teeth
        if not all(f"tooth_flank_{j + 1:03d}" in model.fe_mesh.facets for j in range(teeth)):
            return []
        probed = sorted({k * teeth // _PROBED_TEETH for k in range(_PROBED_TEETH)})
        return tooth_lines(model, probed, self.parameters.face_width, self.parameters.tooth.outward)


def tooth_parameters(view: StageView, gear: Gear) -> dict[str, Any]:
    """Parameters of the FE mesh that ring and planets have in common."""
    stage = view.stage
    return {
        "teeth": gear.teeth,
        "normal_module": stage.normal_module,
        "pressure_angle": stage.pressure_angle,
        "helix_angle": stage.helix_angle,
        "hand": stage.planet_hand,
        "profile_shift": gear.profile_shift,
        "addendum": gear.addendum,
        "dedendum": gear.dedendum,
        "root_fillet": gear.root_fillet,
        "tool": plain_tool(gear.tool),
        "face_width": stage.face_width,
        "fidelity": view.case.solver.fidelity,
        "where": view.case.source,
    }
