"""Bearing with radial clearance: F = k ⟨|u| − c⟩ u/|u| along x and y. Parameters: k N/m, c m.

k is the radial stiffness without the fraction ``CENTERING``, which remains a linear spring, so that
with zero clearance this is the linear bearing.
"""

import math

import numpy as np

from flexgear.coupling.laws.basic import clear
from flexgear.coupling.laws.law import CENTERING, Law, compiled_law
from flexgear.model.bearings import Bearing

LEAST_TANGENT = 1e-4  # of a bearing inside its clearance, over its stiffness


@compiled_law
def _clearance(parameters, motion, force, tangent):
    """Force of a bearing with clearance; the tangent is k along u and k (1 − c/|u|) across it.
    Inside the clearance force and tangent are zero; a small tangent keeps iterations from drifting
    and does not change the solution."""
    k, gap = parameters[0], parameters[1]
    x, y = motion[0, 0], motion[0, 1]
    size = math.sqrt(x * x + y * y)
    share = 1.0 - gap / size if size > gap else 0.0
    clear(force, tangent)
    for i in range(2):
        force[0, i] = force[1, i] = k * share * motion[0, i]
        tangent[0, i, i] = k * max(share, LEAST_TANGENT)
    if share > 0.0:
        along = k * (1.0 - max(share, LEAST_TANGENT)) / (size * size)
        for i in range(2):
            for j in range(2):
                tangent[0, i, j] += along * motion[0, i] * motion[0, j]
    over = max(size - gap, 0.0)
    return 0.5 * k * over * over


def _stated_by(bearing: Bearing, viscosity: float | None) -> list[float] | None:
    gap = bearing.clearance
    return [(1.0 - CENTERING) * bearing.stiffness[0], gap] if gap > 0 else None


CLEARANCE = Law("clearance", _clearance, (0, 1), lambda p: np.array([p[0], p[0]]), _stated_by)
