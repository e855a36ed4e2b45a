"""Rating of bearings over load bins: basic life, reference life of rows, static safety.

The radial force P on a bearing over the positions of its stage is replaced by the constant force of
equal damage,

    P_m = (mean P^p)^{1/p}     (Palmgren 1924, Miner 1945)

and thrust and moment by their means. The moment across the radial load decides how rows share it;
in planets it alternates where their carrier bears a hub moment. With its mean M and standard
deviation s, half of the revolutions are rated with M − s and half with M + s, which is exact for
damage that is a cubic of a moment with a symmetric distribution.

A bearing with stated sizes of its rolling elements is rated by rows (ISO/TS 16281), any other
bearing by its basic life from C (ISO 281); with the modified life where the lubricant is known.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.basic_life import (
    EXPONENTS,
    LEAST_E,
    equivalent_load,
    moment_force,
    paired_force,
    rating_life,
    static_load,
    varying_load,
)
from flexgear.gears.bearings.bearing import (
    THIN_FILM,
    BearingRating,
    RollingBearing,
    rate_load,
    rolling_bearing,
)
from flexgear.gears.bearings.nominal import bearing_speed, blocked_loads
from flexgear.gears.bearings.reference_life import (
    LEAST_RATIO,
    LIFE_LAWS,
    Lubrication,
    Ring,
    Rolling,
    RowRating,
    contamination_factor,
    life_modification,
    reference_viscosity,
    viscosity_at,
)
from flexgear.gears.load_bins import HOUR, LoadBin, case_in_bin
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.gears.rating.sheet import BASIC, COMPUTED, ROWS, Factor, Sheet, sheet_of, value_of
from flexgear.model.bearings import Bearing
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.model.member import PlanetBearing
from flexgear.model.stage_view import BearingPlace
from flexgear.results.rating import RatedPart
from flexgear.solve.bin_loads import BinLoads

LEAST_LOAD_SHARE = 1e-6  # of the largest load of the case; a smaller load is rounding
LEAST_THRUST_SHARE = 1e-9  # of the radial load; a smaller thrust is rounding
LEAST_COUPLE = 0.1  # of the radial load; less of it by the moment is not remarked
LEAST_SPREAD = 1e-3  # of radial load times arm; a smaller deviation of the moment has no effect


class BearingLoad(NamedTuple):
    """Constant load of a bearing in one bin.

    vector: (5,) force x, y, z, N, and moment about x and y, N m, with x along the radial load;
    largest: radial load at the worst position, N; stationary: ring to which the load is stationary;
    radial, axial: (p,) sizes of radial load and thrust at all positions, N; spread: standard
    deviation of the moment about y, N m.
    """

    vector: Array
    largest: float
    stationary: Ring
    radial: Array
    axial: Array
    spread: float = 0.0


def bearing_load(
    force: Array, turned: Array, exponent: float, z: float = 0.0, least: float = 0.0,
    width: float = 0.0,
) -> BearingLoad:  # fmt: skip
    """Constant load that replaces forces and moments (p, 6), N and N m, at p positions of equal
    duration; zero where neither radial load nor thrust exceeds ``least``, N, nor the moment that
    on the ``width`` of the gears, m.

    turned: (p,) rotation in space of the axes of the force, rad; the load is stationary to the ring
    in whose axes its mean is larger, the inner ring turning with these axes. exponent: of the load
    in the damage. z: distance of the bearing's middle from the reference point of the moments, m.
    Moments are averaged in axes that follow the radial load, without one in axes that follow them.
    """
    load, moment = force[:, 0] + 1j * force[:, 1], force[:, 3] + 1j * force[:, 4]
    moment = np.where(np.abs(moment) > least * width, moment, 0.0)  # without rounding
    radial, axial = np.abs(load), float(force[:, 2].mean())
    largest = float(radial.max())
    if largest <= least:
        load, radial, largest = moment, np.zeros(len(load)), 0.0
        axial = axial if abs(axial) > least else 0.0
        if not (axial or moment.any()):
            return BearingLoad(np.zeros(5), 0.0, "inner", *np.zeros((2, len(load))))
    direction = np.divide(load, np.abs(load), out=np.zeros_like(load), where=load != 0.0)
    followed = moment * direction.conj()
    along, across = followed.real, followed.imag - z * radial
    turns_along = abs(load.mean()) >= abs((load * np.exp(1j * turned)).mean())
    axial = axial if abs(axial) > LEAST_THRUST_SHARE * largest else 0.0
    constant = varying_load(radial, exponent)
    vector = np.array([constant, 0.0, axial, along.mean(), across.mean()])
    small = LEAST_THRUST_SHARE * largest if largest else least
    thrust = np.where(np.abs(force[:, 2]) > small, np.abs(force[:, 2]), 0.0)
    ring: Ring = "inner" if turns_along else "outer"
    return BearingLoad(vector, largest, ring, radial, thrust, float(across.std()))


class _Place(NamedTuple):
    """A bearing of the model.

    name: of its spring; alike: common name of all equal bearings; planet: number (from 1) of the
    planet on it, 0 for any other bearing; rows: its rolling bearing with rows, None without rolling
    elements.
    """

    stage: str
    name: str
    alike: str
    planet: int
    place: BearingPlace
    rows: RollingBearing | None

    @property
    def section(self) -> Bearing:
        return self.place.bearing

    @property
    def kind(self) -> Rolling:
        return self.section.rolling or "roller"

    @property
    def exponent(self) -> float:
        """Exponent of the load in the damage; 4 for rows of rollers."""
        if self.rows is None:
            return EXPONENTS[self.kind]
        return LIFE_LAWS[type(self.rows.rows[0])].rotating


class _InBin(NamedTuple):
    """A bearing in one load bin. life: revolutions, inf without load; safety: static, NaN where
    unknown; factors, estimates: as of ``RatedPart``; left_out: thrust and 2 F_M, N, where the basic
    life should count them and does not."""

    life: float
    safety: float
    factors: Sheet
    estimates: Mapping[str, str]
    left_out: tuple[float, float] = (0.0, 0.0)


def rate_bearings(
    case: Case, bins: Sequence[LoadBin], flows: Sequence[PowerFlow], loads: Sequence[BinLoads]
) -> tuple[RatedPart, ...]:
    """Ratings of the bearings of planets, and of members that turn or have rated bearings."""
    forces = [np.abs(f[:, :3]).max() for x in loads for f in x.supports.values()]
    forces += [abs(f) for s in power_flow(case).stages for f in s.gear_mesh_forces.values()]
    least = LEAST_LOAD_SHARE * float(max(forces, default=0.0))
    return tuple(_part(case, place, bins, flows, loads, least) for place in _places(case))


def _places(case: Case) -> Iterator[_Place]:
    for view in map(case.view, [stage.name for stage in case.stages]):
        for place in view.bearings:
            rows, of_planets = rolling_bearing(place.bearing), place.part == "planet"
            for number, spring in enumerate(place.springs, 1):
                alike = f"{view.name}.planet_bearings" if of_planets else spring
                number *= of_planets
                yield _Place(view.name, str(spring), str(alike), number, place, rows)


def _part(
    case: Case, place: _Place, bins: Sequence[LoadBin], flows: Sequence[PowerFlow],
    loads: Sequence[BinLoads], least: float,
) -> RatedPart:  # fmt: skip
    """Rating of one bearing over all bins; least: load that counts, N."""
    section, hours = place.section, sum(b.hours for b in bins)
    missing = ""
    if any(place.name not in x.supports for x in loads):
        missing = "the model has no such support"
    elif isinstance(section, PlanetBearing) and section.journal is not None:
        missing = "a plain bearing has no rating life; `flexgear run` states its least oil film"
    elif place.rows is None and section.dynamic_rating is None:
        missing = f"{place.place.key}.dynamic_rating_kn is missing"
    speeds = [bearing_speed(place.place, flow.stage(place.stage)) for flow in flows]

    def in_bins(rated: bool) -> list[_InBin]:
        stages = [flow.stage(place.stage) for flow in flows]
        blocked = [blocked_loads(case.view(place.stage), x, place.place) for x in stages]
        cases = [case_in_bin(case, b) for b in bins]
        of_bins = zip(cases, loads, speeds, blocked, strict=True)
        return [_in_bin(c, place, x, n, by_flow, least, rated) for c, x, n, by_flow in of_bins]

    try:
        states = in_bins(rated=not missing)
    except FlexgearError as error:
        missing, states = str(error), in_bins(rated=False)
    estimates = {key: rule for x in states for key, rule in x.estimates.items()}
    cycles = np.array([b.turns(speed) for b, speed in zip(bins, speeds, strict=True)], dtype=float)
    radial = np.array([value_of(x.factors, "F_r") for x in states])
    lacking = [
        name
        for k, name in enumerate(("thrust", "the moment"))
        if _matters(np.array([x.left_out[k] for x in states]), radial, cycles, place.exponent)
    ]
    if lacking:
        verb = "are" if len(lacking) > 1 else "is"
        reason = f"by the radial load alone, as {' and '.join(lacking)} {verb} left out"
        estimates["equivalent_load"] = reason
        if all(math.isinf(x.life) for x in states):
            missing = f"without a radial load its life is not {reason}"
    damage = np.array([n / x.life if n else 0.0 for n, x in zip(cycles, states, strict=True)])
    damage[:] = damage if hours and not missing else math.nan
    total = float(damage.sum())
    lasts = math.inf if total == 0.0 else 1.0 / total
    of_rows = np.zeros(0)
    if not missing and hours and place.rows is not None:
        lives = [[_row_life(x.factors, k + 1) for k in range(len(place.rows.rows))] for x in states]
        of_rows = cycles @ (1.0 / np.array(lives))
    required = hours or math.nan
    if section.required_life is not None:
        required = section.required_life / HOUR
    return RatedPart(
        name=place.name, alike=place.alike, stage=place.stage, kind="bearing", rolling=place.kind,
        count=section.count if place.rows is None else 1,
        planets=(place.planet,) * len(bins) if place.planet else (),
        load=np.array([value_of(x.factors, "P", value_of(x.factors, "F_r")) for x in states]),
        cycles=cycles,
        safety=np.array([x.safety for x in states]), damage=damage,
        life=math.nan if math.isnan(total) else hours * lasts,
        whole_safety=lasts ** (1.0 / place.exponent), required=required, missing=missing,
        estimates=estimates,
        factors=tuple(x.factors for x in states), exponent=place.exponent, of_rows=of_rows,
    )  # fmt: skip


def _matters(left_out: Array, radial: Array, cycles: Array, exponent: float) -> bool:
    """Whether a load (B,) that the life does not count exceeds ``LEAST_E`` of the radial load (B,),
    both replaced by those of equal damage over the bins, or in a bin without revolutions."""
    limit = LEAST_E * radial
    in_life = cycles @ left_out**exponent > cycles @ limit**exponent
    return bool(in_life or (left_out > limit)[cycles == 0.0].any())


def _in_bin(
    case: Case, place: _Place, loads: BinLoads, speed: float, blocked: tuple[float, float],
    least: float, rated: bool,
) -> _InBin:  # fmt: skip
    """The load of a bearing in a bin, with life and safety if ``rated``; case: of the bin; speed:
    of the inner ring relative to the outer one, rad/s; blocked: see ``blocked_loads``."""
    load_factor = _stated_load_factor(case, place, loads)
    force = load_factor * loads.supports.get(place.name, np.zeros((1, 6)))
    mate = case.view(place.stage).mate(place.place)
    if mate is not None:
        of_mate = load_factor * loads.supports.get(str(mate.springs[0]), np.zeros((1, 6)))
        force = paired_force(place.section, force, mate.bearing, of_mate)
    turned = loads.carrier_angle.get(place.stage, np.zeros(1))
    force = force + load_factor * blocked[0] * np.eye(6)[2]
    width = case.stage(place.stage).gear_width
    load = bearing_load(force, turned, place.exponent, place.section.z, least, width)
    if load.vector.any():  # of axial forces on a radius: about the tangential load
        load = load._replace(vector=load.vector + load_factor * blocked[1] * np.eye(5)[3])
    radial, _, axial, *moment = load.vector.tolist()
    how = COMPUTED if load_factor == 1.0 else f"computed, times {load_factor:.4g} by key k_gamma"
    rules = [case.rating.forced(place.stage, kind) for kind in ("sun", "ring")]
    how += ", without K_A" if any(x.application_factor != 1.0 for x in rules) else ""
    elements = place.section.elements
    if place.section.rollers is not None and elements is not None and elements.contact_angle:
        how += ", from a model with cylindrical rollers"
    loads_of = {"F_r": radial, "F_a": axial, "M": math.hypot(*moment), "F_r,max": load.largest}
    loads_of |= dict(zip(("M_x", "M_y"), moment, strict=True)) | {"σ_My": load.spread}
    factors = sheet_of(loads_of, how)
    if any(blocked):
        by_flow = {"F_a": axial, "M": loads_of["M"], "M_x": moment[0]}
        factors |= sheet_of(by_flow, "of the power flow, as its member cannot follow it")
    if not rated or not load.vector.any():
        return _InBin(math.inf, math.inf if rated else math.nan, factors, {})
    if place.place.part not in ("planet", "carrier"):  # whose inner rings turn with the axes
        load = load._replace(stationary="outer")
    if place.rows is not None:
        of_bin = _of_rows(case, place.rows, load, speed)
    else:
        reach = 0.5 * width if place.planet and any(blocked) else 0.0
        of_bin = _basic(case, place.section, load, place.exponent, speed, reach)
    return of_bin._replace(factors={**factors, **of_bin.factors})


def _stated_load_factor(case: Case, place: _Place, loads: BinLoads) -> float:
    """Ratio of the K_γ stated by a key to the largest K_γ of the model, by which the load of the
    bearing of a planet, pinion or gear is multiplied like that of its teeth; 1 without a key."""
    if place.place.part not in ("planet", "pinion", "gear"):
        return 1.0
    stated = [case.rating.forced(place.stage, kind).k_gamma or 0.0 for kind in ("sun", "ring")]
    shares = [g.largest_share for n, g in loads.groups.items() if n.stage == place.stage]
    return max(stated) / max(shares) if max(stated) and shares else 1.0


def _basic(
    case: Case, section: Bearing, load: BearingLoad, exponent: float, speed: float, reach: float
) -> _InBin:
    """Basic life of one of several bearings side by side, which share the load evenly, and modified
    life a_ISO L_10 where its data are stated. The moment M never counts: F_M (``moment_force``)
    states what it adds; reach: arm where no stiffness against tilting is stated, m."""
    rating, static, estimates = section.dynamic_rating, section.static_rating, dict[str, str]()
    assert rating is not None
    of_position = equivalent_load(section, load.radial, load.axial)
    equivalent = varying_load(of_position, exponent)
    life = rating_life(rating, equivalent / section.count, exponent)
    largest = float(static_load(section, load.radial, load.axial).max())
    safety = None
    if static is not None and largest > 0.0:  # not under a moment alone
        safety = static * section.count / largest
    couple = moment_force(section, math.hypot(*load.vector[3:]), reach)
    thrust = varying_load(load.axial, exponent) if section.thrust is None else 0.0
    left_out = couple if 0.0 < LEAST_COUPLE * load.vector[0] < 2.0 * couple else None
    factors = sheet_of({"C": rating, "C_0": static, "S_0": safety, "F_M": left_out})
    basis = BASIC
    if section.thrust is None:
        basis += ", radial load alone"
    else:
        factors |= sheet_of({"P": equivalent, "P_0": None if safety is None else largest})
    factors |= sheet_of({"L_10": life / 1e6}, basis)
    diameter, limit = section.mean_diameter, section.fatigue_load_limit
    film = None if diameter is None else _lubrication(case, diameter, speed)
    if film is not None and limit is not None and equivalent:
        ratio = film.contamination * limit * section.count / equivalent
        factor = float(life_modification(section.rolling or "roller", film.viscosity_ratio, ratio))
        life *= factor
        estimates |= THIN_FILM if film.viscosity_ratio < LEAST_RATIO else {}
        of_film = {"κ": film.viscosity_ratio, "e_C": film.contamination, "a_ISO": factor}
        factors |= sheet_of({"C_u": limit, **of_film, "L_nm": life / 1e6})
    return _InBin(
        life, math.nan if safety is None else safety, factors, estimates, (thrust, 2.0 * couple)
    )


def _of_rows(case: Case, bearing: RollingBearing, at: BearingLoad, speed: float) -> _InBin:
    """Life and safety of a bearing by rows in equilibrium with the load.

    Ribs take the thrust on cylindrical rollers and are not rated. Static safety is extrapolated to
    the largest radial load in proportion to it, which is conservative for a bearing with clearance.
    """
    load = at.vector.copy()
    if bearing.of_rollers and not any(row.contact_angle for row in bearing.rows):
        load[2] = 0.0
    if not load.any():
        return _InBin(math.inf, math.inf, {}, {})
    film = _lubrication(case, bearing.rows[0].pitch_diameter, speed)
    alternates = at.spread > LEAST_SPREAD * load[0] * bearing.rows[0].arm
    moments = load[4] + np.array([-at.spread, at.spread] if alternates else [0.0])
    try:
        halves = [
            rate_load(bearing, np.array([*load[:4], moment]), at.stationary, film)
            for moment in moments
        ]
    except FlexgearError as error:
        raise FlexgearError(f"{error} (radial {load[0]:.4g} N)") from None
    factors = dict[str, Factor]()
    for symbol, key in (("C", "dynamic_rating"), ("C_0", "static_rating")):
        factors |= _rating(bearing, symbol, key)
    if film is not None:
        factors |= _rating(bearing, "C_u", "fatigue_load_limit")
        factors |= sheet_of({"κ": film.viscosity_ratio, "e_C": film.contamination})
    for k, rows in enumerate(zip(*(half.rows for half in halves), strict=True), 1):
        tilt, pressure = max(row.tilt for row in rows), max(row.pressure for row in rows)
        of_row = {"F": np.mean([row.load[0] for row in rows]), "ψ": 1e3 * tilt, "p": pressure / 1e6}
        factors |= sheet_of(of_row | _lives(rows), row=k)
    lives = sheet_of(_lives(halves), f"{ROWS}, {at.stationary} ring stationary under the load")
    safeties = [half.static_safety for half in halves if half.static_safety is not None]
    safety = min(safeties, default=math.nan)
    if safeties and load[0]:
        safety *= float(load[0]) / at.largest
    factors |= lives | sheet_of({"S_0": safety if safeties else None})
    life = 1e6 * value_of(lives, "L_nmr", value_of(lives, "L_10r"))
    return _InBin(life, safety, factors, halves[0].estimates)


def _rating(bearing: RollingBearing, symbol: str, key: str) -> dict[str, Factor]:
    """Line of a bearing rating, with the rule by which it is estimated if it is not stated."""
    rule = bearing.estimates.get(key)
    return sheet_of({symbol: getattr(bearing.ratings, key)}, f"estimated {rule}" if rule else "")


def _lives(halves: Sequence[RowRating | BearingRating]) -> dict[str, float | None]:
    """Reference life and, where known, modified reference life of equal numbers of revolutions in
    each state, 10⁶ revolutions."""
    lives = {
        "L_10r": [half.basic_life for half in halves],
        "L_nmr": [x for half in halves if (x := half.modified_life) is not None],
    }
    means = {symbol: sum(1.0 / x for x in of) / len(of) for symbol, of in lives.items() if of}
    return {symbol: 1e-6 / mean if mean else math.inf for symbol, mean in means.items()}


def _row_life(factors: Sheet, row: int) -> float:
    """Life of a row (numbered from 1), revolutions: modified where known, ∞ without load."""
    basic = value_of(factors, f"L_10r,{row}", math.inf)
    return 1e6 * value_of(factors, f"L_nmr,{row}", basic)


def _lubrication(case: Case, diameter: float, speed: float) -> Lubrication | None:
    """κ and e_C for the mean diameter of a bearing, m; None where lubricant, its temperature or its
    cleanliness are not stated."""
    viscosity = None if case.lubricant is None else viscosity_at(case.lubricant)
    if case.lubricant is None or viscosity is None or speed == 0.0:
        return None
    ratio = viscosity / reference_viscosity(diameter, speed)
    contamination = contamination_factor(case.lubricant, diameter, ratio)
    return None if contamination is None else Lubrication(ratio, contamination)
