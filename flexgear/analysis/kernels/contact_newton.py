"""The contact problem of a step, solved by Newton's method for all force elements at once.

With the displacements D and rates W of rows under unit forces, the forces F of n rows satisfy

    F = law(δ, δ̇),   δ = δ* − D F,   δ̇ = δ̇* − W F,

δ*, δ̇* being the motion of the rows without these forces. Linearised about δ₀, δ̇₀ with the force F₀
and the tangents K and C, which couple the rows of one element only,

    (I + K D + C W) F = F₀ + K (δ* − δ₀) + C (δ̇* − δ̇₀).

The equation of a row of given motion has 0 in the place of I and states 0 = law(δ, δ̇). Elements
whose law does not give the force of the solution are linearised about its motion: this is Newton's
method for smooth laws, and an active-set method for laws with branches, such as those of tooth
pairs, which ends with the exact solution. Laws rise with δ, and δ̇ rises with δ within a step, so
that the solution is unique. After some iterations only the first such element is changed, which
cannot cycle between branches (Murty's rule).
"""

from typing import NamedTuple

import numpy as np

from flexgear.analysis.kernels.eliminated_springs import SpringSpace, spring_space
from flexgear.analysis.kernels.static_contact import eliminate, solve_dense
from flexgear.analysis.kernels.vectors import (
    add_two,
    aligned,
    fill,
    padded,
    put,
    put_two,
    rounded_up,
    two_dots,
)
from flexgear.arrays import Array, Ints
from flexgear.compiled import FAST, INNER, PART, njit
from flexgear.coupling.kernels.elements import (
    packed,
    places,
    places_of_gear_mesh,
    rolling_rates,
    widest,
)
from flexgear.coupling.laws import BASIC, HELD_RATE_LAW, LINEAR_RATE_LAW, ONE_SIDED_LAW
from flexgear.coupling.laws.basic import one_sided
from flexgear.coupling.pair_data import PairData, deepest_gap

MAX_ITERATIONS = 60  # linear problems
MANY_ITERATIONS = 20  # after which one element changes at a time
STIFFER = 2.0  # work of a law over that of its tangent, above which the step is shortened
HALVINGS = 40  # of a step: bearings without load start with a ten-thousandth of their stiffness
TOLERANCE = 1e-10  # difference between the forces of a law and the solution over the largest force
SMALLEST = 1e-290  # N; numbers below 1e-308, to which speeds under a brake decay, have few digits
ROUNDING = 1e-13  # rounding of a force over tangent times rate, of steep laws
# m: closing about which new elements are linearised; so small that the rounding of F₀ − k δ₀ does
# not exceed small loads
TOUCHING = 1e-30
BASIC_LAWS = len(BASIC)


class ContactProblem(NamedTuple):
    """A contact problem with room for R rows."""

    displacement: Array  # (R, R) D, m/N
    rate: Array  # (R, R) W, m/(N s)
    free: Array  # (2, R) δ* with offsets, and δ̇*
    motion: Array  # (2, R) δ, δ̇ of the solution
    force: Array  # (R,) N
    matrix: Array  # (R, R)
    right: Array  # (R,)
    springs: SpringSpace  # for eliminated springs


class LawSpace(NamedTuple):
    """Linearised laws of E elements of up to r rows, and work space for one more (the last)."""

    motion: Array  # (E + 1, 2, r) δ₀, δ̇₀
    force: Array  # (E + 1, 2, r) F₀, and its part with a potential
    tangent: Array  # (E + 1, 2, r, r) K, C
    remembered: Ints  # (E + 1,) places of the memory written by the last step, and as the last
    # entry their number, −1 if unknown


def contact_problem(rows: int, springs: int) -> ContactProblem:
    """Work space for ``rows`` rows, of which ``springs`` may be eliminated; entries beyond the rows
    in use stay finite, as loops read padded vectors."""
    size = rounded_up(rows)
    return ContactProblem(
        displacement=np.zeros((rows, size)),
        rate=np.zeros((rows, size)),
        free=np.zeros((2, rows)),
        motion=np.zeros((2, rows)),
        force=np.zeros(size),
        matrix=aligned(size, size),
        right=np.zeros(size),
        springs=spring_space(rows, springs),
    )


def law_space(elements: int, rows: int) -> LawSpace:
    """Work space for the laws of ``elements`` elements of at most ``rows`` rows."""
    count = elements + 1
    return LawSpace(
        motion=np.zeros((count, 2, rows)),
        force=np.zeros((count, 2, rows)),
        tangent=np.zeros((count, 2, rows, rows)),
        remembered=np.full(count, -1),
    )


def first_memory(data: PairData, rates: Array) -> Array:
    """Memory (places, 2, r) of δ and δ̇ before the first step: tooth pairs touch with all their
    slices, other elements are undeformed; rates (6 B,): motions of the blocks in rigid rotation of
    the train, rad/s and m/s."""
    memory = np.zeros((places(data), 2, widest(data)))
    touch = TOUCHING + 2.0 * deepest_gap(data)
    first = places_of_gear_mesh(data) * len(data.s0)
    memory[:first, 0] = np.repeat(touch, places_of_gear_mesh(data))[:, None]
    fixed = packed(data).fixed
    row_rates = rolling_rates(fixed, rates)
    for e, element in enumerate(fixed.element):
        count = element["rows"]
        memory[first + e, 1, :count] = row_rates[element["first"] : element["first"] + count]
    return memory


@njit(**PART)
def _evaluate(laws, rows, e, motion, force, tangent):
    """Evaluate the law of element e at its motion (2, r); returns its potential, J. The law of most
    tooth pairs is inlined, as a call by address takes longer than this law."""
    if rows.element[e].law == ONE_SIDED_LAW:
        return one_sided(rows.parameters[e], motion, force, tangent)
    return laws[rows.element[e].law](rows.parameters[e], motion, force, tangent)


@njit(**PART)
def linearise(laws, rows, e, motion, space, place):
    """Evaluate the law of element e at the motion (2, R) of all rows; force and tangent are written
    to index ``place`` of ``space``; returns the potential, J."""
    element = rows.element[e]
    element_motion = space.motion[place]
    for a in range(element.rows):
        element_motion[0, a] = motion[0, element.first + a]
        element_motion[1, a] = motion[1, element.first + a]
    return _evaluate(laws, rows, e, element_motion, space.force[place], space.tangent[place])


@njit(**INNER)
def start_guess(laws, rows, first, stop, count, memory, space):
    """Evaluate the laws of all elements but the eliminated ones (first … stop − 1) at their motion
    of the last step, memory (places, 2, r), or, for elements without a place, in ``space``."""
    for e in range(count):
        if first <= e < stop:
            continue
        element, element_motion = rows.element[e], space.motion[e]
        for a in range(element.rows if element.place >= 0 else 0):
            element_motion[0, a] = memory[element.place, 0, a]
            element_motion[1, a] = memory[element.place, 1, a]
        _evaluate(laws, rows, e, element_motion, space.force[e], space.tangent[e])


@njit(**INNER)
def _forget(memory, place):
    """Set a place of the memory to a motion at which a tooth pair just touches."""
    for a in range(memory.shape[2]):
        memory[place, 0, a], memory[place, 1, a] = TOUCHING, 0.0


@njit(**INNER)
def remember(rows, count, motion, memory, remembered):
    """Save the motion (2, R) of all elements in memory (places, 2, r) for the next step; places of
    other elements are set to a motion at which a tooth pair just touches."""
    end = remembered.shape[0] - 1
    for p in range(remembered[end] if remembered[end] >= 0 else memory.shape[0]):
        _forget(memory, remembered[p] if remembered[end] >= 0 else p)
    for e in range(count):
        element = rows.element[e]
        for a in range(element.rows):
            memory[element.place, 0, a] = motion[0, element.first + a]
            memory[element.place, 1, a] = motion[1, element.first + a]
        remembered[e] = element.place
    remembered[end] = count


@njit(**INNER, fastmath=FAST)
def _assemble(rows, skipped, count, n, space, problem):
    """Set up matrix and right side of the linear problem with the tangents in ``space``."""
    free, right, size = problem.free, problem.right, padded(n)
    for e in range(count):
        if skipped[0] <= e < skipped[1]:
            continue
        element, first = rows.element[e], rows.element[e].first
        for a in range(element.rows):
            i = first + a
            entries, total = problem.matrix[i, :size], space.force[e, 0, a]
            for b in range(element.rows):
                k, c = space.tangent[e, 0, a, b], space.tangent[e, 1, a, b]
                d, w = problem.displacement[first + b], problem.rate[first + b]
                if b == 0:
                    put_two(entries, k, d, c, w)
                else:
                    add_two(entries, k, d, c, w)
                total += k * (free[0, first + b] - space.motion[e, 0, b])
                total += c * (free[1, first + b] - space.motion[e, 1, b])
            entries[i] += 0.0 if element.law == HELD_RATE_LAW else 1.0
            right[i] = total


@njit(**INNER)
def _elastic_work(force, stiffness):
    """F²/k of a row; 0 without nominal stiffness."""
    return force * force / stiffness if stiffness > 0.0 else 0.0


@njit(**INNER)
def _reach(laws, work, e, x):
    """Share λ of the step w to the new motion, at which an element is linearised next.

    λ = 1 unless the law is much stiffer than its tangent, as for a bearing that had clearance. Then
    λ is such that F(δ₀ + λ w) · w = x · w with the forces x of the solution; the left side rises
    with λ from below the right one, as the energy of a law is convex. For a force without potential
    Σ F²/k = Σ x²/k over the rows is used instead, k the nominal stiffness; or twice Σ F₀²/k at δ₀
    where that is more, as the size of such a force need not rise along a step that turns it. The
    spare place of the law space is overwritten.
    """
    element, parameters = work.rows.element[e], work.rows.parameters[e]
    spare, last_motion = work.space.motion.shape[0] - 1, work.memory[element.place, 0]
    trial, force, tangent = work.space.motion[spare], work.space.force[spare], work.space.tangent
    rows, rates = work.rows.row, work.memory[element.place, 1]
    low, high, reach, required_work, required_size, first_size = 0.0, 1.0, 1.0, 0.0, 0.0, 0.0
    for a in range(element.rows):
        i = element.first + a
        required_work += x[i] * (work.delta[0, i] - last_motion[a])
        required_size += _elastic_work(x[i], rows[i].stiffness)
        first_size += _elastic_work(work.space.force[e, 0, a], rows[i].stiffness)
    required_size = max(required_size, STIFFER * first_size)
    for halving in range(HALVINGS):
        law_work, law_size, conservative = 0.0, 0.0, True
        for a in range(element.rows):
            trial[0, a] = last_motion[a] + reach * (
                work.delta[0, element.first + a] - last_motion[a]
            )
            trial[1, a] = rates[a]
        laws[element.law](parameters, trial, force, tangent[spare])
        for a in range(element.rows):
            i = element.first + a
            law_work += force[0, a] * (work.delta[0, i] - last_motion[a])
            law_size += _elastic_work(force[0, a], rows[i].stiffness)
            conservative = conservative and force[0, a] == force[1, a]
        if not conservative:
            law_work, required_work = law_size, required_size
        if halving == 0 and law_work <= STIFFER * max(required_work, 0.0):
            return 1.0
        if law_work > required_work:
            high = reach
        else:
            low = reach
        reach = 0.5 * (low + high)
    return high


@njit(**INNER)
def disagree(laws, work, count, x, least, share, blur):
    """Whether the force of a nonlinear law at the motion of an equilibrium, with the rates of rigid
    rotation, differs from that in x (R,) by more than ``least`` times the largest force, and than
    its tangent or nominal stiffness times ``blur``, m.

    Such an element is linearised next at the share λ of its step (``_reach``), at most ``share``.
    For all others x is set to the force of the law, which is exactly zero without contact.
    """
    largest, differs, rows, space = 0.0, False, work.rows, work.space
    for e in range(count):
        element = rows.element[e]
        for a in range(element.rows):
            largest = max(largest, abs(x[element.first + a]))
    spare = space.motion.shape[0] - 1
    for e in range(count):
        element = rows.element[e]
        if element.law < BASIC_LAWS:
            continue
        trial, force, wrong = space.motion[spare], space.force[spare], False
        for a in range(element.rows):
            trial[0, a] = work.delta[0, element.first + a]
            trial[1, a] = work.memory[element.place, 1, a]
        laws[element.law](rows.parameters[e], trial, force, space.tangent[spare])
        for a in range(element.rows):
            stiffness = rows.row[element.first + a].stiffness
            stiffness = max(stiffness, abs(space.tangent[spare, 0, a, a]))
            allowed = max(least * largest, blur * stiffness)
            wrong = wrong or abs(force[0, a] - x[element.first + a]) > allowed
        last_motion = work.memory[element.place, 0]
        taken = min(share, _reach(laws, work, e, x)) if wrong else 0.0
        for a in range(element.rows):
            if wrong:
                last_motion[a] += taken * (work.delta[0, element.first + a] - last_motion[a])
            else:
                x[element.first + a] = force[0, a]
        differs = differs or wrong
    return differs


@njit(**PART)
def _disagrees(laws, rows, e, problem, space, least):
    """Whether the force of the law of element e at the motion of the solution differs from that of
    the solution by more than ``least``, N, and rounding. The law is evaluated in the spare place of
    ``space``. Rows of given motion have no law."""
    spare = space.motion.shape[0] - 1
    element = rows.element[e]
    if element.law == HELD_RATE_LAW:
        return False
    linearise(laws, rows, e, problem.motion, space, spare)
    trial, force = space.motion[spare], space.force[spare]
    for a in range(element.rows):
        steep = ROUNDING * abs(space.tangent[spare, 1, a, a] * trial[1, a])
        if abs(force[0, a] - problem.force[element.first + a]) > least + steep:
            return True
    return False


@njit(**PART)
def _take_over(rows, e, space):
    """Copy motion, force and tangent of element e from the spare place of ``space``, where
    ``_disagrees`` has evaluated its law, to place e. A machine that goes from one limit of its
    torque to the other is linearised between them, as it might go back and forth for ever."""
    element, spare = rows.element[e], space.motion.shape[0] - 1
    first, force = space.force[e, 0, 0], space.force[spare, 0, 0]
    steepest = max(space.tangent[e, 1, 0, 0], space.tangent[spare, 1, 0, 0])
    if element.law == LINEAR_RATE_LAW and steepest == 0.0 and first != force:
        law = rows.parameters[e]
        space.force[spare, 0, 0] = middle = 0.5 * (law[3] + law[4])
        space.motion[spare, 1, 0] = law[2] + (middle - law[0]) / law[1]
        space.tangent[spare, 1, 0, 0] = law[1]
    for p in range(2):
        for a in range(element.rows):
            space.motion[e, p, a] = space.motion[spare, p, a]
            space.force[e, p, a] = space.force[spare, p, a]
            for b in range(element.rows):
                space.tangent[e, p, a, b] = space.tangent[spare, p, a, b]


@njit(**INNER)
def solve_contact(laws, rows, first, stop, count, n, space, problem):
    """Compute forces and motion of n rows in ``problem``, from the first linearisation in ``space``
    of the ``count`` elements without the eliminated ones (first … stop − 1).

    Returns the number of linear problems solved, −1 without convergence.
    """
    for iteration in range(1, MAX_ITERATIONS + 1):
        _assemble(rows, (first, stop), count, n, space, problem)
        if not eliminate(problem.matrix, problem.right, n, problem.force):
            _assemble(rows, (first, stop), count, n, space, problem)
            if not solve_dense(problem.matrix, problem.right, n):
                return -1
            put(problem.force, problem.right[:n])
        force, largest = problem.force[: padded(n)], 0.0
        fill(problem.force[n : padded(n)], 0.0)
        for i in range(n):
            largest = max(largest, abs(force[i]))
            delta, rate = two_dots(force, problem.displacement[i], problem.rate[i])
            problem.motion[0, i] = problem.free[0, i] - delta
            problem.motion[1, i] = problem.free[1, i] - rate
        wrong = 0
        for e in range(count):
            if first <= e < stop:
                continue
            if _disagrees(laws, rows, e, problem, space, TOLERANCE * largest + SMALLEST):
                _take_over(rows, e, space)
                wrong += 1
                if iteration > MANY_ITERATIONS:
                    break
        if wrong == 0:
            return iteration
    return -1
