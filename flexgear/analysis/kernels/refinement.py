"""Adaptive step size: levels h₀ 2ʳ chosen by an error estimate.

The local error of Newmark's average acceleration is (β − 1/6) h³ u⃛ (Zienkiewicz, Xie 1991,
Earthquake Eng. Struct. Dyn. 20:871), so that the error of a mode is

    e = (h²/12) D (a⁺ − a).

D = 1/(1 + γ h d + β h² ω²) reduces the weight of modes faster than the step, which respond
quasi-statically. The error of a step is that of the loads of tooth pairs in contact,
max_i k_i |V_iᵀ Φ e|, over a reference load. A step with an error above the tolerance is repeated
with half its size. After several successive steps with an error below a sixteenth of the tolerance
(doubling the size multiplies the error by eight) the size is doubled. Steps of a level start at
multiples of their size and do not pass a saved sample.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.kernels.active_dofs import motions
from flexgear.analysis.kernels.row_receptances import row_value
from flexgear.compiled import FAST, INNER, UNCOUNTED, njit

CALM = 1 / 16  # error over the tolerance below which a step is calm
PATIENCE = 4  # successive calm steps before the size is doubled
COUNTS = np.dtype([(n, np.int64) for n in ("level", "calm", "taken", "refused", "next_look")])


class Control(NamedTuple):
    """Choice and number of steps in a time interval; tolerance 0: one size, without estimate."""

    tolerance: float  # error of one step over ``load``
    load: float  # N
    levels: int
    every: int  # ticks between two samples
    counts: Any  # (1,) COUNTS: desired level, successive calm steps, steps taken, steps refused,
    # tick of the next check of unloaded flanks
    by_level: NDArray[np.int64]  # (L,) number of steps of each size


def control(levels: int, tolerance: float = 0.0, load: float = 1.0, every: int = 1) -> Control:
    """Control that starts at the finest level."""
    counts, by_level = np.zeros(1, dtype=COUNTS), np.zeros(levels, np.int64)
    return Control(float(tolerance), float(load), levels, every, counts, by_level)


@njit(**UNCOUNTED)
def choose_level(control, at, left):
    """Highest level up to the desired one whose step may start at tick ``at`` and passes neither
    the next sample nor the end, ``left`` ticks away."""
    level = control.counts[0].level
    to_sample = control.every - at % control.every
    while level > 0 and (at % (1 << level) != 0 or (1 << level) > min(left, to_sample)):
        level -= 1
    return level


@njit(**INNER, fastmath=FAST)
def step_error(h, level, modal, state, work, n, load):
    """Error of the loads of the n rows in contact in a step, over ``load``."""
    modes, dofs, force = work.modes, work.dofs, work.problem.force
    for j in range(modal.omega2.shape[0]):
        change = modes.acceleration[j] + modes.push[j] - state.acceleration[j]
        modes.spare[j] = h * h / 12.0 * modal.inverse[level, j] * change
    motions(work.active, modes.spare, modes.spare, dofs.image, dofs.image)
    worst = 0.0
    for i in range(n):
        row = work.rows.row[i]
        if row.sided == 0 or force[i] != 0.0:
            worst = max(worst, row.stiffness * abs(row_value(work.rows, i, dofs.image)))
    return worst / load


@njit(**UNCOUNTED)
def after_step(control, level, error):
    """Choose the size of the next step; returns whether the present one is accepted."""
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
