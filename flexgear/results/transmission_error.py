r"""Orders of the transmission error over the gear mesh, from positions in some of its cycles.

In every cycle c of the gear mesh, at the phase ψ (2π a cycle), the transmission error is taken as

    e = a_c + b_c ψ + Σ_n A_n cos nψ + B_n sin nψ,    n = 1 … N,

by least squares over all cycles at once: what passes slowly, as bolts do, is in a_c and b_c, and
the amplitude of order n is √(A_n² + B_n²).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.results.labelled_dataset import coordinate, variable

Array = NDArray[np.float64]
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
