"""What a solution by sectors holds on its way; letters as in `solver.py`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(eq=False)
class Pass:
    """Intermediate results of a solution under k load vectors.

    pieces: for groups of neighbouring sectors, which these are and an array (i + 2b + t + v,
    sectors k) whose first i rows hold f; empty where there are no loads. d (t, z, k): D^{-1} (q_t -
    Z_t^T f). border (b, z, k): x_b. q0 (m, k): motion of the other ties while they are free. mu
    (m, k): forces in the other ties, with the sign reversed.
    """

    pieces: list[tuple[slice, Array]]
    d: Array
    border: Array
    q0: Array
    mu: Array


@dataclass(frozen=True, eq=False)
class UnevenTies:
    """Rows of the other ties that touch this sector but not every sector alike (bolts).

    at (r,): which of the m rows of all other ties they are; z (i, r): their columns of Z_o;
    e (t, r): their columns of E^T.
    """

    at: Ints
    z: Array
    e: Array
