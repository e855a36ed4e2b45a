"""Gear-mesh elements: a contact row for every tooth pair in contact at given stage angles.

A *gear mesh* m is one planet with ring or sun (one flank, one half of a double-helical stage).
Its pair k has the path coordinate s = s0 + k p_bt + (ds/dθ) θ at z = 0, θ being the stage angle;
the pair exists while its contact line is on the path of contact. The row of a pair is the
compression along the 3D line of action

    δ = Nᵀ (u_gear(C) − u_planet(C)) + e − gap,    F = k(s) δ + damping ,

with C = T_p − (s + t z_c) n + z e_z in planet axes and N = cosβ_b n + sinβ_b e_z. Coefficients of
large coordinates (tangential displacement and rotation about the axis) do not depend on C: arms
about the axes are base radii. A gear mesh may also be one row at the pitch point, with the summed
stiffness of its pairs or a periodic stiffness wave. Errors and their rates: ``pair_errors``.

Permanent rows follow those of gear meshes: nonlinear bearings, given forces, rotating supports.

Compiled with numba, as these loops run at every time step. ``Elements`` are constant, ``Rows`` are
work arrays (``elements``).
"""

import math

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.compiled import INNER, PART, UNCOUNTED, ZERO, as_read, njit
from flexgear.coupling.kernels.elements import Rows, packed
from flexgear.coupling.kernels.pair_errors import common_error
from flexgear.coupling.laws import COUPLED_SLICES_LAW, LINEAR_LAW, ONE_SIDED_LAW, SLICES_LAW
from flexgear.coupling.laws.slices import COUNT, DAMPER, FIRST, RELAXATION
from flexgear.coupling.pair_data import FACE_LOAD, FOLLOWING, LINE_COLUMNS, PER_PAIR, WAVE, PairData


@njit(**INNER)
def _turned(vector, ca, sa, coef):
    """Components of a 6-vector in axes rotated about z by the angle of this cosine and sine."""
    for o in range(0, 6, 3):
        coef[o] = ca * vector[o] + sa * vector[o + 1]
        coef[o + 1] = -sa * vector[o] + ca * vector[o + 1]
        coef[o + 2] = vector[o + 2]


@njit(**PART)
def fixed_rows(fixed, places, theta, rows, counts):
    """Adds permanent rows and elements after ``counts`` (rows, elements); returns the new counts.
    places: number of places of gear meshes, which those of fixed elements follow."""
    count, element_count = counts
    turned_by, ca, sa = -1, 1.0, 0.0
    for f in range(fixed.row.shape[0]):
        fixed_part, row = fixed.row[f], rows.row[count + f]
        row.kind, row.owner, row.stiffness = fixed_part.kind, fixed_part.owner, fixed_part.stiffness
        row.sided, row.line, row.beyond, row.following = 0, -1, 0, 0
        row.along, row.damping, row.offset = 0.0, 0.0, 0.0
        width = 0
        for e in range(2):
            end = fixed.end[f, e]
            if end.block >= 0:
                rows.blocks[count + f, width] = end.block
                if end.angle >= 0 and end.angle != turned_by:
                    turned_by, angle = end.angle, theta[end.angle]
                    ca, sa = math.cos(angle), math.sin(angle)
                c, s = (ca, sa) if end.angle >= 0 else (1.0, 0.0)
                _turned(fixed.vector[f, e], c, s, rows.coef[count + f, width])
                width += 1
        row.width = width
    for e in range(fixed.element.shape[0]):
        fixed_part, element = fixed.element[e], rows.element[element_count + e]
        element.law, element.rows = fixed_part.law, fixed_part.rows
        element.first, element.place = count + fixed_part.first, places + e
        for p in range(fixed.parameters.shape[1]):
            rows.parameters[element_count + e, p] = fixed.parameters[e, p]
        if fixed_part.angle >= 0:
            rows.parameters[element_count + e, fixed_part.turned] = theta[fixed_part.angle]
    return count + fixed.row.shape[0], element_count + fixed.element.shape[0]


NEIGHBOURS = 2  # first column of B in a table of slices


@njit(**INNER)
def _between(table, gear_mesh, s):
    """Rows of a table below and above the path coordinate s, and the weight of the latter."""
    last = table.shape[0] - 1
    y = min(max((s - gear_mesh.table_start) / gear_mesh.table_step, 0.0), float(last))
    at = min(int(y), last - 1)
    return table[at], table[at + 1], y - at


@njit(**INNER)
def _periodic(table, share):
    """Stiffness at the fraction ``share`` of a period; samples of the table are equidistant."""
    n = table.shape[0]
    y = (share - math.floor(share)) * n
    j = int(y)
    w = y - j
    return (1.0 - w) * table[j % n, 0] + w * table[(j + 1) % n, 0]


@njit(**INNER)
def _first_and_last(gear_mesh, base):
    """First and last index of pairs that may be in contact; of a stiffness wave the pair nearest to
    the pitch point, or both pairs beside it if teeth are blocks."""
    if gear_mesh.model == WAVE:
        place = (gear_mesh.s_pitch - base) / gear_mesh.pitch
        if gear_mesh.per_tooth == 1 or gear_mesh.planet_turns >= 0:
            return math.floor(place), math.floor(place) + 1
        return math.floor(place + 0.5), math.floor(place + 0.5)
    reach = abs(gear_mesh.slope) * gear_mesh.half_face
    return (
        math.ceil((gear_mesh.s_lo - reach - base) / gear_mesh.pitch),
        math.floor((gear_mesh.s_hi + reach - base) / gear_mesh.pitch),
    )


@njit(**INNER)
def _wrapped(tooth, teeth):
    """Tooth number brought into 0 … teeth − 1 from at most one turn outside."""
    if tooth >= teeth:
        return tooth - teeth
    return tooth + teeth if tooth < 0 else tooth


@njit(**PART)
def _find_pairs(gears, m, theta, pairs, p):
    """Stores the tooth pairs of gear mesh m in contact from ``pairs[p]`` on; returns the new p."""
    gear_mesh = gears.gear_mesh[m]
    base = gear_mesh.s0 + gear_mesh.rate * theta[gear_mesh.angle]
    common = common_error(gear_mesh, gears.runout[m], gears.harmonic[m], theta, base)
    low, high = _first_and_last(gear_mesh, base)
    # integer divisions are slow, so they are done for one pair only
    place = (low - 1) % gear_mesh.places
    tooth = (gear_mesh.gear_tooth0 + gear_mesh.gear_step * (low - 1)) % gear_mesh.gear_teeth
    other = (gear_mesh.planet_tooth0 + gear_mesh.planet_step * (low - 1)) % gear_mesh.planet_teeth
    for k in range(low, high + 1):
        place = _wrapped(place + 1, gear_mesh.places)
        tooth = _wrapped(tooth + gear_mesh.gear_step, gear_mesh.gear_teeth)
        other = _wrapped(other + gear_mesh.planet_step, gear_mesh.planet_teeth)
        s, z, gap = base + k * gear_mesh.pitch, 0.0, 0.0
        number = gear_mesh.table + gears.gear_table[m, tooth] + gears.planet_table[m, other]
        table = gears.table[number]
        if gear_mesh.model == WAVE:
            stiffness = _periodic(table, (s - gear_mesh.s_lo) / gear_mesh.pitch)
            if high > low:  # linear transition between teeth at the pitch point
                stiffness *= 1.0 - abs(s - gear_mesh.s_pitch) / gear_mesh.pitch
        else:
            a, b, w = _between(table, gear_mesh, s)
            v = 1.0 - w
            stiffness, z, gap = v * a[0] + w * b[0], v * a[1] + w * b[1], v * a[2] + w * b[2]
        if gear_mesh.model == FACE_LOAD:
            a, b, w = _between(gears.slices[number], gear_mesh, s)
            touches = (1.0 - w) * a[1] + w * b[1] > 0.0
        else:
            touches = stiffness > 0.0
        if not touches:
            continue
        pair = pairs[p]
        pair.gear_mesh, pair.place, pair.slot = (
            m,
            place,
            _wrapped(place - gear_mesh.slots, gear_mesh.slots),
        )
        pair.tooth, pair.planet_tooth, pair.table = tooth, other, number
        pair.stiffness, pair.s, pair.z, pair.share = stiffness, s, z, 1.0
        tooth_error = gears.gear_error[m, tooth] + gears.planet_error[m, other]
        pair.error = common + tooth_error + gear_mesh.error_slope * z - gap
        p += 1
    return p


@njit(**INNER)
def _shares(pairs, first, stop):
    """Sets the shares of the pairs of one row by stiffness; returns the sum of stiffness and the
    mean error."""
    total, error = 0.0, 0.0
    for q in range(first, stop):
        total += pairs[q].stiffness
    for q in range(first, stop):
        pair = pairs[q]
        pair.share = pair.stiffness / total if total > 0.0 else 1.0 / (stop - first)
        error += pair.share * pair.error
    return total, error


@njit(**INNER)
def _end(coef, share, n, at, arm):
    """Coefficients share · [N; (C − X) × N] of a block in the frame of its body; n: N; at: C − X;
    arm: of N about the axis, constant along the path."""
    nx, ny, nz = n
    x, y, z = at
    coef[0], coef[1], coef[2] = share * nx, share * ny, share * nz
    coef[3] = share * (y * nz - z * ny)
    coef[4] = share * (z * nx - x * nz)
    coef[5] = share * arm


@njit(**PART)
def _tooth_end(gears, coef, block, share, n, at):
    """Coefficients at the node of a tooth; at: C, in the frame of its body."""
    centre = gears.tooth_position[block]
    x, y, z = at[0] - centre[0], at[1] - centre[1], at[2] - centre[2]
    _end(coef, share, n, (x, y, z), x * n[1] - y * n[0])


@njit(**INNER)
def _damping_of(gear_mesh, stiffness, share):
    """Damping of tooth pairs, N s/m; share: of these pairs in the stiffness of all pairs."""
    if gear_mesh.constant_damping > 0.0:
        return gear_mesh.constant_damping * share
    return gear_mesh.damping * math.sqrt(stiffness)


@njit(**PART)
def _fill_row(gears, m, turn, rows, n, span, away, share):
    """Fills row n of gear mesh m with one pair, or with all pairs at the pitch point; returns its
    stiffness and damping.

    turn: cosine and sine of the planet's angle in the gear's frame, then of the angle of its teeth
    in planet axes; span: first pair, and one after the last; away: distance along the face from the
    centre of the contact line, m; share: of these pairs in the stiffness of all pairs.
    """
    first, stop = span
    gear_mesh, row, pairs = gears.gear_mesh[m], rows.row[n], rows.pair
    blocks, coef = rows.blocks[n], rows.coef[n]
    s, z = gear_mesh.s_pitch, 0.0
    if gear_mesh.model == PER_PAIR or gear_mesh.model == FACE_LOAD:
        z = pairs[first].z + away
        s = pairs[first].s + gear_mesh.slope * z
    cx, cy = (
        gear_mesh.tangent_x - s * gear_mesh.normal_x,
        gear_mesh.tangent_y - s * gear_mesh.normal_y,
    )
    cz = gear_mesh.z_offset + z
    ca, sa, cp, sp = turn
    bx, by, nz = (
        gear_mesh.cos_b * gear_mesh.normal_x,
        gear_mesh.cos_b * gear_mesh.normal_y,
        gear_mesh.sin_b,
    )
    normal = (ca * bx - sa * by, sa * bx + ca * by, nz)
    px = gear_mesh.center_distance + cx
    x, y = ca * px - sa * cy, sa * px + ca * cy
    total, error = _shares(pairs, first, stop)
    width = 1
    blocks[0] = gear_mesh.planet_block
    _end(coef[0], -1.0, (bx, by, nz), (cx, cy, cz), gear_mesh.planet_arm)
    row.beyond = 1 if gear_mesh.per_tooth == 1 or gear_mesh.turns >= 0 else 2
    for q in range(first, stop):
        pair = pairs[q]
        pair.row, pair.rows = n, 1
        if gear_mesh.per_tooth == 1:
            blocks[width] = gear_mesh.gear_block + pair.tooth
            _tooth_end(gears, coef[width], blocks[width], pair.share, normal, (x, y, cz))
            width += 1
    if gear_mesh.per_tooth == 0:
        blocks[width] = gear_mesh.gear_block
        _end(coef[width], 1.0, normal, (x, y, cz), gear_mesh.gear_arm)
        width += 1
    if gear_mesh.planet_turns >= 0:
        normal = (cp * bx + sp * by, cp * by - sp * bx, nz)
        x, y = cp * cx + sp * cy, cp * cy - sp * cx
        for q in range(first, stop):
            blocks[width] = gear_mesh.planet_tooth_block + pairs[q].planet_tooth
            _tooth_end(gears, coef[width], blocks[width], -pairs[q].share, normal, (x, y, cz))
            width += 1
    row.width, row.line, row.along = width, m, nz * s + gear_mesh.cos_b * z
    row.kind, row.owner, row.sided, row.following = gear_mesh.kind, m, gear_mesh.sided, 0
    damping = _damping_of(gear_mesh, total, share)
    row.stiffness, row.damping = total, damping
    row.offset = error + gear_mesh.error_slope * away - gear_mesh.gap
    return total, damping


@njit(**INNER)
def _slices_of_pair(gears, m, turn, rows, n, e, q, share):
    """Fills rows n and n + 1 and element e of pair q (``laws.slices``); share: of the pair in the
    stiffness of all pairs. Returns whether it is coupled to the next pairs (``elements``)."""
    gear_mesh, pair, element = gears.gear_mesh[m], rows.pair[q], rows.element[e]
    table, count = gears.slices[pair.table], gear_mesh.slices
    a, b, w = _between(table, gear_mesh, pair.s)
    v, parameters = 1.0 - w, rows.parameters[e]
    radius, whole = v * a[0] + w * b[0], v * a[1] + w * b[1]
    columns = 3 * count + gear_mesh.coupled * (2 * count + count * (count + 1) // 2)
    for j in range(columns):
        parameters[FIRST + j] = v * a[LINE_COLUMNS + j] + w * b[LINE_COLUMNS + j]
    for j in range(count):
        off = parameters[FIRST + j] - pair.z
        parameters[FIRST + j] = 0.5 * (1.0 + off / radius) if radius > 0.0 else 0.5
    for i in range(2):
        _fill_row(gears, m, turn, rows, n + i, (q, q + 1), radius if i == 1 else -radius, share)
        row = rows.row[n + i]
        row.sided = 0  # the law decides slice by slice
        row.stiffness *= 0.5
        row.damping *= 0.5
        for k in range(FOLLOWING):
            column = NEIGHBOURS + FOLLOWING * i + k
            rows.yields[n + i, k] = v * a[column] + w * b[column]
    pair.row, pair.rows = n, 2
    damping = _damping_of(gear_mesh, whole, share)
    parameters[COUNT], parameters[RELAXATION], parameters[DAMPER] = count, damping / whole, 0.0
    if gear_mesh.constant_damping > 0.0:
        parameters[RELAXATION], parameters[DAMPER] = 0.0, 0.5 * damping
    element.law = COUPLED_SLICES_LAW if gear_mesh.coupled == 1 else SLICES_LAW
    element.first, element.rows = n, 2
    element.place = gear_mesh.places * m + pair.place
    return rows.yields[n, 0] != 0.0


@njit(**PART)
def _rows_of_pairs(gears, m, gear_turn, planet_turn, rows, counts, span):
    """Adds rows and elements of the pairs of a span (first, stop) after ``counts`` (rows,
    elements); returns the new counts. Turns: cosine and sine of the angles of both frames."""
    count, element_count = counts
    first, stop = span
    gear_mesh = gears.gear_mesh[m]
    (c, s), (x, y) = gear_turn, (gear_mesh.radial_x, gear_mesh.radial_y)
    turn = (c * x - s * y, s * x + c * y, planet_turn[0], planet_turn[1])
    whole = 0.0
    for q in range(first, stop):
        whole += rows.pair[q].stiffness
    while first < stop:
        share = rows.pair[first].stiffness / whole if whole > 0.0 else 0.0
        if gear_mesh.model == FACE_LOAD:
            if _slices_of_pair(gears, m, turn, rows, count, element_count, first, share):
                following = min(2 * (stop - first - 1), FOLLOWING)
                for row in (rows.row[count], rows.row[count + 1]):
                    row.after, row.following = count + 2, following
            count, element_count, first = count + 2, element_count + 1, first + 1
            continue
        after = first + 1 if gear_mesh.model == PER_PAIR else stop
        share = share if gear_mesh.model == PER_PAIR else 1.0
        stiffness, damping = _fill_row(gears, m, turn, rows, count, (first, after), 0.0, share)
        parameters, element = rows.parameters[element_count], rows.element[element_count]
        element.law = ONE_SIDED_LAW if gear_mesh.sided == 1 else LINEAR_LAW
        element.first, element.rows = count, 1
        element.place = gear_mesh.places * m
        if gear_mesh.model == PER_PAIR:
            element.place += rows.pair[first].place
        parameters[0], parameters[1], parameters[2] = stiffness, damping, 0.0
        if gear_mesh.sided == 1 and gear_mesh.constant_damping > 0.0:
            parameters[1], parameters[2] = 0.0, damping
        count, element_count, first = count + 1, element_count + 1, after
    return count, element_count


@njit(**INNER)
def _cosine_and_sine(theta, angle):
    """Cosine and sine of the angle of that index, of zero for −1."""
    if angle < 0:
        return 1.0, 0.0
    return math.cos(theta[angle]), math.sin(theta[angle])


@njit(**UNCOUNTED)
def fill_rows(elements, theta, active_flanks, rows):
    """Fills ``rows`` at angles theta (A,), rad; returns numbers of rows, elements and tooth pairs.
    active_flanks (M,): 1 for gear meshes that are evaluated."""
    gears = elements.gears
    count = element_count = pairs = places = ZERO
    gear_angle, planet_angle, gear_turn, planet_turn = -1, -1, (1.0, 0.0), (1.0, 0.0)
    for m in range(gears.gear_mesh.shape[0]):
        places += gears.gear_mesh[m].places
        if active_flanks[m] == 1:
            if gears.gear_mesh[m].turns != gear_angle:
                gear_angle = gears.gear_mesh[m].turns
                gear_turn = _cosine_and_sine(theta, gear_angle)
            if gears.gear_mesh[m].planet_turns != planet_angle:
                planet_angle = gears.gear_mesh[m].planet_turns
                planet_turn = _cosine_and_sine(theta, planet_angle)
            stop = _find_pairs(gears, m, theta, rows.pair, pairs)
            count, element_count = _rows_of_pairs(
                gears, m, gear_turn, planet_turn, rows, (count, element_count), (pairs, stop)
            )
            pairs = stop
    n, element_count = fixed_rows(elements.fixed, places, theta, rows, (count, element_count))
    return n, element_count, pairs


def build_rows(data: PairData, rows: Rows, theta: Array, active_flanks: Ints) -> tuple[int, int]:
    """Fills ``rows`` as ``fill_rows``; returns the numbers of rows and of tooth pairs."""
    theta = np.ascontiguousarray(theta, dtype=float)
    n, _, pairs = fill_rows(as_read(packed(data)), theta, active_flanks, as_read(rows))
    return int(n), int(pairs)
