"""Selection of variables and samples for pictures; envelopes and close-ups of long histories.

Oscillations are counted by prominent crests. A line with many oscillations would be a solid band,
so its envelope is drawn: the least and largest values in pieces of a few oscillations each.
"""

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
    """Variable ``name`` of a dataset; FlexgearError that lists its variables if it is missing."""
    if name not in dataset:
        names = ", ".join(sorted(str(key) for key in dataset.variables))
        raise FlexgearError(f"cannot draw: the dataset has no variable '{name}' (it has {names})")
    return dataset[name]


def leading_dim(dataset: xr.Dataset) -> str:
    """Name of the sampled dimension: "time" of a transient, "position" of equilibria."""
    return "time" if "time" in dataset.dims else "position"


def planet_count(dataset: xr.Dataset) -> int:
    """Number of planets N in the dataset of one stage."""
    return len(np.unique(variable(dataset, "planet")))


def abscissa(dataset: xr.Dataset, x: str) -> Array:
    """Values of the horizontal axis: "stage_angle" of the carrier (rad) or "time" (s)."""
    if x not in ("stage_angle", "time"):
        raise FlexgearError(f"cannot draw over '{x}': choose stage_angle or time")
    return np.asarray(variable(dataset, x), dtype=float)


def windowed(dataset: xr.Dataset, x: str, window: Window) -> xr.Dataset:
    """Samples with window[0] <= x <= window[1], x as of ``abscissa``; FlexgearError for fewer than
    two."""
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
    """At most ``samples`` evenly spaced samples from the first on; a slice, which is read fast from
    a file."""
    dim = leading_dim(dataset)
    return dataset.isel({dim: slice(None, None, max(1, -(-dataset.sizes[dim] // samples)))})


MAX_OSCILLATIONS = 30  # of a line; more are drawn as envelope
PIECES = 240  # of an envelope
PER_PIECE = 3.0  # oscillations
PROMINENCE, TINY = 0.3, 1e-300  # of a crest, over the range of the history; least absolute value
CLOSE_UP = 4.0  # oscillations
SMOOTH = 60  # points of a smooth oscillation


def oscillations(values: Array) -> int:
    """Number of crests of a history (t,) with a prominence of a share of its range."""
    finite = values[np.isfinite(values)]
    if finite.size < 3:
        return 0
    least = max(PROMINENCE * float(np.ptp(finite)), TINY)
    return len(scipy.signal.find_peaks(finite, prominence=least)[0])


def draw(
    axes: Axes, x: Array, y: Array, color: str, fill: bool = True, beside: int = 0, **style: Any
) -> None:
    """Draw a history as a line or, with too many oscillations, as envelope with a note that bands,
    or pairs of lines, are envelopes. fill: whether the envelope is filled; beside: oscillations of
    the histories in the same picture, which then have the same form."""
    count = max(oscillations(y), beside)
    if count <= MAX_OSCILLATIONS:
        axes.plot(x, y, color=color, **style)
        return
    pieces = int(min(PIECES, count / PER_PIECE))
    starts = np.linspace(0, len(y), pieces, endpoint=False).astype(int)
    low, high = (_of_neighbours(pick, pick.reduceat(y, starts)) for pick in (np.fmin, np.fmax))
    middle = x[np.minimum(starts + len(y) // (2 * pieces), len(y) - 1)]
    middle[0], middle[-1] = x[0], x[-1]
    zorder = style.get("zorder", 2.0)
    if fill:
        axes.fill_between(middle, low, high, color=color, alpha=0.25, lw=0.0, zorder=zorder)
    for edge in (low, high):
        axes.plot(middle, edge, color=color, **{**style, "lw": 0.9})
    axes.set_title("bands: least to largest", loc="right", fontsize=7.5, weight="normal")


def _of_neighbours(pick: np.ufunc, edge: Array) -> Array:
    """Least or largest value of each piece (p,) and its neighbours; NaN stays. Pieces that contain
    no crest of a slow oscillation then do not notch the envelope."""
    neighbours = np.pad(edge, 1, mode="edge")
    return np.where(np.isnan(edge), edge, pick(pick(neighbours[:-2], edge), neighbours[2:]))


def close_up(values: Array) -> slice:
    """Samples of a few oscillations of histories (t, n) around their largest value."""
    count = max(oscillations(series) for series in values.T)
    length = int(np.ceil(CLOSE_UP * len(values) / max(count, CLOSE_UP)))
    middle = int(np.nanargmax(np.nanmax(values, axis=1, initial=-np.inf)))
    first = min(max(middle - length // 2, 0), len(values) - length)
    return slice(first, first + length + 1)


def orbit(places: Array) -> Array:
    """Smooth path (n, 2) through positions (t, 2), interpolated by cubic splines; only the last
    oscillations if there are many."""
    count = float(max(oscillations(series) for series in places.T))
    if count > MAX_OSCILLATIONS:
        places = places[-int(np.ceil(CLOSE_UP * len(places) / count)) - 1 :]
        count = CLOSE_UP
    more = int(np.ceil(SMOOTH * count / len(places)))
    if more <= 1 or len(places) < 4:
        return places
    at = np.arange(len(places))
    return np.asarray(CubicSpline(at, places)(np.linspace(0, len(places) - 1, more * len(places))))
