"""Load capacity of tooth roots (bending), ISO 6336-3 method B.

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

from flexgear.gears.nominal_stress import contact_line_factor, helix_factor
from flexgear.gears.rating.pair import GearPair, PairLoad, RatedGear
from flexgear.gears.rating.steels import NITRIDED, THROUGH_HARDENED, slip_layer

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
    return helix_factor(pair.geometry.overlap_ratio, pair.helix_angle, pair.rules.edition)


def nominal_root_stress(pair: GearPair, gear: RatedGear, load: PairLoad) -> float:
    """σ_F0, Pa; Y_B counts as 1 where the rim is not known."""
    factors = form_factor(pair, gear) * gear.root.notch_factor * root_helix_factor(pair)
    factors *= (gear.rim_factor or 1.0) * deep_tooth_factor(pair)
    return load.tangential_force / (pair.face_width * pair.normal_module) * factors


def notch(gear: RatedGear) -> float:
    """q_s = s_Fn/(2 ρ_F)."""
    return gear.root.section.thickness / (2.0 * gear.root.section.fillet_radius)


def notch_sensitivity_factor(gear: RatedGear) -> float | str:
    """Y_δrelT, or the key that is missing."""
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


def mean_stress_factor(gear: RatedGear, reversal: float) -> float | str:
    """Y_M, or the key that is missing; reversal: lower over higher load of the two flanks."""
    if reversal == 0.0:
        return 1.0
    influence = mean_stress_influence(gear)
    return influence if isinstance(influence, str) else 1.0 / (1.0 + SENSE * reversal * influence)


def mean_stress_influence(gear: RatedGear) -> float | str:
    """(1 − M)/(1 + M), or the key that is missing."""
    ratio = gear.data.mean_stress_ratio
    if ratio is None:
        if gear.data.steel != "case_hardened":
            return "mean_stress_ratio"
        ratio = max(0.8 - 0.15 * gear.root.notch_factor, 0.0)
    return (1.0 - ratio) / (1.0 + ratio)
