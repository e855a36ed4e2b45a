"""Crowning: a parabola over the active profile, or over the face.

    profile   g = C (2 ξ − 1)²     lead   g = C (2 ζ)²

ξ and ζ as in ``flank``: nothing at the middle, C = C_α or C_β at both ends. Beyond the ends, where
tips touch off the path or a planet's flank meets its other mate, the parabola goes on.
"""

from __future__ import annotations

import numpy as np

from flexgear.gears.modifications.flank import Array, Flank, Gap
from flexgear.model.modifications import FlankModifications


def profile_crowning(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m; None without profile crowning."""
    amount = modifications.profile_crowning
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        return np.asarray(amount * (2.0 * flank.height(rho) - 1.0) ** 2 + 0.0 * z)

    return gap


def lead_crowning(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m; None without lead crowning."""
    amount = modifications.lead_crowning
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        return np.asarray(amount * (2.0 * flank.width(z)) ** 2 + 0.0 * rho)

    return gap
