"""Slopes of profile and helix, and twist: planes about the middle of the flank.

    profile slope   g = C (ξ − 1/2)      C_Hα: C/2 missing at the tip, C/2 left at the root end
    helix slope     g = C ζ              C_Hβ: C/2 missing at the +z end, C/2 left at the −z end
    twist           g = S (ξ − 1/2) ζ    S_α: the profile slope is S ζ, the helix slope S (ξ − 1/2)

ξ and ζ as in ``flank``. The middle of the flank stays, so a slope alone moves no pair along its
path on the mean. C > 0 takes material off where z is larger on any flank of any gear, external or
internal. ISO 1328-1 counts f_Hα positive where material is left at the tip: f_Hα = −C there.
"""

from __future__ import annotations

import numpy as np

from flexgear.gears.modifications.flank import Array, Flank, Gap
from flexgear.model.modifications import FlankModifications


def profile_slope(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m, ≥ −|C|/2 on the active profile; None without a slope."""
    amount = modifications.profile_slope
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        return np.asarray(amount * (flank.height(rho) - 0.5) + 0.0 * z)

    return gap


def helix_slope(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m, ≥ −|C|/2; None without a slope."""
    amount = modifications.helix_slope
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        return np.asarray(amount * flank.width(z) + 0.0 * rho)

    return gap


def twist(modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m, ≥ −|S|/4 on the active profile; None without twist."""
    amount = modifications.twist
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        return np.asarray(amount * (flank.height(rho) - 0.5) * flank.width(z))

    return gap
