"""Gear pairs of ISO 6336: data that do not depend on the load, nominal load, load cycles.

F_t acts at the reference circle of one gear mesh of one planet (and of one half of a double-helical
stage); both gear meshes of a planet are rated separately. Gears are "sun", "planet" and "ring"; the
pinion of a parallel stage counts as "sun" and its gear as "planet".

Load cycles per second of flanks and roots, for N planets:

    sun N |ω_s − ω_c|/2π,  ring N |ω_c − ω_r|/2π,  each flank of a planet |ω_p − ω_c|/2π

The root of a planet is loaded once a turn in both directions: one full alternation, not two cycles.
In a parallel stage pinion and gear are loaded once a turn.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from flexgear.gears.geometry import GearMeshGeometry, StageGeometry, stage_geometry
from flexgear.gears.nominal_stress import RootStress, root_stress, virtual_teeth
from flexgear.gears.power_flow import StageFlow
from flexgear.gears.radii import gears_by_role
from flexgear.gears.rating.steels import allowable_stress
from flexgear.gears.stiffness import (
    iso_numbers,
    iso_theoretical_stiffness,
    iso_transverse_stiffness,
)
from flexgear.gears.tooth import ToothGeometry, base_helix_angle, transverse_angle
from flexgear.model.bodies import Material
from flexgear.model.member import GearMember
from flexgear.model.rating import GearRating, Rating
from flexgear.model.section import Refusal
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView

FINE_GRADE = 4  # coarsest accuracy grade with Y_DT below 1


@dataclass(frozen=True)
class PairLoad:
    """Nominal load of a gear pair. tangential_force: F_t of one gear mesh at the reference circle,
    N; velocity: of the reference circle relative to the carrier, m/s; both ≥ 0."""

    tangential_force: float
    velocity: float


@dataclass(frozen=True)
class RatedGear:
    """One gear of a rated pair.

    root: nominal root stress under F_t = 1 N and its factors; flank_strength, root_strength:
    σ_Hlim, σ_Flim, Pa, None if data are missing; rim_factor: Y_B, None if the rim is unknown;
    rim_left_out: whether it leaves out the bending of a thin rim, that of a flexible FE body;
    inertia: J per face width, kg m; turns: whether it rotates about its axis; face_width: effective
    for the root, m; idler: whether sun and ring load its teeth in turn; reversal: lower over
    higher of the loads on both flanks of a tooth, 1 of idlers; relief: C_αa + C_αf of the flank in
    this gear mesh, m; roll_length: at the pitch point, m.
    """

    part: str
    name: str
    teeth: int
    tooth: ToothGeometry
    data: GearRating
    root: RootStress
    flank_strength: float | None
    root_strength: float | None
    rim_factor: float | None
    rim_left_out: bool
    inertia: float
    turns: bool
    face_width: float
    idler: bool
    reversal: float
    relief: float
    roll_length: float

    @property
    def reference_diameter(self) -> float:
        """Reference diameter d, m."""
        return 2.0 * self.tooth.reference_radius


@dataclass(frozen=True)
class GearPair:
    """Gear mesh "sun" or "ring" of a stage for rating.

    gears: by part, "planet" and the role, the smaller gear (pinion of ISO 6336) first;
    theoretical_stiffness, single_stiffness: c'_th, c' at high loads, N/m² along the transverse line
    of action, with z_n = z/(cos² β_b cos β) as in ISO/TR 6336-30; viscosity: ν_40, m²/s.
    """

    role: str
    gears: Mapping[str, RatedGear]
    geometry: GearMeshGeometry
    stage: Stage
    base_helix_angle: float
    transverse_angle: float
    material: Material
    theoretical_stiffness: float
    single_stiffness: float
    viscosity: float | None
    rules: Rating

    @property
    def pinion(self) -> RatedGear:
        """The smaller gear."""
        return next(iter(self.gears.values()))

    @property
    def wheel(self) -> RatedGear:
        """The larger gear, or the ring."""
        return list(self.gears.values())[1]

    @property
    def internal(self) -> bool:
        """Whether the wheel is a ring."""
        return self.role == "ring"

    @property
    def pitch(self) -> float:
        """Transverse pitch p_t at the reference circle, m."""
        return math.pi * self.stage.normal_module / math.cos(self.stage.helix_angle)

    @property
    def gear_mesh_stiffness(self) -> float:
        """Gear-mesh stiffness c_γα at high loads, N/m²; ISO 6336-1:2006, 9.3."""
        return self.single_stiffness * (0.75 * self.geometry.transverse_contact_ratio + 0.25)

    def curvature(self, part: str, place: float = 0.0) -> float:
        """Radius of curvature of a flank in transverse section, m. place: distance from the pitch
        point along the path of contact, towards the planet's tip, m."""
        gear = self.gears[part]
        sign = 1.0 if part == "planet" or self.internal else -1.0
        return gear.roll_length + sign * place

    def relative_curvature(self, place: float = 0.0) -> float:
        """Radius of relative curvature ρ_red in transverse section, m; ISO 6336-2:2006, 12.3.
        place: as in ``curvature``."""
        small, large = (self.curvature(part, place) for part in self.gears)
        return small * large / (large - small if self.internal else large + small)

    @property
    def profile_modification(self) -> float:
        """Profile modification factor f_ZCa of ISO 6336-2."""
        stated = self.rules.profile_modification_factor
        return 1.0 if stated is None or self.rules.edition == 2006 else stated

    def single_pair_factor(self, part: str) -> float:
        """Factor from the pitch point to the inner point of single contact (ISO 6336-2): Z_B of the
        pinion, Z_D of the wheel; equations in ``capacity``."""
        gear_mesh, ratio = self.geometry, 1.0
        overlap = min(gear_mesh.overlap_ratio, 1.0)
        if overlap < 1.0 and not self.gears[part].tooth.internal:
            inner = gear_mesh.s_hi - gear_mesh.base_pitch
            if part != "planet":
                inner = gear_mesh.s_lo + gear_mesh.base_pitch
            place = inner - self.gears["planet"].roll_length
            at_pitch_point = math.prod(self.curvature(name) for name in self.gears)
            at_inner = math.prod(self.curvature(name, place) for name in self.gears)
            if at_inner <= 0.0:
                return math.inf
            ratio = math.sqrt(at_pitch_point / at_inner)
        return max(1.0, ratio - overlap * (ratio - math.sqrt(self.profile_modification)))

    @property
    def deep_tooth_factor(self) -> float:
        """Deep tooth factor Y_DT of ISO 6336-3."""
        ratio = self.geometry.transverse_contact_ratio / math.cos(self.base_helix_angle) ** 2
        grades = [gear.data.accuracy_grade for gear in self.gears.values()]
        if ratio <= 2.05 or any(grade is None or grade > FINE_GRADE for grade in grades):
            return 1.0
        return 2.366 - 0.666 * ratio if ratio <= 2.5 else 0.7


def gear_pair(view: StageView, g: StageGeometry, role: str) -> GearPair:
    """Gear pair of the gear mesh "sun" or "ring" of a stage. Raises InputError where the case gives
    base diameters or working angles, which do not define tooth roots."""
    stage = view.stage
    width = view.case.rating.face_width(stage.name, role)
    if width is not None:
        stage = stage.model_copy(update={"face_width": width})
        others = (stage if s.name == stage.name else s for s in view.case.stages)
        view = view.case.model_copy(update={"stages": tuple(others)}).view(stage.name)
        g = stage_geometry(view)
    if g.overridden:
        raise view.refuse(
            view.part(role),
            "cannot be rated, as the case gives base diameters or working angles",
            "take these out, so that teeth follow from module, tooth numbers and profile shifts",
        )
    (first, second), (shift, other) = iso_numbers(view, role)
    large = math.inf if role == "ring" else virtual_teeth(second, stage)
    if role == "ring":  # unlike ``iso_numbers``, with the shift of the ring (ISO/TR 6336-30)
        other = gears_by_role(stage)["ring"].profile_shift
    theoretical = iso_theoretical_stiffness((virtual_teeth(first, stage), large), (shift, other))
    parts = sorted(("planet", role), key=lambda part: g.gears[part].teeth)
    lubricant = view.case.lubricant
    return GearPair(
        role=role,
        gears={part: _gear(view, g, role, part) for part in parts},
        geometry=g.gear_meshes[role],
        stage=stage,
        base_helix_angle=base_helix_angle(stage),
        transverse_angle=transverse_angle(stage),
        material=view.material,
        theoretical_stiffness=theoretical,
        single_stiffness=iso_transverse_stiffness(view, role, theoretical),
        viscosity=None if lubricant is None else lubricant.viscosity_40,
        rules=view.case.rating,
    )


def _gear(view: StageView, g: StageGeometry, role: str, part: str) -> RatedGear:
    """Gear ``part`` of the pair ``role``."""
    stage, tooth, gear_mesh = view.stage, g.gears[part], g.gear_meshes[role]
    member, name = gears_by_role(stage)[part], view.part(part)
    unit = 1.0 / (math.cos(base_helix_angle(stage)) * math.cos(transverse_angle(stage)))
    try:
        strengths = [allowable_stress(member.rating, place) for place in ("flank", "root")]
    except Refusal as fault:
        key = f"{name}.rating.{fault.key}"
        raise view.refuse(key, fault.problem, fault.remedy) from None
    rim = _rim(view, part, tooth, member)
    rim_factor = _rim_factor(member, tooth, rim, stage.normal_module)
    left_out = rim_is_flexible(member) and member.rating.rim_factor is None
    idler = part == "planet" and stage.kind == "planetary"
    modifications = member.modifications.of(role if idler else "drive")
    reliefs = (modifications.tip_relief, modifications.root_relief)
    return RatedGear(
        part=part,
        name=name,
        teeth=member.teeth,
        tooth=tooth,
        data=member.rating,
        root=root_stress(tooth, member, stage, gear_mesh, unit, view.case.rating.edition),
        flank_strength=strengths[0],
        root_strength=strengths[1],
        rim_factor=1.0 if left_out else rim_factor,
        rim_left_out=left_out and rim_factor != 1.0,
        inertia=_inertia(view, tooth, member, rim),
        turns=f"{stage.name}.{name}" not in view.case.held_members(),
        face_width=_root_width(view, member, f"{name}.rating.face_width_mm"),
        idler=idler,
        reversal=float(idler),
        relief=sum(relief.amount for relief in reliefs if relief is not None),
        roll_length=tooth.base_radius * math.tan(gear_mesh.working_angle),
    )


def _root_width(view: StageView, member: GearMember, key: str) -> float:
    """Effective face width of a root, m; ISO 6336-3:2006, clause 5. At most one module more at each
    end than the gear mesh. Raises InputError for a gear that is narrower than its gear mesh."""
    common, stated = view.stage.face_width, member.rating.face_width
    if stated is None:
        return common
    if stated < common:
        problem = f"is {1e3 * stated:g} mm, and the gear mesh is {1e3 * common:g} mm wide"
        raise view.refuse(key, problem, "face_width_mm of a stage is that of its narrower gear")
    return min(stated, common + 2.0 * view.stage.normal_module)


def _rim(view: StageView, part: str, tooth: ToothGeometry, member: GearMember) -> float | None:
    """Rim thickness s_R, m; ∞ for a gear without bore, None if unknown."""
    if not tooth.internal:
        bore = member.bore_diameter
        return tooth.root_radius - bore / 2 if bore else math.inf
    return view.ring.rim_thickness if view.stage.form("ring") == "fe" else member.rim_thickness


def rim_is_flexible(member: GearMember) -> bool:
    """Whether the rim is that of a flexible FE body."""
    body = getattr(member, "fe", None)
    return body is not None and body.flexible


def _rim_factor(
    member: GearMember, tooth: ToothGeometry, rim: float | None, module: float
) -> float | None:
    """Rim thickness factor Y_B of ISO 6336-3, None for an unknown or thinner rim. External 1.6
    ln(2.242 h_t/s_R) for 0.5 < s_R/h_t < 1.2, internal 1.15 ln(8.324 m_n/s_R) for 1.75 < s_R/m_n <
    3.5, 1 above."""
    if member.rating.rim_factor is not None:
        return member.rating.rim_factor
    if rim is None:
        return None
    if tooth.internal:
        if rim <= 1.75 * module:
            return None
        return max(1.0, 1.15 * math.log(8.324 * module / rim)) if rim < 3.5 * module else 1.0
    height = abs(tooth.tip_radius - tooth.root_radius)
    if rim <= 0.5 * height:
        return None
    return max(1.0, 1.6 * math.log(2.242 * height / rim)) if rim < 1.2 * height else 1.0


def _inertia(view: StageView, tooth: ToothGeometry, member: GearMember, rim: float | None) -> float:
    """Inertia J per face width, kg m; ISO 6336-1:2006, 6.4.8. Of a disc from its bore to the mean
    of tip and root circle, or of a ring from there to its outer diameter; ∞ for a ring of unknown
    rim."""
    mean_diameter = tooth.tip_radius + tooth.root_radius
    if not tooth.internal:
        outer, inner = mean_diameter, member.bore_diameter
    elif rim is None:
        return math.inf
    else:
        outer, inner = 2.0 * (tooth.root_radius + rim), mean_diameter
    return math.pi / 32.0 * view.material.density * (outer**4 - inner**4)


def pair_load(pair: GearPair, flow: StageFlow) -> PairLoad:
    """Nominal load F_t = F_n cos β_b cos α_t and v = f p_t, shared equally by the planets."""
    tangential = abs(flow.gear_mesh_forces[pair.role]) * math.cos(pair.base_helix_angle)
    tangential *= math.cos(pair.transverse_angle)
    return PairLoad(tangential, flow.gear_mesh_frequency * pair.pitch)


def load_cycles(view: StageView, flow: StageFlow) -> dict[tuple[str, str], float]:
    """Load cycles per second of flank and root by gear mesh ("sun", "ring") and part."""
    turn = 2.0 * math.pi
    rates = {("sun", "sun"): abs(flow.sun_speed - flow.carrier_speed) * view.stage.planets / turn}
    rates["sun", "planet"] = abs(flow.planet_relative_speed) / turn
    if view.stage.kind == "planetary":
        rates["ring", "planet"] = rates["sun", "planet"]
        rates["ring", "ring"] = (
            abs(flow.ring_speed - flow.carrier_speed) * view.stage.planets / turn
        )
    return rates
