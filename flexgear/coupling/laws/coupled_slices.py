"""A tooth pair in slices that bend each other: an influence matrix and a nonlinear line contact.

Slices close by x_j as in ``slices``; the forces f that press on them solve

    Σ_i C_ji f_i + h_j(f_j) = x_j  and  f_j > 0,    or    f_j = 0  and  Σ_i C_ji f_i ≥ x_j,

C being the flexibility of the teeth between the slices and h_j(f) = a_j f ln(d_j/f) the approach
of the line contact; from d_j/e² on, where contact is nearly as wide as deep, its tangent. C is
positive definite, so there is one answer; it is found by Newton's method on the slices that touch,
which are changed until none pulls and none that does not touch overlaps. The forces are the slope
of J = ½ fᵀ C f + Σ ∫ f dh, and their tangent is that of the slices that touch. Damping τ k_j ẋ_j
takes nominal stiffnesses k_j and neither pulls nor exceeds the force, as in ``slices``. Parameters:
number of slices, τ s, then t, nominal stiffness N/m and g m of all, a m/N, d N, and the lower
triangle of C by rows, m/N.
"""

from __future__ import annotations

import math

import numpy as np

from flexgear.compiled import INNER, njit
from flexgear.coupling.laws.law import Array, Law, compiled_law
from flexgear.coupling.laws.slices import COUNT, FIRST, LOOSE, RELAXATION

TRIES = 60
ONE = np.uint64(1)
AGREES = 1e-12  # of the largest approach, by which the equations may differ
SETTLES = 1e-6  # the same before the last correction, which squares it
TOUCHES = 1e-9  # of d: the force from which the line contact is looked at


@njit(**INNER)
def _flexible(bending, count, i, j):
    """C_ij from the parameters behind t, k and g."""
    row, column = max(i, j), min(i, j)
    return bending[2 * count + row * (row + 1) // 2 + column]


@njit(**INNER)
def _overlap(bending, x, f, j):
    """x_j − Σ C_ji f_i."""
    left = x[j]
    for i in range(x.shape[0]):
        left -= _flexible(bending, x.shape[0], i, j) * f[i]
    return left


@njit(**INNER)
def _line_contact(bending, count, j, f):
    """Approach h, its slope and ∫ f dh at the force f: a secant towards no force, where ln grows,
    and the tangent from f = d/e² on."""
    a, d = bending[j], bending[count + j]
    if not a > 0.0:
        return 0.0, 0.0, 0.0
    if f < TOUCHES * d:
        secant = -a * math.log(TOUCHES)
        return secant * f, secant, 0.5 * secant * f * f
    known = min(f, d * math.exp(-2.0))
    ratio, over = math.log(d / known), f - known
    approach, slope = a * known * ratio, a * (ratio - 1.0)
    energy = 0.5 * a * known * known * (ratio - 0.5)
    return approach + slope * over, slope, energy + slope * over * (known + 0.5 * over)


@njit(**INNER)
def _solved(matrix, sides, n):
    """Symmetric elimination of the leading n × n block of ``matrix``, in place, from its upper
    triangle; sides (n, 3): solved. No numbers where it is not positive definite.

    Row after row, so that no sum waits for itself; over unsigned numbers, none is counted from the
    end.
    """
    rows = np.uint64(n)
    for p in range(rows):
        top, known = matrix[p], sides[p]
        inverse = 1.0 / top[p] if top[p] > 0.0 else np.nan
        for r in range(p + ONE, rows):
            entries, side, factor = matrix[r], sides[r], top[r] * inverse
            for c in range(r, rows):
                entries[c] -= factor * top[c]
            for c in range(3):
                side[c] -= factor * known[c]
    for below in range(rows):
        k = rows - ONE - below
        top, side = matrix[k], sides[k]
        x, y, z = side[0], side[1], side[2]
        for r in range(k + ONE, rows):
            x -= top[r] * sides[r, 0]
            y -= top[r] * sides[r, 1]
            z -= top[r] * sides[r, 2]
        side[0], side[1], side[2] = x / top[k], y / top[k], z / top[k]


@njit(error_model="numpy")
def _newton(share, bending, x, f, place, sides):
    """Forces f (K,) under the overlaps x (K,), from a guess in f; the number of slices that touch,
    which are in ``place``, with df/dδ of both rows in ``sides`` (K, 3) behind the last
    correction."""
    count = x.shape[0]
    matrix, active, largest = np.empty((count, count)), np.zeros(count, np.int64), 0.0
    for j in range(count):
        active[j] = 1 if x[j] > 0.0 else 0
        f[j] *= active[j]
        largest = max(largest, abs(x[j]))
    for _ in range(TRIES):
        n, worst = 0, 0.0
        for j in range(count):
            if active[j] == 1:
                place[n] = j
                n += 1
        if n == 0:
            return 0
        for p in range(n):
            j = place[p]
            approach, slope, _ = _line_contact(bending, count, j, f[j])
            left = _overlap(bending, x, f, j) - approach
            worst = max(worst, abs(left))
            sides[p, 0], sides[p, 1], sides[p, 2] = left, 1.0 - share[j], share[j]
            for q in range(p + 1):
                matrix[q, p] = _flexible(bending, count, j, place[q])
            matrix[p, p] += slope
        _solved(matrix, sides, n)
        changed = False
        for p in range(n):
            j = place[p]
            f[j] += sides[p, 0]
            if f[j] < 0.0:
                f[j], active[j], changed = 0.0, 0, True
        if changed or worst > SETTLES * largest:
            continue
        for j in range(count):
            if active[j] == 0 and _overlap(bending, x, f, j) > AGREES * largest:
                active[j], changed = 1, True
        if not changed:
            return n
    return n


@njit(**INNER)
def _guess(stiffness, a, d, x):
    """A force below that of an overlap x, from where Newton's method does not overshoot: nominal
    flexibility and line contact one after the other."""
    most = stiffness * x
    if not most > TOUCHES * d:
        return 0.0
    return most / (1.0 + stiffness * a * max(math.log(d / most), 1.0))


@compiled_law
def _coupled_slices(parameters, motion, force, tangent):
    """Sums over the slices that touch; a pair in the air keeps a small tangent, and no force."""
    count, tau = int(parameters[COUNT]), parameters[RELAXATION]
    share, nominal = parameters[FIRST : FIRST + count], parameters[FIRST + count :]
    bending = parameters[FIRST + 3 * count :]
    x, f, place = np.empty(count), np.empty(count), np.empty(count, np.int64)
    sides, stiffness = np.empty((count, 3)), 0.0
    for j in range(count):
        b = share[j]
        x[j] = (1.0 - b) * motion[0, 0] + b * motion[0, 1] - nominal[count + j]
        f[j] = _guess(nominal[j], bending[j], bending[count + j], x[j])
        stiffness += nominal[j]
    for i in range(2):
        force[0, i], force[1, i] = 0.0, 0.0
        for j in range(2):
            tangent[0, i, j], tangent[1, i, j] = 0.0, 0.0
    n, energy = _newton(share, bending, x, f, place, sides), 0.0
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
            tangent[0, 0, c] += spring * a * sides[p, 1 + c]
            tangent[0, 1, c] += spring * b * sides[p, 1 + c]
        tangent[1, 0, 0] += damper * a * a
        tangent[1, 0, 1] += damper * a * b
        tangent[1, 1, 0] += damper * a * b
        tangent[1, 1, 1] += damper * b * b
    if n == 0:
        tangent[0, 0, 0] = tangent[0, 1, 1] = 0.5 * LOOSE * stiffness
    return energy


@njit()
def forces_of(overlap: Array, share: Array, bending: Array) -> tuple[Array, Array]:
    """Elastic forces (n, K) N of slices that overlap by (n, K) m, and the tangents (n, 2, 2) N/m of
    both rows of each pair; share (n, K): of the second row in a slice; bending (n, …): their a, d
    and lower triangles of C."""
    out, tangent = np.zeros_like(overlap), np.zeros((overlap.shape[0], 2, 2))
    count = overlap.shape[1]
    place, sides = np.empty(count, np.int64), np.empty((count, 3))
    for i in range(overlap.shape[0]):
        touching = _newton(share[i], bending[i], overlap[i], out[i], place, sides)
        for p in range(touching):
            b = share[i, place[p]]
            for c in range(2):
                tangent[i, 0, c] += (1.0 - b) * sides[p, 1 + c]
                tangent[i, 1, c] += b * sides[p, 1 + c]
    return out, tangent


COUPLED_SLICES = Law("coupled_slices", _coupled_slices)
