"""Ring and carrier of a case as bodies of the coupled system: reduced, or rigid by their sizes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Body, rigid_variant
from flexgear.structures.fe_mesh import (
    CarrierMeshParameters,
    FeMesh,
    RingMeshParameters,
    carrier_of_case,
    ring_of_case,
)
from flexgear.structures.fe_mesh.body_solids import carrier_solid, mesh_solid, ring_solid
from flexgear.structures.given import given_carrier, given_ring
from flexgear.structures.halves import PLACE, whole_ring
from flexgear.structures.kinematics import rigid_rows
from flexgear.structures.nodes import carrier_nodes, ring_nodes
from flexgear.structures.reduced import ReducedBody

Array = NDArray[np.float64]


def elastic_part(reduced: ReducedBody) -> Body:
    """A reduced body: its node dofs come first."""
    nodes = 6 * len(reduced.node_names)
    return Body(
        name=BodyName.of("", reduced.name),
        node_names=tuple(reduced.node_names),
        positions=np.asarray(reduced.positions),
        mass=reduced.mass,
        stiffness=reduced.stiffness,
        node_map=np.eye(nodes, reduced.mass.shape[0]),
    )


def rigid_part(view: StageView, part: str, from_files: bool = True) -> Body:
    """The "ring" (both halves of a double-helical one) or "carrier" of a stage, rigid.

    Coordinates are the rigid motion of the frame's origin. A generated body is that of the case's
    sizes, one with a file of FE mesh or matrices that of the file; with from_files = False the
    case's sizes are taken for these, too, and no file is read.
    """
    source = view.ring.fe_mesh if part == "ring" else view.carrier.fe_mesh
    if from_files and source == "reduced":
        whole_body = whole_ring(view, given_ring(view)) if part == "ring" else given_carrier(view)
        return rigid_variant(elastic_part(whole_body))
    fe_mesh: FeMesh | None = None
    if from_files and source == "file":
        fe_mesh = ring_of_case(view) if part == "ring" else carrier_of_case(view)
    if part == "ring":
        nodes = ring_nodes(view, fe_mesh)
        solid = ring_solid(RingMeshParameters.from_case(view))
    else:
        nodes = carrier_nodes(view, fe_mesh)
        solid = carrier_solid(CarrierMeshParameters.from_case(view))
    solid = solid if fe_mesh is None else mesh_solid(fe_mesh)
    if part == "ring" and view.stage.double_helical:
        lift = np.array([0.0, 0.0, view.stage.half_offset])
        solid = solid.shifted(-lift) + solid.mirrored().shifted(lift)
        left = {n.of_half("left"): place - lift for n, place in nodes.items()}
        nodes = left | {n.of_half("right"): place * PLACE + lift for n, place in nodes.items()}
    positions = np.array(list(nodes.values()))
    return Body(
        name=BodyName.of("", part),
        node_names=tuple(nodes),
        positions=positions,
        mass=solid.rigid_mass(view.material.density),
        stiffness=np.zeros((6, 6)),
        node_map=rigid_rows(positions),
        rigid=True,
    )
