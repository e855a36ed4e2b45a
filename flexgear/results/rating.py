"""What a rating leaves: load factors, and stress, safety, cycles and damage of parts in every bin.

A *part* is a flank or a root of a gear, or a bearing. Damage is Miner's sum over the bins that have
a duration; the *reserve* of a part is the factor on all loads that it would bear within its limits,
stresses of flanks growing with their root, those of roots with the load itself, damage of bearings
with its power.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
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

NEVER = {  # what no rating here says anything of
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


@dataclass(frozen=True)
class GearMeshRating:
    """Load factors of a group of gear meshes, e.g. "stage_1 sun", by bin. factors: none without
    load; planet: from 1, that they are of (0: none); largest_k_gamma: that the model gives any
    planet at any time, NaN without load; safety: (B,) in each bin alone of flank and root of both
    gears, "planet" and "sun" or "ring", NaN where there is none."""

    name: GroupName
    factors: tuple[Sheet, ...]
    planet: tuple[int, ...]
    largest_k_gamma: tuple[float, ...]
    safety: Mapping[tuple[str, Kind], Array]


@dataclass(frozen=True)
class RatedPart:
    """A flank, root or bearing over the bins (B,).

    name: "stage_1.sun flank"; alike: name of all that are equal to it,
    "stage_1.planet_bearings"; count: so many equal ones are rated by it; planets: by bin the
    planet from 1 that it is of, 0 where all are loaded alike, of no length where it is of none;
    side: "left" or "right" half that it is of, if gears have two; load: stress Pa, of a bearing
    its equivalent load N, 0 where it is not loaded; cycles: of load, of a bearing revolutions;
    safety: in the bin alone, of a bearing static, NaN where there is none; damage: NaN where it
    is not assessed; life: h, until the sum of damage is one, inf without damage; whole_safety:
    factor on the stress (of a bearing on the load) at which the spectrum just lasts as long as
    the bins say; required: least safety, of a bearing life in h, NaN where none is stated;
    missing: why there is no figure; estimates: rules by the keys that they estimate, so that
    there is no verdict; factors: by bin; cause: largest load factor in the worst bin, "K_Hβ
    1.32"; of_rows: damage (R,) of each row of a bearing, from −z to +z, of no length where rows
    are not rated; exponent: of the load with which stress, of a bearing damage grows; rolling:
    "roller" or "ball" of a bearing; direct: figures of computed stresses at places of the
    teeth, beyond the norm, where they are known; of_teeth: safety (z,) by them of the teeth of
    a ring that stands, from 0 to 2π.
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

    @property
    def damage_sum(self) -> float:
        """Damage over all bins with a duration."""
        return float(self.damage.sum())

    @property
    def least_safety(self) -> float:
        """Least safety over the spectrum and every extreme load; NaN where nothing is assessed."""
        every = [s for s in (self.whole_safety, *self.safety) if math.isfinite(s)]
        return min(every, default=math.nan)

    @property
    def governing_bin(self) -> int | None:
        """The extreme load whose safety is below that of the spectrum; None: the spectrum governs,
        or nothing is assessed."""
        single = [b for b, s in enumerate(self.safety) if s == self.least_safety]
        return single[0] if single and self.least_safety != self.whole_safety else None

    @property
    def worst_bin(self) -> int:
        """The bin that damages most, of several that do alike the one that loads most."""
        damage = np.nan_to_num(self.damage, posinf=math.inf)
        return max(range(len(damage)), key=lambda b: (damage[b], self.load[b]))

    @property
    def reserve(self) -> float:
        """Factor on all loads within the limits; NaN where there is nothing to hold it to."""
        if self.kind == "bearing":
            lasting = (self.life / self.required) ** (1.0 / self.exponent)
            return min([lasting, *(s for s in self.safety.tolist() if math.isfinite(s))])
        return float((self.least_safety / self.required) ** (1.0 / self.exponent))

    @property
    def holds(self) -> bool | None:
        """Whether it is within its limits; None where that cannot be said."""
        if self.missing or self.estimates or not self.reserve > 0.0:
            return None
        return self.reserve >= 1.0


@dataclass(frozen=True)
class Rating:
    """A case rated under its load bins.

    variant: what bends; hours: of all bins together; reliability: that the whole gearbox lasts so
    long, None where parts have no life; not_assessed: what, and why; positions: of equilibria, by
    stage; closure: largest imbalance of them.
    """

    case: Case
    variant: str
    bins: tuple[LoadBin, ...]
    gear_meshes: tuple[GearMeshRating, ...]
    parts: tuple[RatedPart, ...]
    reliability: float | None
    not_assessed: Mapping[str, str]
    positions: Mapping[str, int]
    closure: float

    @property
    def hours(self) -> float:
        """Hours of all bins together."""
        return float(sum(b.hours for b in self.bins))

    @property
    def ranked(self) -> tuple[RatedPart, ...]:
        """Parts with figures, the weakest first."""
        assessed = [p for p in self.parts if not p.missing]
        return tuple(sorted(assessed, key=lambda p: (_last(p.reserve), _last(p.life))))

    @property
    def equal(self) -> dict[str, list[RatedPart]]:
        """Parts by the name of all that are equal, as planets' bearings and both halves of a gear
        are; the weakest first, there and in each, those without figures last."""
        sets: dict[str, list[RatedPart]] = {}
        for part in (*self.ranked, *(p for p in self.parts if p.missing)):
            sets.setdefault(part.alike, []).append(part)
        return sets

    @property
    def weakest(self) -> dict[tuple[str, Kind], RatedPart]:
        """The weakest flank, root and bearing of every stage, the weakest of all first."""
        parts: dict[tuple[str, Kind], RatedPart] = {}
        for part in self.ranked:
            parts.setdefault((part.stage, part.kind), part)
        return parts

    def dataset(self) -> xr.Dataset:
        """Labelled figures of all bins."""
        return rating_dataset(self)

    def __repr__(self) -> str:
        return f"<flexgear rating of {self.case.name}: {len(self.bins)} bins, {self.hours:g} h>"


def _last(value: float) -> float:
    return value if math.isfinite(value) else math.inf


class _Declared(NamedTuple):
    """A figure. of: its values, of a part (of the rating), by bin where it has that axis."""

    quantity: Quantity
    of: Callable[[Any], Any]


BEYOND = "by computed stresses, beyond ISO 6336"
NOT_RATED = "of a part that is not assessed, or not loaded in that bin"


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
    "damage": _by_bin("1", "share of the life that it takes", lambda p: p.damage, NOT_RATED),
    "damage_sum": _whole("1", "Miner's sum over all bins", lambda p: p.damage_sum),
    "life": _whole("h", "time until the sum of damage is one; infinite: never", lambda p: p.life),
    "spectrum_safety": _whole(
        "1", "factor on stress (bearing: load) for a sum of one", lambda p: p.whole_safety
    ),
    "safety": _whole("1", "least of the spectrum and of extreme loads", lambda p: p.least_safety),
    "required": _whole("1", "least safety; of a bearing least life, h", lambda p: p.required),
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
        Quantity(("gear_mesh", "bin"), "1", "planet, from 1, that factors are of; 0: no load"),
        lambda r: [g.planet for g in r.gear_meshes],
    ),
    "direct_tooth_safety": _Declared(
        Quantity(("ring_tooth",), "1", f"least safety of a tooth of a ring that stands, {BEYOND}"),
        lambda r: [safety for p in r.parts for safety in p.of_teeth],
    ),
    "ring_tooth_azimuth": _Declared(
        Quantity(("ring_tooth",), "rad", "place of that tooth about the axis of its ring"),
        lambda r: [2 * math.pi * k / p.of_teeth.size for p, k in _teeth(r)],
    ),
}


def _teeth(rating: Rating) -> list[tuple[RatedPart, int]]:
    """Teeth of rings that stand, of which safeties are known, from 0 in each part."""
    return [(part, k) for part in rating.parts for k in range(part.of_teeth.size)]


def _symbols(rating: Rating) -> list[str]:
    """Load factors of all gear meshes, without what they follow from."""
    sheets = (sheet for g in rating.gear_meshes for sheet in g.factors)
    every = dict.fromkeys(symbol for sheet in sheets for symbol in sheet)
    return [symbol for symbol in every if symbol.startswith("K_")]


def rating_dataset(rating: Rating) -> xr.Dataset:
    """Labelled figures of a rating by the names of ``PARTS`` and ``BINS``."""
    parts = rating.parts
    coords: dict[str, Any] = {
        "bin": [b.name for b in rating.bins],
        "part": [p.name for p in parts],
        "port": [p.member for p in rating.case.ports],
        "member": list(map(str, rating.case.member_names())),
        "gear_mesh": [g.name for g in rating.gear_meshes],
        "factor": _symbols(rating),
        "ring_tooth": [k + 1 for _, k in _teeth(rating)],
    }
    values = {n: np.array([d.of(p) for p in parts]).T for n, d in PARTS.items()}
    values |= {n: np.array(d.of(rating)) for n, d in BINS.items()}
    variables = {}
    for name, declared in (PARTS | BINS).items():
        quantity = declared.quantity
        shape = [len(coords[dim]) for dim in quantity.dims]  # also where there is nothing
        variables[name] = (quantity.dims, values[name].reshape(shape), quantity.attrs)
    for label in ("stage", "kind", "alike", "missing"):
        coords[f"part_{label}"] = ("part", [getattr(p, label) for p in parts])
    coords["ring_tooth_part"] = ("ring_tooth", [part.name for part, _ in _teeth(rating)])
    coords["extreme"] = ("bin", [b.extreme for b in rating.bins])
    case = rating.case
    attrs = provenance(
        case=case.name, variant=rating.variant, content_hash=case.content_hash(),
        parameters=case.to_dict(), closure_max=rating.closure,
    )  # fmt: skip
    return xr.Dataset(variables, coords, attrs)
