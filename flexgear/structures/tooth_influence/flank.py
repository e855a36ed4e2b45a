"""Compliance of a flank by FE: unit loads on the nodes of the flank, along its normal.

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
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.gears.tooth import ToothGeometry
from flexgear.structures.fe_mesh import ToothSegment
from flexgear.structures.fem import (
    FeModel,
    assemble,
    averaging_tie,
    edge_nodes,
    facet_nodes,
    facet_sample,
    nodes_between,
)
from flexgear.structures.kinematics import rigid_motion
from flexgear.structures.linalg.flexibility import flexibility

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FlankCompliance:
    """Of the middle tooth of a segment and those beside it, m/N.

    own: D (n, n), nodes in the order of ``flank_nodes``; neighbour: F (2, m, m) from the nodes of
    ``coarse_nodes`` on a tooth to those on the next one in +θ, and on the one after that; None
    where there are none.
    """

    own: Array
    neighbour: Array | None


def flank_compliance(
    segment: ToothSegment,
    young: float,
    poisson: float,
    *,
    plane_strain: bool = False,
    tied: bool = False,
) -> FlankCompliance:
    """Both compliances of a segment held on its patch "held"; E in Pa.

    plane_strain: no axial displacement anywhere (spur teeth only); tied: without what the node of
    an averaging tie on the tooth's base section takes in, and without the next tooth, which such
    nodes move.
    """
    model = assemble(segment.fe_mesh, young, poisson, density=1.0)
    j = segment.parameters.middle
    flank, has_next = flank_nodes(segment, model, j), j + 1 < segment.parameters.teeth and not tied
    free = np.ones((len(model.nodes), 3), dtype=bool)
    free[facet_nodes(model, segment.fe_mesh.facets["held"])] = False
    free[:, 2] &= not plane_strain
    unit = unit_loads(segment, model, flank)
    beside = (j + 1, j - 1) if has_next else ()
    more = [unit_loads(segment, model, coarse_nodes(segment, k)) for k in beside]
    more += [root_tie(segment, model).T] if tied else []
    whole = held_flexibility(model, free, sp.hstack([unit, *more]))
    layer = np.zeros_like(free)
    rows = slice(None, -1)  # the base section's ends belong to the rim, too
    surface, inner = segment.surface_nodes[j, rows], segment.inner_nodes[j, rows]
    layer[nodes_between(model, surface.ravel(), inner.ravel())] = True
    n = len(flank)
    compliance = whole[:n, :n] - held_flexibility(model, layer & free, unit)
    if tied:
        motion = carried_by_tie(segment, model.nodes[flank])
        compliance -= motion @ whole[n:, n:] @ motion.T
        compliance = 0.5 * (compliance + compliance.T)
    order = np.argsort(flank)
    at = order[np.searchsorted(flank[order], coarse_nodes(segment, j))]
    if not has_next:
        return FlankCompliance(compliance, None)
    after, before = slice(n, n + len(at)), slice(n + len(at), None)
    return FlankCompliance(compliance, np.stack([whole[at, after], whole[before, after]]))


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
    """Numbers of the first, middle and last of so many rows."""
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


def held_flexibility(model: FeModel, free: NDArray[np.bool_], loads: sp.sparray) -> Array:
    """R^T K^{-1} R (k, k) of loads R (3N, k); displacements that are not free (N, 3) are zero."""
    free_dofs = np.flatnonzero(free)
    return flexibility(
        model.stiffness[free_dofs][:, free_dofs].tocsr(), sp.csr_matrix(loads)[free_dofs].tocsc()
    )


def _tie_place(segment: ToothSegment) -> Array:
    return np.array([segment.parameters.tooth.reference_radius, 0.0, 0.0])
