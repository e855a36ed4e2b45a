"""What a rating leaves: load factors, and stress, safety, cycles and damage of parts in every bin.

A *part* is a flank or a root of a gear, or a bearing. Damage is Miner's sum over the bins that have
a duration; the *reserve* of a part is the factor on all loads that it would bear within its limits,
stresses of flanks growing with their root, those of roots with the load itself, damage of bearings
with its power.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.arrays import Array
from flexgear.gears.load_bins import LoadBin
from flexgear.gears.rating.rate import Factor
from flexgear.model.case import Case
from flexgear.results.dataset_file import provenance
from flexgear.results.quantities import Quantity, number
from flexgear.results.version import version

SCHEMA = 1  # of the summary
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
    planet at any time, NaN without load."""

    name: str
    factors: tuple[tuple[Factor, ...], ...]
    planet: tuple[int, ...]
    largest_k_gamma: tuple[float, ...]


@dataclass(frozen=True)
class RatedPart:
    """A flank, root or bearing over the bins (B,).

    name: "stage_1.sun flank"; count: so many equal ones there are; load: stress Pa, of a bearing
    its equivalent load N, 0 where it is not loaded; cycles: of load, of a bearing revolutions;
    safety: in the bin alone, of a bearing static, NaN where there is none; damage: NaN where it is
    not assessed; life: h, until the sum of damage is one, inf without damage; whole_safety: factor
    on the stress (of a bearing on the load) at which the spectrum just lasts as long as the bins
    say; required: least safety, of a bearing life in h, NaN where none is stated; missing: why
    there is no figure; estimates: why there is no verdict; factors: by bin; exponent: of the load
    with which stress, of a bearing damage grows; rolling: "roller" or "ball" of a bearing.
    """

    name: str
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
    estimates: tuple[str, ...] = ()
    factors: tuple[tuple[Factor, ...], ...] = ()
    exponent: float = 1.0
    rolling: str = ""

    @property
    def damage_sum(self) -> float:
        """Of all bins with a duration."""
        return float(self.damage.sum())

    @property
    def least_safety(self) -> float:
        """Of the spectrum and of every extreme load; NaN where nothing is assessed."""
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
        """The bin that damages most; without damage the one that loads most."""
        damage = np.nan_to_num(self.damage)
        return int(np.argmax(damage if damage.any() else self.load))

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
        """Of all bins together."""
        return float(sum(b.hours for b in self.bins))

    @property
    def ranked(self) -> tuple[RatedPart, ...]:
        """Parts with figures, the weakest first."""
        assessed = [p for p in self.parts if not p.missing]
        return tuple(sorted(assessed, key=lambda p: (_last(p.reserve), _last(p.life))))

    def dataset(self) -> xr.Dataset:
        """Labelled figures of all bins."""
        return rating_dataset(self)

    def __repr__(self) -> str:
        return f"<flexgear rating of {self.case.name}: {len(self.bins)} bins, {self.hours:g} h>"


def _last(value: float) -> float:
    return value if math.isfinite(value) else math.inf


NOT_RATED = "of a part that is not assessed, or not loaded in that bin"
_OF_PARTS = {
    "stress": Quantity(("bin", "part"), "Pa", "contact or root stress", "of a bearing"),
    "equivalent_load": Quantity(("bin", "part"), "N", "load of a bearing", "of a gear"),
    "load_cycles": Quantity(("bin", "part"), "1", "load cycles, of a bearing revolutions"),
    "safety": Quantity(("bin", "part"), "1", "safety in the bin alone", NOT_RATED),
    "damage": Quantity(("bin", "part"), "1", "share of the life that the bin takes", NOT_RATED),
    "damage_sum": Quantity(("part",), "1", "Miner's sum over all bins", NOT_RATED),
    "life": Quantity(("part",), "h", "hours until the sum is one; infinite: never", NOT_RATED),
    "spectrum_safety": Quantity(
        ("part",), "1", "factor on stress (bearing: load) for a sum of one", NOT_RATED
    ),
    "load_reserve": Quantity(
        ("part",), "1", "factor on all loads within the limits", f"{NOT_RATED}, or without limit"
    ),
}
_OF_BINS = {
    "hours": Quantity(("bin",), "h", "duration of the bin; 0: extreme load"),
    "port_torque": Quantity(("bin", "port"), "N m", "torque from outside"),
    "member_speed": Quantity(("bin", "member"), "rad/s", "speed of a member"),
    "load_factor": Quantity(
        ("bin", "gear_mesh", "factor"), "1", "load factor of ISO 6336", "where it is not known"
    ),
    "largest_k_gamma": Quantity(
        ("bin", "gear_mesh"), "1", "K_γ of any planet at any time", "without load"
    ),
    "rated_planet": Quantity(
        ("bin", "gear_mesh"), "1", "planet, from 1, that the factors are of; 0: no load"
    ),
}


def rating_dataset(rating: Rating) -> xr.Dataset:
    """Labelled figures of a rating by the names of ``_OF_PARTS`` and ``_OF_BINS``."""
    bins, parts = rating.bins, rating.parts
    ports = [p.member for p in rating.case.ports]
    members = list(map(str, rating.case.member_names()))
    symbols = list(
        dict.fromkeys(f.symbol for g in rating.gear_meshes for b in g.factors for f in b)
    )
    is_bearing = np.array([p.kind == "bearing" for p in parts], dtype=bool)
    load = _columns([p.load for p in parts], len(bins))
    values: dict[str, Any] = {
        "stress": np.where(is_bearing, math.nan, load),
        "equivalent_load": np.where(is_bearing, load, math.nan),
        "load_cycles": _columns([p.cycles for p in parts], len(bins)),
        "safety": _columns([p.safety for p in parts], len(bins)),
        "damage": _columns([p.damage for p in parts], len(bins)),
        "damage_sum": np.array([p.damage_sum for p in parts]),
        "life": np.array([p.life for p in parts]),
        "spectrum_safety": np.array([p.whole_safety for p in parts]),
        "load_reserve": np.array([p.reserve for p in parts]),
        "hours": np.array([b.hours for b in bins]),
        "port_torque": np.array([[b.torque[m] for m in ports] for b in bins]),
        "member_speed": np.array([[b.speed[m] for m in members] for b in bins]),
        "load_factor": _factors(rating.gear_meshes, symbols, len(bins)),
        "largest_k_gamma": _columns([g.largest_k_gamma for g in rating.gear_meshes], len(bins)),
        "rated_planet": np.array([g.planet for g in rating.gear_meshes]).reshape(-1, len(bins)).T,
    }
    declared = _OF_PARTS | _OF_BINS
    return xr.Dataset(
        {name: xr.Variable(declared[name].dims, v, declared[name].attrs)
         for name, v in values.items()},
        {
            "bin": [b.name for b in bins],
            "part": [p.name for p in parts],
            "part_stage": ("part", [p.stage for p in parts]),
            "part_kind": ("part", [p.kind for p in parts]),
            "part_missing": ("part", [p.missing for p in parts]),
            "port": ports,
            "member": members,
            "gear_mesh": [g.name for g in rating.gear_meshes],
            "factor": symbols,
            "extreme": ("bin", [b.extreme for b in bins]),
        },
        provenance(
            case=rating.case.name,
            variant=rating.variant,
            content_hash=rating.case.content_hash(),
            parameters=rating.case.to_dict(),
            closure_max=rating.closure,
        ),
    )  # fmt: skip


def _columns(columns: Sequence[ArrayLike], bins: int) -> Array:
    """(B, n) of n columns (B,)."""
    return np.array(columns, dtype=float).reshape(-1, bins).T


def _factors(gear_meshes: Sequence[GearMeshRating], symbols: Sequence[str], bins: int) -> Array:
    out = np.full((bins, len(gear_meshes), len(symbols)), math.nan)
    for g, gear_mesh in enumerate(gear_meshes):
        for b, factors in enumerate(gear_mesh.factors):
            for factor in factors:
                out[b, g, symbols.index(factor.symbol)] = factor.value
    return out


COLUMNS = ("of", "bin", "quantity", "value", "unit", "source")


def rating_rows(rating: Rating) -> Iterator[tuple[str, str, str, float | str, str, str]]:
    """Rows of ``rating.csv``: one for each part or group of gear meshes, bin and quantity; figures
    of all bins together have the bin "all"."""
    names = [b.name for b in rating.bins]
    for gear_mesh in rating.gear_meshes:
        for name, factors in zip(names, gear_mesh.factors, strict=True):
            for f in factors:
                yield gear_mesh.name, name, f.symbol, f.value, f.unit, f.source
    for part in rating.parts:
        if part.missing:
            yield part.name, "all", "not assessed", part.missing, "", ""
        unit, what = ("N", "equivalent_load") if part.kind == "bearing" else ("Pa", "stress")
        for b, name in enumerate(names):
            figures = {
                (what, unit): part.load, ("load_cycles", "1"): part.cycles,
                ("safety", "1"): part.safety, ("damage", "1"): part.damage,
            }  # fmt: skip
            for (quantity, its_unit), values in figures.items():
                if math.isfinite(values[b]):
                    yield part.name, name, quantity, float(values[b]), its_unit, "computed"
            for f in part.factors[b] if part.factors else ():
                yield part.name, name, f.symbol, f.value, f.unit, f.source
        whole = {
            "damage_sum": (part.damage_sum, "1"),
            "life": (part.life, "h"),
            "spectrum_safety": (part.whole_safety, "1"),
            "load_reserve": (part.reserve, "1"),
        }
        for quantity, (value, unit) in whole.items():
            if not math.isnan(value):
                yield part.name, "all", quantity, value, unit, "computed"


def rating_summary(rating: Rating) -> dict[str, Any]:
    """Figures for programs; None where there is no number, or no end of a life."""
    names = [b.name for b in rating.bins]
    return {
        "case": rating.case.name,
        "result": "rating",
        "schema_version": SCHEMA,
        "version": version(),
        "content_hash": rating.case.content_hash(),
        "variant": rating.variant,
        "hours": rating.hours,
        "positions": dict(rating.positions),
        "equilibrium_closure_max": rating.closure,
        "reliability": rating.reliability,
        "bins": {
            b.name: {
                "hours": b.hours,
                "extreme": b.extreme,
                "torque_nm": dict(b.torque),
                "source": b.source,
            }
            for b in rating.bins
        },
        "weakest": [p.name for p in rating.ranked],
        "load_factors": {
            g.name: {
                name: {f.symbol: f.value for f in factors}
                | {"planet": planet, "largest_k_gamma": number(largest)}
                for name, factors, planet, largest in zip(
                    names, g.factors, g.planet, g.largest_k_gamma, strict=True
                )
                if factors
            }
            for g in rating.gear_meshes
        },
        "parts": {p.name: _part_summary(p, names) for p in rating.parts},
        "not_assessed": dict(rating.not_assessed),
    }


def _part_summary(part: RatedPart, names: Sequence[str]) -> dict[str, Any]:
    if part.missing:
        return {"kind": part.kind, "stage": part.stage, "not_assessed": part.missing}
    load = "equivalent_load_n" if part.kind == "bearing" else "stress_pa"
    return {
        "kind": part.kind,
        "stage": part.stage,
        "count": part.count,
        "safety": number(part.least_safety),
        "spectrum_safety": number(part.whole_safety),
        "required": number(part.required),
        "damage": number(part.damage_sum),
        "life_h": number(part.life),
        "load_reserve": number(part.reserve),
        "within_limits": part.holds,
        "estimates": list(part.estimates),
        "worst_bin": names[part.worst_bin],
        load: dict(zip(names, part.load.tolist(), strict=True)),
        "damage_by_bin": dict(zip(names, map(number, part.damage), strict=True)),
    }
