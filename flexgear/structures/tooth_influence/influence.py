"""Influence of a tooth: compliance of its flank by FE, and between slices of contact lines.

Compliance of a flank. The load of a contact line is work-equivalent nodal forces b (n,) on the
flank's nodes. With R (3N, n), unit loads at these nodes along the flank's normal there,

    F = R^T K^{-1} R,   C_ij = b_i^T F b_j

is exactly the FE solution of every pair of loads, symmetric (Betti) and positive definite.

The local indentation by a line load grows without limit as the FE mesh is refined. It is the same
for the same loads on the same FE mesh with all clamped that lies below a layer under the flank, so

    D = F − F_clamped

does not include it, converges, and is positive semidefinite, for clamping reduces compliance. Line
contact on a layer of that depth ("layer" in ``gears.hertz``) adds the indentation of the clamped
layer again, so that the sum does not depend on the depth.
Source of the subtraction: Steward 1989 (thesis, Newcastle upon Tyne); Vedmar 1981 (thesis, Lund).
Both add Weber and Banaschek's approach to a point at that depth, which is by
2(1 − ν²)/(πE) [κ_layer − κ_point] w less than the clamped layer's (about 1 % of a pair of steel).

The flexibility of a body with teeth tied to nodes (FE ring) includes the displacement of the tie
under the resultants of the flank's load, which the tie spreads linearly over the tooth's base
section. That part of the segment's compliance is subtracted too,

    D <- D − G T G^T,   T = B K^{-1} B^T  (6, 6),   G (n, 6): flank along its normal by q = B u,

so that D and the node's motion together are the compliance of the whole segment, and the depth
where it is held cancels (it is in G T G^T, too). Holding the tooth at its base section instead
would neglect how that section warps: 5 % of the displacement under an even load, a quarter where
the load changes along the face (``validation/tooth_influence``).

Only the −θ flank is tabulated: the +θ flank follows by half a turn about the tooth's radial axis,
the other hand of helix by reflection.

Influence between slices. The load of a slice is even along its piece of the contact line: b_i (n,)
are the means over the piece of the FE shape functions of the flank's nodes, and the mean
displacement there is b_i^T u. So

    C_ij = b_i^T D b_j        displacement of slice i along the normal per force on slice j, m/N

for any contact line, without a table by position: it is symmetric, never indefinite, and the FE
solution itself also between nodes. (Interpolation between tabulated contact lines would need a
table for every slope and every set of slices; interpolation in a table over two points of the flank
would be neither symmetric nor definite.)
"""

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
_TOGETHER = 200  # contact lines that are processed together


@dataclass(frozen=True, eq=False)
class FlankPlaces:
    """FE nodes of a flank, and interpolation between them for slices of contact lines.

    roll: (p + 1,) rows of nodes by roll length √(r² − r_b²), the distance on the line of action
    from the gear's base tangent point, m, equally spaced in roll²; z: (q + 1,) layer borders along
    the face, equally spaced, m; slope: d roll/dz of contact lines on this flank (± tan β_b). Nodes
    (n,) are counted by row and layer border, then middles between rows, then between layer borders.
    """

    roll: Array
    z: Array
    slope: float

    def averages(self, roll: Array, z: Array, width: Array) -> sp.csr_matrix:
        """Rows b_i (K, n): means over slices of the shape functions of the flank's nodes; roll, z
        of the slices' middles and axial width (K,) m."""
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
        """Means (K, m) over slices of the shape functions of a coarser flank, whose nodes are the
        vertices of the first, middle and last row: quadratic in roll², linear along the face.
        Arguments as of ``averages``."""
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
        """Permutation (n,) of the flank's nodes under z -> −z: entry i is the image of node i."""
        rows, columns = len(self.roll), len(self.z)
        start, order = 0, []
        for shape in ((rows, columns), (rows - 1, columns), (rows, columns - 1)):
            size = shape[0] * shape[1]
            order.append(start + np.arange(size).reshape(shape)[:, ::-1].ravel())
            start += size
        return np.concatenate(order)

    def _places(self, roll: Array, z: Array, width: Array) -> tuple[Array, ...]:
        """Integration points (K, p) of slices, which are cut at layer borders: row of the element
        and coordinate −1 … 1 in it, column and coordinate in it, weight (sum 1 over a slice)."""
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
    """Compliance D (n, n) m/N between the nodes of a flank, along its normal.

    It is computed for the −θ flank of a tooth with the gear's hand of helix; ``turned`` and
    ``mirrored`` give the others, which the sign of ``slope`` distinguishes.
    """

    compliance: Array

    def matrix(self, roll: Array, z: Array, width: Array) -> Array:
        """Influence C (…, K, K) m/N between slices: roll, z of their middles and axial width
        (…, K) m.

        Symmetric; positive definite for fewer slices than nodes along the face. Slices beyond the
        flank's ends act at its ends.
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
    """Compliance D of one flank of a tooth, without the indentation of line contact.

    depth: (p + 1,) of the layer whose indentation is subtracted, m; young Pa, poisson; neighbour:
    (2, m, m) m/N, compliance between vertices of the first, middle and last row (``coarse_nodes``)
    and those of the next tooth in +θ and of the one after, None where it is not included.
    """

    depth: Array
    young: float
    poisson: float
    neighbour: Array | None = None

    def coupling(self, slices: Sequence[Array], further: Sequence[Array], steps: int = 1) -> Array:
        """C (…, K, K') m/N: displacement of slices on a tooth per force on slices of the next tooth
        in +θ (steps 2: of the one after); each (roll, z, width), (…, K) m. ValueError where
        ``neighbour`` is None."""
        if self.neighbour is None:
            raise ValueError("neighbouring teeth of this body couple through its FE model")
        shape, other = np.shape(slices[0]), np.shape(further[0])[-1]
        averages, further_averages = (
            self.coarse_averages(*(np.ravel(a) for a in s)) for s in (slices, further)
        )
        between = self.neighbour[steps - 1]
        motion = (averages @ between).reshape(-1, shape[-1], len(between))
        means = further_averages.toarray().reshape(-1, other, len(between))
        return np.asarray(motion @ means.swapaxes(1, 2)).reshape(*shape, other)

    def contact_body(self, roll: Array) -> ContactBody:
        """Layer for the line contact, which ``matrix`` leaves out, at roll lengths (K,) m."""
        order = np.argsort(self.roll)
        depth = np.interp(roll, self.roll[order], self.depth[order])
        return ContactBody(self.young, self.poisson, depth, "layer")

    def turned(self) -> Self:
        """The +θ flank, with the influence of its neighbours."""
        near = self.neighbour
        return replace(self, neighbour=None if near is None else near.swapaxes(1, 2)).mirrored()

    def mirrored(self) -> Self:
        """The flank with the other hand of helix, with the influence of its neighbours."""
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

    tied: whether to subtract the displacement of an averaging tie at the tooth's base section and
    to omit neighbours, as for a tooth of an FE body; plane_strain: whether axial displacement is
    zero (spur teeth only).
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
    rows = slice(None, -1)  # without the base section's ends, which the rim shares
    surface, inner = segment.surface_nodes[j, rows], segment.inner_nodes[j, rows]
    layer[nodes_between(model, surface.ravel(), inner.ravel())] = True
    n = len(flank)
    compliance, neighbour = whole[:n, :n] - held_flexibility(model, layer & free, unit), None
    if tied:
        motion = motion_by_tie(segment, model.nodes[flank])
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
    """Indices (3,) of the first, middle and last of ``rows`` rows."""
    return np.array([0, rows // 2, rows - 1])


def flank_normals(segment: ToothSegment, points: Array) -> Array:
    """Outward normals (n, 3) of −θ flanks of a segment at points (n, 3)."""
    return involute_normals(segment.parameters.tooth, segment.parameters.helix_rate, points)


def involute_normals(
    tooth: ToothGeometry, helix_rate: float, points: Array, side: int = -1
) -> Array:
    """Outward normals (n, 3) of −θ flanks (+θ flanks: side 1) at points (n, 3) m.

    In the transverse section side·cos α e_θ ± sin α e_r (upper sign: external teeth); the helix
    adds −side·tan β_b e_z, tan β_b = r_b κ, before normalisation.
    """
    radius = np.hypot(points[:, 0], points[:, 1])
    radial = points[:, :2] / radius[:, None]
    around = np.column_stack([-radial[:, 1], radial[:, 0]])
    angle = tooth.pressure_angle(radius)[:, None]
    section = tooth.outward * np.sin(angle) * radial + side * np.cos(angle) * around
    slope = -side * tooth.base_radius * helix_rate
    return np.column_stack([section, np.full(len(points), slope)]) / np.hypot(1.0, slope)


def unit_loads(segment: ToothSegment, model: FeModel, nodes: Ints) -> sp.csr_matrix:
    """Unit loads R (3N, k) at nodes (k,) of −θ flanks along their normals."""
    rows = 3 * nodes[:, None] + np.arange(3)
    columns = np.broadcast_to(np.arange(len(nodes))[:, None], rows.shape)
    loads = flank_normals(segment, model.nodes[nodes])
    entries = (loads.ravel(), (rows.ravel(), columns.ravel()))
    return sp.csr_matrix(entries, shape=(model.dofs, len(nodes)))


def root_tie(segment: ToothSegment, model: FeModel) -> sp.csr_matrix:
    """B (6, 3N) of an averaging tie of the middle tooth, the same as a ring's."""
    name = f"tooth_root_{segment.parameters.middle + 1:03d}"
    root = facet_sample(model, segment.fe_mesh.facets[name])
    return sp.csr_matrix(averaging_tie(name, _tie_place(segment), root).rows)


def motion_by_tie(segment: ToothSegment, points: Array) -> Array:
    """Displacement G (k, 6) of the −θ flank along its normal at points (k, 3) m by unit motions of
    the tie's node."""
    motion = rigid_motion(points - _tie_place(segment))
    return np.einsum("ki,kij->kj", flank_normals(segment, points), motion)


def free_displacements(model: FeModel, *, plane_strain: bool) -> NDArray[np.bool_]:
    """Whether each displacement (N, 3) of a segment that is held on its patch "held" is free."""
    free = np.ones((len(model.nodes), 3), dtype=bool)
    free[facet_nodes(model, model.fe_mesh.facets["held"])] = False
    free[:, 2] &= not plane_strain
    return free


def held_flexibility(model: FeModel, free: NDArray[np.bool_], loads: sp.sparray) -> Array:
    """Flexibility R^T K^{-1} R (k, k) of loads R (3N, k) while displacements that are not free
    (N, 3) are zero."""
    free_dofs = np.flatnonzero(free)
    return flexibility(
        model.stiffness[free_dofs][:, free_dofs].tocsr(), sp.csr_matrix(loads)[free_dofs].tocsc()
    )


def _tie_place(segment: ToothSegment) -> Array:
    return np.array([segment.parameters.tooth.reference_radius, 0.0, 0.0])


def _element(share: Array, count: int) -> tuple[Array, Array]:
    """Index of the element among ``count`` equal ones, and coordinate −1 … 1 in it, of shares
    0 … 1 of their length; shares beyond are moved to the ends."""
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
    """Means (K, count) of shape functions over slices; nodes and weighted shape functions:
    (functions, K, points)."""
    slices = np.broadcast_to(np.arange(nodes.shape[1])[:, None], nodes.shape)
    entries = (shape.ravel(), (slices.ravel(), nodes.ravel()))
    return sp.csr_matrix(entries, shape=(nodes.shape[1], count))
