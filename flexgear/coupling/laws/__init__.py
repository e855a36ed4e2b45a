"""Laws of force elements: force, tangent and energy from displacement and rate, by name.

A *force element* has r rows; row i is compressed by δ_i = V_iᵀ u (plus an offset) at the rate δ̇_i,
and its force F_i acts as −V_i F_i on the train. The *law* is one compiled function

    energy = law(parameters, motion, force, tangent)

parameters (p,): of the element; motion (2, r): δ and δ̇. It fills force (2, r): F, and the part of F
with a potential; tangent (2, r, r): ∂F/∂δ and ∂F/∂δ̇, which may couple rows and be unsymmetric; and
returns the potential, J. Solvers call laws by address, so that a new law does not change them. The
law "held_rate" is a constraint: its value is kept at zero, and the force of the row follows.

Rates include rolling: in equilibria and transients a row about the axis has the speed of the inner
relative to the outer ring.

Laws of bearings act on some of the six components of the motion of inner relative to outer ring. To
add a law: write its file, and enter it in ``LAWS``.
"""

from collections.abc import Collection

from flexgear.coupling.laws.basic import (
    GIVEN_FORCE,
    HELD_RATE,
    LINEAR,
    LINEAR_RATE,
    NOT_COMPILED,
    ONE_SIDED,
)
from flexgear.coupling.laws.clearance import CLEARANCE
from flexgear.coupling.laws.coupled_slices import COUPLED_SLICES
from flexgear.coupling.laws.dampers import DAMPERS
from flexgear.coupling.laws.journal import JOURNAL
from flexgear.coupling.laws.law import Law
from flexgear.coupling.laws.rollers import ROLLERS
from flexgear.coupling.laws.slices import SLICES

BASIC = (LINEAR, ONE_SIDED, GIVEN_FORCE, LINEAR_RATE, HELD_RATE)
LAWS: tuple[Law, ...] = (*BASIC, SLICES, COUPLED_SLICES, CLEARANCE, ROLLERS, JOURNAL, DAMPERS)
LAW_NUMBERS = {law.name: number for number, law in enumerate(LAWS)}
ROOM = 16  # solvers are compiled for this number of laws

(
    LINEAR_LAW, ONE_SIDED_LAW, GIVEN_FORCE_LAW, LINEAR_RATE_LAW, HELD_RATE_LAW,
    SLICES_LAW, COUPLED_SLICES_LAW,
) = range(len(BASIC) + 2)  # fmt: skip


def functions(used: Collection[int]) -> tuple[object, ...]:
    """Compiled functions (ROOM,) of laws by number, for solvers: those of basic and ``used`` laws,
    and ``NOT_COMPILED`` for all others."""
    numbers = {*range(len(BASIC)), *used}
    laws = [LAWS[n] if n in numbers else NOT_COMPILED for n in range(len(LAWS))]
    return tuple(law.function() for law in laws + [NOT_COMPILED] * (ROOM - len(LAWS)))
