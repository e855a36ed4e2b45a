"""Gear-mesh elements: one contact row for every tooth pair in mesh at the angles of the stages.

A *gear mesh* m is one planet against ring or sun (one flank, one half of a double-helical stage).
Its pair index k has the path coordinate s = s0 + k p_bt + (ds/dθ) θ at z = 0, θ being the angle of
the stage; the pair exists while its helical contact line lies inside the path of contact. The row
of a pair is the compression along the 3D line of action

    δ = Nᵀ (u_gear(C) − u_planet(C)) + e − gap,    F = k(s) δ + damping ,

with C = T_p − (s + t z_c) n + z e_z in planet axes and N = cosβ_b n + sinβ_b e_z. Coefficients of
large coordinates (tangential displacement and rotation about the axis) do not vary with C: the
arms about the axes are those of the base circles. A gear mesh may also be one row at the pitch
point, with the summed stiffness of its pairs or a periodic stiffness wave.

Compiled with numba: these loops run at every time step. ``PairData`` is constant, ``PairRows`` is
the work space of one evaluation (``pair_data``). Few functions take the two whole: their many
arrays make compilation and calls dear.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from flexgear.coupling.compiled import INNER, INTO, NONE, ONE, UNCOUNTED, ZERO
from flexgear.coupling.pair_data import (
    CLEARANCE,
    LOAD,
    PER_PAIR,
    SLOTS,
    SUPPORT,
    WAVE,
)


@njit(**INNER, error_model="numpy")
def _between(start, step, n, x):
    """Where x lies in a table of n samples: index j and the weight of sample j + 1."""
    y = (x - start) / step
    if y <= 0.0:
        return 0, 0.0
    if y >= n - 1:
        return max(n - 2, 0), 1.0
    j = int(y)
    return j, y - j


@njit(**INNER, error_model="numpy")
def _value(table, t, j, w):
    """Table t between samples j and j + 1."""
    return (1.0 - w) * table[t, j] + w * table[t, min(j + 1, table.shape[1] - 1)]


@njit(**INNER, error_model="numpy")
def _periodic(table, t, share):
    """Value at ``share`` of a period; the table's samples divide the period evenly."""
    n = table.shape[1]
    y = (share - math.floor(share)) * n
    j = int(y)
    w = y - j
    return (1.0 - w) * table[t, j % n] + w * table[t, (j + 1) % n]


@njit(**INNER, error_model="numpy")
def _planet_end(coef, n, nx, ny, nz, cx, cy, cz, arm):
    """−[N; C × N] in planet axes; the moment about the axis is the same all along the path."""
    coef[n, 0, 0] = -nx
    coef[n, 0, 1] = -ny
    coef[n, 0, 2] = -nz
    coef[n, 0, 3] = -(cy * nz - cz * ny)
    coef[n, 0, 4] = -(cz * nx - cx * nz)
    coef[n, 0, 5] = -arm


@njit(**INNER, error_model="numpy")
def _gear_end(coef, n, a, weight, nx, ny, nz, x, y, z, arm):
    """+[N; (C − X) × N] in the gear's frame, (x, y, z) = C − X."""
    coef[n, a, 0] = weight * nx
    coef[n, a, 1] = weight * ny
    coef[n, a, 2] = weight * nz
    coef[n, a, 3] = weight * (y * nz - z * ny)
    coef[n, a, 4] = weight * (z * nx - x * nz)
    coef[n, a, 5] = weight * arm


@njit(**INNER, error_model="numpy")
def _turned(coef, n, a, w, angle):
    """Components of the 6-vector w along axes turned by ``angle`` about z."""
    ca, sa = math.cos(angle), math.sin(angle)
    for o in range(0, 6, 3):
        coef[n, a, o] = ca * w[o] + sa * w[o + 1]
        coef[n, a, o + 1] = -sa * w[o] + ca * w[o + 1]
        coef[n, a, o + 2] = w[o + 2]


@njit(**INNER, error_model="numpy")
def _runout(amplitude, rate, phase, angle, m, theta):
    total = 0.0
    for h in range(amplitude.shape[1]):
        a = amplitude[m, h]
        if a != 0.0:
            total += a * math.sin(rate[m, h] * theta[angle[m, h]] + phase[m, h])
    return total


@njit(**INNER, error_model="numpy")
def _wrapped(tooth, teeth):
    if tooth >= teeth:
        return tooth - teeth
    return tooth + teeth if tooth < 0 else tooth


@njit(inline="always")
def find_pairs(d, rows, theta, wanted):
    """Note the tooth pairs in contact at ``theta`` in ``rows.pair_…``; their number.

    Pairs of a gear mesh follow each other. A stiffness wave has one pair, the nearest to the pitch
    point.
    """
    p = NONE
    samples = d.k_table.shape[1]
    for m in range(d.s0.shape[0]):
        if wanted[m] == 0:
            continue
        pitch, t, waves = d.pitch[m], np.uint64(d.table[m]), d.model[m] == WAVE
        base = d.s0[m] + d.rate[m] * theta[d.angle[m]]
        common = d.error_offset[m] + _runout(
            d.runout_amplitude, d.runout_rate, d.runout_phase, d.runout_angle, m, theta
        )
        if waves:
            low = high = math.floor((d.s_pitch[m] - base) / pitch + 0.5)
        else:
            reach = abs(d.slope[m]) * d.half_face[m]
            low = math.ceil((d.s_lo[m] - reach - base) / pitch)
            high = math.floor((d.s_hi[m] + reach - base) / pitch)
        if d.error_amplitude[m] != 0.0:  # a wave of the pitch is the same at every pair
            wave = math.sin(2 * math.pi * base / pitch + d.error_phase[m])
            common += d.error_amplitude[m] * wave
        # one tooth before the first
        teeth, others = d.gear_teeth[m], d.planet_teeth[m]
        step, other_step = d.gear_step[m], d.planet_step[m]
        tooth = (d.gear_tooth0[m] + step * (low - 1)) % teeth
        other = (d.planet_tooth0[m] + other_step * (low - 1)) % others
        start, spacing, s_lo = d.table_start[t], d.table_step[t], d.s_lo[m]
        for k in range(low, high + 1):
            s, z = base + k * pitch, 0.0
            tooth = _wrapped(tooth + step, teeth)
            other = _wrapped(other + other_step, others)
            if waves:
                stiffness = _periodic(d.k_table, t, (s - s_lo) / pitch)
            else:
                j, w = _between(start, spacing, samples, s)
                stiffness = _value(d.k_table, t, j, w)
                if stiffness <= 0.0:
                    continue
                z = _value(d.z_table, t, j, w)
            error = d.error_gear[m, np.uint64(tooth)] + d.error_planet[m, np.uint64(other)]
            rows.pair_mesh[p] = m
            rows.pair_slot[p] = k % SLOTS
            rows.pair_index[p] = k
            rows.pair_tooth[p] = tooth
            rows.pair_planet_tooth[p] = other
            rows.pair_stiffness[p] = stiffness
            rows.pair_s[p] = s
            rows.pair_z[p] = z
            rows.pair_share[p] = 1.0
            rows.pair_error[p] = common + error
            p += ONE
    return p


@njit(inline="always")
def _rows_of_pairs(d, rows, theta, pairs, complete):
    """One row a pair at the centroid of its contact line, or one a gear mesh at the pitch point.

    complete: coefficients of blocks that the row's line of action holds, too.
    """
    coef = rows.coef
    n = q = NONE
    frame, ct, st = -1, 1.0, 0.0
    while q < pairs:
        mesh = rows.pair_mesh[q]
        m = np.uint64(mesh)
        last = q + ONE
        while last < pairs and rows.pair_mesh[last] == mesh:
            last += ONE
        if d.turns[m] != frame:
            frame = d.turns[m]
            ct, st = (math.cos(theta[frame]), math.sin(theta[frame])) if frame >= 0 else (1.0, 0.0)
        ca = ct * d.radial[m, 0] - st * d.radial[m, 1]
        sa = st * d.radial[m, 0] + ct * d.radial[m, 1]
        tx, ty = d.tangent_point[m, 0], d.tangent_point[m, 1]
        fx, fy, cos_b = d.normal[m, 0], d.normal[m, 1], d.cos_b[m]
        bx, by = cos_b * fx, cos_b * fy
        nx, ny, nz = ca * bx - sa * by, sa * bx + ca * by, d.sin_b[m]
        own, of_teeth = d.model[m] == PER_PAIR, d.per_tooth[m] == 1
        s_pitch, damping, gap, kind = d.s_pitch[m], d.damping[m], d.gap[m], d.kind[m]
        sided = d.sided[m]
        planet_block, gear_block = d.planet_block[m], d.gear_block[m]
        held = 1 if of_teeth or d.turns[m] >= 0 else 2
        while q < last:
            first, after = q, (q + ONE if own else last)
            s, z = s_pitch, 0.0
            if own:
                z = rows.pair_z[q]
                s = rows.pair_s[q] + d.slope[m] * z
            cz = d.z_offset[m] + z
            cx = tx - s * fx
            cy = ty - s * fy
            px = d.center_distance[m] + cx
            x, y = ca * px - sa * cy, sa * px + ca * cy
            total, count = 0.0, 0.0
            for r in range(first, after):
                total += rows.pair_stiffness[r]
                count += 1.0
            error = 0.0
            width = ZERO + 1
            for r in range(first, after):
                share = 1.0
                if not own:
                    share = rows.pair_stiffness[r] / total if total > 0.0 else 1.0 / count
                rows.pair_row[r] = n
                rows.pair_share[r] = share
                error += share * rows.pair_error[r]
                if of_teeth:
                    block = gear_block + rows.pair_tooth[r]
                    at = np.uint64(block)
                    dx = x - d.tooth_position[at, 0]
                    dy = y - d.tooth_position[at, 1]
                    dz = cz - d.tooth_position[at, 2]
                    rows.blocks[n, width] = block
                    _gear_end(coef, n, width, share, nx, ny, nz, dx, dy, dz, dx * ny - dy * nx)
                    width += 1
            if not of_teeth:
                rows.blocks[n, 1] = gear_block
                if complete or held == 1:
                    _gear_end(coef, n, width, 1.0, nx, ny, nz, x, y, cz, d.gear_arm[m])
                width += 1
            rows.blocks[n, 0] = planet_block
            if complete:
                _planet_end(coef, n, bx, by, nz, cx, cy, cz, d.planet_arm[m])
            rows.width[n] = width
            rows.line[n] = mesh
            rows.along[n] = nz * s + cos_b * z
            rows.beyond[n] = held
            rows.kind[n] = kind
            rows.owner[n] = mesh
            rows.sided[n] = sided
            rows.stiffness[n] = total
            rows.damping[n] = damping * math.sqrt(total)
            rows.offset[n] = error - gap
            n += ONE
            q = after
    return np.int64(n)


@njit(**INNER, error_model="numpy")
def _bearing_ends(coef, n, blocks, turn, c, x, y):
    """Coefficients of a bearing row along (x, y) in the row's axes; number of its blocks."""
    m = 0
    for b in range(2):
        if blocks[c, b] < 0:
            continue
        ca, sa = math.cos(turn[c, b]), math.sin(turn[c, b])
        sign = 1.0 if b == 0 else -1.0
        for p in range(6):
            coef[n, m, p] = 0.0
        coef[n, m, 0] = sign * (ca * x - sa * y)
        coef[n, m, 1] = sign * (sa * x + ca * y)
        m += 1
    return m


@njit(inline="always")
def _other_rows(d, rows, theta, n):
    """Turning supports, bearings with clearance and given forces, in this order."""
    coef = rows.coef
    start = n
    for r in range(d.support_stiffness.shape[0]):
        rows.kind[n], rows.sided[n] = SUPPORT, 0
        rows.stiffness[n], rows.offset[n] = d.support_stiffness[r], 0.0
        m = 0
        for b in range(2):
            if d.support_block[r, b] < 0:
                continue
            rows.blocks[n, m] = d.support_block[r, b]
            a = d.support_angle[r, b]
            _turned(coef, n, m, d.support_vector[r, b], theta[a] if a >= 0 else 0.0)
            m += 1
        rows.width[n] = m
        n += 1
    for c in range(d.clearance_stiffness.shape[0]):
        # a bearing pushes along the line of its centres; the tangent of k (|u| − gap) is k along
        # the displacement, k (1 − gap/|u|) across it
        x, y = rows.direction[c, 0], rows.direction[c, 1]
        stiffness = d.clearance_stiffness[c]
        for across in range(2):
            rows.kind[n], rows.sided[n] = CLEARANCE, 1 - across
            rows.stiffness[n] = rows.direction[c, 2] * stiffness if across == 1 else stiffness
            rows.offset[n] = 0.0 if across == 1 else -d.clearance_gap[c]
            m = 0
            for b in range(2):
                if d.clearance_block[c, b] >= 0:
                    rows.blocks[n, m] = d.clearance_block[c, b]
                    m += 1
            ux, uy = (-y, x) if across == 1 else (x, y)
            rows.width[n] = _bearing_ends(coef, n, d.clearance_block, d.clearance_turn, c, ux, uy)
            n += 1
    for k in range(d.load_block.shape[0]):
        # a row's force acts as −x coef on its block: unit amplitude, the vector in the coefficients
        rows.kind[n], rows.sided[n] = LOAD, 0
        rows.stiffness[n], rows.offset[n] = 0.0, 1.0
        a = d.load_angle[k]
        rows.blocks[n, 0] = d.load_block[k]
        _turned(coef, n, ZERO, d.load_vector[k], theta[a] if a >= 0 else 0.0)
        for p in range(6):
            coef[n, 0, p] = -coef[n, 0, p]
        rows.width[n] = 1
        n += 1
    for i in range(start, n):
        rows.owner[i] = i - start
        rows.damping[i] = 0.0
        rows.line[i], rows.along[i], rows.beyond[i] = -1, 0.0, 0
    return n


@njit(inline="always")
def _built(d, rows, theta, wanted, complete):
    pairs = find_pairs(d, rows, theta, wanted)
    n = _rows_of_pairs(d, rows, theta, pairs, complete)
    n = _other_rows(d, rows, theta, n)
    return n, np.int64(pairs)


@njit(**UNCOUNTED, error_model="numpy", forceinline=True)
def build_rows(d, rows, theta, wanted):
    """Fill ``rows`` at the angles ``theta`` (A,) rad; return (number of rows, number of pairs).

    wanted (M,): 1 where a gear mesh is to be looked at.
    """
    return _built(d, rows, theta, wanted, True)


@njit(**INTO, error_model="numpy")
def build_rows_beyond(d, rows, theta, wanted):
    """The same without the coefficients of blocks that lines of action hold: ``coef`` of a row is
    filled from block ``beyond`` on."""
    return _built(d, rows, theta, wanted, False)


@njit(inline="always")
def contact_forces(d, rows, theta, wanted, pair_load, other_load, out):
    """Generalised contact forces −Σ V F on the blocks, (≥ 6 n_blocks,), from stored pair loads.

    pair_load: (M, SLOTS) N; other_load: (extra rows,) N. ``out`` is overwritten. Returns rows.
    Directions of clearance rows are those in ``rows``.
    """
    n, p = build_rows(d, rows, theta, wanted)
    for c in range(out.shape[0]):
        out[c] = 0.0
    for q in range(p):
        r = rows.pair_row[q]
        load = pair_load[rows.pair_mesh[q], rows.pair_slot[q]]
        if load == 0.0:
            continue
        for m in range(rows.width[r]):  # loads of pairs that share a row add up to its force
            b = rows.blocks[r, m]
            for o in range(6):
                out[6 * b + o] -= load * rows.coef[r, m, o]
    for r in range(n):
        if rows.kind[r] >= 0:
            continue
        load = other_load[rows.owner[r]]
        for m in range(rows.width[r]):
            b = rows.blocks[r, m]
            for o in range(6):
                out[6 * b + o] -= load * rows.coef[r, m, o]
    return n
