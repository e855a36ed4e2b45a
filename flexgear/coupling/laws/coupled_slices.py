"""Tooth pair with slices coupled by an influence matrix, and a nonlinear line contact.

Slices are compressed by x_j as in ``slices``; their forces f solve

    Σ_i C_ji f_i + h_j(f_j) = x_j  and  f_j > 0,    or    f_j = 0  and  Σ_i C_ji f_i ≥ x_j,

C being the flexibility of the teeth between slices and h_j(f) = a_j f ln(d_j/f) the approach of the
line contact, continued by its tangent beyond d_j/e², where contact is nearly as wide as deep. C is
positive definite, so the solution is unique. It follows from Newton's method on the active slices,
changed until no active slice pulls and no other overlaps. After a correction Δf the equation of a
slice has a residual of at most a Δf²/2f, f the smaller of both forces; the last correction is that
after which this is rounding for all slices, also for one with a small f that just touches. The
forces are the derivative of
J = ½ fᵀ C f + Σ ∫ f dh, with the tangent of the active slices. Damping τ k_j ẋ_j uses nominal
stiffnesses k_j and neither pulls nor exceeds the force, as in ``slices``. Parameters: number of
slices, τ s, a constant damper, then t, nominal stiffness N/m and g m of all slices, a m/N, d N, and
the lower triangle of C by rows, m/N; then, if there is room, the motion of the last solution, its
forces and their derivatives, from which the next one starts.
"""

import math

import numpy as np

from flexgear.arrays import Array
from flexgear.compiled import INNER, njit
from flexgear.coupling.laws.basic import add_damper, clear
from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.coupling.laws.slices import COUNT, DAMPER, FIRST, LEAST_TANGENT, RELAXATION

MAX_ITERATIONS = 60
ONE = np.uint64(1)
TOLERANCE = 1e-12  # residual over the largest approach
NEAR = 10.0  # largest ratio of a force of the last solution to the nominal one to start from it
LEAST_FORCE = 1e-9  # over d; the line contact is linear below


@njit(**INNER)
def _overlaps(bending, x, f, left):
    """Fills left (K,) with x − C f, in one pass over the triangle of C."""
    count = x.shape[0]
    at = 2 * count
    for j in range(count):
        left[j] = x[j]
    for j in range(count):
        row, total, force = bending[at : at + j + 1], 0.0, f[j]
        for i in range(j):
            total += row[i] * f[i]
            left[i] -= row[i] * force
        left[j] -= total + row[j] * force
        at += j + 1


@njit(**INNER)
def _line_contact(bending, count, j, f):
    """Approach h of slice j, dh/df and ∫ f dh at the force f; linear below ``LEAST_FORCE`` d, and
    continued by its tangent above d/e²."""
    a, d = bending[j], bending[count + j]
    if not a > 0.0:
        return 0.0, 0.0, 0.0
    if f < LEAST_FORCE * d:
        secant = -a * math.log(LEAST_FORCE)
        return secant * f, secant, 0.5 * secant * f * f
    below = min(f, d * math.exp(-2.0))
    ratio, over = math.log(d / below), f - below
    approach, slope = a * below * ratio, a * (ratio - 1.0)
    energy = 0.5 * a * below * below * (ratio - 0.5)
    return approach + slope * over, slope, energy + slope * over * (below + 0.5 * over)


@njit(**INNER)
def _solved(matrix, sides, n):
    """Solves the leading n × n block of a symmetric ``matrix``, in place, for ``sides`` (3, n).
    Elimination of the upper triangle row by row, for vectorised loops; unsigned indices avoid tests
    for negative ones. NaN if the matrix is not positive definite."""
    rows = np.uint64(n)
    first, second, third = sides[0], sides[1], sides[2]
    for p in range(rows):
        top = matrix[p]
        inverse = 1.0 / top[p] if top[p] > 0.0 else np.nan
        x, y, z = first[p], second[p], third[p]
        for r in range(p + ONE, rows):
            entries, factor = matrix[r], top[r] * inverse
            for c in range(r, rows):
                entries[c] -= factor * top[c]
            first[r] -= factor * x
            second[r] -= factor * y
            third[r] -= factor * z
    for below in range(rows):
        k = rows - ONE - below
        top = matrix[k]
        x, y, z = first[k], second[k], third[k]
        for r in range(k + ONE, rows):
            x -= top[r] * first[r]
            y -= top[r] * second[r]
            z -= top[r] * third[r]
        first[k], second[k], third[k] = x / top[k], y / top[k], z / top[k]


@njit(error_model="numpy")
def _newton(share, bending, x, f, space, marks):
    """Computes forces f (K,) under overlaps x (K,), from start values in f, by which slices are
    active at first if any of them is positive; returns the number n of active slices. marks (2, K):
    [0, :n] their indices on return; space (K + 4, K): work array whose last two rows have df/dδ of
    the n slices for both rows of the pair on return."""
    count, largest = x.shape[0], 0.0
    place, active = marks[0], marks[1]
    matrix, left, sides = space[:count], space[count], space[count + 1 :]
    loaded = False
    for j in range(count):
        f[j] = f[j] if x[j] > 0.0 else 0.0
        loaded = loaded or f[j] > 0.0
        largest = max(largest, abs(x[j]))
    for j in range(count):
        active[j] = 1 if (f[j] if loaded else x[j]) > 0.0 else 0
    for _ in range(MAX_ITERATIONS):
        n, residual = 0, 0.0
        for j in range(count):
            if active[j] == 1:
                place[n] = j
                n += 1
        if n == 0:
            return 0
        _overlaps(bending, x, f, left)
        for p in range(n):
            j = place[p]
            approach, slope, _ = _line_contact(bending, count, j, f[j])
            sides[0, p], sides[1, p], sides[2, p] = left[j] - approach, 1.0 - share[j], share[j]
            at = 2 * count + j * (j + 1) // 2
            for q in range(p + 1):
                matrix[q, p] = bending[at + place[q]]
            matrix[p, p] += slope
        _solved(matrix, sides, n)
        changed = False
        for p in range(n):
            j, before, step = place[p], f[place[p]], sides[0, p]
            f[j] += step
            if f[j] < 0.0:
                f[j], active[j], changed = 0.0, 0, True
            least = max(min(before, f[j]), LEAST_FORCE * bending[count + j])
            if bending[j] > 0.0:
                residual = max(residual, 0.5 * bending[j] * step * step / least)
        if changed or residual > TOLERANCE * largest:
            continue
        _overlaps(bending, x, f, left)
        for j in range(count):
            if active[j] == 0 and left[j] > TOLERANCE * largest:
                active[j], changed = 1, True
        if not changed:
            return n
    return n


@njit(**INNER)
def _guess(bound, ratio, d):
    """Start value of the force of a slice, N: nominal flexibility and line contact in series. It is
    below the solution, so that Newton's method does not overshoot. bound: force without line
    contact, N; ratio: a of the line contact times the nominal stiffness."""
    if not bound > LEAST_FORCE * d:
        return 0.0
    return bound / (1.0 + ratio * max(math.log(d / bound), 1.0))


@njit(error_model="numpy")
def coupled_slices(parameters, motion, force, tangent):
    """Sums over active slices; a pair out of contact has a small tangent, and no elastic force."""
    count, tau = int(parameters[COUNT]), parameters[RELAXATION]
    share, nominal = parameters[FIRST : FIRST + count], parameters[FIRST + count :]
    last = FIRST + 5 * count + count * (count + 1) // 2
    bending, memory = parameters[FIRST + 3 * count : last], parameters[last:]
    before, slopes, remembers = memory[2:], memory[2 + count :], memory.shape[0] >= 2 + 3 * count
    space, marks, stiffness = np.empty((count + 6, count)), np.empty((2, count), np.int64), 0.0
    x, f, sides, place = space[0], space[1], space[count + 4 :], marks[0]
    loaded, step, other = False, 0.0, 0.0
    if remembers:
        step, other = motion[0, 0] - memory[0], motion[0, 1] - memory[1]
        for j in range(count):
            loaded = loaded or before[j] > 0.0
    for j in range(count):
        b = share[j]
        x[j] = (1.0 - b) * motion[0, 0] + b * motion[0, 1] - nominal[count + j]
        bound = nominal[j] * x[j]
        guess = before[j] + slopes[j] * step + slopes[count + j] * other if loaded else 0.0
        if not loaded or (before[j] > 0.0 and not bound / NEAR < guess < bound * NEAR):
            guess = _guess(bound, nominal[j] * bending[j], bending[count + j])
        f[j] = guess
        stiffness += nominal[j]
    clear(force, tangent)
    n, energy = _newton(share, bending, x, f, space[2:], marks), 0.0
    if remembers:
        memory[0], memory[1] = motion[0, 0], motion[0, 1]
        for j in range(count):
            before[j], slopes[j], slopes[count + j] = f[j], 0.0, 0.0
        for p in range(n):
            slopes[place[p]], slopes[count + place[p]] = sides[0, p], sides[1, p]
    for p in range(n):
        j = place[p]
        elastic, b = f[j], share[j]
        a, damper, spring = 1.0 - b, tau * nominal[j], 1.0
        damping = damper * (a * motion[1, 0] + b * motion[1, 1])
        if abs(damping) > elastic:
            limited = 1.0 if damping > 0.0 else -1.0
            damping, spring, damper = limited * elastic, 1.0 + limited, 0.0
        approach, _, stored = _line_contact(bending, count, j, elastic)
        energy += 0.5 * elastic * (x[j] - approach) + stored  # ½ fᵀ C f + ∫ f dh
        force[0, 0] += a * (elastic + damping)
        force[0, 1] += b * (elastic + damping)
        force[1, 0] += a * elastic
        force[1, 1] += b * elastic
        for c in range(2):
            tangent[0, 0, c] += spring * a * sides[c, p]
            tangent[0, 1, c] += spring * b * sides[c, p]
        tangent[1, 0, 0] += damper * a * a
        tangent[1, 0, 1] += damper * a * b
        tangent[1, 1, 0] += damper * a * b
        tangent[1, 1, 1] += damper * b * b
    if n == 0:
        tangent[0, 0, 0] = tangent[0, 1, 1] = 0.5 * LEAST_TANGENT * stiffness
    add_damper(parameters[DAMPER], motion, force, tangent)
    return energy


@compiled_law
def _coupled_slices(parameters, motion, force, tangent):
    """``coupled_slices`` for calls by address."""
    return coupled_slices(parameters, motion, force, tangent)


@njit()
def forces_of(overlap: Array, share: Array, bending: Array) -> tuple[Array, Array]:
    """Elastic forces (n, K) of slices, N, and tangents (n, 2, 2) of both rows of each pair, N/m.
    overlap: x (n, K), m; share: t (n, K); bending (n, …): a, d and lower triangle of C."""
    out, tangent = np.zeros_like(overlap), np.zeros((overlap.shape[0], 2, 2))
    count = overlap.shape[1]
    space, marks = np.empty((count + 4, count)), np.empty((2, count), np.int64)
    for i in range(overlap.shape[0]):
        touching = _newton(share[i], bending[i], overlap[i], out[i], space, marks)
        for p in range(touching):
            b = share[i, marks[0, p]]
            for c in range(2):
                tangent[i, 0, c] += (1.0 - b) * space[count + 2 + c, p]
                tangent[i, 1, c] += b * space[count + 2 + c, p]
    return out, tangent


COUPLED_SLICES = Law("coupled_slices", _coupled_slices)
