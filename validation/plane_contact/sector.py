"""FE mesh of some teeth of a gear in the plane, fine along the flanks that touch.

Frame: the gear's centre, x along the middle tooth. The outline is a chain of straight edges between
points on the true flanks, fillets and circles; each edge is one side of a triangle.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from cut_teeth.envelope import Points, resampled
from cut_teeth.gear import Gear
from cut_teeth.shape import shape
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skfem import MeshTri

from flexgear.arrays import Array
from flexgear.structures.fe_mesh.session import gmsh_session

LOADED = (-1, 0, 1)  # teeth that touch, counted from the middle one


@dataclass(frozen=True)
class Grid:
    """Sizes of elements. flank: edges on a flank that touches; fillet: edges of one; growth: of the
    size per distance from them; coarse: of others, modules; neighbours: teeth beyond the loaded
    ones on either side; held: depth below the root circle at which the body is held, modules;
    unloaded: edges on tips, root lands and teeth that do not touch, of the standard number."""

    flank: int
    fillet: int = 20
    growth: float = 0.25
    coarse: float = 0.4
    neighbours: int = 1
    held: float = 3.0
    unloaded: float = 1.0

    def edges(self, standard: int) -> int:
        """Number of edges on a line that does not touch."""
        return max(1, round(self.unloaded * standard))


@dataclass(frozen=True)
class Sector:
    """FE mesh (m) and its patches.

    vertices: (teeth, n + 1) of the loaded teeth's flanks, from the tip to the fillet, at equal
    steps of arc length; facets: (teeth, n) between them; arc: (n + 1,) ρ²/(2 r_b) there, m;
    fillets: (teeth, k) facets of the fillets below them; held: facets.
    """

    fe_mesh: MeshTri
    tooth: Gear
    side: int
    vertices: NDArray[np.int64]
    facets: NDArray[np.int64]
    arc: Array
    fillets: NDArray[np.int64]
    held: NDArray[np.int64]


def flank_arc(tooth: Gear, count: int) -> Array:
    """Arc lengths ρ²/(2 r_b) of the involute, (count + 1,) from the tip to the fillet, m."""
    ends = [tooth.roll_length(r) ** 2 for r in (tooth.tip_radius, shape(tooth).form_radius)]
    return np.linspace(*ends, count + 1) / (2 * tooth.base_radius)


def flank_points(tooth: Gear, arc: Array) -> tuple[Array, Array]:
    """Radius and half angle at arc lengths of the involute."""
    radius = np.sqrt(tooth.base_radius**2 + 2 * tooth.base_radius * arc)
    return radius, tooth.half_angle(radius)


def _half(tooth: Gear, flank: int, fillet: int, land: int) -> tuple[Points, Points, Points]:
    """Points (k,) of the +y half of a tooth as complex numbers: flank from the tip, fillet from
    there, root land to half the pitch. Neighbours share their ends; of a land narrower than half an
    edge of the fillet nothing is left but its end, or elements there would have no height."""
    radius, half = flank_points(tooth, flank_arc(tooth, flank))
    side, bend = radius * np.exp(1j * half), resampled(shape(tooth).root, fillet)
    bend[0] = side[-1]
    ends = np.angle(bend[-1]), tooth.pitch_angle / 2
    edges = min(land, round((ends[1] - ends[0]) * tooth.root_radius / abs(bend[-1] - bend[-2])))
    rest = tooth.root_radius * np.exp(1j * np.linspace(*ends, edges + 1))
    if not edges:
        bend[-1] = rest[0] = tooth.root_radius * np.exp(1j * ends[1])
    return side, bend, rest


def sector(tooth: Gear, side: int, module: float, grid: Grid) -> Sector:
    """Mesh of the loaded teeth and their neighbours; side: +1 where flanks at +θ touch, else −1."""
    loop, held, teeth = sector_outline(tooth, side, module, grid, LOADED)
    return marked(triangles([loop], teeth.fine, grid, module), tooth, side, grid, teeth, held)


def sector_outline(
    tooth: Gear, side: int, module: float, grid: Grid, loaded: Sequence[int]
) -> tuple[Points, Points, TeethOutline]:
    """Closed outline of a sector, the part of it where the body is held, and its teeth; loaded:
    numbers of the teeth that touch, in order."""
    teeth = teeth_outline(
        tooth, side, grid, range(loaded[0] - grid.neighbours, loaded[-1] + grid.neighbours + 1),
        loaded,
    )  # fmt: skip
    line = teeth.points
    radius = tooth.root_radius - tooth.outward * grid.held * module
    ends = np.angle(line[[-1, 0]])
    steps = max(16, round(abs(ends[0] - ends[1]) * radius / (grid.coarse * module)))
    back = radius * np.exp(1j * np.linspace(ends[0], ends[1], steps + 1))
    down = max(3, round(grid.held / grid.coarse))
    share = np.linspace(0, 1, down + 1)[1:-1]
    first = line[-1] + share * (back[0] - line[-1])
    last_side = back[-1] + share * (line[0] - back[-1])
    held = np.concatenate([line[-1:], first, back, last_side, line[:1]])
    return np.concatenate([line, held[1:-1]]), held, teeth


@dataclass(frozen=True)
class TeethOutline:
    """Points along teeth, counter-clockwise; flanks and fillets of those that touch."""

    points: Points
    flanks: list[Points]
    fillets: list[Points]

    @property
    def fine(self) -> list[Points]:
        """Chains with edges of small elements."""
        return [*self.flanks, *self.fillets]


def teeth_outline(
    tooth: Gear, side: int, grid: Grid, numbers: Iterable[int], loaded: Sequence[int]
) -> TeethOutline:
    """Teeth ``numbers``, each with half the root land on either side, of which some touch."""
    chain: list[complex] = []
    flanks, fillets = [], []
    height = tooth.outward * (tooth.tip_radius - shape(tooth).form_radius)
    coarse = max(4, round(height / tooth.pitch_angle / tooth.reference_radius * 16))
    for j in numbers:
        halves = {}
        for s in (-1, 1):
            fine = j in loaded and s == side
            counts = (grid.flank, grid.fillet) if fine else (grid.edges(coarse), grid.edges(6))
            parts = _half(tooth, *counts, grid.edges(3))
            turned = [
                (p if s > 0 else np.conj(p)) * np.exp(1j * j * tooth.pitch_angle) for p in parts
            ]
            halves[s] = turned
            if fine:
                flanks.append(turned[0])
                fillets.append(turned[1])
        tip = np.angle(halves[-1][0][0]), np.angle(halves[1][0][0])
        width = (tip[1] - tip[0]) % (2 * math.pi)
        land = tooth.tip_radius * np.exp(
            1j * (tip[0] + width * np.linspace(0, 1, grid.edges(8) + 1))
        )
        low = np.concatenate([h[::-1] for h in halves[-1][::-1]])
        chain += [*low, *land[1:-1], *np.concatenate(halves[1])]
    return TeethOutline(_distinct(np.array(chain)), flanks, fillets)


def marked(
    fe_mesh: MeshTri, tooth: Gear, side: int, grid: Grid, teeth: TeethOutline, held: Points
) -> Sector:
    """The FE mesh with its patches; held: chain of points."""
    flanks = [chain_on(fe_mesh, c) for c in teeth.flanks]
    return Sector(
        fe_mesh=fe_mesh,
        tooth=tooth,
        side=side,
        vertices=np.array([f[0] for f in flanks]),
        facets=np.array([f[1] for f in flanks]),
        arc=flank_arc(tooth, grid.flank),
        fillets=np.array([chain_on(fe_mesh, _distinct(c))[1] for c in teeth.fillets]),
        held=chain_on(fe_mesh, _distinct(held))[1],
    )


def _distinct(points: Points) -> Points:
    """Without points that repeat the one before."""
    near = abs(np.diff(points)) < 1e-9 * abs(points[0])
    return points[np.concatenate([[True], ~near])]


def triangles(loops: list[Points], fine: list[Points], grid: Grid, unit: float) -> MeshTri:
    """Triangles inside the first of closed chains and outside the others, whose edges stay whole.

    Sizes grow from the chains ``fine``; unit: length in which the grid's sizes are, m.
    """
    with gmsh_session("plane teeth") as gmsh:
        outline(gmsh, loops, fine, grid, unit)
        gmsh.option.setNumber("Mesh.Algorithm", 6)
        gmsh.model.mesh.generate(2)
        tags, xyz, _ = gmsh.model.mesh.getNodes()
        _, corners = gmsh.model.mesh.getElementsByType(2)
    used, corners = np.unique(corners, return_inverse=True)
    row = np.zeros(int(tags.max()) + 1, np.int64)
    row[tags.astype(np.int64)] = np.arange(len(tags))
    xy = unit * xyz.reshape(-1, 3)[row[used.astype(np.int64)], :2]
    return MeshTri(np.ascontiguousarray(xy.T), np.ascontiguousarray(corners.reshape(-1, 3).T))


def outline(gmsh: Any, loops: list[Points], fine: list[Points], grid: Grid, unit: float) -> None:
    """Surface inside the first of closed chains and outside the others, in gmsh; their edges stay
    whole, and sizes grow from the chains ``fine``."""
    geo = gmsh.model.geo
    closed = []
    for loop in loops:
        points = [geo.addPoint(p.real, p.imag, 0) for p in loop / unit]
        ends = zip(points, points[1:] + points[:1], strict=True)
        closed.append([geo.addLine(a, b) for a, b in ends])
    geo.addPlaneSurface([geo.addCurveLoop(lines) for lines in closed])
    geo.synchronize()
    for lines in closed:
        for line in lines:
            gmsh.model.mesh.setTransfiniteCurve(line, 2)
    places = np.concatenate(fine)
    tree = cKDTree(np.column_stack([places.real, places.imag]) / unit)
    smallest = min(abs(np.diff(chain)).mean() for chain in fine) / unit

    def size(dim, tag, x, y, z, default):
        return min(smallest + grid.growth * tree.query([x, y])[0], grid.coarse)

    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
    gmsh.model.mesh.setSizeCallback(size)


def chain_on(fe_mesh: MeshTri, chain: Points) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Vertices at the points of a chain, and the facets between them."""
    far, nodes = cKDTree(fe_mesh.p.T).query(np.column_stack([chain.real, chain.imag]))
    if far.max() > 1e-9 * abs(chain).max():
        raise RuntimeError("the mesher moved a point of the outline")
    pairs = np.sort(np.column_stack([nodes[:-1], nodes[1:]]), axis=1)
    number = {tuple(pair): k for k, pair in enumerate(np.sort(fe_mesh.facets.T, axis=1))}
    return nodes, np.array([number[tuple(pair)] for pair in pairs])
