"""The contact matrix of rows in channels at hand: lines of action on lines, teeth on teeth.

What lines of action answer on the lines of rows is held ready, number beside number for all rows;
it stands until a tooth pair comes or goes. Teeth are taken by the place of their channels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.analysis.near_products import LINE, THREE, TWO, add_block, whole, whole_lines
from flexgear.analysis.wide import aligned, clear, put_paired
from flexgear.coupling.compiled import FAST, INNER, INTO, NONE, ONE, ZERO

Array = NDArray[np.float64]


class ContactWork(NamedTuple):
    """Work space for R rows (in whole cache lines), C channels, M lines, E blocks beyond lines."""

    lead: NDArray[np.uint64]  # (R,) first channel of a row's line
    terms: Array  # (4, R) a row's share of that channel (0 or 1) and of the next, k + f, f
    known: NDArray[np.int64]  # (R + 2,) number of rows, receptance and lines of ``facing``
    facing: Array  # (8 M, R) answers of lines on lines: see ``_face``
    owner: NDArray[np.uint64]  # (E,) row of a block
    place: NDArray[np.uint64]  # (E,) its first channel
    listed: Array  # (E, 8) its six coefficients
    image: Array  # (R, C) G V
    image_r: Array  # (R, C) R V


def contact_work(lines: int, rows: int, width: int, channels: int) -> ContactWork:
    """Empty work space for rows of at most ``width`` blocks."""
    blocks, long = rows * width, whole_lines(rows)
    return ContactWork(
        lead=np.zeros(rows, dtype=np.uint64),
        terms=aligned(4, long),
        known=np.full(rows + 2, -1, dtype=np.int64),
        facing=aligned(8 * lines, long),
        owner=np.zeros(blocks, dtype=np.uint64),
        place=np.zeros(blocks, dtype=np.uint64),
        listed=aligned(blocks, LINE),
        image=aligned(rows, channels),
        image_r=aligned(rows, channels),
    )


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
        add_block(matrix, d, v, max(low[g], begin), min(whole(high[g]), end), own)
        if linked[g] == 1:
            if not across:
                for c in range(0, lined, LINE):
                    clear(own, c)
            across = True
            add_block(matrix, d, v, ZERO, lined, own)
    return across


@njit(**INNER)
def _face(g, r, line, n, lines, ports, which, known, facing):
    """facing (8 M, R): what lines of action answer on the lines of rows.

    Eight for a line: both its channels of G, then of R, on the first channel of a row's line; the
    same on its second. They stand until pairs come or go, or another receptance is meant.
    """
    same = known[0] == n and known[1] == which
    for i in range(n):
        same = same and known[i + 2] == line[i]
    if same:
        return
    known[0], known[1] = n, which
    for i in range(n):
        known[i + 2] = line[i]
    for c in range(ports, lines, 2):
        to = 4 * (c - ports)
        for i in range(n):
            for half in range(2):
                d = ports + 2 * line[i] + half
                for p in range(2):
                    at = to + 4 * half + p
                    facing[at, i] = g[c + p, d] if line[i] >= 0 else 0.0
                    facing[at + 2, i] = r[c + p, d] if line[i] >= 0 else 0.0


@njit(**INNER, fastmath=FAST)
def _by_lines(g, r, facing, line, lead, zeta, both, damped, n, port, out):
    """out[i, j] of the lines of rows i and j, and out[i, n] at a port."""
    for i in range(n):
        row, c, z, kf, f = out[i], lead[i], zeta[i], both[i], damped[i]
        if line[i] >= 0:
            shares = (kf, kf * z, -f, -f * z)
            for j in range(0, n, LINE):
                put_paired(row, j, facing, 8 * line[i], shares, zeta)
            of_g, of_r = g[port, c] + z * g[port, c + ONE], r[port, c] + z * r[port, c + ONE]
            row[n] = kf * of_g - f * of_r
        else:
            for j in range(0, n + 1, LINE):
                clear(row, j)
        row[i] += 1.0


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


@njit(**INNER)
def _list_blocks(order, at, coef, beyond, width, owner, place, listed):
    """Blocks beyond lines one after the other: their rows, channels and coefficients; how many."""
    e = NONE
    for i in order:
        for a in range(beyond[i], width[i]):
            owner[e], place[e] = i, at[i, a]
            for p in range(6):
                listed[e, p] = coef[i, a, p]
            e += ONE
    return e


@njit(**INNER, fastmath=FAST)
def _by_blocks(order, y, y_r, beyond, width, terms, count, owner, place, listed, out):
    """Adds what blocks of rows do to blocks of rows; order (w,): rows that have such blocks."""
    start = NONE
    for j in order:
        own, own_r = y[j], y_r[j]
        kf, f = terms[2, j], terms[3, j]
        for e in range(start, count):
            i, c, v = owner[e], place[e], listed[e]
            p = v[0] * own[c] + v[1] * own[c + ONE] + v[2] * own[c + TWO]
            q = v[0] * own_r[c] + v[1] * own_r[c + ONE] + v[2] * own_r[c + TWO]
            c += THREE
            p += v[3] * own[c] + v[4] * own[c + ONE] + v[5] * own[c + TWO]
            q += v[3] * own_r[c] + v[4] * own_r[c + ONE] + v[5] * own_r[c + TWO]
            out[j, i] += kf * p - f * q
            if i != j:
                out[i, j] += terms[2, i] * p - terms[3, i] * q
        start += np.uint64(width[j] - beyond[j])


@njit(**INTO, fastmath=FAST)
def contact_matrix(
    g, r, line, along, at, part, coef, width, beyond, order, since, reach, ports, lines, low, high,
    linked, n, wide, k, f, which, work, out,
):  # fmt: skip
    """out[i, j] = δ_ij + (k_i + f_i) V_iᵀ G V_j − f_i V_iᵀ R V_j for rows, and in column n the same
    for V_j = the last port.

    G and R symmetric, which halves the work of blocks; lines: one past the last channel of lines
    that rows have; order, since, reach, wide: see ``near.place_rows``; which: number of G among
    those since ``work.known`` was set to −1. out: rows in whole cache lines.
    """
    lined = whole(lines)
    lead, terms, y, y_r, owner, place, listed = (
        work.lead, work.terms, work.image, work.image_r, work.owner, work.place, work.listed
    )  # fmt: skip
    share, zeta, both, damped = terms[0], terms[1], terms[2], terms[3]
    for i in range(n):
        has = line[i] >= 0
        lead[i] = np.uint64(ports + 2 * line[i]) if has else NONE
        share[i], zeta[i] = (1.0, along[i]) if has else (0.0, 0.0)
    for i in range(n):
        both[i], damped[i] = k[i] + f[i], f[i]
    _face(g, r, line, n, lines, ports, which, work.known, work.facing)
    _by_lines(g, r, work.facing, line, lead, zeta, both, damped, n, ports - 1, out)
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
    count = _list_blocks(order[:wide], at, coef, beyond, width, owner, place, listed)
    _by_blocks(order[:wide], y, y_r, beyond, width, terms, count, owner, place, listed, out)
