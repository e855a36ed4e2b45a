"""Figures of the stress in tooth roots, over the positions of a dataset of equilibria.

A fillet is stretched as its own flank carries and pressed as the other flank of the tooth does,
which every tooth of a planet is in turn by sun and ring. Beside them it has no load and no stress;
so the stress ranges at a place along the face

    Δσ(z) = max(0, max σ(z)) − min(0, min σ(z))

over the positions, in the worst tooth and the worst of the fillets that are stretched. Of an FE
ring every tooth is followed through all positions, its rim's bending between loads included. (The
other fillet of a tooth that carries on one flank is pressed harder than its own one is stretched,
but cracks grow in tension.)
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Array = NDArray[np.float64]


def root_figures(data: xr.Dataset, stage: str) -> dict[str, dict[str, float]]:
    """By gear ("planet", "sun", "ring"), MPa: largest and least stress in its fillets, and how far
    it ranges at one place along the face where it ranges farthest; none of a stage without."""
    extremes = root_extremes(data, stage)
    for gear, of_gear in gears_of(data, stage) if extremes else ():
        far = _range_of_teeth(of_gear, stage) if _by_tooth(gear, of_gear) else _range(of_gear)
        extremes[gear]["range"] = 1e-6 * far
    return extremes


def root_extremes(data: xr.Dataset, stage: str) -> dict[str, dict[str, float]]:
    """The same without the range, of any positions."""
    if "face_root_stress" not in data:
        return {}
    return {
        gear: {
            "max": 1e-6 * float(of_gear["root_stress"].max()),
            "min": 1e-6 * min(0.0, float(of_gear["face_root_compression"].min())),
        }
        for gear, of_gear in gears_of(data, stage)
    }


def gears_of(data: xr.Dataset, stage: str) -> Iterator[tuple[str, xr.Dataset]]:
    """Gears of a stage that have root stress, and their part of the data: (…, flank, …)."""
    of_stage = data.isel(flank=data["flank_stage"].to_numpy() == stage)
    for kind in dict.fromkeys(map(str, of_stage["flank_kind"].to_numpy())):
        mate = of_stage.isel(flank=of_stage["flank_kind"].to_numpy() == kind).sel(
            pair_member="gear"
        )
        yield from _loaded(kind, mate)
    yield from _loaded("planet", of_stage.sel(pair_member="planet"))


def _loaded(gear: str, of_gear: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    loaded = of_gear.isel(flank=of_gear["root_stress"].notnull().any("position").to_numpy())
    if loaded.sizes["flank"]:
        yield gear, loaded


def _by_tooth(gear: str, of_gear: xr.Dataset) -> bool:
    """Whether the stress of each tooth is known at all positions, with load and without."""
    return gear == "ring" and "tooth_root_range" in of_gear


def _range_of_teeth(of_gear: xr.Dataset, stage: str) -> float:
    """Pa, the largest of the fillets that are stretched, of all teeth of a ring."""
    teeth = of_gear["tooth_root_range"].to_numpy()[of_gear["tooth_stage"].to_numpy() == stage]
    stretched = np.isin([-1, 1], of_gear["root_side"].to_numpy())
    return float(teeth[:, stretched].max())


def _range(of_gear: xr.Dataset) -> float:
    """Pa, the largest of the fillets that are stretched and all places along the face."""
    side, stresses = of_gear["root_side"].to_numpy(), []
    for fillet in np.unique(side):
        stretched = of_gear["face_root_stress"].isel(flank=side == fillet)
        pressed = of_gear["face_root_compression"].isel(flank=side == -fillet)
        stresses.append(float((_over_all(stretched, np.fmax) - _over_all(pressed, np.fmin)).max()))
    return max(stresses)


def _over_all(stress: xr.DataArray, extreme: np.ufunc) -> Array:
    """Extremes (face,) over flanks, positions and no load, Pa."""
    values = stress.transpose(..., "face").to_numpy()
    return np.asarray(extreme.reduce(values.reshape(-1, values.shape[-1]), axis=0, initial=0.0))
