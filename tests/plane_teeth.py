"""Plane-strain finite elements of a loaded tooth, its neighbours and the body below them.

The loaded tooth stands on the x axis, loads press its +y flank, one at a time. The body is held on
a circle below the teeth and at both ends of the sector. Teeth are cut by brute force
(``cut_teeth``).
"""

import math
from dataclasses import dataclass

import numpy as np
from cut_teeth.shape import Shape, load_angle, shape
from scipy.sparse.linalg import splu
from skfem import Basis, ElementTriP2, ElementVector, FacetBasis, LinearForm, MeshTri, condense
from skfem.helpers import dot
from skfem.models.elasticity import lame_parameters, linear_elasticity

from flexgear.structures.fe_mesh.session import gmsh_session

NEIGHBOURS = 2  # teeth on either side
ROOT_CHORDS = 16
HELD = 1.27  # root thicknesses below the root section: where Weber's half plane would be held
ELEMENT = ElementVector(ElementTriP2())


@dataclass(frozen=True)
class Load:
    """Hertz pressure on the +y flank: radius of its middle and half width a, m; in the tooth frame
    its middle (2,), unit direction (2,), and where its line crosses the tooth's middle line (x)."""

    radius: float
    half_width: float
    middle: np.ndarray
    direction: np.ndarray
    cross: float
    depth: float

    def pressure(self, x):
        """Of one newton per metre of face, Pa."""
        share = ((x[0] - self.middle[0]) ** 2 + (x[1] - self.middle[1]) ** 2) / self.half_width**2
        return 2 / (math.pi * self.half_width) * np.sqrt(np.maximum(1 - share, 0.0))


@dataclass(frozen=True)
class Deflection:
    """Along a unit line load, m²/N: of the flank less its Hertz part down to the middle line; of
    the root section as a rigid line (foundation); of the middle line where the load crosses it."""

    total: float
    foundation: float
    centre: float

    @property
    def tooth(self):
        """Bending, shear and shortening above the root section."""
        return self.total - self.foundation


def load_at(gear, radius, half_width):
    """The load at a radius on the involute."""
    angle, half = load_angle(gear, radius), float(gear.half_angle(radius))
    return Load(
        radius,
        half_width,
        radius * np.array([math.cos(half), math.sin(half)]),
        np.array([-gear.outward * math.sin(angle), -math.cos(angle)]),
        gear.base_radius / math.cos(angle),
        radius * math.sin(half) / math.cos(angle),
    )


def hertz(load, young, poisson):
    """Compliance of one flank down to the middle line, m²/N (Weber and Banaschek 1953)."""
    plane = (1 - poisson**2) / young
    depth = math.log(2 * load.depth / load.half_width)
    return 2 * plane / math.pi * (depth - poisson / (2 * (1 - poisson)))


def deflections(gear, loads, young, poisson, *, held, size):
    """Plane-strain deflection under each load; held: depth below the root section at which the
    body is held, m; size: of the elements at the tooth, m."""
    tooth, out = shape(gear), []
    fe_mesh, edges = meshed(tooth, loads, held, size)
    basis, _, motions = pressed(fe_mesh, edges, loads, young, poisson)
    for load, u in zip(loads, motions, strict=True):
        node = np.argmin(np.hypot(*(fe_mesh.p.T - load.middle).T))
        flank = float(u[basis.nodal_dofs[:, node]] @ load.direction)
        centre = _at(basis, u, np.array([[load.cross], [0.0]]))[:, 0]
        foundation = _of_root_section(tooth, load, lambda x, u=u: _at(basis, u, x))
        total = flank - hertz(load, young, poisson)
        out.append(Deflection(total, foundation, float(centre @ load.direction)))
    return out


def deflection(gear, load, young, poisson, **options):
    """The same under one load."""
    return deflections(gear, [load], young, poisson, **options)[0]


def pressed(fe_mesh, edges, loads, young, poisson):
    """Basis, forces and displacements (k, dofs) under each load of one newton per metre of face;
    edges: pairs (2, n) of nodes of "contact 0" and so on, and "held"."""
    number = {tuple(pair): k for k, pair in enumerate(np.sort(fe_mesh.facets.T, axis=1))}
    facets = {n: np.array([number[tuple(sorted(e))] for e in edges[n].T]) for n in edges}
    basis = Basis(fe_mesh, ELEMENT)
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)

    forces = []
    for k, load in enumerate(loads):
        pressure = LinearForm(lambda v, w, load=load: load.pressure(w.x) * dot(load.direction, v))
        force = pressure.assemble(FacetBasis(fe_mesh, ELEMENT, facets=facets[f"contact {k}"]))
        forces.append(force / (force @ _uniform(basis, load.direction)))
    inner, _, _, free = condense(stiffness, forces[0], D=basis.get_dofs(facets=facets["held"]))
    solved = np.zeros((len(loads), basis.N))
    factor = splu(inner.tocsc(), "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
    solved[:, free] = factor.solve(np.array(forces)[:, free].T).T
    return basis, forces, solved


def _of_root_section(tooth: Shape, load, motion):
    """The section's rotation and translation, work conjugate to linear normal stress, parabolic
    shear and even tension, carried to the line of the load."""
    x, half = tooth.section.real, tooth.section.imag
    share = np.linspace(-0.98, 0.98, 197)  # chords of the fillet cut the corners off
    u = motion(np.array([np.full_like(share, x), share * half]))
    turn = -np.sum(u[0] * share) / np.sum(share**2) / half
    weight = 1 - share**2
    moved = [u[0].mean(), u[1] @ weight / weight.sum() + turn * (load.cross - x)]
    return float(load.direction @ moved)


def _uniform(basis, direction):
    """Dofs of a unit translation."""
    out = np.zeros(basis.N)
    for dofs in (basis.nodal_dofs, basis.facet_dofs):
        for k in range(2):
            out[dofs[k]] = direction[k]
    return out


def _at(basis, u, x):
    """Displacement (2, n) at points (2, n)."""
    return np.asarray(basis.probes(x) @ u).reshape(2, -1)


class _Outline:
    """gmsh points and curves of the teeth, run through from -y to +y. start: place on the +y root
    of the tooth that is being added where a crack begins, mouth: its point."""

    start, mouth = None, 0

    def __init__(self, gmsh, tooth: Shape, size):
        self.geo, self.size, self.gear = gmsh.model.geo, size, tooth.gear
        self.origin = self.geo.addPoint(0, 0, 0, size)
        self.flank, self.root = (
            np.column_stack([p.real, p.imag]) for p in (tooth.flank, tooth.root)
        )
        self.pitch = tooth.gear.pitch_angle
        self.curves: list[int] = []
        self.roots: list[int] = []
        self.last = 0

    def point(self, place, size=None):
        return self.geo.addPoint(*place, 0.0, size or self.size)

    def arc_to(self, place):
        """Circle about the gear's centre."""
        to = self.point(place)
        self.curves.append(self.geo.addCircleArc(self.last, self.origin, to))
        self.last = to

    def root_to(self, places):
        """Along a root, whose chords must be short, with a point where a crack starts."""
        x, start = places[:, 0], self.start
        if start is None or places[0, 1] < 0 or not min(x) < start[0] < max(x):
            self.roots.append(self.spline_to(places))
            return
        upper = np.sign(x[-1] - x[0]) * (x - start[0]) < 0
        self.spline_to(np.vstack([places[upper], start]))
        self.mouth = self.last
        self.spline_to(places[~upper])

    def spline_to(self, places):
        """Through places (n, 2) to the last of them; its curve."""
        ids = [self.point(place) for place in places]
        self.curves.append(self.geo.addSpline([self.last, *ids]))
        self.last = ids[-1]
        return self.curves[-1]

    def tooth(self, angle, marks=()):
        """From root land to root land; marks: places on the +y flank that end curves."""
        turn = _rotation(angle)
        flip = np.array([1.0, -1.0])
        land = self.gear.root_radius * np.array(
            [math.cos(self.pitch / 2), math.sin(self.pitch / 2)]
        )
        if not self.last:
            self.last = self.first = self.point(turn @ (land * flip))
        self.arc_to(turn @ (self.root[-1] * flip))
        self.root_to((self.root[-2::-1] * flip) @ turn.T)
        self.spline_to((self.flank[-2::-1] * flip) @ turn.T)
        self.arc_to(turn @ self.flank[0])
        cut = [self.spline_to(part @ turn.T) for part in _parts(self.flank, marks)]
        self.root_to(self.root[1:] @ turn.T)
        self.arc_to(turn @ land)
        return cut


def _rotation(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _parts(flank, marks):
    """The flank beyond its first point, cut at marks (k, 2); each part ends with its mark."""
    parts, left, along = [], flank[1:], flank[:, 0]
    sense = np.sign(along[-1] - along[0])
    for mark in marks:
        before = sense * left[:, 0] < sense * mark[0]
        parts.append(np.vstack([left[before], mark]))
        left = left[~before]
    return [*parts, left]


def _marks(gear, loads):
    """Ends and middle of the pressures on the flank, from the tip to the root.

    Along the involute the arc is ρ dρ/r_b with the radius of curvature ρ.
    """
    base, radii = gear.base_radius, []
    for load in loads:
        rho = math.sqrt(load.radius**2 - base**2)
        radii += [math.hypot(base, rho + k * load.half_width * base / rho) for k in (-1, 0, 1)]
    out = sorted(radii, reverse=not gear.internal)
    half = gear.half_angle(np.array(out))
    return np.column_stack([out * np.cos(half), out * np.sin(half)])


def meshed(tooth: Shape, loads, held, size, crack=None, finest=0.0):
    """FE mesh and pairs (2, n) of nodes of its edges "contact 0" and so on by load, "held" and,
    with its ends, "crack"; finest: elements at the crack's end, m. Loads do not overlap."""
    far = tooth.section.real - tooth.gear.outward * held
    with gmsh_session("teeth") as gmsh:
        line = _Outline(gmsh, tooth, size)
        parts = {}
        for j in range(-NEIGHBOURS, NEIGHBOURS + 1):
            line.start = crack[0] if crack and j == 0 else None
            parts[j] = line.tooth(j * line.pitch, () if j else _marks(tooth.gear, loads))
        end = (NEIGHBOURS + 0.5) * line.pitch
        corners = [
            line.point((far * math.cos(a), far * math.sin(a)), 3 * size) for a in (end, 0, -end)
        ]
        edge = [
            line.geo.addLine(line.last, corners[0]),
            line.geo.addCircleArc(corners[0], line.origin, corners[1]),
            line.geo.addCircleArc(corners[1], line.origin, corners[2]),
            line.geo.addLine(corners[2], line.first),
        ]
        surface = line.geo.addPlaneSurface([line.geo.addCurveLoop([*line.curves, *edge])])
        from_tip = np.argsort([load.radius for load in loads])[:: 1 if tooth.gear.internal else -1]
        curves = {f"contact {k}": parts[0][3 * n + 1 : 3 * n + 3] for n, k in enumerate(from_tip)}
        curves["held"] = edge
        sizes = {(*load.middle,): load.half_width / 4 for load in loads}
        if crack:
            curves["crack"] = [line.geo.addLine(line.mouth, line.point(crack[1]))]
            sizes[(*crack[1],)] = finest
        line.geo.synchronize()
        gmsh.model.mesh.embed(1, curves.get("crack", []), 2, surface)
        for curve in line.roots:
            gmsh.model.mesh.setTransfiniteCurve(curve, ROOT_CHORDS + 1)
        fields, refined = gmsh.model.mesh.field, []
        for (x, y), least in sizes.items():
            refined.append(fields.add("MathEval"))
            fields.setString(refined[-1], "F", f"{least} + 0.2*sqrt((x-({x}))^2 + (y-({y}))^2)")
        smallest = fields.add("Min")
        fields.setNumbers(smallest, "FieldsList", refined)
        fields.setAsBackgroundMesh(smallest)
        gmsh.model.mesh.generate(2)
        return _read(gmsh, curves)


def _read(gmsh, curves):
    """scikit-fem's mesh of gmsh's triangles, and pairs of nodes by the name of their curves."""
    tags, places, _ = gmsh.model.mesh.getNodes()
    _, corners = gmsh.model.mesh.getElementsByType(2)
    used, corners = np.unique(corners, return_inverse=True)
    row = np.full(int(tags.max()) + 1, -1)
    row[tags] = np.arange(len(tags))
    points = places.reshape(-1, 3)[row[used], :2]
    fe_mesh = MeshTri(np.ascontiguousarray(points.T), corners.reshape(-1, 3).T.copy())
    pairs = {
        name: np.concatenate([gmsh.model.mesh.getElementsByType(1, c)[1] for c in tags_of])
        for name, tags_of in curves.items()
    }
    return fe_mesh, {
        name: np.searchsorted(used, ends).reshape(-1, 2).T for name, ends in pairs.items()
    }
