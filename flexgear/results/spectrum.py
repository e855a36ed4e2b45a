"""Amplitude spectra of histories, by order of a gear mesh.

    A(f) = 2/Σ w_j |Σ_j w_j (x_j − x̄) e^{−2πi f t_j}|

with the Hann window w: a sine between the ends of the history shows its own amplitude at its
frequency. The order is f over the gear-mesh frequency; what passes once a turn of the carrier
stands beside an order by 1/z of the ring.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.results.labelled_dataset import groups_in

Array = NDArray[np.float64]
MOST = 2**17  # samples that are looked at, the last ones
HIGHEST = 10.5  # order


def amplitudes(values: ArrayLike, step: float) -> tuple[Array, Array]:
    """Frequencies (f,) in Hz and amplitudes (..., f) of histories (..., t) sampled every step,
    s."""
    x = np.asarray(values, dtype=float)
    window = np.hanning(x.shape[-1] + 2)[1:-1]
    spectrum = np.abs(np.fft.rfft((x - x.mean(axis=-1, keepdims=True)) * window, axis=-1))
    hz = np.fft.rfftfreq(x.shape[-1], step).astype(float)
    return hz, np.asarray(2 * spectrum / window.sum())


def force_spectra(data: xr.Dataset, stage: str, frequency: float) -> xr.Dataset:
    """Spectra of the gear-mesh forces of a stage's first planet in a settled transient.

    Variable amplitude (gear_mesh, order) in N by kind and side, attribute mean_n; frequency: of the
    gear mesh, Hz.
    Orders go as far as the samples tell, 10 at most.
    """
    last = data.isel(time=slice(-MOST, None))
    first_planet = np.flatnonzero((last["stage"] == stage) & (last["planet"] == 1))
    forces = last["gear_mesh_force"].isel(gear_mesh=first_planet).transpose("gear_mesh", "time")
    force = forces.to_numpy()
    time = last["time"].to_numpy()
    hz, amplitude = amplitudes(force, float(time[-1] - time[0]) / (len(time) - 1))
    order = hz / frequency
    in_range = (order > 0) & (order <= HIGHEST)
    return xr.Dataset(
        {"amplitude": (("gear_mesh", "order"), amplitude[:, in_range], {"units": "N"})},
        {"gear_mesh": [g.part for g in groups_in(forces)], "order": order[in_range]},
        {"mean_n": float(np.abs(force).mean())},
    )
