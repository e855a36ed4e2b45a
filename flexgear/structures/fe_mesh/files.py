"""FE meshes in files: vtu and msh by meshio, inp (Abaqus, CalculiX) by ``inp.py``.

Named patches
  msh  physical groups of triangles or quadrilaterals (format 2.2 on writing)
  vtu  triangle or quadrilateral cells beside the solid ones, and one integer cell array whose name
       joins the patch names by "-" in the order of its values 1, 2, … (meshio's convention for
       cell sets; 0 is the solid "body"); reading also takes integer cell arrays named like the
       patch, not 0 on its cells
  inp  surfaces of (element, face) pairs; reading also takes sets of shell elements and node sets
A facet in two patches is written twice. Lengths are written in m.
"""

import contextlib
import io
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote, unquote

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from flexgear.arrays import Array, Ints
from flexgear.files.atomic import atomic_file
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.input_file import MAX_FE_MESH_BYTES, require_regular
from flexgear.structures.fe_mesh.fe_mesh import (
    EDGES_VTK,
    HEX_FROM_VTK,
    FeMesh,
    Kind,
    corner_jacobians,
    facet_keys,
)
from flexgear.structures.fe_mesh.inp import InpDeck, read_inp, write_inp

UNITS = {"m": 1.0, "mm": 1e-3}
_SUFFIXES = (".msh", ".vtu", ".inp")
_MARK = "flexgear FE mesh of "
_COMMENTS = {  # text before and after a comment in the last line of a file
    ".vtu": ("\n<?", "?>"),
    ".msh": ("$Comments\n", "\n$EndComments"),
    ".inp": ("** ", ""),
}
_SOLID: dict[str, tuple[Kind, int]] = {
    "hexahedron": ("hex", 8),
    "hexahedron20": ("hex", 8),
    "hexahedron27": ("hex", 8),
    "tetra": ("tet", 4),
    "tetra10": ("tet", 4),
}
_SURFACE = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}
_IGNORED = ("vertex", "line", "line3")


def write_fe_mesh(fe_mesh: FeMesh, path: Path | str, case: str = "") -> None:
    """Write vtu, msh or inp with the named patches, in m; the file is written whole or not at all.

    case: name of the case, for a comment in the last line that ``fe_mesh_case`` reads.
    """
    path = Path(path)
    require_format(path)
    with atomic_file(path) as draft:
        if path.suffix == ".inp":
            with draft.open("w", encoding="utf-8") as stream:
                write_inp(fe_mesh, stream)
        else:
            _write_meshio(fe_mesh, draft, path.suffix)
        if case:
            before, after = _COMMENTS[path.suffix]
            with draft.open("a", encoding="utf-8") as stream:
                stream.write(f"{before}{_MARK}{quote(case)}{after}\n")


def fe_mesh_case(path: Path) -> str | None:
    """Name of the case of an exported FE mesh; None where the file does not state it."""
    with open(path, "rb") as file:
        file.seek(max(0, os.path.getsize(path) - 4096))
        end = file.read().decode("utf-8", errors="replace")
    marks = re.findall(rf"{_MARK}([^\s?]+)", end)
    return unquote(marks[-1]) if marks else None


def read_fe_mesh(
    path: Path | str,
    unit: str = "m",
    required_patches: Sequence[str] = (),
    expected_size: float | None = None,
    stems: Sequence[str] = (),
) -> FeMesh:
    """A user's FE mesh with its named groups as patches, converted to m.

    unit: of the file's lengths; expected_size: largest dimension of the body in m, if known; stems:
    of numbered names whose node sets are read even if they are not required. Straight-sided
    second-order cells are reduced to their corners. Left-handed cells are renumbered; facets on the
    surface get outward normals. InputError for a file of which no FE mesh can be made.
    """
    path = Path(path)
    require_format(path, "fe_mesh_file")
    require_regular(path, "fe_mesh_file", MAX_FE_MESH_BYTES)
    deck = read_inp(path) if path.suffix == ".inp" else _read_meshio(path)
    kind, cells = _solid_cells(deck, path)
    used, cells = np.unique(cells, return_inverse=True)
    cells = cells.reshape(-1, 8 if kind == "hex" else 4)
    points = deck.points[used] * UNITS[unit]
    if not np.isfinite(points).all():
        raise InputError(str(path), "nodes", "a coordinate is not a number", "mesh again")
    _check_size(points, unit, expected_size, path)
    _check_pieces(cells, len(points), path)
    cells = _right_handed(points, cells, kind, path)
    number = np.full(len(deck.points), -1, dtype=np.int64)
    number[used] = np.arange(len(used))
    stored = cells[:, HEX_FROM_VTK] if kind == "hex" else cells
    body = FeMesh(points, stored, kind, {})
    patches = _patches(deck, body, number, required_patches, stems, path)
    return replace(body, facets=patches)


def require_format(path: Path, where: str = "export") -> None:
    """InputError unless the suffix is that of a supported format of FE meshes."""
    if path.suffix not in _SUFFIXES:
        problem = f"{path.suffix or 'no suffix'} is no format of FE meshes here"
        raise InputError(where, str(path), problem, f"use {_list(_SUFFIXES)}")


def _list(names: Iterable[str], most: int = 6) -> str:
    listed = list(names)
    more = f" and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + more


def _write_meshio(fe_mesh: FeMesh, path: Path, suffix: str) -> None:
    import meshio

    solid, flat = ("hexahedron", "quad") if fe_mesh.kind == "hex" else ("tetra", "triangle")
    names = list(fe_mesh.facets)
    cells: list[tuple[str, Ints]] = [(solid, fe_mesh.vtk_cells)]
    tags = [np.zeros(len(fe_mesh.cells), dtype=np.int32)]
    if names:
        cells.append((flat, np.concatenate([fe_mesh.facets[n] for n in names])))
        sizes = [len(fe_mesh.facets[n]) for n in names]
        tags.append(np.repeat(np.arange(1, len(names) + 1, dtype=np.int32), sizes))
    if suffix == ".vtu":
        clash = [n for n in names if "-" in n]
        if clash:
            raise FlexgearError(f"vtu cannot hold patch names with a hyphen: {_list(clash)}")
        data = {"-".join(["body", *names]): tags}
        meshio.Mesh(fe_mesh.points, cells, cell_data=data).write(path, file_format="vtu")
        return
    body = len(names) + 1
    tags[0] = tags[0] + body
    groups = {n: np.array([i, 2]) for i, n in enumerate(names, 1)} | {"body": np.array([body, 3])}
    meshio.Mesh(
        fe_mesh.points,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=groups,
    ).write(path, file_format="gmsh22")


def _read_meshio(path: Path) -> InpDeck:
    import meshio

    messages = io.StringIO()
    try:
        with contextlib.redirect_stdout(messages), contextlib.redirect_stderr(messages):
            content = meshio.read(path, file_format="gmsh" if path.suffix == ".msh" else "vtu")
    except (Exception, SystemExit) as error:
        reason = (messages.getvalue().strip() or str(error) or type(error).__name__).splitlines()[0]
        problem, remedy = f"cannot be read ({reason})", "save it again as msh, vtu or inp"
        raise InputError(str(path), "file", problem, remedy) from error
    blocks = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in content.cells]
    vertices = np.asarray(content.points)
    named = [rows for _, rows in blocks] + [np.asarray(s) for s in content.point_sets.values()]
    if vertices.ndim != 2 or any(r.min() < 0 or r.max() >= len(vertices) for r in named if r.size):
        raise InputError(str(path), "cells", "name points that are not there", "mesh again")
    points = np.zeros((len(vertices), 3))
    points[:, : vertices.shape[1]] = vertices[:, :3]
    deck = InpDeck(points, blocks)

    def add(name: str, block: int, members: NDArray[np.generic]) -> None:
        corners = _SURFACE.get(blocks[block][0])
        if corners and len(members):
            deck.groups.setdefault(name, []).extend(blocks[block][1][members][:, :corners])

    for name, sets in content.cell_sets.items():
        for block, members in enumerate(sets):
            if members is not None and not name.startswith("gmsh:"):
                add(name, block, np.asarray(members))
    physical = {int(t): name for name, (t, dim) in content.field_data.items() if dim == 2}
    for key, arrays in content.cell_data.items():
        names: dict[int, str] = {}  # of the values that stand for a patch
        if key == "gmsh:physical":
            names = {t: name for t, name in physical.items() if name not in content.cell_sets}
        elif key.startswith("body-"):
            names = dict(enumerate(key.split("-")[1:], 1))
        for block, values in enumerate(np.asarray(a) for a in arrays):
            if values.dtype.kind not in "iu" or values.ndim != 1:
                continue
            for tag, name in names.items():
                add(name, block, np.flatnonzero(values == tag))
            if not key.startswith(("gmsh:", "body-")):
                add(key, block, np.flatnonzero(values != 0))
    for name, members in content.point_sets.items():
        deck.node_sets[name] = np.asarray(members, dtype=np.int64)
    return deck


def _solid_cells(deck: InpDeck, path: Path) -> tuple[Kind, Ints]:
    """Corner cells in VTK order of the one solid type in the file."""
    solids = [(name, rows) for name, rows in deck.blocks if name in _SOLID and len(rows)]
    names = {name for name, _ in solids}
    strange = {n for n, rows in deck.blocks if len(rows)} - names - {*_SURFACE, *_IGNORED}
    if strange or len(names) > 1:
        problem = f"mixed element types ({_list(sorted(names | strange))})"
        remedy = "mesh the body with hexahedra only or tetrahedra only"
        raise InputError(str(path), "cells", problem, remedy)
    if not names:
        raise InputError(str(path), "cells", "no solid cells", "save the volume elements too")
    name = names.pop()
    rows = np.concatenate([rows for _, rows in solids])
    kind, corners = _SOLID[name]
    if rows.shape[1] > corners:
        _require_straight(deck.points, rows, kind, name, path)
    return kind, rows[:, :corners]


def _require_straight(points: Array, rows: Ints, kind: Kind, name: str, path: Path) -> None:
    """InputError unless mid-side nodes (VTK order of edges) are in the middle of straight edges."""
    edges = np.array(EDGES_VTK[kind])
    ends, first = points[rows[:, edges]], 4 if kind == "tet" else 8
    middle = points[rows[:, first : first + len(edges)]]
    off = _off(ends, middle)
    if kind == "tet":  # some files have gmsh's order of the last two
        off = min(off, _off(ends, middle[:, [0, 1, 2, 3, 5, 4]]))
    if off > 1e-3:
        problem = f"curved {name} cells: mid-side nodes are up to {off * 100:.1f} % of the edge off"
        remedy = "save first-order or straight-sided cells; the elements are quadratic all the same"
        raise InputError(str(path), "cells", problem, remedy)


def _off(ends: Array, middle: Array) -> float:
    """Largest distance of mid-side nodes from the middles of their edges, over the edges'
    length."""
    length = np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2)
    distance = np.linalg.norm(middle - ends.mean(axis=2), axis=2)
    return float((distance / np.maximum(length, np.finfo(float).tiny)).max())


def _check_size(points: Array, unit: str, expected: float | None, path: Path) -> None:
    """InputError where the size of the body is implausible, with the unit that fits."""
    size = float(np.ptp(points, axis=0).max())
    low, high = (0.02, 50.0) if expected is None else (0.5 * expected, 2.0 * expected)
    if low <= size <= high:
        return
    fitting = [u for u, factor in UNITS.items() if low <= size / UNITS[unit] * factor <= high]
    comparison = "" if expected is None else f", not about {expected:.4g} m"
    problem = f'in "{unit}" the body measures {size:.4g} m{comparison}'
    remedy = "check the file and the case's dimensions"
    if fitting:
        remedy = "set fe_mesh_unit = " + " or ".join(f'"{u}"' for u in fitting)
    raise InputError(str(path), "fe_mesh_unit", problem, remedy)


def _check_pieces(cells: Ints, n: int, path: Path) -> None:
    """InputError where the cells of n vertices are not connected."""
    ring = np.roll(cells, 1, axis=1)
    graph = coo_array((np.ones(cells.size), (cells.ravel(), ring.ravel())), shape=(n, n))
    pieces, _ = connected_components(graph, directed=False)
    if pieces > 1:
        problem = f"the body falls into {pieces} pieces"
        raise InputError(str(path), "cells", problem, "merge coincident nodes")


def _right_handed(points: Array, cells: Ints, kind: Kind, path: Path) -> Ints:
    """Cells with left-handed ones renumbered; InputError for cells with corners of both signs."""
    determinant, _ = corner_jacobians(points, cells, kind)
    left = np.asarray(np.all(determinant < 0.0, axis=1))
    mirrored = cells[:, [4, 5, 6, 7, 0, 1, 2, 3] if kind == "hex" else [0, 2, 1, 3]]
    cells = np.where(left[:, None], mirrored, cells)
    determinant, _ = corner_jacobians(points, cells, kind)
    bad = int((determinant <= 0.0).any(axis=1).sum())
    if bad:
        problem = f"{bad} cells are collapsed or inside out"
        raise InputError(str(path), "cells", problem, "repair the mesh")
    return cells


def _patches(
    deck: InpDeck,
    body: FeMesh,
    number: Ints,
    required: Sequence[str],
    stems: Sequence[str],
    path: Path,
) -> dict[str, Ints]:
    """Named groups as facets of the body; node sets only if required or numbered by a stem.

    number: vertex of the body for each point of the file, −1 for none. InputError for groups that
    do not fit the cells, for missing ones, and for cells that lie upon one another.
    """
    n, sides = len(body.points), 4 if body.kind == "hex" else 3
    every = body.every_facet
    keys, first, count = np.unique(facet_keys(every, n), return_index=True, return_counts=True)
    if count.max() > 2:
        problem = f"{int((count > 2).sum())} facets belong to more than two cells"
        raise InputError(str(path), "cells", problem, "delete cells that lie upon one another")
    patches: dict[str, Ints] = {}
    for name, rows in deck.groups.items():
        if {len(r) for r in rows} != {sides}:
            if name in required:
                raise InputError(str(path), name, "its facets do not fit the cells", "mesh again")
            continue
        ids = number[np.array(rows, dtype=np.int64)]
        patch_keys = facet_keys(ids, n) if ids.min() >= 0 else np.full(len(ids), -1)
        at = np.minimum(np.searchsorted(keys, patch_keys), len(keys) - 1)
        strange = int(np.count_nonzero(keys[at] - patch_keys))
        if strange:
            problem = f"{strange} facets are no facets of the solid cells"
            raise InputError(str(path), name, problem, "mesh surface and volume together")
        outward = np.where((count[at] == 1)[:, None], every[first[at]], ids)
        patches[name] = outward[np.unique(patch_keys, return_index=True)[1]]
    numbered = re.compile(rf"(?:{'|'.join(stems)})_\d+")
    for name in [*required, *filter(numbered.fullmatch, deck.node_sets)]:
        if name not in patches and name in deck.node_sets:
            inside = np.zeros(n, dtype=bool)
            members = number[deck.node_sets[name]]
            inside[members[members >= 0]] = True
            facets = body.boundary[inside[body.boundary].all(axis=1)]
            if len(facets):
                patches[name] = facets
    missing = [name for name in required if name not in patches]
    if missing:
        problem = f"{len(missing)} of {len(required)} missing: {_list(missing)}"
        remedy = f"name these surfaces; the file has {_list(patches) or 'none'}"
        raise InputError(str(path), "named groups", problem, remedy)
    return patches
