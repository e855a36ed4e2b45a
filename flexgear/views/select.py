"""Taking what a picture needs out of labelled datasets."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.views.style import FloatArray

Runs = Mapping[str, xr.Dataset]  # by variant
Window = tuple[float, float]


def variable(dataset: xr.Dataset, name: str) -> xr.DataArray:
    """Variable ``name`` of ``dataset``, or one clear line about what it has instead."""
    if name not in dataset:
        names = ", ".join(sorted(str(key) for key in dataset.variables))
        raise FlexgearError(f"cannot draw: the dataset has no variable '{name}' (it has {names})")
    return dataset[name]


def leading_dim(dataset: xr.Dataset) -> str:
    """Name of the sampled dimension: "time" of a transient, "position" of equilibria."""
    return "time" if "time" in dataset.dims else "position"


def planet_count(dataset: xr.Dataset) -> int:
    """Number of planets N of the part of a stage."""
    return len(np.unique(variable(dataset, "planet")))


def abscissa(dataset: xr.Dataset, x: str) -> FloatArray:
    """Values of the horizontal axis: "stage_angle" of the carrier (rad) or "time" (s)."""
    if x not in ("stage_angle", "time"):
        raise FlexgearError(f"cannot draw over '{x}': choose stage_angle or time")
    return np.asarray(variable(dataset, x), dtype=float)


def windowed(dataset: xr.Dataset, x: str, window: Window | None) -> xr.Dataset:
    """Samples with window[0] <= x <= window[1]."""
    if window is None:
        return dataset
    values = abscissa(dataset, x)
    keep = np.flatnonzero((values >= window[0]) & (values <= window[1]))
    if keep.size < 2:
        raise FlexgearError(
            f"nothing to draw between {window[0]:g} and {window[1]:g}: {x} runs from "
            f"{np.nanmin(values):g} to {np.nanmax(values):g}"
        )
    return dataset.isel({leading_dim(dataset): keep})


def within_window(runs: Runs, x: str, window: Window | None) -> Runs:
    """The same of every run."""
    return {name: windowed(data, x, window) for name, data in runs.items()}


def thinned(dataset: xr.Dataset, samples: int) -> xr.Dataset:
    """At most ``samples`` samples, evenly spread from the first on (for maps and animations): a
    slice, which is read at once where the dataset lies in a file."""
    dim = leading_dim(dataset)
    return dataset.isel({dim: slice(None, None, max(1, -(-dataset.sizes[dim] // samples)))})
