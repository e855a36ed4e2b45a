"""A whole plane planetary stage: elastic ring on springs, planets on pins, a sun that floats.

The ring is one body with all its teeth, held by springs on the mean motion of its outer circle
(translation k_r, rotation k_t). Planets and sun are rigid but for their teeth, whose compliance is
that of the held sectors of ``gear_contact``, one for every planet and flank. The carrier stands at
a given angle. Everything per metre of face.

Frames: planet axes as in ``rolling`` for the ring; for the sun their mirror image in x.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg as dense
import scipy.sparse as sp
from cut_teeth.envelope import Points
from cut_teeth.gear import working
from cut_teeth.of_case import gear_of
from cut_teeth.shape import shape
from scipy.spatial import cKDTree
from skfem import MeshTri

from flexgear.arrays import Array
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.stage_view import StageView
from plane_contact import active_set
from plane_contact.body import Body, Elastic
from plane_contact.gear_contact import GearContact, forces_on
from plane_contact.rolling import Candidates, Pair, Rolling
from plane_contact.sector import LOADED, Grid, Sector, marked, teeth_outline, triangles


@dataclass(frozen=True)
class Springs:
    """Per metre of face: ring across the axis (N/m²) and about it (N m/m rad), pins, sun (N/m²)."""

    ring: float
    torsion: float
    pin: float
    sun: float


@dataclass(frozen=True)
class Loaded:
    """At one carrier angle. forces: (2, planets) N/m of the gear meshes with ring and sun, loads:
    (2, planets, 3) of their pairs from the lowest s on; places: (2, planets, 3) their s, m; ring:
    (z, 2) displacement of its teeth's roots, m; planets (N, 3), sun (3,): x, y (m) in the carrier's
    axes for the sun, in their own for planets, and rotation, rad."""

    forces: Array
    loads: Array
    places: Array
    ring: Array
    planets: Array
    sun: Array


class PlaneStage:
    """Bodies of a stage, ready for any of ``angles`` of the carrier."""

    def __init__(
        self, view: StageView, materials: tuple[Elastic, Elastic], springs: Springs, grid: Grid,
        angles: Array,
    ):  # fmt: skip
        """materials: of the gears' teeth and of the ring."""
        material, of_ring = materials
        forces = power_flow(view.case).stages[0].gear_mesh_forces
        paths = stage_paths(view, forces)
        self.view, self.springs, self.angles = view, springs, angles
        self.paths = {kind: paths[kind, ""] for kind in ("ring", "sun")}
        self.load = forces["sun"] / view.stage.face_width
        module = view.stage.normal_module
        self.pairs = {kind: _pair(view, kind) for kind in self.paths}
        self.teeth = sorted(
            {n for a in angles for i in self.planets for n in self._ring_teeth(i, a)}
        )
        self.sun_side = GearContact(self.pairs["sun"], material, module, grid)
        self.ring_sector, self.ring = self._ring_body(of_ring, module, grid)

    @property
    def planets(self) -> range:
        """Their numbers."""
        return range(self.view.stage.planets)

    def at(self, angle: float, window: float) -> Loaded:
        """Equilibrium at a carrier angle; gaps up to ``window`` are looked at, m."""
        parts, closing, compliances = [], [], []
        for i in self.planets:
            for kind in ("ring", "sun"):
                s, _ = self._place(kind, i, angle)
                c = self._rolling(kind, window).candidates(s)
                parts.append((kind, i, s, c))
                closing.append(self._closing(kind, i, c))
                compliances.append(self._compliance(kind, c))
        gap = np.concatenate([c.gap for *_, c in parts])
        on_ring = sp.hstack([self._on_ring(kind, i, angle, c) for kind, i, _, c in parts]).tocsc()
        compliance = dense.block_diag(*compliances) + on_ring.T @ (self.ring.compliance @ on_ring)
        n = len(self.planets)
        support = np.zeros(3 * n + 3)
        support[: 3 * n].reshape(n, 3)[:, :2] = self.springs.pin
        support[3 * n : 3 * n + 2] = self.springs.sun
        load = np.zeros(3 * n + 3)
        load[-1] = -n * self.load * self.pairs["sun"].gear.base_radius
        p, x = active_set.solve(
            gap, 0.5 * (compliance + compliance.T), np.vstack(closing), load, np.diag(support)
        )
        return self._loaded(parts, p, x, on_ring)

    def _loaded(self, parts: list, p: Array, x: Array, on_ring: sp.csc_matrix) -> Loaded:
        n, first = len(self.planets), 0
        loads, places = np.zeros((2, n, len(LOADED))), np.zeros((2, n, len(LOADED)))
        for kind, i, s, c in parts:
            mine = p[first : first + len(c.gap)]
            first += len(c.gap)
            row = 0 if kind == "ring" else 1
            for k, j in enumerate(LOADED):
                loads[row, i, k] = mine[c.pair == k].sum()
                places[row, i, k] = s + j * self.pairs[kind].planet.base_pitch
        u = self.ring.displacement((on_ring @ p).reshape(self.ring.dofs.shape))
        roots = np.asarray(self.at_roots @ u).reshape(2, -1).T
        moved = x[:-3].reshape(n, 3)
        return Loaded(loads.sum(axis=2), loads, places, roots, moved, x[-3:])

    def _place(self, kind: str, planet: int, angle: float) -> tuple[float, int]:
        """s of the pair nearest to the middle of the path, and its index."""
        path = self.paths[kind]
        start = path.position(planet, 0, angle)
        k = round((0.5 * (path.s_lo + path.s_hi) - start) / path.base_pitch)
        return start + k * path.base_pitch, k

    def _ring_teeth(self, planet: int, angle: float) -> list[int]:
        """Numbers of the ring's teeth that may touch, in the order of ``LOADED``."""
        _, k = self._place("ring", planet, angle)
        path = self.paths["ring"]
        middle = int(path.gear_tooth0[planet]) + path.gear_step * k
        return [(middle + j) % path.gear_teeth for j in LOADED]

    def _rolling(self, kind: str, window: float) -> Rolling:
        planet, sun = self.sun_side.sectors
        gear = self.ring_sector if kind == "ring" else sun
        return Rolling(self.pairs[kind], (planet, gear), (np.zeros_like,) * 2, window)

    def _compliance(self, kind: str, c: Candidates) -> Array:
        """Of the planet's teeth, and of the sun's with them."""
        bodies = self.sun_side.bodies[:1] if kind == "ring" else self.sun_side.bodies
        maps = [forces_on(c, b, body) for b, body in enumerate(bodies)]
        return sum(m.T @ (body.compliance @ m) for m, body in zip(maps, bodies, strict=True))

    def _on_ring(self, kind: str, planet: int, angle: float, c: Candidates) -> sp.csr_matrix:
        """Forces on the ring's chain dofs by unit forces of the candidates."""
        size, n = self.ring.dofs.size, len(c.gap)
        if kind != "ring":
            return sp.csr_matrix((size, n))
        teeth = self._ring_teeth(planet, angle)
        s, _ = self._place("ring", planet, angle)
        turn = angle + self.view.stage.planet_angles[planet]
        body = self.pairs["ring"].places(s)[1].angle
        expected = teeth[LOADED.index(0)] * self.pairs["ring"].gear.pitch_angle
        if abs(np.exp(1j * (body + turn - expected)) - 1) > 1e-9:
            raise RuntimeError("ring tooth numbers do not fit the angles")
        count = self.ring.dofs.shape[1]
        chains = np.array([self.teeth.index(t) for t in teeth])
        nodes = chains[c.nodes[1] // count] * count + c.nodes[1] % count
        force = (c.force[1] @ [1, 1j]) * np.exp(1j * (body + turn))
        values = c.weights[1][:, :, None] * np.column_stack([force.real, force.imag])[:, None, :]
        rows = 2 * nodes[:, :, None] + np.arange(2)
        columns = np.broadcast_to(np.arange(n)[:, None, None], rows.shape)
        return sp.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(size, n))

    def _closing(self, kind: str, planet: int, c: Candidates) -> Array:
        """Gaps that unit motions of all planets and the sun close, (n, 3 N + 3)."""
        n = len(self.planets)
        out = np.zeros((len(c.gap), 3 * n + 3))
        d, mirror = c.direction, 1.0 if kind == "ring" else -1.0
        out[:, 3 * planet : 3 * planet + 3] = np.column_stack(
            [mirror * d.real, d.imag, mirror * c.lever]
        )
        if kind == "sun":
            arm = (np.conj(c.point - self.pairs["sun"].distance) * d).imag
            across = (d.real - 1j * d.imag) * np.exp(1j * self.view.stage.planet_angles[planet])
            out[:, -3:] = np.column_stack([across.real, across.imag, arm])
        return out

    def _ring_body(self, material: Elastic, module: float, grid: Grid) -> tuple[Sector, Body]:
        """The ring with fine flanks where planets touch."""
        tooth, fe = self.pairs["ring"].gear, self.view.ring
        outer = tooth.root_radius + fe.rim_thickness
        teeth = teeth_outline(tooth, -1, grid, range(tooth.teeth), self.teeth)
        each = max(1, round(tooth.pitch_angle * outer / (grid.coarse * module)))
        steps = each * tooth.teeth
        circle = outer * np.exp(2j * math.pi * np.arange(steps) / steps)
        rim = np.append(circle, circle[0])
        inner = teeth.points[:-1]  # its last point is its first
        fe_mesh = triangles([circle, inner], teeth.fine, grid, module)
        part = marked(fe_mesh, tooth, -1, grid, teeth, rim)
        body = Body(fe_mesh, material, np.zeros(0, np.int64), self._held(fe_mesh, circle[::each]))
        body.of_chains(part.vertices, part.facets)
        angles = tooth.pitch_angle * np.arange(tooth.teeth)
        share = np.angle(shape(tooth).root[-1]) * np.linspace(-0.8, 0.8, 5)
        place = tooth.root_radius * np.exp(1j * np.add.outer(share, angles))
        probes = body.basis.probes(np.array([place.real.ravel(), place.imag.ravel()]))
        mean = sp.kron(np.full((1, len(share)), 1 / len(share)), sp.identity(tooth.teeth))
        self.at_roots = sp.block_diag([mean, mean]) @ probes
        return part, body

    def _held(self, fe_mesh: MeshTri, rim: Points) -> sp.csr_matrix:
        """Springs on the mean translation and rotation of points of the outer circle, as many as
        teeth: of waves around the ring, only those of that order have a mean there."""
        vertices = cKDTree(fe_mesh.p.T).query(np.column_stack([rim.real, rim.imag]))[1]
        basis = Body.basis_of(fe_mesh)
        x, y = fe_mesh.p[:, vertices]
        n, zero = len(vertices), np.zeros(len(vertices))
        square = x**2 + y**2
        motion = np.array([[zero + 1, zero], [zero, zero + 1], [-y / square, x / square]]) / n
        dofs = basis.nodal_dofs[:, vertices].ravel()
        rows = sp.lil_matrix((3, basis.N))
        rows[:, dofs] = motion.reshape(3, -1)
        k = self.springs
        return (rows.T @ sp.diags([k.ring, k.ring, k.torsion]) @ rows).tocsr()


def _pair(view: StageView, kind: str) -> Pair:
    planet, gear = gear_of(view, "planet"), gear_of(view, kind)
    return Pair(planet, gear, *working(planet, gear))
