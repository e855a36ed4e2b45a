r"""What the rim of an FE ring yields along the face within a tooth, beyond the segment of a tooth.

The influence of a tooth (``flank``) is that of a segment whose rim is held; in the ring the node of
a tooth carries rigid motion only. With shapes p beside the node's motion q (``tooth_shapes``) and
loads on both, the FE ring on its supports has the flexibility

    T = [B; B_s] K⁻¹ [B; B_s]ᵀ,    the same of the segment: T_c,

and what bends more in the whole ring than in the segment is G ΔT Gᵀ on the flank with
ΔT = T − T_c less the block of q, which the node has. Between a tooth and the next two, where
the segment has nothing, it is T less that block. T_c is taken of the ring's own FE mesh, cut and
held where the segment is: a coarse mesh is too stiff within a tooth by more than ΔT, and in the
difference that cancels.

K⁻¹ comes from the condensation of the ring on its nodes (``condensation``): of loads L = B_sᵀ

    u = Ψ q + x,   (K_bb + S) q = Ψᵀ L,   K x = L + Bᵀ(reactions), B x = 0,

so that supports S may change without another factor. Loads L are in equilibrium by themselves:
answers are local, and hardly differ from tooth to tooth (0.1 % between the bolts of ``wind-5mw``);
the mean of some teeth is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.cyclic.condensation import CyclicCondensation
from flexgear.structures.fem import FeModel, Sample, averaging_tie, facet_sample
from flexgear.structures.fem.unassembled import UnassembledModel
from flexgear.structures.kinematics import rigid_motion, turn
from flexgear.structures.linalg.flexibility import flexibility
from flexgear.structures.reduction import AnyCondensation
from flexgear.structures.tooth_shapes import BEYOND, BOTH, COUNT, RimFlexibility, ToothLine

Array = NDArray[np.float64]

TEETH = 5  # whose answers are taken
_FREE = 1e-12  # smallest pivot of a stiffness with unit diagonal that holds a body
_SLACK = 1e-6  # of a pitch and a radius, by which nodes are inside a border


@dataclass(frozen=True)
class Cut:
    """Where a segment is held: pitches to either side of the tooth's middle, and radius m."""

    pitches: float
    radius: float


@dataclass(frozen=True, eq=False)
class RingShapes:
    """Answers of an FE ring to loads on the shapes of some teeth (t,), numbered from 0, of all.

    loads (t, 1 + BEYOND, b, COUNT): Ψᵀ L of the tooth and of the next ones; fixed (t, 1 + BEYOND,
    COUNT, COUNT): of the tooth's own shapes to all with the interface held; piece (t, BOTH, BOTH):
    T_c; less (t, 6, COUNT): N. Components along the axes of the tooth at its middle; those of b are
    the ring's.
    """

    teeth: Array
    count: Array
    loads: Array
    fixed: Array
    piece: Array
    less: Array


def ring_shapes(
    model: UnassembledModel, condensation: AnyCondensation, line: ToothLine, teeth: int, cut: Cut
) -> RingShapes:
    """Of a ring of so many teeth with averaging ties at their roots; line: of tooth 0."""
    asked = sorted({k * teeth // TEETH for k in range(TEETH)})
    shapes = [_of_tooth(model, condensation, line, (j, teeth), cut) for j in asked]
    stacked = (np.stack(arrays) for arrays in zip(*shapes, strict=True))
    return RingShapes(np.array(asked, dtype=float), np.array(float(teeth)), *stacked)


def rim_flexibility(
    shapes: RingShapes, stiffness: Array, supports: Array, line: ToothLine
) -> RimFlexibility:
    """On supports (b, b) at the ring's nodes, teeth first; stiffness: K_bb (b, b); line: of tooth
    0. LinAlgError where they leave the ring free."""
    held, teeth = _inverse(stiffness + supports), int(shapes.count)
    same, beside = np.zeros((BOTH, BOTH)), np.zeros((BEYOND, BOTH, BOTH))
    for n, j in enumerate(shapes.teeth.astype(int)):
        here, at = _axes(j, teeth), slice(6 * j, 6 * j + 6)
        motion = held @ shapes.loads[n]  # of all nodes, by shapes of the tooth and of the next ones
        displacement = shapes.loads[n, 0].T @ motion + shapes.fixed[n]
        same[6:, 6:] += displacement[0] - shapes.piece[n, 6:, 6:]
        same[:6, 6:] += here.T @ motion[0, at] - shapes.piece[n, :6, 6:]
        beside[:, 6:, 6:] += displacement[1:]
        beside[:, :6, 6:] += here.T @ motion[1:, at]
        for k in range(BEYOND):
            further = (j + 1 + k) % teeth
            node = motion[0, 6 * further : 6 * further + 6]
            beside[k, 6:, :6] += (_axes(further, teeth).T @ node).T
    same[6:, :6] = same[:6, 6:].T
    number = len(shapes.teeth)
    return RimFlexibility(same / number, beside / number, shapes.less.mean(axis=0), line)


def _inverse(stiffness: Array) -> Array:
    """LinAlgError where a stiffness leaves a motion free."""
    if not np.all(np.diag(stiffness) > 0.0):
        raise np.linalg.LinAlgError("free")
    scale = 1 / np.sqrt(np.diag(stiffness))
    factor = np.linalg.cholesky(stiffness * scale * scale[:, None])
    if np.diag(factor).min() ** 2 < _FREE:
        raise np.linalg.LinAlgError("free")
    half = np.linalg.inv(factor) * scale
    return np.asarray(half.T @ half)


def shape_tie(line: ToothLine, sample: Sample) -> tuple[sp.csr_matrix, Array]:
    """B_s (COUNT, 3n) and N (6, COUNT) of a tooth by the sample of its base section."""
    rigid, shapes = rigid_motion(sample.points - line.place), line.shapes(sample.points)
    less = np.linalg.solve(_inner(sample, rigid, rigid), _inner(sample, rigid, shapes))
    elastic = shapes - rigid @ less
    weights = np.einsum("m,mci->mci", sample.weights, elastic)
    weights = weights @ np.linalg.inv(_inner(sample, elastic, elastic))
    rows = np.stack([sample.interpolation.T @ weights[:, c] for c in range(3)], axis=1)
    return sp.csr_matrix(rows.reshape(-1, COUNT).T), np.asarray(less, dtype=np.float64)


def _of_tooth(
    model: UnassembledModel,
    condensation: AnyCondensation,
    first: ToothLine,
    which: tuple[int, int],
    cut: Cut,
) -> tuple[Array, Array, Array, Array]:
    """Ψᵀ L, answers with the interface held, T_c and N of one of so many teeth."""
    j, teeth = which
    rows, lessened = [], []
    for i in range(j, j + 1 + BEYOND):
        tie, less = shape_tie(
            _turned(first, i, teeth), facet_sample(model, _root(model, i % teeth))
        )
        rows.append(tie)
        lessened.append(_axes(i, teeth).T @ less)
    loads = sp.hstack([row.T for row in rows]).toarray()
    form = loads
    if isinstance(condensation, CyclicCondensation):
        form = condensation.field_of(loads)
    answers = form[:, :COUNT].T @ condensation.fixed_solve(form)
    return (
        _by_tooth(condensation.constraint_load(loads)),
        _by_tooth(answers),
        _piece(model, _turned(first, j, teeth), rows[0], teeth, cut),
        lessened[0],
    )


def _by_tooth(columns: Array) -> Array:
    """(rows, teeth COUNT) as (teeth, rows, COUNT)."""
    return columns.reshape(len(columns), -1, COUNT).swapaxes(0, 1)


def cut_flexibility(
    model: UnassembledModel, line: ToothLine, rows: sp.csr_matrix, teeth: int, cut: Cut
) -> Array:
    """Flexibility (k, k) between rows (k, 3n) of the ring's FE mesh about a tooth, which is held
    where it is cut; line: of the tooth, one of so many."""
    x, y, z = model.nodes.T
    away = np.arctan2(y, x) - line.angle - line.helix_rate * z
    away = np.abs((away + np.pi) % (2 * np.pi) - np.pi)
    inside = away < (cut.pitches - _SLACK) * 2 * np.pi / teeth
    inside &= np.hypot(x, y) < (1 - _SLACK) * cut.radius
    part, nodes = model.part(np.flatnonzero(inside[model.basis.element_dofs].any(axis=0)))
    dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
    free_dofs = np.flatnonzero(np.repeat(inside[nodes], 3))
    loads = rows.tocsc()[:, dofs[free_dofs]].T.tocsc()
    return flexibility(part.stiffness[free_dofs][:, free_dofs].tocsr(), loads)


def _piece(
    model: UnassembledModel, line: ToothLine, shapes: sp.csr_matrix, teeth: int, cut: Cut
) -> Array:
    """T_c (BOTH, BOTH), along the axes of a tooth with these shapes B_s."""
    tooth = round(line.angle * teeth / (2 * np.pi)) % teeth
    node = averaging_tie("tooth", line.place, facet_sample(model, _root(model, tooth))).rows
    assert node is not None  # no rigid tie
    axes = sp.csr_matrix(turn(-line.angle))
    return cut_flexibility(model, line, sp.vstack([axes @ node, shapes]).tocsr(), teeth, cut)


def _turned(line: ToothLine, tooth: int, teeth: int) -> ToothLine:
    angle = line.angle + 2 * np.pi * tooth / teeth
    return ToothLine(angle, line.radius, line.helix_rate, line.face_width)


def _axes(tooth: int, teeth: int) -> Array:
    """(6, 6) from components along a tooth's axes to the ring's."""
    return turn(2 * np.pi * tooth / teeth)


def _root(model: FeModel, tooth: int) -> NDArray[np.int64]:
    return model.fe_mesh.facets[f"tooth_root_{tooth + 1:03d}"]


def _inner(sample: Sample, one: Array, two: Array) -> Array:
    return np.asarray(np.einsum("m,mci,mcj->ij", sample.weights, one, two))
