"""Gears and gear meshes of a stage at their centre distance: paths of contact, ratios, backlash.

Teeth are those of ``tooth``, radii and working angles those of ``radii``. The path of contact ends
at the tip circles. The backlash is the play that tooth thicknesses leave at the working circles,
plus an allowance of the case, by default

    j = 2/3 (0.06 mm + 0.0005 a + 0.03 m_n)

for the centre distance a and the normal module m_n, by which teeth of ring and sun (pinion) are
thinner. Linear contact has no coast flanks, and no allowance unless the case gives one.

Source: ISO/TR 10064-2:1996, recommended minimum for steel gears in steel housings, pitch-line
speeds below 15 m/s and usual tolerances of shafts, bearings and housing.

Where a case gives base diameters or working angles, the phases of planets and the gear-mesh order
still follow from tooth numbers, with radii p_b z/2π of the planet's base pitch
p_b = 2π r_b,planet/z_planet, which equal the base radii if these are consistent. The path of
contact then ends at the tip circles, or has the length of the given contact ratio.

In a parallel stage the pinion has the role of the sun, and the gear that of the planet.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from flexgear.gears.radii import StageRadii, gears_by_role, is_overridden, stage_radii
from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.member import MatedGear, PlanetGear
from flexgear.model.section import Refusal
from flexgear.model.stage_view import StageView

RULE = "2/3 (0.06 mm + 0.0005 a + 0.03 m_n), ISO/TR 10064-2"


def least_backlash(center_distance: float, normal_module: float) -> float:
    """Allowance j by the rule above, m."""
    return 2.0 / 3.0 * (0.06e-3 + 0.0005 * abs(center_distance) + 0.03 * normal_module)


def backlash_allowance(view: StageView, role: str, center_distance: float) -> float:
    """Normal backlash that thinner teeth of "ring" or "sun" leave, m."""
    stated: float | None = getattr(view.stage, f"backlash_{role}")
    if stated is not None:
        return stated
    if view.gear_mesh.contact_law == "linear":
        return 0.0
    return least_backlash(center_distance, view.stage.normal_module)


def backlash_source(view: StageView, role: str) -> str:
    """Phrase that says where the backlash comes from: the case, linear contact, or the rule, beside
    that of profile shifts at the centre distance."""
    unused = "linear contact, which pulls, does not use it"
    if getattr(view.stage, f"backlash_{role}") is not None:
        return f"the case{f'; {unused}' if view.gear_mesh.contact_law == 'linear' else ''}"
    shifts = f"profile shifts at the centre distance alone; {unused}"
    return shifts if view.gear_mesh.contact_law == "linear" else RULE


PER_PAIR_MODELS = ("per_pair", "face_load", "lumped")
ROUNDING = 1e-3  # play in modules, 2 tan α Σδx, from profile shifts rounded to three decimals


@dataclass(frozen=True)
class GearMeshGeometry:
    """Geometry of one gear mesh. working_angle: transverse, rad; s_lo, s_hi: ends of the path of
    contact on the planet's line of action, m; base_pitch: m; backlash: normal, m; allowance: its
    part from thinner teeth, m."""

    working_angle: float
    s_lo: float
    s_hi: float
    base_pitch: float
    transverse_contact_ratio: float
    overlap_ratio: float
    backlash: float
    allowance: float

    @property
    def total_contact_ratio(self) -> float:
        """Total contact ratio ε_γ = ε_α + ε_β."""
        return self.transverse_contact_ratio + self.overlap_ratio


@dataclass(frozen=True)
class StageGeometry(StageRadii):
    """Gears by role ("sun", "planet", "ring"), gear meshes by "sun" and "ring", radii.

    overridden: whether the case gives a base diameter or working angle; radii of the gears then
    follow from tooth numbers. planet_clearance: gap between tips of neighbouring planets, m (∞ for
    one planet); assembly: (z_s + z_r)/N, NaN for a parallel stage, which has no ring.
    """

    gears: Mapping[str, ToothGeometry] = field(repr=False)
    gear_meshes: Mapping[str, GearMeshGeometry] = field(repr=False)
    overridden: bool
    planet_clearance: float
    assembly: float

    @property
    def sun(self) -> ToothGeometry:
        """Teeth of the sun, or of the pinion of a parallel stage."""
        return self.gears["sun"]

    @property
    def planet(self) -> ToothGeometry:
        """Teeth of the planet, or of the gear of a parallel stage."""
        return self.gears["planet"]

    @property
    def ring(self) -> ToothGeometry:
        """Teeth of the ring."""
        return self.gears["ring"]

    @property
    def sun_gear_mesh(self) -> GearMeshGeometry:
        """Gear mesh of sun and planet, or of pinion and gear."""
        return self.gear_meshes["sun"]

    @property
    def ring_gear_mesh(self) -> GearMeshGeometry:
        """Gear mesh of planet and ring."""
        return self.gear_meshes["ring"]


def stage_geometry(view: StageView) -> StageGeometry:
    """Geometry of a stage, of one half if it is double-helical. Raises InputError for gears that do
    not mesh, planets that collide, and gear-mesh models that need true teeth where the case gives
    base diameters or angles."""
    stage, radii, overridden = view.stage, stage_radii(view), is_overridden(view.stage)
    if overridden and view.gear_mesh.model in PER_PAIR_MODELS:
        problem = f"{view.gear_mesh.model} needs true teeth, but base diameters or angles are given"
        remedy = "use constant, rectangular or fourier, or take those out"
        raise view.refuse("gear_mesh.model", problem, remedy)
    gears = {role: _tooth(view, role, gear) for role, gear in gears_by_role(stage).items()}
    if overridden:
        arm = radii.base["planet"] / gears["planet"].teeth
        gears = {s: replace(tooth, base_radius=arm * tooth.teeth) for s, tooth in gears.items()}
    gear_meshes = {role: _gear_mesh(view, radii, gears, role) for role in gears if role != "planet"}
    clearance = planet_clearance(
        stage.planet_angles, radii.center_distance, gears["planet"].tip_radius
    )
    if clearance < 0 and not (overridden and stage.allow_unassemblable):
        instead = ", or set allow_unassemblable = true" if overridden else ""
        problem = f"neighbouring planets collide: their tips overlap by {-1e3 * clearance:.2f} mm"
        remedy = f"use fewer planets, fewer planet teeth or other planet positions{instead}"
        raise view.refuse("planets", problem, remedy)
    teeth = sum(gear.teeth for role, gear in gears.items() if role != "planet")
    assembly = teeth / stage.planets if stage.kind == "planetary" else math.nan
    return StageGeometry(
        **vars(radii), gears=gears, gear_meshes=gear_meshes, overridden=overridden,
        planet_clearance=clearance, assembly=assembly,
    )  # fmt: skip


def _tooth(view: StageView, role: str, gear: MatedGear | PlanetGear) -> ToothGeometry:
    """Teeth of a gear. Raises InputError for a tool that cannot cut them or leaves no involute."""
    part = view.part(role)
    try:
        tooth = tooth_geometry(gear, view.stage, internal=role == "ring")
    except Refusal as fault:
        raise view.refuse(f"{part}.{fault.key}", fault.problem, fault.remedy) from None
    try:
        form = tooth.form_radius
    except ValueError as fault:
        raise view.refuse(f"{part}.dedendum", str(fault), "lower it, or use more teeth") from None
    if tooth.outward * (tooth.tip_radius - form) <= 0.0:
        problem = (
            f"leaves no involute: it would begin at {2e3 * form:.3f} mm, beyond the tip circle"
        )
        raise view.refuse(f"{part}.dedendum", problem, "lower it, or raise the profile shift")
    return tooth


def planet_clearance(positions: Sequence[float], distance: float, tip_radius: float) -> float:
    """Gap between tips of neighbouring planets at angles ``positions``, m; ∞ for one planet."""
    angles = sorted(angle % (2 * math.pi) for angle in positions)
    if len(angles) < 2:
        return math.inf
    gaps = [b - a for a, b in zip(angles, [*angles[1:], angles[0] + 2 * math.pi], strict=True)]
    return 2 * distance * math.sin(min(*gaps, math.pi) / 2) - 2 * tip_radius


def _gear_mesh(
    view: StageView, radii: StageRadii, gears: Mapping[str, ToothGeometry], role: str
) -> GearMeshGeometry:
    """Geometry of one gear mesh. Where the case gives a contact ratio, the path has its length,
    about the middle of the path between the tip circles, or about the pitch point where that is
    shorter than a base pitch."""
    stage, planet = view.stage, gears["planet"]
    angle = radii.working_angles[role]
    pitch, options, ratio = planet.base_pitch, view.gear_mesh, None
    if options.model not in PER_PAIR_MODELS:
        ratio = options.of(role, "contact_ratio")
    allowance = backlash_allowance(view, role, radii.center_distance)
    low, high = planet.path_of_contact(gears[role], angle)
    if is_overridden(stage):
        backlash = allowance
        if high - low < pitch:
            if ratio is None:
                ratio = _least_ratio(view, role, (high - low) / pitch)
            low = high = radii.base["planet"] * math.tan(angle)
    else:
        _require_contact(view, gears, role, radii)
        # zero where it is no larger than the rounding of profile shifts
        rounding = ROUNDING * view.stage.normal_module
        backlash = allowance + inherent_backlash(gears, role, radii)
        if backlash < -rounding:
            problem = f"teeth overlap by {-1e6 * backlash:.3g} µm at this distance"
            remedy = f"raise backlash_{role}_mm or change the centre distance"
            raise view.refuse(view.part(role), problem, remedy)
        backlash = backlash if backlash > (0.0 if allowance else rounding) else 0.0
    if ratio is not None:
        middle, half = 0.5 * (low + high), 0.5 * ratio * pitch
        low, high = middle - half, middle + half
    return GearMeshGeometry(
        working_angle=angle,
        s_lo=low,
        s_hi=high,
        base_pitch=pitch,
        transverse_contact_ratio=(high - low) / pitch if ratio is None else ratio,
        overlap_ratio=stage.face_width
        * math.sin(stage.helix_angle)
        / (math.pi * stage.normal_module),
        backlash=backlash,
        allowance=allowance,
    )


def _least_ratio(view: StageView, role: str, ratio: float) -> float:
    """Contact ratio in place of a ``ratio`` below one: 1 where the case gives a constant stiffness,
    on which it has no effect, else InputError."""
    if view.gear_mesh.model == "constant" and view.gear_mesh.of(role, "stiffness"):
        return 1.0
    problem = f"the tips leave a contact ratio of {ratio:.3f} ({view.part(role)})"
    remedy = f"give {role}_contact_ratio, or check module and base diameters"
    raise view.refuse(f"gear_mesh.{role}_contact_ratio", problem, remedy)


def _require_contact(
    view: StageView, gears: Mapping[str, ToothGeometry], role: str, radii: StageRadii
) -> None:
    """Raises InputError for interference, tips that reach roots, and a contact ratio below one."""
    gear, planet = gears[role], gears["planet"]
    angle = radii.working_angles[role]
    if gear.internal and gear.tip_radius <= gear.base_radius:
        remedy = "reduce the addendum or raise the profile shift of the ring"
        raise view.refuse("ring.addendum", "the ring's tip lies inside its base circle", remedy)
    if planet.interferes_with(gear, angle):
        problem = "the ring's tip touches the planet's flank below its base circle (interference)"
        remedy = "reduce it, or raise the number of planet teeth"
        raise view.refuse("ring.addendum", problem, remedy)
    for part, tooth in ((role, gear), ("planet", planet)):
        if tooth.thickness_at(tooth.tip_radius) <= 0:
            problem = "flanks meet below the tip circle (pointed teeth)"
            remedy = "lower it, or the profile shift"
            raise view.refuse(f"{view.part(part)}.addendum", problem, remedy)
    room = bottom_clearance(gear, planet, radii.center_distance)
    if min(room) < 0:
        short = view.part(role if room[0] < room[1] else "planet")
        problem = (
            f"a tip reaches {-1e3 * min(room):.2f} mm into the root of its mate ({view.part(role)})"
        )
        raise view.refuse(f"{short}.dedendum", problem, "raise it, or lower the mate's addendum")
    low, high = planet.path_of_contact(gear, angle)
    if high - low < planet.base_pitch:
        problem = f"transverse contact ratio {(high - low) / planet.base_pitch:.3f} is below 1"
        remedy = "raise addenda or change profile shifts"
        if (play := inherent_backlash(gears, role, radii)) > ROUNDING * view.stage.normal_module:
            shift = play / (2.0 * view.stage.normal_module * math.sin(view.stage.pressure_angle))
            problem += f", and profile shifts leave a backlash of {1e3 * play:.3g} mm there"
            remedy = f"add {shift:.3g} to their sum, or change the centre distance"
        raise view.refuse(view.part(role), problem, remedy)


def bottom_clearance(
    gear: ToothGeometry, planet: ToothGeometry, distance: float
) -> tuple[float, float]:
    """Bottom clearance at the gear's root and at the planet's root, m."""
    if gear.internal:
        return (
            gear.root_radius - distance - planet.tip_radius,
            gear.tip_radius - distance - planet.root_radius,
        )
    return (
        distance - planet.tip_radius - gear.root_radius,
        distance - gear.tip_radius - planet.root_radius,
    )


def inherent_backlash(gears: Mapping[str, ToothGeometry], role: str, radii: StageRadii) -> float:
    """Normal play that thicknesses leave at the working circles, m; negative if teeth overlap."""
    gear, planet = gears[role], gears["planet"]
    cos_w = math.cos(radii.working_angles[role])
    r_g, r_p = gear.base_radius / cos_w, planet.base_radius / cos_w
    play = planet.pitch_angle * r_p - gear.thickness_at(r_g) - planet.thickness_at(r_p)
    return play * cos_w * math.cos(radii.base_helix_angle)
