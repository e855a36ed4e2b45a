"""Root stress of a tooth under the slices of its contact line, by a submodel of three teeth.

The body is cut three modules or more below the root and held there: nothing of the tooth's own
clamping is near the fillet, as it is in the compliance model of an FE ring, whose tie ends just at
the critical section. With S_f the stress at points of the fillet per unit load at nodes of the
flank along its normal,

    σ = T K⁻¹ R,   σ of slices = S_f bᵀ f    (b: ``ToothInfluence.averages``)

where a row of T is the stress across the tooth's root line, along the surface, at a vertex of the
fillet: the mean of the elements' own stresses there. Fillets are resolved by eight and more
quadratic elements. The cut stands still (u_cut = 0), which is what bodies that are lumped do.

Stress is that of the −θ flank's own fillet, in tension under load on this flank; half a turn about
the tooth's radial axis gives the other flank.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.fe_mesh import (
    SegmentDivisions,
    SegmentParameters,
    ToothSegment,
    tooth_segment,
)
from flexgear.structures.fem import FeModel, assemble, element_gradient, facet_nodes
from flexgear.structures.linalg.cholesky import Factor
from flexgear.structures.strain import strain_of_gradient, stress_of_strain
from flexgear.structures.tooth_influence.flank import flank_nodes, flank_normals
from flexgear.structures.tooth_influence.influence import ToothInfluence

Array = NDArray[np.float64]

DEPTH = 3.0  # modules below the root circle where the body is cut, at least
LAYER = 0.1  # modules, depth of the first elements under flank and fillet: a quarter of its radius
MARGIN = 0.5  # pitches of rim beside the three teeth
_TOGETHER = 32  # points of a fillet at a time
FINE = SegmentDivisions(flank=8, fillet=12, tooth=6, rim=8, land=4)
WHOLE_FACE = SegmentDivisions(flank=6, fillet=8, tooth=4, rim=5, land=2)  # 1 to 3 % off FINE


@dataclass(frozen=True, eq=False)
class RootInfluence:
    """Stress in a root per load on the flank above it.

    stress: S_f (rows, layers + 1, n) Pa/N by rows of the fillet from the flank's end down and layer
    borders along the face, of unit loads at the flank's n nodes; points: (rows, layers + 1, 3) m;
    flank: places of slices on the flank.
    """

    stress: Array
    points: Array
    flank: ToothInfluence

    def of_slices(self, roll: Array, z: Array, width: Array, force: Array) -> Array:
        """σ (rows, layers + 1) Pa of slices (K,): as in ``ToothInfluence.matrix``; force N."""
        means = self.flank.averages(roll, z, width)
        return np.asarray(self.stress @ (means.T @ force))


def root_parameters(
    parameters: SegmentParameters, module: float, depth: float = DEPTH
) -> SegmentParameters:
    """The submodel of a gear whose influence has these parameters: three teeth, cut ``depth``
    modules below the root circle, with a fillet that is resolved, and as many layers."""
    tooth = parameters.tooth
    return replace(
        parameters,
        held_radius=tooth.root_radius - tooth.outward * depth * module,
        flank_layer=LAYER * module,
        teeth=3,
        margin=MARGIN,
        divisions=replace(WHOLE_FACE, layers=parameters.divisions.layers),
    )


def root_influence(
    parameters: SegmentParameters, young: float, poisson: float, *, plane_strain: bool = False
) -> RootInfluence:
    """S_f of the middle tooth of a segment; E in Pa. plane_strain: no axial displacement."""
    segment = tooth_segment(parameters)
    model = assemble(segment.fe_mesh, young, poisson, density=1.0)
    j, first = parameters.middle, len(segment.roll) - 1
    flank, root = flank_nodes(segment, model, j), segment.surface_nodes[j, first:]
    free = np.ones((len(model.nodes), 3), dtype=bool)
    free[facet_nodes(model, segment.fe_mesh.facets["held"])] = False
    free[:, 2] &= not plane_strain
    kept = np.flatnonzero(free)
    across = _across(segment, j, first)
    wanted = _stress_rows(model, root.ravel(), across.reshape(-1, 3), young, poisson)
    factor = Factor(model.stiffness[kept][:, kept].tocsr())
    loads = -flank_normals(segment, model.nodes[flank])  # a mate pushes
    stress = np.empty((root.size, len(flank)))
    for start in range(0, root.size, _TOGETHER):
        some = slice(start, start + _TOGETHER)
        width = len(stress[some])
        motion = np.zeros((free.size, width))
        motion[kept] = factor.solve(wanted[some][:, kept].T.toarray())
        stress[some] = np.einsum(
            "nip,ni->pn", motion.reshape(-1, 3, len(stress[some]))[flank], loads
        )
    return RootInfluence(
        stress.reshape(*root.shape, len(flank)),
        model.nodes[root],
        ToothInfluence(
            roll=segment.roll,
            z=segment.z,
            depth=segment.depth,
            own=np.zeros((len(flank), 0)),
            neighbour=None,
            slope=-parameters.tooth.outward * parameters.tooth.base_radius * parameters.helix_rate,
            young=young,
            poisson=poisson,
        ),
    )


def _across(segment: ToothSegment, tooth: int, first: int) -> Array:
    """Unit vectors (rows, layers + 1, 3) along the surface of a fillet, across the root line."""
    points = np.asarray(segment.fe_mesh.points)[segment.surface_nodes[tooth]]
    down = np.gradient(points, axis=0)[first:]
    along = np.zeros_like(down)
    along[..., 2] = 1.0
    rate = segment.parameters.helix_rate
    x, y = np.moveaxis(points[first:, :, :2], 2, 0)
    along[..., 0], along[..., 1] = -rate * y, rate * x
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    down -= (down * along).sum(axis=2, keepdims=True) * along
    return np.asarray(down / np.linalg.norm(down, axis=2, keepdims=True))


def _stress_rows(
    model: FeModel, vertices: NDArray[np.int64], across: Array, young: float, poisson: float
) -> sp.csr_matrix:
    """T (k, 3n): t · σ t at vertices (k,) for unit vectors t (k, 3)."""
    slopes = element_gradient(model, vertices)  # (3k, n)
    rows = []
    unit = np.eye(9).reshape(9, 3, 3)  # ∂u_i/∂x_j by 3 i + j
    stress = stress_of_strain(strain_of_gradient(unit), young, poisson)  # (9, 6)
    x, y, z = across.T
    share = np.column_stack([x * x, y * y, z * z, 2 * x * y, 2 * y * z, 2 * x * z]) @ stress.T
    for i in range(3):
        part = sum(sp.diags_array(share[:, 3 * i + j]) @ slopes[j::3] for j in range(3))
        rows.append(sp.kron(part, np.eye(1, 3, i)))
    return (rows[0] + rows[1] + rows[2]).tocsr()
