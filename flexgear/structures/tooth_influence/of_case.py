"""Influence of the teeth of a stage's gears, and flexibility between slices of contact lines.

Influences are read from the cache or computed. A crack at the root adds to the compliance of a
flank

    ΔC_ij = b_i^T (F_cracked − F_whole) b_j ,   F = R^T K^{-1} R  (``influence``)

of one segment with and without the crack (``fe_mesh.tooth_segment``). ΔC is positive semidefinite,
as a crack removes connections, free of the local indentation, which is in both F, and independent
of the depth where the rim is held beyond some modules. It is added to the compliance of the tooth
by any model. Assumptions: the crack is open under all loads of the flank on its side, does not
grow, its faces carry no load, and it has no effect on neighbouring teeth.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, Self, TypeVar

import numpy as np
from scipy.interpolate import interp1d

from flexgear.arrays import Array, Ints
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.hertz import ContactBody, line_contact, relative_radius
from flexgear.gears.radii import gears_by_role
from flexgear.gears.slices import Slices
from flexgear.gears.stiffness import line_load
from flexgear.gears.tooth import ToothGeometry
from flexgear.gears.weber_banaschek import middle_depth
from flexgear.model.bodies import Material
from flexgear.model.faults import Fault
from flexgear.model.stage_view import StageView
from flexgear.structures.cache import cached_arrays
from flexgear.structures.fe_mesh.tooth_segment import (
    CrackedSegmentParameters,
    SegmentDivisions,
    SegmentParameters,
    cracked_segment,
)
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.tooth_influence.influence import (
    FlankCompliance,
    ToothInfluence,
    flank_nodes,
    free_displacements,
    held_flexibility,
    influence_of,
    unit_loads,
)
from flexgear.structures.tooth_influence.tip_edge import (
    LEAST_SLOPE,
    AtTip,
    at_tip,
    roll_along,
    tip_ends,
)

FLANK_LAYER = 0.2  # modules, depth of the subtracted layer; half of it needs elements half as long
DEEPEST = 4.0  # modules below the root circle: greatest depth where a body is held
MARGIN = 1.5  # pitches of rim beside three teeth; more changes plane deflection by 1 %
LAYER = 1.6  # modules, length of a layer along the face
LEAST_LAYERS, MOST_LAYERS = 8, 20  # memory: 15 take 4 GB
DIVISIONS = SegmentDivisions(
    flank=10, fillet=5, tooth=4
)  # plane deflection within 1 % of its limit


def tooth_influence(view: StageView, role: str) -> ToothInfluence | None:
    """Influence of a tooth of "sun", "planet" or "ring" (in a parallel stage "sun" is the pinion,
    "planet" the gear), from the cache or computed (a quarter of a minute).

    None where an FE body is tied at its flanks: it includes the tooth except line contact.
    """
    parameters, tied = influence_parameters(view, role), is_tied(view, role)
    if parameters is None:
        return None
    return segment_influence(parameters, view.material, tied=tied)


def segment_influence(p: SegmentParameters, m: Material, *, tied: bool) -> ToothInfluence:
    """Influence of the middle tooth of a segment, from the cache or computed; tied: see
    ``influence_of``."""
    young, poisson = m.young_modulus, m.poisson_ratio
    content = {"segment": p, "tied": tied, "young": young, "poisson": poisson}
    return cached_arrays(
        ToothInfluence, 6, content, lambda: influence_of(p, young, poisson, tied=tied)
    )


def is_tied(view: StageView, role: str) -> bool:
    """Whether the teeth of an FE body have averaging ties at their roots."""
    return view.fe_tie(role) == "root" and getattr(view.stage, role).fe.tie_kind == "averaging"


def influence_parameters(view: StageView, role: str) -> SegmentParameters | None:
    """The segment of a gear, None where an FE body is tied at its flanks.

    Three teeth, held at the body's bore (a ring's outer diameter), at most ``DEEPEST`` below the
    root, and at cuts across the rim. Of an FE body with rigid ties at the roots, which clamp the
    base sections: one tooth, cut off there. InputError where a tooth or the rim below it cannot be
    meshed.
    """
    tooth, tie = stage_geometry(view).gears[role], view.fe_tie(role)
    if tie == "flank":
        return None
    require_teeth(view, role, tooth)
    segment = one_tooth(view, role, tooth)
    if tie == "root" and not is_tied(view, role):
        return segment
    held = held_radius(view, role, tooth, DEEPEST)
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
    """InputError where a tooth or the rim below it cannot be meshed; other: a second remedy."""
    part, remedy = view.part(role), f"lower it, or {other}"
    if tooth.half_angle(tooth.tip_radius) <= 0.0:
        problem = "the tooth is pointed before its tip circle, so no FE mesh can be made of it"
        raise view.refuse(f"{part}.addendum", problem, remedy)
    rim = tooth.root_radius - gears_by_role(view.stage)[role].bore_diameter / 2
    if not tooth.internal and rim < view.stage.normal_module:
        problem = f"leaves a rim of {1e3 * rim:.2f} mm below the teeth, less than one module"
        raise view.refuse(f"{part}.bore_diameter_mm", problem, remedy)


def held_radius(view: StageView, role: str, tooth: ToothGeometry, modules: float) -> float:
    """Radius ``modules`` below the root circle, m, or of the bore (a ring's outer diameter) where
    the rim is thinner."""
    deepest = tooth.root_radius - tooth.outward * modules * view.stage.normal_module
    gear = gears_by_role(view.stage)[role]
    if role == "ring":
        fe = view.stage.form("ring") == "fe"
        rim = view.ring.rim_thickness if fe else gear.rim_thickness
        return deepest if rim is None else min(deepest, tooth.root_radius + rim)
    return max(deepest, gear.bore_diameter / 2)


PAIR_PLACES = 251  # contact lines for which the flexibility is computed; linear between
_LEAST_WIDTH = 1e-6  # of the face, where a line has left it


@dataclass(frozen=True)
class PairBending:
    """Flexibility of a tooth pair at path coordinates (S,), for contact lines of K slices each.

    flexibility (S, K, K) m/N of both teeth between the slices of a line; beside (S, 2, K, K) m/N:
    displacement of its slices per force on those of the next two lines, each one base pitch
    further, through the bodies below them; scale a m/N and limit d N (S, K) of the approach
    a f ln(d/f) of line contact.
    """

    flexibility: Array
    beside: Array
    scale: Array
    limit: Array

    def with_rim(self, flexibility: Array, beside: Array) -> Self:
        """The pair with the additional flexibility of the rim of an FE gear (``rim_bending``)."""
        more = self.flexibility + flexibility, self.beside + beside
        return replace(self, flexibility=more[0], beside=more[1])


def pair_bending(view: StageView, path: GearMeshPath, slices: Slices, force: float) -> PairBending:
    """Flexibility between slices of contact lines, for ``gears.slices.with_flexibility``.

    force: of the gear mesh, N, for whose mean line load contacts at tip edges are solved
    (``tip_edge``; where both teeth have influences). Displacement and force of slices are along the
    flank's normal. ``beside`` omits neighbours in an FE body, which couple through its reduced
    model and its rim (``rim``).
    """
    width, some = widths(path, slices), some_places(slices, PAIR_PLACES)
    count = slices.count
    flexibility, bodies = np.zeros((len(some), count, count)), []
    beside = np.zeros((len(some), 2, count, count))
    flanks = mating_flanks(path, slices)
    influences = [tooth_influence(view, mating.name) for mating in flanks]
    load = line_load(view, stage_geometry(view), path.kind.gear, force)
    at_tips = _at_tips(path, slices, influences, load)
    for member, (mating, influence) in enumerate(zip(flanks, influences, strict=True)):
        if influence is None:
            steel, radius = view.material, np.hypot(mating.tooth.base_radius, mating.roll)
            depth = middle_depth(mating.tooth, radius)  # to the middle line of an FE body's tooth
            bodies.append(ContactBody(steel.young_modulus, steel.poisson_ratio, depth))
            continue
        flank, roll = mating.of(influence), mating.roll
        if (profile := slices.profile) is not None:
            centre = profile.at(profile.centre, _path_coordinates(path, slices), slices.z)
            roll = roll_along(mating.tooth, roll, centre if member else -centre)
        for tip in at_tips:
            inward = tip.inward if tip.member == member else -tip.inward
            roll = roll_along(mating.tooth, roll, inward)
        flexibility += flank.matrix(roll[some], slices.z[some], width[some])
        bodies.append(flank.contact_body(mating.roll))
        if flank.neighbour is not None:
            lines = (roll, slices.z, width)
            for pitches in (1, 2):
                places = (slices.s, some, pitches * path.base_pitch)
                beside[:, pitches - 1] += _further_line(flank, pitches * mating.step, lines, places)
    cos, internal = path.cos_base_helix, path.off_path.gear.internal
    radius = relative_radius(flanks[0].roll, flanks[1].roll, internal=internal) / cos
    contact = line_contact(bodies[0], bodies[1], radius)
    for tip in at_tips:
        contact = contact.softer(tip.alpha, tip.beta)
    if profile is not None:
        on, z = _path_coordinates(path, slices), slices.z
        more = profile.at(profile.alpha, on, z), profile.at(profile.beta, on, z)
        contact = contact.softer(more[0], np.maximum(more[1], -LEAST_SLOPE * contact.beta))
    scale, limit = contact.of_slice(width / cos)
    return PairBending(
        flexibility=rows_at(slices.s[some], flexibility, slices.s),
        beside=rows_at(slices.s[some], beside, slices.s),
        scale=scale,
        limit=limit,
    )


def _at_tips(
    path: GearMeshPath,
    slices: Slices,
    influences: Sequence[ToothInfluence | None],
    line_load: float,
) -> list[AtTip]:
    """Corrections of line contact at the slices for every tip edge in contact; none where a tooth
    has no influence."""
    planet, gear = influences
    if planet is None or gear is None:
        return []
    on, members = _path_coordinates(path, slices), (planet, gear)
    return [
        at_tip(end, members, path.cos_base_helix, line_load, slices.profile).at(on)
        for end in tip_ends(path, slices)
    ]


class _HasImages(Protocol):
    def mirrored(self) -> Self: ...
    def turned(self) -> Self: ...


Flank = TypeVar("Flank", bound=_HasImages)


class MatingFlank(NamedTuple):
    """Flanks of one gear over the contact lines of a gear mesh.

    name: "planet", "sun" or "ring"; sense: 1 where the force pushes the gear's teeth in +θ, on
    their −θ flank, else −1; step: number of teeth in +θ from one pair to the next; other_hand:
    whether the helix is mirrored, as in right halves; roll (S, K): roll length of slices, limited
    to the flank, m.
    """

    name: str
    tooth: ToothGeometry
    sense: int
    step: int
    other_hand: bool
    roll: Array

    def of(self, flank: Flank) -> Flank:
        """Data of this flank from those of the −θ flank with the gear's hand of helix."""
        flank = flank.mirrored() if self.other_hand else flank
        return flank if self.sense > 0 else flank.turned()


def mating_flanks(path: GearMeshPath, slices: Slices) -> list[MatingFlank]:
    """Flanks of the planet, then of its mate."""
    on = _path_coordinates(path, slices)
    members = (
        ("planet", path.off_path.planet, -path.planet_step, path.planet_step),
        (path.kind.gear, path.off_path.gear, path.gear_step, path.gear_step),
    )
    flanks = []
    for (name, tooth, sense, step), roll in zip(members, path.off_path.rolls(on), strict=True):
        low, high = sorted(map(tooth.roll_length, (tooth.form_radius, tooth.tip_radius)))
        held = np.clip(np.nan_to_num(roll, nan=high), max(low, 1e-3 * tooth.base_pitch), high)
        flanks.append(MatingFlank(name, tooth, sense, step, path.side == "right", held))
    return flanks


def _path_coordinates(path: GearMeshPath, slices: Slices) -> Array:
    """Path coordinates (S, K) of slices, m."""
    return np.clip(slices.s[:, None] + path.slope * slices.z, *slices.span)


def widths(path: GearMeshPath, slices: Slices) -> Array:
    """Axial widths (S, K) m of slices, small but positive where a line is beyond the face."""
    return np.maximum(slices.width, _LEAST_WIDTH * 2 * path.half_face)


def some_places(slices: Slices, most: int) -> Ints:
    """Indices of at most ``most`` of the contact lines, at even distances."""
    return np.unique(np.linspace(0, len(slices.s) - 1, most).astype(np.int64))


def _further_line(
    flank: ToothInfluence, step: int, lines: Sequence[Array], places: tuple[Array, Ints, float]
) -> Array:
    """Displacement C (S', K, K) m/N of slices of some contact lines per force on lines of the tooth
    ``step`` teeth further in +θ. lines: (roll, z, width) of all; places: path coordinates of all,
    indices of those to compute, and distance to the lines with the force, m."""
    s, some, distance = places
    further = np.clip(s[some] + distance, None, s[-1])
    at_lines = [line[some] for line in lines]
    at_further = [rows_at(s, line, further) for line in lines]
    if step > 0:
        return flank.coupling(at_lines, at_further, step)
    return np.swapaxes(flank.coupling(at_further, at_lines, -step), 1, 2)


def rows_at(s: Array, table: Array, places: Array) -> Array:
    """Rows of a table over s (S,), linearly interpolated at ``places``."""
    return np.asarray(interp1d(s, table, axis=0, copy=False, assume_sorted=True)(places))


WITHIN_LAYER = 9  # places over which the depth of a crack in a layer is averaged
CRACK_PLACES = 151  # contact lines that are computed; linear between
CRACK_DIVISIONS = SegmentDivisions(flank=6, fillet=7, rim=5)  # the crack determines ``tooth``


def crack_flexibility(view: StageView, path: GearMeshPath, lines: Slices, fault: Fault) -> Array:
    """ΔC (S, K, K) m/N between slices of contact lines by a crack in a tooth of either gear, from
    the cache or computed (half a minute)."""
    role = "planet" if fault.gear == view.part("planet") else path.kind.gear
    mating = next(m for m in mating_flanks(path, lines) if m.name == role)
    # the segment's z is reversed for turned and mirrored flanks and for left halves
    flipped = (mating.sense < 0) ^ mating.other_hand ^ (path.side == "left")
    p, material = crack_parameters(view, role, fault, -1.0 if flipped else 1.0), view.material
    if max(p.depths) == 0.0:
        return np.zeros((*lines.z.shape, lines.count))
    young, poisson = material.young_modulus, material.poisson_ratio
    content = {"cracked": p, "young": young, "poisson": poisson}
    added = cached_arrays(FlankCompliance, 1, content, lambda: added_compliance(p, young, poisson))
    some, width = some_places(lines, CRACK_PLACES), widths(path, lines)
    flank = mating.of(added)
    flexibility = flank.matrix(mating.roll[some], lines.z[some], width[some])
    return rows_at(lines.s[some], flexibility, lines.s)


def crack_parameters(
    view: StageView, role: str, fault: Fault, sense: float
) -> CrackedSegmentParameters:
    """Segment of a gear with a crack; sense: +1 where the segment's z is that of the case, −1 where
    it is reversed."""
    tooth = stage_geometry(view).gears[role]
    require_teeth(view, role, tooth, "take the crack out")
    cut_off = one_tooth(view, role, tooth)
    borders = cut_off.layer_positions
    share = (np.arange(WITHIN_LAYER) + 0.5) / WITHIN_LAYER
    depths = fault.depth_at(sense * (borders[:-1, None] + np.diff(borders)[:, None] * share))
    whole = replace(  # one tooth: neighbours change ΔC by less than 1 %
        cut_off,
        held_radius=held_radius(view, role, tooth, DEEPEST),
        divisions=replace(CRACK_DIVISIONS, layers=cut_off.divisions.layers),
        margin=MARGIN,
    )
    mean_depths = tuple(depths.mean(axis=1).tolist())
    return CrackedSegmentParameters(**vars(whole), angle=fault.angle, depths=mean_depths)


def added_compliance(
    p: CrackedSegmentParameters, young: float, poisson: float, *, plane_strain: bool = False
) -> FlankCompliance:
    """F_cracked − F_whole of the −θ flank of the middle tooth; young: Pa; plane_strain: as in
    ``influence_of``."""
    (whole, cracked), flexibility = cracked_segment(p), []
    for fe_mesh in (whole.fe_mesh, cracked):
        model = FeModel(fe_mesh, young, poisson, density=1.0)
        free = free_displacements(model, plane_strain=plane_strain)
        loads = unit_loads(whole, model, flank_nodes(whole, model, p.middle))
        flexibility.append(held_flexibility(model, free, loads))
    added = flexibility[1] - flexibility[0]
    compliance = 0.5 * (added + added.T)
    return FlankCompliance(roll=whole.roll, z=whole.z, slope=p.roll_slope, compliance=compliance)
