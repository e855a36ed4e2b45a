"""Contact rows at the active dofs: motion and force of a row, receptances between rows."""

from __future__ import annotations

import numpy as np

from flexgear.analysis.active_dofs import ONE, SIX, TWO, reach_of
from flexgear.analysis.vectors import SIMD, add_six, fill, padded, put_six, put_two
from flexgear.coupling.compiled import FAST, INNER, PART, njit


@njit(**INNER)
def place_rows(active, rows, n):
    """Note in n rows which active dofs they act on: see ``Rows``."""
    blocks, since = active.counts[0].blocks, active.counts[0].dofs
    for i in range(n - 1, -1, -1):
        row = rows.row[i]
        row.dof = active.place[blocks + row.line] if row.line >= 0 else -1
        for a in range(row.beyond, row.width):
            rows.place[i, a] = active.place[rows.blocks[i, a]]
            since = min(since, active.place[rows.blocks[i, a]])
        row.since = since


@njit(**INNER)
def row_value(rows, i, vector):
    """V_iᵀ u for values at the active dofs."""
    row, total = rows.row[i], 0.0
    if row.dof >= 0:
        total = vector[row.dof] + row.along * vector[row.dof + 1]
    for a in range(row.beyond, row.width):
        coef, d = rows.coef[i, a], rows.place[i, a]
        for p in range(SIX):
            total += coef[p] * vector[d + p]
    return total


@njit(**INNER)
def add_row(rows, i, factor, vector):
    """vector += factor · V_i at the active dofs."""
    row = rows.row[i]
    if row.dof >= 0:
        vector[row.dof] += factor
        vector[row.dof + 1] += factor * row.along
    for a in range(row.beyond, row.width):
        coef, d = rows.coef[i, a], rows.place[i, a]
        for p in range(SIX):
            vector[d + p] += factor * coef[p]


@njit(**INNER, fastmath=FAST)
def _receptances_of_lines(active, level, share, rows, n, lines, displacement, rate):
    """What ``row_receptances`` gives as far as it comes from ports and lines of action.

    lines (2, ≥ head, ≥ n): G V and share (G − R) V of all rows side by side, dof by dof, so that a
    row meets all others in one sum of vectors.
    """
    table, head = active.receptance[level], np.uint64(active.counts[0].head)
    moved, moving = lines[0], lines[1]
    for i in range(np.uint64(n)):
        row = rows.row[i]
        if row.dof < 0:
            for d in range(head):
                moved[d, i] = moving[d, i] = 0.0
            continue
        first, second, along = table[row.dof], table[row.dof + 1], row.along
        for d in range(head):
            g = first[TWO * d] + along * second[TWO * d]
            r = first[TWO * d + ONE] + along * second[TWO * d + ONE]
            moved[d, i], moving[d, i] = g, share * (g - r)
    stop = min(padded(n), displacement.shape[1])
    for j in range(n):
        d, along = rows.row[j].dof, rows.row[j].along
        if d < 0:
            fill(displacement[j, :stop], 0.0)
            fill(rate[j, :stop], 0.0)
        else:
            put_two(displacement[j, :stop], 1.0, moved[d], along, moved[d + 1])
            put_two(rate[j, :stop], 1.0, moving[d], along, moving[d + 1])


@njit(**PART)
def _image_of_blocks(active, level, own, coef, place, image):
    """G V and R V of the blocks of one row beyond its line, at the dofs of the rows from it on;
    whether they move lines of action, too."""
    table, head, width = active.receptance[level], active.counts[0].head, 2 * active.counts[0].dofs
    linked, start = False, 2 * own.since - 2 * own.since % SIMD
    for a in range(own.beyond, own.width):
        for p in range(SIX):
            linked = linked or active.reach[place[a] + p, 0] < 2 * head
    if linked:
        start = 0
    for a in range(own.beyond, own.width):
        d = np.int64(place[a])
        low, high = reach_of(active.reach, d, 6, head, own.since)
        if a == own.beyond:
            put_six(image[start : padded(high)], coef[a], table[d : d + 6], start)
            fill(image[padded(high) : padded(width)], 0.0)
        else:
            add_six(image[low : padded(high)], coef[a], table[d : d + 6], low)
    return linked


@njit(**INNER, fastmath=FAST)
def row_receptances(active, level, share, rows, n, vectors, displacement, rate):
    """V_iᵀ G V_j and share · V_iᵀ (G − R) V_j of n rows, both symmetric; vectors: work.

    Lines of action are taken with each other, then blocks with each other, then, where a body has
    both, blocks with lines.
    """
    _receptances_of_lines(active, level, share, rows, n, vectors.lines, displacement, rate)
    row, coef, place, image, count = rows.row, rows.coef, rows.place, vectors.image, np.uint64(n)
    for j in range(count):
        if row[j].beyond >= row[j].width:
            continue
        linked = _image_of_blocks(active, level, row[j], coef[j], place[j], image)
        for i in range(j, count):
            g = r = 0.0
            for a in range(row[i].beyond, row[i].width):
                v, at = coef[i, a], TWO * place[i, a]
                for p in range(SIX):
                    g += v[p] * image[at + TWO * p]
                    r += v[p] * image[at + TWO * p + ONE]
            displacement[i, j] += g
            rate[i, j] += share * (g - r)
            if i != j:
                displacement[j, i] += g
                rate[j, i] += share * (g - r)
        for i in range(count if linked else np.uint64(0)):
            if row[i].dof >= 0:
                at, along = TWO * np.uint64(row[i].dof), row[i].along
                g = image[at] + along * image[at + TWO]
                w = share * (g - image[at + ONE] - along * image[at + TWO + ONE])
                displacement[i, j] += g
                displacement[j, i] += g
                rate[i, j] += w
                rate[j, i] += w
