"""Errors of gear meshes at many angles, as the rows of their tooth pairs hold them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.rows_at_angles import read_offsets
from flexgear.coupling.kernels.elements import packed, pair_rows
from flexgear.coupling.pair_data import PairData

Array = NDArray[np.float64]


def gear_mesh_errors(pairs: PairData, theta: Array) -> Array:
    """Error less gap (p, M), m, of gear meshes that have one row each, at angles theta (p, A)."""
    out = np.zeros((len(theta), len(pairs.s0)))
    every = np.ones(len(pairs.s0), dtype=np.int64)
    read_offsets(packed(pairs), np.ascontiguousarray(theta), every, pair_rows(pairs), out)
    return out
