"""Order analysis: histories over the turn of a member in the place of time, and their spectra.

A history x(t) and the turn φ(t) of a member, both sampled, become x(φ) at equal steps of φ: the
spline of degree 7 through the samples over φ, taken at steps as fine as those of the samples where
the member turns slowest, is low-passed and thinned (``scipy.signal.resample_poly``, Kaiser window).
A line at a fixed order then is one line whatever the speed does. Where a period has p samples, the
spline errs by about (p − 1)^−8 of the amplitude; orders of less than ``LEAST`` samples are refused.

Amplitudes are peak values of sines, A(o) = 2 |Σ w x e^(−2πjoφ)| / Σ w, so that a window w takes
nothing off; between the lines of the transform they are padded so finely that a peak of the Hann
window is low by 0.07 % at most. Two lines are told apart from 2/turns on (Hann).
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np
import xarray as xr
from scipy import fft, interpolate, signal

from flexgear.arrays import Array
from flexgear.model.errors import InputError

DEGREE = 7  # of the spline
LEAST = 4.0  # samples of a period of the highest order
PASSED = 0.375  # of the samples a turn: the highest order that the low-pass leaves as it is
STOP_BAND, LENGTH, CUT = 8.0, 20, 0.87  # β of Kaiser's window, half its length over the factor
MOST = 2**25  # samples of one history at fine steps
PADDING = 16  # length of a transform over that of the history
MAP_PADDING = 8
OVERLAP = 4  # blocks of a map that share a sample
SOURCE = "orders"
TURN, ORDER, TIME = "turn", "order", "time"
SINGLE = 1e-7  # of the largest mean: rounding of what is kept in single precision


def highest_order(turns: xr.DataArray) -> float:
    """Highest order that the sampling of turns (time,) allows; InputError for too few samples."""
    if turns.size <= DEGREE:
        raise InputError(
            SOURCE, _of(turns), f"has {turns.size} samples, and a spline takes {DEGREE + 1}",
            "simulate longer",
        )  # fmt: skip
    return 1.0 / (LEAST * float(np.abs(np.diff(turns.to_numpy())).max()))


def synchronous(
    history: xr.DataArray, turns: xr.DataArray, highest: float | None = None, *, per_turn: int = 0
) -> xr.DataArray:
    """A history (time, …) at equal steps of turns (time,): (turn, …), rising.

    highest: highest order that is resolved, all that the sampling allows if left out; per_turn:
    samples of a turn, as many as that needs if 0. Coordinates: turn, time (turn,) s. A member that
    turns backward has attrs["sense"] = −1 and positive turns. InputError where the speed goes
    through zero or a period of the highest order has fewer than four samples.
    """
    phase = turns.to_numpy()
    sense = 1 if phase[-1] > phase[0] else -1
    phase = sense * phase
    steps = np.diff(phase)
    _refuse(turns, steps, highest)
    limit = highest_order(turns) if highest is None else float(highest)
    count = per_turn or max(2, int(np.ceil(limit / PASSED)))
    times = max(1, int(np.ceil(1.0 / (count * steps.min()))))
    first, last = (int(f(x * count)) for f, x in ((np.ceil, phase[0]), (np.floor, phase[-1])))
    if (last - first) * times > MOST:
        share = 100 * steps.min() / steps.max()
        raise InputError(
            SOURCE, f"speed of {_of(turns)}", f"falls to {share:.2g} % of its largest, which takes "
            "too many samples", "take a part of the run, or a lower highest order",
        )  # fmt: skip
    if last - first < 2:
        raise InputError(
            SOURCE, _of(turns), f"turns by {phase[-1] - phase[0]:.2g} only", "simulate longer"
        )
    at = first / count + np.arange((last - first) * times + 1) / (count * times)
    values = history.transpose(TIME, ...)
    if values.isnull().any():
        raise InputError(
            SOURCE,
            str(history.name),
            "has samples without a value",
            "take another, or a part of it",
        )
    flat = values.to_numpy().reshape(len(phase), -1).astype(float)
    columns = [
        _thinned(interpolate.make_interp_spline(phase, x, DEGREE)(at), times) for x in flat.T
    ]
    shape = (last - first + 1, *values.shape[1:])
    grid = np.arange(first, last + 1) / count
    coords: dict[Hashable, Any] = {**coords_beside(values, TIME)}
    coords[TURN] = xr.Variable(TURN, grid, {"units": "1", "long_name": turns.attrs["long_name"]})
    clock = interpolate.make_interp_spline(phase, turns[TIME].to_numpy().astype(float), DEGREE)
    coords[TIME] = xr.Variable(TURN, clock(grid), {"units": "s"})
    about = {"per_turn": count, "highest_order": min(limit, PASSED * count), "sense": sense}
    return xr.DataArray(
        np.stack(columns, axis=1).reshape(shape),
        coords,
        (TURN, *values.dims[1:]),
        history.name,
        {**history.attrs, **about, "of": _of(turns)},
    )


def _of(turns: xr.DataArray) -> str:
    return str(turns.attrs.get("long_name", "turns")).removeprefix("turns of ")


def _refuse(turns: xr.DataArray, steps: Array, highest: float | None) -> None:
    """InputError for speeds through zero, and for a sampling that is too coarse."""
    time = turns[TIME].to_numpy()
    if not steps.any():
        raise InputError(SOURCE, _of(turns), "does not rotate", "name a member that turns")
    if not (steps > 0).all():
        at = float(time[int(np.argmax(steps <= 0))])
        raise InputError(
            SOURCE, f"speed of {_of(turns)}", f"goes through zero at {at:.4g} s",
            "take a part of the run in which it turns one way",
        )  # fmt: skip
    limit = highest_order(turns)
    if highest is not None and not highest > 0:
        raise InputError(SOURCE, f"order {highest:g}", "is not positive", f"at most {limit:.4g}")
    if highest is not None and not highest <= limit * (1 + 1e-9):
        raise InputError(
            SOURCE, f"order {highest:g} of {_of(turns)}",
            f"has fewer than {LEAST:g} samples a period", f"at most {limit:.4g}, or sample more "
            "often (solver.output_interval_ms)",
        )  # fmt: skip


def _thinned(fine: Array, times: int) -> Array:
    """Every ``times``-th sample after a low-pass that keeps ``PASSED`` of the new rate."""
    if times == 1:
        return fine
    taps = signal.firwin(2 * LENGTH * times + 1, CUT / times, window=("kaiser", STOP_BAND))
    return np.asarray(signal.resample_poly(fine, 1, times, window=taps, padtype="line"))


def _window(name: str, count: int) -> Array:
    try:
        window = np.asarray(signal.get_window(name, count))
        if not np.isfinite(window).all():
            raise ValueError(name)
        return window
    except ValueError:
        remedy = "take hann, flattop, boxcar or another of scipy.signal.windows"
        raise InputError(SOURCE, f"window {name}", "is unknown", remedy) from None


def side_lobes(window: str) -> Array:
    """Largest spectral amplitude of a line of amplitude one at a distance of k / ``PADDING`` lines
    or more, by k."""
    count = 2**12
    lobes = np.abs(fft.rfft(_window(window, count), PADDING * count))
    return np.asarray(np.maximum.accumulate(lobes[::-1])[: 2 * PADDING : -1] / lobes[0])


def order_spectrum(history: xr.DataArray, window: str = "hann") -> xr.DataArray:
    """Amplitudes (order, …) of a history (turn, …) without its mean; in its unit."""
    return _spectra(history, [0], history.sizes[TURN], window, PADDING).isel(block=0)


def order_map(
    history: xr.DataArray, block_turns: float | None = None, window: str = "hann"
) -> xr.DataArray:
    """Amplitudes (block, order, …) of blocks of a history (turn, …), a quarter of a block apart.

    block_turns: length of a block, a thirtieth of the history if left out, but at least two periods
    of order 1. Coordinates: speed (block,) rad/s, mean of the block; time (block,) s, its middle.
    """
    per_turn, total = int(history.attrs["per_turn"]), history.sizes[TURN]
    wished = max(2.0, total / per_turn / 30) if block_turns is None else block_turns
    size = round(wished * per_turn) if math.isfinite(wished) else 0
    if not 16 <= size <= total:
        raise InputError(
            SOURCE, f"blocks of {wished:g} turns", f"do not fit {total / per_turn:.4g} turns",
            "take shorter ones, or simulate longer",
        )  # fmt: skip
    starts = range(0, total - size + 1, max(1, size // OVERLAP))
    spectra = _spectra(history, starts, size, window, MAP_PADDING)
    time = history[TIME].to_numpy()
    begin, end = time[starts], time[np.array(starts) + size - 1]
    rate = 2 * np.pi * history.attrs["sense"] * (size - 1) / per_turn / (end - begin)
    return spectra.assign_coords(
        speed=("block", rate, {"units": "rad/s", "long_name": f"speed of {spectra.attrs['of']}"}),
        time=("block", 0.5 * (begin + end), {"units": "s"}),
    )


def _spectra(
    history: xr.DataArray, starts: Sequence[int], size: int, window: str, padding: int
) -> xr.DataArray:
    """Amplitudes (block, order, …) of blocks of ``size`` samples."""
    per_turn, values = int(history.attrs["per_turn"]), history.transpose(..., TURN)
    w, x = _window(window, size), values.to_numpy()
    count = fft.next_fast_len(padding * size, real=True)
    orders = fft.rfftfreq(count, 1.0 / per_turn)
    orders = orders[: np.searchsorted(orders, history.attrs["highest_order"], side="right")]
    out = np.empty((len(starts), *x.shape[:-1], len(orders)))
    for k, *at in np.ndindex(out.shape[:-1]):
        block = x[*at, starts[k] : starts[k] + size]
        mean = float(w @ block) / w.sum()
        spectrum = fft.rfft((block - mean) * w, count)[: len(orders)]
        out[k, *at] = 2.0 / w.sum() * np.abs(spectrum)
    dims = ("block", *values.dims[:-1], ORDER)
    labelled = _spectrum_of(history, out, dims, orders, window, size / per_turn)
    return labelled.transpose("block", ORDER, ...)


def amplitudes_at(
    history: xr.DataArray, orders: Sequence[float], window: str = "hann"
) -> xr.DataArray:
    """Amplitudes (order, …) of a history (turn, …) exactly at some orders."""
    values, turn = history.transpose(..., TURN), history[TURN].to_numpy()
    w, x = _window(window, len(turn)), values.to_numpy()
    x = x - (x @ w / w.sum())[..., None]
    waves = (np.exp(-2j * np.pi * order * turn) * w for order in orders)
    amplitude = np.stack([2.0 / w.sum() * np.abs(x @ wave) for wave in waves], axis=-1)
    at, turns = np.asarray(orders, dtype=float), len(turn) / history.attrs["per_turn"]
    dims = (*values.dims[:-1], ORDER)
    return _spectrum_of(history, amplitude, dims, at, window, turns).transpose(ORDER, ...)


def _spectrum_of(
    history: xr.DataArray,
    values: Array,
    dims: Sequence[Hashable],
    orders: Array,
    window: str,
    turns: float,
) -> xr.DataArray:
    """Labelled amplitudes of a history; attrs["rounding"]: up to which they are rounding."""
    of, name = str(history.attrs["of"]), history.attrs.get("long_name", history.name)
    about = {"units": "1", "long_name": f"order of {of}"}
    mean = float(np.abs(history.mean(TURN)).max())
    attrs = {
        "units": history.attrs.get("units", ""), "long_name": f"amplitude of {name}",
        "window": window, "of": of, "turns": turns, "largest_mean": mean,
        "rounding": max(SINGLE * mean, history.attrs.get("rounding", 0.0)),
    }  # fmt: skip
    coords = {**coords_beside(history, TURN), ORDER: xr.Variable(ORDER, orders, about)}
    return xr.DataArray(values, coords, dims, history.name, attrs)


def coords_beside(history: xr.DataArray, dim: str) -> dict[Hashable, xr.DataArray]:
    """Coordinates of the other axes."""
    return {name: values for name, values in history.coords.items() if dim not in values.dims}


def envelope(history: xr.DataArray, band: tuple[float, float]) -> xr.DataArray:
    """|x_b + j H x_b| of a history over time or turns; x_b: its part in a band of frequencies, Hz,
    or of orders (Butterworth, 4th order, forward and backward), H: Hilbert's transform. InputError
    for a band above the sampling."""
    axis = TURN if TURN in history.dims else TIME
    rate = (history.sizes[axis] - 1) / float(history[axis][-1] - history[axis][0])
    low, high = band
    if not 0 < low < high < 0.5 * rate:
        unit = "" if axis == TURN else " Hz"
        raise InputError(
            SOURCE, f"band {low:g} to {high:g}{unit}", "is not within what the samples resolve",
            f"rising, above 0 and below {0.5 * rate:.4g}{unit}",
        )  # fmt: skip
    steps = np.diff(history[axis].to_numpy())
    if np.ptp(steps) > 1e-3 * steps.mean():
        raise InputError(
            SOURCE, "envelope", "needs samples at equal steps of time",
            "take a part of the run without torque steps",
        )  # fmt: skip
    values = history.transpose(..., axis)
    sections = signal.butter(4, band, "bandpass", fs=rate, output="sos")
    banded = signal.sosfiltfilt(sections, values.to_numpy().astype(float), axis=-1)
    return values.copy(data=np.abs(signal.hilbert(banded, axis=-1))).transpose(*history.dims)
