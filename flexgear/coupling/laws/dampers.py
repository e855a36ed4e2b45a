"""Viscous dampers of a bearing, joint or port: F = c δ̇ along and about x, y, z.

Rates include rolling: a rotational damper has the torque c ω, also in equilibria at rated speed.
Rates are those in the frame of the inner ring, so Ω × u is neglected beside u̇ in rotating frames.
Parameters: c (6,), N s/m and N m s/rad.
"""

from flexgear.coupling.laws.basic import clear
from flexgear.coupling.laws.law import Law, compiled_law
from flexgear.model.bearings import Bearing


@compiled_law
def _dampers(parameters, motion, force, tangent):
    """Force F = c δ̇ of every row, without coupling and potential."""
    clear(force, tangent)
    for i in range(6):
        force[0, i], tangent[1, i, i] = parameters[i] * motion[1, i], parameters[i]
    return 0.0


def _stated_by(bearing: Bearing, viscosity: float | None) -> list[float] | None:
    damping = bearing.damping
    return list(damping.coefficients) if damping is not None else None


DAMPERS = Law("dampers", _dampers, tuple(range(6)), stated_by=_stated_by, replaces=False)
