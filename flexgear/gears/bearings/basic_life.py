"""Rolling bearings: basic rating life (ISO 281) and estimated radial stiffness.

Basic rating life of rolling bearings (ISO 281) and its ratio between trains.

    L₁₀ = (C/P)^p million revolutions,  L₁₀ₕ = L₁₀ · 2π/|ω| / 3600,

C the basic dynamic load rating, P the equivalent load (``equivalent_load``), p = 3 for ball and
10/3 for roller bearings, ω the speed of the inner against the outer ring. A planet's bearing turns
with the planet's speed relative to the carrier and carries both of its gear meshes: 2 F_t where
the tangential forces of ring and sun mesh are equal. Between trains with the same bearing C drops
out: L/L' = (ω'/ω) (P'/P)^p.

P is the constant load of the same damage over a window: the nominal force of the power flow where
nothing is solved (``check``, ``compare``, ``sweep``), the loads over the positions of equilibria in
``run``, the load of the position itself in ``static``.

Radial stiffness of a roller bearing, estimated from its load and the room that it has.

Palmgren's line contact δ = 7.68e-5 Q^0.9 / l^0.8 (mm, N) of the most loaded roller with
Q = 4.08 F/(Z rows): tangent dF/dδ = F/(0.9 δ). Source: Harris, Rolling Bearing Analysis.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from flexgear.gears.bearings.equivalent_load import equivalent_load

if TYPE_CHECKING:
    from flexgear.gears.power_flow import PowerFlow
    from flexgear.model.bearings import Rolling


BALL = 3.0
ROLLER = 10.0 / 3.0
EXPONENTS = {"ball": BALL, "roller": ROLLER}


def rating_life(dynamic_rating: float, load: float, exponent: float = ROLLER) -> float:
    """L₁₀ in revolutions; inf without load. dynamic_rating, load N."""
    return math.inf if load == 0 else 1e6 * (dynamic_rating / abs(load)) ** exponent


def rating_life_hours(
    dynamic_rating: float, load: float, speed: float, exponent: float = ROLLER
) -> float:
    """L₁₀ₕ in hours at a speed in rad/s; inf at zero speed."""
    life = rating_life(dynamic_rating, load, exponent)
    return math.inf if speed == 0 else life * 2 * math.pi / abs(speed) / 3600


def planet_bearing_life_ratios(
    flow: PowerFlow, reference: PowerFlow, exponent: float = ROLLER
) -> dict[str, float]:
    """Life of each stage's planet bearings over that in ``reference``, for stages of one name.

    Parallel stages have no planet bearing, and those without load or at rest no life to compare.
    """
    states = [
        {s.name: (s.planet_bearing_force, s.planet_relative_speed)
         for s in each.stages if s.kind == "planetary"}
        for each in (flow, reference)
    ]  # fmt: skip
    return {
        name: rating_life_hours(1.0, load, speed, exponent)
        / rating_life_hours(1.0, *states[1][name], exponent)
        for name, (load, speed) in states[0].items()
        if load and speed and name in states[1] and all(states[1][name])
    }


def bearing_life_hours(
    bearing: Rolling, radial: ArrayLike, speed: float, axial: ArrayLike = 0.0
) -> float | None:
    """L₁₀ₕ of a bearing under loads (n,), N, at a speed in rad/s: that of the constant equivalent
    load of the same damage. Bearings side by side share each load evenly; None without a dynamic
    rating, inf at rest or without load."""
    if bearing.dynamic_rating is None or bearing.rolling is None:
        return None
    exponent = EXPONENTS[bearing.rolling]
    load = varying_load(equivalent_load(bearing, radial, axial), exponent) / bearing.count
    return rating_life_hours(bearing.dynamic_rating, load, speed, exponent)


def varying_load(loads: ArrayLike, exponent: float) -> float:
    """Constant load of the same life, P_m = (mean P^p)^(1/p), N, of loads (n,) N that act for
    equally many revolutions each (linear damage: Palmgren 1924, Miner 1945)."""
    size = np.abs(np.asarray(loads, dtype=float))
    most = float(size.max())
    return most * float(np.mean((size / most) ** exponent)) ** (1 / exponent) if most else 0.0


ROLLERS, ROWS = 16, 2
LENGTH = 0.35  # of a roller over the width of the gear


def roller_bearing_stiffness(load: float, width: float) -> float:
    """N/m, under a radial load, N, of two rows of 16 rollers as long as 0.35 of ``width``, m."""
    most = 4.08 * load / (ROLLERS * ROWS)
    deflection = 7.68e-5 * most**0.9 / (LENGTH * width * 1e3) ** 0.8 * 1e-3
    return load / (0.9 * deflection)
