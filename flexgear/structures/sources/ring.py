"""A ring as an FE body, held at its fits, splines and bolts.

Nodes, in order: tooth_001.. (``sources.gears``), fit_1.. and spline_1.. on the axis, bolt_01.. on
the bolt circles in the bolted faces.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexgear.arrays import Array
from flexgear.model.names import NodeName
from flexgear.model.ring import Ring, RingSupport, ring_supports
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Spring
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import BLOCK, DIVISIONS, RingFeMeshParameters, ring_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups, ring_groups
from flexgear.structures.fe_mesh.solids import Solid, ring_solid
from flexgear.structures.reduced import PLACE, ReducedBody, both_halves, mirrored
from flexgear.structures.sources.fe_body import TiedNode
from flexgear.structures.sources.gears import (
    ToothedSource,
    tooth_parameters,
    toothed_source_parameters,
)


@dataclass(frozen=True, eq=False)
class RingSource(ToothedSource):
    """A ring as an FE body. half_offset: distance of the mid-planes of a double-helical ring's
    halves from z = 0, m, None for a single ring."""

    meshed = staticmethod(ring_fe_mesh)
    as_solid = staticmethod(ring_solid)

    section: Ring
    parameters: RingFeMeshParameters
    half_offset: float | None

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
        """Springs of the whole ring; in the right half mirror images of those in the left."""
        return self.springs if self.half_offset is None else mirrored(self.springs)

    @property
    def groups(self) -> Groups:
        """Teeth for either tie, fits, splines, and the surfaces of bolts."""
        return ring_groups(self.parameters, self.section.tie, self.held_by)

    def nodes(self, fe_mesh: FeMesh | None = None) -> list[TiedNode]:
        """Nodes of teeth, then of fits, splines and bolts, see `model/ring.py`."""
        tie, nodes = self.section.tie_kind, self.tooth_nodes
        for s in self.held_by:
            place = np.array(s.place)
            if s.end is not None and fe_mesh is not None:
                # of the end's group, or of the body's end where there is no group
                name = "end_plus" if s.end == "+z" else "end_minus"
                points, facets = np.asarray(fe_mesh.points), fe_mesh.facets
                z = points[facets[name] if name in facets else slice(None)][..., 2]
                place[2] = float(z.max() if s.end == "+z" else z.min())
            support_tie = tie if s.end is not None and s.group else "averaging"
            nodes.append(TiedNode(s.node, place, support_tie, s.group, s.diameter, s.angle))
        return nodes

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
        content = {"supports": supports, **super()._content()}
        if self.parameters.divisions != DIVISIONS[self.parameters.fidelity][0]:
            content["divisions"] = self.parameters.divisions
        return content


def source(view: StageView) -> RingSource:
    """Source of the FE ring of a stage."""
    return RingSource(
        parameters=_ring_fe_mesh(view),
        half_offset=view.stage.half_offset if view.stage.double_helical else None,
        **toothed_source_parameters(view, "ring", view.ring_gear),
    )


def _ring_fe_mesh(view: StageView) -> RingFeMeshParameters:
    """Parameters of the FE mesh of a case's ring, with its teeth and supports.

    Of several bolt circles the FE mesh has the one with holes, else the innermost.
    """
    ring = view.ring
    circles = sorted(
        (c for c in ring.bolt_circles if c.number),
        key=lambda c: (not c.holes, c.circle_diameter - BLOCK * c.diameter),
    )
    bolts: dict[str, Any] = {"bolts": 0}
    if circles:
        bolts = {
            "bolts": circles[0].number,
            "bolt_circle_diameter": circles[0].circle_diameter,
            "bolt_diameter": circles[0].diameter,
            "bolt_holes": circles[0].holes,
            "first_bolt_angle": circles[0].first_angle,
            "first_bolt": ring.first_bolt(circles[0]),
        }
    return RingFeMeshParameters(
        rim_thickness=ring.rim_thickness,
        fits=tuple(fit.band for fit in ring.fits),
        splines=tuple(spline.band for spline in ring.splines),
        other_bolts=tuple((c.number, c.circle_diameter, c.diameter) for c in circles[1:]),
        **bolts,
        **tooth_parameters(view, view.ring_gear),
    )
