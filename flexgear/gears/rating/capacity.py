"""Load capacity of flanks and tooth roots by ISO 6336.

Flanks (pitting), ISO 6336-2 method B:

    σ_H0 = Z_H Z_E Z_ε Z_β √(F_t/(d_1 b) (u ± 1)/u)         minus: internal
    σ_H = Z_B σ_H0 √(K_A K_γ K_v K_Hβ K_Hα)                  wheel: Z_D
    σ_HG = σ_Hlim Z_NT Z_L Z_v Z_R Z_W Z_X,  σ_HP = σ_HG/S_Hmin,  S_H = σ_HG/σ_H

    Z_H = √(2 cos β_b cos α_wt/(cos² α_t sin α_wt)),  Z_E = √(E/(2π (1 − ν²)))
    Z_ε² of ``nominal_stress``,  Z_β = 1/√cos β
    M = √(ρ_C1 ρ_C2/(ρ_1 ρ_2)) at the inner point of single pair contact of the gear;
    Z_B, Z_D = M for spur gears, M − ε_β (M − √f_ZCa) for helical ones, √f_ZCa if ε_β ≥ 1; at
               least 1; f_ZCa = 1 (2006), or by profile modification (2019)

    C_ZL = 0.83 + 0.08 (σ_Hlim − 850)/350,  850 ≤ σ_Hlim ≤ 1200 N/mm², of the softer gear
    Z_L = C_ZL + 4 (1 − C_ZL)/(1.2 + 134/ν_40)²                            ν_40 mm²/s
    Z_v = C_Zv + 2 (1 − C_Zv)/√(0.8 + 32/v),  C_Zv = C_ZL + 0.02           v m/s
    Z_R = (3/R_z10)^{C_ZR},  R_z10 = (R_z1 + R_z2)/2 (10/ρ_red)^{1/3},  C_ZR = 0.32 − σ_Hlim/5000
    Z_W = (1.2 − (HB − 130)/1700) (3/R_zH)^0.15 for a through-hardened gear with a surface-hardened
          mate, 130 ≤ HB ≤ 470,  R_zH = R_z (10/ρ_red)^0.33 (R_z/R_z,soft)^0.66/(v ν_40/1500)^0.33,
          3 ≤ R_zH ≤ 16, R_z of the hard gear; 1 + A (u − 1) for a through-hardened wheel with a
          harder such pinion, A = 0.00898 HB_1/HB_2 − 0.00829 for 1.2 ≤ HB_1/HB_2 ≤ 1.7, u ≤ 20
    Z_X = 1

with roughness in µm, lengths in mm. Source: ISO 6336-2:2006, clauses 5 to 14, with Z_β of the
corrigendum of 2008, as in ISO/TR 6336-30:2017; f_ZCa by manuals of gear programs. A ring has M = 1.
For ε_α ≥ 2 the standard rates other points; the source of Z_B then states that it does not. Static
strength has Z_L = Z_v = Z_R = 1 and Z_W = 1.05 − (HB − 130)/6800, 1 between through-hardened gears.

Tooth roots (bending), ISO 6336-3 method B:

    σ_F0 = F_t/(b m_n) Y_F Y_S Y_β Y_B Y_DT        Y_F with f_ε (2019), see ``nominal_stress``
    σ_F = σ_F0 K_A K_γ K_v K_Fβ K_Fα
    σ_FG = σ_Flim Y_ST Y_NT Y_δrelT Y_RrelT Y_X Y_M,  σ_FP = σ_FG/S_Fmin,  S_F = σ_FG/σ_F

    Y_ST = 2
    Y_DT = 1; for grades up to 4 2.366 − 0.666 ε_αn if 2.05 < ε_αn ≤ 2.5, and 0.7 above
    Y_δrelT = (1 + √(ρ' χ*))/(1 + √(1.2 ρ')),  χ* = (1 + 2 q_s)/5,  ρ' mm of the steel
    Y_M = 1/(1 − R (1 − M)/(1 + M)),  R = −1.2 times the lower over the higher of two opposite loads

Static strength has Y_RrelT = Y_X = 1, Y_δrelT = 0.44 Y_S + 0.12 (case- and induction-hardened),
0.20 Y_S + 0.60 (nitrided) or (1 + 0.82 (Y_S − 1) t)/(1 + 0.82 t), t = (300/σ_0.2)^{1/4} (through-
hardened), and another M. Source: ISO 6336-3:2006, clauses 5 and 9 to 15, annex B for Y_M. If the
case gives σ_0.2, static load is also checked against yield of the fillet, σ_F = σ_0.2.

If data are missing, a ``LimitState`` has no curve, and ``missing`` names their keys.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from flexgear.gears.nominal_stress import contact_line_factor, flank_load_share, helix_factor
from flexgear.gears.radii import gears_by_role
from flexgear.gears.rating.damage import LifeCurve
from flexgear.gears.rating.pair import GearPair, PairLoad, RatedGear, rim_is_flexible
from flexgear.gears.rating.sheet import Factor, Sheet, factor, sheet_of
from flexgear.gears.rating.steels import (
    NITRIDED,
    SURFACE_HARDENED,
    THROUGH_HARDENED,
    Knees,
    flank_knees,
    mean_stress_ratio,
    root_knees,
    root_roughness_factor,
    root_size_factor,
    slip_layer,
    strength_keys,
)

HB_OVER_HV = 0.95  # ISO 18265, unalloyed and low-alloy steels
STRESS_CORRECTION = 2.0  # Y_ST of the test gears
TEST_NOTCH = 1.2  # χ*_T of q_s = 2.5
REVERSED_STRESS = 1.2  # −R of equal loads on both flanks
LEAST_MEAN_STRESS = 0.99  # Y_M above which R is not remarked
ENDLESS = 1e30  # cycles up to which bounded life factors are constant
SEVERAL_PAIRS = "of single contact, which ε_α ≥ 2 does not have: σ_H may be too low"
FE_RIM = 'FE body, whose bending counts in the direct path alone: root_stress = "fe"'
OIL = "lubricant"  # missing section, beside keys of gears
Limit = Literal["flank", "root"]
RATING_KEYS = {  # key of a gear's rating by symbol
    "σ_Hlim": "flank_strength", "σ_Flim": "root_strength", "Y_B": "rim_factor",
    "Y_M": "mean_stress_ratio",
}  # fmt: skip
LOAD_FACTORS: dict[Limit, tuple[str, ...]] = {
    "flank": ("K_A", "K_γ", "K_v", "K_Hβ", "K_Hα"),
    "root": ("K_A", "K_γ", "K_v", "K_Fβ", "K_Fα"),
}


@dataclass(frozen=True)
class LimitState:
    """Flank ("H") or root ("F") of one gear under one load.

    factors: lines that do not depend on cycles, without load factors; curve: σ_HG or σ_FG over
    cycles, Pa, None if data are missing; reference: σ_G with a life factor of 1, Pa; static: those
    factors that differ where static strength limits the curve, by symbol; missing: as of
    ``missing_keys``; yield_strength: σ_0.2 of a root, Pa, if the case gives it.
    """

    letter: str
    factors: Sheet
    curve: LifeCurve | None = None
    reference: float = math.nan
    static: Mapping[str, float] = field(default_factory=dict)
    missing: tuple[str, ...] = ()
    yield_strength: float | None = None

    @property
    def stress(self) -> float:
        """Stress σ_H or σ_F, Pa."""
        return 1e6 * self.factors[f"σ_{self.letter}"].value

    @property
    def least_safety(self) -> float:
        """Required safety S_Hmin or S_Fmin."""
        return self.factors[f"S_{self.letter}min"].value

    def safety(self, cycles: float) -> float:
        """Safety S_H or S_F under this load alone; ∞ without load, NaN if data are missing."""
        if self.curve is None:
            return math.nan
        return self.curve.stress_at(cycles) / self.stress if self.stress else math.inf

    def sheet(self, cycles: float) -> Sheet:
        """Lines of ``factors``, or of static stress where its strength governs, N_L, life factor,
        permissible stress and safety; of a root under static load also safety against yield."""
        if self.curve is None:
            return self.factors
        strength, letter = self.curve.stress_at(cycles), self.letter
        static = self.static if strength == self.curve.limit else {}
        lines, reference = dict(self.factors), self.reference
        for symbol, value in static.items():
            line = lines[symbol]
            lines[symbol] = replace(line, value=value, source=f"{line.source}, static stress")
            reference *= value / line.value
        values = {
            "N_L": cycles,
            "Z_NT" if letter == "H" else "Y_NT": strength / reference,
            f"σ_{letter}P": strength / self.least_safety / 1e6,
            f"S_{letter}": self.safety(cycles),
        }
        if self.yield_strength is not None and self.stress and cycles <= self.curve.cycles[0]:
            safety = self.yield_strength / self.stress
            values |= {"σ_0.2": self.yield_strength / 1e6, "S_0.2": safety}
        return {**lines, **sheet_of(values)}


def rate(
    pair: GearPair, load: PairLoad, load_factors: Mapping[str, float]
) -> dict[tuple[str, Limit], LimitState]:
    """Limit states of flank and root of both gears, by part; load_factors: K_A … K_Fα by symbol,
    1 if left out."""
    states: dict[tuple[str, Limit], LimitState] = {}
    for part, gear in pair.gears.items():
        product = {
            limit: math.prod(load_factors.get(symbol, 1.0) for symbol in symbols)
            for limit, symbols in LOAD_FACTORS.items()
        }
        states[part, "flank"] = _with_keys(_flank(pair, gear, load, product["flank"]), gear)
        states[part, "root"] = _with_keys(_root(pair, gear, load, product["root"]), gear)
    return states


def _with_keys(state: LimitState, gear: RatedGear) -> LimitState:
    """Limit state whose sources name the keys of values that the case gives."""
    lines = dict(state.factors)
    for symbol, key in RATING_KEYS.items():
        if symbol in lines and getattr(gear.data, key) is not None:
            lines[symbol] = replace(lines[symbol], source=f"key {key}")
    return replace(state, factors=lines)


def _load_lines(pair: GearPair, load: PairLoad) -> dict[str, Factor]:
    """First lines of flank and root: load and contact ratios."""
    ratios = pair.geometry.transverse_contact_ratio, pair.geometry.overlap_ratio
    symbols = ("F_t", "v", "ε_α", "ε_β")
    values = (load.tangential_force, load.velocity, *ratios)
    return sheet_of(dict(zip(symbols, values, strict=True)))


def _flank(pair: GearPair, gear: RatedGear, load: PairLoad, product: float) -> LimitState:
    """Limit state of a flank; product: of load factors."""
    rules, stage, steel = pair.rules, pair.stage, pair.material
    working = pair.geometry.working_angle
    zone = 2.0 * math.cos(pair.base_helix_angle) * math.cos(working) / math.sin(working)
    elastic = steel.young_modulus / (2.0 * math.pi * (1.0 - steel.poisson_ratio**2))
    pair_factors = {
        "Z_H": math.sqrt(zone) / math.cos(pair.transverse_angle),
        "Z_E": math.sqrt(elastic) / 1e3,
        "Z_ε": math.sqrt(flank_load_share(pair.geometry)),
        "Z_β": 1.0 / math.sqrt(math.cos(stage.helix_angle)),
    }
    u = pair.wheel.teeth / pair.pinion.teeth
    line = load.tangential_force / (pair.pinion.reference_diameter * stage.face_width)
    line *= (u - 1.0 if pair.internal else u + 1.0) / u
    nominal = math.prod(pair_factors.values()) * math.sqrt(line) / 1e3
    lines = _load_lines(pair, load)
    lines |= sheet_of({"ρ_red": 1e3 * pair.relative_curvature(), **pair_factors})
    if rules.edition != 2006 and stage.helix_angle:
        source = "assumed" if rules.profile_modification_factor is None else ""
        lines["f_ZCa"] = factor("f_ZCa", pair.profile_modification, source)
    single = pair.single_pair_factor(gear.part)
    symbol = "Z_B" if gear is pair.pinion else "Z_D"
    several = pair.geometry.transverse_contact_ratio >= 2.0
    lines[symbol] = factor(symbol, single, SEVERAL_PAIRS if several else "")
    lines |= sheet_of({"σ_H0": nominal, "σ_H": single * nominal * math.sqrt(product)})
    missing = missing_keys(pair, gear, "flank")
    if missing or gear.data.steel is None:
        return _state("H", pair, lines, missing=missing)
    strength = _flank_strength(pair, gear, load)
    static = {"Z_L": 1.0, "Z_v": 1.0, "Z_R": 1.0, "Z_W": _static_hardening(pair, gear)}
    knees = flank_knees(gear.data.steel, rules.flank_long_life_factor, rules.limited_pitting)
    return _state("H", pair, lines, strength, knees, static)


def missing_keys(pair: GearPair, gear: RatedGear, limit: Limit) -> tuple[str, ...]:
    """Missing keys without which a flank or root has no life curve: of the gear's section
    ``rating``, or "planet.flank_rz_um" of its mate, or "lubricant"."""
    data, keys = gear.data, strength_keys(gear.data, limit)
    through_hardened = data.steel in THROUGH_HARDENED
    if limit == "root":
        needed: dict[str, object] = {
            "rim_factor": gear.rim_factor,
            "root_rz_um": data.root_roughness,
            "yield_strength_mpa": data.yield_strength if through_hardened else 1.0,
        }
    else:
        mate = next(g for g in pair.gears.values() if g is not gear)
        keys += [f"{mate.part}.{key}" for key in strength_keys(mate.data, limit)]
        needed = {
            "vickers_hardness": data.vickers_hardness if through_hardened else 1.0,
            "flank_rz_um": data.flank_roughness,
            f"{mate.part}.flank_rz_um": mate.data.flank_roughness,
            OIL: pair.viscosity,
        }
    return tuple(dict.fromkeys([*keys, *(key for key, x in needed.items() if x is None)]))


def _flank_strength(pair: GearPair, gear: RatedGear, load: PairLoad) -> dict[str, float]:
    """σ_Hlim, MPa, and its factors."""
    assert pair.viscosity is not None and gear.flank_strength is not None
    strengths = [g.flank_strength for g in pair.gears.values() if g.flank_strength is not None]
    roughness = [g.data.flank_roughness or 0.0 for g in pair.gears.values()]
    softer = min(max(min(strengths) / 1e6, 850.0), 1200.0)
    c_zl = 0.83 + 0.08 * (softer - 850.0) / 350.0
    c_zv = c_zl + 0.02
    r_z10 = 1e6 * sum(roughness) / 2.0
    r_z10 *= (10.0 / (1e3 * pair.relative_curvature())) ** (1.0 / 3.0)
    film = 0.0 if load.velocity == 0.0 else 1.0 / math.sqrt(0.8 + 32.0 / load.velocity)
    return {
        "σ_Hlim": gear.flank_strength / 1e6,
        "Z_L": c_zl + 4.0 * (1.0 - c_zl) / (1.2 + 134.0 / (1e6 * pair.viscosity)) ** 2,
        "Z_v": c_zv + 2.0 * (1.0 - c_zv) * film,
        "Z_R": (3.0 / r_z10) ** (0.32 - softer / 5000.0),
        "Z_W": _work_hardening(pair, gear, load),
        "Z_X": 1.0,
    }


def _work_hardening(pair: GearPair, gear: RatedGear, load: PairLoad) -> float:
    """Work hardening factor Z_W."""
    mate = next(g for g in pair.gears.values() if g is not gear)
    if gear.data.steel not in THROUGH_HARDENED:
        return 1.0
    assert gear.data.vickers_hardness is not None
    brinell = HB_OVER_HV * gear.data.vickers_hardness
    if mate.data.steel in SURFACE_HARDENED:
        hard, soft = mate.data.flank_roughness, gear.data.flank_roughness
        assert hard is not None and soft is not None and pair.viscosity is not None
        r_zh = 1e6 * hard * (0.01 / pair.relative_curvature()) ** 0.33 * (hard / soft) ** 0.66
        film = (max(load.velocity, 1e-9) * 1e6 * pair.viscosity / 1500.0) ** 0.33
        r_zh = min(max(r_zh / film, 3.0), 16.0)
        hardness = min(max(brinell, 130.0), 470.0)
        return float((1.2 - (hardness - 130.0) / 1700.0) * (3.0 / r_zh) ** 0.15)
    pinion_hardness = mate.data.vickers_hardness
    if gear is not pair.wheel or mate.data.steel not in THROUGH_HARDENED or pinion_hardness is None:
        return 1.0
    ratio = HB_OVER_HV * pinion_hardness / brinell
    if ratio < 1.2:
        return 1.0
    teeth = min(pair.wheel.teeth / pair.pinion.teeth, 20.0)
    return 1.0 + (0.00898 * min(ratio, 1.7) - 0.00829) * (teeth - 1.0)


def _static_hardening(pair: GearPair, gear: RatedGear) -> float:
    """Work hardening factor Z_W of static strength."""
    hard = any(g.data.steel in SURFACE_HARDENED for g in pair.gears.values())
    hardness = gear.data.vickers_hardness
    if gear.data.steel not in THROUGH_HARDENED or not hard or hardness is None:
        return 1.0
    return 1.05 - (min(max(HB_OVER_HV * hardness, 130.0), 470.0) - 130.0) / 6800.0


def _root(pair: GearPair, gear: RatedGear, load: PairLoad, product: float) -> LimitState:
    """Limit state of a root; product: of load factors; Y_B is 1 if the rim is unknown."""
    rules, stage, geometry = pair.rules, pair.stage, pair.geometry
    share = contact_line_factor(geometry, pair.base_helix_angle, rules.edition)
    factors = {
        "Y_F": gear.root.form_factor * share,
        "Y_S": gear.root.notch_factor,
        "Y_β": helix_factor(geometry.overlap_ratio, stage.helix_angle, rules.edition),
        "Y_DT": pair.deep_tooth_factor,
    }
    if gear.rim_factor is not None:
        factors["Y_B"] = gear.rim_factor
    nominal = load.tangential_force / (1e6 * gear.face_width * stage.normal_module)
    nominal *= math.prod(factors.values())
    stresses = {"σ_F0": nominal, "σ_F": nominal * product}
    module = stage.normal_module
    form = {
        "b": 1e3 * gear.face_width,
        "ε_αn": geometry.transverse_contact_ratio / math.cos(pair.base_helix_angle) ** 2,
        "h_Fe/m_n": gear.root.lever / module,
        "s_Fn/m_n": gear.root.section.thickness / module,
        "ρ_F/m_n": gear.root.section.fillet_radius / module,
        "α_Fen": math.degrees(gear.root.load_angle),
    }
    lines = _load_lines(pair, load) | sheet_of(form | factors | stresses)
    if rim_is_flexible(gears_by_role(stage)[gear.part]):
        lines["Y_B"] = factor("Y_B", factors["Y_B"], FE_RIM)
    missing = missing_keys(pair, gear, "root")
    if missing or gear.data.steel is None:
        return _state("F", pair, lines, missing=missing)
    strength = _root_strength(pair, gear)
    static = {"Y_δrelT": _static_notch(gear), "Y_RrelT": 1.0, "Y_X": 1.0}
    static["Y_M"] = _mean_stress_factor(gear, static=True)
    knees = root_knees(gear.data.steel, rules.root_long_life_factor)
    state = _state("F", pair, lines, strength, knees, static)
    if not gear.idler and strength["Y_M"] < LEAST_MEAN_STRESS:
        ratio = sheet_of({"R": -REVERSED_STRESS * gear.reversal})
        state = replace(state, factors={**state.factors, **ratio})
    return replace(state, yield_strength=gear.data.yield_strength)


def _root_strength(pair: GearPair, gear: RatedGear) -> dict[str, float]:
    """σ_Flim, MPa, and its factors."""
    data, layer = gear.data, slip_layer(gear.data)
    assert data.steel is not None and data.root_roughness is not None
    assert gear.root_strength is not None
    q_s = gear.root.section.thickness / (2.0 * gear.root.section.fillet_radius)
    gradient = (1.0 + 2.0 * q_s) / 5.0
    return {
        "σ_Flim": gear.root_strength / 1e6,
        "Y_ST": STRESS_CORRECTION,
        "Y_δrelT": (1.0 + math.sqrt(layer * gradient)) / (1.0 + math.sqrt(TEST_NOTCH * layer)),
        "Y_RrelT": root_roughness_factor(data.steel, data.root_roughness),
        "Y_X": root_size_factor(data.steel, pair.stage.normal_module),
        "Y_M": _mean_stress_factor(gear),
    }


def _static_notch(gear: RatedGear) -> float:
    """Relative notch sensitivity factor Y_δrelT of static strength."""
    notch, yield_strength = gear.root.notch_factor, gear.data.yield_strength
    if gear.data.steel in THROUGH_HARDENED:
        assert yield_strength is not None
        t = 0.82 * (3e8 / yield_strength) ** 0.25
        return (1.0 + t * (notch - 1.0)) / (1.0 + t)
    return 0.20 * notch + 0.60 if gear.data.steel in NITRIDED else 0.44 * notch + 0.12


def _mean_stress_factor(gear: RatedGear, static: bool = False) -> float:
    """Mean stress factor Y_M, of endurance or static strength."""
    return 1.0 / (1.0 + REVERSED_STRESS * gear.reversal * mean_stress_influence(gear, static))


def mean_stress_influence(gear: RatedGear, static: bool = False) -> float:
    """(1 − M)/(1 + M) of a gear with a steel, with M of the case, or of endurance or static
    strength."""
    ratio = gear.data.mean_stress_ratio
    if ratio is None:
        assert gear.data.steel is not None
        ratio = mean_stress_ratio(gear.data.steel, gear.root.notch_factor, static)
    return (1.0 - ratio) / (1.0 + ratio)


def _state(
    letter: str, pair: GearPair, lines: dict[str, Factor], strength: Mapping[str, float] = {},
    knees: Knees = (), static: Mapping[str, float] = {}, missing: tuple[str, ...] = (),
) -> LimitState:  # fmt: skip
    """Limit state with its life curve. The curve is σ_lim times its factors ``strength`` times the
    life factor at ``knees``. The same with the factors ``static`` and the life factor of the first
    knee, but not below the second knee, is the strength at the first knee or ends the extended
    curve, by the rule ``static_factors``. No curve if keys are ``missing``."""
    rules = pair.rules
    safety = rules.least("flank_safety" if letter == "H" else "root_safety")
    required = {f"S_{letter}min": safety}
    if missing:
        return LimitState(letter, {**lines, **sheet_of(required)}, missing=missing)
    reference = math.prod(strength.values())
    if rules.bounded_life_factors:
        knees = (*knees, (ENDLESS, knees[-1][1]))
    stresses = [1e6 * reference * life for _, life in knees]
    limit = 1e6 * math.prod({**strength, **static}.values()) * knees[0][1]
    if rules.static_factors == "constant" or limit < stresses[1]:
        static = {}
    limit = max(limit, stresses[1])
    if rules.static_factors == "interpolated":
        stresses[0] = limit
    extended = limit if rules.static_factors == "extended" else None
    curve = LifeCurve(tuple(n for n, _ in knees), tuple(stresses), extended)
    lines = {**lines, **sheet_of({**strength, **required})}
    return LimitState(letter, lines, curve, 1e6 * reference, static)
