"""Bearings of a case over its load bins: basic life, reference life of rows, static safety.

The load of a bearing over the positions of its stage becomes one constant load of the same damage.
With the sizes of its rolling elements its rows are rated by ISO/TS 16281, modified where the
lubricant is known; without, its basic life follows from C (ISO 281).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.basic_life import EXPONENTS, rating_life, varying_load
from flexgear.gears.bearings.bearing import RollingBearing, rate_load, rolling_bearing
from flexgear.gears.bearings.reference_life import (
    Lubrication,
    contamination_factor,
    reference_viscosity,
    viscosity_at,
)
from flexgear.gears.load_bins import LoadBin
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.gears.rating.sheet import Factor, Sheet, sheet
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.model.member import PlanetBearing, SeatBearing
from flexgear.model.names import MemberName
from flexgear.model.stage_view import stage_key
from flexgear.results.rating import RatedPart
from flexgear.solve.bin_loads import BinLoads

ROUNDING = 1e-9  # of the radial load: less is no thrust


@dataclass(frozen=True)
class BearingLoad:
    """radial: constant radial load of the same damage, N; axial: mean, N; moment: mean (2,) about
    the direction of the radial load and across it, N m; largest: radial load at any position, N;
    stationary: ring against which the load stands still, of a bearing whose inner ring is on what
    its axes turn with."""

    radial: float
    axial: float
    moment: tuple[float, float]
    largest: float
    stationary: Literal["inner", "outer"]

    @property
    def vector(self) -> Array:
        """Force and moment (5,) x, y, z, about x and y, the radial load along x."""
        return np.array([self.radial, 0.0, self.axial, *self.moment])


def bearing_load(force: Array, turned: Array, exponent: float, z: float = 0.0) -> BearingLoad:
    """Of forces and moments (p, 6), N and N m, at positions that count alike.

    turned: (p,) rotation in space of the axes that the force is given in, rad: the load stands
    still against the ring that sees more of its mean. exponent: of the load in the damage, P_m =
    (mean P^p)^{1/p} (Palmgren 1924, Miner 1945). z: of the bearing's middle from where moments are
    given, m. Moments are taken in axes that follow the radial load, as raceways see it.
    """
    x, y = force[:, 0], force[:, 1]
    radial = np.hypot(x, y)
    largest = float(radial.max())
    if largest == 0.0:
        return BearingLoad(0.0, float(force[:, 2].mean()), (0.0, 0.0), 0.0, "inner")
    cos, sin = np.divide([x, y], radial, out=np.zeros((2, len(x))), where=radial > 0.0)
    along = cos * force[:, 3] + sin * force[:, 4]
    across = cos * force[:, 4] - sin * force[:, 3] - z * radial
    load, axial = x + 1j * y, float(force[:, 2].mean())
    turns_along = abs(load.mean()) >= abs((load * np.exp(1j * turned)).mean())
    return BearingLoad(
        radial=varying_load(radial, exponent),
        axial=axial if abs(axial) > ROUNDING * largest else 0.0,
        moment=(float(along.mean()), float(across.mean())),
        largest=largest,
        stationary="inner" if turns_along else "outer",
    )


ROWS, HOUR = "ISO/TS 16281", 3600.0
NO_LOAD = BearingLoad(0.0, 0.0, (0.0, 0.0), 0.0, "inner")
NOTHING = 1e-6  # of the largest load: less is rounding


class _Place(NamedTuple):
    """A bearing of the model. name: of its support; member: that turns in it; key: of its section
    in the stage; rows: its rows, or why they cannot be rated."""

    name: str
    stage: str
    section: PlanetBearing | SeatBearing
    member: str
    key: str
    rows: RollingBearing | str

    @property
    def kind(self) -> Literal["ball", "roller"]:
        return self.section.rolling or "roller"

    def speed(self, flow: PowerFlow) -> float:
        """Speed of the inner against the outer ring, rad/s."""
        if self.member == "planet":
            return flow.stage(self.stage).planet_relative_speed
        return flow.speed[f"{self.stage}.{self.member}"]


class _InBin(NamedTuple):
    """radial: load of all bearings side by side, N; life: revolutions, inf without load; safety:
    static, NaN where unknown; estimates, factors: see ``RatedPart``."""

    radial: float
    life: float = math.inf
    safety: float = math.nan
    estimates: Mapping[str, str] = MappingProxyType({})
    factors: Sheet = MappingProxyType({})


def rate_bearings(
    case: Case, bins: Sequence[LoadBin], flows: Sequence[PowerFlow], loads: Sequence[BinLoads]
) -> tuple[RatedPart, ...]:
    """Bearings of planets and of the seats of FE carriers."""
    forces = [np.abs(f[:, :3]).max() for x in loads for f in x.supports.values()]
    forces += [abs(f) for s in power_flow(case).stages for f in s.gear_mesh_forces.values()]
    least = NOTHING * float(max(forces, default=0.0))
    return tuple(_part(case, place, bins, flows, loads, least) for place in _places(case))


def _places(case: Case) -> Iterator[_Place]:
    for stage in case.stages:
        bearing = stage.planet_bearing
        if stage.kind == "planetary" and isinstance(bearing, PlanetBearing):
            rows = rolling_bearing(bearing)
            for planet in range(stage.planets):
                name = MemberName.of(stage.name, f"planet_bearing_{planet + 1}")
                yield _Place(name, stage.name, bearing, "planet", "planet_bearing", rows)
        for side, seat in stage.seat_bearings.items():
            name, key = MemberName.of(stage.name, f"carrier_{side}"), f"carrier.bearing_{side}"
            yield _Place(name, stage.name, seat, "carrier", key, rolling_bearing(seat))


def _part(
    case: Case, place: _Place, bins: Sequence[LoadBin], flows: Sequence[PowerFlow],
    loads: Sequence[BinLoads], least: float,
) -> RatedPart:  # fmt: skip
    """least: load below which there is none, N."""
    section, hours, exponent = place.section, sum(b.hours for b in bins), EXPONENTS[place.kind]
    missing = ""
    if any(place.name not in x.supports for x in loads):
        missing = "the model has no such support"
    elif isinstance(place.rows, str) and section.dynamic_rating is None:
        missing = f"{stage_key(place.stage, place.key)}.dynamic_rating_kn is missing"
    speeds = [place.speed(flow) for flow in flows]
    states = [
        _in_bin(case, place, of_bin, speed, least, rated=not missing)
        for of_bin, speed in zip(loads, speeds, strict=True)
    ]
    cycles = np.array([b.turns(speed) for b, speed in zip(bins, speeds, strict=True)], dtype=float)
    damage = np.array([n / x.life if n else 0.0 for n, x in zip(cycles, states, strict=True)])
    damage[:] = damage if hours and not missing else math.nan
    total = float(damage.sum())
    lasts = math.inf if total == 0.0 else 1.0 / total
    required = (
        (hours or math.nan) if section.required_life is None else section.required_life / HOUR
    )
    return RatedPart(
        name=place.name, stage=place.stage, kind="bearing", rolling=place.kind,
        count=section.count if isinstance(place.rows, str) else 1,
        load=np.array([x.radial for x in states]), cycles=cycles,
        safety=np.array([x.safety for x in states]), damage=damage,
        life=math.nan if math.isnan(total) else hours * lasts,
        whole_safety=lasts ** (1.0 / exponent), required=required, missing=missing,
        estimates={key: rule for x in states for key, rule in x.estimates.items()},
        factors=tuple(x.factors for x in states), exponent=exponent,
    )  # fmt: skip


def _in_bin(
    case: Case, place: _Place, loads: BinLoads, speed: float, least: float, rated: bool
) -> _InBin:
    """The load with its life and safety if it is to be ``rated``; speed: of the inner against the
    outer ring, rad/s."""
    uneven = _unevenness(case, place, loads)
    force = uneven * loads.supports.get(place.name, np.zeros((1, 6)))
    turned = loads.carrier_angle.get(place.stage, np.zeros(1))
    # springs act at z, which is not the middle of two rows unless rollers make them
    z = place.section.z if place.section.rollers else 0.0
    load = bearing_load(force, turned, EXPONENTS[place.kind], z)
    load = load if load.largest > least else NO_LOAD
    how = (
        f"computed, times {uneven:.4g} by key k_gamma" if uneven != 1.0 else "computed, equilibria"
    )
    lines = [
        Factor("F_r", load.radial, "N", "constant radial load of the same damage", how),
        Factor("F_a", load.axial, "N", "mean axial load", how),
        Factor("M", math.hypot(*load.moment), "N m", "mean moment", how),
        Factor("F_r,max", load.largest, "N", "largest radial load", how),
    ]
    if not rated or load.largest == 0.0:
        safety = math.inf if rated else math.nan
        return _InBin(load.radial, safety=safety, factors=sheet(lines))
    if isinstance(place.rows, RollingBearing):
        of_bin = _of_rows(case, place.rows, load, speed)
    else:
        of_bin = _basic(place.section, load, EXPONENTS[place.kind])
    return of_bin._replace(factors={**sheet(lines), **of_bin.factors})


def _unevenness(case: Case, place: _Place, loads: BinLoads) -> float:
    """K_γ that a key states over the largest of the model: by it a planet's bearing carries more
    than the model says, as its teeth do; 1 without a key."""
    if place.member != "planet":
        return 1.0
    stated = [case.rating.forced(place.stage, kind).k_gamma or 0.0 for kind in ("sun", "ring")]
    shares = [g.largest_share for n, g in loads.groups.items() if n.stage == place.stage]
    return max(stated) / max(shares) if max(stated) and shares else 1.0


def _basic(section: PlanetBearing | SeatBearing, load: BearingLoad, exponent: float) -> _InBin:
    """Basic life of one of the bearings side by side, which share the radial load evenly."""
    assert section.dynamic_rating is not None
    life = rating_life(section.dynamic_rating, load.radial / section.count, exponent)
    safety = math.nan
    lines = [Factor("C", section.dynamic_rating, "N", "dynamic rating", "key dynamic_rating")]
    if section.static_rating is not None:
        safety = section.static_rating * section.count / load.largest
        lines += [
            Factor("C_0", section.static_rating, "N", "static rating", "key static_rating"),
            Factor("S_0", safety, "", "static safety, radial load alone", "ISO 76"),
        ]
    lines.append(Factor("L_10", life / 1e6, "10⁶ rev", "basic life, radial load", "ISO 281"))
    return _InBin(load.radial, life, safety, factors=sheet(lines))


def _of_rows(case: Case, bearing: RollingBearing, at: BearingLoad, speed: float) -> _InBin:
    """Rows in equilibrium with the load; thrust that cylindrical rollers cannot take is left to
    their ribs, which are not rated."""
    load = at.vector
    if bearing.of_rollers and not any(row.contact_angle for row in bearing.rows):
        load[2] = 0.0
    lubrication = _lubrication(case, bearing, speed)
    try:
        rated = rate_load(bearing, load, at.stationary, lubrication)
    except FlexgearError as error:
        raise FlexgearError(f"a bearing under {at.radial:.4g} N: {error}") from None
    estimated = "dynamic_rating" in bearing.estimates
    source = "estimate, ISO 281" if estimated else "key dynamic_rating"
    rating = bearing.ratings.dynamic_rating
    lines = [Factor("C", rating, "N", "dynamic rating of one bearing", source)]
    if lubrication is not None:
        ratio, clean = lubrication.viscosity_ratio, lubrication.contamination
        lines.append(Factor("κ", ratio, "", "viscosity ratio", "ISO 281"))
        lines.append(Factor("e_C", clean, "", "contamination factor", "ISO 281"))
    rev = "10⁶ rev"
    for k, row in enumerate(rated.rows, 1):
        lines += [
            Factor(f"F_{k}", row.load[0], "N", f"radial load of row {k}", ROWS),
            Factor(f"ψ_{k}", 1e3 * row.tilt, "mrad", f"tilt of row {k}", ROWS),
            Factor(f"p_{k}", row.pressure / 1e6, "MPa", f"largest pressure of row {k}", ROWS),
            Factor(f"L_10r,{k}", row.basic_life / 1e6, rev, f"life of row {k}", ROWS),
        ]
        if row.modified_life is not None:
            life = row.modified_life / 1e6
            lines.append(Factor(f"L_nmr,{k}", life, rev, f"modified life of row {k}", ROWS))
    life, safety = rated.basic_life, math.nan
    lines.append(Factor("L_10r", life / 1e6, rev, "life of all rows", ROWS))
    if rated.modified_life is not None:
        life = rated.modified_life
        lines.append(Factor("L_nmr", life / 1e6, rev, "modified life of all rows", ROWS))
    if rated.static_safety is not None:
        safety = rated.static_safety
        lines.append(Factor("S_0", safety, "", "static safety", "ISO 76"))
    return _InBin(at.radial, life, safety, rated.estimates, sheet(lines))


def _lubrication(case: Case, bearing: RollingBearing, speed: float) -> Lubrication | None:
    """κ and e_C; None where lubricant, its temperature or its cleanliness are not stated."""
    viscosity = None if case.lubricant is None else viscosity_at(case.lubricant)
    if case.lubricant is None or viscosity is None or speed == 0.0:
        return None
    diameter = bearing.rows[0].pitch_diameter
    ratio = viscosity / reference_viscosity(diameter, speed)
    contamination = contamination_factor(case.lubricant, diameter, ratio)
    return None if contamination is None else Lubrication(ratio, contamination)
