"""A tooth pair in slices that bend each other: an influence matrix and a nonlinear line contact.

Slices close by x_j as in ``slices``; the forces f that press on them solve

    Σ_i C_ji f_i + h_j(f_j) = x_j  and  f_j > 0,    or    f_j = 0  and  Σ_i C_ji f_i ≥ x_j,

C being the flexibility of the teeth between the slices and h_j(f) = a_j f ln(d_j/f) the approach of
the line contact (f < d_j/e, where it rises). C is positive definite, so there is one answer; it is
found by Newton's method on the slices that touch, which are changed until none pulls and none that
does not touch overlaps. The forces are the slope of J = ½ fᵀ C f + Σ ∫ f dh, and their tangent is
that of the slices that touch. Damping τ k_j ẋ_j takes nominal stiffnesses k_j and neither pulls nor
exceeds the force, as in ``slices``. Slices do not pull under any contact law. Parameters: number of
slices, τ s, 1, then t, nominal stiffness N/m and g m of all, a m/N, d N, and the lower triangle of
C by rows, m/N.
"""

from __future__ import annotations

import math

import numpy as np

from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.coupling.laws.slices import COUNT, FIRST, LOOSE, RELAXATION

TRIES = 60
AGREES = 1e-13  # of the largest approach, by which the equations may differ
TOUCHES = 1e-9  # of d: the force from which the line contact is looked at


@compiled_law
def _coupled_slices(parameters, motion, force, tangent):
    """Newton on the slices that touch; sums over them."""
    count, tau = int(parameters[COUNT]), parameters[RELAXATION]
    triangle = FIRST + 5 * count
    for i in range(2):
        force[0, i], force[1, i] = 0.0, 0.0
        for j in range(2):
            tangent[0, i, j], tangent[1, i, j] = 0.0, 0.0
    x, f, active = np.empty(count), np.zeros(count), np.zeros(count, np.int64)
    place, small = np.empty(count, np.int64), np.empty((count, count))
    sides = np.empty((count, 3))
    largest, stiffness = 0.0, 0.0
    for j in range(count):
        b = parameters[FIRST + j]
        x[j] = (1.0 - b) * motion[0, 0] + b * motion[0, 1] - parameters[FIRST + 2 * count + j]
        largest = max(largest, abs(x[j]))
        stiffness += parameters[FIRST + count + j]
        if x[j] > 0.0:
            active[j] = 1
    n = 0
    for _ in range(TRIES):
        n = 0
        for j in range(count):
            if active[j] == 1:
                place[n] = j
                n += 1
        if n == 0:
            break
        worst = 0.0
        for p in range(n):
            j = place[p]
            left = x[j]
            for q in range(count):
                row, column = max(j, q), min(j, q)
                left -= parameters[triangle + row * (row + 1) // 2 + column] * f[q]
            slope = 0.0
            a, d = parameters[FIRST + 3 * count + j], parameters[FIRST + 4 * count + j]
            if a > 0.0:
                now = max(f[j], TOUCHES * d)
                left -= a * f[j] * math.log(d / now)
                slope = a * (math.log(d / now) - 1.0) if f[j] > now * 0.5 else a * math.log(d / now)
            worst = max(worst, abs(left))
            for q in range(p + 1):
                i = place[q]
                row, column = max(j, i), min(j, i)
                small[p, q] = parameters[triangle + row * (row + 1) // 2 + column]
            small[p, p] += slope
            b = parameters[FIRST + j]
            sides[p, 0], sides[p, 1], sides[p, 2] = left, 1.0 - b, b
        for p in range(n):  # Cholesky, and its three right-hand sides
            for q in range(p + 1):
                total = small[p, q]
                for r in range(q):
                    total -= small[p, r] * small[q, r]
                small[p, q] = math.sqrt(total) if p == q else total / small[q, q]
            for c in range(3):
                total = sides[p, c]
                for r in range(p):
                    total -= small[p, r] * sides[r, c]
                sides[p, c] = total / small[p, p]
        for p in range(n - 1, -1, -1):
            for c in range(3):
                total = sides[p, c]
                for r in range(p + 1, n):
                    total -= small[r, p] * sides[r, c]
                sides[p, c] = total / small[p, p]
        changed = False
        for p in range(n):
            j = place[p]
            f[j] += sides[p, 0]
            if f[j] < 0.0:
                f[j], active[j], changed = 0.0, 0, True
        if not changed and worst <= AGREES * largest:
            for j in range(count):
                if active[j] == 0:
                    left = x[j]
                    for q in range(count):
                        row, column = max(j, q), min(j, q)
                        left -= parameters[triangle + row * (row + 1) // 2 + column] * f[q]
                    if left > AGREES * largest:
                        active[j], changed = 1, True
            if not changed:
                break
    energy = 0.0
    for p in range(n):
        j = place[p]
        b = parameters[FIRST + j]
        a = 1.0 - b
        to_a, to_b, elastic = sides[p, 1], sides[p, 2], f[j]
        damper = tau * parameters[FIRST + count + j]
        damping, spring = damper * (a * motion[1, 0] + b * motion[1, 1]), 1.0
        if abs(damping) > elastic:
            limited = 1.0 if damping > 0.0 else -1.0
            damping, spring, damper = limited * elastic, 1.0 + limited, 0.0
        total = elastic + damping
        scale, d = parameters[FIRST + 3 * count + j], parameters[FIRST + 4 * count + j]
        energy += 0.5 * elastic * x[j]
        if scale > 0.0:  # ∫ f dh − ½ f h, with h = a f ln(d/f)
            energy -= 0.25 * scale * elastic * elastic
        force[0, 0] += a * total
        force[0, 1] += b * total
        force[1, 0] += a * elastic
        force[1, 1] += b * elastic
        tangent[0, 0, 0] += spring * a * to_a
        tangent[0, 0, 1] += spring * a * to_b
        tangent[0, 1, 0] += spring * b * to_a
        tangent[0, 1, 1] += spring * b * to_b
        tangent[1, 0, 0] += damper * a * a
        tangent[1, 0, 1] += damper * a * b
        tangent[1, 1, 0] += damper * a * b
        tangent[1, 1, 1] += damper * b * b
    if n == 0:
        tangent[0, 0, 0] = tangent[0, 1, 1] = 0.5 * LOOSE * stiffness
    return energy


COUPLED_SLICES = Law("coupled_slices", _coupled_slices)
