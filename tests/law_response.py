"""What a law of force elements answers at one motion, called as the solvers call it."""

import numpy as np
from numba import njit

from flexgear.coupling.laws import functions


@njit
def called(laws, number, parameters, motion, force, tangent):
    return laws[number](parameters, motion, force, tangent)


def respond(number, parameters, motion, used=None):
    """Potential J, force (2, r) and tangent (2, r, r) of a law at a motion (2, r); used: numbers of
    the laws that are compiled, that one alone if left out."""
    motion = np.array(motion, dtype=float)
    r = motion.shape[1]
    force, tangent = np.zeros((2, r)), np.zeros((2, r, r))
    laws = functions([number] if used is None else used)
    energy = called(laws, number, np.array(parameters, dtype=float), motion, force, tangent)
    return float(energy), force, tangent
