"""Products with channels at hand (``near.py``): modes, receptances and contact rows.

Loops run from 0 over slices: compiled indices that might be negative are not vectorised.
"""

from __future__ import annotations

from numba import njit

from flexgear.coupling.compiled import FAST, INNER


@njit(**INNER, fastmath=FAST)
def _moved(modes, low, high, start, stop, a, b, out_a, out_b):
    """out += modes[:, start:stop] @ (a, b)[start:stop] for channels low … high − 1."""
    part_a, part_b = a[start:stop], b[start:stop]
    for c in range(low, high):
        row = modes[c, start:stop]
        sum_a = 0.0
        sum_b = 0.0
        for j in range(stop - start):
            sum_a += row[j] * part_a[j]
            sum_b += row[j] * part_b[j]
        out_a[c] += sum_a
        out_b[c] += sum_b


@njit(**INNER, fastmath=FAST)
def moved(modes, ports, first, used, rigid, elastic, a, b, out_a, out_b):
    """out_a = modes @ a and out_b = modes @ b over the channels in use."""
    for c in range(modes.shape[0]):
        out_a[c] = 0.0
        out_b[c] = 0.0
    _moved(modes, 0, ports, 0, modes.shape[1], a, b, out_a, out_b)
    for g in range(first.shape[0]):
        low = ports + 6 * first[g]
        high = low + 6 * used[g]
        if rigid[g] > 0:
            _moved(modes, low, high, 0, rigid[g], a, b, out_a, out_b)
        _moved(modes, low, high, elastic[g, 0], elastic[g, 1], a, b, out_a, out_b)


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
def pushed(modes, ports, first, used, rigid, elastic, forces, out):
    """out = modesᵀ @ forces over the channels in use."""
    n = modes.shape[1]
    for j in range(n):
        out[j] = 0.0
    for c in range(ports):
        f = forces[c]
        if f != 0.0:
            for j in range(n):
                out[j] += f * modes[c, j]
    for g in range(first.shape[0]):
        low = ports + 6 * first[g]
        high = low + 6 * used[g]
        if rigid[g] > 0:
            _pushed(modes, low, high, 0, rigid[g], forces, out)
        _pushed(modes, low, high, elastic[g, 0], elastic[g, 1], forces, out)


@njit(**INNER, fastmath=FAST)
def answered(matrix, ports, first, used, forces, out):
    """out = matrix @ forces for a symmetric matrix of near channels that respects groups."""
    for c in range(out.shape[0]):
        out[c] = 0.0
    for d in range(ports):
        f = forces[d]
        if f != 0.0:
            for c in range(out.shape[0]):
                out[c] += f * matrix[d, c]
    for g in range(first.shape[0]):
        low = ports + 6 * first[g]
        high = low + 6 * used[g]
        part = out[low:high]
        for d in range(low, high):
            f = forces[d]
            if f != 0.0:
                line = matrix[d, low:high]
                for c in range(high - low):
                    part[c] += f * line[c]
                for c in range(ports):
                    out[c] += f * matrix[d, c]


@njit(**INNER, fastmath=FAST)
def near_values(at, coef, width, n, a, b, out_a, out_b):
    """out_a[i] = V_iᵀ a and out_b[i] = V_iᵀ b for two vectors of near channels."""
    for i in range(n):
        sum_a = 0.0
        sum_b = 0.0
        for k in range(width[i]):
            d = at[i, k]
            for p in range(6):
                sum_a += coef[i, k, p] * a[d + p]
                sum_b += coef[i, k, p] * b[d + p]
        out_a[i] = sum_a
        out_b[i] = sum_b


@njit(**INNER, fastmath=FAST)
def near_products(
    matrix, at, part, coef, width, reach, low, high, n, column, y, image, out, out_column
):
    """out[i, j] = V_iᵀ G V_j, out_column[i] = V_iᵀ G e_column; G symmetric.

    low, high: (G,) channels of the groups; y (C,) and image (C, R), G V, are work space. Every
    inner loop runs over contiguous numbers.
    """
    for j in range(n):
        for c in range(reach[j]):
            y[c] = 0.0
        total = 0.0
        for a in range(width[j]):
            d, g = at[j, a], part[j, a]
            start, stop = low[g], min(high[g], reach[j])
            v0, v1, v2 = coef[j, a, 0], coef[j, a, 1], coef[j, a, 2]
            v3, v4, v5 = coef[j, a, 3], coef[j, a, 4], coef[j, a, 5]
            m0, m1, m2 = matrix[d, start:stop], matrix[d + 1, start:stop], matrix[d + 2, start:stop]
            m3, m4, m5 = (
                matrix[d + 3, start:stop], matrix[d + 4, start:stop], matrix[d + 5, start:stop],
            )  # fmt: skip
            own = y[start:stop]
            for c in range(stop - start):
                own[c] += (
                    v0 * m0[c] + v1 * m1[c] + v2 * m2[c] + v3 * m3[c] + v4 * m4[c] + v5 * m5[c]
                )
            for p in range(6):
                total += coef[j, a, p] * matrix[d + p, column]
        out_column[j] = total
        for c in range(reach[j]):
            image[c, j] = y[c]
    for i in range(n):
        for j in range(i + 1):
            out[i, j] = 0.0
        for a in range(width[i]):
            d = at[i, a]
            v0, v1, v2 = coef[i, a, 0], coef[i, a, 1], coef[i, a, 2]
            v3, v4, v5 = coef[i, a, 3], coef[i, a, 4], coef[i, a, 5]
            for j in range(i + 1):
                out[i, j] += (
                    v0 * image[d, j]
                    + v1 * image[d + 1, j]
                    + v2 * image[d + 2, j]
                    + v3 * image[d + 3, j]
                    + v4 * image[d + 4, j]
                    + v5 * image[d + 5, j]
                )
    for i in range(n):
        for j in range(i):
            out[j, i] = out[i, j]


@njit(**INNER, fastmath=FAST)
def near_forces(at, coef, width, n, x, forces):
    """forces = −Σ V_i x_i on the near channels."""
    for c in range(forces.shape[0]):
        forces[c] = 0.0
    for i in range(n):
        if x[i] != 0.0:
            for a in range(width[i]):
                d = at[i, a]
                for p in range(6):
                    forces[d + p] -= x[i] * coef[i, a, p]
