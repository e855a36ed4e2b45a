"""Laws of tooth pairs, of rows with a constant stiffness, of given forces and of machines at ports.

One-sided contact:

    F = 0 where δ ≤ 0,   else   F = min(max(0, k δ + c δ̇), 2 k δ)

Damping acts in contact only, never pulls and never exceeds the elastic force: a term c δ̇ that acts
from δ = 0 on would be discontinuous at impacts and reduce time integration to first order. At zero
rate F = k ⟨δ⟩, the law of equilibria. The linear law is F = k δ + c δ̇. Parameters of both: k, c.

The one-sided law has a third parameter, a damper c₀ that acts in and out of contact, F + c₀ δ̇, as
in most publications on oscillators with clearance; it may pull separating flanks. Either c or c₀ is
zero.
"""

import numpy as np

from flexgear.compiled import INNER, njit
from flexgear.coupling.laws.law import Law, compiled_law


@njit(**INNER)
def clear(force, tangent):
    """Sets forces and tangents of all rows to zero."""
    for i in range(force.shape[1]):
        force[0, i] = force[1, i] = 0.0
        for j in range(force.shape[1]):
            tangent[0, i, j] = tangent[1, i, j] = 0.0


@compiled_law
def _linear(parameters, motion, force, tangent):
    """Linear law F = k δ + c δ̇."""
    k, c = parameters[0], parameters[1]
    delta = motion[0, 0]
    force[0, 0], force[1, 0] = k * delta + c * motion[1, 0], k * delta
    tangent[0, 0, 0], tangent[1, 0, 0] = k, c
    return 0.5 * k * delta * delta


@njit(**INNER)
def one_sided(parameters, motion, force, tangent):
    """One-sided law: open, damped (k δ + c δ̇) or limited (2 k δ), plus the constant damper."""
    k, c, constant = parameters[0], parameters[1], parameters[2]
    delta = motion[0, 0]
    force[0, 0], force[1, 0] = constant * motion[1, 0], 0.0
    tangent[0, 0, 0], tangent[1, 0, 0] = 0.0, constant
    if not delta > 0.0:
        return 0.0
    elastic = k * delta
    damped = elastic + c * motion[1, 0]
    force[1, 0] = elastic
    if damped > 2.0 * elastic:
        force[0, 0], tangent[0, 0, 0] = 2.0 * elastic + force[0, 0], 2.0 * k
    elif damped > 0.0:
        force[0, 0], tangent[0, 0, 0], tangent[1, 0, 0] = damped + force[0, 0], k, c + constant
    return 0.5 * elastic * delta


@compiled_law
def _one_sided(parameters, motion, force, tangent):
    """``one_sided`` for calls by address."""
    return one_sided(parameters, motion, force, tangent)


@njit(**INNER)
def add_damper(damper, motion, force, tangent):
    """Adds c δ̇ to the force of every row."""
    for i in range(motion.shape[1]):
        force[0, i] += damper * motion[1, i]
        tangent[1, i, i] += damper


@compiled_law
def _given_force(parameters, motion, force, tangent):
    """Constant force F = F₀; its work counts as that of a damper, without potential."""
    force[0, 0], force[1, 0] = parameters[0], 0.0
    tangent[0, 0, 0], tangent[1, 0, 0] = 0.0, 0.0
    return 0.0


@compiled_law
def _linear_rate(parameters, motion, force, tangent):
    """Machine at a port: F = F₀ + c (δ̇ − δ̇₀), limited to F₁ … F₂. Parameters: F₀, c, δ̇₀, F₁, F₂."""
    f = parameters[0] + parameters[1] * (motion[1, 0] - parameters[2])
    force[0, 0], force[1, 0] = min(max(f, parameters[3]), parameters[4]), 0.0
    tangent[0, 0, 0] = 0.0
    tangent[1, 0, 0] = parameters[1] if force[0, 0] == f else 0.0
    return 0.0


@compiled_law
def _not_compiled(parameters, motion, force, tangent):
    """Placeholder of a law that is not compiled: NaN, so that solutions with it fail."""
    for k in range(2):
        for i in range(motion.shape[1]):
            force[k, i] = np.nan
            for j in range(motion.shape[1]):
                tangent[k, i, j] = np.nan
    return np.nan


LINEAR = Law("linear", _linear)
ONE_SIDED = Law("one_sided", _one_sided)
GIVEN_FORCE = Law("given_force", _given_force)
LINEAR_RATE = Law("linear_rate", _linear_rate)
HELD_RATE = Law("held_rate", _linear_rate)  # constraint: the value of the law is kept at zero
NOT_COMPILED = Law("not_compiled", _not_compiled)
