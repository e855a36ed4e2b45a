"""Products with channels at hand (``near.py``): modes, receptances and contact rows.

A row V_i is w₀ + ζ w₁ on the two channels of its line of action, and six coefficients on each
block beyond. Channels are c = 0 … C − 1: P ports, lines, slots; those of two groups, or of the
head and a group that is not linked to it, do not move one another. Loops run from 0 over slices:
compiled indices that might be negative are not vectorised (or scattered one by one). Sums of many
lines are taken in whole cache lines (``wide.py``): head and groups begin with one, ranges of modes
too, and what stands between them is zero.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flexgear.analysis.wide import WIDE, add_rows, clear, put_rows
from flexgear.coupling.compiled import FAST, INNER, INTO

ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)  # unsigned: never counted from the end
LINE = WIDE  # numbers in a cache line: work arrays begin with one, and whole ones are taken


def whole_lines(count: int) -> int:
    """So many numbers in whole cache lines."""
    return count + -count % LINE


whole = njit(**INNER)(whole_lines)


@njit(**INNER)
def _add_lines(matrix, first, stop, factors, low, high, out):
    """out[low:high] += matrix[first:stop, low:high]ᵀ @ factors[first:stop], eight rows at once."""
    j = first
    while j + 7 < stop:
        eight = (
            factors[j], factors[j + 1], factors[j + 2], factors[j + 3], factors[j + 4],
            factors[j + 5], factors[j + 6], factors[j + 7],
        )  # fmt: skip
        for c in range(low, high, LINE):
            add_rows(out, c, matrix, j, eight)
        j += 8
    while j + 1 < stop:
        two = (factors[j], factors[j + 1])
        for c in range(low, high, LINE):
            add_rows(out, c, matrix, j, two)
        j += 2
    if j < stop:
        add_line(matrix, j, factors[j], low, high, out)


@njit(**INNER)
def _add_block(matrix, d, v, low, high, out):
    """out[low:high] += matrix[d:d+6, low:high]ᵀ @ v."""
    six = (v[0], v[1], v[2], v[3], v[4], v[5])
    for c in range(low, high, LINE):
        add_rows(out, c, matrix, d, six)


@njit(**INNER)
def add_line(matrix, d, f, low, high, out):
    """out[low:high] += f matrix[d, low:high]."""
    for c in range(low, high, LINE):
        add_rows(out, c, matrix, d, (f,))


@njit(**INTO)
def moved(shapes, head, span, low, high, rigid, elastic, a, out):
    """out = modes @ a over the channels in use; span, rigid, elastic: ranges of modes."""
    for c in range(0, head, LINE):
        clear(out, c)
    _add_lines(shapes, 0, span[0], a, 0, head, out)
    _add_lines(shapes, span[1], span[2], a, 0, head, out)
    for g in range(low.shape[0]):
        first, last = low[g], whole(high[g])
        for c in range(first, last, LINE):
            clear(out, c)
        _add_lines(shapes, 0, rigid[g], a, first, last, out)
        _add_lines(shapes, elastic[g, 0], elastic[g, 1], a, first, last, out)


@njit(**INNER)
def _pushed(modes, low, high, start, stop, forces, out):
    """out[start:stop] += modes[low:high, start:stop]ᵀ @ forces[low:high], slot by slot."""
    if start == stop:
        return
    for c in range(low, high, 6):
        f = forces[c : c + 6]
        if (
            f[0] != 0.0 or f[1] != 0.0 or f[2] != 0.0
            or f[3] != 0.0 or f[4] != 0.0 or f[5] != 0.0
        ):  # fmt: skip
            _add_block(modes, c, f, start, stop, out)


@njit(**INTO)
def pushed(modes, lines, span, low, high, rigid, elastic, forces, out):
    """out = modesᵀ @ forces over the channels in use; lines: one past the last that takes force."""
    for j in range(0, modes.shape[1], LINE):
        clear(out, j)
    _add_lines(modes, 0, lines, forces, 0, span[0], out)
    _add_lines(modes, 0, lines, forces, span[1], span[2], out)
    for g in range(low.shape[0]):
        _pushed(modes, low[g], high[g], 0, rigid[g], forces, out)
        _pushed(modes, low[g], high[g], elastic[g, 0], elastic[g, 1], forces, out)


@njit(**INNER)
def answered(matrix, lines, head, low, high, linked, top, forces, out):
    """out = matrix @ forces for a symmetric matrix of near channels that respects groups."""
    for c in range(0, whole(top), LINE):
        clear(out, c)
    _add_lines(matrix, 0, lines, forces, 0, head, out)
    for g in range(low.shape[0]):
        last = whole(high[g])
        if linked[g] == 1:
            _add_lines(matrix, 0, lines, forces, low[g], last, out)
            _pushed(matrix, low[g], high[g], 0, head, forces, out)
        _pushed(matrix, low[g], high[g], low[g], last, forces, out)


@njit(**INTO, fastmath=FAST)
def near_values(line, along, at, coef, width, beyond, ports, n, a, b, out_a, out_b):
    """out_a[i] = V_iᵀ a and out_b[i] = V_iᵀ b for two vectors of near channels."""
    for i in range(n):
        sum_a = 0.0
        sum_b = 0.0
        if line[i] >= 0:
            d = np.uint64(ports + 2 * line[i])
            sum_a = a[d] + along[i] * a[d + ONE]
            sum_b = b[d] + along[i] * b[d + ONE]
        for k in range(beyond[i], width[i]):
            v, c = coef[i, k], np.uint64(at[i, k])
            sum_a += v[0] * a[c] + v[1] * a[c + ONE] + v[2] * a[c + TWO]
            sum_b += v[0] * b[c] + v[1] * b[c + ONE] + v[2] * b[c + TWO]
            c += THREE
            sum_a += v[3] * a[c] + v[4] * a[c + ONE] + v[5] * a[c + TWO]
            sum_b += v[3] * b[c] + v[4] * b[c + ONE] + v[5] * b[c + TWO]
        out_a[i] = sum_a
        out_b[i] = sum_b


@njit(**INNER)
def _block_image(matrix, at, part, coef, beyond, width, low, high, begin, end, linked, lined, own):
    """own[begin:end] = G V of the blocks of a row beyond its line, and [0:lined] for linked ones.

    Returns whether any is linked.
    """
    for c in range(begin, end, LINE):
        clear(own, c)
    across = False
    for a in range(beyond, width):
        g, d, v = part[a], at[a], coef[a]
        _add_block(matrix, d, v, max(low[g], begin), min(whole(high[g]), end), own)
        if linked[g] == 1:
            if not across:
                for c in range(0, lined, LINE):
                    clear(own, c)
            across = True
            _add_block(matrix, d, v, 0, lined, own)
    return across


@njit(**INNER, fastmath=FAST)
def _on_lines(lead, terms, own, out):
    """out[i] = own on the line of row i."""
    u, zeta = terms[0], terms[1]
    for i in range(lead.shape[0]):
        out[i] = u[i] * own[lead[i]] + zeta[i] * own[lead[i] + ONE]


@njit(**INNER, fastmath=FAST)
def _by_lines(g, r, lead, terms, n, lined, port, own, out):
    """out[i, j] of the lines of rows i and j, and out[i, n] at a port."""
    for i in range(n):
        u, zeta, kf, f = terms[0, i], terms[1, i], terms[2, i], terms[3, i]
        of_g, of_r = (kf * u, kf * zeta), (-f * u, -f * zeta)
        for c in range(0, lined, LINE):
            put_rows(own, c, g, lead[i], of_g)
            add_rows(own, c, r, lead[i], of_r)
        _on_lines(lead[:n], terms, own, out[i, :n])
        out[i, n] = own[port]
        out[i, i] += 1.0


@njit(**INNER, fastmath=FAST)
def _across(y, y_r, lead, terms, n, i, port, out):
    """Adds what blocks of row i do to lines, the other way too."""
    own, own_r = y[i], y_r[i]
    kf, f = terms[2, i], terms[3, i]
    out[i, n] += kf * own[port] - f * own_r[port]
    for j in range(n):
        u, zeta, c = terms[0, j], terms[1, j], lead[j]
        p = u * own[c] + zeta * own[c + ONE]
        q = u * own_r[c] + zeta * own_r[c + ONE]
        out[i, j] += kf * p - f * q
        out[j, i] += terms[2, j] * p - terms[3, j] * q


@njit(**INNER, fastmath=FAST)
def _by_blocks(order, y, y_r, at, coef, beyond, width, terms, out):
    """Adds what blocks of rows do to blocks of rows; order (w,): rows that have such blocks."""
    for first in range(order.shape[0]):
        j = order[first]
        own, own_r = y[j], y_r[j]
        kf, f = terms[2, j], terms[3, j]
        for i in order[first:]:
            p, q = 0.0, 0.0
            for a in range(beyond[i], width[i]):
                c, v = np.uint64(at[i, a]), coef[i, a]
                p += v[0] * own[c] + v[1] * own[c + ONE] + v[2] * own[c + TWO]
                q += v[0] * own_r[c] + v[1] * own_r[c + ONE] + v[2] * own_r[c + TWO]
                c += THREE
                p += v[3] * own[c] + v[4] * own[c + ONE] + v[5] * own[c + TWO]
                q += v[3] * own_r[c] + v[4] * own_r[c + ONE] + v[5] * own_r[c + TWO]
            out[j, i] += kf * p - f * q
            if i != j:
                out[i, j] += terms[2, i] * p - terms[3, i] * q


@njit(**INTO, fastmath=FAST)
def contact_matrix(
    g, r, line, along, at, part, coef, width, beyond, order, since, reach, ports, lines, low, high,
    linked, n, wide, k, f, lead, terms, y, y_r, own, out,
):  # fmt: skip
    """out[i, j] = δ_ij + (k_i + f_i) V_iᵀ G V_j − f_i V_iᵀ R V_j for rows, and in column n the same
    for V_j = the last port.

    G and R symmetric, which halves the work of blocks; lines: one past the last channel of lines
    that rows have; order, since, reach, wide: see ``near.place_rows``. Work space: lead (R,) first
    channel of a row's line; terms (4, R) its share of that channel (0 or 1) and of the next, k + f
    and f; y, y_r (R, C) G V_i and R V_i; own (C,).
    """
    lined = whole(lines)
    u, zeta, both, damped = terms[0], terms[1], terms[2], terms[3]
    for i in range(n):
        has = line[i] >= 0
        lead[i] = np.uint64(ports + 2 * line[i]) if has else np.uint64(0)
        u[i], zeta[i] = (1.0, along[i]) if has else (0.0, 0.0)
    for i in range(n):
        both[i], damped[i] = k[i] + f[i], f[i]
    _by_lines(g, r, lead, terms, n, lined, ports - 1, own, out)
    for first in range(wide):
        i = order[first]
        across = _block_image(
            g, at[i], part[i], coef[i], beyond[i], width[i], low, high, since[first], reach[first],
            linked, lined, y[i],
        )  # fmt: skip
        _block_image(
            r, at[i], part[i], coef[i], beyond[i], width[i], low, high, since[first], reach[first],
            linked, lined, y_r[i],
        )  # fmt: skip
        if across:
            _across(y, y_r, lead, terms, n, i, ports - 1, out)
    _by_blocks(order[:wide], y, y_r, at, coef, beyond, width, terms, out)


@njit(**INTO, fastmath=FAST)
def near_forces(line, along, at, coef, width, beyond, ports, top, n, x, forces):
    """forces = −Σ V_i x_i on the near channels."""
    for c in range(0, whole(top), LINE):
        clear(forces, c)
    for i in range(n):
        if x[i] != 0.0:
            if line[i] >= 0:
                c = ports + 2 * line[i]
                forces[c] -= x[i]
                forces[c + 1] -= x[i] * along[i]
            for a in range(beyond[i], width[i]):
                d = at[i, a]
                for p in range(6):
                    forces[d + p] -= x[i] * coef[i, a, p]
