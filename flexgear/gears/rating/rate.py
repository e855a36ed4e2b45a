"""Stresses, strengths and safeties of both gears of a gear mesh, with every factor.

A gear's flank or root in one state of load is a ``LimitState``: nominal stress, stress, and the
curve of what it bears. What is not known leaves ``curve`` None, and ``missing`` names the key.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from flexgear.gears.rating import capacity as iso
from flexgear.gears.rating.damage import LifeCurve
from flexgear.gears.rating.load_factors import LoadFactors
from flexgear.gears.rating.pair import GearPair, PairLoad, RatedGear
from flexgear.gears.rating.steels import (
    Knees,
    flank_knees,
    root_knees,
    root_roughness_factor,
    root_size_factor,
)
from flexgear.model.rating import Rating, SteelKind


@dataclass(frozen=True)
class Factor:
    """A line of a rating sheet; value in ``unit``."""

    symbol: str
    value: float
    unit: str
    meaning: str
    source: str


def factor_value(factors: Sequence[Factor], symbol: str, without: float = math.nan) -> float:
    """Of a line of a sheet; ``without`` where there is none."""
    return next((f.value for f in factors if f.symbol == symbol), without)


@dataclass(frozen=True)
class LimitState:
    """Flank or root of one gear under one load. letter: "H" or "F" of symbols; nominal: σ_H0 or
    σ_F0, Pa; stress: σ_H or σ_F, Pa; curve: σ_HG or σ_FG over cycles, None where ``missing`` names
    the key that it lacks, in the gear's section ``rating`` or "lubricant"; least_safety: S_Hmin or
    S_Fmin; factors: all that do not depend on cycles, in order; reference: σ_G with a life factor
    of 1, Pa."""

    letter: str
    nominal: float
    stress: float
    least_safety: float
    factors: tuple[Factor, ...]
    missing: str = ""
    curve: LifeCurve | None = None
    reference: float = math.nan

    def permissible(self, cycles: float) -> float | None:
        """σ_HP or σ_FP, Pa."""
        return None if self.curve is None else self.curve.stress_at(cycles) / self.least_safety

    def safety(self, cycles: float) -> float | None:
        """S_H or S_F under this load alone; ∞ without load."""
        if self.curve is None:
            return None
        return self.curve.stress_at(cycles) / self.stress if self.stress else math.inf

    def sheet(self, cycles: float) -> tuple[Factor, ...]:
        """``factors``, and N_L, Z_NT or Y_NT, permissible stress and safety."""
        permissible, safety = self.permissible(cycles), self.safety(cycles)
        if self.curve is None or permissible is None or safety is None:
            return self.factors
        letter, part = self.letter, "ISO 6336-2" if self.letter == "H" else "ISO 6336-3"
        life = self.curve.stress_at(cycles) / self.reference
        return (
            *self.factors,
            Factor("N_L", cycles, "", "load cycles", "ISO 6336-6"),
            Factor("Z_NT" if letter == "H" else "Y_NT", life, "", "life factor", part),
            Factor(f"σ_{letter}P", permissible / 1e6, "MPa", "permissible stress", part),
            Factor(f"S_{letter}", safety, "", "safety", part),
        )


@dataclass(frozen=True)
class GearState:
    """One gear in one gear mesh under one load."""

    part: str
    flank: LimitState
    root: LimitState


def rate(pair: GearPair, load: PairLoad, factors: LoadFactors) -> dict[str, GearState]:
    """Both gears by part."""
    return {
        part: GearState(part, _flank(pair, gear, load, factors), _root(pair, gear, load, factors))
        for part, gear in pair.gears.items()
    }


def _nominal(pair: GearPair, load: PairLoad, factors: LoadFactors) -> list[Factor]:
    source = "ISO 6336-1"
    return [
        Factor("F_t", load.tangential_force, "N", "force at the reference circle", source),
        Factor("v", load.velocity, "m/s", "speed of the pitch line", source),
        Factor("K_A", factors.application, "", "application factor", source),
        Factor("K_γ", factors.load_sharing, "", "mesh load factor", source),
        Factor("K_v", factors.dynamic, "", "dynamic factor", source),
    ]


def _flank(pair: GearPair, gear: RatedGear, load: PairLoad, factors: LoadFactors) -> LimitState:
    rules, source = pair.rules, "ISO 6336-2"
    nominal = iso.nominal_pressure(pair, load)
    single = iso.single_pair_factor(pair, gear.part)
    stress = single * nominal * math.sqrt(factors.flank)
    lines = [
        *_nominal(pair, load, factors),
        Factor("K_Hβ", factors.face_flank, "", "face load factor", "ISO 6336-1"),
        Factor("K_Hα", factors.transverse_flank, "", "transverse load factor", "ISO 6336-1"),
        Factor("Z_H", iso.zone_factor(pair), "", "zone factor", source),
        Factor("Z_E", iso.elasticity_factor(pair) / 1e3, "√(N/mm²)", "elasticity factor", source),
        Factor("Z_ε", iso.contact_ratio_factor(pair), "", "contact ratio factor", source),
        Factor("Z_β", iso.helix_angle_factor(pair), "", "helix angle factor", source),
    ]
    if rules.edition != 2006 and pair.stage.helix_angle:
        where = "assumed" if rules.profile_modification_factor is None else "[rating]"
        value = iso.profile_modification_factor(pair)
        lines.append(Factor("f_ZCa", value, "", "profile modification factor", where))
    name = "Z_B" if gear is pair.pinion else "Z_D"
    lines += [
        Factor(name, single, "", "single pair tooth contact factor", source),
        Factor("σ_H0", nominal / 1e6, "MPa", "nominal contact stress", source),
        Factor("σ_H", stress / 1e6, "MPa", "contact stress", source),
    ]
    strength = _flank_strength(pair, gear, load)
    if isinstance(strength, str):
        return LimitState("H", nominal, stress, rules.least("flank_safety"), tuple(lines), strength)
    knees = flank_knees(_steel(gear), rules.flank_long_life_factor, rules.limited_pitting)
    static = strength[0].value * strength[4].value * strength[5].value
    return _limit("H", nominal, stress, rules, (lines, strength), knees, static)


def _flank_strength(pair: GearPair, gear: RatedGear, load: PairLoad) -> list[Factor] | str:
    """σ_Hlim and its factors in this order, or the key that is missing."""
    source = "ISO 6336-2"
    if gear.data.steel is None:
        return "steel"
    if isinstance(gear.flank_strength, str):
        return gear.flank_strength
    if pair.viscosity is None:
        return "lubricant"
    rough = [g.data.flank_roughness for g in pair.gears.values()]
    peaks = [rz for rz in rough if rz is not None]
    if len(peaks) < len(rough):
        return "flank_rz"
    hardening = iso.work_hardening_factor(pair, gear, load)
    if isinstance(hardening, str):
        return hardening
    return [
        Factor("σ_Hlim", gear.flank_strength / 1e6, "MPa", "allowable stress number", "ISO 6336-5"),
        Factor("Z_L", iso.lubricant_factor(pair, pair.viscosity), "", "lubricant factor", source),
        Factor("Z_v", iso.velocity_factor(pair, load.velocity), "", "velocity factor", source),
        Factor("Z_R", iso.roughness_factor(pair, sum(peaks) / 2), "", "roughness factor", source),
        Factor("Z_W", hardening, "", "work hardening factor", source),
        Factor("Z_X", 1.0, "", "size factor", source),
    ]


def _root(pair: GearPair, gear: RatedGear, load: PairLoad, factors: LoadFactors) -> LimitState:
    rules, source = pair.rules, "ISO 6336-3"
    nominal = iso.nominal_root_stress(pair, gear, load)
    stress = nominal * factors.root
    lines = [
        *_nominal(pair, load, factors),
        Factor("K_Fβ", factors.face_root, "", "face load factor", "ISO 6336-1"),
        Factor("K_Fα", factors.transverse_root, "", "transverse load factor", "ISO 6336-1"),
        Factor("Y_F", iso.form_factor(pair, gear), "", "form factor", source),
        Factor("Y_S", gear.root.notch_factor, "", "stress correction factor", source),
        Factor("Y_β", iso.root_helix_factor(pair), "", "helix angle factor", source),
        Factor("Y_DT", iso.deep_tooth_factor(pair), "", "deep tooth factor", source),
    ]
    if gear.rim_factor is not None:
        lines.append(Factor("Y_B", gear.rim_factor, "", "rim thickness factor", source))
    lines += [
        Factor("σ_F0", nominal / 1e6, "MPa", "nominal root stress", source),
        Factor("σ_F", stress / 1e6, "MPa", "root stress", source),
    ]
    strength = _root_strength(pair, gear)
    if isinstance(strength, str):
        return LimitState("F", nominal, stress, rules.least("root_safety"), tuple(lines), strength)
    limit, correction, sensitivity, _, _, mean = (line.value for line in strength)
    static = limit * correction * iso.static_notch_factor(gear, sensitivity) * mean
    knees = root_knees(_steel(gear), rules.root_long_life_factor)
    return _limit("F", nominal, stress, rules, (lines, strength), knees, static)


def _root_strength(pair: GearPair, gear: RatedGear) -> list[Factor] | str:
    """σ_Flim and its factors in this order, or the key that is missing."""
    source, steel = "ISO 6336-3", gear.data.steel
    if steel is None:
        return "steel"
    if isinstance(gear.root_strength, str):
        return gear.root_strength
    if gear.rim_factor is None:
        return "rim_factor"
    if gear.data.root_roughness is None:
        return "root_rz"
    sensitivity = iso.notch_sensitivity_factor(gear)
    mean = iso.mean_stress_factor(gear)
    for value in (sensitivity, mean):
        if isinstance(value, str):
            return value
    rough = root_roughness_factor(steel, gear.data.root_roughness)
    size = root_size_factor(steel, pair.stage.normal_module)
    return [
        Factor("σ_Flim", gear.root_strength / 1e6, "MPa", "allowable stress number", "ISO 6336-5"),
        Factor("Y_ST", iso.STRESS_CORRECTION, "", "stress correction of test gears", source),
        Factor("Y_δrelT", float(sensitivity), "", "relative notch sensitivity factor", source),
        Factor("Y_RrelT", rough, "", "relative surface factor", source),
        Factor("Y_X", size, "", "size factor", source),
        Factor("Y_M", float(mean), "", "mean stress factor", source),
    ]


def _steel(gear: RatedGear) -> SteelKind:
    assert gear.data.steel is not None  # a gear without has no strength
    return gear.data.steel


def _limit(
    letter: str, nominal: float, stress: float, rules: Rating,
    lines: tuple[list[Factor], list[Factor]], knees: Knees, static: float,
) -> LimitState:  # fmt: skip
    """With the curve of what it bears: σ_lim times all factors of ``lines[1]`` times the life
    factor, ``static`` (MPa) times it at the first knee, but not below what follows."""
    least = rules.least("flank_safety" if letter == "H" else "root_safety")
    reference = math.prod(line.value for line in lines[1])
    first = reference if rules.static_factors == "constant" else static
    stresses = [1e6 * reference * factor for _, factor in knees]
    stresses[0] = max(1e6 * first * knees[0][1], stresses[1])
    curve = LifeCurve(tuple(n for n, _ in knees), tuple(stresses))
    last = Factor(f"S_{letter}min", least, "", "least safety", "[rating]")
    return LimitState(
        letter, nominal, stress, least, (*lines[0], *lines[1], last), "", curve, 1e6 * reference
    )
