"""Rating of the flanks and roots of all gears over load bins, by ISO 6336.

Load factors come from the equilibria of each bin (``solve.bin_loads``); those that the model does
not have from ISO 6336-1 method B; a key of ``[rating]`` overrules both. Each states its source.
Drive and coast flanks accumulate damage separately. Under a reversed torque the flank of a planet
that is in contact with the sun under rated torque is in contact with the ring, and vice versa.
Roots of gears that lasting load cases load in both senses have Y_M of ISO 6336-3, annex B, with
R = −1.2 times the lower over the higher of the largest loads of both senses, which holds from about
100 changes of sense on (of steels that are not case-hardened it is safe).
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.implausible_bearings import untilted
from flexgear.gears.load_bins import HOUR, LoadBin, case_in_bin
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.rating.capacity import FE_RIM, LOAD_FACTORS, OIL, Limit, missing_keys, rate
from flexgear.gears.rating.damage import Spectrum
from flexgear.gears.rating.load_factors import (
    SLOPE_SIGNS,
    dynamic_factor,
    method_b_inputs,
    misalignment,
    root_face_factor,
    tolerance,
    transverse_factors,
)
from flexgear.gears.rating.pair import GearPair, PairLoad, gear_pair, load_cycles, pair_load
from flexgear.gears.rating.sheet import Factor, Sheet, dated, factor, sheet_of, value_of
from flexgear.model.case import Case
from flexgear.model.names import GroupName
from flexgear.model.stage_view import StageView
from flexgear.results.load_sharing import ROUNDING
from flexgear.results.rating import GearMeshRating, Kind, RatedPart
from flexgear.solve.bin_loads import EQUAL_LOAD, BinLoads, GroupLoads, SpectrumTrain, is_excited
from flexgear.studies.rating_direct import LoadedState, direct_path

STATIC_CYCLES = 1.0  # load cycles of an extreme load, or of a load at rest
ENDURANCE_CYCLES = 1e10  # of a load without duration: the end of the curves of ISO 6336
LOAD_EXPONENT: dict[Limit, float] = {"flank": 0.5, "root": 1.0}  # of the load in the stress
METHOD_B = "ISO 6336-1 method B"
PARTING = 2.0  # K_v above which a force that varies about its mean would become negative
REMEDIES = {  # keys that give a factor where neither model nor standard does
    "K_Hβ": 'K_Hβ is not known: gear_mesh.model = "face_load", or rating.k_h_beta',
    "K_v": "K_v is not known: rating.k_v, or data of both gears for method B",
    "K_Hα": "K_Hα is not known: rating.k_h_alpha and k_f_alpha, or the same data",
}
NO_EXCITATION = 'teeth do not excite it: gear_mesh.model = "per_pair", or errors of the stage'
NO_TEETH = "base diameters or working angles stand in place of gears"
OTHER = {"sun": "ring", "ring": "sun", "drive": "coast"}  # the other flank of a tooth
KEYS = {  # of [rating] by symbol
    "K_A": "application_factor", "K_γ": "k_gamma", "K_v": "k_v", "K_Hβ": "k_h_beta",
    "K_Fβ": "k_f_beta", "K_Hα": "k_h_alpha", "K_Fα": "k_f_alpha",
}  # fmt: skip


class _Place(NamedTuple):
    """A flank or root of a gear. gear: "sun", "planet", "gear", …; face: flank of a planet by the
    gear in contact under rated torque, "sun" or "ring"; of other gears "drive" or "coast"."""

    stage: str
    side: str
    gear: str
    face: str
    kind: Limit

    @property
    def name(self) -> str:
        """ "stage_1.sun coast flank, left half"."""
        return self.alike + (f", {self.side} half" if self.side else "")

    @property
    def alike(self) -> str:
        """Common name of both halves: "stage_1.planet flank to the sun", "stage_1.sun coast
        flank"."""
        before = "coast " if self.face == "coast" else ""
        after = f" to the {self.face}" if self.face in ("sun", "ring") else ""
        return f"{self.stage}.{self.gear} {before}{self.kind}{after}"


History = dict[int, LoadedState]  # by number of the bin
Pairs = Mapping[tuple[str, str], GearPair]  # by stage and role


def pairs_of(case: Case) -> Pairs:
    """Gear meshes that can be rated; InputError for a steel without strengths in ISO 6336-5."""
    views = [case.view(stage.name) for stage in case.stages]
    every = [(view, stage_geometry(view)) for view in views]
    return {
        (view.name, role): gear_pair(view, geometry, role)
        for view, geometry in every
        for role in (() if geometry.overridden else geometry.gear_meshes)
    }


def rate_gears(
    pairs: Pairs,
    trains: Sequence[SpectrumTrain],
    flows: Sequence[PowerFlow],
    loads: Sequence[BinLoads],
) -> tuple[tuple[GearMeshRating, ...], tuple[RatedPart, ...], dict[str, str]]:
    """Load factors by group of gear meshes, ratings of flanks and roots, and reasons why groups are
    not assessed; trains: the train of the case, then those with other deviations."""
    case, bins = trains[0].case, trains[0].bins
    cases = [case_in_bin(case, load_bin) for load_bin in bins]
    groups: list[GearMeshRating] = []
    histories: dict[_Place, History] = defaultdict(dict)
    rated = {stage for stage, _ in pairs}
    missing = {stage.name: NO_TEETH for stage in case.stages if stage.name not in rated}
    for (stage, role), pair_of_one_sense in pairs.items():
        forces = [f.stage(stage).gear_mesh_forces[role] for f in flows]
        lasting = [f for f, load_bin in zip(forces, bins, strict=True) if load_bin.hours > 0.0]
        pair = _reversed(pair_of_one_sense, lasting)
        gear = case.view(stage).part(role)
        for group in (GroupName.of(stage, gear, side) for side in pair.stage.sides):
            computed = [load.groups.get(group) for load in loads]
            sheets: list[Sheet] = [{} for _ in bins]
            safety: dict[tuple[str, Kind], Array] = {}
            reasons: tuple[str, ...] = ()
            for b, (flow, of_bin) in enumerate(zip(flows, computed, strict=True)):
                if of_bin is None:
                    continue
                load, ruled = pair_load(pair, flow.stage(stage)), cases[b]
                factors, unknown = load_factors(ruled, pair, load, group, of_bin)
                if unknown:
                    reasons = reasons or (*unknown, *_also_missing(case, pair))
                    continue
                sheets[b] = dated(factors, case.rating.edition)
                states = _states(ruled, pair, load, group, bins[b], flow, factors, of_bin)
                for place, state in states.items():
                    histories[place][b] = state
                    of_part = safety.setdefault(
                        (state.part, place.kind), np.full(len(bins), math.nan)
                    )
                    of_part[b] = state.state.safety(state.at)
            planets = tuple(0 if x is None else x.planet for x in computed)
            largest = tuple(math.nan if x is None else x.largest_share for x in computed)
            groups.append(GearMeshRating(group, tuple(sheets), planets, largest, safety, reasons))
            missing |= {str(group): "; ".join(reasons)} if reasons else {}
            missing |= _uneven(group, bins, flows, loads)
            keys = [f'{k}.kinematics = "spatial"' for k in _untilted(cases, group) if any(sheets)]
            if keys:
                missing[f"{group}, tilting"] = f"it does not count in K_Hβ: {' and '.join(keys)}"
            if any(sheets) and _unexcited(cases, group):
                missing[f"{group}, K_v"] = NO_EXCITATION
    parts = []
    for place, history in histories.items():
        pair = pairs[place.stage, next(iter(history.values())).group.role]
        part = _part(case, place, history, bins, cases)
        direct, reason = direct_path(trains, pair, place.kind, history, loads)
        if direct is not None:
            part = replace(part, direct=direct.sheet(), of_teeth=direct.safety_of_teeth)
        elif reason:
            missing[f"{place.alike}, direct path"] = reason
        left_out = pair.gears[next(iter(history.values())).part].rim_left_out
        if left_out and place.kind == "root" and not part.direct and part.reserve >= 1.0:
            part = replace(part, estimates={**part.estimates, "Y_B of the thin FE rim": "as 1"})
            missing[f"{place.alike}, bending of the rim"] = FE_RIM
        parts.append(part)
    return tuple(groups), tuple(parts), missing


def _reversed(pair: GearPair, forces: Sequence[float]) -> GearPair:
    """The pair with the ``reversal`` of gears that are no idlers, by the largest gear-mesh forces
    of both senses; forces: N, signed, of load cases with a duration."""
    lower, higher = sorted((max(forces, default=0.0), max((-f for f in forces), default=0.0)))
    share = max(lower, 0.0) / higher if higher > 0.0 else 0.0
    gears = {part: replace(g, reversal=g.reversal or share) for part, g in pair.gears.items()}
    return replace(pair, gears=gears)


def _states(
    case: Case, pair: GearPair, load: PairLoad, group: GroupName, load_bin: LoadBin,
    flow: PowerFlow, factors: Sheet, computed: GroupLoads,
) -> dict[_Place, LoadedState]:  # fmt: skip
    """Flanks and roots that a group of gear meshes loads in a bin; case: with its rules."""
    view, states, pair = case.view(group.stage), {}, replace(pair, rules=case.rating)
    rates = load_cycles(view, flow.stage(group.stage))
    rated = rate(pair, load, {symbol: line.value for symbol, line in factors.items()})
    for (part, kind), state in rated.items():
        between = part == "planet" and view.stage.kind == "planetary"
        face = group.role if between else "drive"
        cycles = HOUR * load_bin.hours * rates[group.role, part]
        stands = load_bin.hours > 0.0 and cycles == 0.0
        at = STATIC_CYCLES if load_bin.extreme or stands else cycles or ENDURANCE_CYCLES
        face = face if computed.drive else OTHER[face]
        place = _Place(group.stage, group.side, view.part(part), face, kind)
        planet = 0 if computed.alike else computed.planet
        states[place] = LoadedState(state, factors, cycles, at, group, part, planet)
    return states


def _uneven(
    group: GroupName, bins: Sequence[LoadBin], flows: Sequence[PowerFlow], loads: Sequence[BinLoads]
) -> dict[str, str]:
    """Remark on a group of gear meshes with load cases in which its planets do not share its
    nominal load (``load_sharing.carry_together``); empty without such a case."""
    forces = [abs(f.stage(group.stage).gear_mesh_forces[group.role]) for f in flows]
    names = [
        load_bin.name
        for load_bin, load, force in zip(bins, loads, forces, strict=True)
        if group not in load.groups and force > ROUNDING * max(forces)
    ]
    if not names:
        return {}
    others_text = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return {f"{group}, {names[0]}{others_text}": "its planets do not carry the load together there"}


def _untilted(cases: Sequence[Case], group: GroupName) -> list[str]:
    """Keys by which gears of this gear mesh may tilt, although the computed K_Hβ leaves that out;
    empty where it leaves nothing out, or where every case states K_Hβ."""
    view = cases[0].view(group.stage)
    stated = [case.rating.forced(group.stage, group.role).k_h_beta for case in cases]
    computed = view.gear_mesh.model == "face_load" and None in stated
    return untilted(view, group.role) if computed else []


def _unexcited(cases: Sequence[Case], group: GroupName) -> bool:
    """Whether teeth do not excite the train from which K_v is computed, so that it is about 1.
    False where every load case states K_v."""
    case = cases[0]
    stated = [each.rating.forced(group.stage, group.role).k_v for each in cases]
    by_train = case.rating.dynamic_factor == "train" and case.rating.deviations == "stated"
    return by_train and None in stated and not is_excited(case)


def load_factors(
    case: Case, pair: GearPair, load: PairLoad, group: GroupName, computed: GroupLoads
) -> tuple[dict[str, Factor], tuple[str, ...]]:
    """K_A … K_Fα of a gear mesh, each with its source, and the reasons why some are unknown. case:
    with the rules of the load bin."""
    rules, lines = case.rating, dict[str, Factor]()
    forced = rules.forced(group.stage, group.role)
    of_planet = "computed" if computed.alike else f"computed, planet {computed.planet}"
    of_planet += f", gear-mesh cycle {computed.cycle + 1}"
    train = computed.deviated + (rules.deviations == "drawn")  # without a train of the case alone
    of_planet += f", deviations {train}" if train else ""

    def take(symbol: str, *sources: tuple[str, float], least: float = 0.0) -> None:
        """Set a factor from its key or else the first source with a finite value, if there is one,
        at least ``least``."""
        key = KEYS.get(symbol)
        stated = None if key is None else getattr(forced, key)
        if stated is not None:
            sources, least = ((f"key {key}", stated),), 0.0
        for source, value in sources:
            if math.isfinite(value):
                below = f": {value:.4g}, at least {least:g}" if value < least else ""
                lines[symbol] = factor(symbol, max(value, least), source + below)
                return

    def product(*symbols: str) -> float:
        return math.prod(lines[s].value for s in symbols if s in lines)

    take("K_A")
    take("K_γ", (of_planet, computed.k_gamma))
    k_v, resonance = dynamic_factor(pair, load, product("K_A", "K_γ"))
    tilt = ", without tilt" if _untilted([case], group) else ""
    along = (of_planet + tilt, computed.k_h_beta)
    take("K_Hβ", along, least=rules.least("face_load_factor"))
    by_b = f"{METHOD_B}, N = {resonance:.3g}"
    if k_v > PARTING:
        by_b += f"; above {PARTING:g} vibration would part the teeth, which it does not count"
    beside = f"; {METHOD_B}: {k_v:.4g}" if math.isfinite(k_v) else ""
    slope = misalignment(pair)
    if rules.deviations == "worst" and computed.deviated and slope is not None:
        sign = SLOPE_SIGNS[computed.deviated - 1][pair.role]
        lines["f_ma"] = factor("f_ma", 1e6 * sign * slope)
    of_train = (f"computed, motion of the train{beside}", computed.k_v)
    take("K_v", of_train, (by_b, k_v), least=rules.least("dynamic_factor"))
    of_flank = value_of(lines, "K_Hβ")
    take("K_Fβ", ("ISO 6336-1, from K_Hβ", root_face_factor(pair, of_flank)))
    norm = transverse_factors(pair, load, product("K_A", "K_γ"), product("K_v", "K_Hβ"))
    for symbol, by_norm in zip(("K_Hα", "K_Fα"), norm, strict=True):
        take(symbol, (of_planet, computed.k_h_alpha), (METHOD_B, by_norm), least=1.0)
    unknown = tuple(reason for symbol, reason in REMEDIES.items() if symbol not in lines)
    of_pairs = None in (forced.k_h_alpha, forced.k_f_alpha) and math.isnan(computed.k_h_alpha)
    if forced.k_v is None or of_pairs:  # by method B, or beside it
        lines |= sheet_of(method_b_inputs(pair, load, product("K_A", "K_γ")))
    return lines, unknown


def _part(
    case: Case, place: _Place, history: History, bins: Sequence[LoadBin], cases: Sequence[Case]
) -> RatedPart:
    """Rating of a flank or root over all bins; cases: with the rules of each bin."""
    load, cycles, safety, damage = (np.zeros(len(bins)) for _ in range(4))
    safety[:] = math.nan
    sheets: list[Sheet] = [{} for _ in bins]
    stage, planets = case.stage(place.stage), [0] * len(bins)
    of_planets = place.gear == "planet"
    for b, x in history.items():
        load[b], cycles[b], planets[b] = x.state.stress, x.cycles, x.planet
        sheets[b] = dated(x.state.sheet(x.at), case.rating.edition)
        safety[b] = x.state.safety(x.at)
    states = [x.state for x in history.values()]
    missing = _missing(case.view(place.stage), place.gear, [k for x in states for k in x.missing])
    lasting = [b for b in history if bins[b].hours > 0.0]
    curves = [curve for b in lasting if (curve := history[b].state.curve) is not None]
    life = whole = math.nan
    if missing or not lasting:
        damage[:] = math.nan
    else:
        spectrum = Spectrum.of(curves, load[lasting], cycles[lasting])
        damage[lasting], whole = spectrum.damages(), float(spectrum.safety)
        total = float(damage.sum())
        life = sum(b.hours for b in bins) / total if total else math.inf
    straight = any(_untilted([cases[b]], x.group) for b, x in history.items())
    estimates = {"K_Hβ without tilt": "as kinematics of its gears has none"} if straight else {}
    if any(_unexcited([cases[b]], x.group) for b, x in history.items()):
        estimates["K_v of the train"] = "which nothing in the model excites"
    part = RatedPart(
        name=place.name, alike=place.alike, stage=place.stage, kind=place.kind, side=place.side,
        count=stage.planets if of_planets else 1, planets=tuple(planets) if of_planets else (),
        load=load, cycles=cycles,
        safety=safety, damage=damage, life=life, whole_safety=whole,
        required=case.rating.least(f"{place.kind}_safety"), missing=missing, factors=tuple(sheets),
        exponent=LOAD_EXPONENT[place.kind], estimates=estimates,
    )  # fmt: skip
    worst = history.get(part.worst_bin)
    if worst is None:
        return part
    largest, symbol = max((value_of(worst.factors, s, 1.0), s) for s in LOAD_FACTORS[place.kind])
    above_one = largest > 1.0 + EQUAL_LOAD
    return replace(part, cause=f"{symbol} {largest:.3g}" if above_one else "")


def _also_missing(case: Case, pair: GearPair) -> list[str]:
    """Text on keys that are missing beside load factors: strengths, surfaces and accuracy of both
    gears; empty without any."""
    view, keys = case.view(pair.stage.name), list[str]()
    for gear in pair.gears.values():
        places: tuple[Limit, Limit] = ("flank", "root")
        of_gear = [key for place in places for key in missing_keys(pair, gear, place)]
        of_gear += ["accuracy_grade"] if tolerance(pair, gear, "pitch") is None else []
        keys += [key if "." in key or key == OIL else f"{gear.part}.{key}" for key in of_gear]
    return list(filter(None, [_missing(view, "", keys)]))


def _missing(view: StageView, gear: str, keys: Iterable[str]) -> str:
    """Names of keys of ``missing_keys`` as a case has them, by section; "" without any. gear: whose
    rating has a key without a gear's name."""
    sections: dict[str, list[str]] = {}
    for key in sorted(dict.fromkeys(keys), key=OIL.__eq__):
        mate, _, bare = key.rpartition(".")
        section = f"{view.key(view.part(mate) if mate else gear)}.rating" if key != OIL else OIL
        sections.setdefault(section, []).append(bare if key != OIL else "viscosity_40_mm2_per_s")
    names = [f"{section}.{', '.join(bare)}" for section, bare in sections.items()]
    several = len(names) > 1 or any(len(bare) > 1 for bare in sections.values())
    return f"{', '.join(names)} {'are' if several else 'is'} missing" if names else ""
