"""Channels at hand: lines of action and the blocks in contact, copied side by side.

First comes the *head*, for good: the P ports, and three channels a gear mesh along its line of
action, which stand for the bodies whose contact vectors do not change (``action_lines.py``). Of
hundreds of tooth nodes only a few are in contact at a time. Their rows of modes and receptances
follow in contiguous *slots*, which later steps find again: those of bodies that rows touch by
other than lines, for good, then teeth as they come into contact. A tooth that has left keeps its
slot until another one needs it, and at least one step, which energy accounts look back over.
Products of contact rows then run over short contiguous lines of numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from flexgear.analysis.contact_matrix import ContactWork, contact_work
from flexgear.analysis.near_products import LINE, whole_lines
from flexgear.analysis.step_arrays import StepData
from flexgear.analysis.wide import aligned
from flexgear.coupling.action_lines import covered
from flexgear.coupling.compiled import INNER, INTO
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import SLOTS, PairData

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
HEAD = np.int64(-1)  # instead of a slot


class Near(NamedTuple):
    """Work space; C near channels: P ports, 3 a gear mesh, then 6 a slot.

    Blocks and modes of *groups* do not move one another (ring and train, where they meet in gear
    meshes only): a group has slots in a row, and products leave out what is zero.
    """

    slot: IntArray  # (n_blocks,) slot of a block, −1 none
    group: IntArray  # (n_blocks,) its group
    block: IntArray  # (S,) block of a slot, −1 none
    seen: IntArray  # (S,) step at which a slot was last in contact
    fresh: IntArray  # (S,) slots filled at this step
    filled: IntArray  # (L, S) whether ``displacement`` holds the block of a slot
    counts: IntArray  # (6,) slots filled at this step, number of the step, channels in use, rows
    # with blocks beyond their lines, lines up to the last in use, tick of the next look at backs
    first: IntArray  # (G,) first slot of a group
    used: IntArray  # (G,) slots in use
    linked: IntArray  # (G,) 1 where ports or lines of action move with the group
    low: IntArray  # (G,) first channel of a group
    high: IntArray  # (G,) one past the last in use
    span: IntArray  # (3,) rigid modes, and the range of elastic modes that move the head
    rigid: IntArray  # (G,) rigid modes it moves in: all or none
    elastic: IntArray  # (G, 2) range of its elastic modes; all three in whole cache lines
    modes: Array  # (C, n), n in whole cache lines
    shapes: Array  # (n, C) the same the other way
    displacement: Array  # (L, C, C) receptance of a step of each size
    residual: Array  # (C, C)
    at: IntArray  # (R, B) first channel of each block of a row beyond its line
    part: IntArray  # (R, B) group of each such block
    order: NDArray[np.uint64]  # (R,) rows with such blocks, by their first channels
    since: IntArray  # (R,) first slot channel that the row and those after it touch, in cache lines
    reach: IntArray  # (R,) one past the last
    line: Array  # (C,) work
    line_2: Array  # (C,) work
    free: Array  # (C,) motion without contact forces
    rate: Array  # (C,) and its rate
    forces: Array  # (C,) of the last step
    motion: Array  # (C,) of the last step, where it was asked for
    contact: ContactWork  # of the contact matrix


def head_size(modal: ModalSystem) -> int:
    """Ports and lines of action, in whole cache lines."""
    return whole_lines(len(modal.system.ports) + 3 * len(modal.system.pairs.s0))


def whole_ranges(rigid: int, first: int, last: int) -> tuple[int, int, int]:
    """Rigid modes and a range of elastic ones in whole cache lines that do not overlap.

    What is added moves nothing.
    """
    rigid = whole_lines(rigid)
    first = max(first - first % LINE, rigid)
    return rigid, first, max(whole_lines(last), first)


def near_channels(modal: ModalSystem, rows: int, width: int, sizes: int = 1) -> Near:
    """Work space for a system, so many rows of so many blocks, and so many step sizes.

    Slots of teeth are empty.
    """
    pairs = modal.system.pairs
    blocks, head = len(modal.system.blocks) // 6, head_size(modal)
    teeth, others, lined = touched_blocks(pairs, blocks)
    group, rigid, elastic = groups(modal, teeth)
    held = [np.flatnonzero(others & (group == g)) for g in range(len(rigid))]
    # twice the teeth in contact at once: those of the last step stay
    room = [
        min(
            int((teeth & (group == g)).sum()),
            2 * SLOTS * int((pairs.per_tooth * (group[pairs.gear_block] == g)).sum()),
        )
        for g in range(len(rigid))
    ]
    # channels of a group begin with a cache line
    rooms = [whole_lines(len(h) + r) for h, r in zip(held, room, strict=True)]
    first = np.concatenate([[0], np.cumsum(rooms)])
    slots = int(first[-1])
    slot = np.full(blocks, -1, dtype=np.int64)
    block = np.full(slots, -1, dtype=np.int64)
    seen = np.full(slots, -2, dtype=np.int64)
    for g, own in enumerate(held):
        at = slice(first[g], first[g] + len(own))
        slot[own], block[at] = np.arange(at.start, at.stop), own
        seen[at] = np.iinfo(np.int64).max
    channels = head + 6 * slots
    channels += LINE * (channels // LINE % 2 == 0)  # an odd number of them: their sets all differ
    modes = whole_lines(modal.modes.shape[1])
    used = np.array([len(h) for h in held], dtype=np.int64)
    low = head + 6 * first[:-1].astype(np.int64)
    span = np.array(whole_ranges(*head_span(modal, lined)), dtype=np.int64)
    ranges = [whole_ranges(r, *e) for r, e in zip(rigid, elastic, strict=True)]
    return Near(
        slot=slot,
        group=group,
        block=block,
        seen=seen,
        fresh=np.zeros(slots, dtype=np.int64),
        filled=np.zeros((sizes, slots), dtype=np.int64),
        counts=np.zeros(6, dtype=np.int64),
        first=first[:-1].astype(np.int64),
        used=used,
        linked=linked_groups(modal, group, lined, len(rigid)),
        low=low,
        high=low + 6 * used,
        span=span,
        rigid=np.array([r for r, _, _ in ranges], dtype=np.int64),
        elastic=np.array([e for _, *e in ranges], dtype=np.int64).reshape(-1, 2),
        modes=aligned(channels, modes),
        shapes=aligned(modes, channels),
        displacement=aligned(sizes, channels, channels),
        residual=aligned(channels, channels),
        at=np.zeros((rows, width), dtype=np.int64),
        part=np.zeros((rows, width), dtype=np.int64),
        order=np.zeros(rows, dtype=np.uint64),
        since=np.zeros(rows, dtype=np.int64),
        reach=np.zeros(rows, dtype=np.int64),
        line=aligned(channels),
        line_2=aligned(channels),
        free=aligned(channels),
        rate=aligned(channels),
        forces=aligned(channels),
        motion=aligned(channels),
        contact=contact_work(len(pairs.s0), rows, width, channels),
    )


def head_span(modal: ModalSystem, lined: NDArray[np.bool_]) -> IntArray:
    """(3,) number of rigid modes, first and one past the last elastic mode that moves the head."""
    r, blocks = modal.rigid_count, 6 * len(lined)
    moving = np.vstack(
        [modal.channel_modes[:blocks][np.repeat(lined, 6)], modal.channel_modes[blocks:]]
    )
    at = np.flatnonzero(moving[:, r:].any(axis=0)) + r
    return np.array([r, at[0], at[-1] + 1] if len(at) else [r, r, r], dtype=np.int64)


def groups(modal: ModalSystem, teeth: NDArray[np.bool_]) -> tuple[IntArray, IntArray, IntArray]:
    """Group of every block (n_blocks,), those without teeth first, and modes of the groups.

    Elastic modes of a group must stand in a row; where they do not, all is one group.
    """
    n, r = modal.modes.shape[1], modal.rigid_count
    blocks = len(modal.channels) // 6
    moves = np.abs(modal.channel_modes[: 6 * blocks]).reshape(blocks, 6, n).max(axis=1) > 0
    known = (modal.residual[: 6 * blocks, : 6 * blocks] != 0).reshape(blocks, 6, 6 * blocks)
    known = known.any(axis=1).reshape(blocks, blocks, 6).any(axis=2)
    linked = (moves.astype(float) @ moves.T.astype(float) > 0) | known
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


def linked_groups(
    modal: ModalSystem, group: IntArray, lined: NDArray[np.bool_], count: int
) -> IntArray:
    """(G,) 1 where blocks of a group are on lines of action, or move with a port."""
    n = 6 * len(group)
    shared = np.abs(modal.channel_modes[:n]) @ np.abs(modal.channel_modes[n:]).T
    moved = (shared + np.abs(modal.residual[:n, n:]) > 0).any(axis=1).reshape(-1, 6).any(axis=1)
    with_head = lined | moved
    return np.array([(with_head & (group == g)).any() for g in range(count)], dtype=np.int64)


def touched_blocks(
    pairs: PairData, blocks: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """(n_blocks,) each: one tooth of a gear; others that rows touch; those that lines move."""
    teeth, others, lined = (np.zeros(blocks, dtype=bool) for _ in range(3))
    gears = covered(pairs) == 2
    lined[pairs.planet_block] = True
    lined[pairs.gear_block[gears]] = True
    for m in np.flatnonzero(~gears):
        end = pairs.gear_teeth[m] if pairs.per_tooth[m] else 1
        of = teeth if pairs.per_tooth[m] else others
        of[pairs.gear_block[m] : pairs.gear_block[m] + end] = True
    for several in (pairs.support_block, pairs.clearance_block, pairs.load_block):
        others[several[several >= 0]] = True
    return teeth, others & ~teeth, lined


def begin(near: Near, data: StepData) -> None:
    """Fill the head and every slot in use; receptances of slots when a step needs them."""
    near.filled[:] = 0
    near.contact.known[:], near.counts[5] = -1, 0
    head, source = data.head, len(data.channel_modes) - data.head
    slots = np.concatenate([f + np.arange(u) for f, u in zip(near.first, near.used, strict=True)])
    own = (head + 6 * slots[:, None] + np.arange(6)).ravel()
    blocks = (6 * near.block[slots][:, None] + np.arange(6)).ravel()
    here = np.concatenate([np.arange(head), own])
    there = np.concatenate([np.arange(source, source + head), blocks])
    n = data.channel_modes.shape[1]
    near.modes[here, :n] = data.channel_modes[there]
    near.shapes[:n, here] = data.channel_modes[there].T
    near.displacement[: len(data.h), :head, :head] = data.displacement[:, source:, source:]
    near.residual[np.ix_(here, here)] = data.residual[np.ix_(there, there)]
    near.high[:] = near.low + 6 * near.used
    near.counts[2] = max([head, *near.high[near.used > 0]])


@njit(**INNER)
def _copy(target, source, near_block, s, t, head):
    """The part of a channel matrix between slots s and t, both ways; −1 stands for the head."""
    first = source.shape[0] - head
    rows, columns = (head if s < 0 else 6), (head if t < 0 else 6)
    c, g = (0, first) if s < 0 else (head + 6 * s, 6 * near_block[s])
    d, h = (0, first) if t < 0 else (head + 6 * t, 6 * near_block[t])
    for p in range(rows):
        for q in range(columns):
            target[c + p, d + q] = source[g + p, h + q]
            target[d + q, c + p] = source[h + q, g + p]


@njit(**INNER)
def _copy_slot(target, source, near_block, first, used, linked, s, g, head):
    """The part of a channel matrix between slot s of group g and all in use that it moves."""
    if linked[g] == 1:
        _copy(target, source, near_block, s, HEAD, head)
    for t in range(first[g], first[g] + used[g]):
        _copy(target, source, near_block, s, t, head)


@njit(**INNER)
def _copy_modes(near, channel_modes, c, source):
    """Modes of one near channel, both ways."""
    for j in range(channel_modes.shape[1]):
        near.modes[c, j] = channel_modes[source, j]
        near.shapes[j, c] = channel_modes[source, j]


@njit(**INNER)
def _extent(near, head):
    """Channels in use."""
    top = head
    for g in range(near.first.shape[0]):
        near.high[g] = near.low[g] + 6 * near.used[g]
        if near.used[g] > 0:
            top = max(top, near.high[g])
    near.counts[2] = top


@njit(**INTO)
def fill_rung(near, rung, displacement, head):
    """Bring the receptance of a step size (n_c, n_c) up to date with the slots in use."""
    for g in range(near.first.shape[0]):
        for s in range(near.first[g], near.first[g] + near.used[g]):
            if near.filled[rung, s] == 0:
                near.filled[rung, s] = 1
                _copy_slot(
                    near.displacement[rung], displacement, near.block, near.first, near.used,
                    near.linked, s, g, head,
                )  # fmt: skip


@njit(**INNER)
def _places(near, line, blocks, width, beyond, n, head, now):
    """Where rows are: at, part, order, since, reach; whether every block has a slot."""
    whole = True
    wide = lines = 0
    for i in range(n):
        lines = max(lines, line[i] + 1)
        if beyond[i] == width[i]:
            continue
        begin, end = near.modes.shape[0], 0
        for a in range(beyond[i], width[i]):
            b = blocks[i, a]
            s = near.slot[b]
            if s < 0:
                whole = False
                continue
            c = head + 6 * s
            near.seen[s] = max(near.seen[s], now)
            near.at[i, a], near.part[i, a] = c, near.group[b]
            begin, end = min(begin, c - c % LINE), max(end, c + 6 + -(c + 6) % LINE)
        p = wide
        while p > 0 and near.since[p - 1] > begin:
            near.order[p], near.since[p] = near.order[p - 1], near.since[p - 1]
            near.reach[p] = near.reach[p - 1]
            p -= 1
        near.order[p], near.since[p], near.reach[p] = i, begin, end
        wide += 1
    for p in range(wide - 2, -1, -1):
        near.reach[p] = max(near.reach[p], near.reach[p + 1])
    near.counts[3], near.counts[4] = wide, lines
    return whole


@njit(**INTO)
def place_rows(near, line, blocks, width, beyond, n, channel_modes, residual, head):
    """Slots for blocks of rows (n) beyond their lines, and where they are. Fills new slots.

    ``near.order`` lists the rows that have such blocks by the first channel of their own, so that
    what one of them and those after it touch is short: ``since`` … ``reach``.
    ``near.fresh`` lists the slots that were filled.
    """
    near.counts[0] = 0
    near.counts[1] += 1
    now = near.counts[1]
    if _places(near, line, blocks, width, beyond, n, head, now):
        return
    for i in range(n):
        for a in range(beyond[i], width[i]):
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
                c = head + 6 * s
                for p in range(6):
                    near.forces[c + p] = 0.0
                    _copy_modes(near, channel_modes, c + p, 6 * b + p)
                _copy_slot(
                    near.residual, residual, near.block, near.first, near.used, near.linked, s, g,
                    head,
                )  # fmt: skip
    _extent(near, head)
    _places(near, line, blocks, width, beyond, n, head, now)


@njit(**INNER)
def spread(near, values, head, out):
    """Values of slots in use to the places of their blocks in all channels, out (n_c,)."""
    for s in range(near.block.shape[0]):
        b, c = 6 * near.block[s], head + 6 * s
        if b >= 0:
            for p in range(6):
                out[b + p] = values[c + p]
