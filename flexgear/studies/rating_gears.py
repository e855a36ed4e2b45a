"""Flanks and roots of all gears of a case over its load bins, by ISO 6336.

Load factors come from the equilibria of each bin (``solve.bin_loads``); where the model does not
tell one, from ISO 6336-1 method B; a key of ``[rating]`` overrules both. Each says where it is
from. A flank is pressed, and a fillet stretched, by the gear mesh that carries on it: what of a sun
carries under rated torque and what under a reversed one wear apart, and a planet's flank that
presses the sun under rated torque presses the ring under a reversed one.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.load_bins import LoadBin
from flexgear.gears.power_flow import PowerFlow
from flexgear.gears.rating.damage import Spectrum
from flexgear.gears.rating.load_factors import (
    LoadFactors,
    dynamic_factor,
    root_face_factor,
    transverse_factors,
)
from flexgear.gears.rating.pair import GearPair, PairLoad, gear_pair, load_cycles, pair_load
from flexgear.gears.rating.rate import Factor, GearState, rate
from flexgear.model.case import Case
from flexgear.model.names import GroupName
from flexgear.model.rating import ForcedFactors
from flexgear.model.stage_view import StageView
from flexgear.results.load_sharing import ROUNDING
from flexgear.results.rating import GearMeshRating, Kind, RatedPart
from flexgear.solve.bin_loads import BinLoads, GroupLoads, SpectrumTrain
from flexgear.studies.rating_direct import DirectPath, LoadedState

STATIC = 1.0  # load cycles of an extreme load, or of one at rest
ENDLESS = 1e10  # of a load without duration: where the curves of ISO 6336 end
KINDS: tuple[Kind, Kind] = ("flank", "root")
GROWTH: dict[Kind, float] = {"flank": 0.5, "root": 1.0}  # exponent of the load in the stress
NO_FACE_FACTOR = 'K_Hβ is not known: gear_mesh.model = "face_load", or rating.k_h_beta'
OF_GEARS = "rating.accuracy_grade, steel, grade and hardness of both gears"
NO_DYNAMIC_FACTOR = f"K_v is not known: {OF_GEARS}, or rating.k_v"
NO_TRANSVERSE_FACTOR = f"K_Hα is not known: {OF_GEARS}, or rating.k_h_alpha and k_f_alpha"
METHOD_B = "ISO 6336-1 method B"
NO_TEETH = "base diameters or working angles stand in place of gears"


class _Place(NamedTuple):
    """A flank or a root. gear: "sun", "planet", "gear", …; face: of a planet "sun" or "ring", which
    presses it under rated torque, of other gears "drive" or "coast"."""

    stage: str
    side: str
    gear: str
    face: str
    kind: Kind

    @property
    def name(self) -> str:
        """ "stage_1.planet flank to the sun", "stage_1.sun coast flank"."""
        before = "coast " if self.face == "coast" else ""
        after = f" to the {self.face}" if self.face in ("sun", "ring") else ""
        half = f", {self.side} half" if self.side else ""
        return f"{self.stage}.{self.gear} {before}{self.kind}{after}{half}"


class _InBin(NamedTuple):
    """A gear mesh in one bin. factors: of the load; states: by part; missing: why there is none."""

    factors: tuple[Factor, ...] = ()
    states: Mapping[str, GearState] = {}
    missing: str = ""


History = dict[int, LoadedState]  # by number of the bin


Pairs = Mapping[tuple[str, str], GearPair]  # by stage and role


def pairs_of(case: Case) -> Pairs:
    """Gear meshes that can be rated; InputError for steels that the norm has no strength of."""
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
    """Load factors by group of gear meshes, flanks and roots, and why groups are not assessed;
    trains: the case's, and those of other deviations that loads are of."""
    case, bins = trains[0].case, trains[0].bins
    groups: list[GearMeshRating] = []
    histories: dict[_Place, History] = defaultdict(dict)
    rated = {stage for stage, _ in pairs}
    missing = {stage.name: NO_TEETH for stage in case.stages if stage.name not in rated}
    for (stage_name, role), pair in pairs.items():
        view = case.view(stage_name)
        for group in (GroupName.of(stage_name, role, side) for side in view.stage.sides):
            of_bins = [
                _in_bin(view, pair, flow, load.groups.get(group))
                for flow, load in zip(flows, loads, strict=True)
            ]
            _append(histories, view, group, bins, flows, loads, of_bins)
            groups.append(_gear_mesh(group, of_bins, loads))
            missing |= {str(group): x.missing for x in reversed(of_bins) if x.missing}
            missing |= _uneven(group, bins, flows, loads)
    parts = []
    for place, history in histories.items():
        kinds = {x.group.kind for x in history.values()}  # under reversed torque planets' two
        pair = pairs[place.stage, min(kinds)]
        direct = DirectPath(trains, pair, place.kind, history, loads)
        part = _part(case, place, history, bins)
        if len(kinds) == 1 and direct.applies:
            part = replace(part, direct=direct.lines(), of_teeth=direct.safety_of_teeth)
        parts.append(part)
    return tuple(groups), tuple(parts), missing


def _uneven(
    group: GroupName, bins: Sequence[LoadBin], flows: Sequence[PowerFlow], loads: Sequence[BinLoads]
) -> dict[str, str]:
    """Remark on a group of gear meshes with load cases in which its planets do not share its
    nominal load (``load_sharing.carry_together``); empty without such a case."""
    forces = [abs(f.stage(group.stage).gear_mesh_forces[group.kind]) for f in flows]
    names = [
        load_bin.name
        for load_bin, load, force in zip(bins, loads, forces, strict=True)
        if group not in load.groups and force > ROUNDING * max(forces)
    ]
    if not names:
        return {}
    beside = f" and {len(names) - 1} more" if len(names) > 1 else ""
    return {f"{group}, {names[0]}{beside}": "its planets do not carry the load together there"}


def _gear_mesh(
    group: GroupName, of_bins: Sequence[_InBin], loads: Sequence[BinLoads]
) -> GearMeshRating:
    at = [load.groups.get(group) for load in loads]
    planets = tuple(0 if g is None else g.planet for g in at)
    largest = tuple(math.nan if g is None else g.largest_share for g in at)
    return GearMeshRating(group, tuple(x.factors for x in of_bins), planets, largest)


def _append(
    histories: dict[_Place, History], view: StageView, group: GroupName, bins: Sequence[LoadBin],
    flows: Sequence[PowerFlow], loads: Sequence[BinLoads], of_bins: Sequence[_InBin],
) -> None:  # fmt: skip
    """Put the states of a group into the histories of the flanks and roots that they load."""
    other = {"sun": "ring", "ring": "sun", "drive": "coast"}
    for b, (load_bin, flow, of_bin) in enumerate(zip(bins, flows, of_bins, strict=True)):
        rates = load_cycles(view, flow.stage(view.name))
        for part, state in of_bin.states.items():
            between = part == "planet" and view.stage.kind == "planetary"
            face = group.kind if between else "drive"
            face = face if loads[b].groups[group].drive else other[face]
            cycles = 3600.0 * load_bin.hours * rates[group.kind, part]
            stands = load_bin.hours > 0.0 and cycles == 0.0
            at = STATIC if load_bin.extreme or stands else cycles or ENDLESS
            for kind in KINDS:
                place = _Place(view.name, group.side, view.part(part), face, kind)
                histories[place][b] = LoadedState(getattr(state, kind), cycles, at, group, part)


def _in_bin(
    view: StageView, pair: GearPair, flow: PowerFlow, group_loads: GroupLoads | None
) -> _InBin:
    """A gear mesh in one bin; without load there is nothing to rate."""
    if group_loads is None:
        return _InBin()
    load = pair_load(pair, flow.stage(view.name))
    factors = load_factors(view.case, pair, load, GroupName.of(view.name, pair.role), group_loads)
    if isinstance(factors, str):
        return _InBin(missing=factors)
    sources, values = factors
    return _InBin(tuple(sources), rate(pair, load, values))


def load_factors(
    case: Case, pair: GearPair, load: PairLoad, group: GroupName, computed: GroupLoads
) -> tuple[list[Factor], LoadFactors] | str:
    """K_A … K_Fα of a gear mesh, each with where it is from; why there are none as a text."""
    rules = case.rating
    of_planet = f"computed, planet {computed.planet}" if pair.stage.planets > 1 else "computed"
    of_planet += f", deviations {computed.deviated}" if computed.deviated else ""
    chosen = _Chosen(rules.forced(group.stage, group.kind))
    chosen.take("K_A", "application factor", ("key application_factor", rules.application_factor))
    chosen.take("K_γ", "load sharing of the planets", (of_planet, computed.k_gamma))
    along = _at_least(of_planet, computed.k_h_beta, rules.least("face_load_factor"))
    if not chosen.take("K_Hβ", "face load factor, flank", along):
        return NO_FACE_FACTOR
    by_rule = dynamic_factor(pair, load, chosen.product("K_A", "K_γ"))
    k_v = math.nan if by_rule is None else by_rule.value
    sources = (("computed, motion of the train", computed.k_v), (METHOD_B, k_v))
    dynamic = [_at_least(*source, rules.least("dynamic_factor")) for source in sources]
    if not chosen.take("K_v", "dynamic factor", *dynamic):
        return NO_DYNAMIC_FACTOR
    face_root = root_face_factor(pair, chosen.value("K_Hβ"))
    chosen.take("K_Fβ", "face load factor, root", ("ISO 6336-1, from K_Hβ", face_root))
    norm = transverse_factors(pair, load, chosen.product("K_A", "K_γ", "K_v", "K_Hβ"))
    across = _at_least(of_planet, computed.k_h_alpha, 1.0)
    for k, (symbol, part) in enumerate((("K_Hα", "flank"), ("K_Fα", "root"))):
        by_norm = (METHOD_B, math.nan if norm is None else norm[k])
        if not chosen.take(symbol, f"transverse load factor, {part}", across, by_norm):
            return NO_TRANSVERSE_FACTOR
    return chosen.factors, LoadFactors(
        application=chosen.value("K_A"),
        load_sharing=chosen.value("K_γ"),
        dynamic=chosen.value("K_v"),
        face_flank=chosen.value("K_Hβ"),
        face_root=chosen.value("K_Fβ"),
        transverse_flank=chosen.value("K_Hα"),
        transverse_root=chosen.value("K_Fα"),
    )


def _at_least(source: str, value: float, least: float) -> tuple[str, float]:
    """A value that may not be below a limit, and what it is from."""
    if value < least:
        return f"{source}: {value:.4g}, at least {least:g}", least
    return source, value


KEYS = {  # of [rating] by symbol
    "K_γ": "k_gamma", "K_v": "k_v", "K_Hβ": "k_h_beta", "K_Fβ": "k_f_beta", "K_Hα": "k_h_alpha",
    "K_Fα": "k_f_alpha",
}  # fmt: skip


class _Chosen:
    """Factors of a gear mesh as they are chosen: a key, else the first source that tells."""

    def __init__(self, forced: ForcedFactors) -> None:
        self._forced, self.factors = forced, list[Factor]()

    def take(self, symbol: str, meaning: str, *sources: tuple[str, float]) -> bool:
        """Choose among a key of the case and (source, value), NaN where it does not tell; whether
        one of them does."""
        key = KEYS.get(symbol, "")
        stated = getattr(self._forced, key) if key else None
        if stated is not None:
            sources = ((f"key {key}", stated),)
        for source, value in sources:
            if math.isfinite(value):
                self.factors.append(Factor(symbol, float(value), "", meaning, source))
                return True
        return False

    def value(self, symbol: str) -> float:
        """Of a factor that was chosen."""
        return next(f.value for f in self.factors if f.symbol == symbol)

    def product(self, *symbols: str) -> float:
        """Of factors that were chosen."""
        return math.prod(self.value(symbol) for symbol in symbols)


def _part(case: Case, place: _Place, history: History, bins: Sequence[LoadBin]) -> RatedPart:
    """A flank or root over all bins."""
    count = case.stage(place.stage).planets if place.gear == "planet" else 1
    shape = len(bins)
    load, cycles, safety, damage = (np.zeros(shape) for _ in range(4))
    safety[:] = math.nan
    factors: list[tuple[Factor, ...]] = [()] * shape
    lasting = [b for b in history if bins[b].hours > 0.0]
    for b, (state, count_of_bin, at, *_) in history.items():
        load[b], cycles[b] = state.stress, count_of_bin
        factors[b] = tuple(f for f in state.sheet(at) if not f.symbol.startswith("K_"))
        in_bin = state.safety(at)
        safety[b] = math.nan if in_bin is None else in_bin
    states = [x.state for x in history.values()]
    missing = _missing(case, place, next((x.missing for x in states if x.missing), ""))
    every = [history[b].state.curve for b in lasting]
    curves = [curve for curve in every if curve is not None]
    life = whole = math.nan
    if lasting and len(curves) == len(lasting):
        spectrum = Spectrum.of(curves, load[lasting], cycles[lasting])
        damage[lasting] = spectrum.damages
        life, whole = spectrum.life(sum(b.hours for b in bins)), spectrum.safety
    if missing or not lasting:
        damage[:] = math.nan
    return RatedPart(
        name=place.name, stage=place.stage, kind=place.kind, count=count, load=load, cycles=cycles,
        safety=safety, damage=damage, life=life, whole_safety=whole,
        required=states[0].least_safety, missing=missing, factors=tuple(factors),
        exponent=GROWTH[place.kind],
    )  # fmt: skip


def _missing(case: Case, place: _Place, key: str) -> str:
    """Why a flank or root is not assessed, by the key that is missing as a case writes it."""
    if not key:
        return ""
    if key == "lubricant":
        return "lubricant.viscosity_40_mm2_per_s is missing"
    return f"{case.view(place.stage).key(place.gear)}.rating.{key} is missing"
