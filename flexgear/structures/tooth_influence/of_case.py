"""Influence of the teeth of a stage's gears: where their bodies are held, and the cache of them."""

from __future__ import annotations

import math
from dataclasses import replace

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.bodies import Material
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh import SegmentDivisions, SegmentParameters, tooth_segment
from flexgear.structures.tooth_influence.influence import ToothInfluence, flank_compliance
from flexgear.structures.tooth_influence.influence_cache import ROOT, TOOTH, cached
from flexgear.structures.tooth_influence.root_stress import (
    DEPTH,
    RootInfluence,
    root_influence,
    root_parameters,
)

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
    ``flank_compliance``."""
    return cached(
        {"segment": p, "tied": tied, "young": m.young_modulus, "poisson": m.poisson_ratio},
        lambda: influence_of(p, m.young_modulus, m.poisson_ratio, tied=tied),
        TOOTH,
    )


def root_of_case(view: StageView, role: str) -> RootInfluence:
    """Root stress of a tooth of a gear named as in ``tooth_influence``, from the cache or made
    (about a minute)."""
    parameters, m = root_segment(view, role), view.material
    return cached(
        {"root": parameters, "young": m.young_modulus, "poisson": m.poisson_ratio},
        lambda: root_influence(parameters, m.young_modulus, m.poisson_ratio),
        ROOT,
    )


def root_segment(view: StageView, role: str) -> SegmentParameters:
    """The submodel of a gear's root: cut ``DEPTH`` modules below the root circle, or at the bore
    (a ring's outer diameter) where the rim is thinner. InputError where there is no
    such tooth or rim."""
    tooth, module = stage_geometry(view).gears[role], view.stage.normal_module
    _require_teeth(view, role, tooth, 'set gear_mesh.root_stress = "none"')
    held = _held_radius(view, role, tooth, DEPTH)
    depth = tooth.outward * (tooth.root_radius - held) / module
    return root_parameters(_segment(view, role, tooth), module, depth)


def influence_of(
    parameters: SegmentParameters, young: float, poisson: float, *, tied: bool = False
) -> ToothInfluence:
    """Influence of the middle tooth of a segment; E in Pa; tied: see ``flank_compliance``."""
    segment, tooth = tooth_segment(parameters), parameters.tooth
    influence = flank_compliance(segment, young, poisson, tied=tied)
    return ToothInfluence(
        roll=segment.roll,
        z=segment.z,
        depth=segment.depth,
        own=influence.own,
        neighbour=influence.neighbour,
        slope=-tooth.outward * tooth.base_radius * parameters.helix_rate,
        young=young,
        poisson=poisson,
    )


def is_tied(view: StageView, role: str) -> bool:
    """Whether an averaging tie at the tooth's root takes in part of its flexibility."""
    return view.fe_tie(role) == "root" and getattr(view, role).tie_kind == "averaging"


def require_influences(view: StageView) -> None:
    """InputError for what a stage's influences would be refused for, without making any."""
    options = view.gear_mesh
    roles = ("planet", *stage_geometry(view).gear_meshes)
    if options.model == "face_load" and options.tooth_compliance == "fe":
        for role in roles:
            influence_parameters(view, role)
    if options.root_stress == "fe":
        for role in roles:
            root_segment(view, role)


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
    _require_teeth(view, role, tooth)
    if alone:
        return _segment(view, role, tooth)
    held, segment = _held_radius(view, role, tooth, DEEPEST), _segment(view, role, tooth)
    return replace(segment, held_radius=held, teeth=3, margin=MARGIN)


def _segment(view: StageView, role: str, tooth: ToothGeometry) -> SegmentParameters:
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


def _require_teeth(
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


def _held_radius(view: StageView, role: str, tooth: ToothGeometry, modules: float) -> float:
    """Radius so many modules below the root circle, or where the body ends before."""
    deepest = tooth.root_radius - tooth.outward * modules * view.stage.normal_module
    gear = gears_by_role(view.stage)[role]
    if role == "ring":
        fe = view.stage.form("ring") == "fe"
        rim = view.ring.rim_thickness if fe else gear.rim_thickness
        return deepest if rim is None else min(deepest, tooth.root_radius + rim)
    return max(deepest, gear.bore_diameter / 2)
