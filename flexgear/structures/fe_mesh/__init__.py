"""FE meshes of rings, planets and carriers with named patches; only here are gmsh and meshio."""

from flexgear.structures.fe_mesh.carrier import CarrierMeshParameters
from flexgear.structures.fe_mesh.carrier_mesh import carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import (
    fe_mesh_case,
    read_fe_mesh,
    require_format,
    write_fe_mesh,
)
from flexgear.structures.fe_mesh.gears import (
    PlanetMeshParameters,
    RingMeshParameters,
    planet_fe_mesh,
    ring_fe_mesh,
)
from flexgear.structures.fe_mesh.groups import Groups, carrier_groups, planet_groups, ring_groups
from flexgear.structures.fe_mesh.placement import mesh_of_file
from flexgear.structures.fe_mesh.tooth_segment import (
    SegmentDivisions,
    SegmentParameters,
    ToothSegment,
    tooth_segment,
)

__all__ = [
    "CarrierMeshParameters",
    "FeMesh",
    "Groups",
    "PlanetMeshParameters",
    "RingMeshParameters",
    "SegmentDivisions",
    "SegmentParameters",
    "ToothSegment",
    "carrier_fe_mesh",
    "carrier_groups",
    "fe_mesh_case",
    "mesh_of_file",
    "planet_fe_mesh",
    "planet_groups",
    "read_fe_mesh",
    "require_format",
    "ring_fe_mesh",
    "ring_groups",
    "tooth_segment",
    "write_fe_mesh",
]
