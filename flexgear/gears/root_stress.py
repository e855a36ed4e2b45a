"""Nominal tooth root stress after ISO 6336-3:2006, method B.

    σ_F0 = F_t/(b m_n) · Y_F Y_S Y_β,   F_t = F_n cos β_b cos α_t
    Y_F = 6 (h_Fe/m_n) cos α_Fen / ((s_Fn/m_n)² cos α_n)
    Y_S = (1.2 + 0.13 L) q_s^{1/(1.21 + 2.3/L)},   L = s_Fn/h_Fe,   q_s = s_Fn/(2 ρ_F)
    Y_β = 1 − min(ε_β, 1) · min(β, 30°)/120°

of the virtual spur gear in the normal section, z_n = z/(cos² β_b cos β), with the whole load at the
outer point of single contact. No load factor (K_A, K_v, K_Fβ, K_Fα), rim or deep tooth factor (Y_B,
Y_DT) is in it: a figure to compare gears and programs by, not the stress of the case's own load
distribution. The edition of 2019 further has f_ε in Y_F and 1/cos³ β in Y_β.

The critical section is where tangents at 30° to the tooth's middle line touch the fillet that a
rack with the tip radius root_fillet · m_n leaves (external gears, clause 6.2.2), or tangents at 60°
the fillet of the ring as ``tooth`` draws it: the standard makes a ring by a shaper cutter, which no
case gives. The formula of Y_S was found for 1 ≤ q_s < 8.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from flexgear.gears.geometry import GearMeshGeometry, StageGeometry, stage_geometry
from flexgear.gears.radii import gears_by_role
from flexgear.gears.tooth import (
    Rack,
    ToothGeometry,
    base_helix_angle,
    transverse_angle,
)

if TYPE_CHECKING:
    from flexgear.model.member import GearMember
    from flexgear.model.stage import Stage
    from flexgear.model.stage_view import StageView


@dataclass(frozen=True)
class CriticalSection:
    """Where a tooth breaks: thickness s_Fn, distance from the gear's centre along the middle line,
    radius of curvature ρ_F of the fillet there; m, in the normal section."""

    thickness: float
    distance: float
    fillet_radius: float


@dataclass(frozen=True)
class RootStress:
    """Nominal root stress of one gear in one gear mesh, Pa, and what it is made of.

    lever: h_Fe, m; load_angle: α_Fen, rad; form_factor, notch_factor, helix_factor: Y_F, Y_S, Y_β.
    """

    section: CriticalSection
    lever: float
    load_angle: float
    form_factor: float
    notch_factor: float
    helix_factor: float
    stress: float


def rack_section(teeth: float, gear: GearMember, rack: Rack) -> CriticalSection:
    """Section at 30° tangents of a spur gear of ``teeth`` z_n made by a rack without protuberance.

    E = π/4 m − h_fP tan α − (1 − sin α) ρ/cos α,  G = (ρ − h_fP)/m + x,  H = 2/z (π/2 − E/m) − π/3,
    θ = 2 G/z tan θ − H,  s_Fn/m = z sin(π/3 − θ) + √3 (G/cos θ − ρ/m),
    ρ_F/m = ρ/m + 2 G²/(cos θ (z cos² θ − 2 G)). ISO 6336-3:2006, equations 10 to 16.
    """
    module, alpha = rack.normal_module, rack.pressure_angle
    tip, g = gear.root_fillet, gear.root_fillet - gear.dedendum + gear.profile_shift
    e = math.pi / 4 - gear.dedendum * math.tan(alpha)
    e -= (1 - math.sin(alpha)) * tip / math.cos(alpha)
    h = 2 / teeth * (math.pi / 2 - e) - math.pi / 3
    theta = float(
        brentq(lambda a: a - 2 * g / teeth * math.tan(a) + h, -0.1, 1.5, xtol=1e-15, rtol=1e-14)
    )
    reach = g / math.cos(theta) - tip
    curvature = 2 * g**2 / (math.cos(theta) * (teeth * math.cos(theta) ** 2 - 2 * g))
    return CriticalSection(
        module * (teeth * math.sin(math.pi / 3 - theta) + math.sqrt(3) * reach),
        module * (teeth * math.cos(math.pi / 3 - theta) + reach) / 2,
        module * (tip + curvature),
    )


def drawn_section(tooth: ToothGeometry) -> CriticalSection:
    """Section where the arc of the tooth's fillet makes the angle ``ROOT_SECTION`` with its middle
    line, or where it begins if it is steeper there."""
    root = tooth.outline()
    return CriticalSection(root.root_thickness, float(root.x[-1]), tooth.fillet_radius)


def virtual_teeth(teeth: int, rack: Rack) -> float:
    """z_n = z/(cos² β_b cos β)."""
    return teeth / (math.cos(base_helix_angle(rack)) ** 2 * math.cos(rack.helix_angle))


def virtual_tooth(tooth: ToothGeometry, gear: GearMember, rack: Rack) -> ToothGeometry:
    """Tooth of the virtual spur gear: d_n = m_n z_n, d_an = d_n + d_a − d. Its number of teeth,
    not whole, stays that of the gear: pitches are π m_n, on the base circle π m_n cos α_n."""
    reference = rack.normal_module * virtual_teeth(tooth.teeth, rack) / 2
    shift = reference - tooth.reference_radius
    half = math.pi / 2 + 2 * gear.profile_shift * math.tan(rack.pressure_angle)
    return replace(
        tooth,
        reference_radius=reference,
        base_radius=reference * math.cos(rack.pressure_angle),
        tip_radius=tooth.tip_radius + shift,
        root_radius=tooth.root_radius + shift,
        thickness=rack.normal_module * half,
        transverse_angle=rack.pressure_angle,
    )


def outer_single_contact(tooth: ToothGeometry, base_pitch: float, contact_ratio: float) -> float:
    """Radius at which a tooth is loaded when its pair stands alone, ε_α − 1 base pitches from the
    tip along the path of contact, m; ISO 6336-3:2006, equation 23 (d_en/2)."""
    step = tooth.outward * base_pitch * (contact_ratio - 1.0)
    return math.hypot(tooth.base_radius, tooth.roll_length(tooth.tip_radius) - step)


def root_stress(
    tooth: ToothGeometry,
    gear: GearMember,
    stage: Stage,
    gear_mesh: GearMeshGeometry,
    force: float,
    *,
    drawn: bool = False,
) -> RootStress:
    """Of the gear ``tooth`` in a gear mesh of normal force ``force``, N along the 3D normal.

    drawn: with the fillet that ``tooth`` draws, an arc, in the place of the rack's.
    """
    module, beta_b = stage.normal_module, base_helix_angle(stage)
    virtual = virtual_tooth(tooth, gear, stage)
    if tooth.internal or drawn:
        section = drawn_section(virtual)
    else:
        section = rack_section(virtual_teeth(tooth.teeth, stage), gear, stage)
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
    tilt = min(math.degrees(stage.helix_angle), 30.0) / 120.0
    helix = 1.0 - min(gear_mesh.overlap_ratio, 1.0) * tilt
    tangential = abs(force) * math.cos(beta_b) * math.cos(transverse_angle(stage))
    stress = tangential / (stage.face_width * module) * form * notch_factor * helix
    return RootStress(section, lever, angle, form, notch_factor, helix, stress)


def stage_root_stress(
    view: StageView, g: StageGeometry, forces: Mapping[str, float]
) -> dict[tuple[str, str], RootStress]:
    """Root stress by gear mesh ("sun", "ring") and gear; forces: normal, N, by gear mesh.

    A gear mesh without force is left out, and so are all where base diameters or working angles are
    given, as teeth then are not those of the gears.
    """
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
    """Nominal root stress of each gear by its role, Pa: of a planet the larger of both its gear
    meshes."""
    found: dict[str, float] = {}
    for (_, part), one in stage_root_stress(view, stage_geometry(view), forces).items():
        found[part] = max(found.get(part, 0.0), one.stress)
    return found
