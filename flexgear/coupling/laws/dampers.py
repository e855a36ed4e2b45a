"""Viscous dampers beside the springs of a bearing, joint or port: F = c δ̇ along and about x, y, z.

Rates are whole ones: a damper against turning takes c ω of what rolls, in equilibria at rated
speed, too. They are taken in the frame of the inner ring, so that of a body in a turning frame
Ω × u is left out beside u̇. Parameters: c (6,), N s/m and N m s/rad.
"""

from __future__ import annotations

from flexgear.coupling.laws.basic import clear
from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.model.bearings import Bearing


@compiled_law
def _dampers(parameters, motion, force, tangent):
    """No row is coupled with another, and none has a potential."""
    clear(force, tangent)
    for i in range(6):
        force[0, i], tangent[1, i, i] = parameters[i] * motion[1, i], parameters[i]
    return 0.0


def _stated_by(bearing: Bearing, viscosity: float | None) -> list[float] | None:
    damping = bearing.damping
    return list(damping.coefficients) if damping is not None else None


DAMPERS = Law("dampers", _dampers, tuple(range(6)), stated_by=_stated_by, replaces=False)
