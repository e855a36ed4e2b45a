"""Influence of the teeth of a stage's gears: where their bodies are held, and the cache of it."""

from __future__ import annotations

import math
from dataclasses import replace

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.bodies import Material
from flexgear.model.stage_view import StageView
from flexgear.structures.cache import cached_arrays
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions, SegmentParameters
from flexgear.structures.tooth_influence.influence import ToothInfluence, influence_of

FLANK_LAYER = 0.2  # modules: dip cut off; at a tenth elements must be half as long for the same
DEEPEST = 4.0  # modules below the root circle where a body is held at the latest
MARGIN = 1.5  # pitches of rim beside three teeth; further away 1 % of the deflection in a plane
LAYER = 1.6  # modules of a layer along the face
LEAST_LAYERS, MOST_LAYERS = 8, 20  # memory: 15 take 2 GB, 30 take 5
DIVISIONS = SegmentDivisions(flank=10, fillet=5, tooth=4)  # plane deflection 1 % below the limit


def tooth_influence(view: StageView, role: str) -> ToothInfluence | None:
    """Influence of a tooth of "sun", "planet" or "ring" (of a parallel stage's pinion and gear,
    "sun" and "planet"), from the cache or made (half a minute).

    None where an FE body is tied at its flanks: it has the whole tooth, and only line contact
    ("point" at a depth of the tie's choice) stays outside.
    """
    parameters, tied = influence_parameters(view, role), is_tied(view, role)
    if parameters is None:
        return None
    return segment_influence(parameters, view.material, tied=tied)


def segment_influence(p: SegmentParameters, m: Material, *, tied: bool) -> ToothInfluence:
    """Influence of the middle tooth of a segment, from the cache or made; tied: see
    ``influence_of``."""
    young, poisson = m.young_modulus, m.poisson_ratio
    content = {"segment": p, "tied": tied, "young": young, "poisson": poisson}
    return cached_arrays(
        ToothInfluence, 6, content, lambda: influence_of(p, young, poisson, tied=tied)
    )


def is_tied(view: StageView, role: str) -> bool:
    """Whether an averaging tie at the tooth's root takes in part of its flexibility."""
    return view.fe_tie(role) == "root" and getattr(view, role).tie_kind == "averaging"


def influence_parameters(view: StageView, role: str) -> SegmentParameters | None:
    """The segment of a gear.

    Three teeth, held at the body's bore (a ring's outer diameter), ``DEEPEST`` below the root at
    the latest, and at cuts across the rim. A rigid tie at the root of an FE body holds the tooth's
    base section as a clamp does: one tooth, cut off there. InputError where a tooth or the rim
    below it cannot be made.
    """
    tooth = stage_geometry(view).gears[role]
    if view.fe_tie(role) == "flank":
        return None
    alone = view.fe_tie(role) == "root" and not is_tied(view, role)
    require_teeth(view, role, tooth)
    if alone:
        return one_tooth(view, role, tooth)
    held, segment = held_radius(view, role, tooth, DEEPEST), one_tooth(view, role, tooth)
    return replace(segment, held_radius=held, teeth=3, margin=MARGIN)


def one_tooth(view: StageView, role: str, tooth: ToothGeometry) -> SegmentParameters:
    """One tooth of a gear, cut off at its base section."""
    stage = view.stage
    hand = 1.0 if (stage.planet_hand == "right") == (role != "sun") else -1.0
    layers = math.ceil(stage.face_width / (LAYER * stage.normal_module))
    layers = min(max(layers, LEAST_LAYERS), MOST_LAYERS)
    return SegmentParameters(
        tooth=tooth,
        face_width=stage.face_width,
        helix_rate=hand * math.tan(stage.helix_angle) / tooth.reference_radius,
        held_radius=None,
        flank_layer=FLANK_LAYER * stage.normal_module,
        teeth=1,
        divisions=replace(DIVISIONS, layers=layers),
    )


def require_teeth(
    view: StageView,
    role: str,
    tooth: ToothGeometry,
    other: str = 'set gear_mesh.tooth_compliance = "width"',
) -> None:
    part, instead = view.part(role), f"lower it, or {other}"
    if tooth.half_angle(tooth.tip_radius) <= 0.0:
        problem = "the tooth is pointed before its tip circle, so no FE mesh can be made of it"
        raise view.refuse(f"{part}.addendum", problem, instead)
    rim = tooth.root_radius - gears_by_role(view.stage)[role].bore_diameter / 2
    if not tooth.internal and rim < view.stage.normal_module:
        problem = f"leaves a rim of {1e3 * rim:.2f} mm below the teeth, less than one module"
        raise view.refuse(f"{part}.bore_diameter_mm", problem, instead)


def held_radius(view: StageView, role: str, tooth: ToothGeometry, modules: float) -> float:
    """Radius so many modules below the root circle, or where the body ends before."""
    deepest = tooth.root_radius - tooth.outward * modules * view.stage.normal_module
    gear = gears_by_role(view.stage)[role]
    if role == "ring":
        fe = view.stage.form("ring") == "fe"
        rim = view.ring.rim_thickness if fe else gear.rim_thickness
        return deepest if rim is None else min(deepest, tooth.root_radius + rim)
    return max(deepest, gear.bore_diameter / 2)
