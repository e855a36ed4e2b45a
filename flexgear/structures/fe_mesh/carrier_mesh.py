"""FE mesh of the planet carrier by gmsh: half sectors, mirrored, turned to every pin, joined.

gmsh (OpenCASCADE) meshes the half sector from a pin at θ = 0 to the middle of the next gap with
straight tetrahedra. For equally spaced planets its mirror image and N rotations make a carrier that
is exactly N-fold periodic and mirror-symmetric. Otherwise there is a half sector for each different
gap; all of them have the same mesh in the plane θ = 0, where they are joined.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import ceil, cos, pi, sin, sqrt
from types import ModuleType

import numpy as np
from scipy.optimize import brentq
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Ints
from flexgear.model.errors import FlexgearError, InputError
from flexgear.structures.bodies import rotation
from flexgear.structures.fe_mesh.carrier import CarrierFeMeshParameters
from flexgear.structures.fe_mesh.fe_mesh import FeMesh, corner_jacobians, welded
from flexgear.structures.fe_mesh.session import gmsh_session, meshing_unit

_SIZE = {"quick": 1.6, "standard": 0.85, "fine": 0.5}  # cell size over mean plate thickness
_ROUND = {"quick": 8, "standard": 16, "fine": 24}  # least number of straight sides of a circle
_ROUND_BORE = 8  # the same for holes much thinner than a pin
_SAMPLES = 33  # points on a curve for its distance to others
_FLATTEST = 1e-3  # least det [e1 e2 e3]/(|e1||e2||e3|) of a cell
_REFINEMENTS = (1.0, 1.3, 1.6, 2.0, 2.5)  # divisors of the cell size that are tried in turn


def carrier_fe_mesh(p: CarrierFeMeshParameters) -> FeMesh:
    """Tetrahedra of the carrier; patches drive, bearing_drive, bearing_far, pin_1 .. pin_N."""
    p.check()
    unit = meshing_unit(p.plate_diameter)
    fe_mesh = _in_gmsh(p.in_units_of(unit))
    return replace(fe_mesh, points=fe_mesh.points * unit)


def _in_gmsh(p: CarrierFeMeshParameters) -> FeMesh:
    """FE mesh of the carrier in the unit of its lengths, made by gmsh."""
    with gmsh_session("carrier") as gmsh:
        for fe_meshes in _half_sectors(gmsh, p):
            halves = [FeMesh(points, cells, "tet", {}) for points, cells in fe_meshes]
            factor = _pin_factor(p, halves[0])  # one for all, which share the plane θ = 0
            rounded = [(_rounded(p, half.points, factor), half.cells) for half in halves]
            if all(corner_jacobians(*half, "tet")[1].min() > _FLATTEST for half in rounded):
                true_pins = [FeMesh(*half, "tet", {}) for half in rounded]
                return _complete(p, true_pins, [_half_patches(p, half) for half in halves])
    problem = "no sound FE mesh: some edges nearly touch"
    remedy = "move hub, seat, bore and pin diameters apart by a few mm"
    raise InputError(p.where, "stage.carrier.fe", problem, remedy)


def _half_patches(p: CarrierFeMeshParameters, half: FeMesh) -> dict[str, Ints]:
    """Patches of the half sector by their exact surfaces; "pin" without a number."""
    facets = half.boundary
    at = half.points[facets]
    gap, tolerance = p.plate_gap / 2.0, 1e-7 * p.plate_diameter
    z_drive, z_far = -gap - p.plate_thickness_drive, gap + p.plate_thickness_far

    def cylinder(x: float, radius: float, low: float, high: float, name: str) -> Ints:
        """Facets on a cylinder about (x, 0) between two heights z."""
        off = np.abs(np.hypot(at[..., 0] - x, at[..., 1]) - radius).max(axis=1)
        z = at[..., 2]
        inside = (z.min(axis=1) > low - tolerance) & (z.max(axis=1) < high + tolerance)
        matching = facets[(off < tolerance) & inside & (np.ptp(z, axis=1) > tolerance)]
        if len(matching) == 0:
            raise FlexgearError(f"carrier: the FE mesh has no facets on {name}")
        return matching

    end = np.abs(at[..., 2] - (z_drive - p.hub_length)).max(axis=1) < tolerance
    seat = p.seat_width / 2.0
    return {
        "drive": facets[end],
        "bearing_drive": cylinder(
            0.0, p.seat_drive_diameter / 2.0, z_drive - p.seat_drive_width, z_drive, "seat_drive"
        ),
        "bearing_far": cylinder(
            0.0, p.seat_far_diameter / 2.0, z_far, z_far + p.seat_far_width, "seat_far"
        ),
        "pin": cylinder(p.center_distance, p.pin_diameter / 2.0, -seat, seat, "pins"),
    }


def _pin_factor(p: CarrierFeMeshParameters, half: FeMesh) -> float:
    """Factor on the radius of the pins' vertices that gives each pin its true volume.

    A polygon inscribed in a circle has a smaller area, to the square of which bending stiffness is
    proportional: 16 straight sides would reduce it by 5 %.
    """
    radius, gap = p.pin_diameter / 2.0, p.plate_gap / 2.0
    centre = half.points[half.cells].mean(axis=1)
    pin = np.hypot(centre[:, 0] - p.center_distance, centre[:, 1]) < radius
    pin_cells = half.cells[pin & (np.abs(centre[:, 2]) < gap)]
    exact = pi * (radius**2 - p.pin_bore**2 / 4.0) * gap  # half of π r² times the length 2 gap

    def excess(factor: float) -> float:
        e = _rounded(p, half.points, factor)[pin_cells]
        return float(np.linalg.det(e[:, 1:] - e[:, :1]).sum() / 6.0 - exact)

    return 1.0 if excess(1.0) >= 0.0 else float(brentq(excess, 1.0, 1.5))


def _rounded(p: CarrierFeMeshParameters, points: Array, factor: float) -> Array:
    """Vertices (n, 3), those on the pin's surface moved to ``factor`` times its radius."""
    x, y, z = points[:, 0] - p.center_distance, points[:, 1], points[:, 2]
    tolerance = 1e-7 * p.plate_diameter
    skin = np.abs(np.hypot(x, y) - p.pin_diameter / 2.0) < tolerance
    skin &= np.abs(z) < p.plate_gap / 2.0 + tolerance
    out = points.copy()
    out[skin, 0] = p.center_distance + x[skin] * factor
    out[skin, 1] = y[skin] * factor
    return out


def _half_sectors(
    gmsh: ModuleType, p: CarrierFeMeshParameters
) -> Iterator[list[tuple[Array, Ints]]]:
    """FE meshes of the half sectors, the coarsest first: vertices (n, 3) and right-handed cells
    (m, 4) for each of p.half_gaps. Those that gmsh cannot make are skipped."""
    halves = [_solids(gmsh.model.occ, p, phi) for phi in p.half_gaps[0]]
    gmsh.model.occ.synchronize()
    for refinement in _REFINEMENTS:
        _set_sizes(gmsh, p, halves, refinement)
        _same_plane(gmsh, p, halves)
        if _generate(gmsh):
            yield [_tetrahedra(gmsh, half) for half in halves]
        gmsh.model.mesh.clear()


def _solids(occ: ModuleType, p: CarrierFeMeshParameters, phi: float) -> list[int]:
    """Volumes of the half sector 0 <= θ <= φ, sharing the faces where they meet."""
    bore, plate, pin = p.hub_bore / 2.0, p.plate_diameter / 2.0, p.pin_diameter / 2.0
    gap, seat = p.plate_gap / 2.0, p.seat_width / 2.0
    z_drive, z_far = -gap - p.plate_thickness_drive, gap + p.plate_thickness_far

    def turned(corners: list[tuple[float, float]]) -> tuple[int, int]:
        """Solid of revolution 0 <= θ <= φ of a polygon in the (r, z) plane."""
        points = [occ.addPoint(r, 0.0, z) for r, z in dict.fromkeys(corners)]  # each once
        lines = [occ.addLine(a, b) for a, b in zip(points, points[1:] + points[:1], strict=True)]
        face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        entities = occ.revolve([(2, face)], 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, phi)
        return next(entity for entity in entities if entity[0] == 3)

    hub, seat_drive = p.hub_diameter / 2.0, p.seat_drive_diameter / 2.0
    z_seat, z_end = z_drive - p.seat_drive_width, z_drive - p.hub_length
    seat_far, z_seat_far = p.seat_far_diameter / 2.0, z_far + p.seat_far_width
    solids = [
        turned(
            [(bore, z_end), (hub, z_end), (hub, z_seat), (seat_drive, z_seat)]
            + [(seat_drive, z_drive), (plate, z_drive), (plate, -gap), (bore, -gap)]
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
    solids.append(_half_web(occ, p, phi))
    if p.pin_bore > 0.0:
        hole = occ.addCylinder(
            *(p.center_distance, 0.0, z_drive, 0.0, 0.0, z_far - z_drive, p.pin_bore / 2.0)
        )
        solids, _ = occ.cut(solids, [(3, hole)])
    entities, _ = occ.fragment(solids[:1], solids[1:])
    return sorted({tag for dim, tag in entities if dim == 3})


def _same_plane(gmsh: ModuleType, p: CarrierFeMeshParameters, halves: list[list[int]]) -> None:
    """Copy the mesh of the first half sector's faces at θ = 0 to those of the others."""
    if len(halves) == 1:
        return
    faces, centres = [], []
    for half in halves:
        boundary = gmsh.model.getBoundary([(3, v) for v in half], combined=False, oriented=False)
        tags = sorted({tag for _, tag in boundary})
        centre = np.array([gmsh.model.occ.getCenterOfMass(2, tag) for tag in tags])
        on = np.abs(centre[:, 1]) < 1e-7 * p.plate_diameter
        faces.append(np.array(tags)[on])
        centres.append(centre[on])
    for face, at in zip(faces[1:], centres[1:], strict=True):
        distance, first = cKDTree(centres[0]).query(at)
        if len(face) != len(faces[0]) or distance.max() > 1e-7 * p.plate_diameter:
            raise FlexgearError("carrier: half sectors differ in the plane of a pin")
        gmsh.model.mesh.setPeriodic(2, face, faces[0][first], np.eye(4).ravel())


def _generate(gmsh: ModuleType) -> bool:
    """Mesh and improve; whether that succeeded, which it does not where chords cross."""
    try:
        gmsh.model.mesh.generate(3)
    except Exception:  # gmsh raises nothing more specific
        return False
    volumes = [gmsh.model.mesh.getElements(3, v) for _, v in gmsh.model.getEntities(3)]
    if any(list(kinds) != [4] for kinds, _, _ in volumes):
        return False
    if max(nodes.max() for _, _, (nodes,) in volumes) > gmsh.model.mesh.getNodes()[0].max():
        return False  # gmsh has not finished a volume
    if _flattest(gmsh) < 1e-4:
        return False  # Netgen crashes on cells without volume
    gmsh.model.mesh.optimize("Netgen")
    gmsh.model.mesh.optimize("")
    return _flattest(gmsh) > _FLATTEST


def _flattest(gmsh: ModuleType) -> float:
    """Smallest |det [e1 e2 e3]|/(|e1||e2||e3|) of all cells."""
    points, cells = _tetrahedra(gmsh, [tag for _, tag in gmsh.model.getEntities(3)])
    e = points[cells[:, 1:]] - points[cells[:, :1]]
    return float((np.abs(np.linalg.det(e)) / np.linalg.norm(e, axis=2).prod(axis=1)).min())


def _set_sizes(
    gmsh: ModuleType, p: CarrierFeMeshParameters, halves: list[list[int]], refinement: float
) -> None:
    """Set cell sizes, and the number of straight sides of every curve, the same for curves that
    half sectors have in common."""
    size = _SIZE[p.fidelity] * p.plate_thickness / refinement
    option = gmsh.option.setNumber
    option("Mesh.MeshSizeMax", size)
    option("Mesh.MeshSizeMin", size / 10.0)
    option("Mesh.MeshSizeExtendFromBoundary", 1)
    option("Mesh.Algorithm", 6)
    option("Mesh.Algorithm3D", 1)
    option("Mesh.Optimize", 1)
    option("Mesh.OptimizeNetgen", 0)
    sides: dict[int, int] = {}
    middles: list[Array] = []
    for half in halves:
        samples = _samples(gmsh, half)
        sides |= _sides(gmsh, p, samples, size, refinement)
        middles += [at[_SAMPLES // 2] for at in samples.values()]
    alike = cKDTree(np.array(middles)).query_ball_point(middles, 1e-7 * p.plate_diameter)
    curves = list(sides)
    for curve, others in zip(curves, alike, strict=True):
        most = max(sides[curves[k]] for k in others)
        gmsh.model.mesh.setTransfiniteCurve(curve, most + 1)


def _samples(gmsh: ModuleType, volumes: list[int]) -> dict[int, Array]:
    """Points (_SAMPLES, 3) along every curve of volumes, by the curve's tag."""
    faces = gmsh.model.getBoundary([(3, v) for v in volumes], combined=False, oriented=False)
    edges = gmsh.model.getBoundary(faces, combined=False, oriented=False)
    samples = {}
    for curve in sorted({tag for _, tag in edges}):
        low, high = (float(u[0]) for u in gmsh.model.getParametrizationBounds(1, curve))
        at = gmsh.model.getValue(1, curve, np.linspace(low, high, _SAMPLES))
        samples[curve] = np.reshape(at, (-1, 3))
    return samples


def _sides(
    gmsh: ModuleType,
    p: CarrierFeMeshParameters,
    samples: dict[int, Array],
    size: float,
    refinement: float,
) -> dict[int, int]:
    """Number of straight sides of each curve, enough that no chord meets a neighbouring curve."""
    side_of = {}
    ends = {c: {abs(tag) for _, tag in gmsh.model.getBoundary([(1, c)])} for c in samples}
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
                and np.abs(other[:, 2] - at[0, 2]).max() < 1e-9 * p.plate_diameter
            ]
            # height of a chord over its arc, r (1 - cos(turn/2n)) ≈ r turn²/(8 n²) <= distance/3
            clear = turn * sqrt(3.0 * radius / (8.0 * max(min(near, default=radius), 1e-4 * size)))
            sides = max(sides, round(refinement * whole * turn / (2.0 * pi)), ceil(clear))
        else:
            off = 2.0 * np.hypot(at[:, 0] - p.center_distance, at[:, 1])
            chord = pi * p.pin_diameter / _ROUND[p.fidelity]
            for diameter, longest in ((p.pin_bore, p.pin_bore), (p.pin_diameter, 2.0 * chord)):
                if diameter and np.abs(off - diameter).max() < 1e-7 * p.plate_diameter:
                    sides = max(sides, ceil(length / longest))  # else facets would cross the pin
        side_of[curve] = sides
    return side_of


def _tetrahedra(gmsh: ModuleType, volumes: list[int]) -> tuple[Array, Ints]:
    """Vertices (n, 3) and right-handed cells (m, 4) of volumes of the gmsh model."""
    nodes = [gmsh.model.mesh.getElementsByType(4, volume)[1] for volume in volumes]
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    used, cells = np.unique(np.concatenate(nodes).astype(np.int64), return_inverse=True)
    at = np.empty(int(tags.max()) + 1, dtype=np.int64)
    at[tags.astype(np.int64)] = np.arange(len(tags))
    points = xyz.reshape(-1, 3)[at[used]]
    cells = cells.reshape(-1, 4).astype(np.int64)
    e = points[cells[:, 1:]] - points[cells[:, :1]]
    inverted = np.linalg.det(e) < 0.0
    cells[inverted] = cells[inverted][:, [0, 2, 1, 3]]
    return points, cells


def _half_web(occ: ModuleType, p: CarrierFeMeshParameters, phi: float) -> tuple[int, int]:
    """Half of a web, on the pin's side of the middle line θ = φ, extruded over the gap."""
    web, z = p.web(phi), -p.plate_gap / 2.0
    edge, start, at = web.edge, web.start, phi - web.phi
    corner, half = phi - web.edge_angle, web.half_thickness(start)
    origin = occ.addPoint(0.0, 0.0, z)
    pin = occ.addPoint(p.center_distance * cos(at), p.center_distance * sin(at), z)
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
    entities = occ.extrude([(2, occ.addPlaneSurface([loop]))], 0.0, 0.0, p.plate_gap)
    return next(entity for entity in entities if entity[0] == 3)


def _complete(
    p: CarrierFeMeshParameters, halves: list[FeMesh], patches: list[dict[str, Ints]]
) -> FeMesh:
    """The carrier: for every pin the half sector of the gap after it and the mirror image of that
    of the gap before it, with common vertices welded."""
    kinds, order, following = p.half_gaps
    before, tolerance, count = np.roll(following, 1), 1e-7 * p.plate_diameter, p.planets
    exact = [
        _on_planes(half.points, phi, tolerance) for half, phi in zip(halves, kinds, strict=True)
    ]
    turns = [rotation(angle).T for angle in p.angles[order]]
    places = [exact[k] @ turn for k, turn in zip(following, turns, strict=True)]
    places += [(exact[k] * [1.0, -1.0, 1.0]) @ t for k, t in zip(before, turns, strict=True)]
    starts = np.cumsum([0, *map(len, places)])
    points, number = welded(np.concatenate(places), tolerance)

    def sector(i: int, rows: list[Ints]) -> Ints:
        """Vertex numbers of rows of the two half sectors at pin i; mirrored rows are reordered to
        stay right-handed."""
        mirrored = rows[before[i]].copy()
        mirrored[:, [0, 1]] = mirrored[:, [1, 0]]
        halves = [starts[i] + rows[following[i]], starts[count + i] + mirrored]
        return number[np.concatenate(halves)]

    cells = np.concatenate([sector(i, [half.cells for half in halves]) for i in range(count)])
    facets = {
        name: np.concatenate([sector(i, [part[name] for part in patches]) for i in range(count)])
        for name in ("drive", "bearing_drive", "bearing_far")
    }
    pins = {int(order[i]): sector(i, [part["pin"] for part in patches]) for i in range(count)}
    facets |= {f"pin_{pin + 1}": pins[pin] for pin in range(count)}
    if p.drive_side == "+z":
        points[:, 2] *= -1.0
        cells = cells[:, [1, 0, 2, 3]]
        facets = {name: rows[:, ::-1] for name, rows in facets.items()}
    return FeMesh(points, cells, "tet", facets)


def _on_planes(points: Array, phi: float, tolerance: float) -> Array:
    """Vertices of the half sector 0 <= θ <= φ, those near θ = 0 or θ = φ moved exactly there."""
    points = points.copy()
    web = np.abs(points @ [-sin(phi), cos(phi), 0.0]) < tolerance
    points[np.abs(points[:, 1]) < tolerance, 1] = 0.0
    points[web, :2] = np.hypot(*points[web, :2].T)[:, None] * [cos(phi), sin(phi)]
    return points
