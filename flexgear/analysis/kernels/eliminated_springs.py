"""Springs whose receptances do not depend on the angle, eliminated from a step's contact problem.

A spring in a turning frame is a row with F = k δ at every angle. Where the receptances D between
such rows b are constant, as between a carrier and planets with equal teeth, so is S in

    S = (k⁻¹ + D_bb)⁻¹,    F_b = S (δ*_b − D_bc F_c),

and the contact problem has the other rows c only, with

    δ*_c − D_cb S δ*_b,    D_cc − D_cb S D_bc,    W_cc − W_cb S D_bc

as free displacement, and displacement and rate under unit forces (see ``contact_newton``). In the
contact problem the springs' rows come last; in the records of a step only machines follow them.
"""

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
    """B springs for L step sizes; H channels: ports, lines of action and one more. Last axes have a
    padded length B' ≥ B, with zeros beyond B."""

    stiffness: Array  # (B,) N/m
    condensed: Array  # (L, B, B') S, N/m
    displacement: Array  # (L, H, B') D_bc for a unit force on a channel, m/N
    modal: Array  # (L, H, B') its modal part G − R, m/N
    force: Array  # (L, H, B') S D_bc


class BlockImage(NamedTuple):
    """G V and R V of the blocks of one row at the active dofs, zero outside two ranges."""

    image: Array  # (≥ 2 C,) G V and R V, alternating
    first: np.uint64  # first entry of the first range, and one past its last
    stop: np.uint64
    others: np.uint64  # the same of the second range
    end: np.uint64


class SpringSpace(NamedTuple):
    """Work space of a problem of R rows."""

    displacement: Array  # (R, B') D_cb
    rate: Array  # (R, B') W_cb
    force: Array  # (B', R) S D_bc
    row_force: Array  # (B',) S D_bc of one row
    pull: Array  # (B',) S δ*_b, then F_b


def spring_space(rows: int, springs: int) -> SpringSpace:
    """Work space, with zeros beyond the springs."""
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
    """Index in the contact problem of row i of ``total``. The springs, ``springs`` in number, are
    the last ones of the first n rows; the problem has them at its end."""
    if i >= n:
        return i - springs
    return i if i < n - springs else i + total - n


@njit(**PART)
def spring_receptances(active, level, share, rows, j, at, first, springs, blocks, space):
    """Displacements and rates of the springs' rows, which begin with row ``first``, under a unit
    force of row j, at index ``at`` of ``space``; blocks: the ``BlockImage`` of row j."""
    row, coef, place, count = rows.row, rows.coef, rows.place, springs.stiffness.shape[0]
    image = blocks.image
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
            if not (blocks.first <= d < blocks.stop or blocks.others <= d < blocks.end):
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
def _subtract_products(first, second, factors, others, table, count):
    """first[i] −= Σ_b a[b] table[b, i] and second[i] −= Σ_b b[b] table[b, i], with the factors a, b
    over the first ``count`` rows of the table (a multiple of four), each read once for both."""
    for b in range(ZERO, np.uint64(count), FOUR):
        u, v, w, x = factors[b], factors[b + ONE], factors[b + TWO], factors[b + THREE]
        d, e, f, g = others[b], others[b + ONE], others[b + TWO], others[b + THREE]
        for i in range(np.uint64(first.shape[0])):
            p, q, r, s = table[b, i], table[b + ONE, i], table[b + TWO, i], table[b + THREE, i]
            first[i] -= u * p + v * q + w * r + x * s
            second[i] -= d * p + e * q + f * r + g * s


@njit(**INNER, fastmath=FAST)
def eliminate_springs(springs, level, m, problem):
    """Eliminate the springs, the last rows of the contact problem, from its first m rows: replaces
    δ*_c, D_cc and W_cc as in the docstring of the module."""
    space, free = problem.springs, problem.free
    count, pull, width = springs.stiffness.shape[0], problem.springs.pull, padded(m)
    fill(pull, 0.0)
    for b in range(count):
        add(pull, free[0, m + b], springs.condensed[level, b])
    table_rows = count + -count % 4
    for i in range(m):
        displacement, rate = space.displacement[i], space.rate[i]
        free[0, i] -= dot(displacement, pull)
        free[1, i] -= dot(rate, pull)
        _subtract_products(
            problem.displacement[i, :width], problem.rate[i, :width], displacement, rate,
            space.force, table_rows,
        )  # fmt: skip


@njit(**PART)
def add_springs(springs, n, total, problem):
    """Forces and displacements of the springs from the forces of the other rows, with all rows in
    their original order. Rates of springs are set to zero: no force depends on them."""
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
    """``EliminatedSprings`` without springs, for so many step sizes and channels."""
    tables = np.zeros((3, levels, channels, 0))
    return EliminatedSprings(np.zeros(0), np.zeros((levels, 0, 0)), *tables)
