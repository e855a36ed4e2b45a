"""Rolling bearing of one or several rows: equilibrium under a load, ratings of all rows.

The load (5,) is (F_x, F_y, F_z, M_x, M_y) at the middle of the bearing, the motion (5,) its
conjugate (x, y, z, r_x, r_y); see ``rows``. Equilibrium minimises the potential
Π = Σ energy(u) − load · u by Newton's method with Levenberg–Marquardt damping, which ensures that Π
falls and vanishes near the solution. Unknowns are scaled by the approach expected under the load.

Ratings that a case leaves out are estimated, in N and mm:

    C    ISO 281:2007 by f_c in closed form (Harris, Kotzalas 2006, ch. 11): rollers
         b_m 207.9 λν γ^(2/9) (1 − γ)^(29/27)/(1 + γ)^(1/4) (1 + (1.04 t)^4.5)^(−2/9)
         · (i L_we cos α)^(7/9) Z^(3/4) D_we^(29/27), λν = 0.83, b_m = 1.1,
         t = ((1 − γ)/(1 + γ))^(143/108);
         balls b_m 145.3 γ^0.3 (1 − γ)^1.39/(1 + γ)^(1/3) (1 + (1.04 t)^(10/3))^(−0.3)
         · (i cos α)^0.7 Z^(2/3) D_w^1.8, b_m = 1.3, t = ((1 − γ)/(1 + γ))^1.72, grooves of
         0.52 D_w; above 25.4 mm 3.647 D_w^1.4 in place of 1.3 D_w^1.8; two rows of α = 0 less by
         0.90/0.95
    C_0  ISO 76:2006, rollers: 44 (1 − γ) i Z L_we D_we cos α; balls: i Z cos α/5 times the load
         under which a raceway has 4200 MPa (E 207 GPa), of which that standard's f_0 follows
    C_u  ISO 281:2007, annex B, simplified: C_0/8.2 of rollers, C_0/22 of balls,
         for D_pw > 100 mm times (100/D_pw)^0.3 and (100/D_pw)^0.5
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.bearings.reference_life import (
    LEAST_RATIO,
    LIFE_FACTOR_MATERIAL,
    Lubrication,
    Ratings,
    Ring,
    RowRating,
    life_of_rows,
    row_rating,
)
from flexgear.gears.bearings.rows import BallRow, RollerRow, Row, RowState, standard_drops
from flexgear.model.bearings import Bearing, RollingElements
from flexgear.model.errors import FlexgearError

COMPONENTS = ("x", "y", "z", "rx", "ry")
THIN_FILM = {"a_ISO": "is 0.1 for a viscosity ratio below 0.1, where ISO 281 states none"}
TOLERANCE = 1e-9  # of the residual over the load
ROUNDING = 1e-5  # residual over the load, where approaches are too small beside groove distances
LEAST_DAMPING = 1e-14  # keeps the step finite where no element is loaded
MAX_ITERATIONS = 1000


@dataclass(frozen=True)
class RollingBearing:
    """One bearing, or several equal ones side by side on one seat. rows: rows of all bearings along
    the axis; ratings: of one bearing; estimates: rule by which a key of the case was estimated, by
    key. A life or safety that rests on an estimate is reported without a verdict."""

    rows: tuple[Row, ...]
    ratings: Ratings
    estimates: Mapping[str, str] = field(default_factory=dict)

    @property
    def of_rollers(self) -> bool:
        """Whether the rolling elements are rollers."""
        return isinstance(self.rows[0], RollerRow)

    def states(self, motion: Array, first: float = 0.0) -> list[RowState]:
        """Loads of all rows at a motion (5,); first: angle of the first element, rad."""
        return [row.state(np.asarray(motion, dtype=float), first) for row in self.rows]


@dataclass(frozen=True)
class BearingRating:
    """Life and static safety of a bearing in one state. motion: (5,), m and rad; rows: ratings of
    every row; basic_life, modified_life: of all rows together, revolutions; static_safety: least of
    all rows; estimates: rules behind estimated values, by name of the value."""

    motion: Array
    rows: tuple[RowRating, ...]
    basic_life: float
    modified_life: float | None
    static_safety: float | None
    estimates: Mapping[str, str]

    @property
    def pressure(self) -> float:
        """Largest contact pressure of all rows, Pa."""
        return max(row.pressure for row in self.rows)


def direction(vector: Array) -> float:
    """Angle of the radial part of a load or motion (5,), rad."""
    return math.atan2(vector[1], vector[0])


def equilibrium(
    bearing: RollingBearing, load: Array, held: Mapping[str, float] | None = None
) -> Array:
    """Motion (5,) under a load (5,), N and N m, with the first element in direction of the load.

    held: prescribed motion by component, m or rad, in place of the load. Cylindrical roller
    bearings take no axial load: z is 0 unless ``held`` has it. Raises FlexgearError without
    equilibrium.
    """
    load = np.asarray(load, dtype=float)
    motion = np.zeros(5)
    prescribed = dict(held or {})
    if bearing.of_rollers and not any(row.contact_angle for row in bearing.rows):
        if "z" not in prescribed and load[2] != 0:
            raise FlexgearError("a cylindrical roller bearing takes no axial load")
        prescribed.setdefault("z", 0.0)
    for name, value in prescribed.items():
        motion[COMPONENTS.index(name)] = value
    free = np.array([name not in prescribed for name in COMPONENTS])
    first, scale = direction(load), _scale(bearing, load)
    size = max(float(np.abs(scale * load)[free].max(initial=0.0)), 1e-12 * float(scale[0]))

    def evaluate(u: Array) -> tuple[float, Array, Array]:
        """Π, its gradient and Hessian over the free components, all scaled."""
        states = bearing.states(u, first)
        energy = sum(s.energy for s in states) - float(load @ (free * u))
        residual = np.sum([s.force for s in states], axis=0) - load
        tangent = scale[:, None] * np.sum([s.tangent for s in states], axis=0) * scale
        gradient = (scale * residual)[free] / size
        return energy / size, gradient, tangent[np.ix_(free, free)] / size

    damping, (potential, residual, tangent) = 1e-3, evaluate(motion)
    for _ in range(MAX_ITERATIONS):
        if np.abs(residual).max(initial=0.0) < TOLERANCE:
            return motion
        trial = motion.copy()
        damped = tangent + damping * np.eye(len(residual))
        trial[free] -= scale[free] * np.linalg.solve(damped, residual)
        trial_state = evaluate(trial)
        if trial_state[0] <= potential + 1e-12 * abs(potential):
            motion, (potential, residual, tangent) = trial, trial_state
            damping = max(0.1 * damping, LEAST_DAMPING)
        else:
            damping *= 10
            if damping > 1 and np.abs(residual).max() < ROUNDING:
                return motion
    cause = "it can move freely"
    if len(bearing.rows) == 1 and bearing.rows[0].contact_angle:
        cause = "one row slides along its contact angle without axial load; give both of the pair"
    raise FlexgearError(f"no equilibrium of the bearing under its load: {cause}")


def _scale(bearing: RollingBearing, load: Array) -> Array:
    """Expected size of the motion (5,), m and rad: approach δ of one element under its share of the
    load, and tilt δ over an arm."""
    row = bearing.rows[0]
    arm = max(row.pitch_diameter / 2, *(abs(r.position) for r in bearing.rows))
    force = max(float(np.abs(load[:3]).max()), float(np.abs(load[3:]).max()) / arm, 1.0)
    element_load = 5 * force / (row.count * len(bearing.rows))
    approach = (element_load / row.stiffness) ** (1 / row.exponent)
    return approach * np.array([1, 1, 1, 1 / arm, 1 / arm])


def rate_motion(
    bearing: RollingBearing,
    motion: Array,
    stationary: Ring,
    lubrication: Lubrication | None = None,
    first: float | None = None,
) -> BearingRating:
    """Ratings of a bearing at a motion (5,). stationary: ring that is stationary relative to the
    load; first: angle of the first element, rad, by default the direction of the motion."""
    motion = np.asarray(motion, dtype=float)
    states = bearing.states(motion, direction(motion) if first is None else first)
    rows = tuple(
        row_rating(row, bearing.ratings, motion, state, stationary, lubrication)
        for row, state in zip(bearing.rows, states, strict=True)
    )
    basic = life_of_rows(bearing.rows, [row.basic_life for row in rows])
    assert basic is not None
    estimates = dict(bearing.estimates)
    if lubrication is None:
        estimates.pop("fatigue_load_limit", None)
    elif lubrication.viscosity_ratio < LEAST_RATIO:
        estimates |= THIN_FILM
    safeties = [row.static_safety for row in rows if row.static_safety is not None]
    return BearingRating(
        motion,
        rows,
        basic,
        life_of_rows(bearing.rows, [row.modified_life for row in rows]),
        min(safeties) if safeties else None,
        estimates,
    )


def rate_load(
    bearing: RollingBearing,
    load: Array,
    stationary: Ring,
    lubrication: Lubrication | None = None,
    held: Mapping[str, float] | None = None,
) -> BearingRating:
    """Ratings (see ``rate_motion``) of a bearing in ``equilibrium`` under a load (5,)."""
    motion = equilibrium(bearing, load, held)
    return rate_motion(bearing, motion, stationary, lubrication, direction(np.asarray(load)))


ESTIMATES = {
    "dynamic_rating": "by ISO 281 from the size of the rolling elements",
    "static_rating": "by ISO 76 from the size of the rolling elements",
    "fatigue_load_limit": "by ISO 281, annex B, from the static rating",
}
STATIC_PRESSURE, STATIC_YOUNG = 4200e6, 207e9  # of balls at the static rating in ISO 76, Pa


def rolling_bearing(section: Bearing) -> RollingBearing | None:
    """The rolling bearing of a bearing section of a case; None if that has no rolling elements."""
    elements = section.elements
    if elements is None:
        return None
    rows = _rows(section, elements)
    rows_per_bearing = len(rows) // section.count
    dynamic = section.dynamic_rating or dynamic_rating(rows[0], rows_per_bearing)
    static = section.static_rating or static_rating(rows[0], rows_per_bearing)
    limit = section.fatigue_load_limit or fatigue_load_limit(rows[0], static)
    estimates = {key: rule for key, rule in ESTIMATES.items() if getattr(section, key) is None}
    return RollingBearing(rows, Ratings(dynamic, static, limit, rows_per_bearing), estimates)


def _rows(section: Bearing, elements: RollingElements) -> tuple[Row, ...]:
    """Rows of all bearings, from −z to +z."""
    source = section.rollers or elements
    total = section.rollers.rows if section.rollers else (elements.rows or 1) * section.count
    spacing, gap, length = source.spacing or 0.0, source.clearance or 0.0, source.length or 0.0
    assert source.count is not None
    outward = 1.0 if elements.arrangement == "X" or total == 1 else -1.0
    rows: list[Row] = []
    for k in range(total):
        place = k - (total - 1) / 2
        # motion along −z loads the row at +z of an O arrangement, along +z that of an X arrangement
        angle = elements.contact_angle * outward * (1.0 if place >= 0 else -1.0)
        common = (source.count, elements.diameter, elements.pitch_diameter, angle, gap)
        if section.rolling == "ball":
            grooves = elements.inner_groove, elements.outer_groove
            inner, outer = (ratio * elements.diameter for ratio in grooves)
            rows.append(BallRow(*common, spacing * place, inner, outer, elements.tilt_arm))
        else:
            profile = _drops(elements, length), elements.edge_stress
            rows.append(RollerRow(*common, spacing * place, length, *profile))
    return tuple(rows)


def _drops(elements: RollingElements, length: float) -> tuple[float, ...]:
    """Profile drops P_k (n_s,), m: by how much a roller's radius is smaller in each lamina."""
    count = elements.laminae
    if elements.profile == "logarithmic":
        return standard_drops(elements.diameter, length, elements.contact_angle, count)
    if elements.profile == "straight":
        return (0.0,) * count
    place = np.abs((2 * np.arange(count) + 1) / count - 1)
    table = np.interp(place, np.linspace(0, 1, len(elements.drops)), elements.drops)
    return tuple(float(drop) for drop in table)


def dynamic_rating(row: Row, rows: int) -> float:
    """Basic dynamic load rating C, N, of a radial bearing of ``rows`` rows."""
    g, d, cos = row.gamma, 1e3 * row.diameter, math.cos(row.contact_angle)
    curved = (1 - g) / (1 + g)
    if isinstance(row, RollerRow):
        factor = 207.9 * LIFE_FACTOR_MATERIAL * g ** (2 / 9) * (1 - g) ** (29 / 27)
        factor *= (1 + g) ** -0.25 * (1 + (1.04 * curved ** (143 / 108)) ** 4.5) ** (-2 / 9)
        size = (rows * 1e3 * row.length * cos) ** (7 / 9) * row.count**0.75
        return float(1.1 * factor * size * d ** (29 / 27))
    factor = 145.3 * g**0.3 * (1 - g) ** 1.39 * (1 + g) ** (-1 / 3)
    factor *= (1 + (1.04 * curved**1.72) ** (10 / 3)) ** -0.3
    factor *= 0.90 / 0.95 if rows > 1 and not row.contact_angle else 1.0
    of_balls = 1.3 * d**1.8 if d <= 25.4 else 3.647 * d**1.4
    return float(factor * (rows * cos) ** 0.7 * row.count ** (2 / 3) * of_balls)


def static_rating(row: Row, rows: int) -> float:
    """Basic static load rating C_0, N, of a bearing of ``rows`` rows."""
    elements = rows * row.count * math.cos(row.contact_angle)
    if isinstance(row, RollerRow):
        return float(44e6 * (1 - row.gamma) * elements * row.length * row.diameter)
    assert isinstance(row, BallRow)
    unit_pressure = max(float(contact.pressure(1.0)) for contact in row.contacts)  # load ~ p³
    return elements / 5 * (STATIC_PRESSURE / unit_pressure) ** 3 * (row.young / STATIC_YOUNG) ** 2


def fatigue_load_limit(row: Row, static: float) -> float:
    """Fatigue load limit C_u, N, from the static load rating C_0, N."""
    size = max(10 * row.pitch_diameter, 1.0)  # D_pw over 100 mm
    return static / 8.2 / size**0.3 if isinstance(row, RollerRow) else static / 22 / size**0.5
