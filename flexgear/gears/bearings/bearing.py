"""A whole rolling bearing: rows side by side, equilibrium under a load, ratings of all rows.

The load (5,) is (F_x, F_y, F_z, M_x, M_y) at the middle of the bearing, the motion (5,) its
conjugate (x, y, z, r_x, r_y); see ``rows``. Equilibrium minimises Π = Σ energy(u) − load · u by
Newton's method, damped (Levenberg, Marquardt) so that Π falls, in unknowns that are scaled by the
approach which the load makes; without damping in the end, so that it converges as Newton's does.

The bearing that a case describes, with what its catalogue data leaves out estimated by rule.

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
         times (100/D_pw)^0.3 and (100/D_pw)^0.5 from D_pw = 100 mm on

in N and mm.
"""

from __future__ import annotations

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
from flexgear.gears.bearings.rows import (
    BallRow,
    RollerRow,
    Row,
    RowState,
    roller_stiffness,
    standard_drops,
)
from flexgear.model.bearings import Bearing, RollingElements
from flexgear.model.errors import FlexgearError

COMPONENTS = ("x", "y", "z", "rx", "ry")
FILM = {"a_ISO": "is 0.1 for a viscosity ratio below 0.1, where ISO 281 states none"}
CLOSURE = 1e-9  # of an equilibrium, over the load
ROUNDED_CLOSURE = 1e-5  # where rounding ends it: closings far below the distance of grooves
LEAST_DAMPING = 1e-14  # keeps the step finite where no element is loaded
ITERATIONS = 1000


@dataclass(frozen=True)
class RollingBearing:
    """rows: all of them along the axis, of equal bearings side by side if there are several;
    ratings: of one bearing. estimates: rules by which keys of the case were estimated; with any of
    them the figures of life and safety are to have no verdict."""

    rows: tuple[Row, ...]
    ratings: Ratings
    estimates: Mapping[str, str] = field(default_factory=dict)

    @property
    def of_rollers(self) -> bool:
        """Whether its elements are rollers."""
        return isinstance(self.rows[0], RollerRow)

    def states(self, motion: Array, first: float = 0.0) -> list[RowState]:
        """Loads of all rows at a motion (5,); first: angle of the first element, rad."""
        return [row.state(np.asarray(motion, dtype=float), first) for row in self.rows]


@dataclass(frozen=True)
class BearingRating:
    """motion: (5,), m and rad; rows: figures of every row; basic_life, modified_life: of all rows
    together, revolutions; static_safety: the least; estimates: those of the bearing that its
    figures rest on, and of the film."""

    motion: Array
    rows: tuple[RowRating, ...]
    basic_life: float
    modified_life: float | None
    static_safety: float | None
    estimates: Mapping[str, str]

    @property
    def pressure(self) -> float:
        """Largest of all rows, Pa."""
        return max(row.pressure for row in self.rows)


def direction(vector: Array) -> float:
    """Angle of the radial part of a load or motion (5,), rad, where the first element stands."""
    return math.atan2(vector[1], vector[0])


def equilibrium(
    bearing: RollingBearing,
    load: Array,
    held: Mapping[str, float] | None = None,
) -> Array:
    """Motion (5,) under a load (5,), N and N m, the first element under it.

    held: components whose motion is prescribed, m or rad, in place of their load. Cylindrical
    rollers cannot take a thrust: there z is held at 0 unless said. FlexgearError without
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

    def at(u: Array) -> tuple[float, Array, Array]:
        states = bearing.states(u, first)
        energy = sum(s.energy for s in states) - float(load @ (free * u))
        out_of_balance = np.sum([s.force for s in states], axis=0) - load
        tangent = scale[:, None] * np.sum([s.tangent for s in states], axis=0) * scale
        balance = (scale * out_of_balance)[free] / size
        return energy / size, balance, tangent[np.ix_(free, free)] / size

    damping, (potential, balance, tangent) = 1e-3, at(motion)
    for _ in range(ITERATIONS):
        if np.abs(balance).max(initial=0.0) < CLOSURE:
            return motion
        trial = motion.copy()
        damped = tangent + damping * np.eye(len(balance))
        trial[free] -= scale[free] * np.linalg.solve(damped, balance)
        trial_state = at(trial)
        if trial_state[0] <= potential + 1e-12 * abs(potential):
            motion, (potential, balance, tangent) = trial, trial_state
            damping = max(0.1 * damping, LEAST_DAMPING)
        else:
            damping *= 10
            if damping > 1 and np.abs(balance).max() < ROUNDED_CLOSURE:
                return motion
    why = "it can move freely"
    if len(bearing.rows) == 1 and bearing.rows[0].contact_angle:
        why = "one row slides along its contact angle unless thrust holds it; give both of its pair"
    raise FlexgearError(f"no equilibrium of the bearing under its load: {why}")


def _scale(bearing: RollingBearing, load: Array) -> Array:
    """Expected size of the motion (5,): approach of an element under the load, over an arm."""
    row = bearing.rows[0]
    arm = max(row.pitch_diameter / 2, *(abs(r.position) for r in bearing.rows))
    force = max(float(np.abs(load[:3]).max()), float(np.abs(load[3:]).max()) / arm, 1.0)
    each = 5 * force / (row.count * len(bearing.rows))
    stiffness = row.stiffness if isinstance(row, BallRow) else None
    if isinstance(row, RollerRow):
        stiffness = roller_stiffness(row.length)
    assert stiffness is not None
    approach = (each / stiffness) ** (1 / row.exponent)
    return approach * np.array([1, 1, 1, 1 / arm, 1 / arm])


def rate_motion(
    bearing: RollingBearing,
    motion: Array,
    stationary: Ring,
    lubrication: Lubrication | None = None,
    first: float | None = None,
) -> BearingRating:
    """Figures of all rows at a motion (5,).

    stationary: ring that is stationary relative to the load. first: angle of the first element,
    rad; where the motion is largest if left out.
    """
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
        estimates |= FILM
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
    """``rate_motion`` in ``equilibrium`` with a load (5,), the first element under it."""
    motion = equilibrium(bearing, load, held)
    return rate_motion(bearing, motion, stationary, lubrication, direction(np.asarray(load)))


LAMINAE = 30  # of a roller: the least number of the standard
ESTIMATES = {
    "dynamic_rating": "by ISO 281 from the size of the rolling elements",
    "static_rating": "by ISO 76 from the size of the rolling elements",
    "fatigue_load_limit": "by ISO 281, annex B, from the static rating",
}
STATIC_PRESSURE, STATIC_YOUNG = 4200e6, 207e9  # of balls at the static rating in ISO 76, Pa


def rolling_bearing(section: Bearing, laminae: int = LAMINAE) -> RollingBearing | str:
    """The bearing with all its rows, or why it cannot be rated."""
    elements = section.elements
    if elements is None:
        return "elements are missing (diameter, pitch_diameter, …)"
    rows = _rows(section, elements, laminae)
    first, each = rows[0], len(rows) // section.count
    dynamic = section.dynamic_rating or dynamic_rating(first, each)
    static = section.static_rating or static_rating(first, each)
    limit = section.fatigue_load_limit or fatigue_load_limit(first, static)
    estimates = {key: rule for key, rule in ESTIMATES.items() if getattr(section, key) is None}
    return RollingBearing(rows, Ratings(dynamic, static, limit, each), estimates)


def _rows(section: Bearing, elements: RollingElements, laminae: int) -> tuple[Row, ...]:
    """Rows of all bearings, from −z to +z."""
    source = section.rollers or elements
    total = section.rollers.rows if section.rollers else (elements.rows or 1) * section.count
    spacing, gap, length = source.spacing or 0.0, source.clearance or 0.0, source.length or 0.0
    assert source.count is not None
    outward = 1.0 if elements.arrangement == "X" or total == 1 else -1.0
    rows: list[Row] = []
    for k in range(total):
        place = k - (total - 1) / 2
        # rows at +z whose contact lines meet outside are loaded by motion along −z
        angle = elements.contact_angle * outward * (1.0 if place >= 0 else -1.0)
        common = (source.count, elements.diameter, elements.pitch_diameter, angle, gap)
        if section.rolling == "ball":
            grooves = elements.inner_groove, elements.outer_groove
            inner, outer = (ratio * elements.diameter for ratio in grooves)
            rows.append(BallRow(*common, spacing * place, inner, outer))
        else:
            drops = _drops(elements, length, laminae)
            edge_stress = elements.edge_stress
            rows.append(RollerRow(*common, spacing * place, length, drops, edge_stress))
    return tuple(rows)


def _drops(elements: RollingElements, length: float, laminae: int) -> tuple[float, ...]:
    """P_k of the laminae, m."""
    if elements.profile == "logarithmic":
        return standard_drops(elements.diameter, length, elements.contact_angle, laminae)
    if elements.profile == "straight":
        return (0.0,) * laminae
    place = np.abs((2 * np.arange(laminae) + 1) / laminae - 1)
    table = np.interp(place, np.linspace(0, 1, len(elements.drops)), elements.drops)
    return tuple(float(drop) for drop in table)


def dynamic_rating(row: Row, rows: int) -> float:
    """C, N, of a radial bearing of ``rows`` rows."""
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
    """C_0, N, of a bearing of ``rows`` rows."""
    elements = rows * row.count * math.cos(row.contact_angle)
    if isinstance(row, RollerRow):
        return float(44e6 * (1 - row.gamma) * elements * row.length * row.diameter)
    assert isinstance(row, BallRow)
    at_one = max(float(contact.pressure(1.0)) for contact in row.contacts)  # p³ grows with load
    return elements / 5 * (STATIC_PRESSURE / at_one) ** 3 * (row.young / STATIC_YOUNG) ** 2


def fatigue_load_limit(row: Row, static: float) -> float:
    """C_u, N, from C_0, N."""
    size = max(10 * row.pitch_diameter, 1.0)  # D_pw over 100 mm
    return static / 8.2 / size**0.3 if isinstance(row, RollerRow) else static / 22 / size**0.5
