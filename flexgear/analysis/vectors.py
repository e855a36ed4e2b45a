"""Plain loops over contiguous vectors, compiled.

NumPy's own assignments and products bring broadcasting, error texts and BLAS into every compiled
function that uses them, which multiplies the time that compilation takes.
"""

from __future__ import annotations

from numba import njit

from flexgear.coupling.compiled import FAST, INNER

SIMD = 16  # numbers that a vectorised loop takes at once; what remains it takes one by one


def rounded_up(count: int) -> int:
    """The next multiple of SIMD: so many numbers take no longer, and often less long."""
    return count + -count % SIMD


wide = njit(**INNER)(rounded_up)


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
    """Σ a_i b_i over the length of ``a``."""
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@njit(**INNER, fastmath=FAST)
def add(target, factor, source):
    """target[i] += factor · source[i] over the length of ``target``."""
    for i in range(target.shape[0]):
        target[i] += factor * source[i]


@njit(**INNER, fastmath=FAST)
def add_two(target, factor, source, other_factor, other):
    """target[i] += factor · source[i] + other_factor · other[i] over the length of ``target``."""
    for i in range(target.shape[0]):
        target[i] += factor * source[i] + other_factor * other[i]


@njit(**INNER, fastmath=FAST)
def add_six(target, factors, sources, first, width):
    """target[i] += Σ_p factors[p] · sources[first + p · width + i], p = 0 … 5, over the length of
    ``target``: six lines of a matrix at once, for most of the time goes into reading ``target``."""
    a, b, c, d, e, f = (
        factors[0],
        factors[1],
        factors[2],
        factors[3],
        factors[4],
        factors[5],
    )
    n = target.shape[0]
    p = sources[first : first + n]
    q = sources[first + width : first + width + n]
    r = sources[first + 2 * width : first + 2 * width + n]
    s = sources[first + 3 * width : first + 3 * width + n]
    t = sources[first + 4 * width : first + 4 * width + n]
    u = sources[first + 5 * width : first + 5 * width + n]
    for i in range(n):
        target[i] += a * p[i] + b * q[i] + c * r[i] + d * s[i] + e * t[i] + f * u[i]
