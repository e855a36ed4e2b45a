"""A user's FE mesh in the place that a case needs."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from flexgear.model.errors import InputError
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import read_fe_mesh
from flexgear.structures.fe_mesh.groups import Groups
from flexgear.structures.fe_mesh.placement import Placement, check_place, placed

if TYPE_CHECKING:
    from flexgear.model.fe_mesh_source import FeMeshSource


def mesh_of_file(source: FeMeshSource, groups: Groups, size: float, where: str) -> FeMesh:
    """The user's file, moved as the case says; InputError unless its groups are in their place.

    size: largest dimension of the body, m; where: what the case is from.
    """
    file, key = str(source.fe_mesh_file), f"stage.{groups.body}.fe.fe_mesh_file"
    if source.fe_mesh == "reduced":
        raise InputError(
            where, f"stage.{groups.body}.fe.fe_mesh", "is reduced: there is no FE mesh",
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
        raise InputError(where, key, problem, fault.remedy) from None
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
