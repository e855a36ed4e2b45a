"""Gears as FE bodies: what all have in common, planet, ring.

Nodes, in order: tooth_001.. at the reference circle and mid-face, tied to root or flank. Of a
planet, of which all of a stage are the same body, reduced once: bore on the axis at mid-face. Of a
ring: fit_1.. and spline_1.. on the axis, bolt_01.. on the bolt circles in the bolted faces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flexgear.arrays import Array
from flexgear.model.bodies import Planet
from flexgear.model.member import PlanetBearing
from flexgear.model.names import NodeName
from flexgear.model.ring import End, Ring, RingSupport, ring_supports
from flexgear.structures.bodies import Spring
from flexgear.structures.cache import content_key
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import (
    PlanetFeMeshParameters,
    RingFeMeshParameters,
    planet_fe_mesh,
    ring_fe_mesh,
)
from flexgear.structures.fe_mesh.groups import Groups, planet_groups, ring_groups
from flexgear.structures.fe_mesh.solids import Solid, planet_solid, ring_solid
from flexgear.structures.fe_mesh.tooth_segment import SegmentParameters
from flexgear.structures.reduced import PLACE, Progress, ReducedBody, both_halves, mirrored, silent
from flexgear.structures.sources.fe_body import FeBody, TiedNode

if TYPE_CHECKING:
    from flexgear.structures.estimate import ProbeLoad
    from flexgear.structures.fem.assembly import FeModel


_PROBED_TEETH = 12  # teeth whose flanks the static error estimate loads


@dataclass(frozen=True, eq=False)
class ToothedSource(FeBody):
    """A ring or planet with teeth and an FE mesh; reference_radius: radius of the circle on which
    its tooth nodes lie, m."""

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
        """tooth_001.. at the reference circle and mid-face."""
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
        """Lines on flanks of some teeth, where all flanks are groups of the FE mesh."""
        from flexgear.structures.estimate import tooth_lines

        teeth = self.parameters.teeth
        if not all(f"tooth_flank_{j + 1:03d}" in model.fe_mesh.facets for j in range(teeth)):
            return []
        probed = sorted({k * teeth // _PROBED_TEETH for k in range(_PROBED_TEETH)})
        return tooth_lines(model, probed, self.parameters.face_width, self.parameters.tooth.outward)


BORE = "bore"


@dataclass(frozen=True, eq=False)
class PlanetSource(ToothedSource):
    """A planet. bearing: in its bore."""

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
        """Teeth, then the bore, a seat of the bearing about the axis."""
        return [*self.tooth_nodes, TiedNode(NodeName.parse(BORE), np.zeros(3), "seat", BORE)]

    @property
    def springs(self) -> list[Spring]:
        """Its bearing on a fixed pin."""
        return [Spring(NodeName.parse(BORE), np.asarray(self.bearing.matrix))]


@dataclass(frozen=True, eq=False)
class RingSource(ToothedSource):
    """A ring. half_offset: of the mid-planes of both halves of a double-helical ring from z = 0, m;
    None for a single one; segment: of teeth with shapes along the face, None without such shapes;
    along_face: whether gear meshes distribute load along the face."""

    meshed = staticmethod(ring_fe_mesh)
    as_solid = staticmethod(ring_solid)

    section: Ring
    parameters: RingFeMeshParameters
    half_offset: float | None
    segment: SegmentParameters | None
    along_face: bool

    @property
    def held_by(self) -> list[RingSupport]:
        """Fits, splines and bolts of the meshed part."""
        return ring_supports(self.section, self.parameters.face_width)

    @property
    def springs(self) -> list[Spring]:
        """Springs of its fits, splines and bolts."""
        return [Spring(s.node, np.diag(s.stiffness), s.angle) for s in self.held_by]

    @property
    def whole_springs(self) -> list[Spring]:
        """Supports of the whole ring; those of the right half are the mirror image of those of the
        left."""
        return self.springs if self.half_offset is None else mirrored(self.springs)

    @property
    def groups(self) -> Groups:
        """Teeth for either tie, fits, splines, and the surfaces of bolts."""
        return ring_groups(self.parameters, self.section.tie, self.held_by)

    def nodes(self, fe_mesh: FeMesh | None = None) -> list[TiedNode]:
        """Teeth, then fits, splines and bolts, see `model/ring.py`."""
        tie, nodes = self.section.tie_kind, self.tooth_nodes
        for s in self.held_by:
            place = np.array(s.place)
            if s.end is not None and fe_mesh is not None:
                place[2] = _bolted_face(fe_mesh, s.end)
            of_bolt = tie if s.end is not None and s.group else "averaging"
            nodes.append(TiedNode(s.node, place, of_bolt, s.group, s.diameter, s.angle))
        return nodes

    def reduced(self, progress: Progress = silent, limit_hz: float | None = None) -> ReducedBody:
        """The reduced ring (``FeBody.reduced``), with the flexibility of its rim along the face
        where that counts."""
        body = super().reduced(progress, limit_hz)
        if self.segment is None:
            return body if self.along_face else _loaded_evenly(body)
        # half of the package
        from flexgear.structures.tooth_influence.rim import cached_shapes, with_rim

        b, segment = slice(0, body.interface_dofs), self.segment
        supports = self.supports(body.node_names, body.stiffness[b, b])
        key = content_key(**self.content())
        shapes = cached_shapes(segment, self.parameters.teeth, key, self.condensed)
        always = self.section.tooth_shapes == "always"
        return with_rim(body, shapes, segment, self.material, supports, always=always)

    def whole(self, body: ReducedBody) -> ReducedBody:
        """The body itself, or both halves of a double-helical ring."""
        return body if self.half_offset is None else both_halves(body, self.half_offset)

    def _whole_solid(
        self, solid: Solid, places: dict[NodeName, Array]
    ) -> tuple[Solid, dict[NodeName, Array]]:
        if self.half_offset is None:
            return solid, places
        lift = np.array([0.0, 0.0, self.half_offset])
        left = {n.of_half("left"): place - lift for n, place in places.items()}
        right = {n.of_half("right"): place * PLACE + lift for n, place in places.items()}
        return solid.shifted(-lift) + solid.mirrored().shifted(lift), left | right

    def _content(self) -> Mapping[str, Any]:
        supports = [[s.node, s.group, s.place, s.end, s.diameter] for s in self.held_by]
        return {"supports": supports, **super()._content()}


def _bolted_face(fe_mesh: FeMesh, end: End) -> float:
    """z of an end face, m: the group's, or the body's end where there is no group."""
    name = "end_plus" if end == "+z" else "end_minus"
    points, facets = np.asarray(fe_mesh.points), fe_mesh.facets
    z = points[facets[name] if name in facets else slice(None)][..., 2]
    return float(z.max() if end == "+z" else z.min())


def _loaded_evenly(body: ReducedBody) -> ReducedBody:
    """The body with a report whose static error is that of teeth loaded over the whole face."""
    from flexgear.structures.estimate import judged

    cases = body.report.get("static_error_cases")
    return body.with_(report={**body.report, **judged(cases)}) if cases else body
