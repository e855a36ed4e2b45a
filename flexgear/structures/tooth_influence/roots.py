"""Root stress of a tooth under the slices of contact lines, by a submodel of three teeth.

The body is cut ``DEPTH`` modules below the root and held there, so that the held surface is not
near the fillet. (In the compliance model of an FE ring the tie ends just at the critical section.)
With unit loads R at nodes of the flanks along their normals and K of the free (f) and cut (c) dofs,

    σ = S_f bᵀ f + S_u u_cut,   S_f = T K_ff⁻¹ R,   S_u = T_c − T_f K_ff⁻¹ K_fc

(b: ``FlankPlaces.averages``), where a row of T is the stress along the surface, across the tooth's
root line, at a vertex of the fillet: the mean of the stresses in the elements that meet there.
Fillets have eight and more quadratic elements. In lumped bodies u_cut = 0; in an FE body u_cut is
the displacement of that body.

T is of the fillet beside the −θ flank, in tension under load on this flank. Half a turn about the
middle tooth's radial axis maps the segment onto itself: the stress of the +θ fillet under load on
−θ flanks is that of the −θ fillet under load on +θ flanks, so that one set of solutions suffices.

In an FE ring or planet the motion u(x) = Φ_r(x) q of the body at the cut of the submodel, turned
by φ_j about the axis to tooth j, gives the stress

    σ = Σ_c S_u,c · R(φ_j)ᵀ u(R(φ_j) x_c),

corrected to zero under rigid motion, where rounding errors remain. At the depth of the cut the
error of the body's FE mesh, which has coarse teeth, is negligible.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from flexgear.arrays import Array, Ints
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.slices import Slices
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import rotation
from flexgear.structures.cache import cached_arrays
from flexgear.structures.fe_mesh.tooth_segment import (
    SegmentDivisions,
    SegmentParameters,
    ToothSegment,
    tooth_segment,
)
from flexgear.structures.fem.assembly import FeModel, element_gradient, facet_nodes
from flexgear.structures.linalg.dense import blocks
from flexgear.structures.linalg.sparse import Factor
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.strain import strain_of_gradient, stress_of_strain
from flexgear.structures.surface_strain import FieldAt
from flexgear.structures.tooth_influence.influence import (
    FlankPlaces,
    flank_nodes,
    flank_normals,
    free_displacements,
)
from flexgear.structures.tooth_influence.of_case import (
    held_radius,
    influence_parameters,
    mating_flanks,
    one_tooth,
    require_teeth,
    some_places,
    widths,
)

DEPTH = 4.5  # modules below the root circle where the body is cut
FIRST = 0.15  # modules, height of the rim's first row: it affects stress at the fillet's foot
LAYER = 0.1  # modules, depth of elements under flank and fillet: a quarter of the fillet's radius
MARGIN = 0.5  # pitches of rim beside the three teeth
HALF_TURN = np.array([1.0, -1.0, -1.0])  # signs of a vector after half a turn about the x axis
_TOGETHER = 32  # points of a fillet that are processed together
FINE = SegmentDivisions(flank=8, fillet=12, tooth=6, rim=8, land=4)
WHOLE_FACE = SegmentDivisions(flank=6, fillet=8, tooth=4, land=2)  # 1 to 3 % off FINE


@dataclass(frozen=True, eq=False)
class RootInfluence(FlankPlaces):
    """Stress in the roots of a tooth per load on its flank and on those of both neighbours.

    stress: S_f (3, 2, rows, layers + 1, n) Pa/N of unit loads at the n nodes of the −θ flank of the
    tooth before (in −θ), of the tooth itself and of the next one; in the fillet on the loaded
    flanks' side, then in the other; by rows of the fillet from the flank's end down and layer
    borders along the face. points: (rows, layers + 1, 3) m of the −θ fillet. cut: S_u (rows, layers
    + 1, c, 3) Pa/m in the −θ fillet per displacement of the cut at cut_points (c, 3) m; the middle
    tooth is on the x axis.

    It is computed for loads on −θ flanks of a tooth with the gear's hand of helix.
    """

    stress: Array
    points: Array
    cut: Array
    cut_points: Array

    def per_force(self, roll: Array, z: Array, width: Array) -> Array:
        """Stress σ (…, K, 3, 2, rows, layers + 1) Pa/N per force of each slice on the tooth before,
        the tooth itself and the next, with the cut held; roll, z, width of slices (…, K) m."""
        shape = np.shape(roll)
        means = self.averages(roll.ravel(), z.ravel(), width.ravel())
        of_nodes = self.stress.reshape(-1, self.stress.shape[-1]).T
        return np.asarray(means @ of_nodes).reshape(*shape, *self.stress.shape[:-1])

    def turned(self) -> Self:
        """Stress per load on +θ flanks, by half a turn about the tooth's radial axis. The fillet
        beside the loaded flank is the first; cut and points remain those of the −θ fillet."""
        return replace(self, stress=self.stress[::-1]).mirrored()

    def mirrored(self) -> Self:
        """Stress per load for the other hand of helix, z -> −z; cut and points are unchanged."""
        stress = self.stress[:, :, :, ::-1, self.flipped_nodes()]
        return replace(self, stress=stress, slope=-self.slope)


def root_parameters(
    parameters: SegmentParameters, module: float, depth: float = DEPTH
) -> SegmentParameters:
    """The submodel of a gear: three teeth with fine fillets, cut ``depth`` modules below the root
    circle; the first rows of the rim do not depend on the depth.

    parameters: of one tooth of the gear; module: m.
    """
    tooth, growth = parameters.tooth, WHOLE_FACE.growth
    rim = math.ceil(math.log1p(depth * (growth - 1.0) / FIRST) / math.log(growth))
    return replace(
        parameters,
        held_radius=tooth.root_radius - tooth.outward * depth * module,
        flank_layer=LAYER * module,
        teeth=3,
        margin=MARGIN,
        divisions=replace(WHOLE_FACE, rim=rim, layers=parameters.divisions.layers),
    )


def root_influence(
    parameters: SegmentParameters, young: float, poisson: float, *, plane_strain: bool = False
) -> RootInfluence:
    """Stress in the root of the middle tooth of three per force on flanks (S_f) and per motion of
    the cut (S_u). young: Pa; plane_strain: whether axial displacement is zero."""
    segment = tooth_segment(parameters)
    model = FeModel(segment.fe_mesh, young, poisson, density=1.0)
    j, first = parameters.middle, len(segment.roll) - 1
    root = segment.surface_nodes[j, first:]
    held = facet_nodes(model, segment.fe_mesh.facets["held"])
    free = free_displacements(model, plane_strain=plane_strain)
    free_dofs, cut = np.flatnonzero(free), (3 * held[:, None] + np.arange(3)).ravel()
    across = _across(segment, j, first)
    stress_rows = _stress_rows(model, root.ravel(), across.reshape(-1, 3), young, poisson)
    factor = Factor(model.stiffness[free_dofs][:, free_dofs].tocsr())
    coupling = model.stiffness[cut][:, free_dofs].tocsr()
    nodes, loads = _loaded(segment, model)
    stress = np.empty((root.size, *nodes.shape))
    of_cut = np.empty((root.size, len(cut)))
    for some in blocks(root.size, _TOGETHER):
        motion = np.zeros((free.size, len(stress[some])))
        motion[free_dofs] = factor.solve(stress_rows[some][:, free_dofs].T.toarray())
        at = motion.reshape(-1, 3, motion.shape[1])[nodes]
        stress[some] = np.einsum("stnip,stni->pstn", at, loads)
        of_cut[some] = stress_rows[some][:, cut].toarray() - (coupling @ motion[free_dofs]).T
    stress = stress.reshape(*root.shape, *nodes.shape)
    stress[:, :, 1] = stress[:, ::-1, 1]
    return RootInfluence(
        roll=segment.roll,
        z=segment.z,
        slope=parameters.roll_slope,
        stress=np.ascontiguousarray(np.moveaxis(stress, (3, 2), (0, 1))),
        points=model.nodes[root],
        cut=of_cut.reshape(*root.shape, len(held), 3),
        cut_points=model.nodes[held],
    )


def _loaded(segment: ToothSegment, model: FeModel) -> tuple[Ints, Array]:
    """Nodes (2, teeth, n) of −θ and +θ flanks, and unit forces (2, teeth, n, 3) into the teeth
    there.

    +θ flanks and their nodes are the images of −θ flanks under half a turn about the middle tooth's
    radial axis, so that their teeth are in reverse order.
    """
    teeth = range(segment.parameters.teeth)
    nodes = np.stack([flank_nodes(segment, model, j) for j in teeth])
    force = np.stack([-flank_normals(segment, model.nodes[at]) for at in nodes])
    gap, images = cKDTree(model.nodes).query(model.nodes[nodes] * HALF_TURN)
    assert np.all(gap < 1e-6 * segment.parameters.face_width)
    return np.stack([nodes, images]), np.stack([force, force * HALF_TURN])


def _across(segment: ToothSegment, tooth: int, first: int) -> Array:
    """Unit vectors (rows, layers + 1, 3) along the surface of a −θ fillet, across the root line;
    first: row of the surface where the fillet begins."""
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
    model: FeModel, vertices: Ints, across: Array, young: float, poisson: float
) -> sp.csr_matrix:
    """Rows T (k, 3n) of the normal stress t · σ t at vertices (k,) along unit vectors ``across``,
    t (k, 3), Pa/m; young: Pa."""
    slopes = element_gradient(model, vertices)  # (3k, n)
    rows = []
    unit = np.eye(9).reshape(9, 3, 3)  # gradients ∂u_i/∂x_j = 1, in the order 3 i + j
    stress = stress_of_strain(strain_of_gradient(unit), young, poisson)  # (9, 6)
    x, y, z = across.T
    share = np.column_stack([x * x, y * y, z * z, 2 * x * y, 2 * y * z, 2 * x * z]) @ stress.T
    for i in range(3):
        part = sum(sp.diags_array(share[:, 3 * i + j]) @ slopes[j::3] for j in range(3))
        rows.append(sp.kron(part, np.eye(1, 3, i)))
    return (rows[0] + rows[1] + rows[2]).tocsr()


_PLACES = 126  # contact lines of the table; linear between


def root_of_case(view: StageView, role: str) -> RootInfluence:
    """Root stress of a tooth of a gear, with ``role`` as in ``tooth_influence``, from the cache or
    computed (about a minute)."""
    parameters, m = root_segment(view, role), view.material
    young, poisson = m.young_modulus, m.poisson_ratio
    content = {"root": parameters, "young": young, "poisson": poisson}
    return cached_arrays(
        RootInfluence, 2, content, lambda: root_influence(parameters, young, poisson)
    )


def root_segment(view: StageView, role: str) -> SegmentParameters:
    """The submodel of a gear's root, cut ``DEPTH`` modules below the root circle, or at the bore (a
    ring's outer diameter) where the rim is thinner. InputError where a tooth or the rim cannot be
    meshed."""
    tooth, module = stage_geometry(view).gears[role], view.stage.normal_module
    require_teeth(view, role, tooth, 'set gear_mesh.root_stress = "none"')
    held = held_radius(view, role, tooth, DEPTH)
    depth = tooth.outward * (tooth.root_radius - held) / module
    return root_parameters(one_tooth(view, role, tooth), module, depth)


def require_influences(view: StageView) -> None:
    """InputError where a stage's influences or root stress cannot be computed; computes none."""
    options = view.gear_mesh
    roles = ("planet", *stage_geometry(view).gear_meshes)
    if options.model == "face_load" and options.tooth_compliance == "fe":
        for role in roles:
            influence_parameters(view, role)
    if options.root_stress == "fe":
        for role in roles:
            root_segment(view, role)


@dataclass(frozen=True, eq=False)
class PairRoots:
    """Root stress of one gear of a gear mesh over the path of contact.

    name: "planet", "sun" or "ring"; sense: 1 where −θ flanks are loaded, else −1; step: number of
    teeth in +θ from one pair to the next. s: (S,) path coordinates, m, rising; stress: (S, K, 3, 2,
    rows, q) Pa/N of a tooth per force of a slice on the tooth before, on itself and on the next in
    +θ; in the fillet beside the loaded flank, then in the other; q layer borders along the face at
    z (q,) m.
    """

    name: str
    sense: int
    step: int
    s: Array
    stress: Array
    z: Array

    def of(self, s: Array, force: Array) -> Array:
        """Stress σ (n, 3, 2, rows, q) Pa by pairs at s (n,) m with forces of slices (n, K) N: in
        the tooth after that of the pair, in this one and in the one before; fillets as in
        ``stress``."""
        (n, count), flat = force.shape, self.stress.reshape(len(self.s) * force.shape[1], -1)
        at = np.clip(np.searchsorted(self.s, s) - 1, 0, len(self.s) - 2)
        fraction = np.clip((s - self.s[at]) / np.diff(self.s)[at], 0.0, 1.0)[:, None]
        columns = count * at[:, None] + np.arange(count)
        entries = np.concatenate([(1.0 - fraction) * force, fraction * force], axis=1)
        places = np.concatenate([columns, columns + count], axis=1)
        starts = 2 * count * np.arange(n + 1)
        shares = sp.csr_matrix((entries.ravel(), places.ravel(), starts), (n, len(flat)))
        return np.asarray(shares @ flat).reshape(n, *self.stress.shape[2:])


def pair_roots(view: StageView, path: GearMeshPath, slices: Slices) -> list[PairRoots]:
    """Root stress of the planet, then of its mate, with the cut held."""
    width, some = widths(path, slices), some_places(slices, _PLACES)
    roots = []
    for flank in mating_flanks(path, slices):
        root = flank.of(root_of_case(view, flank.name))
        stress = root.per_force(flank.roll[some], slices.z[some], width[some])
        sense = flank.sense
        roots.append(PairRoots(flank.name, sense, flank.step, slices.s[some], stress, root.z))
    return roots


def both_cuts(root: RootInfluence) -> Array:
    """S_u (2, rows, q, c, 3) Pa/m in the −θ fillet and in the +θ fillet, its image under half a
    turn about the tooth's radial axis."""
    away, partner = cKDTree(root.cut_points).query(root.cut_points * HALF_TURN)
    assert np.all(away < 1e-6 * np.ptp(root.cut_points[:, 2]))
    return np.stack([root.cut, root.cut[:, ::-1, partner] * HALF_TURN])


def body_root_rows(root: RootInfluence, body: ReducedBody, teeth: int) -> NDArray[np.float32]:
    """Stress (teeth, 2, rows, q, d) Pa in the −θ and +θ fillets of all teeth of a ring or planet
    per reduced coordinate; tooth 0 is on the x axis."""
    cuts, field = both_cuts(root), FieldAt(body)
    shape, d = cuts.shape[:3], len(body.mass)
    out = np.empty((teeth, int(np.prod(shape)), d), dtype=np.float32)
    flat = cuts.reshape(-1, *cuts.shape[3:])
    for j in range(teeth):
        turn = rotation(2 * np.pi * j / teeth)
        weights = field.weights(root.cut_points @ turn.T).tocsc()
        used = np.flatnonzero(np.diff(weights.indptr))
        in_body = np.moveaxis(flat @ turn.T, 2, 0)  # (3, p, c): per displacement, body's axes
        of_vertices = np.stack([weights[:, used].T @ part.T for part in in_body], axis=1)
        recovery = body.recovery[(3 * used[:, None] + np.arange(3)).ravel()]
        rows = of_vertices.reshape(len(recovery), -1).T.astype(np.float32) @ recovery
        out[j] = body.with_rigid(rows)
    return out.reshape(teeth, *shape, -1)
