"""How the planets of a train's stages share the load: factors over samples and coefficients."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.results.load_sharing import (
    Definition,
    load_sharing,
    mesh_load_factor,
    planet_load_factors,
    sharing_by,
)
from flexgear.results.train_dataset import GearMeshName, groups_of

Array = NDArray[np.float64]
DEFINITIONS: tuple[Definition, ...] = get_args(Definition)
FEWEST = 4.0  # samples a gear-mesh cycle whose maximum is to be seen


def sharing_histories(
    force: ArrayLike, rated: ArrayLike, gear_meshes: Sequence[GearMeshName]
) -> dict[str, Array]:
    """ "load_sharing" (t, groups) and "planet_load_factor" (t, G) of forces (t, G) in N.

    rated: (G,) mean force at rated torque. Both are NaN below 3 % of the rated load, and the
    latter where a gear mesh has nobody to share with.
    """
    f, mean = np.asarray(force, dtype=float), np.asarray(rated, dtype=float)
    groups = groups_of(gear_meshes)
    factor = np.full(f.shape, np.nan)
    largest = np.full((len(f), len(groups)), np.nan)
    for k, at in enumerate(groups.values()):
        factor[:, at] = planet_load_factors(f[:, at], float(mean[at].mean()))
        largest[:, k] = load_sharing(f[:, at], float(mean[at].mean()))
    return {"load_sharing": largest, "planet_load_factor": factor}


def sharing_coefficients(
    force: ArrayLike,
    gear_meshes: Sequence[GearMeshName],
    samples_per_cycle: Mapping[str, float],
) -> dict[str, Array]:
    """ "load_sharing_coefficient" (definitions, groups), "planet_coefficient" (definitions, G) and
    "mesh_load_factor" (groups,) of forces (t, G) in N.

    samples_per_cycle: by stage. What cannot be said (too few samples a cycle, no load) is NaN.
    """
    f = np.asarray(force, dtype=float)
    groups = groups_of(gear_meshes)
    planets = np.full((len(DEFINITIONS), f.shape[1]), np.nan)
    largest = np.full((len(DEFINITIONS), len(groups)), np.nan)
    for g, (group, at) in enumerate(groups.items()):
        per_cycle = samples_per_cycle[group.stage]
        for d, definition in enumerate(DEFINITIONS):
            if not _can_be_said(f[:, at], definition, per_cycle):
                continue
            found = sharing_by(definition, f[:, at], per_cycle)
            planets[d, at], largest[d, g] = found.planets, found.coefficient
    assumed = [mesh_load_factor(len(at)) for at in groups.values()]
    return {
        "load_sharing_coefficient": largest,
        "planet_coefficient": planets,
        "mesh_load_factor": np.array([math.nan if a is None else a for a in assumed]),
    }


def _can_be_said(force: Array, definition: Definition, per_cycle: float) -> bool:
    if not len(force):
        return False
    total = force.sum(axis=1) * (np.sign(force.sum()) or 1.0)
    if definition == "instantaneous":
        return bool(np.all(total > 0))
    return bool(per_cycle >= FEWEST and len(force) >= per_cycle and np.all(total > 0))


def sharing_figures(data: xr.Dataset, group: str) -> dict[str, Any]:
    """Figures of one group of a dataset, for summaries: None where there is no number."""
    one = data.sel(group=group)
    figures: dict[str, Any] = {
        str(d): _number(one["load_sharing_coefficient"].sel(definition=d))
        for d in data["definition"].to_numpy()
    }
    figures["iec_61400_4"] = _number(one["mesh_load_factor"])
    return figures


def _number(value: xr.DataArray) -> float | None:
    return float(value) if np.isfinite(value) else None
