"""Results of a rating: load factors, and stress, safety, cycles and damage of parts in each bin.

A *part* is a flank or a root of a gear, or a bearing. Damage is Miner's sum over the bins with a
duration. The *reserve* of a part is the factor on all loads at which it reaches its limit; stress
of flanks is proportional to the square root of load, that of roots to load, and damage of bearings
to a power of load.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.gears.load_bins import LoadBin
from flexgear.gears.rating.sheet import Sheet, value_of
from flexgear.model.case import Case
from flexgear.model.names import GroupName
from flexgear.results.dataset_file import provenance
from flexgear.results.quantities import Quantity

NOT_COVERED = {  # failure modes that are not rated, with reasons
    "micropitting": "ISO/TS 6336-22 is not computed",
    "scuffing": "ISO/TS 6336-20 and -21 are not computed",
    "tooth flank fracture": "ISO/TS 6336-4 is not computed",
    "shafts": "their strength and that of keys, splines and fits is not computed",
    "lubrication": "supply, film and temperature are not computed",
    "wear": "it is not computed",
}
Kind = Literal["flank", "root", "bearing"]
LIMITS: dict[Kind, str] = {
    "flank": "Pitting",
    "root": "Tooth bending",
    "bearing": "Bearing life",
}
REQUIRED: dict[Kind, str] = {"flank": "S_Hmin", "root": "S_Fmin"}


@dataclass(frozen=True)
class GearMeshRating:
    """Load factors of a group of gear meshes, e.g. "stage_1 sun", by bin.

    factors: empty without load. planet: number of their planet, 0 without load. largest_k_gamma:
    largest K_γ of any planet at any time, NaN without load. safety: (B,) of flank and root of
    "planet" and "sun" or "ring" in each single bin, NaN if not assessed. missing: reasons why it is
    not assessed.
    """

    name: GroupName
    factors: tuple[Sheet, ...]
    planet: tuple[int, ...]
    largest_k_gamma: tuple[float, ...]
    safety: Mapping[tuple[str, Kind], Array]
    missing: tuple[str, ...]


@dataclass(frozen=True, repr=False)
class RatedPart:
    """A flank, root or bearing over the bins (B,).

    name: such as "stage_1.sun flank". alike: name of the set of equal parts, such as
    "stage_1.planet_bearings". count: number of equal parts with this rating. planets: number of the
    part's planet by bin, 0 if all are loaded equally, empty without planets. side: half, "left" or
    "right", if gears have two. load: stress, Pa, or equivalent load of a bearing, N, 0 without
    load. cycles: load cycles, or revolutions of a bearing. safety: in the single bin, static safety
    of a bearing, NaN if not assessed. damage: NaN if not assessed. life: time until the sum of
    damage is one, h, inf without damage. whole_safety: factor on stress (load of a bearing) at
    which the sum of damage of the spectrum is one. required: required safety of the spectrum, or
    life of a bearing, h, NaN if none is stated. missing: reason for a missing rating. estimates:
    rules of estimated data by key, for which there is no verdict. factors: by bin. cause: largest
    load factor in the worst bin, such as "K_Hβ 1.32". of_rows: damage (R,) of each row of a
    bearing, from −z to +z,
    empty if rows are not rated. exponent: of load in the stress, or in the damage of a bearing.
    rolling: "roller" or "ball" of a bearing. direct: figures of computed stresses, beyond the
    standard. of_teeth: safety (z,) by computed stresses of the teeth of a stationary ring, from 0
    to 2π.
    """

    name: str
    alike: str
    stage: str
    kind: Kind
    count: int
    load: Array
    cycles: Array
    safety: Array
    damage: Array
    life: float
    whole_safety: float
    required: float
    missing: str = ""
    estimates: Mapping[str, str] = field(default_factory=dict)
    factors: tuple[Sheet, ...] = ()
    exponent: float = 1.0
    rolling: str = ""
    planets: tuple[int, ...] = ()
    side: str = ""
    cause: str = ""
    of_rows: Array = field(default_factory=lambda: np.zeros(0))
    direct: Sheet = field(default_factory=dict)
    of_teeth: Array = field(default_factory=lambda: np.zeros(0))

    def __repr__(self) -> str:
        figures = f"safety {self.least_safety:.3g}, damage {self.damage_sum:.3g}"
        return f"<rating of {self.name}: {self.missing or f'{figures}, life {self.life:.3g} h'}>"

    @property
    def damage_sum(self) -> float:
        """Sum of damage over all bins with a duration."""
        return float(self.damage.sum())

    def required_in(self, b: int) -> float:
        """Required safety of a flank or root in a bin, which may be another one under extreme
        loads; 1 for the static safety of a bearing."""
        if self.kind == "bearing":
            return 1.0
        sheet = self.factors[b] if self.factors else {}
        return value_of(sheet, REQUIRED[self.kind], self.required)

    @cached_property
    def _nearest(self) -> tuple[float, float, int | None]:
        """Safety and required safety of the spectrum or of a bin, and that bin, where their ratio
        is least; NaN if none is assessed."""
        limit = 1.0 if self.kind == "bearing" else self.required
        every: list[tuple[float, float, int | None]] = [(self.whole_safety, limit, None)]
        every += [(s, self.required_in(b), b) for b, s in enumerate(self.safety.tolist())]
        assessed = [x for x in every if math.isfinite(x[0])]
        return min(assessed, key=lambda x: x[0] / x[1], default=(math.nan, limit, None))

    @property
    def least_safety(self) -> float:
        """Safety of the spectrum or under the extreme load that is nearest to its limit, NaN if
        none is assessed."""
        return self._nearest[0]

    @property
    def limit(self) -> float:
        """Required safety to which ``least_safety`` is compared; 1 of a bearing."""
        return self._nearest[1]

    @property
    def governing_bin(self) -> int | None:
        """The extreme load that is nearer to its limit than the spectrum, None if there is none."""
        return self._nearest[2]

    @property
    def worst_bin(self) -> int:
        """The bin with the largest damage, of several equal ones that with the largest load."""
        damage = np.nan_to_num(self.damage, posinf=math.inf)
        return max(range(len(damage)), key=lambda b: (damage[b], self.load[b]))

    @property
    def reserve(self) -> float:
        """Factor on all loads at which the part reaches its limit, NaN without a limit."""
        if self.kind == "bearing":
            of_life = (self.life / self.required) ** (1.0 / self.exponent)
            return min([of_life, *(s for s in self.safety.tolist() if math.isfinite(s))])
        return float((self.least_safety / self.limit) ** (1.0 / self.exponent))

    @property
    def is_below_directly(self) -> bool:
        """Whether the safety by computed stresses, beyond the standard, is below the required."""
        symbol = REQUIRED.get(self.kind, "")
        return value_of(self.direct, "S_direct") < value_of(self.direct, symbol, self.required)

    @property
    def holds(self) -> bool | None:
        """Whether the part is within its limits; None if that is unknown, or doubtful by computed
        stresses."""
        if self.missing or self.estimates or not self.reserve > 0.0:
            return None
        within = self.reserve >= 1.0
        return None if within and self.is_below_directly else within


@dataclass(frozen=True)
class Rating:
    """A case rated under its load bins.

    variant: description of flexible bodies. reliability: probability that no assessed part fails
    within ``hours``, None if no part has a life. not_assessed: reasons by part. positions: number
    of equilibria by stage. halving: largest relative change of the largest computed K_γ K_Hβ of a
    group of gear meshes with every second position or cycle, with names of group and bin. closure:
    largest relative imbalance of equilibria.
    """

    case: Case
    variant: str
    bins: tuple[LoadBin, ...]
    gear_meshes: tuple[GearMeshRating, ...]
    parts: tuple[RatedPart, ...]
    reliability: float | None
    not_assessed: Mapping[str, str]
    positions: Mapping[str, int]
    halving: tuple[float, str, str]
    closure: float

    @property
    def hours(self) -> float:
        """Total hours of all bins."""
        return float(sum(b.hours for b in self.bins))

    @property
    def ranked(self) -> tuple[RatedPart, ...]:
        """Assessed parts, the weakest first."""
        assessed = [p for p in self.parts if not p.missing]
        return tuple(sorted(assessed, key=lambda p: (_last(p.reserve), _last(p.life))))

    @property
    def equal(self) -> dict[str, list[RatedPart]]:
        """Sets of equal parts, such as bearings of planets or both halves of a gear, by name.

        The weakest sets, and the weakest parts of each, come first, parts without a rating last.
        """
        sets: dict[str, list[RatedPart]] = {}
        for part in (*self.ranked, *(p for p in self.parts if p.missing)):
            sets.setdefault(part.alike, []).append(part)
        return sets

    @property
    def weakest(self) -> dict[tuple[str, Kind], RatedPart]:
        """The weakest flank, root and bearing of each stage, the weakest of all first."""
        parts: dict[tuple[str, Kind], RatedPart] = {}
        for part in self.ranked:
            parts.setdefault((part.stage, part.kind), part)
        return parts

    def dataset(self) -> xr.Dataset:
        """Dataset with the variables of ``PARTS`` and ``BINS``."""
        parts = self.parts
        coords: dict[str, Any] = {
            "bin": [b.name for b in self.bins],
            "part": [p.name for p in parts],
            "port": [p.member for p in self.case.ports],
            "member": list(map(str, self.case.member_names())),
            "gear_mesh": [g.name for g in self.gear_meshes],
            "factor": _symbols(self),
            "ring_tooth": [k + 1 for _, k in _teeth(self)],
        }
        values = {n: np.array([d.of(p) for p in parts]).T for n, d in PARTS.items()}
        values |= {n: np.array(d.of(self)) for n, d in BINS.items()}
        variables = {}
        for name, declared in (PARTS | BINS).items():
            quantity = declared.quantity
            shape = [len(coords[dim]) for dim in quantity.dims]  # for arrays without entries
            variables[name] = (quantity.dims, values[name].reshape(shape), quantity.attrs)
        for label in ("stage", "kind", "alike", "missing"):
            coords[f"part_{label}"] = ("part", [getattr(p, label) for p in parts])
        coords["ring_tooth_part"] = ("ring_tooth", [part.name for part, _ in _teeth(self)])
        coords["extreme"] = ("bin", [b.extreme for b in self.bins])
        attrs = provenance(self.case, self.variant, closure_max=self.closure)
        return xr.Dataset(variables, coords, attrs)

    def __repr__(self) -> str:
        bins = f"{len(self.bins)} bin{'s' if len(self.bins) != 1 else ''}"
        return f"<flexgear rating of {self.case.name}: {bins}, {self.hours:g} h>"


def _last(value: float) -> float:
    return value if math.isfinite(value) else math.inf


class _Declared(NamedTuple):
    """A variable of the dataset. of: its values for a part or for the rating."""

    quantity: Quantity
    of: Callable[[Any], Any]


BEYOND = "by computed stresses, beyond ISO 6336"
NOT_RATED = "for a part that is not assessed, or not loaded in the bin"


def _by_bin(
    unit: str, meaning: str, of: Callable[[RatedPart], Any], missing: str = ""
) -> _Declared:
    return _Declared(Quantity(("bin", "part"), unit, meaning, missing), of)


def _whole(unit: str, meaning: str, of: Callable[[RatedPart], Any]) -> _Declared:
    return _Declared(Quantity(("part",), unit, meaning, f"{NOT_RATED}, or without a limit"), of)


def _direct(unit: str, symbol: str, meaning: str) -> _Declared:
    meaning = f"{meaning} of the worst place {BEYOND}"
    return _whole(unit, meaning, lambda p: value_of(p.direct, symbol))


def _load_of(bearing: bool) -> Callable[[RatedPart], Array]:
    return lambda p: p.load if (p.kind == "bearing") is bearing else np.full_like(p.load, math.nan)


PARTS = {
    "stress": _by_bin("Pa", "contact or root stress", _load_of(False), "of a bearing"),
    "equivalent_load": _by_bin(
        "N", "equivalent or radial load of a bearing", _load_of(True), "of a gear"
    ),
    "load_cycles": _by_bin("1", "load cycles, of a bearing revolutions", lambda p: p.cycles),
    "bin_safety": _by_bin(
        "1", "safety in the bin alone, of a bearing static", lambda p: p.safety, NOT_RATED
    ),
    "damage": _by_bin("1", "share of life that the bin consumes", lambda p: p.damage, NOT_RATED),
    "damage_sum": _whole("1", "Miner's sum over all bins", lambda p: p.damage_sum),
    "life": _whole("h", "time until the sum of damage is one", lambda p: p.life),
    "spectrum_safety": _whole(
        "1", "factor on stress (bearing: load) for a sum of one", lambda p: p.whole_safety
    ),
    "safety": _whole(
        "1", "of the spectrum or the extreme load nearest to its limit", lambda p: p.least_safety
    ),
    "required": _whole(
        "1",
        "least safety beside safety; of a bearing least life, h",
        lambda p: p.required if p.kind == "bearing" else p.limit,
    ),
    "load_reserve": _whole("1", "factor on all loads within the limits", lambda p: p.reserve),
    "direct_safety": _direct("1", "S_direct", "least safety"),
    "direct_damage_sum": _direct("1", "D_direct", "Miner's sum"),
    "direct_life": _direct("h", "L_direct", "life"),
}
BINS = {
    "hours": _Declared(
        Quantity(("bin",), "h", "duration of the bin; 0: extreme load"),
        lambda r: [b.hours for b in r.bins],
    ),
    "port_torque": _Declared(
        Quantity(("bin", "port"), "N m", "torque from outside"),
        lambda r: [[b.torque[p.member] for p in r.case.ports] for b in r.bins],
    ),
    "member_speed": _Declared(
        Quantity(("bin", "member"), "rad/s", "speed of a member"),
        lambda r: [[b.speed[m] for m in r.case.member_names()] for b in r.bins],
    ),
    "load_factor": _Declared(
        Quantity(("gear_mesh", "bin", "factor"), "1", "of ISO 6336", "where it is not known"),
        lambda r: [
            [[value_of(f, s) for s in _symbols(r)] for f in g.factors] for g in r.gear_meshes
        ],
    ),
    "largest_k_gamma": _Declared(
        Quantity(("gear_mesh", "bin"), "1", "K_γ of any planet at any time", "without load"),
        lambda r: [g.largest_k_gamma for g in r.gear_meshes],
    ),
    "rated_planet": _Declared(
        Quantity(("gear_mesh", "bin"), "1", "planet of the factors, from 1; 0: no load"),
        lambda r: [g.planet for g in r.gear_meshes],
    ),
    "direct_tooth_safety": _Declared(
        Quantity(("ring_tooth",), "1", f"least safety of a tooth of a stationary ring, {BEYOND}"),
        lambda r: [safety for p in r.parts for safety in p.of_teeth],
    ),
    "ring_tooth_azimuth": _Declared(
        Quantity(("ring_tooth",), "rad", "angle of the tooth about the axis of its ring"),
        lambda r: [2 * math.pi * k / p.of_teeth.size for p, k in _teeth(r)],
    ),
}


def _teeth(rating: Rating) -> list[tuple[RatedPart, int]]:
    """Part and index of each tooth of stationary rings with a safety."""
    return [(part, k) for part in rating.parts for k in range(part.of_teeth.size)]


def _symbols(rating: Rating) -> list[str]:
    """Symbols of the load factors of all gear meshes."""
    sheets = (sheet for g in rating.gear_meshes for sheet in g.factors)
    every = dict.fromkeys(symbol for sheet in sheets for symbol in sheet)
    return [symbol for symbol in every if symbol.startswith("K_")]
