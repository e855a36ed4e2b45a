"""Rolling bearings: basic rating life (ISO 281) and estimated radial stiffness.

Basic rating life:

    L₁₀ = (C/P)^p million revolutions,  L₁₀ₕ = L₁₀ · 2π/|ω| / 3600,

C is the basic dynamic load rating, P the equivalent load (``equivalent_load``), p = 3 for ball and
10/3 for roller bearings, ω the speed of the inner ring against the outer ring. A planet bearing
turns at the speed of the planet relative to the carrier and carries the forces of both gear meshes:
2 F_t where the tangential forces at ring and sun are equal.

P is the constant load that does the same damage as the loads: the nominal force of the power flow
in ``check``, ``compare`` and ``sweep``, the loads of all positions in ``run``, the load of the one
position in ``static``.

The radial stiffness of a roller bearing is estimated from its load and the width of the gear, by
Palmgren's line contact δ = 7.68e-5 Q^0.9 / l^0.8 (mm, N) of the most loaded roller with
Q = 4.08 F/(Z rows): tangent dF/dδ = F/(0.9 δ). Source: Harris, Rolling Bearing Analysis.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from flexgear.gears.bearings.equivalent_load import equivalent_load
from flexgear.model.bearings import Rolling

BALL = 3.0
ROLLER = 10.0 / 3.0
EXPONENTS = {"ball": BALL, "roller": ROLLER}


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
