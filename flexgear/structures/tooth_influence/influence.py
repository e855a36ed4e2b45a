"""Influence of a tooth: compliance of its flank, and what slices of contact lines make of it.

Compliance of a flank by FE: unit loads on the nodes of the flank, along its normal.

The load of a contact line is work-equivalent nodal forces b (n,) on the flank's nodes. With R
(3N, n), unit loads at these nodes along the flank's normal there,

    F = R^T K^{-1} R,   C_ij = b_i^T F b_j

is the FE solution of every pair of loads exactly, symmetric (Betti) and positive definite.

Under a line load a dip forms that deepens without end as the FE mesh is refined. The same loads on
the same FE mesh, with all clamped that lies below the layer under the flank, make the same dip:

    D = F − F_clamped

is free of it, converges, and is positive semidefinite, for clamping takes compliance away. Line
contact on a layer of that depth ("layer" in ``gears.hertz``) puts back what the clamped solution
has taken off, so that the depth drops out of the sum.
Source of the subtraction: Steward 1989 (thesis, Newcastle upon Tyne); Vedmar 1981 (thesis, Lund).
Both add Weber and Banaschek's approach to a point at that depth, which is by
2(1 − ν²)/(πE) [κ_layer − κ_point] w less than the clamped layer's (about 1 % of a pair of steel).

A body whose teeth are tied to nodes (FE ring) has in its own flexibility what the averaging tie
takes in: the resultants of the flank's load, spread linearly over the tooth's base section. Of the
same segment that part is taken off, too,

    D <- D − G T G^T,   T = B K^{-1} B^T  (6, 6),   G (n, 6): flank along its normal by q = B u,

so that tooth and node together are the segment in one piece, whatever the tie cannot follow, and
the depth at which it is held drops out (G T G^T has the same). Holding the tooth at its base
section instead would leave out how that section warps: 5 % of an even load, a quarter where the
load changes along the face (``validation/tooth_influence``).

Only the loaded flank, −θ, is tabulated: the +θ one follows by half a turn about the tooth's radial
axis, the other hand of helix by reflection.

Influence between slices of contact lines on a tooth, from the compliance of its flank.

A slice spreads its load evenly along its piece of the contact line: b_i (n,) are the means over
the piece of the FE shape functions at the flank's nodes, and the mean displacement there is
b_i^T u. So

    C_ij = b_i^T D b_j        displacement of slice i along the normal per force on slice j, m/N

for any contact line, oblique ones too, without a table by position: it is symmetric and never
indefinite wherever slices lie, and between nodes it is the FE solution itself, not a guess.
(Interpolating C between tabulated contact lines would need a table for every slope and every set of
slices; interpolating a table over two points of the flank would be neither symmetric nor definite.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.arrays import Array, Ints
from flexgear.gears.hertz import ContactBody
from flexgear.gears.tooth import ToothGeometry
from flexgear.structures.bodies import rigid_motion
from flexgear.structures.fe_mesh.tooth_segment import SegmentParameters, ToothSegment, tooth_segment
from flexgear.structures.fem.assembly import (
    FeModel,
    edge_nodes,
    facet_nodes,
    facet_sample,
    nodes_between,
)
from flexgear.structures.fem.ties import averaging_tie
from flexgear.structures.linalg.dense import blocks
from flexgear.structures.linalg.sparse import flexibility

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)  # of a slice's piece within a layer
_TOGETHER = 200  # contact lines at a time


@dataclass(frozen=True, eq=False)
class FlankPlaces:
    """FE nodes of a flank and places of slices among them.

    roll: (p + 1,) rows of nodes by √(r² − r_b²), the place on the line of action from the gear's
    own base tangent point, m, equally spaced in roll²; z: (q + 1,) layer borders along the face,
    equally spaced, m; slope: d roll/dz of contact lines on this flank (± tan β_b). Nodes (n,) are
    counted by row and layer border, then middles between rows, then between layer borders.
    """

    roll: Array
    z: Array
    slope: float

    def averages(self, roll: Array, z: Array, width: Array) -> sp.csr_matrix:
        """Rows b_i (K, n): means over slices of the shape functions of the flank's nodes."""
        rows, columns = len(self.roll), len(self.z)
        row, x, column, y, weights = self._places(roll, z, width)
        corner = row * columns + column
        between_rows = rows * columns + row * columns + column
        between_layers = (2 * rows - 1) * columns + row * (columns - 1) + column
        nodes = [corner, corner + columns, corner + columns + 1, corner + 1]
        nodes += [between_rows, between_rows + 1]
        nodes += [between_layers, between_layers + columns - 1]
        return _means(np.stack(nodes), weights * _serendipity(x, y), len(self.flipped_nodes()))

    def coarse_averages(self, roll: Array, z: Array, width: Array) -> sp.csr_matrix:
        """Averages on first, middle and last row (parabola in roll²), linear along the face."""
        columns = len(self.z)
        row, x, column, y, weights = self._places(roll, z, width)
        at, last = row + 0.5 * (1 + x), len(self.roll) - 1
        middle = coarse_rows(len(self.roll))[1]
        along = [
            (at - middle) * (at - last) / (middle * last),
            at * (last - at) / (middle * (last - middle)),
            at * (at - middle) / (last * (last - middle)),
        ]
        shape = [a * share for a in along for share in (0.5 * (1 - y), 0.5 * (1 + y))]
        nodes = [k * columns + column + step for k in range(3) for step in (0, 1)]
        return _means(np.stack(nodes), weights * np.stack(shape), 3 * columns)

    def flipped_nodes(self) -> Ints:
        """Permutation (n,) of the flank's nodes under z -> −z: entry i is the node at the mirrored
        place of node i."""
        rows, columns = len(self.roll), len(self.z)
        start, order = 0, []
        for shape in ((rows, columns), (rows - 1, columns), (rows, columns - 1)):
            size = shape[0] * shape[1]
            order.append(start + np.arange(size).reshape(shape)[:, ::-1].ravel())
            start += size
        return np.concatenate(order)

    def _places(self, roll: Array, z: Array, width: Array) -> tuple[Array, ...]:
        """Points (K, p) of slices, cut at layer borders: element row and place in it, −1 … 1,
        element column and place in it, weight (a slice's sum to 1)."""
        roll, z, half = (np.asarray(a, dtype=float) for a in (roll, z, 0.5 * np.asarray(width)))
        step, count = self.z[1] - self.z[0], len(self.z) - 1
        first = np.clip(np.floor((z - half - self.z[0]) / step + 1e-9), 0, count - 1)
        pieces = int(np.ceil(2 * half.max() / step - 1e-9)) + 1
        borders = self.z[0] + step * (first[:, None] + np.arange(pieces + 1))
        borders[:, 0], borders[:, -1] = -np.inf, np.inf  # beyond the face's ends, too
        cut = np.clip(borders, (z - half)[:, None], (z + half)[:, None])
        middle, reach = 0.5 * (cut[:, 1:] + cut[:, :-1]), 0.5 * np.diff(cut, axis=1)
        at = (middle[..., None] + reach[..., None] * _POINTS).reshape(len(z), -1)
        weights = (0.5 * reach / half[:, None])[..., None] * _WEIGHTS
        place = np.maximum(roll[:, None] + self.slope * (at - z[:, None]), 0.0)
        top, bottom = self.roll[0] ** 2, self.roll[-1] ** 2
        row, x = _element((place**2 - top) / (bottom - top), len(self.roll) - 1)
        column, y = _element((at - self.z[0]) / (step * count), count)
        return row, x, column, y, weights.reshape(len(z), -1)


@dataclass(frozen=True, eq=False)
class FlankCompliance(FlankPlaces):
    """Compliance D (n, n) m/N between the nodes of one flank, along its normal. As made it is that
    of the −θ flank of a tooth with the gear's hand of helix; the slope tells flank and hand apart.
    """

    compliance: Array

    def matrix(self, roll: Array, z: Array, width: Array) -> Array:
        """C (…, K, K) m/N of slices: roll, z of their middles and axial width (…, K) m.

        Symmetric; positive definite while there are fewer slices than nodes along the face.
        Slices beyond the flank's ends act at its ends.
        """
        shape = np.broadcast_shapes(np.shape(roll), np.shape(z), np.shape(width))
        k, n = shape[-1], len(self.compliance)
        lines = (np.broadcast_to(a, shape).reshape(-1, k) for a in (roll, z, width))
        roll, z, width = (np.ascontiguousarray(a, dtype=float) for a in lines)
        out = np.empty((len(roll), k, k))
        for some in blocks(len(roll), _TOGETHER):
            means = self.averages(roll[some].ravel(), z[some].ravel(), width[some].ravel())
            motion = (means @ self.compliance).reshape(-1, k, n)
            c = motion @ means.toarray().reshape(-1, k, n).swapaxes(1, 2)
            out[some] = 0.5 * (c + c.swapaxes(1, 2))
        return out.reshape(*shape, k)

    def turned(self) -> Self:
        """The +θ flank: half a turn about the tooth's radial axis, z -> −z, +θ <-> −θ."""
        return self.mirrored()

    def mirrored(self) -> Self:
        """The flank with the other hand of helix: z -> −z."""
        at = self.flipped_nodes()
        return replace(self, compliance=self.compliance[np.ix_(at, at)], slope=-self.slope)


@dataclass(frozen=True, eq=False)
class ToothInfluence(FlankCompliance):
    """Compliance of one flank of a tooth, without the dip of line contact.

    depth: (p + 1,) at which the dip is cut off, m; young Pa, poisson;
    neighbour: (2, m, m) m/N, from first, middle and last row to the same of the next tooth in +θ
    and of the one after that, None where neighbours are not counted.
    """

    depth: Array
    young: float
    poisson: float
    neighbour: Array | None = None

    def coupling(self, slices: Sequence[Array], further: Sequence[Array], steps: int = 1) -> Array:
        """C (…, K, K') m/N: displacement of slices on a tooth per force on slices of the next one
        in +θ, or the one after that (steps 2); each (roll, z, width), (…, K) m. ValueError where
        neighbours are not counted."""
        if self.neighbour is None:
            raise ValueError("neighbouring teeth of this body couple through its own FE model")
        shape, other = np.shape(slices[0]), np.shape(further[0])[-1]
        averages, further_averages = (
            self.coarse_averages(*(np.ravel(a) for a in s)) for s in (slices, further)
        )
        between = self.neighbour[steps - 1]
        motion = (averages @ between).reshape(-1, shape[-1], len(between))
        means = further_averages.toarray().reshape(-1, other, len(between))
        return np.asarray(motion @ means.swapaxes(1, 2)).reshape(*shape, other)

    def contact_body(self, roll: Array) -> ContactBody:
        """The layer whose line contact belongs to ``matrix``, at places (K,) on the flank."""
        order = np.argsort(self.roll)
        depth = np.interp(roll, self.roll[order], self.depth[order])
        return ContactBody(self.young, self.poisson, depth, "layer")

    def turned(self) -> Self:
        """Neighbours change sides with it."""
        near = self.neighbour
        return replace(self, neighbour=None if near is None else near.swapaxes(1, 2)).mirrored()

    def mirrored(self) -> Self:
        """With its neighbours."""
        near = self.neighbour
        if near is not None:
            coarse = np.arange(near.shape[1]).reshape(3, -1)[:, ::-1].ravel()
            near = near[:, coarse[:, None], coarse]
        return replace(super().mirrored(), neighbour=near)


def influence_of(
    parameters: SegmentParameters,
    young: float,
    poisson: float,
    *,
    tied: bool = False,
    plane_strain: bool = False,
) -> ToothInfluence:
    """Influence of the middle tooth of a segment held on its patch "held"; E in Pa.

    tied: without what the node of an averaging tie on the tooth's base section takes in, and
    without the next tooth, which such nodes move; plane_strain: no axial displacement anywhere
    (spur teeth only).
    """
    segment, j = tooth_segment(parameters), parameters.middle
    model = FeModel(segment.fe_mesh, young, poisson, density=1.0)
    flank, has_next = flank_nodes(segment, model, j), j + 1 < parameters.teeth and not tied
    free = free_displacements(model, plane_strain=plane_strain)
    unit = unit_loads(segment, model, flank)
    neighbours = (j + 1, j - 1) if has_next else ()
    more = [unit_loads(segment, model, coarse_nodes(segment, k)) for k in neighbours]
    more += [root_tie(segment, model).T] if tied else []
    whole = held_flexibility(model, free, sp.hstack([unit, *more]))
    layer = np.zeros_like(free)
    rows = slice(None, -1)  # the base section's ends belong to the rim, too
    surface, inner = segment.surface_nodes[j, rows], segment.inner_nodes[j, rows]
    layer[nodes_between(model, surface.ravel(), inner.ravel())] = True
    n = len(flank)
    compliance, neighbour = whole[:n, :n] - held_flexibility(model, layer & free, unit), None
    if tied:
        motion = carried_by_tie(segment, model.nodes[flank])
        compliance -= motion @ whole[n:, n:] @ motion.T
        compliance = 0.5 * (compliance + compliance.T)
    if has_next:
        order = np.argsort(flank)
        at = order[np.searchsorted(flank[order], coarse_nodes(segment, j))]
        after, before = slice(n, n + len(at)), slice(n + len(at), None)
        neighbour = np.stack([whole[at, after], whole[before, after]])
    return ToothInfluence(
        roll=segment.roll,
        z=segment.z,
        slope=parameters.roll_slope,
        depth=segment.depth,
        compliance=compliance,
        young=young,
        poisson=poisson,
        neighbour=neighbour,
    )


def flank_nodes(segment: ToothSegment, model: FeModel, tooth: int) -> Ints:
    """Nodes (n,) of a −θ flank: its vertices by row and layer border, then the middles between
    rows, then those between layer borders."""
    at = segment.flank_nodes[tooth]
    between_rows = edge_nodes(model, at[:-1], at[1:])
    between_layers = edge_nodes(model, at[:, :-1], at[:, 1:])
    return np.concatenate([at.ravel(), between_rows.ravel(), between_layers.ravel()])


def coarse_nodes(segment: ToothSegment, tooth: int) -> Ints:
    """Vertices (m,) of the first, middle and last row of a −θ flank by row and layer border."""
    return segment.flank_nodes[tooth][coarse_rows(len(segment.roll))].ravel()


def coarse_rows(rows: int) -> Ints:
    """Indices of the first, middle and last of ``rows`` rows."""
    return np.array([0, rows // 2, rows - 1])


def flank_normals(segment: ToothSegment, points: Array) -> Array:
    """Outward normals (n, 3) of −θ flanks of a segment at points (n, 3)."""
    return involute_normals(segment.parameters.tooth, segment.parameters.helix_rate, points)


def involute_normals(
    tooth: ToothGeometry, helix_rate: float, points: Array, side: int = -1
) -> Array:
    """Outward normals (n, 3) of −θ flanks (+θ: side 1) at points (n, 3): cos α e_θ on the flank's
    side ± sin α e_r in the section, (upper sign external), and with the helix tan β_b = r_b κ
    along z."""
    radius = np.hypot(points[:, 0], points[:, 1])
    radial = points[:, :2] / radius[:, None]
    around = np.column_stack([-radial[:, 1], radial[:, 0]])
    angle = tooth.pressure_angle(radius)[:, None]
    section = tooth.outward * np.sin(angle) * radial + side * np.cos(angle) * around
    slope = -side * tooth.base_radius * helix_rate
    return np.column_stack([section, np.full(len(points), slope)]) / np.hypot(1.0, slope)


def unit_loads(segment: ToothSegment, model: FeModel, nodes: Ints) -> sp.csr_matrix:
    """R (3N, k): unit loads at nodes (k,) of −θ flanks along the normals there."""
    rows = 3 * nodes[:, None] + np.arange(3)
    columns = np.broadcast_to(np.arange(len(nodes))[:, None], rows.shape)
    loads = flank_normals(segment, model.nodes[nodes])
    entries = (loads.ravel(), (rows.ravel(), columns.ravel()))
    return sp.csr_matrix(entries, shape=(model.dofs, len(nodes)))


def root_tie(segment: ToothSegment, model: FeModel) -> sp.csr_matrix:
    """B (6, 3N) of an averaging tie of the middle tooth, like a ring's in ``interfaces``."""
    name = f"tooth_root_{segment.parameters.middle + 1:03d}"
    root = facet_sample(model, segment.fe_mesh.facets[name])
    return sp.csr_matrix(averaging_tie(name, _tie_place(segment), root).rows)


def carried_by_tie(segment: ToothSegment, points: Array) -> Array:
    """G (k, 6): displacement at points (k, 3) of the −θ flank along the normal there by unit
    motions of the tie's node."""
    motion = rigid_motion(points - _tie_place(segment))
    return np.einsum("ki,kij->kj", flank_normals(segment, points), motion)


def free_displacements(model: FeModel, *, plane_strain: bool) -> NDArray[np.bool_]:
    """Which displacements (N, 3) are free of a segment that is held on its patch "held"."""
    free = np.ones((len(model.nodes), 3), dtype=bool)
    free[facet_nodes(model, model.fe_mesh.facets["held"])] = False
    free[:, 2] &= not plane_strain
    return free


def held_flexibility(model: FeModel, free: NDArray[np.bool_], loads: sp.sparray) -> Array:
    """R^T K^{-1} R (k, k) of loads R (3N, k); displacements that are not free (N, 3) are zero."""
    free_dofs = np.flatnonzero(free)
    return flexibility(
        model.stiffness[free_dofs][:, free_dofs].tocsr(), sp.csr_matrix(loads)[free_dofs].tocsc()
    )


def _tie_place(segment: ToothSegment) -> Array:
    return np.array([segment.parameters.tooth.reference_radius, 0.0, 0.0])


def _element(share: Array, count: int) -> tuple[Array, Array]:
    """Index of the element, of ``count`` equal ones, and position in it, −1 … 1, of shares 0 … 1;
    limited to the ends."""
    at = np.clip(share, 0.0, 1.0) * count
    number = np.minimum(at.astype(np.int64), count - 1)
    return number, 2 * (at - number) - 1


def _serendipity(x: Array, y: Array) -> Array:
    """Shape functions (8, …) of the corners (−,−), (+,−), (+,+), (−,+), of the middles of the sides
    y = ∓1, and of those of x = ∓1."""
    corners = [
        0.25 * (1 + a * x) * (1 + b * y) * (a * x + b * y - 1)
        for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    sides = [0.5 * (1 - x**2) * (1 + b * y) for b in (-1, 1)]
    return np.stack([*corners, *sides, *(0.5 * (1 - y**2) * (1 + a * x) for a in (-1, 1))])


def _means(nodes: Ints, shape: Array, count: int) -> sp.csr_matrix:
    """Means (K, count) over the points of slices; nodes, weighted shape: (functions, K, points)."""
    slices = np.broadcast_to(np.arange(nodes.shape[1])[:, None], nodes.shape)
    entries = (shape.ravel(), (slices.ravel(), nodes.ravel()))
    return sp.csr_matrix(entries, shape=(nodes.shape[1], count))
