"""Compiled loops over samples: saved loads of tooth pairs, forces and errors of rows at many
angles, laws of all force elements over a period."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.compiled import INNER, UNCOUNTED, njit
from flexgear.coupling.kernels.elements import add_to_blocks
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.pair_data import PairData, extra_rows, two_rows


class PairLoads(NamedTuple):
    """Loads of tooth pairs and supports over t samples, see ``Solution``."""

    pair_load: Array  # (t, M, slots) N
    pair_tooth: NDArray[np.int16]  # (t, M, slots) tooth of the gear from 0, −1 without a pair
    pair_stiffness: Array  # (t, M, slots) N/m
    pair_position: Array  # (t, M, slots) path coordinate, m
    far_load: Array  # (t, M, slots) N, of the second row of a pair; empty if no pair has two rows
    pair_approach: Array  # (t, M, slots, 4) m, δ of both rows, then by bodies alone; empty as above
    support_load: Array  # (t, r) N, of the rows of supports, bearings and loads


def empty_pair_loads(data: PairData, count: int) -> PairLoads:
    """Arrays for ``count`` samples, without pairs."""
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
    """Save the forces (≥ n,) and δ (≥ n,) of n rows of ``pairs`` tooth pairs as sample ``at``."""
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
    """Contact forces −Σ V F on the blocks, the first columns of ``out`` (t, n_c), which is
    overwritten. loads: ``pair_load``, ``far_load`` and ``support_load`` of ``PairLoads``."""
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
    """Write to ``out`` the error minus gap (p, M), m, of gear meshes with one row each."""
    for p in range(theta.shape[0]):
        n, _, _ = fill_rows(elements, theta[p], active_flanks, rows)
        for i in range(n):
            row = rows.row[i]
            if row.kind >= 0:
                out[p, row.owner] = row.offset


@njit(**UNCOUNTED)
def evaluate_laws(laws, elements, parameters, motion, force, tangent, space):
    """Forces and tangents of all elements at the motions of their rows.

    elements (E, 4): number of the law, sample, first row in the sample, number of rows; parameters
    (E, p): of the laws; motion (N, n, 2): δ, δ̇ of the rows at N samples; force (N, n) and tangent
    (2, N, n, n) are overwritten; space: for each number of rows r from 1, work arrays (2, r),
    (2, r), (2, r, r).
    """
    force[:], tangent[:] = 0.0, 0.0
    for e in range(elements.shape[0]):
        law, j, first, count = elements[e]
        element_motion, forces, slopes = space[count - 1]
        for a in range(count):
            element_motion[0, a] = motion[j, first + a, 0]
            element_motion[1, a] = motion[j, first + a, 1]
        laws[law](parameters[e], element_motion, forces, slopes)
        for a in range(count):
            force[j, first + a] = forces[0, a]
            for b in range(count):
                tangent[0, j, first + a, first + b] = slopes[0, a, b]
                tangent[1, j, first + a, first + b] = slopes[1, a, b]
