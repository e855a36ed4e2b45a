"""A ring: teeth inside, held by fits, splines and bolts; of a double-helical stage both halves.

Nodes, in order: tooth_001.. at the reference circle and mid-face, fit_1.. and spline_1.. on the
axis, bolt_01.. on the bolt circles in the bolted faces.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexgear.model.names import NodeName
from flexgear.model.ring import End, Ring
from flexgear.model.ring_supports import RingSupport, ring_supports
from flexgear.structures.fe_mesh import (
    FeMesh,
    Groups,
    RingMeshParameters,
    SegmentParameters,
    ring_fe_mesh,
    ring_groups,
)
from flexgear.structures.fe_mesh.body_solids import ring_solid
from flexgear.structures.halves import PLACE, both_halves, mirrored
from flexgear.structures.progress import Progress, silent
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.solids import Solid
from flexgear.structures.sources.source import TiedNode
from flexgear.structures.sources.toothed import ToothedSource
from flexgear.structures.springs import Spring, stiffness_at
from flexgear.structures.store import content_key

if TYPE_CHECKING:
    from flexgear.structures.fem.elements import FeMeshLike

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RingSource(ToothedSource):
    """half_offset: of the mid-planes of both halves of a double-helical ring from z = 0, m; None of
    a single one; segment: of teeth that may yield along the face beside their nodes, None where
    they take no shapes; along_face: whether gear meshes distribute load along the face."""

    section: Ring
    mesh: RingMeshParameters
    half_offset: float | None
    segment: SegmentParameters | None
    along_face: bool

    @property
    def held_by(self) -> list[RingSupport]:
        """Fits, splines and bolts of what is meshed."""
        return ring_supports(self.section, self.mesh.face_width)

    @property
    def springs(self) -> list[Spring]:
        """All that holds the whole ring; supports of the right half are the mirror image of those
        of the left."""
        springs = [Spring(s.node, np.diag(s.stiffness), s.angle) for s in self.held_by]
        return springs if self.half_offset is None else mirrored(springs)

    @property
    def groups(self) -> Groups:
        """Teeth for either tie, fits, splines, and what holds the bolts."""
        return ring_groups(self.mesh, self.section.tie, self.held_by)

    def nodes(self, fe_mesh: FeMeshLike | None = None) -> list[TiedNode]:
        """Teeth, then fits, splines and bolts, see `model/ring_supports.py`."""
        tie, nodes = self.section.tie_kind, self.tooth_nodes
        for s in self.held_by:
            place = np.array(s.place)
            if s.end is not None and fe_mesh is not None:
                place[2] = _bolted_face(fe_mesh, s.end)
            of_bolt = tie if s.end is not None and s.group else "averaging"
            nodes.append(TiedNode(s.node, place, of_bolt, s.group, s.diameter, s.angle))
        return nodes

    def supports(self, node_names: tuple[str, ...], stiffness: Array) -> Array:
        """Its springs to ground, of a double-helical ring those of its left half."""
        springs = [Spring(s.node, np.diag(s.stiffness), s.angle) for s in self.held_by]
        return stiffness_at(springs, node_names)

    def solid(self) -> Solid:
        """Of one half, if double-helical."""
        return ring_solid(self.mesh)

    def reduced(self, progress: Progress = silent, limit_hz: float | None = None) -> ReducedBody:
        """As of every body, and how its rim bends along the face where that counts."""
        # half of the package
        from flexgear.structures.tooth_influence.rim import TeethOfRing, with_rim

        b = (body := super().reduced(progress, limit_hz)).interface_dofs
        supports = self.supports(body.node_names, body.stiffness[:b, :b])
        key = content_key(**self.content()) if self.segment else ""
        always = self.section.tooth_shapes == "always"
        teeth = TeethOfRing(self.mesh.teeth, self.material, self.segment, always, self.along_face)
        return with_rim(body, teeth, supports, key, self.condensed)

    def whole(self, body: ReducedBody) -> ReducedBody:
        """Itself, or both halves."""
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

    def _generated(self) -> FeMesh:
        return ring_fe_mesh(self.mesh)

    def _content(self) -> Mapping[str, Any]:
        return {
            "ties": [self.section.tie, self.section.tie_kind],
            "supports": [[s.node, s.group, s.place, s.end, s.diameter] for s in self.held_by],
            "teeth": [self.mesh.teeth, self.reference_radius],
        }


def _bolted_face(fe_mesh: FeMeshLike, end: End) -> float:
    """z of an end face, m: the group's, or the body's end where there is none."""
    name = "end_plus" if end == "+z" else "end_minus"
    points, facets = np.asarray(fe_mesh.points), fe_mesh.facets
    z = points[facets[name] if name in facets else slice(None)][..., 2]
    return float(z.max() if end == "+z" else z.min())
