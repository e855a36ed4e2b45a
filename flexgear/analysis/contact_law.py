"""The law of tooth pairs in a time step, once for pairs, lumped rows and stiffness waves.

One-sided contact:

    F = 0 where δ ≤ 0,   else   F = min(max(0, k δ + c δ̇), 2 k δ)

Damping acts in contact only, never pulls and never exceeds the elastic load: a term c δ̇ that
switched on at δ = 0 would jump at an impact, where steps were then of first order only. F is
continuous, and what it needs follows from k and c. At rest it is k ⟨δ⟩, the law of equilibria.
Under the linear law F = k δ + c δ̇ always.

A loaded row is *damped*, F = k δ + c δ̇, or *limited*, F = 2 k δ, where c δ̇ > k δ. F rises with δ,
and δ̇ with δ within a step, so that one state only agrees with its own answer; a step that finds
another is taken again. The first guess is the state of the last step, and limited where a pair has
been apart.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from flexgear.analysis.lines import dot
from flexgear.coupling.compiled import FAST, INNER, INTO, ONE
from flexgear.coupling.pair_data import LOAD, PER_PAIR, SLOTS

PLACES = 2 * SLOTS  # of a gear mesh's rows in what a step carries on: more than pairs in contact
TRIES = 60  # steps taken again until the states of all rows agree
CAUTIOUS = 20  # tries after which one row changes at a time
TIE = 1e-9  # share of a load by which rows at the border of two states stay as they are


def row_place(model: int, index: int) -> int:
    """Where a row is kept: by the number of its pair, or as the only one of its gear mesh."""
    return index % PLACES if model == PER_PAIR else 0


place_of = njit(**INNER)(row_place)


@njit(**INTO)
def rows_of_law(
    sided, model, limited, stiffness, damping, pair_row, pair_mesh, pair_index, n, n_pairs, share,
    k, c, f,
):  # fmt: skip
    """Stiffness k and damping c of every row in its state; f = share · c. sided (M,), limited
    (M, PLACES): gear meshes whose pairs only push, and rows in the limited state."""
    for i in range(n):
        k[i] = stiffness[i]
        c[i] = damping[i]
    for q in range(n_pairs):
        m, i = pair_mesh[q], pair_row[q]
        if sided[m] == 1 and limited[m, place_of(model[m], pair_index[q])] == 1:
            k[i] = 2.0 * stiffness[i]
            c[i] = 0.0
    for i in range(n):
        f[i] = share * c[i]


@njit(**INTO, fastmath=FAST)
def right_sides(kind, stiffness, offset, n, delta, rate, c, right):
    """k (δ + e) + c δ̇ of every row, or the force itself where it is given."""
    for i in range(n):
        right[i] = stiffness[i] * (delta[i] + offset[i]) + c[i] * rate[i]
    for i in range(n):
        if kind[i] == LOAD:
            right[i] = offset[i]


@njit(**INNER, fastmath=FAST)
def gained(i, line, along, at, coef, width, beyond, ports, modes, push):
    """V_iᵀ Φ p of one row for a modal vector p."""
    total = 0.0
    if line[i] >= 0:
        d = np.uint64(ports + 2 * line[i])
        total += dot(push, modes[d]) + along[i] * dot(push, modes[d + ONE])
    for a in range(beyond[i], width[i]):
        for p in range(6):
            total += coef[i, a, p] * dot(push, modes[at[i, a] + p])
    return total


@njit(**INNER)
def change_states(
    sided, model, load, limited, stiffness, damping, line, along, at, coef, width, beyond, pair_row,
    pair_mesh, pair_index, n_pairs, ports, modes, push, h, gain, x, rate, first,
):  # fmt: skip
    """Put loaded rows in the state that agrees with their answer; how many were in the other.

    x (R,) loads, rate (R,) δ̇ of the free motion, push (n,) modal accelerations by the loads and
    gain what they add to velocities; first: change one row at most. In a damped row of constant k
    with h k < 2 c the load F grows by the factor 1 + h k / 2c at least before c δ̇ exceeds k δ:
    others are not looked at.
    """
    changed, last = 0, -1
    for q in range(n_pairs):
        i, m = pair_row[q], pair_mesh[q]
        if i == last:
            continue
        last = i
        c, force = damping[i], x[i]
        if sided[m] == 0 or c == 0.0 or force <= 0.0:
            continue
        place = place_of(model[m], pair_index[q])
        before, is_limited = load[m, place], limited[m, place]
        growth = min(0.5, 0.5 * h * stiffness[i] / c)
        if is_limited == 0 and abs(force - before) <= growth * before:
            continue
        approach = rate[i] + gain * gained(
            i, line, along, at, coef, width, beyond, ports, modes, push
        )
        over = 2.0 * c * approach / force - 1.0  # c δ̇ > k δ in either state
        if (over > TIE and is_limited == 0) or (over < -TIE and is_limited == 1):
            limited[m, place] = 1 - is_limited
            changed += 1
            if first:
                return changed
    return changed


@njit(**INTO)
def remember(
    sided, model, damping, pair_mesh, pair_index, pair_row, n_pairs, x, load, limited
):  # fmt: skip
    """Note loads and states of rows; one without load is taken to be limited when it touches."""
    for m in range(load.shape[0]):
        for p in range(load.shape[1]):
            load[m, p] = 0.0
            if limited[m, p] == 1:
                limited[m, p] = 2  # of a row that may have gone
    for q in range(n_pairs):
        m, i = pair_mesh[q], pair_row[q]
        p = place_of(model[m], pair_index[q])
        load[m, p] = max(x[i], 0.0)
        if x[i] <= 0.0:
            limited[m, p] = 1 if sided[m] == 1 and damping[i] > 0.0 else 0
        elif limited[m, p] == 2:
            limited[m, p] = 1
    for m in range(load.shape[0]):
        for p in range(load.shape[1]):
            if limited[m, p] == 2:
                limited[m, p] = 0
