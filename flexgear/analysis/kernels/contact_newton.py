"""The contact problem of a step: Newton on the laws of all force elements at once.

With D the displacement and W the rate of rows under unit forces, the forces F of n rows satisfy

    F = law(δ, δ̇),   δ = δ* − D F,   δ̇ = δ̇* − W F,

δ*, δ̇* being what rows do without them. Linearised about some δ₀, δ̇₀ with tangents K and C, which
couple rows of one element only,

    (I + K D + C W) F = F₀ + K (δ* − δ₀) + C (δ̇* − δ̇₀).

A row that is held has no law to obey: its equation has 0 in the place of I and says 0 = law(δ, δ̇).
Elements whose law disagrees with its answer are linearised anew about it: that is Newton's method
where laws are smooth, and an active set where they have branches, as tooth pairs have, which
settles with the exact answer. Laws rise with δ, and δ̇ with δ within a step, so that the answer is
unique. After some tries only the first element that disagrees is changed, which cannot cycle
between branches (Murty's rule).
"""

from __future__ import annotations

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
from flexgear.coupling.laws import BASIC, HELD_RATE_LAW, ONE_SIDED_LAW
from flexgear.coupling.laws.basic import one_sided
from flexgear.coupling.pair_data import PairData, deepest_gap

TRIES = 60  # linear problems until all laws agree
CAUTIOUS = 20  # tries after which one element changes at a time
STIFFER = 2.0  # times the force of its tangent: a law that is not followed all of the way
HALVINGS = 40  # of a way: bearings without load start with a ten-thousandth of their stiffness
AGREES = 1e-10  # of the largest force, by which a law and its answer may differ
ROUNDING = 1e-13  # of a rate times its tangent: steep laws give no force more exactly
# m: the motion about which elements are linearised that were not there before; next to nothing,
# for F₀ − k δ₀ is rounding that small loads must stand out of
TOUCHING = 1e-30
BASIC_LAWS = len(BASIC)


class ContactProblem(NamedTuple):
    """n rows of E elements, the largest of r rows."""

    displacement: Array  # (R, R) D, m/N
    rate: Array  # (R, R) W, m/(N s)
    free: Array  # (2, R) δ* with offsets, and δ̇*
    motion: Array  # (2, R) δ, δ̇ at the answer
    force: Array  # (R,) N
    matrix: Array  # (R, R)
    right: Array  # (R,)
    springs: SpringSpace  # of those that are eliminated


class LawSpace(NamedTuple):
    """Laws of E elements about some motion, and work space for one more."""

    motion: Array  # (E + 1, 2, r) δ₀, δ̇₀
    force: Array  # (E + 1, 2, r) F₀ and its part that has a potential
    tangent: Array  # (E + 1, 2, r, r) K, C
    remembered: Ints  # (E + 1,) places of the memory that the last step wrote; their number, −1
    # where it is not known, at the end


def contact_problem(rows: int, springs: int) -> ContactProblem:
    """Work space for so many rows and springs among them that may be eliminated; what is behind
    the rows in use stays finite, as whole vectors are read."""
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
    """Work space for elements of at most ``rows`` rows."""
    count = elements + 1
    return LawSpace(
        motion=np.zeros((count, 2, rows)),
        force=np.zeros((count, 2, rows)),
        tangent=np.zeros((count, 2, rows, rows)),
        remembered=np.full(count, -1),
    )


def first_memory(data: PairData, rates: Array) -> Array:
    """Memory (places, 2, r) of the elements before the first step: tooth pairs touch, with all
    their slices, and all else is where it was made, at the rates of blocks (6 B,) in rolling."""
    memory = np.zeros((places(data), 2, widest(data)))
    touch = TOUCHING + 2.0 * deepest_gap(data)
    first = places_of_gear_mesh(data) * len(data.s0)
    memory[:first, 0] = np.repeat(touch, places_of_gear_mesh(data))[:, None]
    fixed = packed(data).fixed
    of_rows = rolling_rates(fixed, rates)
    for e, element in enumerate(fixed.element):
        count = element["rows"]
        memory[first + e, 1, :count] = of_rows[element["first"] : element["first"] + count]
    return memory


@njit(**PART)
def _evaluate(laws, rows, e, motion, force, tangent):
    """The law of element e at its motion (2, r): its potential, J. The one of most tooth pairs is a
    part of its caller: a call by address takes longer than that law."""
    if rows.element[e].law == ONE_SIDED_LAW:
        return one_sided(rows.parameters[e], motion, force, tangent)
    return laws[rows.element[e].law](rows.parameters[e], motion, force, tangent)


@njit(**PART)
def linearise(laws, rows, e, motion, space, place):
    """Evaluate the law of element e at the motion (2, R) of all rows: its force and tangent go to
    a place of ``space``, its potential (J) is returned."""
    element = rows.element[e]
    at_element = space.motion[place]
    for a in range(element.rows):
        at_element[0, a] = motion[0, element.first + a]
        at_element[1, a] = motion[1, element.first + a]
    return _evaluate(laws, rows, e, at_element, space.force[place], space.tangent[place])


@njit(**INNER)
def start_guess(laws, rows, first, stop, count, memory, space):
    """Evaluate the laws of all elements, of those that are eliminated (first … stop − 1) no law, at
    their motion of the last step, memory (places, 2, r). An element that has no place in the memory
    is taken at the motion that ``space`` holds already."""
    for e in range(count):
        if first <= e < stop:
            continue
        element, at_element = rows.element[e], space.motion[e]
        for a in range(element.rows if element.place >= 0 else 0):
            at_element[0, a] = memory[element.place, 0, a]
            at_element[1, a] = memory[element.place, 1, a]
        _evaluate(laws, rows, e, at_element, space.force[e], space.tangent[e])


@njit(**INNER)
def _forget(memory, place):
    """Make the motion at a place of the memory one at which a tooth pair just touches."""
    for a in range(memory.shape[2]):
        memory[place, 0, a], memory[place, 1, a] = TOUCHING, 0.0


@njit(**INNER)
def remember(rows, count, motion, memory, remembered):
    """Save the motion (2, R) of all elements as memory (places, 2, r) for the next step. Places of
    elements that do not exist now get a motion at which a tooth pair just touches."""
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
    """The linear problem of the tangents in ``space``; its right side goes to ``right``."""
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
def _over(force, stiffness):
    """F²/k, 0 of a row without nominal stiffness."""
    return force * force / stiffness if stiffness > 0.0 else 0.0


@njit(**INNER)
def _reach(laws, work, element, parameters, x):
    """How much of the way w to the new motion an element goes before it is linearised anew.

    All of it, λ = 1, unless its law is much stiffer than its tangent, as of a bearing that had
    clearance left: then to where F(δ₀ + λ w) · w = x · w, the force that the others ask for. The
    left side rises with λ, from less than the right one, as a law's energy is convex. A law whose
    force has no potential may push across the way: there it is |F|² that is followed to |x|², each
    row's over its nominal stiffness. The spare place of the law space is overwritten.
    """
    spare, last_motion = work.space.motion.shape[0] - 1, work.memory[element.place, 0]
    trial, force, tangent = work.space.motion[spare], work.space.force[spare], work.space.tangent
    rows, rates = work.rows.row, work.memory[element.place, 1]
    low, high, reach, required_work, required_size = 0.0, 1.0, 1.0, 0.0, 0.0
    for a in range(element.rows):
        i = element.first + a
        required_work += x[i] * (work.delta[0, i] - last_motion[a])
        required_size += _over(x[i], rows[i].stiffness)
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
            law_size += _over(force[0, a], rows[i].stiffness)
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
def disagree(laws, work, count, x, least, share):
    """Whether an element of a law that is not linear between contacts has a force at the motion of
    an equilibrium, in steady rolling, that differs from its force in x (R,) by more than ``least``
    of the largest one.

    Such an element is linearised next at a motion at most ``share`` of the way from where it was to
    the new one: see ``_reach``. Of all others x takes over the force of the law, which is exactly
    zero without contact.
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
            wrong = wrong or abs(force[0, a] - x[element.first + a]) > least * largest
        last_motion = work.memory[element.place, 0]
        taken = min(share, _reach(laws, work, element, rows.parameters[e], x)) if wrong else 0.0
        for a in range(element.rows):
            if wrong:
                last_motion[a] += taken * (work.delta[0, element.first + a] - last_motion[a])
            else:
                x[element.first + a] = force[0, a]
        differs = differs or wrong
    return differs


@njit(**PART)
def _disagrees(laws, rows, e, problem, space, least):
    """Whether the law of element e gives another force at the motion that was solved for than the
    force that was; it is evaluated in the spare place of ``space``. Held rows always agree."""
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
    """Copy motion, force and tangent to place e from the spare place of ``space``, where
    ``_disagrees`` has just evaluated the law of element e."""
    element, spare = rows.element[e], space.motion.shape[0] - 1
    for p in range(2):
        for a in range(element.rows):
            space.motion[e, p, a] = space.motion[spare, p, a]
            space.force[e, p, a] = space.force[spare, p, a]
            for b in range(element.rows):
                space.tangent[e, p, a, b] = space.tangent[spare, p, a, b]


@njit(**INNER)
def solve_contact(laws, rows, first, stop, count, n, space, problem):
    """Solve for the forces and motion of n rows, which go to ``problem``; ``space`` holds a first
    linearisation of the ``count`` elements, but those that are eliminated (first … stop − 1).

    Returns the number of linear problems that were solved, −1 where laws and answer never agreed.
    """
    for tries in range(1, TRIES + 1):
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
            if _disagrees(laws, rows, e, problem, space, AGREES * largest):
                _take_over(rows, e, space)
                wrong += 1
                if tries > CAUTIOUS:
                    break
        if wrong == 0:
            return tries
    return -1
