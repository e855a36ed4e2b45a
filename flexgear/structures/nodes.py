"""Where the interface nodes of ring and carrier are.

In order. Ring: tooth_001.. at the reference circle and mid-face, fit_1.. and spline_1.. on the
axis, bolt_01.. on the bolt circles in the bolted faces. Carrier: drive, bearing_drive, bearing_far
on the axis at the middle of their patches, pin_1.. on the pins' axes at mid-face.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.geometry import stage_geometry
from flexgear.model.names import NodeName
from flexgear.model.ring import End
from flexgear.model.ring_supports import ring_supports
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh import CarrierMeshParameters
from flexgear.structures.fe_mesh.fe_mesh import facet_areas

if TYPE_CHECKING:
    from flexgear.structures.fem.elements import FeMeshLike

Array = NDArray[np.float64]
SEATS = ("drive", "bearing_drive", "bearing_far")


def ring_nodes(view: StageView, fe_mesh: FeMeshLike | None = None) -> dict[NodeName, Array]:
    """Place (3,) m of every node of the ring; in end faces of the FE mesh, of the case where there
    is none."""
    radius, teeth = stage_geometry(view).ring.reference_radius, view.ring_gear.teeth
    angles = 2 * np.pi * np.arange(teeth) / teeth
    places = radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    nodes = {NodeName.of("tooth", j, digits=3): place for j, place in enumerate(places, 1)}
    for support in ring_supports(view.ring, view.stage.face_width):
        place = nodes[support.node] = np.array(support.place)
        if support.end is not None and fe_mesh is not None:
            place[2] = _bolted_face(fe_mesh, support.end)
    return nodes


def carrier_nodes(view: StageView, fe_mesh: FeMeshLike | None = None) -> dict[NodeName, Array]:
    """Place (3,) m of every node of the carrier; on the axis at the middle of the FE mesh's
    patches, of the case's where there is none."""
    places = {}
    if fe_mesh is None:
        places = CarrierMeshParameters.from_case(view).seat_heights
    else:
        for name in SEATS:
            corners = np.asarray(fe_mesh.points)[fe_mesh.facets[name]]
            area = facet_areas(np.asarray(fe_mesh.points), fe_mesh.facets[name])
            places[name] = float(area @ corners[..., 2].mean(axis=1) / area.sum())
    nodes = {NodeName.parse(name): np.array([0.0, 0.0, z]) for name, z in places.items()}
    radius = stage_geometry(view).center_distance
    for i, angle in enumerate(view.stage.planet_angles):
        nodes[NodeName.of("pin", i + 1)] = radius * np.array([np.cos(angle), np.sin(angle), 0.0])
    return nodes


def _bolted_face(fe_mesh: FeMeshLike, end: End) -> float:
    """z of an end face, m: the group's, or the body's end where there is none."""
    name = "end_plus" if end == "+z" else "end_minus"
    points, facets = np.asarray(fe_mesh.points), fe_mesh.facets
    z = points[facets[name] if name in facets else slice(None)][..., 2]
    return float(z.max() if end == "+z" else z.min())
