"""What the energy account of a transient leaves over.

residual(t) = Δ(kinetic + elastic + pair elastic)
              − (input − brake − damping − pair damping + parametric work),  Δ since the start,

relative to the largest elastic energy (structure and tooth pairs) of the run.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.model.errors import FlexgearError

STORED = ("kinetic", "elastic", "pair_elastic")
ENTERED = {
    "input_work": 1.0,
    "brake_work": -1.0,
    "damping_work": -1.0,
    "pair_damping_work": -1.0,
    "parametric_work": 1.0,
}


def energy_residual(data: xr.Dataset) -> NDArray[np.float64]:
    """Residual (t,) over the peak elastic energy of a dataset with energy_* in J."""
    names = [f"energy_{n}" for n in (*STORED, *ENTERED)]
    missing = [n for n in names if n not in data]
    if missing:
        raise FlexgearError(f"no energy balance without {', '.join(missing)}")
    since = {n: data[n].to_numpy() - data[n].to_numpy()[0] for n in names}
    left = sum(since[f"energy_{n}"] for n in STORED)
    left = left - sum(sign * since[f"energy_{n}"] for n, sign in ENTERED.items())
    peak = float((data["energy_elastic"] + data["energy_pair_elastic"]).max())
    if peak <= 0:
        raise FlexgearError("no energy balance: the run holds no elastic energy")
    return np.asarray(left / peak)
