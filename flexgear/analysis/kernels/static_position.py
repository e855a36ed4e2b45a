"""Static contact problems of positions: assembled, solved, and checked by substitution.

Rows F = k (Vᵀ u + e), or the linearised law of their element (``contact_newton``), with u = P a +
S f, the equilibrium P_rᵀ f = 0 of the rigid motions and the given rotations form a symmetric
complementarity problem. Loads of one-sided rows minimise a convex energy, so that any set of loaded
rows with a consistent solution is the right one. The first set are the flanks that carry the
torque. Where it leads to a singular problem (backlash, errors beyond the load, no load) the set is
found by continuation: open rows keep a share of their stiffness, which makes the solution unique,
and the share is reduced in steps. Where the last set still leaves a body free, as between two
flanks without load, the solution with the smallest share is used: the body is as near to touching
all its flanks as possible, and forces of the remaining stiffness, which move a floating sun, are
removed at this position. Each position is solved again until its coast flanks and nonlinear laws
are consistent with the solution.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.coast_flanks import look_at_rest
from flexgear.analysis.kernels.contact_newton import (
    TOLERANCE,
    TOUCHING,
    LawSpace,
    disagree,
    first_memory,
    law_space,
    start_guess,
)
from flexgear.analysis.kernels.samples import note_loads
from flexgear.analysis.kernels.static_contact import (
    EXACT,
    LOOSE,
    SOFTEST,
    ContactSet,
    block_motions,
    local_blocks,
    refine_set,
    release,
    row_products,
    solve_set,
)
from flexgear.analysis.kernels.vectors import dot, fill, put
from flexgear.arrays import Array, Ints
from flexgear.compiled import FAST, INNER, PART, UNCOUNTED, ZERO, njit
from flexgear.coupling.kernels.elements import (
    Elements,
    Rows,
    add_neighbours,
    add_to_blocks,
    freeze_neighbours,
    of_blocks,
    packed,
    pair_rows,
    yield_to_neighbours,
)
from flexgear.coupling.kernels.pairs import fill_rows
from flexgear.coupling.pair_data import PairData

CLOSURE = 1e-8  # largest residual of an equilibrium over its load


class Held(NamedTuple):
    """Static behaviour of a train without its contact rows, under forces f on its channels.

    Beside the row forces there are x unknowns: r amplitudes a of the rigid motions P, then the F
    torques T_o of the reaction ports. They move the channels by P a − S e_o T_o; equilibrium and
    given rotations require Pᵀ f = 0 and input_rows · q = 0.
    """

    flexibility: Array  # (n_c, n_c) S, m/N
    motions: Array  # (n_c, x) motions of the channels by the unknowns
    balance: Array  # (n_c, x) P, then −input_rows · q per unit force on a channel, transposed
    corner: Array  # (x, x) coefficients of the unknowns in equilibrium and given rotations
    reactions: Ints  # (F,) ports whose torque is unknown


class PositionWork(NamedTuple):
    """Work space of a position."""

    elements: Elements
    rows: Rows
    contact: ContactSet
    space: LawSpace  # linearised laws
    memory: Array  # (places, 2, r) motion about which they are linearised
    delta: Array  # (2, R) δ of the solution, and zero rate
    channels: Array  # (3, n_c) of the solution: motion of the loaded blocks, forces; work space
    local: tuple[Ints, Ints, Ints]  # place, blocks, reach: see ``local_blocks``


def position_work(pairs: PairData, train: Held, ports: int, rates: Array) -> PositionWork:
    """Work space of a train's positions; ports: their number; rates (6 B,): motions of the blocks
    in rigid rotation of the train."""
    rows = pair_rows(pairs)
    channels, extra = train.motions.shape
    count, size = len(rows.row), len(rows.row) + extra + 1
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
    memory = first_memory(pairs, rates)
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


@njit(**INNER)
def _row_motions(n, port_torques, train, work):
    """Compute in ``work.contact`` δ* of n rows under given torques (P,), N·m, and δ* − δ under unit
    row forces."""
    rows, flex, motion = work.rows, train.flexibility, work.channels[0]
    first = flex.shape[0] - port_torques.shape[0]
    m = local_blocks(rows, n, work.local)
    row_products(rows, n, flex, work.local, work.channels[2], work.contact.motion)
    add_neighbours(rows, n, work.contact.motion)
    for b in work.local[1][:m]:
        for c in range(6 * b, 6 * b + 6):
            motion[c] = dot(port_torques, flex[c, first:])
    release(work.local, m)
    for i in range(n):
        work.contact.free[i] = of_blocks(rows, i, motion) + rows.row[i].offset


@njit(**INNER)
def _extra_unknowns(n, port_torques, train, work):
    """Compute the columns of rigid motions and reactions in the rows' motion; and equilibrium and
    given rotations as matrix rows after the first n, with their right side."""
    rows, contact, motions, balance = work.rows, work.contact, train.motions, train.balance
    extra, first = motions.shape[1], motions.shape[0] - port_torques.shape[0]
    for i in range(n):
        for e in range(extra):
            column, below = 0.0, 0.0
            for a in range(rows.row[i].width):
                base = 6 * rows.blocks[i, a]
                for p in range(6):
                    column -= rows.coef[i, a, p] * motions[base + p, e]
                    below += rows.coef[i, a, p] * balance[base + p, e]
            contact.motion[i, n + e] = column
            contact.matrix[n + e, i] = below
    for e in range(extra):
        put(contact.matrix[n + e, n : n + extra], train.corner[e])
        contact.right[n + e] = 0.0
        for q in range(port_torques.shape[0]):
            contact.right[n + e] += balance[first + q, e] * port_torques[q]


@njit(**INNER)
def _law_rows(n, count, total, work):
    """Compute the matrix rows F + K (motion · x) = F₀ + K (δ* − δ₀) from the linearised laws."""
    rows, space, contact = work.rows, work.space, work.contact
    for e in range(count):
        element = rows.element[e]
        for a in range(element.rows):
            i = element.first + a
            equation, right = contact.matrix[i], space.force[e, 0, a]
            fill(equation[:total], 0.0)
            for b in range(element.rows):
                k, closing = space.tangent[e, 0, a, b], contact.motion[element.first + b]
                for j in range(total):
                    equation[j] += k * closing[j]
                right += k * (contact.free[element.first + b] - space.motion[e, 0, b])
            equation[i] += 1.0
            contact.right[i] = right
            contact.sided[i] = rows.row[i].sided


@njit(**INNER)
def _law_imbalance(count, rows, space, delta, x):
    """Largest difference between a force of the solution and its linearised law, N, and the largest
    of all forces and of stiffness times error or gap of all rows, N. NaN where a force is NaN."""
    largest, worst, nan_if_any = 1e-300, 0.0, 0.0
    for e in range(count):
        element = rows.element[e]
        for a in range(element.rows):
            i = element.first + a
            row, force = rows.row[i], space.force[e, 0, a]
            for b in range(element.rows):
                change = delta[element.first + b] - space.motion[e, 0, b]
                force += space.tangent[e, 0, a, b] * change
            if row.sided == 1 and force < 0.0:
                force = 0.0
            largest = max(largest, abs(x[i]), row.stiffness * abs(row.offset))
            worst = max(worst, abs(force - x[i]))
            nan_if_any += 0.0 * (force - x[i])  # max() ignores NaN
    return worst + nan_if_any, largest


@njit(**INNER)
def _closure(n, count, port_torques, train, work, x):
    """Largest residual of a solution in laws and equilibrium, by substitution, over the largest
    load of ``_law_imbalance``."""
    balance, reactions, rows = train.balance, train.reactions, work.rows
    motion, forces, delta, space = work.channels[0], work.channels[1], work.delta[0], work.space
    nc, ports, free = balance.shape[0], port_torques.shape[0], reactions.shape[0]
    first, r = nc - ports, balance.shape[1] - free
    fill(forces, 0.0)
    for i in range(n):
        add_to_blocks(rows, i, -x[i], forces)
    for q in range(ports):
        forces[first + q] = port_torques[q]
    for f in range(free):
        forces[first + reactions[f]] -= x[n + r + f]
    block_motions(rows, n, work.local, train, x[n : n + r], work.channels)
    for i in range(n):
        delta[i] = of_blocks(rows, i, motion) + rows.row[i].offset
    yield_to_neighbours(rows, n, x, delta)
    worst, largest = _law_imbalance(count, rows, space, delta, x)
    left, scale, nan_if_any = 0.0, 1e-300, 0.0 * worst
    for e in range(r):
        total, size = 0.0, 0.0
        for c in range(nc):
            total += balance[c, e] * forces[c]
            size = max(size, abs(balance[c, e]) * max(abs(forces[c]), largest))
        left, scale = max(left, abs(total)), max(scale, size)
        nan_if_any += 0.0 * total
    return max(worst / largest, left / scale) + nan_if_any


@njit(**PART)
def solve_position(laws, theta, port_torques, forward, active_flanks, train, work, out):
    """Solve one position; returns the numbers of rows, elements and pairs, and the closure,
    infinite without a solution. out: x (n + r + F,).

    port_torques (P,): given torques on the ports, N·m; forward: whether the flanks of the rated
    torque carry; active_flanks (M,): flanks in the problem, set to all flanks where the given ones
    have no solution.
    """
    extra = train.motions.shape[1]
    rows, contact, memory, elements = work.rows, work.contact, work.memory, work.elements
    gear_meshes = elements.gears.gear_mesh
    n, count, pairs, closure = ZERO, ZERO, ZERO, np.inf
    for attempt in range(3):
        if attempt == 1:
            fill(active_flanks, 1)
        if attempt < 2:
            n, count, pairs = fill_rows(elements, theta, active_flanks, rows)
            start_guess(laws, rows, ZERO, ZERO, count, memory, work.space)
            _row_motions(n, port_torques, train, work)
            _extra_unknowns(n, port_torques, train, work)
            _law_rows(n, count, n + extra, work)
        for i in range(n):
            contact.active[i] = 1
            if rows.row[i].sided == 1:
                carries = gear_meshes[rows.row[i].owner].carries == 1
                contact.active[i] = 1 if carries == forward else 0
        # directly, by continuation to share 0, by continuation to the smallest share
        first, last = EXACT if attempt == 0 else 0, LOOSE if attempt == 2 else EXACT
        share = solve_set(contact, n, extra, out, first, last)
        if share < 0.0:
            continue
        refine_set(contact, n, extra, share, False, out)
        if share > 0.0:
            refine_set(contact, n, extra, SOFTEST, True, out)
        for i in range(n):
            if rows.row[i].sided == 1 and (contact.active[i] == 0 or out[i] < 0.0):
                out[i] = 0.0
        closure = _closure(n, count, port_torques, train, work, out)
        if closure <= CLOSURE:
            break
    return n, count, pairs, closure


MAX_ITERATIONS = 60  # until coast flanks and laws are consistent with the solution
MANY_ITERATIONS = 20  # after which laws take half steps
# rounding of motions in base pitches: without load, forces of the last solution are rounding
BLUR = 2e-11
DEEP = 0.01  # closing in base pitches at which all slices of a flank touch


class Positions(NamedTuple):
    """Given values and results of positions; see ``Equilibrium``."""

    theta: Array
    port_torques: Array
    torques: Array
    eta: Array
    active_flanks: NDArray[np.int64]
    closure: Array


@njit(**INNER, fastmath=FAST)
def modal_part(elastic, forces, omega2, first, eta):
    """eta[first:] = Φᵀ f / ω², with the elastic modes (n_c, n) of the channels."""
    part = eta[first:]
    fill(part, 0.0)
    for c in range(forces.shape[0]):
        f = forces[c]
        if f != 0.0:
            for j in range(part.shape[0]):
                part[j] += f * elastic[c, j]
    for j in range(part.shape[0]):
        part[j] /= omega2[j]


@njit(**INNER)
def _coast_flanks_agree(gears, rows, pairs, theta, motion, active_flanks):
    """Activate coast flanks whose gap has nearly closed; returns True if there are none."""
    agreed, gear_meshes = True, gears.gear_mesh
    for m in range(gear_meshes.shape[0]):
        b = gear_meshes[m].opposite
        if b >= 0 and active_flanks[b] == 0:
            look_at_rest(gears, rows, pairs, theta, motion, m, active_flanks)
            agreed = agreed and active_flanks[b] == 0
    return agreed


@njit(**INNER)
def _start_slices(gear_meshes, forward, memory):
    """Set the motion about which slices are linearised: open for flanks that do not carry; for
    those that do, the last motion, or one with all slices in contact where that was open."""
    for m in range(gear_meshes.shape[0]):
        if gear_meshes[m].slices == 0:
            continue
        carries = (gear_meshes[m].carries == 1) == forward
        first = gear_meshes[m].places * m
        for place in range(first, first + gear_meshes[m].places):
            for a in range(2):
                if not carries:
                    memory[place, 0, a] = -TOUCHING
                elif memory[place, 0, a] < 0.0:
                    memory[place, 0, a] = DEEP * gear_meshes[m].pitch


@njit(**PART)
def _solve_one(laws, theta, port_torques, forward, train, work, out, active_flanks):
    """Equilibrium at one position, with all coast flanks that are nearly closed; returns the
    numbers of rows and tooth pairs, and the closure, infinite where no solution satisfies the
    laws."""
    gears, rows, motion = work.elements.gears, work.rows, work.channels[0]
    gear_meshes = gears.gear_mesh
    memory = work.memory
    pitch = 0.0
    for m in range(gear_meshes.shape[0]):
        active_flanks[m] = gear_meshes[m].carries if forward else 1
        pitch = max(pitch, gear_meshes[m].pitch)
    _start_slices(gear_meshes, forward, memory)
    n, pairs, closure = ZERO, ZERO, 0.0
    for iteration in range(MAX_ITERATIONS):
        n, count, pairs, closure = solve_position(
            laws, theta, port_torques, forward, active_flanks, train, work, out
        )
        if not closure <= CLOSURE:
            break
        share = 0.5 if iteration > MANY_ITERATIONS else 1.0
        last = iteration == MAX_ITERATIONS - 1
        least, blur = (CLOSURE, BLUR * pitch) if last else (TOLERANCE, 0.0)
        if disagree(laws, work, count, out, least, share, blur):
            closure = np.inf
            continue  # gaps of coast flanks are only known where all laws are satisfied
        if _coast_flanks_agree(gears, rows, pairs, theta, motion, active_flanks):
            break
    return n, pairs, closure


@njit(**UNCOUNTED, nogil=True)
def solve_positions(laws, span, forward, train, modes, work, out, solutions, loads):
    """Solve positions span[0] … span[1] − 1, with results in ``solutions`` and ``loads``. Returns
    the index of the first position without equilibrium, or span[1], and its closure."""
    elastic, omega2 = modes
    rows, delta, channel_forces = work.rows, work.delta[0], work.channels[1]
    angles, port_torques, torques = solutions.theta, solutions.port_torques, solutions.torques
    reactions = train.reactions
    r = train.motions.shape[1] - reactions.shape[0]
    for p in range(span[0], span[1]):
        n, pairs, closure = _solve_one(
            laws, angles[p], port_torques[p], forward[p], train, work, out,
            solutions.active_flanks[p],
        )  # fmt: skip
        if not closure <= CLOSURE:
            return p, closure
        solutions.closure[p] = closure
        for f in range(reactions.shape[0]):
            torques[p, reactions[f]] = -out[n + r + f]
        put(solutions.eta[p], out[n : n + r])
        modal_part(elastic, channel_forces, omega2, r, solutions.eta[p])
        freeze_neighbours(rows, n, out)
        note_loads(rows, n, pairs, out, delta, p, loads)
    return span[1], 0.0
