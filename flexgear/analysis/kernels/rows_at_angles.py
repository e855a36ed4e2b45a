"""Rows of tooth pairs at many angles: their forces on the blocks, their errors."""

from __future__ import annotations

from flexgear.compiled import UNCOUNTED, njit
from flexgear.coupling.kernels.pairs import contact_forces, fill_rows


@njit(**UNCOUNTED)
def all_forces(elements, rows, angles, active_flanks, loads, out):
    """Forces of contact rows on the blocks; ``out`` (t, n_c) starts with them."""
    pair_load, far_load, other_load = loads
    for t in range(angles.shape[0]):
        loads_now = (pair_load[t], far_load[t], other_load[t])
        contact_forces(elements, rows, angles[t], active_flanks[t], loads_now, out[t])


@njit(**UNCOUNTED)
def read_offsets(elements, theta, active_flanks, rows, out):
    """Error less gap (p, M), m, of gear meshes that have one row each, into ``out``."""
    for p in range(theta.shape[0]):
        n, _, _ = fill_rows(elements, theta[p], active_flanks, rows)
        for i in range(n):
            row = rows.row[i]
            if row.kind >= 0:
                out[p, row.owner] = row.offset
