"""Nominal stresses of teeth without load factors: pressure at the pitch point, root stress.

Contact pressure of a gear mesh at its pitch point:

    p = 2 w/(π a) of Hertz (``hertz``),   w = Z_ε² F cos β_b / b,
    Z_ε² = (4 − ε_α)/3 (1 − ε_β) + ε_β/ε_α,   1/ε_α where ε_β ≥ 1

with the normal force F of one gear mesh, its face width b and the radius of relative curvature
ρ_n = ρ_t/cos β_b at the pitch point: σ_H0 of ISO 6336-2:2019 without Z_β.

Tooth root stress after ISO 6336-3:2006, method B:

    σ_F0 = F_t/(b m_n) · Y_F Y_S Y_β,   F_t = F_n cos β_b cos α_t
    Y_F = 6 (h_Fe/m_n) cos α_Fen / ((s_Fn/m_n)² cos α_n)
    Y_S = (1.2 + 0.13 L) q_s^{1/(1.21 + 2.3/L)},   L = s_Fn/h_Fe,   q_s = s_Fn/(2 ρ_F)
    Y_β = 1 − min(ε_β, 1) · min(β, 30°)/120°

of the virtual spur gear in the normal section, z_n = z/(cos² β_b cos β), with the whole load at the
outer point of single contact. It includes no load factor (K_A, K_v, K_Fβ, K_Fα), rim or deep tooth
factor (Y_B, Y_DT): it compares gears and programs, and is not the stress under the load
distribution of a case. The edition of 2019 also has f_ε in Y_F (``contact_line_factor``) and
1/cos³ β in Y_β (``helix_factor``):

    f_ε = √(1/ε_αn) where ε_β ≥ 1; 1 for spur gears (0.7 where ε_αn ≥ 2); in between
    √(1 − ε_β + ε_β/ε_αn), or √((1 − ε_β)/2 + ε_β/ε_αn) where ε_αn ≥ 2;  ε_αn = ε_α/cos² β_b

The critical section is where tangents at 30° to the tooth's middle line (60° for a ring) touch the
root (``tool``), which is cut with the generating profile shift x_E of ``as_cut``; for a rack these
are equations 10 to 16 of the standard. For a cutter the edition of 2006 has a substitute rack
(``substitute_rack_section``), that of 2019 the cutter itself. The formula of Y_S holds for
1 ≤ q_s < 8.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from flexgear.gears.geometry import GearMeshGeometry, StageGeometry, stage_geometry
from flexgear.gears.hertz import ContactBody, line_contact, relative_radius
from flexgear.gears.radii import gears_by_role
from flexgear.gears.root import CriticalSection
from flexgear.gears.tool import CutterTool, plain_tool
from flexgear.gears.tooth import (
    PlainRack,
    Rack,
    ToothGeometry,
    base_helix_angle,
    reference_radius,
    tooth_geometry,
    transverse_angle,
)
from flexgear.model.member import GearMember
from flexgear.model.stage import Stage
from flexgear.model.stage_view import StageView

_ITERATIONS = 30  # of θ; each reduces the error about twentyfold


def flank_load_share(gear_mesh: GearMeshGeometry) -> float:
    """Squared contact ratio factor Z_ε² of ISO 6336-2."""
    ratio, overlap = gear_mesh.transverse_contact_ratio, min(gear_mesh.overlap_ratio, 1.0)
    return max((4.0 - ratio) / 3.0 * (1.0 - overlap), 0.0) + overlap / ratio


def pitch_point_pressure(view: StageView, g: StageGeometry, role: str, force: float) -> float:
    """Nominal contact pressure at the pitch point, Pa. role: "sun" or "ring"; force: normal, of one
    gear mesh of one half, N."""
    gear_mesh, gear, material = g.gear_meshes[role], g.gears[role], view.material
    curvature = [
        tooth.base_radius * math.tan(gear_mesh.working_angle) for tooth in (g.planet, gear)
    ]
    cos_base = math.cos(g.base_helix_angle)
    radius = relative_radius(*curvature, internal=gear.internal) / cos_base
    share = flank_load_share(gear_mesh)
    depth = gear.reference_radius  # has no effect on the pressure
    body = ContactBody(material.young_modulus, material.poisson_ratio, depth)
    line_load = abs(force) * cos_base / view.stage.face_width * share
    return float(line_contact(body, body, radius).pressure(line_load))


@dataclass(frozen=True)
class RootStress:
    """Nominal root stress of one gear in one gear mesh, Pa, and its factors. lever: h_Fe, m;
    load_angle: α_Fen, rad; form_factor: Y_F; notch_factor: Y_S; helix_factor: Y_β."""

    section: CriticalSection
    lever: float
    load_angle: float
    form_factor: float
    notch_factor: float
    helix_factor: float
    stress: float


def as_cut(gear: GearMember, rack: Rack) -> GearMember:
    """A gear with its generating profile shift x_E = x + A_sn/(2 m_n tan α_n) and its tip circle;
    A_sn: ``rating.thickness_deviation``."""
    shift = gear.rating.thickness_deviation
    shift /= 2 * rack.normal_module * math.tan(rack.pressure_angle)
    changes = {"profile_shift": gear.profile_shift + shift, "addendum": gear.addendum - shift}
    return gear.model_copy(update=changes)


def virtual_teeth(teeth: int, rack: Rack) -> float:
    """Number of teeth of the virtual spur gear, z_n = z/(cos² β_b cos β)."""
    return teeth / (math.cos(base_helix_angle(rack)) ** 2 * math.cos(rack.helix_angle))


def virtual_tooth(tooth: ToothGeometry, gear: GearMember, rack: Rack) -> ToothGeometry:
    """Tooth of the virtual spur gear, cut by the same tool in normal section. d_n = m_n z_n, d_an =
    d_n + d_a − d, likewise for a cutter; ``teeth`` of the result is rounded."""
    per_tooth = virtual_teeth(1, rack)
    tool = plain_tool(gear.tool)
    if isinstance(tooth.tool, CutterTool):
        teeth = per_tooth * tooth.tool.teeth
        longer = rack.normal_module * teeth - 2 * reference_radius(tooth.tool.teeth, rack)
        diameter = None if tool.tip_diameter is None else tool.tip_diameter + longer
        tool = replace(tool, teeth=teeth, tip_diameter=diameter)
    blank = gear.model_copy(update={"teeth": per_tooth * gear.teeth, "tool": tool})
    normal = PlainRack(rack.normal_module, rack.pressure_angle)
    return tooth_geometry(blank, normal, internal=tooth.internal)


def outer_single_contact(tooth: ToothGeometry, base_pitch: float, contact_ratio: float) -> float:
    """Radius d_en/2 of the outer point of single pair contact, m: ε_α − 1 base pitches from the tip
    along the path of contact. ISO 6336-3:2006, equation 23."""
    step = tooth.outward * base_pitch * (contact_ratio - 1.0)
    return math.hypot(tooth.base_radius, tooth.roll_length(tooth.tip_radius) - step)


def helix_factor(overlap_ratio: float, helix_angle: float, edition: int = 2006) -> float:
    """Helix factor Y_β of ISO 6336-3, with 1/cos³ β in the edition of 2019; helix_angle in rad."""
    tilt = min(math.degrees(helix_angle), 30.0) / 120.0
    factor = 1.0 - min(overlap_ratio, 1.0) * tilt
    return factor / math.cos(helix_angle) ** 3 if edition == 2019 else factor


def contact_line_factor(gear_mesh: GearMeshGeometry, beta_b: float, edition: int) -> float:
    """Factor f_ε of ISO 6336-3:2019, 1 in the edition of 2006; beta_b: base helix angle, rad."""
    if edition != 2019:
        return 1.0
    ratio = gear_mesh.transverse_contact_ratio / math.cos(beta_b) ** 2
    overlap = min(gear_mesh.overlap_ratio, 1.0)
    if overlap == 0.0:
        return 0.7 if ratio >= 2.0 else 1.0
    return math.sqrt((1.0 - overlap) / (2.0 if ratio >= 2.0 else 1.0) + overlap / ratio)


def substitute_rack_section(
    tooth: ToothGeometry, gear: GearMember, stage: Stage
) -> CriticalSection:
    """Critical section of a ring by the substitute rack of ISO 6336-3:2006, corrected 2007-04-01,
    m; checked against printed roots of another program in ``validation/reboucas2020``.

    With z_n < 0 and lengths in modules:

        ρ_fPv = ρ_fP + (x_0 + h_fP − ρ_fP)^1.95/(3.156 · 1.036^{z_0})
        E = π/4 − h_fP tan α_n + s_pr/cos α_n − (1 − sin α_n) ρ_fPv/cos α_n
        G = ρ_fPv − h_fP + x,  H = 2/z_n (π/2 − E) − π/6,  θ = 2G/z_n tan θ − H
        s_Fn = z_n sin(π/6 − θ) + q,  q = G/cos θ − ρ_fPv
        ρ_F = ρ_fPv + 2G²/(cos θ (|z_n| cos² θ − 2G))

    and the distance −(z_n cos(π/6 − θ) + √3 q)/2 from the axis. h_fP: dedendum, or that of the root
    circle where the cutter's tip diameter is given. Equations 10 to 16, 19, 21 there.
    """
    m, alpha, tool = stage.normal_module, stage.pressure_angle, gear.tool
    assert isinstance(tooth.tool, CutterTool)
    cutter_teeth, shift, tip = tooth.tool.teeth, gear.profile_shift, gear.root_fillet
    depth = gear.dedendum
    if tool.tip_diameter is not None:
        depth = shift + (tooth.root_radius - tooth.reference_radius) / m
    teeth, lean = -virtual_teeth(gear.teeth, stage), math.pi / 6.0
    over = max(tool.profile_shift + depth - tip, 0.0)
    virtual_tip = tip + over**1.95 / (3.156 * 1.036**cutter_teeth)
    free = (tool.protuberance - tool.grinding_allowance) / m
    half = math.pi / 4.0 - depth * math.tan(alpha)
    half += (free - (1.0 - math.sin(alpha)) * virtual_tip) / math.cos(alpha)
    g, h, theta = virtual_tip - depth + shift, 2.0 / teeth * (math.pi / 2.0 - half) - lean, lean
    for _ in range(_ITERATIONS):
        theta = 2.0 * g / teeth * math.tan(theta) - h
    q, cos = g / math.cos(theta) - virtual_tip, math.cos(theta)
    thickness = teeth * math.sin(lean - theta) + q
    distance = -0.5 * (teeth * math.cos(lean - theta) + math.sqrt(3.0) * q)
    radius = virtual_tip + 2.0 * g**2 / (cos * (abs(teeth) * cos**2 - 2.0 * g))
    return CriticalSection(m * thickness, m * distance, m * radius)


def root_stress(
    tooth: ToothGeometry,
    gear: GearMember,
    stage: Stage,
    gear_mesh: GearMeshGeometry,
    force: float,
    edition: int = 2019,
) -> RootStress:
    """Nominal root stress of a gear in one gear mesh. force: along the 3D normal, N; edition: of
    ISO 6336-3, where 2006 has a substitute rack for a ring's cutter."""
    module, beta_b = stage.normal_module, base_helix_angle(stage)
    if gear.rating.thickness_deviation:
        gear = as_cut(gear, stage)
        tooth = tooth_geometry(gear, stage, internal=tooth.internal)
    virtual = virtual_tooth(tooth, gear, stage)
    section = virtual.root.section
    if edition == 2006 and tooth.internal:
        section = substitute_rack_section(tooth, gear, stage)
    pitch = math.pi * module * math.cos(stage.pressure_angle)
    ratio = gear_mesh.transverse_contact_ratio / math.cos(beta_b) ** 2
    radius = outer_single_contact(virtual, pitch, ratio)
    angle = float(virtual.load_angle(np.asarray(radius)))
    # every normal of the flank touches the base circle
    lever = tooth.outward * (virtual.base_radius / math.cos(angle) - section.distance)
    slimness, notch = section.thickness / lever, section.thickness / (2 * section.fillet_radius)
    form = 6 * lever * module * math.cos(angle) / section.thickness**2
    form /= math.cos(stage.pressure_angle)
    notch_factor = (1.2 + 0.13 * slimness) * notch ** (1 / (1.21 + 2.3 / slimness))
    helix = helix_factor(gear_mesh.overlap_ratio, stage.helix_angle)
    tangential = abs(force) * math.cos(beta_b) * math.cos(transverse_angle(stage))
    stress = tangential / (stage.face_width * module) * form * notch_factor * helix
    return RootStress(section, lever, angle, form, notch_factor, helix, stress)


def stage_root_stress(
    view: StageView, g: StageGeometry, forces: Mapping[str, float]
) -> dict[tuple[str, str], RootStress]:
    """Nominal root stress by gear mesh ("sun", "ring") and gear; forces: normal, N, by gear mesh.
    Gear meshes without force are left out. Empty where the case gives base diameters or working
    angles, which do not belong to true teeth."""
    if g.overridden:
        return {}
    gears = gears_by_role(view.stage)
    return {
        (role, part): root_stress(g.gears[part], gears[part], view.stage, gear_mesh, forces[role])
        for role, gear_mesh in g.gear_meshes.items()
        if forces[role]
        for part in ("planet", role)
    }


def largest_root_stress(view: StageView, forces: Mapping[str, float]) -> dict[str, float]:
    """Largest nominal root stress by role of the gear, Pa; a planet has two gear meshes."""
    largest: dict[str, float] = {}
    for (_, part), stress in stage_root_stress(view, stage_geometry(view), forces).items():
        largest[part] = max(largest.get(part, 0.0), stress.stress)
    return largest
