"""Compiled loops over samples: loads that are noted where they are solved for, forces and errors of
rows at many angles, laws of all force elements over a period.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.compiled import INNER, UNCOUNTED, njit
from flexgear.coupling.kernels.elements import add_to_blocks
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.pair_data import PairData, extra_rows, two_rows


class PairLoads(NamedTuple):
    """t samples of M gear meshes, see ``Solution``; a slot without a pair stays as it was made."""

    pair_load: Array  # (t, M, slots) N
    pair_tooth: NDArray[np.int16]  # (t, M, slots) of the gear, 0-based; −1 none
    pair_stiffness: Array  # (t, M, slots) N/m
    pair_position: Array  # (t, M, slots) path coordinate, m
    far_load: Array  # (t, M, slots) N, of a pair's second row; without length where none has two
    pair_approach: Array  # (t, M, slots, 4) m, likewise: δ of both rows, and of the bodies alone
    support_load: Array  # (t, extra rows) N


def empty_pair_loads(data: PairData, count: int) -> PairLoads:
    """Room for so many samples, without pairs."""
    shape = (count, len(data.s0), data.slots)
    load, stiffness, position = np.zeros((3, *shape))
    return PairLoads(
        pair_load=load,
        pair_tooth=np.full(shape, -1, dtype=np.int16),
        pair_stiffness=stiffness,
        pair_position=position,
        far_load=np.zeros(two_rows(data, count)),
        pair_approach=np.zeros((*two_rows(data, count), 4)),
        support_load=np.zeros((count, extra_rows(data))),
    )


@njit(**INNER)
def note_loads(rows, n, pairs, force, delta, at, loads):
    """Note forces (≥ n,) and δ (≥ n,) of n rows with so many tooth pairs as sample ``at``."""
    for q in range(pairs):
        pair = rows.pair[q]
        m, slot, first = pair.gear_mesh, pair.slot, pair.row
        loads.pair_load[at, m, slot] = pair.share * force[first]
        if pair.rows == 2:
            loads.far_load[at, m, slot] = force[first + 1]
            loads.pair_load[at, m, slot] += force[first + 1]
            for a in range(2):
                approach = delta[first + a]
                loads.pair_approach[at, m, slot, a] = approach
                loads.pair_approach[at, m, slot, 2 + a] = approach - rows.row[first + a].offset
        loads.pair_tooth[at, m, slot] = pair.tooth
        loads.pair_stiffness[at, m, slot] = pair.stiffness
        loads.pair_position[at, m, slot] = pair.s
    for i in range(n):
        if rows.row[i].kind < 0:
            loads.support_load[at, rows.row[i].owner] = force[i]


@njit(**UNCOUNTED)
def all_forces(elements, rows, angles, active_flanks, loads, out):
    """Generalised contact forces −Σ V F on the blocks, which ``out`` (t, n_c) starts with, from
    stored loads: of pairs (t, M, slots) N, what of it their second rows carry (t, M, slots), or
    (t, 0, slots) where none has two, and of other rows (t, extra rows) N. ``out`` is overwritten.
    """
    pair_load, far_load, other_load = loads
    for t in range(angles.shape[0]):
        forces = out[t]
        n, _, pairs = fill_rows(elements, angles[t], active_flanks[t], rows)
        for c in range(forces.shape[0]):
            forces[c] = 0.0
        for q in range(pairs):  # loads of pairs that share a row add up to its force
            pair = rows.pair[q]
            load = pair_load[t, pair.gear_mesh, pair.slot]
            if pair.rows == 2:
                far = far_load[t, pair.gear_mesh, pair.slot]
                add_to_blocks(rows, pair.row + 1, -far, forces)
                load -= far
            add_to_blocks(rows, pair.row, -load, forces)
        for r in range(n):
            if rows.row[r].kind < 0:
                add_to_blocks(rows, r, -other_load[t, rows.row[r].owner], forces)


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
