"""The FE meshes a case asks for: generated, or the user's own file in the place the case needs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flexgear.structures.fe_mesh.carrier import CarrierMeshParameters, carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import read_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups, carrier_groups, ring_groups
from flexgear.structures.fe_mesh.placement import Placement, check_place, placed
from flexgear.structures.fe_mesh.ring import RingMeshParameters, ring_fe_mesh

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.fe_mesh_source import FeMeshSource


def ring_of_case(case: Case) -> FeMesh:
    """Ring gear as [ring] says; patches as in ring.py."""
    p = RingMeshParameters.from_case(case)
    if case.ring.fe_mesh == "generate":
        return ring_fe_mesh(p)
    return _own(case, case.ring, ring_groups(case), 2.0 * p.outer_radius)


def carrier_of_case(case: Case) -> FeMesh:
    """Carrier as [carrier] says; patches as in carrier.py."""
    if case.carrier.fe_mesh == "generate":
        return carrier_fe_mesh(CarrierMeshParameters.from_case(case))
    return _own(case, case.carrier, carrier_groups(case), case.carrier.plate_diameter)


def _own(case: Case, source: FeMeshSource, groups: Groups, size: float) -> FeMesh:
    """The user's file, moved as the case says; InputError unless its groups are in their place."""
    path = Path(str(source.fe_mesh_file))
    read = read_fe_mesh(
        path,
        source.fe_mesh_unit,
        groups.needed,
        size,
        f"{case.source}: {groups.body}.fe_mesh_file",
        tuple(f.stem for f in groups.families if f.numbered),
    )
    placement = Placement(source.fe_mesh_shift, source.fe_mesh_turn)
    fe_mesh = placed(read, placement)
    check_place(fe_mesh, groups, placement, str(path))
    return fe_mesh
