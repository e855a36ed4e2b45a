"""Springs whose receptances do not change with the angle, eliminated from a step's contact problem.

A spring in a turning frame is a row with F = k δ at every angle. Where receptances D between such
rows b are constant, as between a carrier and planets that are the same from tooth to tooth, so is

    S = (k⁻¹ + D_bb)⁻¹,    F_b = S (δ*_b − D_bc F_c),

and the contact problem is one of the other rows c, with

    δ*_c − D_cb S δ*_b,    D_cc − D_cb S D_bc,    W_cc − W_cb S D_bc

for their displacement and rate under unit forces (see ``contact_newton``). In it the springs' rows
come last; in the records of a step they are the last but those of machines.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexgear.analysis.kernels.active_dofs import ONE, SIX, TWO
from flexgear.analysis.kernels.vectors import (
    add,
    aligned,
    dot,
    fill,
    padded,
    put,
    put_two,
    rounded_up,
)
from flexgear.arrays import Array
from flexgear.compiled import FAST, INNER, PART, njit

ZERO, THREE, FOUR = np.uint64(0), np.uint64(3), np.uint64(4)


class EliminatedSprings(NamedTuple):
    """B springs for L step sizes; H channels: ports, lines of action and one more. Of every last
    axis B' ≥ B, what is behind B is zero."""

    stiffness: Array  # (B,) N/m
    condensed: Array  # (L, B, B') S, N/m
    displacement: Array  # (L, H, B') D_bc of a unit force on a channel, m/N
    modal: Array  # (L, H, B') the part of it that modes have, G − R
    force: Array  # (L, H, B') S D_bc


class SpringSpace(NamedTuple):
    """Work space of a problem of R rows."""

    displacement: Array  # (R, B') D_cb
    rate: Array  # (R, B') W_cb
    force: Array  # (B', R) S D_bc
    row_force: Array  # (B',) the same of one row
    pull: Array  # (B',) S δ*_b, then F_b


def spring_space(rows: int, springs: int) -> SpringSpace:
    """Work space; what is behind the springs in use stays zero."""
    size = rounded_up(springs)
    return SpringSpace(
        displacement=aligned(rows, size),
        rate=aligned(rows, size),
        force=aligned(size, rounded_up(rows)),
        row_force=aligned(size),
        pull=aligned(size),
    )


@njit(**INNER)
def place_in_problem(i, springs, n, total):
    """Place of row i of ``total`` in the contact problem; the springs are the last rows before n,
    and come last in the problem."""
    if i >= n:
        return i - springs
    return i if i < n - springs else i + total - n


@njit(**PART)
def spring_receptances(active, level, share, rows, j, at, first, springs, ranges, image, space):
    """Displacements and rates of the springs' rows, from row ``first`` on, under a unit force of
    row j, into place ``at`` of ``space``.

    image: G V and R V of the row's blocks in the ``ranges``, see ``row_receptances``.
    """
    row, coef, place, count = rows.row, rows.coef, rows.place, springs.stiffness.shape[0]
    displacement, rate, force = space.displacement[at], space.rate[at], space.row_force
    if row[j].dof >= 0:
        h = active.channel[row[j].dof] - 6 * active.counts[0].blocks
        along, table, modal = row[j].along, springs.displacement[level], springs.modal[level]
        put_two(displacement, 1.0, table[h], along, table[h + 1])
        put_two(rate, share, modal[h], share * along, modal[h + 1])
        put_two(force, 1.0, springs.force[level, h], along, springs.force[level, h + 1])
    else:
        fill(displacement, 0.0)
        fill(rate, 0.0)
        fill(force, 0.0)
    for b in range(count if row[j].beyond < row[j].width else 0):
        i = first + b
        if row[i].parts & row[j].parts == 0:
            continue
        g = r = 0.0
        for a in range(row[i].beyond, row[i].width):
            v, d = coef[i, a], TWO * place[i, a]
            if not (ranges[0] <= d < ranges[1] or ranges[2] <= d < ranges[3]):
                continue
            for p in range(SIX):
                g += v[p] * image[d + TWO * p]
                r += v[p] * image[d + TWO * p + ONE]
        displacement[b] += g
        rate[b] += share * (g - r)
        add(force, g, springs.condensed[level, b])
    for b in range(count):
        space.force[b, at] = force[b]


@njit(**INNER, fastmath=FAST)
def _subtract_products(first, second, of_first, of_second, table, count):
    """first[i] −= Σ_b of_first[b] table[b, i], and second alike, over so many rows b of the table,
    a multiple of four, which are read once for both."""
    for b in range(ZERO, np.uint64(count), FOUR):
        u, v, w, x = of_first[b], of_first[b + ONE], of_first[b + TWO], of_first[b + THREE]
        d, e, f, g = of_second[b], of_second[b + ONE], of_second[b + TWO], of_second[b + THREE]
        for i in range(np.uint64(first.shape[0])):
            p, q, r, s = table[b, i], table[b + ONE, i], table[b + TWO, i], table[b + THREE, i]
            first[i] -= u * p + v * q + w * r + x * s
            second[i] -= d * p + e * q + f * r + g * s


@njit(**INNER, fastmath=FAST)
def eliminate_springs(springs, level, m, problem):
    """Eliminate the springs, the last rows of the contact problem, from its first m rows: δ*_c,
    D_cc and W_cc of the module's docstring, in place."""
    space, free = problem.springs, problem.free
    count, pull, width = springs.stiffness.shape[0], problem.springs.pull, padded(m)
    fill(pull, 0.0)
    for b in range(count):
        add(pull, free[0, m + b], springs.condensed[level, b])
    whole = count + -count % 4
    for i in range(m):
        displacement, rate = space.displacement[i], space.rate[i]
        free[0, i] -= dot(displacement, pull)
        free[1, i] -= dot(rate, pull)
        _subtract_products(
            problem.displacement[i, :width], problem.rate[i, :width], displacement, rate,
            space.force, whole,
        )  # fmt: skip


@njit(**PART)
def add_springs(springs, n, total, problem):
    """Forces and displacements of the springs from those of the other rows, and all in the order
    of the rows again. Rates of springs are not worked out: no force depends on them."""
    count = springs.stiffness.shape[0]
    m, first_spring = total - count, n - count
    pull, force, motion = problem.springs.pull, problem.force, problem.motion
    for b in range(count):
        pull[b] -= dot(problem.springs.force[b, : padded(m)], force)
    for i in range(total - 1, n - 1, -1):
        force[i] = force[i - count]
        motion[0, i], motion[1, i] = motion[0, i - count], motion[1, i - count]
    put(force[first_spring:n], pull[:count])
    for b in range(count):
        motion[0, first_spring + b] = pull[b] / springs.stiffness[b]
        motion[1, first_spring + b] = 0.0


def no_springs(levels: int, channels: int) -> EliminatedSprings:
    """None is eliminated."""
    tables = np.zeros((3, levels, channels, 0))
    return EliminatedSprings(np.zeros(0), np.zeros((levels, 0, 0)), *tables)
