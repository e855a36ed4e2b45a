"""How evenly planets share the load.

K = N max_i F_i / Σ F_i, spread = (max_i F_i − min_i F_i) / F_rated. K loses its meaning where
ΣF passes zero and is not a number below 3 % of rated ΣF.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
LEAST_SHARE = 0.03  # of rated ΣF, below which K is not evaluated


def load_sharing(force: ArrayLike, rated_mean_force: float) -> Array:
    """K (...,) of gear-mesh forces (..., N) in N; NaN where |ΣF| < 3 % of N · rated mean.

    Under reversed torque (ΣF < 0) the planet with the largest load of that sign counts.
    """
    f = np.asarray(force, dtype=float)
    planets = f.shape[-1]
    total = f.sum(axis=-1)
    largest = (f * np.sign(total)[..., None]).max(axis=-1)
    enough = np.abs(total) >= LEAST_SHARE * planets * abs(rated_mean_force)
    return np.divide(
        planets * largest, np.abs(total), out=np.full(total.shape, np.nan), where=enough
    )


def planet_force_spread(force: ArrayLike, rated_mean_force: float) -> Array:
    """(max − min) / rated mean (...,) of gear-mesh forces (..., N) in N; defined everywhere."""
    f = np.asarray(force, dtype=float)
    return np.asarray(np.ptp(f, axis=-1) / abs(rated_mean_force))
