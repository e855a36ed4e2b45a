"""How the planets of a train's stages share the load: factors over samples and coefficients."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.model.names import GearMeshName
from flexgear.results.labelled_dataset import groups_of
from flexgear.results.load_sharing import load_sharing, mesh_load_factor, planet_load_factors
from flexgear.results.running_sharing import DEFINITIONS, RunningSharing

Array = NDArray[np.float64]
ROUNDING = 1e-9  # of the largest force of a train: below it a gear mesh carries nothing


def without_rounding(force: ArrayLike, largest: float = 0.0) -> Array:
    """Forces (t, G) of all gear meshes of a train, zero where they are rounding of the largest.

    largest: of the loads that they are made of, N. Without torque errors may press one stage, or
    both flanks of a gear mesh, and what others carry is left over from that.
    """
    f = np.asarray(force, dtype=float)
    return np.where(np.abs(f) > ROUNDING * np.abs(f).max(initial=largest), f, 0.0)


def sharing_histories(
    force: ArrayLike, rated: ArrayLike, gear_meshes: Sequence[GearMeshName]
) -> dict[str, Array]:
    """ "load_sharing" (t, groups) and "planet_load_factor" (t, G) of forces (t, G) in N.

    force: of all gear meshes; rated: (G,) mean force at rated torque. Both are NaN where
    ``carry_together`` says no, and the latter where a gear mesh has nobody to share with.
    """
    f, mean = without_rounding(force), np.asarray(rated, dtype=float)
    groups = groups_of(gear_meshes)
    factor = np.full(f.shape, np.nan)
    largest = np.full((len(f), len(groups)), np.nan)
    for k, at in enumerate(groups.values()):
        factor[:, at] = planet_load_factors(f[:, at], float(mean[at].mean()))
        largest[:, k] = load_sharing(f[:, at], float(mean[at].mean()))
    return {"load_sharing": largest, "planet_load_factor": factor}


class SharingCoefficients:
    """Coefficients of all gear meshes of a train, from forces that come piece by piece.

    samples_per_cycle: by stage. What cannot be said (too few samples a cycle, no load) is NaN.
    """

    def __init__(
        self, gear_meshes: Sequence[GearMeshName], samples_per_cycle: Mapping[str, float]
    ) -> None:
        self._groups = [
            (at, RunningSharing(len(at), samples_per_cycle[group.stage]))
            for group, at in groups_of(gear_meshes).items()
        ]
        self._count = len(gear_meshes)

    def append(self, force: ArrayLike) -> None:
        """Some samples more of the gear-mesh forces (t, G), N."""
        f = without_rounding(force)
        for at, group in self._groups:
            group.append(f[:, at])

    def close_window(self) -> None:
        """What comes is of the next window."""
        for _, group in self._groups:
            group.close_window()

    def coefficients(self, first: int = 0) -> dict[str, Array]:
        """ "load_sharing_coefficient" (definitions, groups) and "planet_coefficient" (definitions,
        G) from the window ``first`` on, "mesh_load_factor" (groups,)."""
        planets = np.full((len(DEFINITIONS), self._count), np.nan)
        for at, group in self._groups:
            planets[:, at] = [group.planets(d, first) for d in DEFINITIONS]
        largest = [planets[:, at].max(axis=1) for at, _ in self._groups]
        assumed = [mesh_load_factor(len(at)) for at, _ in self._groups]
        return {
            "load_sharing_coefficient": np.reshape(largest, (-1, len(DEFINITIONS))).T,
            "planet_coefficient": planets,
            "mesh_load_factor": np.array([math.nan if a is None else a for a in assumed]),
        }


def sharing_coefficients(
    force: ArrayLike,
    gear_meshes: Sequence[GearMeshName],
    samples_per_cycle: Mapping[str, float],
) -> dict[str, Array]:
    """``SharingCoefficients`` of forces (t, G) in N that are all there."""
    running = SharingCoefficients(gear_meshes, samples_per_cycle)
    running.append(force)
    return running.coefficients()


def sharing_figures(data: xr.Dataset, group: str) -> dict[str, Any]:
    """Figures of one group of a dataset, for summaries: None where there is no number."""
    of_group = data.sel(group=group)
    figures: dict[str, Any] = {
        str(d): _number(of_group["load_sharing_coefficient"].sel(definition=d))
        for d in data["definition"].to_numpy()
    }
    figures["iec_61400_4"] = _number(of_group["mesh_load_factor"])
    return figures


def _number(value: xr.DataArray) -> float | None:
    return float(value) if np.isfinite(value) else None
