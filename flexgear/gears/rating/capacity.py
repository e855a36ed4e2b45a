"""Load capacity of flanks and tooth roots: the factors of ISO 6336.

Load capacity of flanks (pitting), ISO 6336-2 method B.

    σ_H0 = Z_H Z_E Z_ε Z_β √(F_t/(d_1 b) (u ± 1)/u)         minus: internal
    σ_H = Z_B σ_H0 √(K_A K_γ K_v K_Hβ K_Hα)                  wheel: Z_D
    σ_HG = σ_Hlim Z_NT Z_L Z_v Z_R Z_W Z_X,  σ_HP = σ_HG/S_Hmin,  S_H = σ_HG/σ_H

    Z_H = √(2 cos β_b cos α_wt/(cos² α_t sin α_wt)),  Z_E = √(E/(2π (1 − ν²)))
    Z_ε² of ``nominal_stress``,  Z_β = √cos β (2006) or 1/√cos β (corrigendum of 2008, 2019)
    M = √(ρ_C1 ρ_C2/(ρ_1 ρ_2)) at the inner point of single contact of the gear;
    Z_B, Z_D = M of spur gears, M − ε_β (M − √f_ZCa) of helical ones, √f_ZCa where ε_β ≥ 1; at
               least 1; f_ZCa = 1 (2006) or for the profile modification (2019)

    C_ZL = 0.83 + 0.08 (σ_Hlim − 850)/350,  850 ≤ σ_Hlim ≤ 1200 N/mm², of the softer gear
    Z_L = C_ZL + 4 (1 − C_ZL)/(1.2 + 134/ν_40)²                            ν_40 mm²/s
    Z_v = C_Zv + 2 (1 − C_Zv)/√(0.8 + 32/v),  C_Zv = C_ZL + 0.02           v m/s
    Z_R = (3/R_z10)^{C_ZR},  R_z10 = (R_z1 + R_z2)/2 (10/ρ_red)^{1/3},  C_ZR = 0.32 − σ_Hlim/5000
    Z_W = (1.2 − (HB − 130)/1700) (3/R_zH)^0.15 of a through-hardened gear beside a surface-hardened
          one, 130 ≤ HB ≤ 470,  R_zH = R_z (10/ρ_red)^0.33 (R_z/R_z,soft)^0.66/(v ν_40/1500)^0.33,
          3 ≤ R_zH ≤ 16, R_z of the hard gear; 1 + A (u − 1) of a through-hardened wheel beside a
          harder such pinion, A = 0.00898 HB_1/HB_2 − 0.00829 for 1.2 ≤ HB_1/HB_2 ≤ 1.7, u ≤ 20
    Z_X = 1

Lengths in µm and mm there. Source: ISO 6336-2:2006, clauses 5 to 14; f_ZCa by manuals of gear
programs. A ring has M = 1. From ε_α = 2 on the standard rates other points than these.

Load capacity of tooth roots (bending), ISO 6336-3 method B.

    σ_F0 = F_t/(b m_n) Y_F Y_S Y_β Y_B Y_DT        Y_F with f_ε (2019), see ``nominal_stress``
    σ_F = σ_F0 K_A K_γ K_v K_Fβ K_Fα
    σ_FG = σ_Flim Y_ST Y_NT Y_δrelT Y_RrelT Y_X Y_M,  σ_FP = σ_FG/S_Fmin,  S_F = σ_FG/σ_F

    Y_ST = 2
    Y_DT = 1, 2.366 − 0.666 ε_αn for 2.05 < ε_αn ≤ 2.5 and 0.7 above, of grades up to 4
    Y_δrelT = (1 + √(ρ' χ*))/(1 + √(1.2 ρ')),  χ* = (1 + 2 q_s)/5,  ρ' mm of the steel
    Y_M = 1/(1 − R (1 − M)/(1 + M)),  R = −1.2 times the lower over the higher of two opposite loads

Static stress has Y_RrelT = Y_X = 1, Y_δrelT = 0.44 Y_S + 0.12 (case- and induction-hardened)
or 0.20 Y_S + 0.60 (nitrided). Source: ISO 6336-3:2006, clauses 5 and 9 to 15, annex B for Y_M.
"""

from __future__ import annotations

import math

from flexgear.gears.nominal_stress import contact_line_factor, flank_load_share, helix_factor
from flexgear.gears.rating.pair import GearPair, PairLoad, RatedGear
from flexgear.gears.rating.steels import NITRIDED, SURFACE_HARDENED, THROUGH_HARDENED, slip_layer

HB_OVER_HV = 0.95  # ISO 18265, unalloyed and low-alloy steels


def zone_factor(pair: GearPair) -> float:
    """Z_H."""
    working = pair.geometry.working_angle
    above = 2.0 * math.cos(pair.base_helix_angle) * math.cos(working)
    return math.sqrt(above / math.sin(working)) / math.cos(pair.transverse_angle)


def elasticity_factor(pair: GearPair) -> float:
    """Z_E, √Pa."""
    material = pair.material
    return math.sqrt(material.young_modulus / (2.0 * math.pi * (1.0 - material.poisson_ratio**2)))


def contact_ratio_factor(pair: GearPair) -> float:
    """Z_ε."""
    return math.sqrt(flank_load_share(pair.geometry))


def helix_angle_factor(pair: GearPair) -> float:
    """Z_β."""
    root = math.sqrt(math.cos(pair.stage.helix_angle))
    return root if pair.rules.edition == 2006 else 1.0 / root


def profile_modification_factor(pair: GearPair) -> float:
    """f_ZCa."""
    stated = pair.rules.profile_modification_factor
    return 1.0 if stated is None or pair.rules.edition == 2006 else stated


def single_pair_factor(pair: GearPair, part: str) -> float:
    """Z_B, or Z_D of the wheel."""
    gear_mesh, ratio = pair.geometry, 1.0
    overlap = min(gear_mesh.overlap_ratio, 1.0)
    if overlap < 1.0 and not pair.gears[part].tooth.internal:
        inner = gear_mesh.s_hi - gear_mesh.base_pitch
        if part != "planet":
            inner = gear_mesh.s_lo + gear_mesh.base_pitch
        flat = steep = 1.0
        for each in pair.gears:
            flat *= pair.curvature(each)
            steep *= pair.curvature(each, inner - pair.gears["planet"].roll_length)
        if steep <= 0.0:
            return math.inf
        ratio = math.sqrt(flat / steep)
    helical = math.sqrt(profile_modification_factor(pair))
    return max(1.0, ratio - overlap * (ratio - helical))


def nominal_pressure(pair: GearPair, load: PairLoad) -> float:
    """σ_H0, Pa."""
    u = pair.wheel.teeth / pair.pinion.teeth
    factors = zone_factor(pair) * elasticity_factor(pair)
    factors *= contact_ratio_factor(pair) * helix_angle_factor(pair)
    line = load.tangential_force / (pair.pinion.reference_diameter * pair.stage.face_width)
    return factors * math.sqrt(line * (u + (-1.0 if pair.internal else 1.0)) / u)


def _strength(pair: GearPair) -> float:
    """σ_Hlim of the softer gear, N/mm², 850 to 1200."""
    strengths = [
        g.flank_strength for g in pair.gears.values() if not isinstance(g.flank_strength, str)
    ]
    return min(max(min(strengths) / 1e6, 850.0), 1200.0)


def _film_coefficient(pair: GearPair) -> float:
    """C_ZL."""
    return 0.83 + 0.08 * (_strength(pair) - 850.0) / 350.0


def lubricant_factor(pair: GearPair, viscosity: float) -> float:
    """Z_L; ν_40 m²/s."""
    c = _film_coefficient(pair)
    return c + 4.0 * (1.0 - c) / (1.2 + 134.0 / (1e6 * viscosity)) ** 2


def velocity_factor(pair: GearPair, velocity: float) -> float:
    """Z_v; m/s."""
    c = _film_coefficient(pair) + 0.02
    if velocity == 0.0:
        return c
    return c + 2.0 * (1.0 - c) / math.sqrt(0.8 + 32.0 / velocity)


def roughness_factor(pair: GearPair, roughness: float) -> float:
    """Z_R; mean R_z of both flanks, m."""
    exponent = 0.32 - _strength(pair) / 5000.0
    relative = 1e6 * roughness * (10.0 / (1e3 * pair.relative_curvature)) ** (1.0 / 3.0)
    return (3.0 / relative) ** exponent


def work_hardening_factor(pair: GearPair, gear: RatedGear, load: PairLoad) -> float | str:
    """Z_W, or the key that is missing."""
    mate = next(g for g in pair.gears.values() if g is not gear)
    if gear.data.steel not in THROUGH_HARDENED:
        return 1.0
    if gear.data.vickers_hardness is None:
        return "vickers_hardness"
    brinell = HB_OVER_HV * gear.data.vickers_hardness
    if mate.data.steel in SURFACE_HARDENED:
        hard, soft = mate.data.flank_roughness, gear.data.flank_roughness
        assert hard is not None and soft is not None and pair.viscosity is not None
        rough = 1e6 * hard * (0.01 / pair.relative_curvature) ** 0.33 * (hard / soft) ** 0.66
        film = (max(load.velocity, 1e-9) * 1e6 * pair.viscosity / 1500.0) ** 0.33
        rough = min(max(rough / film, 3.0), 16.0)
        hardness = min(max(brinell, 130.0), 470.0)
        return float((1.2 - (hardness - 130.0) / 1700.0) * (3.0 / rough) ** 0.15)
    harder = mate.data.vickers_hardness
    if gear is not pair.wheel or mate.data.steel not in THROUGH_HARDENED or harder is None:
        return 1.0
    ratio = HB_OVER_HV * harder / brinell
    if ratio < 1.2:
        return 1.0
    teeth = min(pair.wheel.teeth / pair.pinion.teeth, 20.0)
    return 1.0 + (0.00898 * min(ratio, 1.7) - 0.00829) * (teeth - 1.0)


STRESS_CORRECTION = 2.0  # Y_ST of the test gears
TEST_NOTCH = 1.2  # χ*_T of q_s = 2.5
FINE = 4  # coarsest accuracy grade with Y_DT below 1
SENSE = 1.2  # of the stress under the other flank's load


def deep_tooth_factor(pair: GearPair) -> float:
    """Y_DT."""
    ratio = pair.geometry.transverse_contact_ratio / math.cos(pair.base_helix_angle) ** 2
    grades = [gear.data.accuracy_grade for gear in pair.gears.values()]
    if ratio <= 2.05 or any(grade is None or grade > FINE for grade in grades):
        return 1.0
    return 2.366 - 0.666 * ratio if ratio <= 2.5 else 0.7


def form_factor(pair: GearPair, gear: RatedGear) -> float:
    """Y_F of the edition."""
    share = contact_line_factor(pair.geometry, pair.base_helix_angle, pair.rules.edition)
    return gear.root.form_factor * share


def root_helix_factor(pair: GearPair) -> float:
    """Y_β of the edition."""
    return helix_factor(pair.geometry.overlap_ratio, pair.stage.helix_angle, pair.rules.edition)


def nominal_root_stress(pair: GearPair, gear: RatedGear, load: PairLoad) -> float:
    """σ_F0, Pa; Y_B counts as 1 where the rim is not known."""
    factors = form_factor(pair, gear) * gear.root.notch_factor * root_helix_factor(pair)
    factors *= (gear.rim_factor or 1.0) * deep_tooth_factor(pair)
    return load.tangential_force / (pair.stage.face_width * pair.stage.normal_module) * factors


def notch(gear: RatedGear) -> float:
    """q_s = s_Fn/(2 ρ_F)."""
    return gear.root.section.thickness / (2.0 * gear.root.section.fillet_radius)


def notch_sensitivity_factor(gear: RatedGear) -> float | str:
    """Relative notch sensitivity factor Y_δrelT, or the name of the key that the case lacks."""
    layer = slip_layer(gear.data)
    if isinstance(layer, str):
        return layer
    gradient = (1.0 + 2.0 * notch(gear)) / 5.0
    return (1.0 + math.sqrt(layer * gradient)) / (1.0 + math.sqrt(TEST_NOTCH * layer))


def static_notch_factor(gear: RatedGear, endurance: float) -> float:
    """Y_δrelT of static stress; that of endurance for steels without a rule here."""
    if gear.data.steel in THROUGH_HARDENED:
        return endurance
    y_s = gear.root.notch_factor
    return 0.20 * y_s + 0.60 if gear.data.steel in NITRIDED else 0.44 * y_s + 0.12


def mean_stress_factor(gear: RatedGear) -> float | str:
    """Y_M, or the key that is missing: equal loads in both senses on planets, one sense else."""
    if not gear.reversed:
        return 1.0
    influence = mean_stress_influence(gear)
    return influence if isinstance(influence, str) else 1.0 / (1.0 + SENSE * influence)


def mean_stress_influence(gear: RatedGear) -> float | str:
    """(1 − M)/(1 + M), or the key that is missing."""
    ratio = gear.data.mean_stress_ratio
    if ratio is None:
        if gear.data.steel != "case_hardened":
            return "mean_stress_ratio"
        ratio = max(0.8 - 0.15 * gear.root.notch_factor, 0.0)
    return (1.0 - ratio) / (1.0 + ratio)
