"""Dense elimination, and the contact problem of a position with one-sided rows.

Pair forces F are unknown, with δ = δ̂ − A F − b T and F = k δ. The contact matrix is positive
definite, so that the set of loaded rows is unique. It is found by adding and dropping rows until
none is in tension and no unloaded row overlaps.
"""

from typing import NamedTuple

import numpy as np

from flexgear.analysis.kernels.vectors import SIMD, dot, padded
from flexgear.arrays import Array, Ints
from flexgear.compiled import FAST, INNER, PART, njit

MAX_SETS = 50  # sets of loaded rows before only one row is changed at a time
SHARES = (1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 0.0)  # shares of stiffness of open rows in a continuation
EXACT, LOOSE = 5, 4  # indices of share 0 and of the smallest share above
SOFTEST = 1e-12  # share below soft supports, as of floating suns; chosen: 1e-13 is rounding
ROUNDING = 1e-11  # tension or overlap over the largest force
ZERO, ONE, TWO, THREE, FOUR, WHOLE = (np.uint64(i) for i in (0, 1, 2, 3, 4, SIMD))
LEAST_PIVOT = 0.5  # of elimination without exchange of rows


class ContactSet(NamedTuple):
    """Matrix and right side of a position, unchanged by the solver, and its loaded rows."""

    matrix: Array  # (S, S) rows, then rigid motions, then reactions
    right: Array  # (S,)
    sided: Ints  # (S,) 1 for one-sided rows
    active: Ints  # (S,) 1 for loaded rows
    motion: Array  # (R, S) δ = δ* − motion · x
    free: Array  # (R,) δ*
    small: Array  # (S, S) work space
    spare: Array  # (S,) work space


@njit(**INNER, fastmath=FAST)
def solve_dense(a, b, n):
    """Solve a x = b for the leading n × n block by Gaussian elimination with partial pivoting, in
    place, with x in b; returns False for a singular matrix.

    Rows are subtracted in multiples of SIMD; columns left of the pivot are not read again.
    """
    rows, stop = np.uint64(n), np.uint64(min(padded(n), a.shape[1]))
    for i in range(rows):
        pivot, largest = i, abs(a[i, i])
        for r in range(i + ONE, rows):
            if abs(a[r, i]) > largest:
                pivot, largest = r, abs(a[r, i])
        if largest == 0.0:
            return False
        top = a[i]
        if pivot != i:
            for c in range(i, rows):
                top[c], a[pivot, c] = a[pivot, c], top[c]
            b[i], b[pivot] = b[pivot], b[i]
        inverse, start = 1.0 / top[i], i - i % WHOLE
        for r in range(i + ONE, rows):
            lower = a[r]
            factor = lower[i] * inverse
            b[r] -= factor * b[i]
            for c in range(start, stop):
                lower[c] -= factor * top[c]
    for below in range(rows):
        k = rows - ONE - below
        top, total = a[k], b[k]
        for c in range(k + ONE, rows):
            total -= top[c] * b[c]
        b[k] = total / top[k]
    return True


@njit(**PART)
def _four_pivots(a, b, k, start, stop):
    """Eliminate within rows k … k + 3, from column ``start`` on, and replace pivots by their
    inverses; returns whether all pivots are large enough."""
    k1, k2, k3 = k + ONE, k + TWO, k + THREE
    p, q, r, s = a[k], a[k1], a[k2], a[k3]
    d0 = 1.0 / p[k]
    l10, l20, l30 = q[k] * d0, r[k] * d0, s[k] * d0
    u11, u12, u13 = q[k1] - l10 * p[k1], q[k2] - l10 * p[k2], q[k3] - l10 * p[k3]
    d1 = 1.0 / u11
    l21, l31 = (r[k1] - l20 * p[k1]) * d1, (s[k1] - l30 * p[k1]) * d1
    u22, u23 = r[k2] - l20 * p[k2] - l21 * u12, r[k3] - l20 * p[k3] - l21 * u13
    d2 = 1.0 / u22
    l32 = (s[k2] - l30 * p[k2] - l31 * u12) * d2
    u33 = s[k3] - l30 * p[k3] - l31 * u13 - l32 * u23
    large = p[k] > LEAST_PIVOT and u11 > LEAST_PIVOT and u22 > LEAST_PIVOT and u33 > LEAST_PIVOT
    for c in range(start, stop):
        x = p[c]
        y = q[c] - l10 * x
        z = r[c] - l20 * x - l21 * y
        q[c], r[c], s[c] = y, z, s[c] - l30 * x - l31 * y - l32 * z
    b[k1] -= l10 * b[k]
    b[k2] -= l20 * b[k] + l21 * b[k1]
    b[k3] -= l30 * b[k] + l31 * b[k1] + l32 * b[k2]
    p[k], q[k1], r[k2], s[k3] = d0, d1, d2, 1.0 / u33
    return large


@njit(**PART)
def _subtract_four(a, b, k, start, rows, stop):
    """Subtract rows k … k + 3 from all rows below, up to ``rows``, one at a time: loops over more
    than these five arrays are not vectorised."""
    k1, k2, k3 = k + ONE, k + TWO, k + THREE
    p, q, r, s = a[k], a[k1], a[k2], a[k3]
    d0, d1, d2, d3 = p[k], q[k1], r[k2], s[k3]
    p1, p2, p3, q2, q3, r3 = p[k1], p[k2], p[k3], q[k2], q[k3], r[k3]
    for i in range(k + FOUR, rows):
        lower = a[i]
        f0 = lower[k] * d0
        f1 = (lower[k1] - f0 * p1) * d1
        f2 = (lower[k2] - f0 * p2 - f1 * q2) * d2
        f3 = (lower[k3] - f0 * p3 - f1 * q3 - f2 * r3) * d3
        for c in range(start, stop):
            lower[c] -= f0 * p[c] + f1 * q[c] + f2 * r[c] + f3 * s[c]
        b[i] -= f0 * b[k] + f1 * b[k1] + f2 * b[k2] + f3 * b[k3]


@njit(**PART)
def _substitute(a, b, rows, stop, x):
    """Solve U x = b, four unknowns at once; entries of x not yet computed are zero."""
    for c in range(stop):
        x[c] = 0.0
    for done in range(ZERO, rows, FOUR):
        k = rows - FOUR - done
        k1, k2, k3 = k + ONE, k + TWO, k + THREE
        p, q, r, s = a[k], a[k1], a[k2], a[k3]
        t0 = t1 = t2 = t3 = 0.0
        for c in range(k - k % WHOLE, stop):
            t0 += p[c] * x[c]
            t1 += q[c] * x[c]
            t2 += r[c] * x[c]
            t3 += s[c] * x[c]
        x[k3] = (b[k3] - t3) * s[k3]
        x[k2] = (b[k2] - t2 - r[k3] * x[k3]) * r[k2]
        x[k1] = (b[k1] - t1 - q[k3] * x[k3] - q[k2] * x[k2]) * q[k1]
        x[k] = (b[k] - t0 - p[k3] * x[k3] - p[k2] * x[k2] - p[k1] * x[k1]) * p[k]


@njit(**INNER, fastmath=FAST)
def eliminate(a, b, n, x):
    """Solve a x = b for the leading n × n block without exchange of rows; returns False where a
    pivot is too small for that. a (m, m) and b (m,) are overwritten; m is a multiple of SIMD.

    Matrices I + K D with positive definite D and stiffness K have pivots of at least 1 in any
    units. Four rows at a time are subtracted from the rows below, which takes a third of the time
    of ``solve_dense``. Rows after n are set to x = 0.
    """
    rows, stop = np.uint64(n + -n % 4), np.uint64(padded(n))
    for i in range(np.uint64(n), rows):
        for c in range(stop):
            a[i, c] = 0.0
        a[i, i], b[i] = 1.0, 0.0
    for k in range(ZERO, rows, FOUR):
        start = k - k % WHOLE
        if not _four_pivots(a, b, k, start, stop):
            return False
        _subtract_four(a, b, k, start, rows, stop)
    _substitute(a, b, rows, stop, x)
    return True


@njit(**INNER)
def _laid_out(matrix, right, n, total, active, leak, work, x):
    """Copy A to ``work`` and b to x; for rows that are not active x_i = leak (b − A x + x)_i, with
    the share ``leak`` of stiffness."""
    for i in range(total):
        entries, target = matrix[i], work[i]
        if i < n and active[i] == 0:
            for c in range(total):
                target[c] = leak * entries[c]
            target[i] += 1.0 - leak
            x[i] = leak * right[i]
        else:
            for c in range(total):
                target[c] = entries[c]
            x[i] = right[i]


@njit(**INNER)
def _row_is_wrong(matrix, right, i, total, active, leak, least, x):
    """Whether row i is active with tension, or inactive with overlap, of more than ``least``, N."""
    if active == 1:
        return x[i] < -least
    force = x[i] / leak if leak > 0.0 else right[i]
    if leak == 0.0:
        for b in range(total):
            force -= matrix[i, b] * x[b]
    return force > least


@njit(**INNER)
def _largest_of(values, n):
    """max |values[:n]|."""
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(values[i]))
    return largest


@njit(**PART)
def _exchange(contact, n, total, share, least, x, first_only):
    """Number of rows, or of the first only, activated for overlap or deactivated for tension."""
    matrix, right, active, wrong = contact.matrix, contact.right, contact.active, 0
    for i in range(n):
        if contact.sided[i] == 1 and _row_is_wrong(
            matrix, right, i, total, active[i], share, least, x
        ):
            wrong += 1
            active[i] = 1 - active[i]
            if first_only:
                break
    return wrong


@njit(**INNER)
def solve_set(contact, n, extra, x, first, last):
    """Solve the contact problem; x (n + extra,): pair forces, then extra unknowns.

    Row i < n of the matrix (n + extra,)² states F_i + Σ_j k_i A_ij F_j + … = right_i; the extra
    equations (equilibrium, given rotations) always hold. ``contact.active`` is the first guess of
    loaded rows and returns the final set. Open rows keep the shares ``SHARES[first]`` …
    ``SHARES[last]`` of their stiffness in succession, each starting from the previous set. Returns
    the last share, or −1 without a solution. All wrong rows are changed at once; after ``MAX_SETS``
    sets only the first wrong row, which cannot cycle for a positive definite matrix (Murty's rule).
    """
    matrix, right, active = contact.matrix, contact.right, contact.active
    total, work = n + extra, contact.small
    for at in range(first, last + 1):
        share, wrong, least = SHARES[at], 1, 0.0
        if first < last:
            least = ROUNDING * max(_largest_of(right, n), _largest_of(x, n) if at > first else 0.0)
        tries = 0
        while wrong > 0:
            _laid_out(matrix, right, n, total, active, share, work, x)
            if tries == 4 * MAX_SETS or not solve_dense(work, x, total):
                return -1.0
            if share == 0.0:
                for i in range(n):
                    if active[i] == 0:
                        x[i] = 0.0  # removes rounding
            wrong = _exchange(contact, n, total, share, least, x, tries >= MAX_SETS)
            tries += 1
    return SHARES[last]


@njit(**INNER)
def refine_set(contact, n, extra, leak, unload, x):
    """One step of iterative refinement of a solution x of ``solve_set`` with the share ``leak``;
    with ``unload`` to the solution in which the springs of open rows, now of this share, are
    unloaded at the motion of x, and so exert almost no force."""
    matrix, right, active = contact.matrix, contact.right, contact.active
    total, work, spare = n + extra, contact.small, contact.spare
    for i in range(total):
        left = right[i]
        for c in range(total):
            left -= matrix[i, c] * x[c]
        if i < n and active[i] == 0 and leak > 0.0:
            left = -x[i] / leak if unload else left - (1.0 / leak - 1.0) * x[i]
        spare[i] = left
    _laid_out(matrix, spare, n, total, active, leak, work, spare)
    if solve_dense(work, spare, total):
        for i in range(total):
            if i >= n or active[i] == 1 or leak > 0.0:
                x[i] += spare[i]


@njit(**INNER)
def local_blocks(rows, n, local):
    """List the m blocks on which n rows act, and return m. local: place, blocks, reach.

    blocks (m,): their numbers, in the order from the last row to the first; place: index in
    ``blocks`` of a block, or −1; reach[j]: number of blocks of rows j … n − 1, so that products of
    row j with later rows need only the first reach[j] blocks. ``place`` must be −1 everywhere at
    the call; ``release`` restores this.
    """
    place, blocks, reach = local
    m = 0
    for i in range(n - 1, -1, -1):
        for a in range(rows.row[i].width):
            b = rows.blocks[i, a]
            if place[b] < 0:
                place[b] = m
                blocks[m] = b
                m += 1
        reach[i] = m
    return m


@njit(**INNER)
def release(local, m):
    """Reset ``place`` after ``local_blocks`` with m blocks."""
    place, blocks, _ = local
    for j in range(m):
        place[blocks[j]] = -1


@njit(**INNER, fastmath=FAST)
def row_products(rows, n, matrix, local, y, out):
    """out[i, j] = V_iᵀ G V_j for block rows V and a symmetric channel matrix G (n_c, n_c).

    local: see ``local_blocks``; y (≥ 6 m): work space for G V_j on the blocks of rows j … n − 1;
    the rest follows by symmetry.
    """
    place, blocks, reach = local
    for j in range(n):
        count = reach[j]
        for c in range(6 * count):
            y[c] = 0.0
        for a in range(rows.row[j].width):
            base = 6 * rows.blocks[j, a]
            for p in range(6):
                v = rows.coef[j, a, p]
                entries = matrix[base + p]
                for c in range(count):
                    at = 6 * blocks[c]
                    to = 6 * c
                    y[to] += v * entries[at]
                    y[to + 1] += v * entries[at + 1]
                    y[to + 2] += v * entries[at + 2]
                    y[to + 3] += v * entries[at + 3]
                    y[to + 4] += v * entries[at + 4]
                    y[to + 5] += v * entries[at + 5]
        for i in range(j, n):
            total = 0.0
            for a in range(rows.row[i].width):
                at = 6 * place[rows.blocks[i, a]]
                for p in range(6):
                    total += rows.coef[i, a, p] * y[at + p]
            out[i, j] = total
            out[j, i] = total


@njit(**INNER, fastmath=FAST)
def block_motions(rows, n, local, train, unknowns, channels):
    """Motion, in ``channels[0]`` (n_c,), of the blocks on which n rows act, by the forces on these
    blocks and the torques on the ports in ``channels[1]``, and by the amplitudes ``unknowns`` (r,)
    of the rigid motions. Of thousands of channels only few are loaded. train: ``Held``; local: see
    ``local_blocks``."""
    motion, forces, blocks = channels[0], channels[1], local[1]
    m = local_blocks(rows, n, local)
    ports = 6 * local[0].shape[0]
    for b in blocks[:m]:
        for c in range(6 * b, 6 * b + 6):
            flexibility = train.flexibility[c]
            total = dot(flexibility[ports:], forces[ports:])
            for other in blocks[:m]:
                for d in range(6 * other, 6 * other + 6):
                    total += flexibility[d] * forces[d]
            for e in range(unknowns.shape[0]):
                total += train.motions[c, e] * unknowns[e]
            motion[c] = total
    release(local, m)
