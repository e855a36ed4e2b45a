"""Shapes of the teeth of a case's FE ring: whether they count, the cache, slices of its pairs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import interp1d

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.slices import Slices
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.stage_view import StageView
from flexgear.structures.build import ring_condensed, ring_key
from flexgear.structures.estimate import PROMISED, judged, shape_errors
from flexgear.structures.fe_mesh import SegmentParameters
from flexgear.structures.fe_mesh.tooth_block import base_section_angle
from flexgear.structures.interfaces import ring_supports
from flexgear.structures.linalg.threads import single_threaded_blas
from flexgear.structures.probe_loads import END_SHARE
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.tooth_influence.flank import involute_normals
from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.influence_cache import Form, cached
from flexgear.structures.tooth_influence.of_case import (
    influence_parameters,
    is_tied,
    tooth_influence,
)
from flexgear.structures.tooth_influence.pairs import mating_flanks, some_places
from flexgear.structures.tooth_influence.ring_shapes import (
    Cut,
    RingShapes,
    rim_flexibility,
    ring_shapes,
)
from flexgear.structures.tooth_shapes import ORDERS, RimFlexibility, ToothLine, carried

Array = NDArray[np.float64]

_ARRAYS = ("teeth", "count", "loads", "fixed", "piece", "less")
_SLICES = 20  # of the loads of the estimate
_PLACES = 251  # contact lines that are computed; linear between
SHAPES = Form(
    "ring_shapes",
    2,
    lambda bending: {name: getattr(bending, name) for name in _ARRAYS},
    lambda arrays: RingShapes(**{name: arrays[name] for name in _ARRAYS}),
)


def has_shapes(view: StageView) -> bool:
    """Whether teeth of a stage may take shapes: an FE ring whose slices bend each other, tied at
    its roots by averaging ties, and not given reduced."""
    asked = view.gear_mesh.model == "face_load" and view.gear_mesh.tooth_compliance == "fe"
    fe = asked and is_tied(view, "ring") and view.ring.tooth_shapes != "none"
    return fe and view.ring.fe_mesh != "reduced"


def kept_shapes(view: StageView) -> RingShapes:
    """Of the case's ring, from the cache or made, which takes another factor of its matrix."""
    teeth, line, cut = view.ring_gear.teeth, _first_line(view), _cut(view)

    def made() -> RingShapes:
        model, condensation = ring_condensed(view)
        with single_threaded_blas():
            return ring_shapes(model, condensation, line, teeth, cut)

    content = {"shapes_of": ring_key(view), "orders": ORDERS, "line": line, "cut": cut}
    return cached(content, made, SHAPES)


def with_rim(view: StageView, body: ReducedBody) -> ReducedBody:
    """The reduced ring with what its teeth yield along the face on the case's supports, where that
    counts, and its size in the report: the static error without it (``rim_error``) and whether it
    is taken in.

    Without it where ``has_shapes`` says no, or where the supports leave the ring free. The static
    error is that of the loads which the case's gear meshes put on teeth: at the ends of the face
    only where they distribute load along it.
    """
    if not has_shapes(view):
        return body if view.gear_mesh.model == "face_load" else _loaded_evenly(body)
    b, line = body.interface_dofs, _first_line(view)
    supports, stiffness = ring_supports(view, body), body.stiffness[:b, :b]
    try:
        with single_threaded_blas():
            rim = rim_flexibility(kept_shapes(view), stiffness, supports, line)
    except np.linalg.LinAlgError:
        return body
    influence = tooth_influence(view, "ring")
    assert influence is not None  # has_shapes
    error = rim_error(rim, influence, _parameters(view).tooth)
    counts = view.ring.tooth_shapes == "always" or error > PROMISED
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


def _parameters(view: StageView) -> SegmentParameters:
    parameters = influence_parameters(view, "ring")
    assert parameters is not None  # has_shapes
    return parameters


def _first_line(view: StageView) -> ToothLine:
    p = _parameters(view)
    return ToothLine(0.0, p.tooth.reference_radius, p.helix_rate, p.face_width)


def _cut(view: StageView) -> Cut:
    """Where the segment of the ring's tooth is held: beyond the lands beside its last teeth."""
    p = _parameters(view)
    assert p.held_radius is not None
    land = 1.0 - base_section_angle(p.tooth) / p.tooth.pitch_angle
    return Cut(0.5 * (p.teeth - 1) + land + p.margin, p.held_radius)


def _at(s: Array, table: Array, places: Array) -> Array:
    """Rows of a table over s at other places."""
    return np.asarray(interp1d(s, table, axis=0, copy=False, assume_sorted=True)(places))
