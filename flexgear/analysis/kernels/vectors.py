"""Plain loops over contiguous vectors, compiled.

NumPy's own assignments and products bring broadcasting, error texts and BLAS into every compiled
function that uses them, which multiplies the time that compilation takes.
"""

import math

import numpy as np
from numpy.typing import NDArray

from flexgear.compiled import FAST, INNER, njit

CACHE_LINE = 8  # numbers in a cache line
SIMD = 16  # numbers per iteration of a vectorised loop


def rounded_up(count: int) -> int:
    """The next multiple of SIMD, for which vectorised loops take no longer, and often less."""
    return count + -count % SIMD


def aligned(*shape: int) -> NDArray[np.float64]:
    """An array of zeros aligned to a cache line, as vectors across two lines are read slowly."""
    room = np.zeros(math.prod(shape) + CACHE_LINE)
    start = -(room.ctypes.data // room.itemsize) % CACHE_LINE
    return room[start : start + math.prod(shape)].reshape(shape)


padded = njit(**INNER)(rounded_up)


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
def two_dots(a, b, c):
    """Σ a_i b_i and Σ a_i c_i over the length of ``a``."""
    total = other = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
        other += a[i] * c[i]
    return total, other


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
def put_two(target, factor, source, other_factor, other):
    """target[i] = factor · source[i] + other_factor · other[i] over the length of ``target``."""
    for i in range(target.shape[0]):
        target[i] = factor * source[i] + other_factor * other[i]


@njit(**INNER, fastmath=FAST)
def add_six(target, factors, table, first):
    """target[i] += Σ_p factors[p] · table[p, first + i], p = 0 … 5, over the length of target."""
    stop = first + target.shape[0]
    p, q, r = table[0, first:stop], table[1, first:stop], table[2, first:stop]
    s, t, u = table[3, first:stop], table[4, first:stop], table[5, first:stop]
    a, b, c, d, e, f = factors[0], factors[1], factors[2], factors[3], factors[4], factors[5]
    for i in range(target.shape[0]):
        target[i] += a * p[i] + b * q[i] + c * r[i] + d * s[i] + e * t[i] + f * u[i]


@njit(**INNER, fastmath=FAST)
def put_six(target, factors, table, first):
    """target[i] = Σ_p factors[p] · table[p, first + i], p = 0 … 5, over the length of target."""
    stop = first + target.shape[0]
    p, q, r = table[0, first:stop], table[1, first:stop], table[2, first:stop]
    s, t, u = table[3, first:stop], table[4, first:stop], table[5, first:stop]
    a, b, c, d, e, f = factors[0], factors[1], factors[2], factors[3], factors[4], factors[5]
    for i in range(target.shape[0]):
        target[i] = a * p[i] + b * q[i] + c * r[i] + d * s[i] + e * t[i] + f * u[i]
