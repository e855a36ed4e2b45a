"""The FE meshes a case asks for: generated, or the user's own file in the place the case needs."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.carrier import CarrierMeshParameters, carrier_fe_mesh
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import read_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups, carrier_groups, ring_groups
from flexgear.structures.fe_mesh.placement import Placement, check_place, placed
from flexgear.structures.fe_mesh.ring import RingMeshParameters, ring_fe_mesh

if TYPE_CHECKING:
    from flexgear.model.fe_mesh_source import FeMeshSource
    from flexgear.model.stage_view import StageView


def require_generated(view: StageView, part: str) -> None:
    """InputError for what the FE mesh of "ring" or "carrier" would be refused for, which is not
    generated."""
    generator = RingMeshParameters if part == "ring" else CarrierMeshParameters
    generator.from_case(view).check()


def ring_of_case(view: StageView) -> FeMesh:
    """Ring gear as [stage.ring.fe] says; patches as in ring.py."""
    p = RingMeshParameters.from_case(view)
    if view.ring.fe_mesh == "generate":
        return ring_fe_mesh(p)
    return _own(view, view.ring, ring_groups(view), 2.0 * p.outer_radius)


def carrier_of_case(view: StageView) -> FeMesh:
    """Carrier as [stage.carrier.fe] says; patches as in carrier.py."""
    if view.carrier.fe_mesh == "generate":
        return carrier_fe_mesh(CarrierMeshParameters.from_case(view))
    return _own(view, view.carrier, carrier_groups(view), view.carrier.plate_diameter)


def _own(view: StageView, source: FeMeshSource, groups: Groups, size: float) -> FeMesh:
    """The user's file, moved as the case says; InputError unless its groups are in their place."""
    file, key = str(source.fe_mesh_file), f"stage.{groups.body}.fe.fe_mesh_file"
    if source.fe_mesh == "reduced":
        raise InputError(
            view.source, f"stage.{groups.body}.fe.fe_mesh", "is reduced: there is no FE mesh",
            "name the other component",
        )  # fmt: skip
    placement = Placement(source.fe_mesh_shift, source.fe_mesh_turn)
    stems = tuple(f.stem for f in groups.families if f.numbered)
    try:
        read = _read(file, _stamp(file), source.fe_mesh_unit, tuple(groups.needed), size, stems)
        fe_mesh = placed(read, placement)
        check_place(fe_mesh, groups, placement, file)
    except InputError as fault:
        what = ": ".join(dict.fromkeys([file, fault.key]))
        problem = f"{what}: {fault.problem}"
        raise InputError(view.source, key, problem, fault.remedy) from None
    return fe_mesh


def _stamp(file: str) -> tuple[int, int]:
    """Differs when the file has changed."""
    try:
        status = Path(file).stat()
    except OSError:
        return (0, 0)
    return (status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=2)  # a command looks at both files before its work, a sweep at every point
def _read(
    file: str,
    stamp: tuple[int, int],
    unit: str,
    needed: tuple[str, ...],
    size: float,
    stems: tuple[str, ...],
) -> FeMesh:
    return read_fe_mesh(file, unit, needed, size, stems=stems)
