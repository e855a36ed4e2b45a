"""Tooth loads by splitting the gear-mesh force in proportion to pair stiffness.

Tan et al. 2023, eq. 23, F_l = k_l ΣF / Σk: the estimate that the paper compares the dynamic tooth
loads with. As printed the factor k_l is missing; without it the parts would not add up to ΣF.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def stiffness_split(load: ArrayLike, stiffness: ArrayLike) -> NDArray[np.float64]:
    """F_l (..., slots) in N from pair loads and stiffnesses (..., slots); zero where Σk = 0."""
    f, k = np.asarray(load, dtype=float), np.asarray(stiffness, dtype=float)
    total = k.sum(axis=-1, keepdims=True)
    share = np.divide(k, total, out=np.zeros_like(k), where=total > 0)
    return np.asarray(share * f.sum(axis=-1, keepdims=True))
