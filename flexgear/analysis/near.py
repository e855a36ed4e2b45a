"""Channels at hand: those of the blocks in contact, copied side by side.

Of hundreds of tooth nodes only a few are in contact at a time. Their rows of modes and receptances
stand in contiguous *slots*, which later steps find again: the ports come first, then the blocks
that are no teeth, for good, then teeth as they come into contact. A tooth that has left keeps its
slot until another one needs it, and at least one step, which energy accounts look back over.
Products of contact rows then run over short contiguous lines.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flexgear.analysis.lines import fill, put
from flexgear.coupling.compiled import INNER
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import SLOTS, PairData

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Near(NamedTuple):
    """Work space; C near channels, P ports first, then 6 a slot.

    Blocks and modes of *groups* do not move one another (ring and train, where they meet in gear
    meshes only): a group has slots in a row, and products leave out what is zero.
    """

    slot: IntArray  # (n_blocks,) slot of a block, −1 none
    group: IntArray  # (n_blocks,) its group
    block: IntArray  # (S,) block of a slot, −1 none
    seen: IntArray  # (S,) step at which a slot was last in contact
    fresh: IntArray  # (S,) slots filled at this step
    filled: IntArray  # (L, S) whether ``displacement`` holds the block of a slot
    counts: IntArray  # (2,) slots filled at this step, number of the step
    first: IntArray  # (G,) first slot of a group
    used: IntArray  # (G,) slots in use
    rigid: IntArray  # (G,) rigid modes it moves in: all or none
    elastic: IntArray  # (G, 2) range of its elastic modes
    modes: Array  # (C, n)
    displacement: Array  # (L, C, C) receptance of a step of each size
    residual: Array  # (C, C)
    at: IntArray  # (R, B) first channel of each block of a row
    part: IntArray  # (R, B) group of each block of a row
    reach: IntArray  # (R,) channels that rows from this one on touch
    image: Array  # (C, R) work
    line: Array  # (C,) work
    line_2: Array  # (C,) work
    free: Array  # (C,) motion without contact forces
    rate: Array  # (C,) and its rate
    forces: Array  # (C,) of the last step
    motion: Array  # (C,) of the last step, where it was asked for


def near_channels(modal: ModalSystem, rows: int, width: int, sizes: int = 1) -> Near:
    """Work space for a system, so many rows of so many blocks, and so many step sizes.

    Slots of teeth are empty.
    """
    pairs = modal.system.pairs
    blocks, ports = len(modal.system.blocks) // 6, len(modal.system.ports)
    teeth = tooth_blocks(pairs, blocks)
    group, rigid, elastic = groups(modal, teeth)
    held = [np.flatnonzero(~teeth & (group == g)) for g in range(len(rigid))]
    # twice the teeth in contact at once: those of the last step stay
    room = [
        min(
            int((teeth & (group == g)).sum()),
            2 * SLOTS * int((pairs.per_tooth * (group[pairs.gear_block] == g)).sum()),
        )
        for g in range(len(rigid))
    ]
    first = np.concatenate([[0], np.cumsum([len(h) + r for h, r in zip(held, room, strict=True)])])
    slots = int(first[-1])
    slot = np.full(blocks, -1, dtype=np.int64)
    block = np.full(slots, -1, dtype=np.int64)
    seen = np.full(slots, -2, dtype=np.int64)
    for g, own in enumerate(held):
        at = slice(first[g], first[g] + len(own))
        slot[own], block[at] = np.arange(at.start, at.stop), own
        seen[at] = np.iinfo(np.int64).max
    channels = ports + 6 * slots
    channels += -channels % 8  # whole cache lines, an odd number: their sets then all differ
    channels += 8 * (channels // 8 % 2 == 0)
    return Near(
        slot=slot,
        group=group,
        block=block,
        seen=seen,
        fresh=np.zeros(slots, dtype=np.int64),
        filled=np.zeros((sizes, slots), dtype=np.int64),
        counts=np.zeros(2, dtype=np.int64),
        first=first[:-1].astype(np.int64),
        used=np.array([len(h) for h in held], dtype=np.int64),
        rigid=rigid,
        elastic=elastic,
        modes=np.zeros((channels, modal.modes.shape[1])),
        displacement=np.zeros((sizes, channels, channels)),
        residual=np.zeros((channels, channels)),
        at=np.zeros((rows, width), dtype=np.int64),
        part=np.zeros((rows, width), dtype=np.int64),
        reach=np.zeros(rows, dtype=np.int64),
        image=np.zeros((channels, rows + -rows % 8)),
        line=np.zeros(channels),
        line_2=np.zeros(channels),
        free=np.zeros(channels),
        rate=np.zeros(channels),
        forces=np.zeros(channels),
        motion=np.zeros(channels),
    )


def groups(modal: ModalSystem, teeth: NDArray[np.bool_]) -> tuple[IntArray, IntArray, IntArray]:
    """Group of every block (n_blocks,), those without teeth first, and modes of the groups.

    Elastic modes of a group must stand in a row; where they do not, all is one group.
    """
    n, r = modal.modes.shape[1], modal.rigid_count
    blocks = len(modal.channels) // 6
    moves = np.abs(modal.channel_modes[: 6 * blocks]).reshape(blocks, 6, n).max(axis=1) > 0
    known = np.abs(modal.residual[: 6 * blocks, : 6 * blocks]).reshape(blocks, 6, blocks, 6)
    linked = (moves.astype(float) @ moves.T.astype(float) > 0) | (known.max(axis=(1, 3)) > 0)
    count, found = connected_components(linked, directed=False)
    order = sorted(range(count), key=lambda g: (bool(teeth[found == g].any()), g))
    ranges, rigid = [], []
    for g in order:
        mine = moves[found == g].any(axis=0)
        at = np.flatnonzero(mine[r:]) + r
        ranges.append((at[0], at[-1] + 1) if len(at) else (r, r))
        rigid.append(r if mine[:r].any() else 0)
        if len(at) and len(at) != at[-1] + 1 - at[0]:
            one = np.zeros(blocks, dtype=np.int64)
            return one, np.array([r], dtype=np.int64), np.array([[r, n]], dtype=np.int64)
    place = np.argsort(order)
    return place[found].astype(np.int64), np.array(rigid, np.int64), np.array(ranges, np.int64)


def tooth_blocks(pairs: PairData, blocks: int) -> NDArray[np.bool_]:
    """(n_blocks,) whether a block is one tooth of a gear."""
    out = np.zeros(blocks, dtype=bool)
    for m in np.flatnonzero(pairs.per_tooth):
        out[pairs.gear_block[m] : pairs.gear_block[m] + pairs.gear_teeth[m]] = True
    return out


@njit(**INNER)
def _copy(target, source, near_block, s, t, ports):
    """The part of a channel matrix between slots s and t, both ways; −1 stands for the ports."""
    first_port = source.shape[0] - ports
    rows, columns = (ports if s < 0 else 6), (ports if t < 0 else 6)
    c, g = (0, first_port) if s < 0 else (ports + 6 * s, 6 * near_block[s])
    d, h = (0, first_port) if t < 0 else (ports + 6 * t, 6 * near_block[t])
    for p in range(rows):
        for q in range(columns):
            target[c + p, d + q] = source[g + p, h + q]
            target[d + q, c + p] = source[h + q, g + p]


@njit(**INNER)
def _copy_slot(target, source, near_block, first, used, s, ports):
    """The part of a channel matrix between slot s and all in use."""
    _copy(target, source, near_block, s, -1, ports)
    for g in range(first.shape[0]):
        for t in range(first[g], first[g] + used[g]):
            _copy(target, source, near_block, s, t, ports)


@njit(**INNER)
def begin(near, channel_modes, displacement, residual, ports):
    """Fill the ports and every slot in use; receptances (L, n_c, n_c) of steps when they come."""
    for r in range(near.filled.shape[0]):
        fill(near.filled[r], 0)
    for t in range(ports):
        put(near.modes[t], channel_modes[channel_modes.shape[0] - ports + t])
    for r in range(displacement.shape[0]):
        _copy(near.displacement[r], displacement[r], near.block, -1, -1, ports)
    _copy(near.residual, residual, near.block, -1, -1, ports)
    for g in range(near.first.shape[0]):
        for s in range(near.first[g], near.first[g] + near.used[g]):
            c, b = ports + 6 * s, 6 * near.block[s]
            for p in range(6):
                put(near.modes[c + p], channel_modes[b + p])
            _copy_slot(near.residual, residual, near.block, near.first, near.used, s, ports)


@njit(**INNER)
def fill_rung(near, rung, displacement, ports):
    """Bring the receptance of a step size (n_c, n_c) up to date with the slots in use."""
    for g in range(near.first.shape[0]):
        for s in range(near.first[g], near.first[g] + near.used[g]):
            if near.filled[rung, s] == 0:
                near.filled[rung, s] = 1
                _copy_slot(
                    near.displacement[rung], displacement, near.block, near.first, near.used, s,
                    ports,
                )  # fmt: skip


@njit(**INNER)
def place_rows(near, blocks, width, n, channel_modes, residual, ports):
    """Slots for the blocks of rows (n), and where they are: at, part, reach. Fills new slots.

    ``near.fresh`` lists the slots that were filled.
    """
    near.counts[0] = 0
    near.counts[1] += 1
    now = near.counts[1]
    for i in range(n):
        for a in range(width[i]):
            s = near.slot[blocks[i, a]]
            if s >= 0 and near.seen[s] < now:
                near.seen[s] = now
    for i in range(n):
        for a in range(width[i]):
            b = blocks[i, a]
            if near.slot[b] < 0:
                g = near.group[b]
                s = near.first[g]
                while near.seen[s] >= now - 1:  # in contact now or at the step before
                    s += 1
                if near.block[s] >= 0:
                    near.slot[near.block[s]] = -1
                near.block[s], near.slot[b], near.seen[s] = b, s, now
                near.used[g] = max(near.used[g], s + 1 - near.first[g])
                near.fresh[near.counts[0]] = s
                near.counts[0] += 1
                for r in range(near.filled.shape[0]):
                    near.filled[r, s] = 0
                c = ports + 6 * s
                for p in range(6):
                    near.forces[c + p] = 0.0
                    put(near.modes[c + p], channel_modes[6 * b + p])
                _copy_slot(near.residual, residual, near.block, near.first, near.used, s, ports)
    reach = ports
    for i in range(n - 1, -1, -1):
        for a in range(width[i]):
            b = blocks[i, a]
            c = ports + 6 * near.slot[b]
            near.at[i, a] = c
            near.part[i, a] = near.group[b]
            reach = max(reach, c + 6)
        near.reach[i] = reach


@njit(**INNER)
def spread(near, values, ports, out):
    """Values of near channels to the places of all channels, out (n_c,)."""
    first_port = out.shape[0] - ports
    for t in range(ports):
        out[first_port + t] = values[t]
    for s in range(near.block.shape[0]):
        b, c = 6 * near.block[s], ports + 6 * s
        if b >= 0:
            for p in range(6):
                out[b + p] = values[c + p]
