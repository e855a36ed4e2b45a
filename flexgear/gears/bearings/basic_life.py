"""Rolling bearings: equivalent loads (ISO 281, ISO 76), basic rating life, estimated stiffness.

Basic rating life:

    L₁₀ = (C/P)^p million revolutions,  L₁₀ₕ = L₁₀ · 2π/|ω| / 3600,

C is the basic dynamic load rating, P the equivalent load, p = 3 for ball and
10/3 for roller bearings, ω the speed of the inner ring against the outer ring. A planet bearing
turns at the speed of the planet relative to the carrier and carries the forces of both gear meshes:
2 F_t where the tangential forces at ring and sun are equal.

P is the constant load that does the same damage as the loads: the nominal force of the power flow
in ``check``, ``compare`` and ``sweep``, the loads of all positions in ``run``, the load of the one
position in ``static``.

The radial stiffness of a roller bearing is estimated from its load and the width of the gear, by
Palmgren's line contact δ = 7.68e-5 Q^0.9 / l^0.8 (mm, N) of the most loaded roller with
Q = 4.08 F/(Z rows): tangent dF/dδ = F/(0.9 δ). Source: Harris, Rolling Bearing Analysis.

Equivalent loads:

    P = F_r + Y_1 F_a where F_a <= e F_r,   P = X F_r + Y F_a beyond,
    P_0 = max(X_0 F_r + Y_0 F_a, F_r)

with factors of the key ``thrust``, or by its contact angle α. Rollers in one row (in two rows):

    e = 1.5 tan α,  Y_1 = 0 (0.45 cot α),  X = 0.4 (0.67),  Y = 0.4 cot α (0.67 cot α),
    X_0 = 0.5 (1),  Y_0 = 0.22 cot α (0.44 cot α)

and balls by tables with linear interpolation: over α, or for α = 0 over f_0 F_a/C_0 of one bearing.
Two single rows without preload that take the thrust K of their shaft in opposite directions load
each other, as the radial load on one induces thrust S on it, which the other one returns:

    F_a = max(S, S' + K),  S = F_r/(2 Y) of rollers, e F_r of balls

with K > 0 towards the bearing, S' of the other one. Sources: ISO 281:2007, table 3 (balls) and
table 8 (rollers); P_0: ISO 76:2006; pairs: catalogues of bearing manufacturers.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexgear.arrays import Array
from flexgear.model.bearings import Rolling, Springs

BALL = 3.0
ROLLER = 10.0 / 3.0
EXPONENTS = {"ball": BALL, "roller": ROLLER}
_RELATIVE = (0.172, 0.345, 0.689, 1.03, 1.38, 2.07, 3.45, 5.17, 6.89)  # f_0 F_a/C_0, α = 0
_E_RELATIVE = (0.19, 0.22, 0.26, 0.28, 0.30, 0.34, 0.38, 0.42, 0.44)
_Y_RELATIVE = (2.30, 1.99, 1.71, 1.55, 1.45, 1.31, 1.15, 1.04, 1.00)
_ANGLES = (20, 25, 30, 35, 40, 45)  # degrees
_E = (0.57, 0.68, 0.80, 0.95, 1.14, 1.34)
_Y_0 = (0.42, 0.38, 0.33, 0.29, 0.26, 0.22)  # of one row; of two 2 Y_0
_BALLS = {  # by rows: X, Y, Y_1
    1: ((0.43, 0.41, 0.39, 0.37, 0.35, 0.33), (1.00, 0.87, 0.76, 0.66, 0.57, 0.50), (0.0,) * 6),
    2: (
        (0.70, 0.67, 0.63, 0.60, 0.57, 0.54),
        (1.63, 1.41, 1.24, 1.07, 0.93, 0.81),
        (1.09, 0.92, 0.78, 0.66, 0.55, 0.47),
    ),
}
LEAST_E = 0.19  # of the tables; less axial load than this fraction of the radial load has no effect


class ThrustFactors(NamedTuple):
    """Factors of P and P_0, one for all loads or (n,); x_0, y_0: None if unknown."""

    e: float | Array
    x: float
    y: float | Array
    y_1: float
    x_0: float | None
    y_0: float | None


def thrust_factors(bearing: Rolling, axial: Array) -> ThrustFactors | None:
    """e, X, Y, Y_1, X_0 and Y_0 of a bearing under axial loads (n,), N; None if axial loads have no
    effect on its life."""
    thrust = bearing.thrust
    if thrust is None:
        return None
    angle, two = thrust.contact_angle, thrust.rows == 2
    if angle is None:
        assert thrust.e is not None and thrust.x is not None and thrust.y is not None
        return ThrustFactors(thrust.e, thrust.x, thrust.y, thrust.y_1, thrust.x_0, thrust.y_0)
    if bearing.rolling == "roller":
        cot = 1.0 / math.tan(angle)
        if two:
            return ThrustFactors(1.5 / cot, 0.67, 0.67 * cot, 0.45 * cot, 1.0, 0.44 * cot)
        return ThrustFactors(1.5 / cot, 0.4, 0.4 * cot, 0.0, 0.5, 0.22 * cot)
    if angle == 0.0:
        assert bearing.static_rating is not None and thrust.calculation_factor is not None
        relative = thrust.calculation_factor * axial / bearing.static_rating
        limit, slope = (np.interp(relative, _RELATIVE, row) for row in (_E_RELATIVE, _Y_RELATIVE))
        return ThrustFactors(limit, 0.56, slope, 0.0, 0.6, 0.5)
    rows = (_E, *_BALLS[thrust.rows], _Y_0)
    e, x, y, y_1, y_0 = (float(np.interp(math.degrees(angle), _ANGLES, row)) for row in rows)
    return ThrustFactors(e, x, y, y_1, 0.5 * thrust.rows, y_0 * thrust.rows)


def equivalent_load(bearing: Rolling, radial: ArrayLike, axial: ArrayLike = 0.0) -> Array:
    """Equivalent dynamic load P (n,), N, of all bearings side by side, which share loads evenly.

    radial, axial: loads (n,) or one for all, N; P is the radial load if axial ones have no effect.
    """
    radial_size, axial_size = _sizes(radial, axial)
    factors = thrust_factors(bearing, axial_size / bearing.count)
    if factors is None:
        return radial_size
    below = axial_size <= factors.e * radial_size
    beyond = factors.x * radial_size + factors.y * axial_size
    return np.where(below, radial_size + factors.y_1 * axial_size, beyond)


def moment_force(bearing: Springs, moment: float, arm: float = 0.0) -> float:
    """F_M = M/(2 a), N: radial force of a moment, N m, on each half of the bearings at ±a, whose
    stiffness against tilting is k_t = k_r a²; arm: a where none is stated, m, 0 leaves M out."""
    radial, tilt = bearing.stiffness[0], bearing.stiffness[3]
    arm = math.sqrt(tilt / radial) if radial and tilt else arm
    return moment / (2.0 * arm) if arm else 0.0


def static_load(bearing: Rolling, radial: ArrayLike, axial: ArrayLike = 0.0) -> Array:
    """Equivalent static load P_0 (n,), N; arguments as in ``equivalent_load``. NaN under axial load
    with unknown X_0 and Y_0."""
    radial_size, axial_size = _sizes(radial, axial)
    factors = thrust_factors(bearing, axial_size / bearing.count)
    if factors is None:
        return radial_size
    if factors.x_0 is None or factors.y_0 is None:
        return np.where(axial_size > 0.0, math.nan, radial_size)
    return np.maximum(factors.x_0 * radial_size + factors.y_0 * axial_size, radial_size)


def paired_force(bearing: Rolling, force: Array, mate: Rolling, mate_force: Array) -> Array:
    """Force (…, 3 or 6), N, on a bearing with ``thrust.direction``, with the thrust that the pair
    has in place of that of its springs. force, mate_force: by the springs of both."""
    assert bearing.thrust is not None
    sign = 1.0 if bearing.thrust.direction == "+z" else -1.0
    induced = []
    for each, load in ((bearing, force), (mate, mate_force)):
        factors = thrust_factors(each, np.zeros(1))
        assert factors is not None
        share = factors.e if each.rolling == "ball" else 0.5 / factors.y
        induced.append(share * np.hypot(load[..., 0], load[..., 1]))
    outside = sign * (force[..., 2] + mate_force[..., 2])
    paired = np.array(force, dtype=float)
    paired[..., 2] = sign * np.maximum(induced[0], induced[1] + outside)
    return paired


def _sizes(radial: ArrayLike, axial: ArrayLike) -> tuple[Array, Array]:
    """Absolute values of both loads, broadcast to one shape (n,)."""
    sizes = np.broadcast_arrays(np.abs(np.atleast_1d(radial)), np.abs(np.atleast_1d(axial)))
    return np.asarray(sizes[0], dtype=float), np.asarray(sizes[1], dtype=float)


def rating_life(dynamic_rating: float, load: float, exponent: float = ROLLER) -> float:
    """L₁₀, revolutions, of a bearing with dynamic_rating and load in N; inf without load."""
    return math.inf if load == 0 else 1e6 * (dynamic_rating / abs(load)) ** exponent


def rating_life_hours(
    dynamic_rating: float, load: float, speed: float, exponent: float = ROLLER
) -> float:
    """L₁₀ₕ, hours, with dynamic_rating and load in N, speed in rad/s; inf at zero speed."""
    life = rating_life(dynamic_rating, load, exponent)
    return math.inf if speed == 0 else life * 2 * math.pi / abs(speed) / 3600


def bearing_life_hours(
    bearing: Rolling, radial: ArrayLike, speed: float, axial: ArrayLike = 0.0
) -> float | None:
    """L₁₀ₕ of a bearing, hours, under radial and axial loads (n,), N, at a speed, rad/s.

    The loads act for equally many revolutions each (``varying_load`` of their equivalent loads);
    bearings side by side share each load evenly. None without a dynamic rating, inf at zero speed
    or without load.
    """
    if bearing.dynamic_rating is None or bearing.rolling is None:
        return None
    exponent = EXPONENTS[bearing.rolling]
    load = varying_load(equivalent_load(bearing, radial, axial), exponent) / bearing.count
    return rating_life_hours(bearing.dynamic_rating, load, speed, exponent)


def varying_load(loads: ArrayLike, exponent: float) -> float:
    """Constant load, N, that does the damage of loads (n,), N: P_m = (mean P^p)^(1/p). The loads
    act for equally many revolutions each (linear damage: Palmgren 1924, Miner 1945)."""
    size = np.abs(np.asarray(loads, dtype=float))
    largest = float(size.max())
    if largest == 0.0:
        return 0.0
    return largest * float(np.mean((size / largest) ** exponent)) ** (1 / exponent)


ROLLERS, ROWS = 16, 2
LENGTH_RATIO = 0.35  # length of a roller over width of the gear


def roller_bearing_stiffness(load: float, width: float) -> float:
    """Radial stiffness, N/m, of two rows of 16 rollers under a radial load, N. width: of the gear
    on the bearing, m; a roller is 0.35 times as long."""
    roller_load = 4.08 * load / (ROLLERS * ROWS)
    deflection = 7.68e-5 * roller_load**0.9 / (LENGTH_RATIO * width * 1e3) ** 0.8 * 1e-3
    return load / (0.9 * deflection)
