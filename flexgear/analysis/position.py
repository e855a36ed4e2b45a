"""The contact problem of one position at rest: assembled, solved and checked by substitution.

Rows F = k (Vᵀ u + e) with u = P a + S f, the balance P_rᵀ f = 0 of the rigid motions and the given
rotations make one symmetric complementarity problem: loads of one-sided rows minimise a convex
energy, so any set of loaded rows that closes is the answer. It is looked for from the flanks that
carry the torque; where that ends in a set that holds nothing (backlash, errors beyond the load, no
load at all), by continuation: an open row keeps a share of its stiffness, which makes the answer
unique, and that share is lowered step by step. Where even the last set leaves a body loose, as at
rest between two flanks, the body stands where the smallest share leaves it: as near to touching
all its flanks as it can.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.analysis.contact import (
    local_blocks,
    refine_set,
    release,
    right_side,
    row_products,
    row_values,
    solve_set,
)
from flexgear.analysis.lines import dot, fill
from flexgear.coupling.compiled import INNER, ZERO
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.pair_data import LOAD, PairRows
from flexgear.coupling.pairs import build_rows

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
CLOSURE = 1e-8
LEAKS = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9)  # shares of their stiffness that open rows keep
PASSES = 1e-11  # of the largest force: pull or overlap that is rounding


class Held(NamedTuple):
    """What a train answers to forces on its channels at rest, its contact rows apart.

    rigid (n_c, r) motion of the channels in rigid motions; flexibility (n_c, n_c) m/N; master_rigid
    (F, r), master_flexibility (F, n_c): the given rotations; reactions (F,): ports whose torque is
    sought.
    """

    rigid: Array
    flexibility: Array
    master_rigid: Array
    master_flexibility: Array
    reactions: IntArray


class PositionWork(NamedTuple):
    """Work space of a position; matrix and right side stay after it is solved."""

    matrix: Array
    small: Array
    wide: Array
    right: Array
    delta: Array
    motion: Array  # (n_c,) of the channels at the solution
    place: IntArray
    blocks: IntArray
    active: IntArray  # 1 where a row is loaded
    forces: Array  # (n_c,) on the channels at the solution


def held(modal: ModalSystem) -> Held:
    """The train's answer at rest from its modes and residual flexibility."""
    system, r = modal.system, modal.rigid_count
    elastic, omega2 = slice(r, None), modal.omega[r:] ** 2
    follow = (modal.masters[:, elastic] / omega2) @ modal.channel_modes[:, elastic].T
    return Held(
        rigid=np.ascontiguousarray(modal.channel_modes[:, :r]),
        flexibility=np.ascontiguousarray(modal.static_receptance()),
        master_rigid=np.ascontiguousarray(modal.masters[:, :r]),
        master_flexibility=np.ascontiguousarray(follow + system.masters @ modal.residual_motion),
        reactions=system.reactions,
    )


def position_work(rows: PairRows, train: Held, ports: int) -> PositionWork:
    """Work space for a train with that many ports."""
    channels, r = train.rigid.shape
    size = len(rows.kind) + r + len(train.reactions) + 1
    size += -size % 8  # whole blocks of 8
    blocks = (channels - ports) // 6
    return PositionWork(
        matrix=np.zeros((size, size)),
        small=np.zeros((size, size)),
        wide=np.zeros(6 * blocks),
        right=np.zeros(size),
        delta=np.zeros(size),
        motion=np.zeros(channels),
        place=np.full(blocks, -1, dtype=np.int64),
        blocks=np.zeros(blocks, dtype=np.int64),
        active=np.zeros(size, dtype=np.int64),
        forces=np.zeros(channels),
    )


@njit(**INNER)
def _assemble(rows, n, known, train, work):
    """Matrix and right side of n rows, rigid motions and reactions under given torques (P,)."""
    matrix, right, flex = work.matrix, work.right, train.flexibility
    rigid, reactions = train.rigid, train.reactions
    r, ports, free = rigid.shape[1], known.shape[0], reactions.shape[0]
    first = flex.shape[0] - ports
    m = local_blocks(rows, n, work.place, work.blocks)
    row_products(rows, n, flex, work.place, work.blocks, work.wide, matrix)
    release(work.place, work.blocks, m)
    for i in range(n):
        k = rows.stiffness[i]
        for j in range(n):
            matrix[i, j] *= k
        matrix[i, i] += 1.0
        for e in range(r):
            total = 0.0
            for a in range(rows.width[i]):
                base = 6 * rows.blocks[i, a]
                for p in range(6):
                    total += rows.coef[i, a, p] * rigid[base + p, e]
            matrix[i, n + e] = -k * total
            matrix[n + e, i] = total
        pushed = 0.0
        for f in range(free):
            matrix[i, n + r + f] = 0.0
            matrix[n + r + f, i] = 0.0
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                c = rows.coef[i, a, p]
                for q in range(ports):
                    pushed += c * flex[first + q, base + p] * known[q]
                for f in range(free):
                    matrix[i, n + r + f] += k * c * flex[first + reactions[f], base + p]
                    matrix[n + r + f, i] -= c * train.master_flexibility[f, base + p]
        right[i] = right_side(rows, i, pushed, 0.0, 0.0)
    for e in range(r):
        for f in range(r):
            matrix[n + e, n + f] = 0.0
        right[n + e] = 0.0
        for q in range(ports):
            right[n + e] += rigid[first + q, e] * known[q]
        for f in range(free):
            matrix[n + e, n + r + f] = rigid[first + reactions[f], e]
            matrix[n + r + f, n + e] = train.master_rigid[f, e]
    for f in range(free):
        right[n + r + f] = 0.0
        for q in range(ports):
            right[n + r + f] -= train.master_flexibility[f, first + q] * known[q]
        for g in range(free):
            matrix[n + r + f, n + r + g] = -train.master_flexibility[f, first + reactions[g]]


@njit(**INNER)
def largest_of(values, n):
    """max |values[:n]|."""
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(values[i]))
    return largest


@njit(**INNER)
def follow_leak(matrix, right, sided, n, extra, active, work, x, exact):
    """Loaded rows by continuation: open rows keep less and less of their stiffness.

    exact: nothing at last, which has an answer only where contact holds every body. Returns the
    last share, or −1 without an answer.
    """
    last = -1.0
    for leak in LEAKS:
        least = PASSES * max(largest_of(right, n), largest_of(x, n) if last > 0.0 else 0.0)
        if solve_set(matrix, right, sided, n, extra, active, work, x, leak, least) < 0:
            return -1.0
        last = leak
    if exact:
        least = PASSES * max(largest_of(right, n), largest_of(x, n))
        if solve_set(matrix, right, sided, n, extra, active, work, x, 0.0, least) < 0:
            return -1.0
        last = 0.0
    return last


@njit(**INNER)
def _closure(rows, n, known, train, work, x):
    """Largest imbalance of a solution by substitution: channel forces, motion, pair law, balance.

    Over the largest load or, where that is more, what errors and gaps would load stiff bodies with.
    """
    rigid, flex, reactions = train.rigid, train.flexibility, train.reactions
    forces, motion, delta = work.forces, work.motion, work.delta
    nc, r, ports, free = flex.shape[0], rigid.shape[1], known.shape[0], reactions.shape[0]
    first = nc - ports
    fill(forces, 0.0)
    for i in range(n):
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                forces[base + p] -= x[i] * rows.coef[i, a, p]
    for q in range(ports):
        forces[first + q] = known[q]
    for f in range(free):
        forces[first + reactions[f]] -= x[n + r + f]
    for c in range(nc):
        motion[c] = dot(flex[c], forces)
        for e in range(r):
            motion[c] += rigid[c, e] * x[n + e]
    row_values(rows, n, motion, delta)
    largest, worst = 1e-300, 0.0
    for i in range(n):
        force = right_side(rows, i, delta[i], 0.0, 0.0)
        if rows.sided[i] == 1 and force < 0.0:
            force = 0.0
        largest = max(largest, abs(x[i]))
        if rows.kind[i] != LOAD:
            largest = max(largest, rows.stiffness[i] * abs(rows.offset[i]))
        worst = max(worst, abs(force - x[i]))
    closure = worst / largest
    left, scale = 0.0, 1e-300
    for e in range(r):
        balance, size = 0.0, 0.0
        for c in range(nc):
            balance += rigid[c, e] * forces[c]
            size = max(size, abs(rigid[c, e]) * max(abs(forces[c]), largest))
        left, scale = max(left, abs(balance)), max(scale, size)
    return max(closure, left / scale)


@njit(inline="always")
def solve_position(pairs, rows, theta, known, forward, wanted, train, work, out):
    """One position; returns (rows, pairs, closure), infinite without answer. out: x (n + r + F).

    known (P,): given torques on the ports; forward: the flanks of the rated torque carry; wanted
    (M,): gear meshes to look at, all of them where those that carry do not do.
    """
    extra = train.rigid.shape[1] + train.reactions.shape[0]
    n, n_pairs, closure = ZERO, ZERO, np.inf
    for attempt in range(3):
        if attempt == 1:
            fill(wanted, 1)
        if attempt < 2:
            n, n_pairs = build_rows(pairs, rows, theta, wanted)
            _assemble(rows, n, known, train, work)
        for i in range(n):
            work.active[i] = 1
            if rows.sided[i] == 1 and rows.kind[i] >= 0:
                work.active[i] = 1 if (pairs.front[rows.owner[i]] == 1) == forward else 0
        if attempt == 0:
            leak, none = 0.0, 0.0
            status = solve_set(
                work.matrix, work.right, rows.sided, n, extra, work.active, work.small, out, leak,
                none,
            )  # fmt: skip
            leak = leak if status >= 0 else -1.0
        else:
            leak = follow_leak(
                work.matrix, work.right, rows.sided, n, extra, work.active, work.small, out,
                attempt == 1,
            )  # fmt: skip
        if leak < 0.0:
            continue
        refine_set(
            work.matrix, work.right, n, extra, work.active, leak, work.small, work.delta, out
        )
        for i in range(n):
            if rows.sided[i] == 1 and (work.active[i] == 0 or out[i] < 0.0):
                out[i] = 0.0
        closure = _closure(rows, n, known, train, work, out)
        if closure <= CLOSURE:
            break
    return n, n_pairs, closure
