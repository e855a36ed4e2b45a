"""Hexahedra of a few straight teeth of a gear: a plane section of quadrilaterals along the face.

The section is that of ``plane_contact.sector``, meshed with recombined triangles that are each cut
into quadrilaterals once more; vertices of the loaded flank lie on the involute.
"""

from dataclasses import dataclass

import numpy as np
from cut_teeth.envelope import Points
from cut_teeth.gear import Gear
from numpy.typing import NDArray
from plane_contact.sector import Grid, outline, sector_outline

from flexgear.arrays import Array, Ints
from flexgear.structures.fe_mesh.session import gmsh_session

QUAD = 3  # gmsh's number of four-node quadrilaterals
ON = 1e-7  # of a radius: how far a vertex may lie off a line that it is on


@dataclass(frozen=True)
class Section:
    """points (n, 2) m in the gear's frame; quads (m, 4) counter-clockwise; flank (k, 2) and held
    (l, 2): edges of the loaded flank and of where the body is held, the body to their left."""

    points: Array
    quads: Ints
    flank: Ints
    held: Ints


def section(tooth: Gear, side: int, module: float, grid: Grid) -> Section:
    """The middle tooth loaded on its flank at ``side``; sizes of the grid are halved."""
    loop, held, teeth = sector_outline(tooth, side, module, grid, (0,))
    with gmsh_session("solid teeth") as gmsh:
        outline(gmsh, [loop], teeth.fine, grid, module)
        gmsh.option.setNumber("Mesh.Algorithm", 5)
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 1)
        gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1)
        gmsh.model.mesh.generate(2)
        tags, xyz, _ = gmsh.model.mesh.getNodes()
        _, corners = gmsh.model.mesh.getElementsByType(QUAD)
        if len(gmsh.model.mesh.getElementsByType(2)[0]):
            raise RuntimeError("gmsh left triangles")
    used, corners = np.unique(corners.astype(np.int64), return_inverse=True)
    row = np.zeros(int(tags.max()) + 1, np.int64)
    row[tags.astype(np.int64)] = np.arange(len(tags))
    points = module * xyz.reshape(-1, 3)[row[used], :2]
    quads = counter_clockwise(points, corners.reshape(-1, 4))
    edges = free_edges(quads)
    on_flank, on_held = (edges[on_chain(points, edges, chain)] for chain in (teeth.flanks[0], held))
    flank = np.unique(on_flank)
    radius = np.hypot(*points[flank].T)
    angle = side * tooth.half_angle(radius)
    points[flank] = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return Section(points, quads, on_flank, on_held)


def counter_clockwise(points: Array, quads: Ints) -> Ints:
    """All with a positive area."""
    x, y = np.moveaxis(points[quads], 2, 0)
    area = (x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])
    return np.where((area < 0)[:, None], quads[:, ::-1], quads)


def free_edges(quads: Ints) -> Ints:
    """(e, 2) edges of one quadrilateral only, the body to their left."""
    edges = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2).reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True,
                                return_counts=True)  # fmt: skip
    return edges[first[count == 1]]


def on_chain(points: Array, edges: Ints, chain: Points) -> NDArray[np.bool_]:
    """Whether the middles of edges (e,) lie on the straight pieces of a chain."""
    middle = points[edges].mean(axis=1) @ np.array([1, 1j])
    start, along = chain[:-1], np.diff(chain)
    seen = (middle[:, None] - start) / along  # 0 … 1 on a piece, imaginary part across
    off = np.abs(seen.imag) * abs(along)
    near = (seen.real > 0) & (seen.real < 1) & (off < ON * abs(chain).max())
    return near.any(axis=1)


def extruded(plane: Section, z: Array) -> tuple[Array, Ints]:
    """Points (n (q + 1), 3) m and hexahedra (m q, 8), bottom and top, at layer borders z (q + 1,);
    layer by layer."""
    n = len(plane.points)
    xy = np.tile(plane.points, (len(z), 1))
    level = n * np.arange(len(z) - 1)[:, None, None]
    cells = np.concatenate([plane.quads + level, plane.quads + level + n], axis=2)
    return np.column_stack([xy, np.repeat(z, n)]), cells.reshape(-1, 8)


def walls(plane: Section, edges: Ints, layers: int) -> Ints:
    """Facets (layers e, 4) above edges (e, 2) of the section, outward."""
    n = len(plane.points)
    first, second = (edges[:, i] + n * np.arange(layers)[:, None] for i in (0, 1))
    return np.stack([first, second, second + n, first + n], axis=-1).reshape(-1, 4)
