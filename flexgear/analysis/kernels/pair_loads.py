"""Loads of tooth pairs and other rows over positions or time, noted where they are solved for."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.compiled import INNER, njit
from flexgear.coupling.pair_data import PairData, extra_rows, two_rows


class PairLoads(NamedTuple):
    """t samples of M gear meshes; a slot that holds no pair stays as it was made."""

    load: Array  # (t, M, slots) N
    tooth: NDArray[np.int16]  # (t, M, slots) of the gear, 0-based; −1 none
    stiffness: Array  # (t, M, slots) N/m
    position: Array  # (t, M, slots) path coordinate, m
    far: (
        Array  # (t, M, slots) load of a pair's second row, N, and its approach (t, M, slots, 4), m:
    )
    approach: Array  # δ of both rows, and of the bodies alone; without length where no pair has two
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
