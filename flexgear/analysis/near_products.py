"""Products with channels at hand (``near.py``): modes, receptances and contact rows.

A row V_i is w₀ + ζ w₁ on the two channels of its line of action, and six coefficients on each
block beyond. Channels are c = 0 … C − 1: P ports, lines, slots; those of two groups, or of the
head and a group that is not linked to it, do not move one another. Loops run from 0 over slices:
compiled indices that might be negative are not vectorised (or scattered one by one), nor are loops
over many arrays, whose overlap would have to be ruled out at every call.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flexgear.coupling.compiled import FAST, INNER

ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)  # unsigned: never counted from the end
LINE = 8  # numbers in a cache line: work arrays begin with one, and whole ones are taken


@njit(**INNER, fastmath=FAST)
def _moved(shapes, low, high, start, stop, a, out):
    """out[low:high] += shapes[start:stop, low:high]ᵀ @ a[start:stop], six modes at once."""
    to = out[low:high]
    j = start
    while j + 5 < stop:
        a0, a1, a2, a3, a4, a5 = a[j], a[j + 1], a[j + 2], a[j + 3], a[j + 4], a[j + 5]
        s0, s1, s2 = shapes[j, low:high], shapes[j + 1, low:high], shapes[j + 2, low:high]
        s3, s4, s5 = shapes[j + 3, low:high], shapes[j + 4, low:high], shapes[j + 5, low:high]
        for c in range(high - low):
            to[c] += a0 * s0[c] + a1 * s1[c] + a2 * s2[c] + a3 * s3[c] + a4 * s4[c] + a5 * s5[c]
        j += 6
    while j < stop:
        a0, s0 = a[j], shapes[j, low:high]
        for c in range(high - low):
            to[c] += a0 * s0[c]
        j += 1


@njit(**INNER, fastmath=FAST)
def moved(shapes, head, span, low, high, rigid, elastic, a, out):
    """out = modes @ a over the channels in use."""
    for c in range(head):
        out[c] = 0.0
    _moved(shapes, 0, head, 0, span[0], a, out)
    _moved(shapes, 0, head, span[1], span[2], a, out)
    for g in range(low.shape[0]):
        to = out[low[g] : high[g]]
        for c in range(to.shape[0]):
            to[c] = 0.0
        if rigid[g] > 0:
            _moved(shapes, low[g], high[g], 0, rigid[g], a, out)
        _moved(shapes, low[g], high[g], elastic[g, 0], elastic[g, 1], a, out)


@njit(**INNER, fastmath=FAST)
def _pushed(modes, low, high, start, stop, forces, out):
    """out[start:stop] += modes[low:high, start:stop]ᵀ @ forces[low:high], six rows at once."""
    part = out[start:stop]
    for c in range(low, high, 6):
        f0, f1, f2 = forces[c], forces[c + 1], forces[c + 2]
        f3, f4, f5 = forces[c + 3], forces[c + 4], forces[c + 5]
        if f0 == 0.0 and f1 == 0.0 and f2 == 0.0 and f3 == 0.0 and f4 == 0.0 and f5 == 0.0:
            continue
        m0, m1, m2 = modes[c, start:stop], modes[c + 1, start:stop], modes[c + 2, start:stop]
        m3, m4, m5 = modes[c + 3, start:stop], modes[c + 4, start:stop], modes[c + 5, start:stop]
        for j in range(stop - start):
            part[j] += f0 * m0[j] + f1 * m1[j] + f2 * m2[j] + f3 * m3[j] + f4 * m4[j] + f5 * m5[j]


@njit(**INNER, fastmath=FAST)
def _pushed_by_head(modes, ports, lines, start, stop, forces, out):
    """The same for ports and lines."""
    part = out[start:stop]
    for c in range(ports):
        f, m = forces[c], modes[c, start:stop]
        if f != 0.0:
            for j in range(stop - start):
                part[j] += f * m[j]
    for c in range(ports, lines, 2):
        f0, f1, m0, m1 = forces[c], forces[c + 1], modes[c, start:stop], modes[c + 1, start:stop]
        if f0 != 0.0 or f1 != 0.0:
            for j in range(stop - start):
                part[j] += f0 * m0[j] + f1 * m1[j]


@njit(**INNER, fastmath=FAST)
def pushed(modes, ports, lines, span, low, high, rigid, elastic, forces, out):
    """out = modesᵀ @ forces over the channels in use; lines: one past the last that takes force."""
    for j in range(modes.shape[1]):
        out[j] = 0.0
    _pushed_by_head(modes, ports, lines, 0, span[0], forces, out)
    _pushed_by_head(modes, ports, lines, span[1], span[2], forces, out)
    for g in range(low.shape[0]):
        if rigid[g] > 0:
            _pushed(modes, low[g], high[g], 0, rigid[g], forces, out)
        _pushed(modes, low[g], high[g], elastic[g, 0], elastic[g, 1], forces, out)


@njit(**INNER, fastmath=FAST)
def add_line(matrix, d, f, start, stop, out):
    """out[start:stop] += f matrix[d, start:stop]."""
    line, to = matrix[d, start:stop], out[start:stop]
    for c in range(stop - start):
        to[c] += f * line[c]


@njit(**INNER, fastmath=FAST)
def answered(matrix, lines, head, low, high, linked, top, forces, out):
    """out = matrix @ forces for a symmetric matrix of near channels that respects groups."""
    for c in range(top):
        out[c] = 0.0
    for d in range(lines):
        f = forces[d]
        if f != 0.0:
            add_line(matrix, d, f, 0, head, out)
            for g in range(low.shape[0]):
                if linked[g] == 1:
                    add_line(matrix, d, f, low[g], high[g], out)
    for g in range(low.shape[0]):
        _pushed(matrix, low[g], high[g], low[g], high[g], forces, out)
        if linked[g] == 1:
            _pushed(matrix, low[g], high[g], 0, head, forces, out)


@njit(**INNER, fastmath=FAST)
def near_values(line, along, at, coef, width, beyond, ports, n, a, b, out_a, out_b):
    """out_a[i] = V_iᵀ a and out_b[i] = V_iᵀ b for two vectors of near channels."""
    for i in range(n):
        sum_a = 0.0
        sum_b = 0.0
        if line[i] >= 0:
            c = ports + 2 * line[i]
            sum_a = a[c] + along[i] * a[c + 1]
            sum_b = b[c] + along[i] * b[c + 1]
        for k in range(beyond[i], width[i]):
            v, start = coef[i, k], at[i, k]
            own_a, own_b = a[start : start + 6], b[start : start + 6]
            for p in range(6):
                sum_a += v[p] * own_a[p]
                sum_b += v[p] * own_b[p]
        out_a[i] = sum_a
        out_b[i] = sum_b


@njit(**INNER, fastmath=FAST)
def _line_image(g, c, zeta, start, stop, y):
    """y = G (e_c + ζ e_{c+1}) on start … stop − 1."""
    g0, g1, to = g[c, start:stop], g[c + ONE, start:stop], y[start:stop]
    for k in range(stop - start):
        to[k] = g0[k] + zeta * g1[k]


@njit(**INNER, fastmath=FAST)
def _line_images(matrix, lead, terms, n, lined, y):
    """y[j] = G (u e_c + ζ e_{c+1}) on channels 0 … lined − 1 for rows j < n, c = lead[j]."""
    for j in range(n):
        u, zeta, c = terms[j, 0], terms[j, 1], lead[j]
        g0, g1, to = matrix[c, :lined], matrix[c + ONE, :lined], y[j, :lined]
        for k in range(lined):
            to[k] = u * g0[k] + zeta * g1[k]


@njit(**INNER, fastmath=FAST)
def _block_image(g, d, v, start, stop, y):
    """y += G v on start … stop − 1, v (6,) on channels d … d + 5."""
    v0, v1, v2, v3, v4, v5 = v[0], v[1], v[2], v[3], v[4], v[5]
    g0, g1, g2 = g[d, start:stop], g[d + 1, start:stop], g[d + 2, start:stop]
    g3, g4, g5 = g[d + 3, start:stop], g[d + 4, start:stop], g[d + 5, start:stop]
    to = y[start:stop]
    for k in range(stop - start):
        to[k] += v0 * g0[k] + v1 * g1[k] + v2 * g2[k] + v3 * g3[k] + v4 * g4[k] + v5 * g5[k]


@njit(**INNER, fastmath=FAST)
def _block_images(
    matrix, lead, terms, at, part, coef, width, beyond, since, reach, low, high, linked, lined,
    wide, y,
):  # fmt: skip
    """y[j] += G V_j for rows j < wide: blocks beyond lines everywhere, lines on linked groups."""
    for j in range(wide):
        begin, end = since[j], reach[j]
        to = y[j, begin:end]
        for d in range(end - begin):
            to[d] = 0.0
        for b in range(low.shape[0]):
            first = max(low[b] - low[b] % LINE, begin)
            last = min(high[b] + -high[b] % LINE, end)
            if linked[b] == 1 and terms[j, 0] != 0.0 and first < last:
                _line_image(matrix, lead[j], terms[j, 1], first, last, y[j])
        for a in range(beyond[j], width[j]):
            b, d, v = part[j, a], at[j, a], coef[j, a]
            first = max(low[b] - low[b] % LINE, begin)
            _block_image(matrix, d, v, first, min(high[b] + -high[b] % LINE, end), y[j])
            if linked[b] == 1:
                _block_image(matrix, d, v, 0, lined, y[j])


@njit(**INNER, fastmath=FAST)
def _values_on_lines(own, own_r, lead, terms, right, below):
    """right[i] and below[i] of a row and those after it so far as they move along lines."""
    kf, f = terms[0, 2], terms[0, 3]
    for i in range(lead.shape[0]):
        c, u, zeta = lead[i], terms[i, 0], terms[i, 1]
        p = u * own[c] + zeta * own[c + ONE]
        q = u * own_r[c] + zeta * own_r[c + ONE]
        right[i] = kf * p - f * q
        below[i] = terms[i, 2] * p - terms[i, 3] * q


@njit(**INNER, fastmath=FAST)
def _values_on_blocks(own, own_r, at, coef, width, beyond, terms, right, below):
    """The same of the blocks beyond, added."""
    kf, f = terms[0, 2], terms[0, 3]
    for i in range(at.shape[0]):
        p, q = 0.0, 0.0
        for a in range(beyond[i], width[i]):
            c, v = np.uint64(at[i, a]), coef[i, a]
            p += v[0] * own[c] + v[1] * own[c + ONE] + v[2] * own[c + TWO]
            q += v[0] * own_r[c] + v[1] * own_r[c + ONE] + v[2] * own_r[c + TWO]
            c += THREE
            p += v[3] * own[c] + v[4] * own[c + ONE] + v[5] * own[c + TWO]
            q += v[3] * own_r[c] + v[4] * own_r[c + ONE] + v[5] * own_r[c + TWO]
        right[i] += kf * p - f * q
        if i > 0:
            below[i] += terms[i, 2] * p - terms[i, 3] * q


@njit(**INNER, fastmath=FAST)
def contact_matrix(
    g, r, line, along, at, part, coef, width, beyond, since, reach, ports, lines, low, high,
    linked, n, wide, k, f, lead, terms, y, y_r, out,
):  # fmt: skip
    """out[i, j] = δ_ij + (k_i + f_i) V_iᵀ G V_j − f_i V_iᵀ R V_j; y[i, t] = V_iᵀ G e_t for the
    ports t, y_r the same of R.

    G and R symmetric, which halves the work; lines: one past the last channel of lines that rows
    have; wide: one past the last row with blocks beyond its line; since and reach: slot channels
    that rows j … n − 1 touch. Work space: lead (R,) first channel of a row's line; terms (R, 4)
    its share of that channel (0 or 1) and of the next, k + f and f; y, y_r (R, C) G V_i and R V_i.
    """
    lined = lines + -lines % LINE
    for i in range(n):
        has = line[i] >= 0
        lead[i] = np.uint64(ports + 2 * line[i]) if has else np.uint64(0)
        terms[i, 0], terms[i, 1] = (1.0, along[i]) if has else (0.0, 0.0)
        terms[i, 2], terms[i, 3] = k[i] + f[i], f[i]
    _line_images(g, lead, terms, n, lined, y)
    _line_images(r, lead, terms, n, lined, y_r)
    for which in range(2):
        _block_images(
            g if which == 0 else r, lead, terms, at, part, coef, width, beyond, since, reach, low,
            high, linked, lined, wide, y if which == 0 else y_r,
        )  # fmt: skip
    for j in range(n):
        right, below = out[j, j:n], out[j:n, j]
        _values_on_lines(y[j], y_r[j], lead[j:n], terms[j:n], right, below)
        if j < wide:
            _values_on_blocks(
                y[j], y_r[j], at[j:wide], coef[j:wide], width[j:wide], beyond[j:wide],
                terms[j:wide], right, below,
            )  # fmt: skip
        out[j, j] += 1.0


@njit(**INNER, fastmath=FAST)
def near_forces(line, along, at, coef, width, beyond, ports, top, n, x, forces):
    """forces = −Σ V_i x_i on the near channels."""
    for c in range(top):
        forces[c] = 0.0
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
