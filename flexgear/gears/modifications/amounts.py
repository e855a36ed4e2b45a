"""Modifications that are one amount C times a shape over the flank, g = C f(ξ, ζ).

    profile crowning   f = (2 ξ − 1)²    C_α at both ends of the active profile
    lead crowning      f = (2 ζ)²        C_β at both ends of the face
    profile slope      f = ξ − 1/2       C_Hα: C/2 missing at the tip, C/2 left at the root end
    helix slope        f = ζ             C_Hβ: C/2 missing at the +z end, C/2 left at the −z end
    twist              f = (ξ − 1/2) ζ   S_α: the profile slope is S ζ, the helix slope S (ξ − 1/2)

ξ and ζ as in ``flank``. Beyond the ends, where tips touch off the path or a planet's flank meets
its other mate, shapes go on. The middle of the flank stays, so that none of them alone moves a pair
along its path there. C > 0 takes material off where z is larger on any flank of any gear, external
or internal. ISO 1328-1 counts f_Hα positive where material is left at the tip: f_Hα = −C there.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.modifications.flank import Flank, Gap
from flexgear.model.modifications import FlankModifications

SHAPES: dict[str, Callable[[Array, Array], Array]] = {  # f(ξ, ζ) by key of the case
    "profile_crowning": lambda xi, zeta: (2.0 * xi - 1.0) ** 2,
    "profile_slope": lambda xi, zeta: xi - 0.5,
    "lead_crowning": lambda xi, zeta: (2.0 * zeta) ** 2,
    "helix_slope": lambda xi, zeta: zeta,
    "twist": lambda xi, zeta: (xi - 0.5) * zeta,
}


def of_amount(name: str, modifications: FlankModifications, flank: Flank) -> Gap | None:
    """Gap at rho and z (any shape), m; None without an amount of that key."""
    amount, shape = getattr(modifications, name), SHAPES[name]
    if not amount:
        return None

    def gap(rho: Array, z: Array) -> Array:
        xi, zeta = flank.height(rho), flank.width(z)
        return np.asarray(amount * shape(xi, zeta) + 0.0 * xi * zeta)

    return gap
