"""Compiled loops over samples: loads that are noted where they are solved for, forces and errors of
rows at many angles, laws of all force elements over a period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.compiled import INNER, UNCOUNTED, njit
from flexgear.coupling.kernels.pairs import contact_forces, fill_rows
from flexgear.coupling.pair_data import PairData, extra_rows, two_rows


class PairLoads(NamedTuple):
    """t samples of M gear meshes; a slot that holds no pair stays as it was made."""

    load: Array  # (t, M, slots) N
    tooth: NDArray[np.int16]  # (t, M, slots) of the gear, 0-based; −1 none
    stiffness: Array  # (t, M, slots) N/m
    position: Array  # (t, M, slots) path coordinate, m
    far: Array  # (t, M, slots) load of a pair's second row, N; without length where no pair has two
    approach: Array  # (t, M, slots, 4) m, likewise: δ of both rows, and of the bodies alone
    supports: Array  # (t, extra rows) N


def empty_pair_loads(data: PairData, count: int) -> PairLoads:
    """Room for so many samples, without pairs."""
    shape = (count, len(data.s0), data.slots)
    load, stiffness, position = np.zeros((3, *shape))
    return PairLoads(
        load=load,
        tooth=np.full(shape, -1, dtype=np.int16),
        stiffness=stiffness,
        position=position,
        far=np.zeros(two_rows(data, count)),
        approach=np.zeros((*two_rows(data, count), 4)),
        supports=np.zeros((count, extra_rows(data))),
    )


@njit(**INNER)
def note_loads(rows, n, pairs, force, delta, at, loads):
    """Note forces (≥ n,) and δ (≥ n,) of n rows with so many tooth pairs as sample ``at``."""
    for q in range(pairs):
        pair = rows.pair[q]
        m, slot, first = pair.mesh, pair.slot, pair.row
        loads.load[at, m, slot] = pair.share * force[first]
        if pair.rows == 2:
            loads.far[at, m, slot] = force[first + 1]
            loads.load[at, m, slot] += force[first + 1]
            for a in range(2):
                approach = delta[first + a]
                loads.approach[at, m, slot, a] = approach
                loads.approach[at, m, slot, 2 + a] = approach - rows.row[first + a].offset
        loads.tooth[at, m, slot] = pair.tooth
        loads.stiffness[at, m, slot] = pair.stiffness
        loads.position[at, m, slot] = pair.s
    for i in range(n):
        if rows.row[i].kind < 0:
            loads.supports[at, rows.row[i].owner] = force[i]


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


@njit(**UNCOUNTED)
def evaluate_laws(laws, elements, parameters, motion, force, tangent, space):
    """Forces and tangents at the motion of all rows.

    elements (E, 4): law, sample, first row there, rows; parameters (E, p); motion (N, n, 2): δ, δ̇
    of the rows of N samples; force (N, n) and tangent (2, N, n, n) are overwritten; space: work
    arrays (2, r), (2, r), (2, r, r) for elements of each number of rows r, from 1.
    """
    force[:], tangent[:] = 0.0, 0.0
    for e in range(elements.shape[0]):
        law, j, first, count = elements[e]
        at_element, answer, slopes = space[count - 1]
        for a in range(count):
            at_element[0, a], at_element[1, a] = motion[j, first + a, 0], motion[j, first + a, 1]
        laws[law](parameters[e], at_element, answer, slopes)
        for a in range(count):
            force[j, first + a] = answer[0, a]
            for b in range(count):
                tangent[0, j, first + a, first + b] = slopes[0, a, b]
                tangent[1, j, first + a, first + b] = slopes[1, a, b]
