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

Only the loaded flank, −θ, is tabulated: the +θ one follows by half a turn about the tooth's radial
axis, the other hand of helix by reflection.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.fe_mesh import ToothSegment
from flexgear.structures.fem import FeModel, assemble, edge_nodes, facet_nodes, nodes_between
from flexgear.structures.linalg.flexibility import flexibility

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class FlankCompliance:
    """Of the middle tooth of a segment and the next one in +θ, m/N.

    own: D (n, n), nodes in the order of ``flank_nodes``; neighbour: F (m, m) from the nodes of
    ``coarse_nodes`` on the middle tooth to those on the next one, None where there is none.
    """

    own: Array
    neighbour: Array | None


def flank_compliance(
    segment: ToothSegment, young: float, poisson: float, *, plane_strain: bool = False
) -> FlankCompliance:
    """Both compliances of a segment held on its patch "held"; E in Pa.

    plane_strain: no axial displacement anywhere (spur teeth only).
    """
    model = assemble(segment.fe_mesh, young, poisson, density=1.0)
    j = segment.parameters.middle
    flank, coarse = flank_nodes(segment, model, j), coarse_nodes(segment, j)
    has_next = j + 1 < segment.parameters.teeth
    beside = coarse_nodes(segment, j + 1) if has_next else np.zeros(0, np.int64)
    free = np.ones((len(model.nodes), 3), dtype=bool)
    free[facet_nodes(model, segment.fe_mesh.facets["held"])] = False
    free[:, 2] &= not plane_strain
    whole = _flexibility(segment, model, free, np.concatenate([flank, beside]))
    layer = np.zeros_like(free)
    rows = slice(None, -1)  # the base section's ends belong to the rim, too
    surface, inner = segment.surface_nodes[j, rows], segment.inner_nodes[j, rows]
    layer[nodes_between(model, surface.ravel(), inner.ravel())] = True
    clamped = _flexibility(segment, model, layer & free, flank)
    n = len(flank)
    at = np.searchsorted(flank[order := np.argsort(flank)], coarse)
    neighbour = whole[order[at], n:] if has_next else None
    return FlankCompliance(whole[:n, :n] - clamped, neighbour)


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
    """Outward normals (n, 3) of −θ flanks at points (n, 3): ∓(cos α e_θ ∓ sin α e_r) in the
    section, (upper sign external), and with the helix tan β_b = r_b κ along z."""
    tooth = segment.parameters.tooth
    radius = np.hypot(points[:, 0], points[:, 1])
    radial = points[:, :2] / radius[:, None]
    around = np.column_stack([-radial[:, 1], radial[:, 0]])
    angle = tooth.pressure_angle(radius)[:, None]
    section = tooth.outward * np.sin(angle) * radial - np.cos(angle) * around
    slope = tooth.base_radius * segment.parameters.helix_rate
    return np.column_stack([section, np.full(len(points), slope)]) / np.hypot(1.0, slope)


def _flexibility(
    segment: ToothSegment, model: FeModel, free: NDArray[np.bool_], nodes: Ints
) -> Array:
    """R^T K^{-1} R (k, k) for unit loads at nodes (k,); displacements not free (N, 3) are zero."""
    kept = np.flatnonzero(free)
    number = np.full(free.size, -1)
    number[kept] = np.arange(len(kept))
    rows = number[3 * nodes[:, None] + np.arange(3)]
    columns = np.broadcast_to(np.arange(len(nodes))[:, None], rows.shape)
    loads = flank_normals(segment, model.nodes[nodes])
    there = rows >= 0
    right = sp.csc_matrix(
        (loads[there], (rows[there], columns[there])), shape=(len(kept), len(nodes))
    )
    return flexibility(model.stiffness[kept][:, kept].tocsr(), right)
