"""Tooth pairs with a damper that acts always: F = elastic force + c δ̇, in contact or not.

So oscillators with clearance are damped in most publications. A pair that parts is then slowed and,
where flanks leave each other fast, pulled; in contact alone (``basic``, ``slices``) it is not. A
pair in slices has its damper τ K on the whole contact line, K being its nominal stiffness; with the
rows where ``slices`` has them that is ½ τ K on each of the two. Parameters: as of the laws of the
same elastic force.
"""

from __future__ import annotations

from flexgear.compiled import INNER, njit
from flexgear.coupling.laws.coupled_slices import coupled_slices
from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.coupling.laws.slices import COUNT, FIRST, RELAXATION, slices


@njit(**INNER)
def _add_damper(damper, motion, force, tangent):
    """c δ̇ of every row beside forces at rest."""
    for i in range(motion.shape[1]):
        force[0, i] += damper * motion[1, i]
        tangent[1, i, i] += damper


@njit(**INNER)
def _of_line(parameters):
    """½ τ K of a contact line; its slices' stiffnesses stand behind their places."""
    count, stiffness = int(parameters[COUNT]), 0.0
    for j in range(count):
        stiffness += parameters[FIRST + count + j]
    return 0.5 * parameters[RELAXATION] * stiffness


@compiled_law
def _one_sided_always(parameters, motion, force, tangent):
    """k ⟨δ⟩ + c δ̇."""
    k, delta = parameters[0], motion[0, 0]
    touches = 1.0 if delta > 0.0 else 0.0
    force[0, 0] = force[1, 0] = touches * k * delta
    tangent[0, 0, 0], tangent[1, 0, 0] = touches * k, 0.0
    _add_damper(parameters[1], motion, force, tangent)
    return 0.5 * touches * k * delta * delta


@compiled_law
def _slices_always(parameters, motion, force, tangent):
    """Slices beside each other without damping of their own."""
    energy = slices(parameters, 0.0, motion, force, tangent)
    _add_damper(_of_line(parameters), motion, force, tangent)
    return energy


@compiled_law
def _coupled_slices_always(parameters, motion, force, tangent):
    """Slices that bend each other without damping of their own."""
    energy = coupled_slices(parameters, 0.0, motion, force, tangent)
    _add_damper(_of_line(parameters), motion, force, tangent)
    return energy


ONE_SIDED_ALWAYS = Law("one_sided_always", _one_sided_always)
SLICES_ALWAYS = Law("slices_always", _slices_always)
COUPLED_SLICES_ALWAYS = Law("coupled_slices_always", _coupled_slices_always)
