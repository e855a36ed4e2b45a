"""Radial harmonics of a ring: what its star is made of.

u_r(φ_j) = u_x cos φ_j + u_y sin φ_j at equally spaced angles φ_j = 2πj/z + φ_0, and

    u_r(φ) = Σ_n |c_n| cos(n φ − arg c_n),   c_n = (2/z) Σ_j u_r(φ_j) e^{i n φ_j}   (c_0: 1/z).

A star that turns by θ has arg(c_n)/n growing by θ, modulo 2π/n.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def radial_displacement(displacement: ArrayLike, first_angle: float = 0.0) -> Array:
    """u_r (..., z) from tooth-node displacements (..., z, 2 or 3) in global axes."""
    u = np.asarray(displacement, dtype=float)
    phi = first_angle + 2 * np.pi * np.arange(u.shape[-2]) / u.shape[-2]
    return np.asarray(u[..., 0] * np.cos(phi) + u[..., 1] * np.sin(phi))


def harmonics(values: ArrayLike, first_angle: float = 0.0) -> NDArray[np.complex128]:
    """c_n (..., z//2 + 1) of values (..., z) at equally spaced angles, orders 0, 1, 2, …

    The highest order of an even number of angles counts once, as order 0 does.
    """
    v = np.asarray(values, dtype=float)
    z = v.shape[-1]
    c = np.conj(np.fft.rfft(v, axis=-1)) * (2 / z)
    c[..., 0] /= 2
    if z % 2 == 0:
        c[..., -1] /= 2
    orders = np.arange(c.shape[-1])
    return np.asarray(c * np.exp(1j * orders * first_angle))


def radial_harmonics(displacement: ArrayLike, first_angle: float = 0.0) -> NDArray[np.complex128]:
    """c_n (..., orders) in m of tooth-node displacements (..., z, 2 or 3)."""
    return harmonics(radial_displacement(displacement, first_angle), first_angle)


def star_angle(coefficients: NDArray[np.complex128], order: int) -> Array:
    """arg(c_order)/order (...,) in rad, in [0, 2π/order): where a crest of that order stands."""
    period = 2 * np.pi / order
    return np.asarray(np.mod(np.angle(coefficients[..., order]) / order, period))


def angle_difference(a: ArrayLike, b: ArrayLike, order: int) -> Array:
    """a − b in rad, the smallest modulo 2π/order, in [−π/order, π/order)."""
    period = 2 * np.pi / order
    difference = np.asarray(a, dtype=float) - np.asarray(b, dtype=float)
    return np.asarray(np.mod(difference + period / 2, period) - period / 2)
