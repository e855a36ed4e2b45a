"""Flexibility of the rim of an FE ring or planet along the face within a tooth.

The influence of a tooth is that of a segment whose rim is held; the node of a tooth in the gear has
rigid motion only. With the amplitudes p of shapes (``reduced``) added to the node's motion q the FE
gear on its supports has the flexibility

    T = [B; B_s] K⁻¹ [B; B_s]ᵀ,    the segment likewise T_c,

and the flank of the whole gear is more flexible than that of the segment by G ΔT Gᵀ, where
ΔT = T − T_c without the block of q, which the node has. Between a tooth and the next two, which the
segment does not couple, ΔT is T without that block. T_c is computed from the gear's FE mesh, cut
and held where the segment is: a coarse mesh is too stiff within a tooth by more than ΔT, and this
error cancels in the difference.

K⁻¹ comes from the condensation of the gear on its nodes (``condensation``): of loads L = B_sᵀ

    u = Ψ q + x,   (K_bb + S) q = Ψᵀ L,   K x = L + Bᵀ(reactions), B x = 0,

so that supports S may change without another factor. Loads L have no resultant, so that
displacements are local and nearly the same for all teeth (0.1 % apart between the bolts of
``wind-5mw``); ΔT is the mean over some teeth.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from flexgear.arrays import Array, Ints
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.slices import Slices
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.bodies import Material
from flexgear.structures.bodies import rigid_motion, turn
from flexgear.structures.cache import cached_arrays
from flexgear.structures.estimate import (
    END_SHARE,
    PROMISED,
    is_held,
    largest_tooth_error,
    shape_errors,
)
from flexgear.structures.fe_mesh.section import base_section_angle
from flexgear.structures.fe_mesh.tooth_segment import SegmentParameters
from flexgear.structures.fem.assembly import FeModel, Sample, facet_sample
from flexgear.structures.fem.ties import averaging_tie
from flexgear.structures.linalg.dense import scaled_inverse, single_threaded_blas
from flexgear.structures.linalg.sparse import flexibility
from flexgear.structures.reduced import (
    MOTIONS,
    NEXT_TEETH,
    ORDERS,
    SHAPES,
    ReducedBody,
    RimFlexibility,
    ToothLine,
    normal_displacement,
)
from flexgear.structures.reduction import AnyCondensation
from flexgear.structures.tooth_influence.influence import ToothInfluence, involute_normals
from flexgear.structures.tooth_influence.of_case import (
    mating_flanks,
    rows_at,
    segment_influence,
    some_places,
)

SAMPLED_TEETH = 5  # over which the flexibility is averaged
_SLICES = 20  # of the loads of the estimate
_PLACES = 251  # contact lines that are computed; linear between
_SLACK = 1e-6  # of a pitch and a radius: nodes so near a cut count as on it


@dataclass(frozen=True)
class Cut:
    """Surfaces where a segment is held: pitches to either side of the tooth's middle, radius m."""

    pitches: float
    radius: float


@dataclass(frozen=True, eq=False)
class RingShapes:
    """Displacements of an FE gear by loads on the shapes of some teeth (t,), numbered from 0.

    count: number of all teeth; loads (t, 1 + NEXT_TEETH, b, SHAPES): Ψᵀ L of loads on the tooth and
    the next ones; fixed (t, 1 + NEXT_TEETH, SHAPES, SHAPES): with the interface held, amplitudes of
    the tooth's shapes by loads on the shapes of the tooth and the next ones; piece (t, MOTIONS,
    MOTIONS): T_c; less (t, 6, SHAPES): N. Components along the axes of the tooth at its middle, in
    the dimension b along those of the gear.
    """

    teeth: Array
    count: Array
    loads: Array
    fixed: Array
    piece: Array
    less: Array


def shape_displacements(
    model: FeModel, condensation: AnyCondensation, line: ToothLine, teeth: int, cut: Cut
) -> RingShapes:
    """Displacements by loads on the shapes of a gear's teeth with averaging ties at their roots;
    line: of tooth 0; teeth: number of all teeth."""
    sampled = sorted({k * teeth // SAMPLED_TEETH for k in range(SAMPLED_TEETH)})
    shapes = [_of_tooth(model, condensation, line, (j, teeth), cut) for j in sampled]
    stacked = (np.stack(arrays) for arrays in zip(*shapes, strict=True))
    return RingShapes(np.array(sampled, dtype=float), np.array(float(teeth)), *stacked)


def rim_flexibility(
    shapes: RingShapes, stiffness: Array, supports: Array, line: ToothLine
) -> RimFlexibility:
    """ΔT of a gear on supports (b, b) at its nodes, teeth first, that leave no motion free;
    stiffness: K_bb (b, b); line: of tooth 0."""
    flexibility, teeth = scaled_inverse(stiffness + supports), int(shapes.count)
    same, beside = np.zeros((MOTIONS, MOTIONS)), np.zeros((NEXT_TEETH, MOTIONS, MOTIONS))
    for n, j in enumerate(shapes.teeth.astype(int)):
        axes, at = _axes(j, teeth), slice(6 * j, 6 * j + 6)
        motion = flexibility @ shapes.loads[n]  # of all nodes, by loads on the tooth and the next
        displacement = shapes.loads[n, 0].T @ motion + shapes.fixed[n]
        same[6:, 6:] += displacement[0] - shapes.piece[n, 6:, 6:]
        same[:6, 6:] += axes.T @ motion[0, at] - shapes.piece[n, :6, 6:]
        beside[:, 6:, 6:] += displacement[1:]
        beside[:, :6, 6:] += axes.T @ motion[1:, at]
        for k in range(NEXT_TEETH):
            further = (j + 1 + k) % teeth
            node = motion[0, 6 * further : 6 * further + 6]
            beside[k, 6:, :6] += (_axes(further, teeth).T @ node).T
    same[6:, :6] = same[:6, 6:].T
    number = len(shapes.teeth)
    return RimFlexibility(same / number, beside / number, shapes.less.mean(axis=0), line)


def shape_tie(line: ToothLine, sample: Sample) -> tuple[sp.csr_matrix, Array]:
    """B_s (SHAPES, 3n) and N (6, SHAPES) of a tooth from a sample of its base section."""
    rigid, shapes = rigid_motion(sample.points - line.place), line.shapes(sample.points)
    less = np.linalg.solve(_inner(sample, rigid, rigid), _inner(sample, rigid, shapes))
    elastic = shapes - rigid @ less
    weights = np.einsum("m,mci->mci", sample.weights, elastic)
    weights = weights @ np.linalg.inv(_inner(sample, elastic, elastic))
    rows = np.stack([sample.interpolation.T @ weights[:, c] for c in range(3)], axis=1)
    return sp.csr_matrix(rows.reshape(-1, SHAPES).T), np.asarray(less, dtype=np.float64)


def _of_tooth(
    model: FeModel,
    condensation: AnyCondensation,
    first: ToothLine,
    which: tuple[int, int],
    cut: Cut,
) -> tuple[Array, Array, Array, Array]:
    """Entries of ``RingShapes`` (loads, fixed, piece, less) of one tooth; first: line of tooth 0;
    which: number of the tooth and number of all teeth."""
    j, teeth = which
    ties = [
        shape_tie(_turned(first, i, teeth), facet_sample(model, _root(model, i % teeth)))
        for i in range(j, j + 1 + NEXT_TEETH)
    ]
    rows = [tie for tie, _ in ties]
    loads = sp.hstack([row.T for row in rows]).toarray()
    form = condensation.field_of(loads)
    amplitudes = form[:, :SHAPES].T @ condensation.fixed_solve(form)
    return (
        _by_tooth(condensation.constraint_load(loads)),
        _by_tooth(amplitudes),
        _piece(model, _turned(first, j, teeth), rows[0], teeth, cut),
        _axes(j, teeth).T @ ties[0][1],
    )


def _by_tooth(columns: Array) -> Array:
    """Columns (rows, teeth · SHAPES) as (teeth, rows, SHAPES)."""
    return columns.reshape(len(columns), -1, SHAPES).swapaxes(0, 1)


def cut_flexibility(
    model: FeModel, line: ToothLine, rows: sp.csr_matrix, teeth: int, cut: Cut
) -> Array:
    """Flexibility (k, k) between rows (k, 3n) of the part of a gear's FE mesh that is cut out about
    a tooth and held at the cut; line: of the tooth; teeth: number of all teeth."""
    x, y, z = model.nodes.T
    away = np.arctan2(y, x) - line.angle - line.helix_rate * z
    away = np.abs((away + np.pi) % (2 * np.pi) - np.pi)
    inside = away < (cut.pitches - _SLACK) * 2 * np.pi / teeth
    outward = np.sign(line.radius - cut.radius)  # from the cut to the teeth
    inside &= outward * (np.hypot(x, y) - cut.radius) > _SLACK * cut.radius
    part, nodes = model.part(np.flatnonzero(inside[model.basis.element_dofs].any(axis=0)))
    dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
    free_dofs = np.flatnonzero(np.repeat(inside[nodes], 3))
    loads = rows.tocsc()[:, dofs[free_dofs]].T.tocsc()
    return flexibility(part.stiffness[free_dofs][:, free_dofs].tocsr(), loads)


def _piece(model: FeModel, line: ToothLine, shapes: sp.csr_matrix, teeth: int, cut: Cut) -> Array:
    """T_c (MOTIONS, MOTIONS), along the axes of a tooth; shapes: its B_s."""
    tooth = round(line.angle * teeth / (2 * np.pi)) % teeth
    node = averaging_tie("tooth", line.place, facet_sample(model, _root(model, tooth))).rows
    assert node is not None  # no rigid tie
    axes = sp.csr_matrix(turn(-line.angle))
    return cut_flexibility(model, line, sp.vstack([axes @ node, shapes]).tocsr(), teeth, cut)


def _turned(line: ToothLine, tooth: int, teeth: int) -> ToothLine:
    """Line of a tooth from that of tooth 0."""
    return replace(line, angle=line.angle + 2 * np.pi * tooth / teeth)


def _axes(tooth: int, teeth: int) -> Array:
    """Rotation (6, 6) of components along a tooth's axes to the gear's."""
    return turn(2 * np.pi * tooth / teeth)


def _root(model: FeModel, tooth: int) -> Ints:
    return model.fe_mesh.facets[f"tooth_root_{tooth + 1:03d}"]


def _inner(sample: Sample, u: Array, v: Array) -> Array:
    """∫ uᵀ v dA."""
    return np.asarray(np.einsum("m,mci,mcj->ij", sample.weights, u, v))


Condensed = Callable[[], tuple[FeModel, AnyCondensation]]


def cached_shapes(
    segment: SegmentParameters, teeth: int, gear_key: str, condensed: Condensed
) -> RingShapes:
    """``shape_displacements`` from the cache, or computed by another factor of the gear's matrix.

    gear_key: key of its reduced body; condensed: function that returns its FE model and
    condensation.
    """
    line, cut = first_line(segment), cut_of(segment)

    def make() -> RingShapes:
        model, condensation = condensed()
        with single_threaded_blas():
            return shape_displacements(model, condensation, line, teeth, cut)

    content = {"shapes_of": gear_key, "orders": ORDERS, "line": line, "cut": cut}
    return cached_arrays(RingShapes, 2, content, make)


def with_rim(
    body: ReducedBody,
    shapes: RingShapes,
    segment: SegmentParameters,
    material: Material,
    supports: Array,
    *,
    always: bool,
) -> ReducedBody:
    """The reduced gear with the flexibility of its rim along the face, where that is not negligible
    (``PROMISED``); its report has the error without it (``rim_error``) and whether it is included.

    segment: of its teeth; supports: (b, b) stiffness at its nodes; the gear is returned unchanged
    where they leave it free; always: include the flexibility even if it is negligible.
    """
    b, line = slice(0, body.interface_dofs), first_line(segment)
    with single_threaded_blas():
        if not is_held(body.stiffness[b, b] + supports):
            return body
        rim = rim_flexibility(shapes, body.stiffness[b, b], supports, line)
    influence = segment_influence(segment, material, tied=True)
    error = rim_error(rim, influence, segment.tooth)
    counts = always or error > PROMISED
    report = {
        **body.report,
        **largest_tooth_error(body.report.get("static_error_cases", {}), None if counts else error),
        "rim_error": error,
        "rim_counts": counts,
    }
    return body.with_(rim=rim if counts else None, report=report)


def rim_bending(
    rim: RimFlexibility, path: GearMeshPath, slices: Slices, member: int
) -> tuple[Array, Array]:
    """Flexibility that a gear's rim adds to contact lines of K slices, m/N: ΔC (S, K, K) between
    the slices of a line, and (S, NEXT_TEETH, K, K) to those of the next two, as in ``PairBending``.

    member: 0 planet, 1 its mate. The right half of a ring is the mirror image of the left, z -> −z.
    """
    flank = mating_flanks(path, slices)[member]
    some, z = some_places(slices, _PLACES), -slices.z if flank.other_hand else slices.z
    motion = flank_motion(rim, flank.tooth, -flank.sense, (flank.roll[some], z[some]))
    beside = []
    for pitches, between in enumerate(rim.beside, start=1):
        further = np.clip(slices.s[some] + pitches * path.base_pitch, None, slices.s[-1])
        places = rows_at(slices.s, flank.roll, further), rows_at(slices.s, z, further)
        further_motion = flank_motion(rim, flank.tooth, -flank.sense, places)
        after = between if flank.step > 0 else between.T
        beside.append(motion @ after @ further_motion.swapaxes(1, 2))
    parts = motion @ rim.tooth @ motion.swapaxes(1, 2), np.stack(beside, axis=1)
    within, between_lines = (rows_at(slices.s[some], c, slices.s) for c in parts)
    return 0.5 * (within + within.swapaxes(1, 2)), between_lines


def flank_motion(
    rim: RimFlexibility, tooth: ToothGeometry, side: int, places: tuple[Array, Array]
) -> Array:
    """Displacement G (…, MOTIONS) of a flank along its normal by unit motions of a tooth, at places
    (roll, z) (…,) m; side: −1 for the −θ flank, else 1."""
    roll, z = places
    radius = np.hypot(tooth.base_radius, roll).ravel()
    angle = side * tooth.half_angle(radius) + rim.line.helix_rate * z.ravel()
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z.ravel()])
    normals = involute_normals(tooth, rim.line.helix_rate, points, side)
    return normal_displacement(rim.line, rim.less, points, normals).reshape(*z.shape, -1)


def rim_error(rim: RimFlexibility, influence: ToothInfluence, tooth: ToothGeometry) -> float:
    """Largest of ``shape_errors`` under even loads along the −θ flank at pitch height, over the
    whole face and at either end."""
    width = np.full(_SLICES, rim.line.face_width / _SLICES)
    z = width[0] * (np.arange(_SLICES) + 0.5 - 0.5 * _SLICES)
    roll = np.full(_SLICES, tooth.roll_length(tooth.reference_radius))
    at_end = np.arange(_SLICES) < END_SHARE * _SLICES
    loads = np.array([np.ones(_SLICES), at_end, at_end[::-1]], dtype=float)
    motion = flank_motion(rim, tooth, -1, (roll, z))
    compliance = influence.matrix(roll, z, width)
    return float(shape_errors(compliance, motion @ rim.tooth @ motion.T, loads).max())


def first_line(p: SegmentParameters) -> ToothLine:
    """Helix through the middle of the first tooth of a gear, at the reference circle."""
    return ToothLine(0.0, p.tooth.reference_radius, p.helix_rate, p.face_width)


def cut_of(p: SegmentParameters) -> Cut:
    """Where the segment of the gear's tooth is held: beyond the lands beside its last teeth."""
    assert p.held_radius is not None
    land = 1.0 - base_section_angle(p.tooth) / p.tooth.pitch_angle
    return Cut(0.5 * (p.teeth - 1) + land + p.margin, p.held_radius)
