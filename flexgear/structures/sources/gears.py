"""Teeth of gears as FE bodies, which ring and planet have in common.

Nodes tooth_001.. come first, at the reference circle and mid-face, tied to root or flank.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgear.gears.tool import plain_tool
from flexgear.gears.tooth import reference_radius
from flexgear.model.bodies import Planet
from flexgear.model.member import Gear
from flexgear.model.names import NodeName
from flexgear.model.ring import Ring
from flexgear.model.stage_view import StageView
from flexgear.structures.cache import content_key
from flexgear.structures.fe_mesh.gears import PlanetFeMeshParameters, RingFeMeshParameters
from flexgear.structures.fe_mesh.tooth_segment import SegmentParameters
from flexgear.structures.reduced import Progress, ReducedBody, silent
from flexgear.structures.sources.fe_body import FeBody, TiedNode
from flexgear.structures.sources.of_case import common_parameters

if TYPE_CHECKING:
    from flexgear.structures.estimate import ProbeLoad
    from flexgear.structures.fem.assembly import FeModel


_PROBED_TEETH = 12  # teeth whose flanks the static error estimate loads


@dataclass(frozen=True, eq=False)
class ToothedSource(FeBody):
    """A ring or planet as an FE body. reference_radius: of the circle of its tooth nodes, m;
    segment: of its teeth, None without shapes along the face; along_face: whether gear meshes
    distribute load along the face."""

    section: Ring | Planet
    parameters: RingFeMeshParameters | PlanetFeMeshParameters
    reference_radius: float
    segment: SegmentParameters | None
    along_face: bool

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

    def reduced(self, progress: Progress = silent, limit_hz: float | None = None) -> ReducedBody:
        """The reduced gear (``FeBody.reduced``), with the flexibility of its rim along the face
        where that is not negligible."""
        body = super().reduced(progress, limit_hz)
        # lazy: they import half of the package
        from flexgear.structures.estimate import largest_tooth_error
        from flexgear.structures.tooth_influence.rim import cached_shapes, with_rim

        if self.segment is None:
            cases = body.report.get("static_error_cases")
            if self.along_face or not cases:
                return body
            return body.with_(report={**body.report, **largest_tooth_error(cases)})

        b, segment = slice(0, body.interface_dofs), self.segment
        supports = self.supports(body.node_names, body.stiffness[b, b])
        key = content_key(**self.content())
        shapes = cached_shapes(segment, self.parameters.teeth, key, self.condensed)
        always = self.section.tooth_shapes == "always"
        return with_rim(body, shapes, segment, self.material, supports, always=always)

    def probe_loads(self, model: FeModel) -> Sequence[ProbeLoad]:
        """Line loads on the flanks of some teeth; none where the FE mesh lacks flanks as groups."""
        from flexgear.structures.estimate import tooth_lines

        teeth = self.parameters.teeth
        if not all(f"tooth_flank_{j + 1:03d}" in model.fe_mesh.facets for j in range(teeth)):
            return []
        probed = sorted({k * teeth // _PROBED_TEETH for k in range(_PROBED_TEETH)})
        return tooth_lines(model, probed, self.parameters.face_width, self.parameters.tooth.outward)


def toothed_source_parameters(view: StageView, part: str, gear: Gear) -> dict[str, Any]:
    """Parameters of the source of a gear, "ring" or "planet", without FE mesh and supports."""
    common, gear_mesh = common_parameters(view, part), view.gear_mesh
    section, segment = common["section"], None
    fe_influence = gear_mesh.model == "face_load" and gear_mesh.tooth_compliance == "fe"
    root_ties = view.fe_tie(part) == "root" and section.tie_kind == "averaging"
    shaped = section.tooth_shapes != "none" and section.fe_mesh != "reduced"
    if fe_influence and root_ties and shaped:
        # lazy: it imports half of the package
        from flexgear.structures.tooth_influence.of_case import influence_parameters

        segment = influence_parameters(view, part)
    return {
        "reference_radius": reference_radius(gear.teeth, view.stage),
        "segment": segment,
        "along_face": gear_mesh.model == "face_load",
        **common,
    }


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
