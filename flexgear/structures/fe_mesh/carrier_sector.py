"""Half sector of the planet carrier, 0 <= θ <= π/N, as straight tetrahedra from gmsh."""

from __future__ import annotations

from itertools import pairwise
from math import ceil, cos, pi, sin, sqrt
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.model.errors import FlexgearError, InputError

if TYPE_CHECKING:
    from flexgear.structures.fe_mesh.carrier import CarrierMeshParameters

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SIZE = {"quick": 1.6, "standard": 0.85, "fine": 0.5}  # cell size over mean plate thickness
_ROUND = {"quick": 8, "standard": 16, "fine": 24}  # least number of straight sides of a circle
_SAMPLES = 33  # points on a curve for its distance to others
_ROUND_BORE = 8  # the same for holes much thinner than a pin


def half_sector(gmsh: ModuleType, p: CarrierMeshParameters) -> tuple[Array, Ints]:
    """Vertices (n, 3) m and right-handed cells (m, 4); to be called inside a gmsh session."""
    occ, phi = gmsh.model.occ, pi / p.planets
    bore, plate, pin = p.hub_bore / 2.0, p.plate_diameter / 2.0, p.pin_diameter / 2.0
    gap, seat = p.plate_gap / 2.0, p.seat_width / 2.0
    z_drive, z_far = -gap - p.plate_thickness_drive, gap + p.plate_thickness_far

    def turned(corners: list[tuple[float, float]]) -> tuple[int, int]:
        """Solid of revolution 0 <= θ <= φ of a polygon in the (r, z) plane."""
        points = [occ.addPoint(r, 0.0, z) for r, z in corners]
        lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
        face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        made = occ.revolve([(2, face)], 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, phi)
        return next(entity for entity in made if entity[0] == 3)

    hub, seat_drive = p.hub_outer_diameter / 2.0, p.seat_drive_diameter / 2.0
    if abs(hub - seat_drive) < 0.1 * (p.plate_thickness_drive + p.plate_thickness_far) / 2.0:
        hub = seat_drive  # a small step would only make slivers
    z_seat, z_end = z_drive - p.seat_drive_width, z_drive - p.hub_length
    seat_far, z_seat_far = p.seat_far_diameter / 2.0, z_far + p.seat_far_width
    solids = [
        turned(
            [(bore, z_end), (hub, z_end), (hub, z_seat), (seat_drive, z_seat)]
            + [(seat_drive, z_drive), (plate, z_drive), (plate, -gap), (bore, -gap)]
            if hub != seat_drive
            else [(bore, z_end), (hub, z_end), (hub, z_seat)]
            + [(hub, z_drive), (plate, z_drive), (plate, -gap), (bore, -gap)]
        ),
        turned(
            [(bore, gap), (plate, gap), (plate, z_far), (seat_far, z_far)]
            + [(seat_far, z_seat_far), (bore, z_seat_far)]
        ),
    ]
    levels = sorted({-gap, -seat, seat, gap})
    solids += [
        (3, occ.addCylinder(p.center_distance, 0.0, a, 0.0, 0.0, b - a, pin, angle=pi))
        for a, b in pairwise(levels)
    ]
    solids.append(_half_web(occ, p))
    if p.pin_bore > 0.0:
        hole = occ.addCylinder(
            *(p.center_distance, 0.0, z_drive, 0.0, 0.0, z_far - z_drive, p.pin_bore / 2.0)
        )
        solids, _ = occ.cut(solids, [(3, hole)])
    occ.fragment(solids[:1], solids[1:])
    occ.synchronize()

    for refinement in (1.0, 1.6, 2.5):
        _set_sizes(gmsh, p, refinement)
        if _generate(gmsh):
            return _tetrahedra(gmsh)
        gmsh.model.mesh.clear()
    raise InputError(
        p.where,
        "carrier",
        "no sound FE mesh: some edges nearly touch",
        "move hub, seat, bore and pin diameters apart by a few mm",
    )


def _generate(gmsh: ModuleType) -> bool:
    """Mesh and improve; False where chords of neighbouring curves cross."""
    try:
        gmsh.model.mesh.generate(3)
    except Exception:  # gmsh raises nothing more specific
        return False
    if list(gmsh.model.mesh.getElements(3)[0]) != [4] or _flattest(gmsh) < 1e-4:
        return False  # and Netgen would crash on cells without volume
    gmsh.model.mesh.optimize("Netgen")
    gmsh.model.mesh.optimize("")
    return _flattest(gmsh) > 1e-3


def _flattest(gmsh: ModuleType) -> float:
    """Smallest |det [e1 e2 e3]|/(|e1||e2||e3|) of all cells."""
    points, cells = _tetrahedra(gmsh)
    e = points[cells[:, 1:]] - points[cells[:, :1]]
    return float((np.abs(np.linalg.det(e)) / np.linalg.norm(e, axis=2).prod(axis=1)).min())


def _set_sizes(gmsh: ModuleType, p: CarrierMeshParameters, refinement: float) -> None:
    """Number of straight sides of every curve; a chord keeps clear of the neighbouring curves."""
    thickness = (p.plate_thickness_drive + p.plate_thickness_far) / 2.0
    size = SIZE[p.fidelity] * thickness / refinement
    option = gmsh.option.setNumber
    option("Mesh.MeshSizeMax", size)
    option("Mesh.MeshSizeMin", size / 10.0)
    option("Mesh.MeshSizeExtendFromBoundary", 1)
    option("Mesh.Algorithm", 6)
    option("Mesh.Algorithm3D", 1)
    option("Mesh.Optimize", 1)
    option("Mesh.OptimizeNetgen", 0)
    samples, ends = {}, {}
    for _, curve in gmsh.model.getEntities(1):
        low, high = (float(u[0]) for u in gmsh.model.getParametrizationBounds(1, curve))
        at = gmsh.model.getValue(1, curve, np.linspace(low, high, _SAMPLES))
        samples[curve] = np.reshape(at, (-1, 3))
        ends[curve] = {abs(tag) for _, tag in gmsh.model.getBoundary([(1, curve)])}
    for curve, at in samples.items():
        length = float(np.linalg.norm(np.diff(at, axis=0), axis=1).sum())
        sides = max(round(length / size), 1)
        if gmsh.model.getType(1, curve) == "Circle":
            low, high = gmsh.model.getParametrizationBounds(1, curve)
            turn = float(high[0] - low[0])
            radius = length / turn
            whole = _ROUND[p.fidelity] if radius > 0.4 * p.pin_diameter else _ROUND_BORE
            near = [
                float(cKDTree(other).query(at)[0].min())
                for tag, other in samples.items()
                if tag != curve
                and not ends[tag] & ends[curve]
                and np.abs(other[:, 2] - at[0, 2]).max() < 1e-9
            ]
            # height of a chord over its arc, r (1 - cos(turn/2n)) ≈ r turn²/(8 n²) <= distance/3
            clear = turn * sqrt(3.0 * radius / (8.0 * max(min(near, default=radius), 1e-4 * size)))
            sides = max(sides, round(refinement * whole * turn / (2.0 * pi)), ceil(clear))
        gmsh.model.mesh.setTransfiniteCurve(curve, sides + 1)


def _tetrahedra(gmsh: ModuleType) -> tuple[Array, Ints]:
    """Vertices in use (n, 3) and right-handed cells (m, 4) of the gmsh model."""
    types, _, connectivity = gmsh.model.mesh.getElements(3)
    if list(types) != [4]:
        raise FlexgearError("carrier: gmsh gave other elements than tetrahedra")
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    used, cells = np.unique(connectivity[0].astype(np.int64), return_inverse=True)
    at = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    at[tags.astype(np.int64)] = np.arange(len(tags))
    points = xyz.reshape(-1, 3)[at[used]]
    cells = cells.reshape(-1, 4).astype(np.int64)
    e = points[cells[:, 1:]] - points[cells[:, :1]]
    inverted = np.linalg.det(e) < 0.0
    cells[inverted] = cells[inverted][:, [0, 2, 1, 3]]
    return points, cells


def _half_web(occ: ModuleType, p: CarrierMeshParameters) -> tuple[int, int]:
    """Half a web on the pin's side of the middle line θ = φ, extruded over the gap."""
    phi, edge, start, z = pi / p.planets, p.plate_diameter / 2.0, p.web_start, -p.plate_gap / 2.0
    corner, half = phi - p.web_edge_angle, p.web_half_thickness(start)
    origin, pin = occ.addPoint(0.0, 0.0, z), occ.addPoint(p.center_distance, 0.0, z)
    inner = occ.addPoint(start * cos(phi), start * sin(phi), z)
    outer = occ.addPoint(edge * cos(phi), edge * sin(phi), z)
    on_edge = occ.addPoint(edge * cos(corner), edge * sin(corner), z)
    on_arc = occ.addPoint(start * cos(phi) + half * sin(phi), start * sin(phi) - half * cos(phi), z)
    loop = occ.addCurveLoop(
        [
            occ.addLine(inner, outer),
            occ.addCircleArc(outer, origin, on_edge),
            occ.addCircleArc(on_edge, pin, on_arc),
            occ.addLine(on_arc, inner),
        ]
    )
    made = occ.extrude([(2, occ.addPlaneSurface([loop]))], 0.0, 0.0, p.plate_gap)
    return next(entity for entity in made if entity[0] == 3)
