"""The small contact problem of one position or one time step, compiled.

Unknown pair forces F with δ = δ̂ − A F − b T and F = k δ + c δ̇; one-sided rows carry compression
only. The contact matrix is positive definite up to damping, so the set of loaded rows is unique;
it is found by adding and dropping rows until none is in tension and none overlaps unloaded.
"""

from __future__ import annotations

import math

from numba import njit

from flexgear.analysis.wide import WIDE, add_rows
from flexgear.coupling.compiled import FAST, INNER
from flexgear.coupling.pair_data import LOAD

MAX_SETS = 50
SMALL_PIVOT = 0.5  # below which a matrix is not what elimination without pivoting is for
AT_MIDDLE = 1e-9  # of its clearance: a bearing so near its middle has no direction
LOOSE = 1e-4  # share of its stiffness that a bearing inside its clearance keeps


@njit(**INNER, fastmath=FAST)
def solve_dense(a, b, n):
    """Gaussian elimination with partial pivoting of the leading n × n block, in place; b := x."""
    for i in range(n):
        pivot = i
        largest = abs(a[i, i])
        for r in range(i + 1, n):
            if abs(a[r, i]) > largest:
                largest = abs(a[r, i])
                pivot = r
        if largest == 0.0:
            return False
        if pivot != i:
            for c in range(i, n):
                a[i, c], a[pivot, c] = a[pivot, c], a[i, c]
            b[i], b[pivot] = b[pivot], b[i]
        inverse = 1.0 / a[i, i]
        for r in range(i + 1, n):
            factor = a[r, i] * inverse
            if factor != 0.0:
                for c in range(i + 1, n):
                    a[r, c] -= factor * a[i, c]
                b[r] -= factor * b[i]
    for i in range(n - 1, -1, -1):
        total = b[i]
        for c in range(i + 1, n):
            total -= a[i, c] * b[c]
        b[i] = total / a[i, i]
    return True


@njit(**INNER, fastmath=FAST)
def _substitute(a, n, x):
    """x with U x = column n, four unknowns at once; the diagonal of U is held inverted."""
    i = n - 1
    while (i + 1) % 4 != 0:
        total = a[i, n]
        for c in range(i + 1, n):
            total -= a[i, c] * x[c]
        x[i] = total * a[i, i]
        i -= 1
    while i > 0:
        k, known = i - 3, x[i + 1 : n]
        r0, r1, r2, r3 = a[k, : n + 1], a[k + 1, : n + 1], a[k + 2, : n + 1], a[k + 3, : n + 1]
        t0, t1, t2, t3 = r0[n], r1[n], r2[n], r3[n]
        u0, u1, u2, u3 = r0[i + 1 : n], r1[i + 1 : n], r2[i + 1 : n], r3[i + 1 : n]
        for c in range(known.shape[0]):
            t0 -= u0[c] * known[c]
            t1 -= u1[c] * known[c]
            t2 -= u2[c] * known[c]
            t3 -= u3[c] * known[c]
        x3 = t3 * r3[k + 3]
        x2 = (t2 - r2[k + 3] * x3) * r2[k + 2]
        x1 = (t1 - r1[k + 3] * x3 - r1[k + 2] * x2) * r1[k + 1]
        x0 = (t0 - r0[k + 3] * x3 - r0[k + 2] * x2 - r0[k + 1] * x1) * r0[k]
        x[k], x[k + 1], x[k + 2], x[k + 3] = x0, x1, x2, x3
        i -= 4


@njit(**INNER, fastmath=FAST, error_model="numpy")
def _pivot_rows(a, k, last, start, end):
    """Finish rows k … last − 1, at most four, from column ``start`` on; diagonals inverted.

    Factors come from the 4 × 4 block alone, not from rows that have to be written first.
    """
    if last < k + 4:
        for r in range(k, last):
            own = a[r]
            for q in range(k, r):
                factor = (-own[q] * a[q, q],)
                for c in range(start, end, WIDE):
                    add_rows(own, c, a, q, factor)
            if not own[r] > SMALL_PIVOT:
                return False
            own[r] = 1.0 / own[r]
        return True
    p0, p1 = a[k, k : k + 4], a[k + 1, k : k + 4]
    p2, p3 = a[k + 2, k : k + 4], a[k + 3, k : k + 4]
    d0 = 1.0 / p0[0]
    l10, l20, l30 = p1[0] * d0, p2[0] * d0, p3[0] * d0
    u11 = p1[1] - l10 * p0[1]
    u12, u13 = p1[2] - l10 * p0[2], p1[3] - l10 * p0[3]
    d1 = 1.0 / u11
    l21, l31 = (p2[1] - l20 * p0[1]) * d1, (p3[1] - l30 * p0[1]) * d1
    u22 = p2[2] - l20 * p0[2] - l21 * u12
    u23 = p2[3] - l20 * p0[3] - l21 * u13
    d2 = 1.0 / u22
    l32 = (p3[2] - l30 * p0[2] - l31 * u12) * d2
    u33 = p3[3] - l30 * p0[3] - l31 * u13 - l32 * u23
    if not (p0[0] > SMALL_PIVOT and u11 > SMALL_PIVOT and u22 > SMALL_PIVOT and u33 > SMALL_PIVOT):
        return False
    for c in range(start, end, WIDE):
        add_rows(a[k + 1], c, a, k, (-l10,))
        add_rows(a[k + 2], c, a, k, (-l20, -l21))
        add_rows(a[k + 3], c, a, k, (-l30, -l31, -l32))
    p0[0], p1[1], p2[2], p3[3] = d0, d1, d2, 1.0 / u33
    return True


@njit(**INNER, fastmath=FAST)
def eliminate(a, n, x):
    """x with A x = b, columns 0 … n of ``a`` being [A b], without pivoting; ``a`` is used up.

    Contact matrices I + k A are positive definite but for their rows' scale, their pivots 1 or
    more; False where a pivot is too small. Four pivot rows are finished, then subtracted at once
    from each row below, which do not wait for one another; in whole blocks of 8 numbers, of which
    ``a`` must have enough.
    """
    end = WIDE * (n // WIDE + 1)
    for k in range(0, n, 4):
        last, start = min(k + 4, n), WIDE * (k // WIDE)
        if not _pivot_rows(a, k, last, start, end):
            return False
        if last == n:
            break
        p0, p1, p2 = a[k, k : k + 4], a[k + 1, k : k + 4], a[k + 2, k : k + 4]
        d0, d1, d2, d3 = p0[0], p1[1], p2[2], a[k + 3, k + 3]
        u01, u02, u03, u12, u13, u23 = p0[1], p0[2], p0[3], p1[2], p1[3], p2[3]
        for i in range(last, n):
            own = a[i]
            f0 = own[k] * d0
            f1 = (own[k + 1] - f0 * u01) * d1
            f2 = (own[k + 2] - f0 * u02 - f1 * u12) * d2
            f3 = (own[k + 3] - f0 * u03 - f1 * u13 - f2 * u23) * d3
            for c in range(start, end, WIDE):
                add_rows(own, c, a, k, (-f0, -f1, -f2, -f3))
    _substitute(a, n, x)
    return True


@njit(**INNER)
def _laid_out(matrix, right, n, total, active, leak, work, x):
    """work ← [A b] and x ← b; a row that is not active states x_i = leak (b − A x + x)_i."""
    for i in range(total):
        line, own = matrix[i], work[i]
        if i < n and active[i] == 0:
            for c in range(total):
                own[c] = leak * line[c]
            own[i] += 1.0 - leak
            x[i] = leak * right[i]
        else:
            for c in range(total):
                own[c] = line[c]
            x[i] = right[i]
        if total < work.shape[1]:
            own[total] = x[i]


@njit(**INNER)
def _row_is_wrong(matrix, right, i, total, pushes, leak, least, x):
    """Whether row i pulls though it is active, or overlaps by more than ``least`` though not."""
    if pushes == 1:
        return x[i] < -least
    force = x[i] / leak if leak > 0.0 else right[i]
    if leak == 0.0:
        for b in range(total):
            force -= matrix[i, b] * x[b]
    return force > least


@njit(**INNER)
def solve_set(matrix, right, sided, n, extra, active, work, x, leak, least):
    """Solve the contact problem; ``x`` (n + extra) gets pair forces, then extra unknowns.

    matrix (n + extra,)²: row i < n states F_i + Σ_j (k_i A_ij + c_i V_ij) F_j + … = right_i;
    extra equations (brake, balance) always hold. sided (n,): 1 where a row can only push;
    ``active`` (n,) is the first guess of loaded rows and returns the answer. leak: share of its
    stiffness that an open row keeps; least: pull and overlap that pass, N. Returns the number of
    sets tried, or −1 without convergence. Every set changes all wrong rows at once; after some
    tries only the first wrong row, which cannot cycle for a positive definite matrix (Murty's
    rule).
    """
    total = n + extra
    for tries in range(4 * MAX_SETS):
        _laid_out(matrix, right, n, total, active, leak, work, x)
        if work.shape[1] < WIDE * (total // WIDE + 1) or not eliminate(work, total, x):
            _laid_out(matrix, right, n, total, active, leak, work, x)
            if not solve_dense(work, x, total):
                return -1
        if leak == 0.0:
            for i in range(n):
                if active[i] == 0:
                    x[i] = 0.0  # exchange of rows may have left rounding there
        wrong = 0
        for i in range(n):
            if sided[i] == 1 and _row_is_wrong(matrix, right, i, total, active[i], leak, least, x):
                wrong += 1
                active[i] = 1 - active[i]
                if tries >= MAX_SETS:
                    break
        if wrong == 0:
            return tries + 1
    return -1


@njit(**INNER)
def refine_set(matrix, right, n, extra, active, leak, work, spare, x):
    """One step of iterative refinement of a solution of ``solve_set``; spare (n + extra,) work."""
    total = n + extra
    for i in range(total):
        left = right[i]
        for c in range(total):
            left -= matrix[i, c] * x[c]
        if i < n and active[i] == 0 and leak > 0.0:
            left -= (1.0 / leak - 1.0) * x[i]
        spare[i] = left
    _laid_out(matrix, spare, n, total, active, leak, work, spare)
    if solve_dense(work, spare, total):
        for i in range(total):
            if i >= n or active[i] == 1 or leak > 0.0:
                x[i] += spare[i]


@njit(**INNER)
def local_blocks(rows, n, place, blocks):
    """List the blocks that rows touch: blocks (m,), place[block] = position or −1. Returns m.

    Rows are walked from the last to the first and ``rows.reach[j]`` notes how many blocks rows
    j … n − 1 touch, so that products of row j with later rows need only that many blocks.
    ``place`` must be −1 everywhere on entry; ``release`` puts it back.
    """
    m = 0
    for i in range(n - 1, -1, -1):
        for a in range(rows.width[i]):
            b = rows.blocks[i, a]
            if place[b] < 0:
                place[b] = m
                blocks[m] = b
                m += 1
        rows.reach[i] = m
    return m


@njit(**INNER)
def release(place, blocks, m):
    """Undo ``local_blocks``."""
    for j in range(m):
        place[blocks[j]] = -1


@njit(**INNER, fastmath=FAST)
def row_products(rows, n, matrix, place, blocks, y, out):
    """out[i, j] = V_iᵀ G V_j for block rows V and a symmetric channel matrix G (n_c, n_c).

    y (≥ 6 m): G V_j on the blocks of rows j and later only; the rest follows by symmetry.
    """
    for j in range(n):
        reach = rows.reach[j]
        for c in range(6 * reach):
            y[c] = 0.0
        for a in range(rows.width[j]):
            base = 6 * rows.blocks[j, a]
            for p in range(6):
                v = rows.coef[j, a, p]
                line = matrix[base + p]
                for c in range(reach):
                    at = 6 * blocks[c]
                    to = 6 * c
                    y[to] += v * line[at]
                    y[to + 1] += v * line[at + 1]
                    y[to + 2] += v * line[at + 2]
                    y[to + 3] += v * line[at + 3]
                    y[to + 4] += v * line[at + 4]
                    y[to + 5] += v * line[at + 5]
        for i in range(j, n):
            total = 0.0
            for a in range(rows.width[i]):
                at = 6 * place[rows.blocks[i, a]]
                for p in range(6):
                    total += rows.coef[i, a, p] * y[at + p]
            out[i, j] = total
            out[j, i] = total


@njit(**INNER)
def right_side(rows, i, delta, rate, c):
    """k (δ + e) + c δ̇ of row i, or the force itself where it is given."""
    if rows.kind[i] == LOAD:
        return rows.offset[i]
    return rows.stiffness[i] * (delta + rows.offset[i]) + c * rate


@njit(**INNER)
def row_values(rows, n, vector, out):
    """out[i] = V_iᵀ u for a channel vector u."""
    for i in range(n):
        total = 0.0
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                total += rows.coef[i, a, p] * vector[base + p]
        out[i] = total


@njit(**INNER)
def look_along(pairs, rows, motion):
    """Turn clearance rows to where their bearings are displaced; largest change."""
    change = 0.0
    for r in range(pairs.clearance_stiffness.shape[0]):
        x, y = 0.0, 0.0
        for e in range(2):
            block = pairs.clearance_block[r, e]
            if block < 0:
                continue
            sign = 1.0 if e == 0 else -1.0
            a = pairs.clearance_turn[r, e]
            ca, sa = math.cos(a), math.sin(a)
            ux, uy = motion[6 * block], motion[6 * block + 1]
            x += sign * (ca * ux + sa * uy)
            y += sign * (-sa * ux + ca * uy)
        size = math.sqrt(x * x + y * y)
        if size > AT_MIDDLE * pairs.clearance_gap[r]:
            share = max(1.0 - pairs.clearance_gap[r] / size, LOOSE)
            change = max(
                change,
                abs(x / size - rows.direction[r, 0]) + abs(y / size - rows.direction[r, 1]),
            )
            change = max(change, abs(share - rows.direction[r, 2]))
            rows.direction[r, 0], rows.direction[r, 1] = x / size, y / size
            rows.direction[r, 2] = share
    return change
