"""Which step size is taken next: a ladder of sizes h₀ 2ʳ, climbed and left by an error estimate.

Newmark's average acceleration leaves out (β − 1/6) h³ u⃛ of the motion after a step (Zienkiewicz,
Xie 1991, Earthquake Eng. Struct. Dyn. 20:871), so a mode errs by

    e = (h²/12) D (a⁺ − a),

where D = 1/(1 + γ h d + β h² ω²) keeps modes that are faster than the step, and follow the others
statically, from being counted with their acceleration. What counts is what e does to the loads of
tooth pairs in contact: the error of a step is max_i k_i |V_iᵀ Φ e| over a reference load. A step
that errs by more than the tolerance is taken again at half its size; after some steps in a row
that err by less than a sixteenth (twice the size gives eight times the error) it is doubled. Steps
of a rung start at multiples of their size and end on saved samples.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.analysis.near_products import moved, near_values
from flexgear.coupling.compiled import FAST, INNER, UNCOUNTED

CALM = 1 / 16  # share of the tolerance below which a step counts towards a longer one
PATIENCE = 4  # such steps in a row


class Control(NamedTuple):
    """State of the ladder. tolerance 0: one size, never judged."""

    tolerance: float  # of one step, share of ``load``
    load: float  # N
    rungs: int
    counts: NDArray[np.int64]  # (4,) rung wanted, calm steps in a row, steps taken, steps refused
    taken: NDArray[np.int64]  # (L,) steps taken of each size


def control(rungs: int, tolerance: float = 0.0, load: float = 1.0) -> Control:
    """At the lowest rung."""
    return Control(
        float(tolerance), float(load), rungs, np.zeros(4, np.int64), np.zeros(rungs, np.int64)
    )


@njit(**UNCOUNTED)
def choose_rung(control, at, left, save_every):
    """Largest rung wanted that starts at tick ``at`` and passes neither the end nor a sample."""
    rung = control.counts[0]
    to_sample = save_every - at % save_every
    while rung > 0 and (at % (1 << rung) != 0 or (1 << rung) > min(left, to_sample)):
        rung -= 1
    return rung


@njit(**INNER, fastmath=FAST)
def step_error(
    h, inverse, before, without, push, load, near, ports, seen, rows, n, active, e, value, spare
):
    """Error of a step as a share of ``load``; e (n,), value and spare (R,) are work space.

    The new acceleration is ``without`` contact forces plus ``push``; seen: channels of the head
    that rows have.
    """
    for j in range(before.shape[0]):
        e[j] = h * h / 12.0 * inverse[j] * (without[j] + push[j] - before[j])
    moved(near.shapes, seen, near.span, near.low, near.high, near.rigid, near.elastic, e, near.line)
    near_values(
        rows.line, rows.along, near.at, rows.coef, rows.width, rows.beyond, ports, n, near.line,
        near.line, value, spare,
    )  # fmt: skip
    worst = 0.0
    for i in range(n):
        if active[i] == 1:
            worst = max(worst, rows.stiffness[i] * abs(value[i]))
    return worst / load


@njit(**UNCOUNTED)
def after_step(control, rung, error):
    """Whether the step stands; chooses the size of the next one."""
    counts = control.counts
    if not error <= control.tolerance and rung > 0:
        counts[0] = rung - 1
        counts[1] = 0
        counts[3] += 1
        return False
    if error < CALM * control.tolerance:
        counts[1] += 1
        if counts[1] >= PATIENCE and rung == counts[0] and rung + 1 < control.rungs:
            counts[0] += 1
            counts[1] = 0
    else:
        counts[1] = 0
    return True
