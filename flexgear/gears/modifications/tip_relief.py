"""Tip relief: g = C ((ℓ − x)/ℓ)^n at the distance x < ℓ from the tip on the path of contact.

C and ℓ: ``amount`` and ``length``; n = 1 for the linear form, 2 for the parabolic one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flexgear.model.section import Refusal

if TYPE_CHECKING:
    from flexgear.gears.modifications import Flank
    from flexgear.model.stage import Gear

Array = NDArray[np.float64]


def tip_relief(gear: Gear, flank: Flank) -> Callable[[Array, Array], Array] | None:
    """Gap at rho and z (any shape), m; None without relief. Refusal of a length beyond the path."""
    relief = gear.tip_relief
    if relief is None:
        return None
    path = abs(flank.tip - flank.root)
    if relief.length > path:
        raise Refusal(
            "tip_relief.length",
            f"{1e3 * relief.length:g} mm is longer than the path of contact, {1e3 * path:.4g} mm",
            "shorten it",
        )
    amount, length = relief.amount, relief.length
    power = {"linear": 1, "parabolic": 2}[relief.form]

    def gap(rho: Array, z: Array) -> Array:
        left = 1.0 - np.abs(rho - flank.tip) / length
        return np.asarray(amount * np.clip(left, 0.0, 1.0) ** power)

    return gap
