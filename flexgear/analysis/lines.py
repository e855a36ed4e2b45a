"""Plain loops over lines of numbers, compiled.

NumPy's own assignments and products bring broadcasting, error texts and BLAS into every compiled
function that uses them, which multiplies the time that compilation takes.
"""

from __future__ import annotations

from numba import njit

from flexgear.coupling.compiled import FAST, INNER


@njit(**INNER)
def put(target, source):
    """target[i] = source[i] over the length of ``source``."""
    for i in range(source.shape[0]):
        target[i] = source[i]


@njit(**INNER)
def fill(target, value):
    """target[i] = value."""
    for i in range(target.shape[0]):
        target[i] = value


@njit(**INNER, fastmath=FAST)
def dot(a, b):
    """Σ a_i b_i."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total
