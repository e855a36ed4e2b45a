"""Which step size is taken next: levels of refinement h₀ 2ʳ, chosen by an error estimate.

Newmark's average acceleration leaves out (β − 1/6) h³ u⃛ of the motion after a step (Zienkiewicz,
Xie 1991, Earthquake Eng. Struct. Dyn. 20:871), so a mode errs by

    e = (h²/12) D (a⁺ − a),

where D = 1/(1 + γ h d + β h² ω²) keeps modes that are faster than the step, and follow the others
statically, from being counted with their acceleration. What counts is what e does to the loads of
tooth pairs in contact: the error of a step is max_i k_i |V_iᵀ Φ e| over a reference load. A step
that errs by more than the tolerance is taken again at half its size; after some steps in a row
that err by less than a sixteenth (twice the size gives eight times the error) it is doubled. Steps
of a level start at multiples of their size and end on saved samples.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.active_dofs import motions
from flexgear.analysis.kernels.row_receptances import row_value
from flexgear.compiled import FAST, INNER, UNCOUNTED, njit

CALM = 1 / 16  # share of the tolerance below which a step counts towards a longer one
PATIENCE = 4  # such steps in a row
COUNTS = np.dtype([(n, np.int64) for n in ("level", "calm", "taken", "refused", "next_look")])


class Control(NamedTuple):
    """How steps of a piece of time are chosen and counted. tolerance 0: one size, never judged."""

    tolerance: float  # of one step, share of ``load``
    load: float  # N
    levels: int
    every: int  # ticks between two samples
    counts: Any  # (1,) COUNTS: level wanted, calm steps in a row, steps taken and refused; tick of
    # the next look at unloaded flanks
    by_level: NDArray[np.int64]  # (L,) steps taken of each size


def control(levels: int, tolerance: float = 0.0, load: float = 1.0, every: int = 1) -> Control:
    """At the finest level."""
    counts, by_level = np.zeros(1, dtype=COUNTS), np.zeros(levels, np.int64)
    return Control(float(tolerance), float(load), levels, every, counts, by_level)


@njit(**UNCOUNTED)
def choose_level(control, at, left):
    """Coarsest level wanted that starts at tick ``at`` and passes neither the end nor a sample."""
    level = control.counts[0].level
    to_sample = control.every - at % control.every
    while level > 0 and (at % (1 << level) != 0 or (1 << level) > min(left, to_sample)):
        level -= 1
    return level


@njit(**INNER, fastmath=FAST)
def step_error(h, level, modal, state, work, n, load):
    """Error of a step as a share of ``load`` over the n rows that carry."""
    modes, dofs, force = work.modes, work.dofs, work.problem.force
    for j in range(modal.omega2.shape[0]):
        gained = modes.acceleration[j] + modes.push[j] - state.acceleration[j]
        modes.spare[j] = h * h / 12.0 * modal.inverse[level, j] * gained
    motions(work.active, modes.spare, modes.spare, dofs.image, dofs.image)
    worst = 0.0
    for i in range(n):
        row = work.rows.row[i]
        if row.sided == 0 or force[i] != 0.0:
            worst = max(worst, row.stiffness * abs(row_value(work.rows, i, dofs.image)))
    return worst / load


@njit(**UNCOUNTED)
def after_step(control, level, error):
    """Whether the step stands; chooses the size of the next one."""
    counts = control.counts[0]
    if not error <= control.tolerance and level > 0:
        counts.level = level - 1
        counts.calm = 0
        counts.refused += 1
        return False
    if error < CALM * control.tolerance:
        counts.calm += 1
        if counts.calm >= PATIENCE and level == counts.level and level + 1 < control.levels:
            counts.level += 1
            counts.calm = 0
    else:
        counts.calm = 0
    return True
