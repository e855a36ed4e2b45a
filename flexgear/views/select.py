"""Taking what a picture needs out of labelled datasets; envelopes and close-ups of long histories.

An oscillation is a crest that stands out. Lines with many of them would be one solid band; their
envelope is the least and largest value of pieces that hold some each.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy
import xarray as xr
from matplotlib.axes import Axes
from scipy.interpolate import CubicSpline

from flexgear.arrays import Array
from flexgear.model.errors import FlexgearError

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


def abscissa(dataset: xr.Dataset, x: str) -> Array:
    """Values of the horizontal axis: "stage_angle" of the carrier (rad) or "time" (s)."""
    if x not in ("stage_angle", "time"):
        raise FlexgearError(f"cannot draw over '{x}': choose stage_angle or time")
    return np.asarray(variable(dataset, x), dtype=float)


def windowed(dataset: xr.Dataset, x: str, window: Window) -> xr.Dataset:
    """Samples with window[0] <= x <= window[1], x as ``abscissa`` has it."""
    values = abscissa(dataset, x)
    keep = np.flatnonzero((values >= window[0]) & (values <= window[1]))
    if keep.size < 2:
        raise FlexgearError(
            f"nothing to draw between {window[0]:g} and {window[1]:g}: {x} runs from "
            f"{np.nanmin(values):g} to {np.nanmax(values):g}"
        )
    return dataset.isel({leading_dim(dataset): keep})


def within_window(runs: Runs, x: str, window: Window) -> Runs:
    """The window of every run."""
    return {name: windowed(data, x, window) for name, data in runs.items()}


def thinned(dataset: xr.Dataset, samples: int) -> xr.Dataset:
    """At most ``samples`` samples, evenly spread from the first on (for maps and animations): a
    slice, which is read at once where the dataset lies in a file."""
    dim = leading_dim(dataset)
    return dataset.isel({dim: slice(None, None, max(1, -(-dataset.sizes[dim] // samples)))})


MOST = 30  # oscillations that are drawn one by one
PIECES = 240  # of an envelope
LEAST = 3.0  # oscillations of a piece
CREST, TINY = 0.3, 1e-300  # of the range of a history, by which a crest stands out at least
SHOWN = 4.0  # oscillations of a close-up
SMOOTH = 60  # points of an oscillation that looks round


def oscillations(values: Array) -> int:
    """Number of crests of a history (t,) that exceed a share of its range."""
    finite = values[np.isfinite(values)]
    if finite.size < 3:
        return 0
    least = max(CREST * float(np.ptp(finite)), TINY)
    return len(scipy.signal.find_peaks(finite, prominence=least)[0])


def is_dense(values: Array) -> bool:
    """Whether histories (t,) or (t, n) have more oscillations than a picture shows."""
    return any(oscillations(series) > MOST for series in values.reshape(len(values), -1).T)


def draw(axes: Axes, x: Array, y: Array, color: str, fill: bool = True, **style: Any) -> bool:
    """Draw a history as a line, or as its envelope, filled or not; returns whether it is that."""
    count = oscillations(y)
    if count <= MOST:
        axes.plot(x, y, color=color, **style)
        return False
    pieces = int(min(PIECES, count / LEAST))
    starts = np.linspace(0, len(y), pieces, endpoint=False).astype(int)
    low, high = (_of_neighbours(pick, pick.reduceat(y, starts)) for pick in (np.fmin, np.fmax))
    middle = x[np.minimum(starts + len(y) // (2 * pieces), len(y) - 1)]
    middle[0], middle[-1] = x[0], x[-1]
    zorder = style.get("zorder", 2.0)
    if fill:
        axes.fill_between(middle, low, high, color=color, alpha=0.25, lw=0.0, zorder=zorder)
    for edge in (low, high):
        axes.plot(middle, edge, color=color, **{**style, "lw": 0.9})
    return True


def _of_neighbours(pick: np.ufunc, edge: Array) -> Array:
    """Least or largest of each piece (p,) and those beside it, so that a piece that misses the turn
    of a slow cycle makes no tooth in the edge; NaN stays."""
    neighbours = np.pad(edge, 1, mode="edge")
    return np.where(np.isnan(edge), edge, pick(pick(neighbours[:-2], edge), neighbours[2:]))


def say_envelope(axes: Axes) -> None:
    """Note on a panel that bands, or pairs of lines, are envelopes."""
    axes.set_title("bands: least to largest", loc="right", fontsize=7.5, weight="normal")


def close_up(values: Array) -> slice:
    """Some oscillations of histories (t, n) about their largest value."""
    count = max(oscillations(series) for series in values.T)
    length = int(np.ceil(SHOWN * len(values) / max(count, SHOWN)))
    middle = int(np.nanargmax(np.nanmax(values, axis=1, initial=-np.inf)))
    first = min(max(middle - length // 2, 0), len(values) - length)
    return slice(first, first + length + 1)


def orbit(places: Array) -> Array:
    """The path (n, 2) through places (t, 2), the last oscillations if there are many, with enough
    points between the samples that it looks as smooth as the motion is."""
    count = float(max(oscillations(series) for series in places.T))
    if count > MOST:
        places = places[-int(np.ceil(SHOWN * len(places) / count)) - 1 :]
        count = SHOWN
    more = int(np.ceil(SMOOTH * count / len(places)))
    if more <= 1 or len(places) < 4:
        return places
    at = np.arange(len(places))
    return np.asarray(CubicSpline(at, places)(np.linspace(0, len(places) - 1, more * len(places))))
