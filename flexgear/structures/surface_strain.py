"""Interpolation in a body's FE mesh, and strain at points of its surface.

Strain at a point of a ring's surface is a linear function of the reduced coordinates. The point is
the intersection of the surface of the FE mesh with a ray from the axis at a height z: the last one
for the outer surface, the first one for a tooth root. The strains of the three vertices around it
are interpolated linearly, so that with the gradient G of ``strain`` and the recovery Phi_r

    eps_ij = sum_v w_v (e_i . G_vj Phi_r + e_j . G_vi Phi_r) q / 2 = rows q,

from which strain by rounding errors under rigid motion is removed. Base vectors at a point:
e_1 along the surface across the axis, e_2 along the surface towards +z, e_3 the outward normal.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Ints
from flexgear.structures.bodies import rigid_motion
from flexgear.structures.fe_mesh.fe_mesh import HEX_TO_VTK, facets_of, outer, triangles
from flexgear.structures.reduced import ReducedBody

# tetrahedra of a hexahedron in VTK's order, round the diagonal 0-6
_TETRAHEDRA = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
_CANDIDATES = 48  # cells nearest to a point by their centres, one of which contains the point


class FieldAt:
    """Linear interpolation of fields in tetrahedra; a hexahedron is split into six. Exact for
    linear fields."""

    def __init__(self, body: ReducedBody) -> None:
        self.points = np.asarray(body.points, dtype=float)
        cells = np.asarray(body.cells)
        if cells.shape[1] != 4:
            vtk = cells[:, HEX_TO_VTK]
            cells = np.concatenate([vtk[:, list(corners)] for corners in _TETRAHEDRA])
        self.cells: Ints = cells
        corners = self.points[cells]
        self._centres = cKDTree(corners.mean(axis=1))
        # map x − x_0, x_0 the first vertex of a tetrahedron, to the weights of the three others
        self._inverse = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))

    def weights(self, places: Array) -> sp.csr_matrix:
        """Weights (n, p) of the vertices in the value at places (n, 3) m. Outside the mesh the
        field of the nearest tetrahedron is extrapolated."""
        near = self._centres.query(places, k=min(_CANDIDATES, len(self.cells)))[1]
        near = near.reshape(len(places), -1)
        away = places[:, None] - self.points[self.cells[near, 0]]
        others = np.einsum("nkij,nkj->nki", self._inverse[near], away)
        weights = np.concatenate([1.0 - others.sum(axis=2, keepdims=True), others], axis=2)
        best = np.argmax(weights.min(axis=2), axis=1)
        at = np.arange(len(places))
        rows = np.repeat(at, 4), self.cells[near[at, best]].ravel()
        return sp.csr_matrix((weights[at, best].ravel(), rows), (len(places), len(self.points)))


_EDGE = 1e-6  # distance from a triangle, over its size, at which a ray still meets it


def _closest(corners: Array, place: Array) -> Array:
    """Weights (t, 3) of the corners (t, 3, 3) m of triangles at their points nearest to ``place``
    (3,) m."""
    a, b, c = np.moveaxis(corners, 1, 0)
    edges = np.stack([b - a, c - a], axis=2)
    inner = np.einsum("tij,tj->ti", np.linalg.pinv(edges), place - a)
    candidates = [np.column_stack([1.0 - inner.sum(axis=1), inner])]  # in the plane, on each edge
    for i, j in ((0, 1), (1, 2), (2, 0)):
        first, edge = corners[:, i], corners[:, j] - corners[:, i]
        share = np.einsum("ti,ti->t", place - first, edge) / np.einsum("ti,ti->t", edge, edge)
        on_edge = np.zeros((len(corners), 3))
        on_edge[:, j] = np.clip(share, 0.0, 1.0)
        on_edge[:, i] = 1.0 - on_edge[:, j]
        candidates.append(on_edge)
    weights = np.stack(candidates, axis=1)
    distances = np.linalg.norm(np.einsum("tqk,tki->tqi", weights, corners) - place, axis=2)
    distances[:, 0][weights[:, 0].min(axis=1) < 0.0] = np.inf
    return np.asarray(weights[np.arange(len(corners)), distances.argmin(axis=1)])


@dataclass(frozen=True)
class Ray:
    """Ray from the axis at height z, m, at an angle, rad, to the last surface that it meets; first:
    to the first one."""

    angle: float
    z: float
    first: bool = False


@dataclass(frozen=True, eq=False)
class SurfaceStrain:
    """Strain at n points of a body's surface per reduced coordinate: rows (n, 3, 3, d), components
    along the base vectors of each point."""

    body: ReducedBody
    rows: Array

    def along(self, directions: Sequence[float]) -> Array:
        """Strain (n, d) per coordinate along cos δ e_1 + sin δ e_2; directions: δ (n,), rad."""
        t = np.column_stack([np.cos(directions), np.sin(directions)])
        return np.einsum("na,nb,nabd->nd", t, t, self.rows[:, :2, :2])

    def hoop_stress(self, young_modulus: float, poisson_ratio: float) -> Array:
        """Stress (n, d) along e_1, Pa, per coordinate: E/(1 - nu^2) (eps_1 + nu eps_2), for the
        stress along the normal of a surface without load is zero."""
        strain = self.rows[:, 0, 0] + poisson_ratio * self.rows[:, 1, 1]
        return young_modulus / (1.0 - poisson_ratio**2) * strain


@dataclass(frozen=True, eq=False)
class Surface:
    """Surface of a body's FE mesh as triangles."""

    body: ReducedBody

    @cached_property
    def triangles(self) -> Ints:
        """(t, 3) vertex numbers; a quadrilateral is two of them."""
        cells = np.asarray(self.body.cells)
        facets = facets_of(cells[:, HEX_TO_VTK] if cells.shape[1] == 8 else cells)
        return triangles(outer(facets))

    def meeting(self, ray: Ray) -> tuple[Ints, Array, Array] | None:
        """Vertices (3,), their weights (3,) and base vectors (3, 3) where a ray meets the surface;
        None where it meets none."""
        towards = np.array([math.cos(ray.angle), math.sin(ray.angle), 0.0])
        centers, radii = self._spheres  # of the triangles whose spheres the ray's line meets
        sideways = centers[:, 0] * towards[1] - centers[:, 1] * towards[0]
        near = np.flatnonzero(sideways**2 + (centers[:, 2] - ray.z) ** 2 <= radii**2)
        corners = np.asarray(self.body.points)[self.triangles[near]]
        a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        normal = np.cross(a, b)
        across = normal @ towards
        with np.errstate(divide="ignore", invalid="ignore"):
            away = corners[:, 0] - [0.0, 0.0, ray.z]
            along_ray = np.einsum("ti,ti->t", away, normal) / across
            point = along_ray[:, None] * towards - away
            square = np.einsum("ti,ti->t", normal, normal)
            v = np.einsum("ti,ti->t", np.cross(point, b), normal) / square
            w = np.einsum("ti,ti->t", np.cross(a, point), normal) / square
            met = (v > -_EDGE) & (w > -_EDGE) & (v + w < 1 + _EDGE) & (along_ray > 0)
        if not met.any():
            return None
        candidates, choose = np.flatnonzero(met), np.argmin if ray.first else np.argmax
        k = int(candidates[choose(along_ray[candidates])])
        outward = normal[k] / math.sqrt(square[k])
        outward *= np.sign(across[k]) * (-1.0 if ray.first else 1.0)
        along = np.cross([0.0, 0.0, 1.0], outward)
        along /= np.linalg.norm(along)
        base = np.array([along, np.cross(outward, along), outward])
        return self.triangles[near[k]], np.array([1.0 - v[k] - w[k], v[k], w[k]]), base

    def nearest(self, place: Array) -> tuple[Ints, Array, float]:
        """Vertices (3,) around the point of the surface nearest to ``place`` (3,) m, their weights
        (3,), and its distance from there, m."""
        near = self._by_centre.query(place, k=min(_CANDIDATES, len(self.triangles)))[1]
        near = np.atleast_1d(near)
        corners = np.asarray(self.body.points, dtype=float)[self.triangles[near]]
        weights = _closest(corners, place)
        away = np.linalg.norm(np.einsum("tk,tki->ti", weights, corners) - place, axis=1)
        k = int(np.argmin(away))
        return self.triangles[near[k]], weights[k], float(away[k])

    @cached_property
    def _by_centre(self) -> cKDTree:
        return cKDTree(np.asarray(self.body.points)[self.triangles].mean(axis=1))

    def coarseness(self, vertices: Ints) -> float:
        """Longest edge, m, of the triangle between three vertices (3,)."""
        corners = np.asarray(self.body.points)[vertices]
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max())

    def motion(self, vertices: Ints, weights: Array) -> Array:
        """Displacement (3, d) in the body's axes of a point among three vertices (3,) with weights
        (3,), per reduced coordinate; exact for rigid motion, as ``ReducedBody.recover``."""
        body, rows = self.body, (3 * vertices[:, None] + np.arange(3)).ravel()
        field = np.asarray(body.recovery[rows], dtype=float).reshape(3, 3, -1)
        exact = rigid_motion(weights[None] @ np.asarray(body.points)[vertices])[0]
        return body.with_rigid(np.einsum("k,kid->id", weights, field), exact)

    @cached_property
    def _spheres(self) -> tuple[Array, Array]:
        """Centres (t, 3) m and radii (t,) m of spheres that enclose the triangles."""
        corners = np.asarray(self.body.points)[self.triangles]
        centers = corners.mean(axis=1)
        radii = np.linalg.norm(corners - centers[:, None], axis=2).max(axis=1)
        return centers, (1.0 + 4 * _EDGE) * radii

    def strain(self, rays: Sequence[Ray]) -> SurfaceStrain:
        """Strain at the points where rays meet the surface; NaN for rays that meet none."""
        meetings = [self.meeting(ray) for ray in rays]
        rows = np.full((len(rays), 3, 3, len(self.body.mass)), np.nan)
        hit = [meeting is not None for meeting in meetings]
        if any(hit):
            hits = [meeting for meeting in meetings if meeting is not None]
            at, weights, base = (np.array(x) for x in zip(*hits, strict=True))
            strain = self._strain(at, weights)
            rows[hit] = np.einsum("nai,nijd,nbj->nabd", base, strain, base, optimize=True)
        return SurfaceStrain(self.body, rows)

    def _strain(self, vertices: Ints, weights: Array) -> Array:
        """Strain (n, 3, 3, d) per reduced coordinate, along the body's axes, at points among three
        vertices (n, 3) each with weights (n, 3); exactly zero for rigid motion."""
        body, count = self.body, len(vertices)
        place = (np.repeat(np.arange(count), 3), vertices.ravel())
        mean = sp.csr_matrix((weights.ravel(), place), shape=(count, len(body.points)))
        slopes = [(mean @ body.vertex_gradient[j::3]).tocsc() for j in range(3)]
        used = np.unique(np.concatenate([np.flatnonzero(np.diff(s.indptr)) for s in slopes]))
        out = np.empty((count, 3, 3, len(body.mass)))
        for i in range(3):
            recovery = np.asarray(body.recovery[3 * used + i], dtype=float)
            for j in range(3):
                out[:, i, j] = slopes[j][:, used] @ recovery
        return body.with_rigid(0.5 * (out + out.swapaxes(1, 2)))
