"""Shapes of the teeth of an FE ring: whether they count, the cache, slices of its pairs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import interp1d

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.slices import Slices
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.material import Material
from flexgear.structures.estimate import PROMISED, judged, shape_errors
from flexgear.structures.fe_mesh import SegmentParameters
from flexgear.structures.fe_mesh.tooth_block import base_section_angle
from flexgear.structures.fem.unassembled import UnassembledModel
from flexgear.structures.linalg.threads import single_threaded_blas
from flexgear.structures.probe_loads import END_SHARE
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.reduction import AnyCondensation
from flexgear.structures.tooth_influence.flank import involute_normals
from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.influence_cache import Form, cached
from flexgear.structures.tooth_influence.of_case import segment_influence
from flexgear.structures.tooth_influence.pairs import mating_flanks, some_places
from flexgear.structures.tooth_influence.ring_shapes import (
    Cut,
    RingShapes,
    rim_flexibility,
    ring_shapes,
)
from flexgear.structures.tooth_shapes import ORDERS, RimFlexibility, ToothLine, carried

Array = NDArray[np.float64]
Condensed = Callable[[], tuple[UnassembledModel, AnyCondensation]]

_ARRAYS = ("teeth", "count", "loads", "fixed", "piece", "less")
_SLICES = 20  # of the loads of the estimate
_PLACES = 251  # contact lines that are computed; linear between
SHAPES = Form(
    "ring_shapes",
    2,
    lambda bending: {name: getattr(bending, name) for name in _ARRAYS},
    lambda arrays: RingShapes(**{name: arrays[name] for name in _ARRAYS}),
)


@dataclass(frozen=True)
class TeethOfRing:
    """What decides whether teeth of an FE ring yield along the face beside their nodes.

    segment: of its teeth, None where they take no shapes; always: whether these count however
    little they are; along_face: whether gear meshes distribute load along the face.
    """

    number: int
    material: Material
    segment: SegmentParameters | None
    always: bool
    along_face: bool


def kept_shapes(
    segment: SegmentParameters, teeth: int, ring_key: str, condensed: Condensed
) -> RingShapes:
    """Of a ring, from the cache or made, which takes another factor of its matrix.

    ring_key: of what its reduced body depends on; condensed: makes the body and its condensation.
    """
    line, cut = first_line(segment), cut_of(segment)

    def made() -> RingShapes:
        model, condensation = condensed()
        with single_threaded_blas():
            return ring_shapes(model, condensation, line, teeth, cut)

    content = {"shapes_of": ring_key, "orders": ORDERS, "line": line, "cut": cut}
    return cached(content, made, SHAPES)


def with_rim(
    body: ReducedBody, teeth: TeethOfRing, supports: Array, ring_key: str, condensed: Condensed
) -> ReducedBody:
    """The reduced ring with what its teeth yield along the face on its supports, where that counts,
    and its size in the report: the static error without it (``rim_error``) and whether it is taken
    in. supports: (b, b) stiffness at its nodes; ring_key, condensed: see ``kept_shapes``.

    Without it where teeth take no shapes, or where the supports leave the ring free. The static
    error is that of the loads which the case's gear meshes put on teeth: at the ends of the face
    only where they distribute load along it.
    """
    segment = teeth.segment
    if segment is None:
        return body if teeth.along_face else _loaded_evenly(body)
    b, line = body.interface_dofs, first_line(segment)
    shapes = kept_shapes(segment, teeth.number, ring_key, condensed)
    try:
        with single_threaded_blas():
            rim = rim_flexibility(shapes, body.stiffness[:b, :b], supports, line)
    except np.linalg.LinAlgError:
        return body
    influence = segment_influence(segment, teeth.material, tied=True)
    error = rim_error(rim, influence, segment.tooth)
    counts = teeth.always or error > PROMISED
    report = {
        **body.report,
        **judged(body.report.get("static_error_cases", {}), None if counts else error),
        "rim_error": error,
        "rim_counts": counts,
    }
    return body.with_(rim=rim if counts else None, report=report)


def _loaded_evenly(body: ReducedBody) -> ReducedBody:
    """A ring whose teeth are loaded over the whole face."""
    cases = body.report.get("static_error_cases")
    return body.with_(report={**body.report, **judged(cases)}) if cases else body


def rim_bending(rim: RimFlexibility, path: GearMeshPath, slices: Slices) -> tuple[Array, Array]:
    """ΔC (S, K, K) and what it does to the slices of the next two lines, (S, BEYOND, K, K) m/N: as
    ``PairBending`` has them of both teeth. The right half of a ring is the mirror image of the
    left, z -> −z."""
    flank = mating_flanks(path, slices)[1]
    some, z = some_places(slices, _PLACES), -slices.z if flank.other_hand else slices.z
    here = flank_motion(rim, flank.tooth, -flank.sense, (flank.roll[some], z[some]))
    beside = []
    for apart, flexibility in enumerate(rim.beside, start=1):
        further = np.clip(slices.s[some] + apart * path.base_pitch, None, slices.s[-1])
        places = _at(slices.s, flank.roll, further), _at(slices.s, z, further)
        there = flank_motion(rim, flank.tooth, -flank.sense, places)
        after = flexibility if flank.step > 0 else flexibility.T
        beside.append(here @ after @ there.swapaxes(1, 2))
    both = here @ rim.own @ here.swapaxes(1, 2), np.stack(beside, axis=1)
    near, beyond = (_at(slices.s[some], c, slices.s) for c in both)
    return 0.5 * (near + near.swapaxes(1, 2)), beyond


def flank_motion(
    rim: RimFlexibility, tooth: ToothGeometry, side: int, places: tuple[Array, Array]
) -> Array:
    """G (…, 6 + shapes) at (roll, z) (…,) m of a flank, −θ: side −1, along its normal."""
    roll, z = places
    radius = np.hypot(tooth.base_radius, roll).ravel()
    angle = side * tooth.half_angle(radius) + rim.line.helix_rate * z.ravel()
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z.ravel()])
    normals = involute_normals(tooth, rim.line.helix_rate, points, side)
    return carried(rim.line, rim.less, points, normals).reshape(*z.shape, -1)


def rim_error(rim: RimFlexibility, influence: ToothInfluence, tooth: ToothGeometry) -> float:
    """The worst of ``shape_errors`` under even loads along the −θ flank at pitch height, over the
    face and at its ends."""
    width = np.full(_SLICES, rim.line.face_width / _SLICES)
    z = width[0] * (np.arange(_SLICES) + 0.5 - 0.5 * _SLICES)
    roll = np.full(_SLICES, tooth.roll_length(tooth.reference_radius))
    at_end = np.arange(_SLICES) < END_SHARE * _SLICES
    loads = np.array([np.ones(_SLICES), at_end, at_end[::-1]], dtype=float)
    motion = flank_motion(rim, tooth, -1, (roll, z))
    compliance = influence.matrix(roll, z, width)
    return float(shape_errors(compliance, motion @ rim.own @ motion.T, loads).max())


def first_line(p: SegmentParameters) -> ToothLine:
    """Line along the flank of the first tooth of a ring, at the reference circle."""
    return ToothLine(0.0, p.tooth.reference_radius, p.helix_rate, p.face_width)


def cut_of(p: SegmentParameters) -> Cut:
    """Where the segment of the ring's tooth is held: beyond the lands beside its last teeth."""
    assert p.held_radius is not None
    land = 1.0 - base_section_angle(p.tooth) / p.tooth.pitch_angle
    return Cut(0.5 * (p.teeth - 1) + land + p.margin, p.held_radius)


def _at(s: Array, table: Array, places: Array) -> Array:
    """Rows of a table over s at other places."""
    return np.asarray(interp1d(s, table, axis=0, copy=False, assume_sorted=True)(places))
