"""Products with channels at hand (``near.py``): modes, receptances and values of contact rows.

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

from flexgear.analysis.wide import WIDE, add_rows, clear
from flexgear.coupling.compiled import FAST, INNER, INTO, ONE, ZERO

TWO, THREE = np.uint64(2), np.uint64(3)
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
def add_block(matrix, d, v, low, high, out):
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
    _add_lines(shapes, ZERO, span[0], a, ZERO, head, out)
    _add_lines(shapes, span[1], span[2], a, ZERO, head, out)
    for g in range(low.shape[0]):
        first, last = low[g], whole(high[g])
        for c in range(first, last, LINE):
            clear(out, c)
        _add_lines(shapes, ZERO, rigid[g], a, first, last, out)
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
            add_block(modes, c, f, start, stop, out)


@njit(**INTO)
def pushed(modes, lines, span, low, high, rigid, elastic, forces, out):
    """out = modesᵀ @ forces over the channels in use; lines: one past the last that takes force."""
    for j in range(0, modes.shape[1], LINE):
        clear(out, j)
    _add_lines(modes, ZERO, lines, forces, ZERO, span[0], out)
    _add_lines(modes, ZERO, lines, forces, span[1], span[2], out)
    for g in range(low.shape[0]):
        _pushed(modes, low[g], high[g], ZERO, rigid[g], forces, out)
        _pushed(modes, low[g], high[g], elastic[g, 0], elastic[g, 1], forces, out)


@njit(**INNER)
def answered(matrix, lines, head, low, high, linked, top, forces, out):
    """out = matrix @ forces for a symmetric matrix of near channels that respects groups."""
    for c in range(0, whole(top), LINE):
        clear(out, c)
    _add_lines(matrix, ZERO, lines, forces, ZERO, head, out)
    for g in range(low.shape[0]):
        last = whole(high[g])
        if linked[g] == 1:
            _add_lines(matrix, ZERO, lines, forces, low[g], last, out)
            _pushed(matrix, low[g], high[g], ZERO, head, forces, out)
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
