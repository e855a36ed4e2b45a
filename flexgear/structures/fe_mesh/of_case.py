"""The FE meshes a case asks for: generated, or the user's own file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flexgear.structures.fe_mesh.carrier import CarrierMeshParameters, carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import read_fe_mesh
from flexgear.structures.fe_mesh.ring import RingMeshParameters, ring_fe_mesh

if TYPE_CHECKING:
    from flexgear.model.case import Case


def ring_of_case(case: Case) -> FeMesh:
    """Ring gear as [ring] says; patches as in ring.py."""
    p = RingMeshParameters.from_case(case)
    if case.ring.fe_mesh == "generate":
        return ring_fe_mesh(p)
    return read_fe_mesh(
        Path(str(case.ring.fe_mesh_file)),
        case.ring.fe_mesh_unit,
        ring_patches(case),
        2.0 * p.outer_radius,
        f"{case.source}: ring.fe_mesh_file",
    )


def carrier_of_case(case: Case) -> FeMesh:
    """Carrier as [carrier] says; patches as in carrier.py."""
    if case.carrier.fe_mesh == "generate":
        return carrier_fe_mesh(CarrierMeshParameters.from_case(case))
    return read_fe_mesh(
        Path(str(case.carrier.fe_mesh_file)),
        case.carrier.fe_mesh_unit,
        carrier_patches(case),
        case.carrier.plate_diameter,
        f"{case.source}: carrier.fe_mesh_file",
    )


def ring_patches(case: Case) -> list[str]:
    """Names a user's ring mesh must have: teeth for the chosen tie, fits, and what holds bolts.

    Solid bolts act on discs of the bolted end face, end_minus or end_plus.
    """
    kind = "root" if case.ring.tie == "root" else "flank"
    names = [f"tooth_{kind}_{j:03d}" for j in range(1, case.stage.ring.teeth + 1)]
    names += [f"fit_{k}" for k in range(1, len(case.ring.fits) + 1)]
    bolts = case.ring.bolts
    if bolts.holes:
        return names + [f"bolt_{k:02d}" for k in range(1, bolts.number + 1)]
    return names + (["end_plus" if case.ring.end == "+z" else "end_minus"] if bolts.number else [])


def carrier_patches(case: Case) -> list[str]:
    """Names a user's carrier mesh must have."""
    pins = [f"pin_{i}" for i in range(1, case.stage.planets + 1)]
    return ["drive", "bearing_drive", "bearing_far", *pins]
