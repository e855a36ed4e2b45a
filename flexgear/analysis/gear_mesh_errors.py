"""Errors of gear meshes at many angles, as the rows of their tooth pairs hold them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.compiled import UNCOUNTED, njit
from flexgear.coupling.kernels.elements import packed, pair_rows
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.pair_data import PairData

Array = NDArray[np.float64]


def gear_mesh_errors(pairs: PairData, theta: Array) -> Array:
    """Error less gap (p, M), m, of gear meshes that have one row each, at angles theta (p, A)."""
    out = np.zeros((len(theta), len(pairs.s0)))
    every = np.ones(len(pairs.s0), dtype=np.int64)
    _read_offsets(packed(pairs), np.ascontiguousarray(theta), every, pair_rows(pairs), out)
    return out


@njit(**UNCOUNTED)
def _read_offsets(elements, theta, active_flanks, rows, out):
    for p in range(theta.shape[0]):
        n, _, _ = fill_rows(elements, theta[p], active_flanks, rows)
        for i in range(n):
            row = rows.row[i]
            if row.kind >= 0:
                out[p, row.owner] = row.offset
