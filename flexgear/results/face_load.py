"""Figures of the load along the face, over the positions of a dataset of equilibria.

K_Hβ of ISO 6336-1 is the largest over the mean line load along the face, where W(z) is what all
pairs of a gear mesh carry at z in the mean of a cycle; here of the positions of a dataset, which
have to be spread evenly over whole cycles of the gear mesh for that.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from flexgear.gears.face_load import factor_along


def face_figures(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Figures over all positions of a dataset of equilibria, of every flank that carries, by its
    name; none where pairs have no slices."""
    if "face_line_load" not in data:
        return {}
    found = {}
    for name in map(str, data["flank"].to_numpy()):
        own = data.sel(flank=name)
        load = own["face_line_load"].mean("position").to_numpy()
        if not load.max() > 0:
            continue
        found[name] = {
            "k_h_beta": factor_along(load),
            "largest_contact_pressure_mpa": 1e-6 * float(own["largest_contact_pressure"].max()),
            "largest_line_load_n_per_mm": 1e-3 * float(own["largest_line_load"].max()),
            "misalignment_um": 1e6 * float(own["gear_mesh_misalignment"].mean()),
            "misalignment_by_cause_um": _causes(own),
            **_mean_and_swing(own, "transmission_error"),
            **_mean_and_swing(own, "unloaded_transmission_error"),
        }
    return found


def misalignment_of_groups(figures: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, float]]:
    """Misalignment by cause, µm, of ``face_figures`` in the mean over the planets, by group of
    gear meshes."""
    groups: dict[str, list[Mapping[str, float]]] = {}
    for flank, one in figures.items():
        groups.setdefault(_group(flank), []).append(one["misalignment_by_cause_um"])
    return {
        group: {c: float(np.mean([one.get(c, 0.0) for one in every])) for c in _all_keys(every)}
        for group, every in groups.items()
    }


def _group(flank: str) -> str:
    """ "stage ring" of "stage ring 1 drive"."""
    return flank.rsplit(" ", 2)[0]


def _all_keys(every: Iterable[Mapping[str, float]]) -> list[str]:
    return list(dict.fromkeys(key for one in every for key in one))


def _mean_and_swing(own: xr.Dataset, error: str) -> dict[str, float]:
    """Mean and peak to peak, µm, of one flank."""
    values = own[error].to_numpy()[np.isfinite(own["transmission_error"].to_numpy())]
    return {
        f"{error}_um": 1e6 * float(values.mean()),
        f"{error}_peak_to_peak_um": 1e6 * float(np.ptp(values)),
    }


def _causes(own: xr.Dataset) -> dict[str, float]:
    """Mean misalignment by cause, µm, of one flank; without what its gear mesh does not have."""
    found = own["gear_mesh_misalignment_by_cause"]
    every = {str(c): found.sel(cause=c).to_numpy() for c in found["cause"].to_numpy()}
    return {c: 1e6 * float(np.nanmean(v)) for c, v in every.items() if np.nan_to_num(v).any()}
