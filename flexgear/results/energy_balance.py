"""What the energy account of a transient leaves over.

residual(t) = Δ(kinetic + elastic + pair elastic)
              − (input − brake − damping − pair damping + parametric work),  Δ since the start,

relative to the largest elastic energy (structure and tooth pairs) of the run.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.kernels.energy import LEFT_OVER
from flexgear.model.errors import FlexgearError
from flexgear.results.sinks import Ranges


def energy_residual(data: xr.Dataset) -> NDArray[np.float64]:
    """Residual (t,) over the peak elastic energy of a dataset with energy_* in J."""
    account = energy_account(data)
    left = account["left"].to_numpy()
    return np.asarray((left - left[0]) / _peak(account["elastic"]))


def energy_account(data: xr.Dataset) -> xr.Dataset:
    """Over the samples of a dataset with energy_*: "left", what is stored less what entered, and
    "elastic", of structure and tooth pairs, J."""
    missing = [n for e in LEFT_OVER if (n := f"energy_{e}") not in data]
    if missing:
        raise FlexgearError(f"no energy balance without {', '.join(missing)}")
    left = sum((sign * data[f"energy_{n}"] for n, sign in LEFT_OVER.items()), xr.DataArray(0.0))
    elastic = data["energy_elastic"] + data["energy_pair_elastic"]
    return xr.Dataset({"left": left, "elastic": elastic})


def largest_residual(ranges: Ranges) -> float:
    """Largest size of the residual, of ``Ranges(energy_account)``."""
    first = float(ranges.first["left"])
    most = max(float(ranges.largest["left"]) - first, first - float(ranges.least["left"]))
    return most / _peak(ranges.largest["elastic"])


def _peak(elastic: xr.DataArray) -> float:
    peak = float(elastic.max())
    if peak <= 0:
        raise FlexgearError("no energy balance: the run holds no elastic energy")
    return peak
