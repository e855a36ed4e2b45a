"""Radial stiffness of a roller bearing, estimated from its load and the room that it has.

Palmgren's line contact δ = 7.68e-5 Q^0.9 / l^0.8 (mm, N) of the most loaded roller with
Q = 4.08 F/(Z rows): tangent dF/dδ = F/(0.9 δ). Source: Harris, Rolling Bearing Analysis.
"""

from __future__ import annotations

ROLLERS, ROWS = 16, 2
LENGTH = 0.35  # of a roller over the width of the gear


def roller_bearing_stiffness(load: float, width: float) -> float:
    """N/m, under a radial load, N, of two rows of 16 rollers as long as 0.35 of ``width``, m."""
    most = 4.08 * load / (ROLLERS * ROWS)
    deflection = 7.68e-5 * most**0.9 / (LENGTH * width * 1e3) ** 0.8 * 1e-3
    return load / (0.9 * deflection)
