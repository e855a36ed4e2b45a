"""Transverse section of the ring gear as quadrilaterals, exactly z-periodic and mirror-symmetric.

gmsh meshes one tooth sector with transfinite quadrilaterals; the sector is then made symmetric to
the last digit and turned by 2πj/z. Blocks of a sector (tip at the top, rim at the bottom)::

        tip                     A1  between the involutes, tip circle to form circle
       +---+                    A2  between the fillets, form circle to base section
       |A1 |                    B   below the tooth, root circle to the rim's outer edge
       +---+                    C   below the root land, between neighbouring teeth
      / A2  \\
     +-------+----+             The line between A2 and B is the tooth's base section, the patch
     |   B   | C  |             "root" of the tooth: from fillet end to fillet end, bowed one
     +-------+----+             fillet radius into the rim (which opens its corners).

All nodes are held in polar coordinates, so flank nodes lie on the involute exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, pi, sin
from types import ModuleType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.gears.tooth import ToothGeometry
from flexgear.model.errors import FlexgearError
from flexgear.structures.fe_mesh.session import gmsh_session

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_SPLINE_POINTS = 25  # support points of a flank's spline; nodes are put on the involute afterwards
_BOW = 1.0  # depth of the base section below the root circle, in fillet radii: opens its corners
_MIN_LAND = 0.1  # least width of the block C at its top, in fillet radii


@dataclass(frozen=True)
class SectionDivisions:
    """Number of elements: across the tooth, along involute and fillet, from root circle outward."""

    tooth: int
    flank: int
    fillet: int
    rim: int

    @property
    def around(self) -> int:
        """Columns of one tooth sector."""
        return self.tooth + 1


@dataclass(frozen=True)
class RingSection:
    """Quadrilaterals in the transverse plane.

    radius, angle: (n,) m, rad; quads: (m, 4) counter-clockwise;
    tooth_lines: "flank" (-θ side, the one a planet carried by +Z presses), "backflank" (+θ side),
    "root" (base section) -> (z, k, 2) node ids; outer: (k, 2); holes: (n_b, k, 2) or empty.
    """

    radius: Array
    angle: Array
    quads: Ints
    tooth_lines: dict[str, Ints]
    outer: Ints
    holes: Ints = field(default_factory=lambda: np.zeros((0, 0, 2), dtype=np.int64))

    @property
    def points(self) -> Array:
        """(n, 2) m."""
        return np.column_stack([self.radius * np.cos(self.angle), self.radius * np.sin(self.angle)])


@dataclass
class _Sector:
    """One tooth sector: nodes 0..n-1 of its own; `left` and `right` are its two border lines."""

    radius: Array
    angle: Array
    quads: Ints
    left: Ints
    right: Ints
    lines: dict[str, Ints]


def toothed_section(
    tooth: ToothGeometry, outer_radius: float, divisions: SectionDivisions, growth: float = 1.0
) -> RingSection:
    """Structured section between the teeth's tips and a circle of nodes equally spaced.

    growth: ratio of successive radial element sizes outward from the root circle.
    """
    with gmsh_session("ring section") as gmsh:
        sector = _sector(gmsh, tooth, outer_radius, divisions, growth)
    return _replicate(sector, tooth, outer_radius)


def base_section_angle(tooth: ToothGeometry) -> float:
    """Half angle of a tooth's base section, rad: to the fillet's end, and never wholly up to the
    next tooth's."""
    land = _MIN_LAND * tooth.fillet_radius / tooth.root_radius
    return min(tooth.fillet.end, (tooth.pitch_angle - land) / 2.0)


def base_section_depth(tooth: ToothGeometry) -> float:
    """How far the base section bows below the root circle at the tooth's middle, m."""
    return _BOW * tooth.fillet_radius


@dataclass(frozen=True)
class _Outline:
    """gmsh curves of one tooth sector, of the side of an angle's sign: involute, fillet and radial
    line below; across the tooth by name ("tip", "form", "root", "outer"); block C's other curves;
    blocks: (curves, corners) of A1, A2, B and C."""

    flank: dict[int, int]
    fillet: dict[int, int]
    side: dict[int, int]
    across: dict[str, int]
    land: int
    land_outer: int
    right: int
    blocks: list[tuple[list[int], list[int]]]


def _sector(
    gmsh: ModuleType,
    tooth: ToothGeometry,
    outer_radius: float,
    div: SectionDivisions,
    growth: float,
) -> _Sector:
    outline = _drawn(gmsh.model.geo, tooth, outer_radius, div)
    _divide(gmsh.model.geo, outline, div, growth)
    gmsh.model.mesh.generate(2)
    return _sector_nodes(gmsh, tooth, outline)


def _drawn(
    geo: ModuleType, tooth: ToothGeometry, outer_radius: float, div: SectionDivisions
) -> _Outline:
    """Points and curves of the sector, tooth in the middle of the X axis."""
    pitch = tooth.pitch_angle
    base_angle = base_section_angle(tooth)
    base_radius = float(tooth.root_profile(base_angle))
    outer_angle = pitch * div.tooth / div.around / 2.0

    def point(radius: float, angle: float) -> int:
        return int(geo.addPoint(radius * cos(angle), radius * sin(angle), 0.0))

    origin = point(0.0, 0.0)
    radii = np.linspace(tooth.tip_radius, tooth.form_radius, _SPLINE_POINTS)
    angles = tooth.half_angle(radii)
    fillet = np.linspace(float(angles[-1]), base_angle, _SPLINE_POINTS)
    fillet_radii = tooth.root_profile(fillet)
    flank, curve_fillet, side, tip, form, base, outer = {}, {}, {}, {}, {}, {}, {}
    for sign in (-1, 1):
        on_flank = [point(r, sign * a) for r, a in zip(radii, angles, strict=True)]
        on_fillet = [point(r, sign * a) for r, a in zip(fillet_radii[1:], fillet[1:], strict=True)]
        tip[sign], form[sign], base[sign] = on_flank[0], on_flank[-1], on_fillet[-1]
        outer[sign] = point(outer_radius, sign * outer_angle)
        flank[sign] = geo.addSpline(on_flank)
        curve_fillet[sign] = geo.addSpline([form[sign], *on_fillet])
        side[sign] = geo.addLine(base[sign], outer[sign])
    next_base = point(base_radius, pitch - base_angle)
    next_outer = point(outer_radius, pitch - outer_angle)
    across = {
        name: geo.addCircleArc(ends[-1], origin, ends[1])
        for name, ends in (("tip", tip), ("form", form), ("outer", outer))
    }
    bowed = point(tooth.root_radius - tooth.outward * base_section_depth(tooth), 0.0)
    across["root"] = geo.addSpline([base[-1], bowed, base[1]])
    land = geo.addLine(base[1], next_base)
    land_outer = geo.addCircleArc(outer[1], origin, next_outer)
    right = geo.addLine(next_base, next_outer)

    def block(top: str, down: dict[int, int], bottom: str) -> list[int]:
        return [across[top], down[1], -across[bottom], -down[-1]]

    blocks = [
        (block("tip", flank, "form"), [tip[-1], tip[1], form[1], form[-1]]),
        (block("form", curve_fillet, "root"), [form[-1], form[1], base[1], base[-1]]),
        (block("root", side, "outer"), [base[-1], base[1], outer[1], outer[-1]]),
        ([land, right, -land_outer, -side[1]], [base[1], next_base, next_outer, outer[1]]),
    ]
    return _Outline(flank, curve_fillet, side, across, land, land_outer, right, blocks)


def _divide(geo: ModuleType, outline: _Outline, div: SectionDivisions, growth: float) -> None:
    """Number of elements along every curve, and blocks of quadrilaterals."""
    for curve in outline.across.values():
        geo.mesh.setTransfiniteCurve(curve, div.tooth + 1)
    for curve in (outline.land, outline.land_outer):
        geo.mesh.setTransfiniteCurve(curve, 2)
    for curve in outline.flank.values():
        geo.mesh.setTransfiniteCurve(curve, div.flank + 1)
    for curve in outline.fillet.values():
        geo.mesh.setTransfiniteCurve(curve, div.fillet + 1)
    for curve in (*outline.side.values(), outline.right):
        geo.mesh.setTransfiniteCurve(curve, div.rim + 1, "Progression", growth)
    for curves, corners in outline.blocks:
        surface = geo.addPlaneSurface([geo.addCurveLoop(curves)])
        geo.mesh.setTransfiniteSurface(surface, cornerTags=corners)
        geo.mesh.setRecombine(2, surface)
    geo.synchronize()


def _sector_nodes(gmsh: ModuleType, tooth: ToothGeometry, outline: _Outline) -> _Sector:
    """What gmsh made of it, nodes of the flanks put on the involute and the fillet exactly.

    Raises FlexgearError if gmsh gives other elements than quadrilaterals.
    """
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    number = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    types, _, connectivity = gmsh.model.mesh.getElements(2)
    if list(types) != [3]:
        raise FlexgearError("ring section: gmsh gave other elements than quadrilaterals")
    used = np.unique(connectivity[0].astype(np.int64))
    number[used] = np.arange(len(used))
    where = np.full(len(number), -1, dtype=np.int64)
    where[tags.astype(np.int64)] = np.arange(len(tags))
    xy = xyz.reshape(-1, 3)[where[used], :2]
    radius, angle = np.hypot(xy[:, 0], xy[:, 1]), np.arctan2(xy[:, 1], xy[:, 0])

    def line(curve: int) -> Ints:
        """Nodes of a curve from its start to its end."""
        on_curve, _, u = gmsh.model.mesh.getNodes(1, curve, True, True)
        return number[on_curve[np.argsort(u)].astype(np.int64)]

    for sign in (-1, 1):
        flank_nodes, fillet_nodes = line(outline.flank[sign]), line(outline.fillet[sign])
        angle[flank_nodes] = sign * tooth.half_angle(radius[flank_nodes])
        radius[fillet_nodes[1:]] = tooth.root_profile(np.abs(angle[fillet_nodes[1:]]))
    quads = number[connectivity[0].astype(np.int64).reshape(-1, 4)]
    outer = [line(outline.across["outer"])[:-1], line(outline.land_outer)]
    lines = {
        "flank": line(outline.flank[-1]),
        "backflank": line(outline.flank[1]),
        "root": line(outline.across["root"]),
        "outer": np.concatenate(outer),
    }
    left, right = line(outline.side[-1]), line(outline.right)
    return _Sector(radius, angle, _counter_clockwise(xy, quads), left, right, lines)


def _replicate(sector: _Sector, tooth: ToothGeometry, outer_radius: float) -> RingSection:
    """Turn the sector z times; its right border is the left border of the next one."""
    n, z, pitch = len(sector.radius), tooth.teeth, tooth.pitch_angle
    own = np.ones(n, dtype=bool)
    own[sector.right] = False
    local = np.full(n, -1, dtype=np.int64)
    local[own] = np.arange(int(own.sum()))
    n_own = int(own.sum())
    ahead = np.zeros(n, dtype=np.int64)
    ahead[sector.right] = 1
    local[sector.right] = local[sector.left]
    radius, angle = _symmetric(sector.radius[own], sector.angle[own], pitch)
    radius[np.isclose(radius, outer_radius, rtol=1e-9)] = outer_radius
    turns = np.arange(z)[:, None]

    def everywhere(ids: Ints) -> Ints:
        """(…) sector node ids -> (z, …) section node ids."""
        flat = ids.reshape(1, -1)
        return (((turns + ahead[flat]) % z) * n_own + local[flat]).reshape(z, *ids.shape)

    pairs = {
        name: everywhere(np.column_stack([ids[:-1], ids[1:]])) for name, ids in sector.lines.items()
    }
    return RingSection(
        np.tile(radius, z),
        (angle[None, :] + pitch * turns).ravel(),
        everywhere(sector.quads).reshape(-1, 4),
        {name: pairs[name] for name in ("flank", "backflank", "root")},
        pairs["outer"].reshape(-1, 2),
    )


def _symmetric(radius: Array, angle: Array, pitch: float) -> tuple[Array, Array]:
    """Average every node with its mirror image about the tooth's middle, θ -> -θ modulo pitch."""

    def place(theta: Array) -> Array:
        turn = 2.0 * pi * theta / pitch  # one pitch to a full circle
        return np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])

    distance, partner = cKDTree(place(angle)).query(place(-angle))
    if distance.max() > 1e-5 * radius.max() or (partner[partner] != np.arange(len(partner))).any():
        raise FlexgearError("ring section: the sector is not symmetric about the tooth's middle")
    wraps = np.round((angle + angle[partner]) / pitch) * pitch
    return (radius + radius[partner]) / 2.0, (angle - angle[partner] + wraps) / 2.0


def _counter_clockwise(xy: Array, quads: Ints) -> Ints:
    p = xy[quads]
    d1, d2 = p[:, 2] - p[:, 0], p[:, 3] - p[:, 1]
    clockwise = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0] < 0.0
    return np.where(clockwise[:, None], quads[:, ::-1], quads)
