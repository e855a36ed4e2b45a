"""Fourier series of results: shape of a ring, orders of transmission errors over a cycle."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.arrays import Array
from flexgear.results.labelled_dataset import coordinate, variable


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


ERRORS = ("transmission_error", "unloaded_transmission_error")


def positions_for(orders: int) -> int:
    """Least positions of a gear-mesh cycle for so many orders, a mean and a slope."""
    return 2 * orders + 4


def order_amplitudes(phase: Array, values: Array, orders: int) -> Array:
    """Amplitudes (N,) of orders 1 … N; phase (p,) in cycles, values (p,) m."""
    cycle = np.floor(phase + 1e-9).astype(int)
    inside = 2.0 * np.pi * (phase - cycle)
    cycle_columns = (cycle[:, None] == np.unique(cycle)).astype(float)
    waves = np.arange(1, orders + 1) * inside[:, None]
    terms = np.hstack(
        [np.cos(waves), np.sin(waves), cycle_columns, cycle_columns * (inside - np.pi)[:, None]]
    )
    coefficients = np.linalg.lstsq(terms, values, rcond=None)[0]
    return np.hypot(coefficients[:orders], coefficients[orders : 2 * orders])


def with_orders(data: xr.Dataset, phase: Array, orders: int) -> xr.Dataset:
    """The dataset of equilibria with the orders of loaded and unloaded transmission errors; missing
    of flanks that do not carry throughout. phase (p,): of the gear mesh at its positions, in
    cycles."""
    variables = {}
    for name in ERRORS:
        values = data[name].transpose("position", "flank").to_numpy()
        amplitudes = np.full((values.shape[1], orders), np.nan)
        for m in np.flatnonzero(np.isfinite(values).all(axis=0)):
            amplitudes[m] = order_amplitudes(phase, values[:, m], orders)
        variables[f"{name}_order"] = variable(f"{name}_order", amplitudes)
    return data.assign(variables).assign_coords(
        gear_mesh_order=coordinate("gear_mesh_order", "gear_mesh_order", np.arange(1, orders + 1)),
        gear_mesh_phase=coordinate("gear_mesh_phase", "position", phase),
    )
