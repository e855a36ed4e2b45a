"""Gears and gear meshes of a stage at their centre distance: paths of contact, ratios, backlash.

Normal backlash that teeth are made with is what the case gives, else by a rule

    j = 2/3 (0.06 mm + 0.0005 a + 0.03 m_n)

for the centre distance a and the normal module m_n. It is an allowance: teeth of ring and sun
(pinion) are thinner by it, beside what profile shifts leave at the centre distance. Linear contact
has no coast flanks, and no allowance unless it is given.

Source: ISO/TR 10064-2:1996, recommended minimum for steel gears in steel housings, pitch-line
speeds below 15 m/s and usual tolerances of shafts, bearings and housing.

Teeth are those of ``tooth``, radii and working angles those of ``radii``. The path of contact lies
between the tips; teeth have the play that their thicknesses at the working circles leave, and what
the case asks for.

Where base diameters or working angles are given, tooth numbers still say how the gears roll: the
phases of planets and the order of the gear mesh come from radii p_b z/2π with the planet's base
pitch p_b = 2π r_b,planet/z_planet, which are the base radii wherever these fit one another. The
path of contact then lies between the tips, or is as long as the given contact ratio says.

A parallel stage has its pinion in the sun's role and its gear in the planet's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from flexgear.gears.radii import StageRadii, gears_by_role, is_overridden, stage_radii
from flexgear.gears.tooth import ToothGeometry, tooth_geometry
from flexgear.model.section import Refusal

if TYPE_CHECKING:
    from flexgear.model.member import MatedGear, PlanetGear
    from flexgear.model.stage_view import StageView


RULE = "2/3 (0.06 mm + 0.0005 a + 0.03 m_n), ISO/TR 10064-2"


def least_backlash(center_distance: float, normal_module: float) -> float:
    """j of the module's head, m."""
    return 2.0 / 3.0 * (0.06e-3 + 0.0005 * abs(center_distance) + 0.03 * normal_module)


def backlash_allowance(view: StageView, role: str, center_distance: float) -> float:
    """Normal backlash of the planets with "ring" or "sun" that thinner teeth make, m."""
    stated: float | None = getattr(view.stage, f"backlash_{role}")
    if stated is not None:
        return stated
    if view.gear_mesh.contact_law == "linear":
        return 0.0
    return least_backlash(center_distance, view.stage.normal_module)


def backlash_source(view: StageView, role: str) -> str:
    """Source of the backlash as a phrase: the case, linear contact (none), or the rule."""
    linear = view.gear_mesh.contact_law == "linear"
    if getattr(view.stage, f"backlash_{role}") is not None:
        return f"the case{'; linear contact takes none' if linear else ''}"
    return "linear contact takes none" if linear else RULE


PER_PAIR_MODELS = ("per_pair", "face_load", "lumped")
ROUNDED = 1e-3  # modules of play, 2 tan α Σδx, that profile shifts of three decimals make or take


@dataclass(frozen=True)
class GearMeshGeometry:
    """One gear mesh: working transverse pressure angle (rad), path of contact on the planet's
    line of action s_lo…s_hi (m), base pitch (m), contact ratios, normal backlash (m), and its part
    that teeth of ring or sun are thinner by, m."""

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
        """ε_γ = ε_α + ε_β."""
        return self.transverse_contact_ratio + self.overlap_ratio


@dataclass(frozen=True)
class StageGeometry(StageRadii):
    """Gears by role ("sun", "planet", "ring"), gear meshes by "sun" and "ring", radii.

    overridden: whether a base diameter or working angle is given; radii of the gears are then those
    of their tooth numbers. planet_clearance: gap between tips of neighbouring planets, m (∞ for one
    planet); assembly: (z_s + z_r)/N. A parallel stage has no ring; numbers of it are missing.
    """

    gears: Mapping[str, ToothGeometry]
    gear_meshes: Mapping[str, GearMeshGeometry]
    overridden: bool
    planet_clearance: float
    assembly: float

    @property
    def sun(self) -> ToothGeometry:
        """Sun, or pinion."""
        return self.gears["sun"]

    @property
    def planet(self) -> ToothGeometry:
        """Planet, or gear of a parallel stage."""
        return self.gears["planet"]

    @property
    def ring(self) -> ToothGeometry:
        """Ring of a planetary stage."""
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
    """Geometry of a stage, of one half if it is double-helical.

    Raises InputError for gears that cannot mesh, planets that collide, and models of the gear mesh
    that need true teeth where base diameters or angles are given.
    """
    stage, radii, overridden = view.stage, stage_radii(view), is_overridden(view.stage)
    if overridden and view.gear_mesh.model in PER_PAIR_MODELS:
        raise view.refuse(
            "gear_mesh.model",
            f"{view.gear_mesh.model} needs true teeth, but base diameters or angles are given",
            "use constant, rectangular or fourier, or take those out",
        )
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
        raise view.refuse(
            "planets",
            f"neighbouring planets collide: their tips overlap by {-1e3 * clearance:.2f} mm",
            f"use fewer planets, fewer planet teeth or other planet positions{instead}",
        )
    teeth = sum(gear.teeth for role, gear in gears.items() if role != "planet")
    assembly = teeth / stage.planets if stage.kind == "planetary" else math.nan
    return StageGeometry(
        **vars(radii), gears=gears, gear_meshes=gear_meshes, overridden=overridden,
        planet_clearance=clearance, assembly=assembly,
    )  # fmt: skip


def _tooth(view: StageView, role: str, gear: MatedGear | PlanetGear) -> ToothGeometry:
    """InputError for a tool that cannot cut it, or that leaves no involute."""
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
    """One gear mesh, with a path as long as a contact ratio that is given, about the same middle
    (the pitch point where tips do not reach each other)."""
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
        backlash = _backlash(view, gears, role, radii, allowance)
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
    """1 where nothing follows from the contact ratio, which is constant stiffness that is given."""
    if view.gear_mesh.model == "constant" and view.gear_mesh.of(role, "stiffness"):
        return 1.0
    raise view.refuse(
        f"gear_mesh.{role}_contact_ratio",
        f"the tips leave a contact ratio of {ratio:.3f} ({view.part(role)})",
        f"give {role}_contact_ratio, or check module and base diameters",
    )


def _require_contact(
    view: StageView, gears: Mapping[str, ToothGeometry], role: str, radii: StageRadii
) -> None:
    """InputError for interference, tips that reach roots, and a contact ratio below one."""
    gear, planet = gears[role], gears["planet"]
    angle = radii.working_angles[role]
    if gear.internal and gear.tip_radius <= gear.base_radius:
        raise view.refuse(
            "ring.addendum", "the ring's tip lies inside its base circle",
            "reduce the addendum or raise the profile shift of the ring",
        )  # fmt: skip
    if planet.interferes_with(gear, angle):
        raise view.refuse(
            "ring.addendum",
            "the ring's tip touches the planet's flank below its base circle (interference)",
            "reduce it, or raise the number of planet teeth",
        )
    for part, tooth in ((role, gear), ("planet", planet)):
        if tooth.thickness_at(tooth.tip_radius) <= 0:
            raise view.refuse(
                f"{view.part(part)}.addendum", "flanks meet below the tip circle (pointed teeth)",
                "lower it, or the profile shift",
            )  # fmt: skip
    room = bottom_clearance(gear, planet, radii.center_distance)
    if min(room) < 0:
        short = view.part(role if room[0] < room[1] else "planet")
        raise view.refuse(
            f"{short}.dedendum",
            f"a tip reaches {-1e3 * min(room):.2f} mm into the root of its mate "
            f"({view.part(role)})",
            "raise it, or lower the mate's addendum",
        )
    low, high = planet.path_of_contact(gear, angle)
    if high - low < planet.base_pitch:
        raise view.refuse(
            view.part(role),
            f"transverse contact ratio {(high - low) / planet.base_pitch:.3f} is below 1",
            "raise addenda or change profile shifts",
        )


def bottom_clearance(
    gear: ToothGeometry, planet: ToothGeometry, distance: float
) -> tuple[float, float]:
    """Room at the gear's root below the planet's tip, and at the planet's root; m."""
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
    """Normal play that thicknesses leave on the working circles, m; below 0 where teeth overlap."""
    gear, planet = gears[role], gears["planet"]
    cos_w = math.cos(radii.working_angles[role])
    r_g, r_p = gear.base_radius / cos_w, planet.base_radius / cos_w
    play = planet.pitch_angle * r_p - gear.thickness_at(r_g) - planet.thickness_at(r_p)
    return play * cos_w * math.cos(radii.base_helix_angle)


def _backlash(
    view: StageView,
    gears: Mapping[str, ToothGeometry],
    role: str,
    radii: StageRadii,
    allowance: float,
) -> float:
    """Normal play left by thicknesses at the working circles, plus the allowance, m; 0 where
    rounded profile shifts and centre distances alone make a little play, or an overlap as small."""
    rounding = ROUNDED * view.stage.normal_module
    backlash = allowance + inherent_backlash(gears, role, radii)
    if backlash < -rounding:
        raise view.refuse(
            view.part(role), f"teeth overlap by {-1e6 * backlash:.3g} µm at this distance",
            f"raise backlash_{role}_mm or change the centre distance",
        )  # fmt: skip
    return backlash if backlash > (0.0 if allowance else rounding) else 0.0
