"""Gear-mesh forces of many sets of errors at once, position by position: see ``error_sets``."""

from typing import NamedTuple

import numpy as np

from flexgear.analysis.kernels.static_contact import EXACT, ContactSet, solve_set, with_right
from flexgear.analysis.kernels.static_position import CLOSURE, solve_position
from flexgear.arrays import Array
from flexgear.compiled import njit

MAX_GROWTH = 1e4  # gaps over forces, above which the set of rows is singular


class Waves(NamedTuple):
    """Errors of J sets with j as last axis; harmonics as factors of sine and cosine; m and m/m."""

    offset: Array  # (M, J)
    slope: Array  # (M, J)
    sine: Array  # (M, J)
    cosine: Array  # (M, J)
    gear: Array  # (M, z, J)
    planet: Array  # (M, z_p, J)
    runout_sine: Array  # (M, H, J)
    runout_cosine: Array  # (M, H, J)


@njit(nogil=True)
def forces_under_errors(laws, positions, span, train, waves, work, force):
    """Compute the forces (p, M, J) of positions span[0] … span[1] − 1, N; returns the index of the
    first position without equilibrium, or span[1]. positions: angles (p, A), torques (p, P),
    forward (p,); see ``solve_position``."""
    theta, port_torques, forward = positions
    gear_meshes, rows, contact = work.elements.gears.gear_mesh, work.rows, work.contact
    active_flanks, out = np.ones(len(gear_meshes), dtype=np.int64), np.zeros(len(contact.right))
    extra = train.motions.shape[1]
    for p in range(span[0], span[1]):
        n, _, pairs, closure = solve_position(
            laws, theta[p], port_torques[p], forward[p], active_flanks, train, work, out
        )
        if not closure <= CLOSURE:
            return p
        # ``contact`` has the whole matrix and the right side without errors
        q0, influence, places, loaded, residual = _eliminated(
            contact, gear_meshes, rows, n, extra, forward[p]
        )
        if not residual <= CLOSURE:
            return p
        errors = _row_errors(work.elements.gears, rows, pairs, theta[p], waves, n)
        x = _linear_solution(q0, influence, places, errors)
        _release_tension(x, influence, places, loaded, errors, work, n, extra, out)
        for a in range(len(places)):
            force[p, rows.row[places[a]].owner] += x[a]
    return span[1]


@njit()
def _eliminated(contact, gear_meshes, rows, n, extra, forward):
    """x_S and y_B of the c gear-mesh rows without errors (c,), N, and per error (c, c), N/m; their
    row numbers (c,); 1 for rows in S (c,); and the residual of the inverse."""
    matrix, right = contact.matrix, contact.right
    inside = np.empty(n + extra, dtype=np.int64)  # rows of S
    place = np.full(n, -1, dtype=np.int64)  # index of a row in S
    places = np.empty(n, dtype=np.int64)
    loaded = np.zeros(n, dtype=np.int64)
    s, c = 0, 0
    for i in range(n):
        in_s = True
        if rows.row[i].kind >= 0:
            in_s = (
                rows.row[i].sided == 0 or (gear_meshes[rows.row[i].owner].carries == 1) == forward
            )
            places[c], loaded[c] = i, 1 if in_s else 0
            c += 1
        if in_s:
            inside[s], place[i] = i, s
            s += 1
    for e in range(extra):
        inside[s] = n + e
        s += 1
    inverse, residual = _inverse(matrix, inside[:s])
    places, loaded = places[:c], loaded[:c]
    q0, influence, entries = np.zeros(c), np.zeros((c, c)), np.empty(s)
    for a in range(c):
        if loaded[a] == 1:
            entries[:] = inverse[place[places[a]]]
        else:
            entries[:] = 0.0
            for b in range(s):
                entries += matrix[places[a], inside[b]] * inverse[b]
            q0[a] = -right[places[a]]
            influence[a, a] = -rows.row[places[a]].stiffness
        for b in range(s):
            q0[a] += entries[b] * right[inside[b]]
        for b in range(c):
            if loaded[b] == 1:
                influence[a, b] = entries[place[places[b]]] * rows.row[places[b]].stiffness
    return q0, influence, places, loaded, residual


@njit()
def _inverse(matrix, at):
    """Inverse of matrix[at, at] and its residual; scaled, as forces and motions differ in units."""
    s = len(at)
    a = np.empty((s, s))
    for i in range(s):
        for j in range(s):
            a[i, j] = matrix[at[i], at[j]]
    by_row, by_column = np.empty(s), np.empty(s)
    # columns first: large coefficients of rigid motions would dominate every row
    for j in range(s):
        by_column[j] = 1.0 / max(np.abs(a[:, j]).max(), 1e-300)
        a[:, j] *= by_column[j]
    for i in range(s):
        by_row[i] = 1.0 / max(np.abs(a[i]).max(), 1e-300)
        a[i] *= by_row[i]
    inverse = np.linalg.inv(a)
    residual = np.abs(a @ inverse - np.eye(s)).max()
    for i in range(s):
        for j in range(s):
            inverse[i, j] *= by_column[i] * by_row[j]
    return inverse, residual


@njit()
def _row_errors(gears, rows, pairs, theta, waves, n):
    """Errors (n, J) of all rows in every set, m, by the formula of ``coupling.kernels.pairs``."""
    count = waves.offset.shape[1]
    errors, steady = np.zeros((n, count)), np.zeros(count)
    last = -1
    for q in range(pairs):
        pair = rows.pair[q]
        m, row, share = pair.gear_mesh, pair.row, pair.share
        if m != last:
            last = m
            steady[:] = waves.offset[m]
            for h in range(gears.runout.shape[1]):
                angle = gears.runout[m, h].rate * theta[gears.runout[m, h].angle]
                sine, cosine = np.sin(angle), np.cos(angle)
                for j in range(count):
                    steady[j] += sine * waves.runout_sine[m, h, j]
                    steady[j] += cosine * waves.runout_cosine[m, h, j]
        angle = 2 * np.pi * pair.s / gears.gear_mesh[m].pitch
        sine, cosine = np.sin(angle), np.cos(angle)
        tooth, other = pair.tooth, pair.planet_tooth
        for j in range(count):
            error = steady[j] + sine * waves.sine[m, j] + cosine * waves.cosine[m, j]
            error += waves.gear[m, tooth, j] + waves.planet[m, other, j]
            error += waves.slope[m, j] * pair.z
            errors[row, j] += share * error
    return errors


@njit()
def _linear_solution(q0, influence, places, errors):
    """x_S and y_B (c, J) under errors (n, J), without one-sided contact."""
    c, count = len(q0), errors.shape[1]
    x = np.empty((c, count))
    for a in range(c):
        x[a] = q0[a]
        for b in range(c):
            factor = influence[a, b]
            if factor != 0.0:
                for j in range(count):
                    x[a, j] += factor * errors[places[b], j]
    return x


@njit()
def _gaps(influence, places, loaded, rows):
    """The complementarity problem w = x + Q z, w ≥ 0, z ≥ 0, w·z = 0 for rows with tension, as a
    contact problem with the forces z; Q (c, c) from ``influence``."""
    c = len(places)
    q, sided, small = np.empty((c, c)), np.zeros(c, dtype=np.int64), np.empty((c, c))
    for b in range(c):
        row = rows.row[places[b]]
        for a in range(c):
            q[a, b] = influence[a, b] / row.stiffness if loaded[b] == 1 else 0.0
        sided[b] = loaded[b] * row.sided
    vectors = np.zeros((3, c))
    return ContactSet(q, vectors[0], sided, np.zeros_like(sided), q, vectors[1], small, vectors[2])


@njit()
def _release_tension(x, influence, places, loaded, errors, work, n, extra, out):
    """Replace x_S and y_B (c, J) by forces of one-sided contact, N; NaN without equilibrium."""
    (c, count), rows = x.shape, work.rows
    gaps, z = _gaps(influence, places, loaded, rows), np.zeros(c)
    for j in range(count):
        w, pulls = x[:, j], False
        for a in range(c):
            pulls = pulls or (rows.row[places[a]].sided == 1 and not w[a] >= 0.0)
        if pulls:
            largest = np.abs(w).max()
            gaps.right[:], gaps.active[:] = -w, 0
            solved = solve_set(gaps, c, 0, z, EXACT, EXACT) >= 0.0
            solved = solved and np.abs(z).sum() < MAX_GROWTH * largest
            for a in range(c):
                for b in range(c):
                    w[a] += gaps.matrix[a, b] * z[b]
            for a in range(c):
                carries = loaded[a] == 1 and gaps.active[a] == 0
                work.contact.active[places[a]] = 1 if carries else 0
                solved = solved and (loaded[a] == 1 or w[a] >= 0.0)
                w[a] = max(w[a], 0.0) if carries else 0.0
            if not solved:
                _solve_whole(places, errors[:, j], n, extra, work, out, w)
        else:
            for a in range(c):
                w[a] *= loaded[a]


@njit()
def _solve_whole(places, errors, n, extra, work, out, w):
    """Compute the forces w (c,) from the whole problem in ``work`` under errors (n,) of its rows;
    NaN without a solution. ``work.contact.active`` is the first guess of loaded rows."""
    rows, right = work.rows, work.contact.right.copy()
    contact = with_right(work.contact, right)
    for i in range(n):
        if rows.row[i].kind < 0:
            contact.active[i] = 1
        else:
            right[i] += rows.row[i].stiffness * errors[i]
    share = -1.0
    for first in (EXACT, 0):  # directly, then by continuation
        if share < 0.0:
            share = solve_set(contact, n, extra, out, first, EXACT)
    for a in range(len(w)):
        w[a] = out[places[a]] if share >= 0.0 else np.nan
