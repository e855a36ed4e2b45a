"""Bearings of a case over its load bins: basic life, reference life of rows, static safety.

The load of a bearing over the positions of its stage becomes one constant load of the same damage.
With the sizes of its rolling elements its rows are rated by ISO/TS 16281, modified where the
lubricant is known; without, its basic life follows from C (ISO 281).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.basic_life import EXPONENTS, rating_life, varying_load
from flexgear.gears.bearings.bearing import (
    BearingRating,
    RollingBearing,
    rate_load,
    rolling_bearing,
)
from flexgear.gears.bearings.reference_life import (
    Lubrication,
    contamination_factor,
    reference_viscosity,
    viscosity_at,
)
from flexgear.gears.load_bins import LoadBin
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.gears.rating.rate import Factor
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


STEEL, HOUR = "ISO/TS 16281", 3600.0
NO_LOAD = BearingLoad(0.0, 0.0, (0.0, 0.0), 0.0, "inner")
NOTHING = 1e-6  # of the largest load: less is rounding


class _Place(NamedTuple):
    """A bearing of the model. name: of its support; member: that turns in it."""

    name: str
    stage: str
    section: PlanetBearing | SeatBearing
    member: str

    def speed(self, flow: PowerFlow) -> float:
        """Of the inner against the outer ring, rad/s."""
        if self.member == "planet":
            return flow.stage(self.stage).planet_relative_speed
        return flow.speed[f"{self.stage}.{self.member}"]


class _InBin(NamedTuple):
    """at: load of all bearings side by side; life: revolutions, inf without load; safety: static,
    NaN where unknown; estimates, factors: see ``RatedPart``."""

    at: BearingLoad
    life: float
    safety: float
    estimates: tuple[str, ...]
    factors: tuple[Factor, ...]


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
        view = case.view(stage.name)
        if stage.kind == "planetary" and isinstance(stage.planet_bearing, PlanetBearing):
            for planet in range(stage.planets):
                name = MemberName.of(stage.name, f"planet_bearing_{planet + 1}")
                yield _Place(name, stage.name, stage.planet_bearing, "planet")
        for side, seat in view.seat_bearings.items():
            name = MemberName.of(stage.name, f"carrier_{side}")
            yield _Place(name, stage.name, seat, "carrier")


def _part(
    case: Case, place: _Place, bins: Sequence[LoadBin], flows: Sequence[PowerFlow],
    loads: Sequence[BinLoads], least: float,
) -> RatedPart:  # fmt: skip
    section, hours = place.section, sum(b.hours for b in bins)
    bearing, kind = rolling_bearing(section), section.rolling or "roller"
    exponent = EXPONENTS[kind]
    missing = _missing(place, bearing, loads)
    states = [_unrated(case, place, x, exponent, least) for x in loads]
    if not missing:
        states = [
            _rated(case, place, bearing, flow, state)
            for flow, state in zip(flows, states, strict=True)
        ]
    cycles = np.array(
        [b.turns(place.speed(flow)) for b, flow in zip(bins, flows, strict=True)], dtype=float
    )
    damage = np.array([n / x.life if n else 0.0 for n, x in zip(cycles, states, strict=True)])
    damage[:] = damage if hours and not missing else math.nan
    total = float(damage.sum())
    lasts = math.inf if total == 0.0 else 1.0 / total
    required_life = section.required_life
    return RatedPart(
        name=place.name, stage=place.stage, kind="bearing", rolling=kind,
        count=1 if isinstance(bearing, RollingBearing) else section.count,
        load=np.array([x.at.radial for x in states]), cycles=cycles,
        safety=np.array([x.safety for x in states]), damage=damage,
        life=math.nan if math.isnan(total) else hours * lasts,
        whole_safety=math.nan if math.isnan(total) else lasts ** (1.0 / exponent),
        required=(hours or math.nan) if required_life is None else required_life / HOUR,
        missing=missing,
        estimates=tuple(dict.fromkeys(text for x in states for text in x.estimates)),
        factors=tuple(x.factors for x in states), exponent=exponent,
    )  # fmt: skip


def _missing(place: _Place, bearing: RollingBearing | str, loads: Sequence[BinLoads]) -> str:
    """Why a bearing is not assessed."""
    if any(place.name not in x.supports for x in loads):
        return "the model has no such support"
    if isinstance(bearing, RollingBearing) or place.section.dynamic_rating is not None:
        return ""
    place_of = "planet_bearing" if place.member == "planet" else place.name.rpartition(".")[2]
    key = place_of.replace("carrier_", "carrier.bearing_")
    return f"{stage_key(place.stage, key)}.dynamic_rating_kn is missing"


def _unevenness(case: Case, place: _Place, loads: BinLoads) -> float:
    """K_γ that a key states over the largest of the model: by it a planet's bearing carries more
    than the model says, as its teeth do; 1 without a key."""
    if place.member != "planet":
        return 1.0
    stated = [case.rating.forced(place.stage, kind).k_gamma or 0.0 for kind in ("sun", "ring")]
    shares = [g.largest_share for n, g in loads.groups.items() if n.stage == place.stage]
    return max(stated) / max(shares) if max(stated) and shares else 1.0


def _unrated(case: Case, place: _Place, loads: BinLoads, exponent: float, least: float) -> _InBin:
    """The load alone, zero where it is below ``least``, N, which is rounding."""
    uneven = _unevenness(case, place, loads)
    force = uneven * loads.supports.get(place.name, np.zeros((1, 6)))
    turned = loads.carrier_angle.get(place.stage, np.zeros(1))
    # springs act at z, which is not the middle of two rows unless rollers make them
    z = place.section.z if place.section.rollers else 0.0
    at = bearing_load(force, turned, exponent, z)
    at = at if at.largest > least else NO_LOAD
    return _InBin(at, math.inf, math.nan, (), _loads(at, uneven))


def _rated(
    case: Case, place: _Place, bearing: RollingBearing | str, flow: PowerFlow, state: _InBin
) -> _InBin:
    """A load with life and safety, and their factors behind its own."""
    if state.at.largest == 0.0:
        return state._replace(safety=math.inf)
    if isinstance(bearing, RollingBearing):
        rated = _rows(case, bearing, state.at, place.speed(flow))
    else:
        rated = _basic(place.section, state.at, EXPONENTS[place.section.rolling or "roller"])
    return rated._replace(factors=(*state.factors, *rated.factors))


def _loads(at: BearingLoad, uneven: float) -> tuple[Factor, ...]:
    how = (
        "computed, equilibria" if uneven == 1.0 else f"computed, times {uneven:.4g} by key k_gamma"
    )
    return (
        Factor("F_r", at.radial, "N", "constant radial load of the same damage", how),
        Factor("F_a", at.axial, "N", "mean axial load", how),
        Factor("M", math.hypot(*at.moment), "N m", "mean moment", how),
        Factor("F_r,max", at.largest, "N", "largest radial load", how),
    )


def _basic(section: PlanetBearing | SeatBearing, at: BearingLoad, exponent: float) -> _InBin:
    """Basic life of one of the bearings side by side, which share the radial load evenly."""
    assert section.dynamic_rating is not None
    each = at.radial / section.count
    life = rating_life(section.dynamic_rating, each, exponent)
    safety = math.nan
    lines = [Factor("C", section.dynamic_rating, "N", "dynamic rating", "key dynamic_rating")]
    if section.static_rating is not None:
        safety = section.static_rating * section.count / at.largest
        lines += [
            Factor("C_0", section.static_rating, "N", "static rating", "key static_rating"),
            Factor("S_0", safety, "", "static safety, radial load alone", "ISO 76"),
        ]
    lines.append(Factor("L_10", life / 1e6, "10⁶ rev", "basic life, radial load", "ISO 281"))
    return _InBin(at, life, safety, (), tuple(lines))


def _rows(case: Case, bearing: RollingBearing, at: BearingLoad, speed: float) -> _InBin:
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
    life = rated.basic_life if rated.modified_life is None else rated.modified_life
    safety = math.nan if rated.static_safety is None else rated.static_safety
    factors = tuple(_of_rows(bearing, rated, lubrication))
    return _InBin(at, life, safety, rated.estimates, factors)


def _lubrication(case: Case, bearing: RollingBearing, speed: float) -> Lubrication | None:
    """κ and e_C; None where lubricant, its temperature or its cleanliness are not stated."""
    viscosity = None if case.lubricant is None else viscosity_at(case.lubricant)
    if case.lubricant is None or viscosity is None or speed == 0.0:
        return None
    diameter = bearing.rows[0].pitch_diameter
    ratio = viscosity / reference_viscosity(diameter, speed)
    contamination = contamination_factor(case.lubricant, diameter, ratio)
    return None if contamination is None else Lubrication(ratio, contamination)


def _of_rows(
    bearing: RollingBearing, rated: BearingRating, lubrication: Lubrication | None
) -> Iterator[Factor]:
    ratings = bearing.ratings
    estimated = any(text.startswith("dynamic_rating") for text in bearing.estimates)
    source = "estimate, ISO 281" if estimated else "key dynamic_rating"
    yield Factor("C", ratings.dynamic_rating, "N", "dynamic rating of one bearing", source)
    if lubrication is not None:
        yield Factor("κ", lubrication.viscosity_ratio, "", "viscosity ratio", "ISO 281")
        yield Factor("e_C", lubrication.contamination, "", "contamination factor", "ISO 281")
    for k, row in enumerate(rated.rows, 1):
        yield Factor(f"F_{k}", row.load[0], "N", f"radial load of row {k}", STEEL)
        yield Factor(f"ψ_{k}", 1e3 * row.tilt, "mrad", f"tilt of row {k}", STEEL)
        yield Factor(f"p_{k}", row.pressure / 1e6, "MPa", f"largest pressure of row {k}", STEEL)
        yield Factor(f"L_10r,{k}", row.basic_life / 1e6, "10⁶ rev", f"life of row {k}", STEEL)
        if row.modified_life is not None:
            yield Factor(
                f"L_nmr,{k}", row.modified_life / 1e6, "10⁶ rev", f"modified life of row {k}", STEEL
            )
    yield Factor("L_10r", rated.basic_life / 1e6, "10⁶ rev", "life of all rows", STEEL)
    if rated.modified_life is not None:
        text = "modified life of all rows"
        yield Factor("L_nmr", rated.modified_life / 1e6, "10⁶ rev", text, STEEL)
    if rated.static_safety is not None:
        yield Factor("S_0", rated.static_safety, "", "static safety", "ISO 76")
