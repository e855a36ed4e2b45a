"""The laws of force elements: force, tangent and energy from displacement and rate, by name.

A *force element* has r rows; row i closes by δ_i = V_iᵀ u (plus an offset) at the rate δ̇_i, and
carries the force F_i, which acts as −V_i F_i on the train. Its *law* is one compiled function

    energy = law(parameters, motion, force, tangent)

parameters (p,): of the element; motion (2, r): δ and δ̇. It fills force (2, r): F, and the part of
it that has a potential; tangent (2, r, r): ∂F/∂δ and ∂F/∂δ̇; and returns the potential, J. Tangents
need not be symmetric; r rows may be coupled. A law knows no rows, and the solvers know no law: they
call it by its address, so that adding one changes none of them. Only rows under the law
"held_rate" are held: what it gives is not their force but zero, and their force is what that takes.

Rates are whole: in equilibria and transients a row about the axis has the speed of its inner ring
less that of its outer one, so that a law with component 5 knows the speed of the shaft. A force
needs no potential.

Laws of bearings also say on which of the six components of the relative motion of inner and outer
ring their rows act. To add one: write its file, and enter it in ``LAWS``.
"""

from __future__ import annotations

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
ROOM = 16  # the number of laws is part of what the solvers are compiled for

(
    LINEAR_LAW, ONE_SIDED_LAW, GIVEN_FORCE_LAW, LINEAR_RATE_LAW, HELD_RATE_LAW,
    SLICES_LAW, COUPLED_SLICES_LAW,
) = range(len(BASIC) + 2)  # fmt: skip


def functions(used: Collection[int]) -> tuple[object, ...]:
    """The compiled functions of the basic laws and of those ``used``, by number, as solvers take
    them: ``ROOM`` places, and where nothing should call a law that gives no number."""
    needed = [n < len(BASIC) or n in used for n in range(len(LAWS))]
    laws = [law if there else NOT_COMPILED for law, there in zip(LAWS, needed, strict=True)]
    return tuple(law.function() for law in laws + [NOT_COMPILED] * (ROOM - len(LAWS)))
