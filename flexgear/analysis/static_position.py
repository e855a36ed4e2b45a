"""The contact problem of one position at rest: assembled, solved and checked by substitution.

Rows F = k (Vᵀ u + e), or the linearised law of their element (``contact_newton``), with u = P a + S
f, the balance P_rᵀ f = 0 of the rigid motions and the given rotations make one symmetric
complementarity problem: loads of one-sided rows minimise a convex energy, so any set of loaded rows
that closes is the answer. It is looked for from the flanks that carry the torque; where that ends
in a set that holds nothing (backlash, errors beyond the load, no load at all), by continuation: an
open row keeps a share of its stiffness, which makes the answer unique, and that share is lowered
step by step. Where even the last set leaves a body loose, as at rest between two flanks, the body
stands where the smallest share leaves it: as near to touching all its flanks as it can.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.analysis.contact_newton import LawSpace, first_memory, law_space, start_guess
from flexgear.analysis.static_contact import (
    local_blocks,
    refine_set,
    release,
    row_products,
    row_values,
    solve_set,
)
from flexgear.analysis.vectors import dot, fill
from flexgear.coupling.compiled import INNER, PART, ZERO
from flexgear.coupling.elements import Elements, Rows, packed, pair_rows
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.neighbours import add_neighbours, yield_to_neighbours
from flexgear.coupling.pair_data import PairData
from flexgear.coupling.pairs import fill_rows

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
CLOSURE = 1e-8
LEAKS = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9)  # shares of their stiffness that open rows keep
PASSES = 1e-11  # of the largest force: pull or overlap that is rounding


class Held(NamedTuple):
    """What a train answers to forces on its channels at rest, its contact rows apart.

    rigid (n_c, r) motion of the channels in rigid motions; flexibility (n_c, n_c) m/N; input_rigid
    (F, r), input_flexibility (F, n_c): the given rotations; reactions (F,): ports whose torque is
    sought.
    """

    rigid: Array
    flexibility: Array
    input_rigid: Array
    input_flexibility: Array
    reactions: IntArray


class ContactSet(NamedTuple):
    """Matrix and right side of a position, which stay after it is solved, and its loaded rows."""

    matrix: Array  # (S, S) rows, then rigid motions, then reactions
    right: Array  # (S,)
    sided: IntArray  # (S,) 1 where a row can only push
    active: IntArray  # (S,) 1 where a row is loaded
    motion: Array  # (R, S): δ = δ* − motion @ x
    free: Array  # (R,) δ*
    small: Array  # (S, S) work
    spare: Array  # (S,) work


class PositionWork(NamedTuple):
    """Work space of a position."""

    elements: Elements
    rows: Rows
    contact: ContactSet
    space: LawSpace  # laws about the motion that they are linearised about
    memory: Array  # (places, 2, r) this motion
    delta: Array  # (2, R) δ at the solution, and no rate
    channels: Array  # (3, n_c) motion and forces at the solution, work
    local: tuple[IntArray, IntArray, IntArray]  # place, blocks, reach: see ``local_blocks``


def held(modal: ModalSystem) -> Held:
    """The train's answer at rest from its modes and residual flexibility."""
    system, r = modal.system, modal.rigid_count
    elastic, omega2 = slice(r, None), modal.omega[r:] ** 2
    follow = (modal.input_rows[:, elastic] / omega2) @ modal.channel_modes[:, elastic].T
    return Held(
        rigid=np.ascontiguousarray(modal.channel_modes[:, :r]),
        flexibility=np.ascontiguousarray(modal.static_receptance()),
        input_rigid=np.ascontiguousarray(modal.input_rows[:, :r]),
        input_flexibility=np.ascontiguousarray(follow + system.input_rows @ modal.residual_motion),
        reactions=system.reactions,
    )


def position_work(pairs: PairData, train: Held, ports: int) -> PositionWork:
    """Work space for a train with that many ports."""
    rows = pair_rows(pairs)
    channels, r = train.rigid.shape
    count, size = len(rows.row), len(rows.row) + r + len(train.reactions) + 1
    blocks = (channels - ports) // 6
    contact = ContactSet(
        matrix=np.zeros((size, size)),
        right=np.zeros(size),
        sided=np.zeros(size, dtype=np.int64),
        active=np.zeros(size, dtype=np.int64),
        motion=np.zeros((count, size)),
        free=np.zeros(count),
        small=np.zeros((size, size)),
        spare=np.zeros(size),
    )
    memory = first_memory(pairs)
    local = (np.full(blocks, -1, np.int64), np.zeros(blocks, np.int64), np.zeros(count, np.int64))
    return PositionWork(
        elements=packed(pairs),
        rows=rows,
        contact=contact,
        space=law_space(len(rows.element), memory.shape[2]),
        memory=memory,
        delta=np.zeros((2, count)),
        channels=np.zeros((3, channels)),
        local=local,
    )


@njit(**PART)
def _row_motions(n, known, train, work):
    """δ*, and δ* − δ of n rows under unit forces, rigid motions, reactions: see ``ContactSet``."""
    rows, motion, free = work.rows, work.contact.motion, work.contact.free
    flex, rigid, reactions = train.flexibility, train.rigid, train.reactions
    r, ports = rigid.shape[1], known.shape[0]
    first = flex.shape[0] - ports
    m = local_blocks(rows, n, work.local)
    row_products(rows, n, flex, work.local, work.channels[2], motion)
    add_neighbours(rows, n, motion)
    release(work.local, m)
    for i in range(n):
        free[i] = rows.row[i].offset
        fill(motion[i, n : n + r + reactions.shape[0]], 0.0)
        for a in range(rows.row[i].width):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                c = rows.coef[i, a, p]
                for e in range(r):
                    motion[i, n + e] -= c * rigid[base + p, e]
                for f in range(reactions.shape[0]):
                    motion[i, n + r + f] += c * flex[first + reactions[f], base + p]
                for q in range(ports):
                    free[i] += c * flex[first + q, base + p] * known[q]


@njit(**PART)
def _law_rows(n, count, total, work):
    """Rows of the matrix, F + K (motion @ x) = F₀ + K (δ* − δ₀), from the linearised laws."""
    rows, space, contact = work.rows, work.space, work.contact
    for e in range(count):
        element = rows.element[e]
        for a in range(element.rows):
            i = element.first + a
            line, right = contact.matrix[i], space.force[e, 0, a]
            fill(line[:total], 0.0)
            for b in range(element.rows):
                k, moved = space.tangent[e, 0, a, b], contact.motion[element.first + b]
                for j in range(total):
                    line[j] += k * moved[j]
                right += k * (contact.free[element.first + b] - space.motion[e, 0, b])
            line[i] += 1.0
            contact.right[i] = right
            contact.sided[i] = rows.row[i].sided


@njit(**PART)
def _balance_rows(n, known, train, work):
    """Rows of the matrix below: balance of rigid motions, and the given rotations."""
    matrix, right, motion = work.contact.matrix, work.contact.right, work.contact.motion
    rows, rigid, reactions = work.rows, train.rigid, train.reactions
    r, ports, free = rigid.shape[1], known.shape[0], reactions.shape[0]
    first = rigid.shape[0] - ports
    for i in range(n):
        for e in range(r):
            matrix[n + e, i] = -motion[i, n + e]
        for f in range(free):
            total = 0.0
            for a in range(rows.row[i].width):
                base = 6 * rows.blocks[i, a]
                for p in range(6):
                    total -= rows.coef[i, a, p] * train.input_flexibility[f, base + p]
            matrix[n + r + f, i] = total
    for e in range(r):
        for f in range(r):
            matrix[n + e, n + f] = 0.0
        right[n + e] = 0.0
        for q in range(ports):
            right[n + e] += rigid[first + q, e] * known[q]
        for f in range(free):
            matrix[n + e, n + r + f] = rigid[first + reactions[f], e]
            matrix[n + r + f, n + e] = train.input_rigid[f, e]
    for f in range(free):
        right[n + r + f] = 0.0
        for q in range(ports):
            right[n + r + f] -= train.input_flexibility[f, first + q] * known[q]
        for g in range(free):
            matrix[n + r + f, n + r + g] = -train.input_flexibility[f, first + reactions[g]]


@njit(**PART)
def _assemble(laws, n, count, known, train, work):
    """Matrix and right side of n rows, rigid motions and reactions under given torques (P,)."""
    total = n + train.rigid.shape[1] + train.reactions.shape[0]
    rows, memory, space = work.rows, work.memory, work.space
    start_guess(laws, rows, count, memory, space)
    _row_motions(n, known, train, work)
    _law_rows(n, count, total, work)
    _balance_rows(n, known, train, work)


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


@njit(**PART)
def _law_imbalance(count, rows, space, delta, x):
    """Largest difference of a force and its linearised law at the solution, and the largest load:
    of forces or, where that is more, what errors and gaps would load stiff bodies with. Not a
    number where one of them is none."""
    largest, worst, sound = 1e-300, 0.0, 0.0
    for e in range(count):
        element = rows.element[e]
        for a in range(element.rows):
            i = element.first + a
            row, force = rows.row[i], space.force[e, 0, a]
            for b in range(element.rows):
                way = delta[element.first + b] - space.motion[e, 0, b]
                force += space.tangent[e, 0, a, b] * way
            if row.sided == 1 and force < 0.0:
                force = 0.0
            largest = max(largest, abs(x[i]), row.stiffness * abs(row.offset))
            worst = max(worst, abs(force - x[i]))
            sound += 0.0 * (force - x[i])  # the larger of two passes over what is not a number
    return worst + sound, largest


@njit(**PART)
def _closure(n, count, known, train, work, x):
    """Largest imbalance of a solution by substitution: channel forces, motion, laws, balance.

    Over the largest load of ``_law_imbalance``.
    """
    rigid, flex, reactions, rows = train.rigid, train.flexibility, train.reactions, work.rows
    motion, forces, delta, space = work.channels[0], work.channels[1], work.delta[0], work.space
    nc, r, ports, free = flex.shape[0], rigid.shape[1], known.shape[0], reactions.shape[0]
    first = nc - ports
    fill(forces, 0.0)
    for i in range(n):
        for a in range(rows.row[i].width):
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
    for i in range(n):
        delta[i] += rows.row[i].offset
    yield_to_neighbours(rows, n, x, delta)
    worst, largest = _law_imbalance(count, rows, space, delta, x)
    left, scale, sound = 0.0, 1e-300, 0.0 * worst
    for e in range(r):
        balance, size = 0.0, 0.0
        for c in range(nc):
            balance += rigid[c, e] * forces[c]
            size = max(size, abs(rigid[c, e]) * max(abs(forces[c]), largest))
        left, scale = max(left, abs(balance)), max(scale, size)
        sound += 0.0 * balance
    return max(worst / largest, left / scale) + sound


@njit(**PART)
def _solve_set(n, extra, work, x, how):
    """Loaded rows of an assembled position; the share that open rows kept, −1 without answer.

    how: 0 all at once, 1 by continuation to the end, 2 to the smallest share.
    """
    c, none = work.contact, 0.0
    if how > 0:
        return follow_leak(c.matrix, c.right, c.sided, n, extra, c.active, c.small, x, how == 1)
    tries = solve_set(c.matrix, c.right, c.sided, n, extra, c.active, c.small, x, none, none)
    return none if tries >= 0 else -1.0


@njit(**INNER)
def solve_position(laws, theta, known, forward, active_flanks, train, work, out):
    """One position; returns (rows, elements, pairs, closure), infinite without answer. out: x
    (n + r + F).

    known (P,): given torques on the ports; forward: the flanks of the rated torque carry;
    active_flanks (M,): gear meshes to look at, all of them where those that carry do not do.
    """
    extra = train.rigid.shape[1] + train.reactions.shape[0]
    rows, contact, elements = work.rows, work.contact, work.elements
    meshes = elements.gears.mesh
    n, count, pairs, closure = ZERO, ZERO, ZERO, np.inf
    for attempt in range(3):
        if attempt == 1:
            fill(active_flanks, 1)
        if attempt < 2:
            n, count, pairs = fill_rows(elements, theta, active_flanks, rows)
            _assemble(laws, n, count, known, train, work)
        for i in range(n):
            contact.active[i] = 1
            if rows.row[i].sided == 1:
                carries = meshes[rows.row[i].owner].carries == 1
                contact.active[i] = 1 if carries == forward else 0
        leak = _solve_set(n, extra, work, out, attempt)
        if leak < 0.0:
            continue
        refine_set(
            contact.matrix, contact.right, n, extra, contact.active, leak, contact.small,
            contact.spare, out,
        )  # fmt: skip
        for i in range(n):
            if rows.row[i].sided == 1 and (contact.active[i] == 0 or out[i] < 0.0):
                out[i] = 0.0
        closure = _closure(n, count, known, train, work, out)
        if closure <= CLOSURE:
            break
    return n, count, pairs, closure
