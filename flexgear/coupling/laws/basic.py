"""Laws of tooth pairs, of rows with a constant stiffness, of given forces and of machines at ports.

One-sided contact:

    F = 0 where δ ≤ 0,   else   F = min(max(0, k δ + c δ̇), 2 k δ)

Damping acts in contact only, never pulls and never exceeds the elastic load: a term c δ̇ that
switched on at δ = 0 would jump at an impact, where steps were then of first order only. F is
continuous, and what it needs follows from k and c. At rest it is k ⟨δ⟩, the law of equilibria.
Under the linear law F = k δ + c δ̇ always. Parameters of both: k, c.

Laws of tooth pairs that only push have one parameter more, a damper c₀ that acts always, F + c₀ δ̇,
in contact or not: so oscillators with clearance are damped in most publications. A pair that parts
is then slowed and, where flanks leave each other fast, pulled. It is zero where c is not.
"""

from __future__ import annotations

import numpy as np

from flexgear.compiled import INNER, njit
from flexgear.coupling.laws.law import Law, compiled_law


@njit(**INNER)
def clear(force, tangent):
    """No force and no tangent of any row."""
    for i in range(force.shape[1]):
        force[0, i] = force[1, i] = 0.0
        for j in range(force.shape[1]):
            tangent[0, i, j] = tangent[1, i, j] = 0.0


@compiled_law
def _linear(parameters, motion, force, tangent):
    """F = k δ + c δ̇."""
    k, c = parameters[0], parameters[1]
    delta = motion[0, 0]
    force[0, 0], force[1, 0] = k * delta + c * motion[1, 0], k * delta
    tangent[0, 0, 0], tangent[1, 0, 0] = k, c
    return 0.5 * k * delta * delta


@njit(**INNER)
def one_sided(parameters, motion, force, tangent):
    """Open, damped (k δ + c δ̇) or limited (2 k δ), and the damper that acts always."""
    k, c, always = parameters[0], parameters[1], parameters[2]
    delta = motion[0, 0]
    force[0, 0], force[1, 0] = always * motion[1, 0], 0.0
    tangent[0, 0, 0], tangent[1, 0, 0] = 0.0, always
    if not delta > 0.0:
        return 0.0
    elastic = k * delta
    damped = elastic + c * motion[1, 0]
    force[1, 0] = elastic
    if damped > 2.0 * elastic:
        force[0, 0], tangent[0, 0, 0] = 2.0 * elastic + force[0, 0], 2.0 * k
    elif damped > 0.0:
        force[0, 0], tangent[0, 0, 0], tangent[1, 0, 0] = damped + force[0, 0], k, c + always
    return 0.5 * elastic * delta


@compiled_law
def _one_sided(parameters, motion, force, tangent):
    """The same, to be called by its address."""
    return one_sided(parameters, motion, force, tangent)


@njit(**INNER)
def add_damper(damper, motion, force, tangent):
    """c δ̇ of every row beside forces at rest."""
    for i in range(motion.shape[1]):
        force[0, i] += damper * motion[1, i]
        tangent[1, i, i] += damper


@compiled_law
def _given_force(parameters, motion, force, tangent):
    """F = F₀, whatever moves; its work is booked like that of a damper."""
    force[0, 0], force[1, 0] = parameters[0], 0.0
    tangent[0, 0, 0], tangent[1, 0, 0] = 0.0, 0.0
    return 0.0


@compiled_law
def _linear_rate(parameters, motion, force, tangent):
    """F = F₀ + c (δ̇ − δ̇₀) from F₁ to F₂: a machine at a port. Parameters: F₀, c, δ̇₀, F₁, F₂."""
    f = parameters[0] + parameters[1] * (motion[1, 0] - parameters[2])
    force[0, 0], force[1, 0] = min(max(f, parameters[3]), parameters[4]), 0.0
    tangent[0, 0, 0] = 0.0
    tangent[1, 0, 0] = parameters[1] if force[0, 0] == f else 0.0
    return 0.0


@compiled_law
def _not_compiled(parameters, motion, force, tangent):
    """Stands for a law that nobody said is used: no number, so that no solution comes of it."""
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
HELD_RATE = Law("held_rate", _linear_rate)  # of a row that is held: what the law gives is zero
NOT_COMPILED = Law("not_compiled", _not_compiled)
