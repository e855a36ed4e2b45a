"""Order analysis: histories over the rotation of a member instead of time, and their spectra.

From samples of a history x(t) and the rotation φ(t) of a member in turns, x(φ) at equal steps of φ
is computed: a spline of degree 7 over φ is evaluated at the smallest step of the samples, low-pass
filtered and decimated (``scipy.signal.resample_poly``, Kaiser window). A component of fixed order
then is a single line at any speed. For p samples per period the relative error of the spline is
about (p − 1)^−8; orders with fewer than ``MIN_SAMPLES`` samples per period are refused.

Amplitudes are peak values of sines, A(o) = 2 |Σ w x e^(−2πjoφ)| / Σ w, corrected for the window w.
By zero padding, a peak of the Hann window is at most 0.07 % too low. Lines are resolved if their
orders differ by 2/turns or more (Hann).

A slow trend, as of forces in a run-up, has a skirt of amplitudes from order zero on, which are no
lines. Coordinate ``without_trend`` has the amplitudes without the polynomial of degree
``TREND_DEGREE`` that fits the history with the weights w. Of a sine of two periods, Hann, at least
a third is left, of one of three periods 0.993.
"""

import math
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np
import scipy
import xarray as xr
from scipy import fft, interpolate

from flexgear.arrays import Array
from flexgear.model.errors import InputError, echo

DEGREE = 7  # of the spline
MIN_SAMPLES = 4.0  # of a period of the highest order
PASS_BAND = 0.375  # highest order that the low-pass filter does not attenuate, over samples a turn
# β of the Kaiser window, half of its length and its cut-off over the decimation factor
KAISER_BETA, HALF_LENGTH, CUT_OFF = 8.0, 20, 0.87
MAX_SAMPLES = 2**25  # of one history at the smallest step
PADDING = 16  # length of a transform over that of the history
MAP_PADDING = 8
OVERLAP = 4  # blocks of a map that share a sample
SOURCE = "orders"
TURN, ORDER, TIME = "turn", "order", "time"
SINGLE = 1e-7  # of the largest mean, rounding of single precision
TREND_DEGREE = 3  # see above


def highest_order(turns: xr.DataArray) -> float:
    """Highest order that the sampling of turns (time,) allows; InputError for too few samples."""
    if turns.size <= DEGREE:
        problem = f"has {turns.size} samples, and a spline needs {DEGREE + 1}"
        raise InputError(SOURCE, _of(turns), problem, "simulate longer")
    return 1.0 / (MIN_SAMPLES * float(np.abs(np.diff(turns.to_numpy())).max()))


def synchronous(
    history: xr.DataArray, turns: xr.DataArray, highest: float | None = None, *, per_turn: int = 0
) -> xr.DataArray:
    """A history (time, …) at equal steps of turns (time,): (turn, …) with increasing turns.

    highest: highest order to be resolved, by default the highest that the sampling allows;
    per_turn: samples per turn, 0 for the number that this order needs. Coordinates: turn, time
    (turn,) s. For backward rotation attrs["sense"] is −1 and turns are positive. Raises InputError
    if the speed passes zero or a period of the highest order has fewer than four samples.
    """
    phase = turns.to_numpy()
    sense = 1 if phase[-1] > phase[0] else -1
    phase = sense * phase
    steps = np.diff(phase)
    _refuse(turns, steps, highest)
    limit = highest_order(turns) if highest is None else float(highest)
    count = per_turn or max(2, int(np.ceil(limit / PASS_BAND)))
    times = max(1, int(np.ceil(1.0 / (count * steps.min()))))
    first, last = (int(f(x * count)) for f, x in ((np.ceil, phase[0]), (np.floor, phase[-1])))
    if (last - first) * times > MAX_SAMPLES:
        share = 100 * steps.min() / steps.max()
        problem = f"falls to {share:.2g} % of its largest, which needs too many samples"
        remedy = "use a part of the run, or a lower highest order"
        raise InputError(SOURCE, f"speed of {_of(turns)}", problem, remedy)
    if last - first < 2:
        problem = f"rotates by only {phase[-1] - phase[0]:.2g} turns"
        raise InputError(SOURCE, _of(turns), problem, "simulate longer")
    at = first / count + np.arange((last - first) * times + 1) / (count * times)
    values = history.transpose(TIME, ...)
    if values.isnull().any():
        problem = "has samples without a value"
        raise InputError(SOURCE, str(history.name), problem, "use another, or a part of it")
    flat = values.to_numpy().reshape(len(phase), -1).astype(float)
    splines = (interpolate.make_interp_spline(phase, x, DEGREE) for x in flat.T)
    columns = [_decimated(spline(at), times) for spline in splines]
    shape = (last - first + 1, *values.shape[1:])
    grid = np.arange(first, last + 1) / count
    coords: dict[Hashable, Any] = {**coords_beside(values, TIME)}
    coords[TURN] = xr.Variable(TURN, grid, {"units": "1", "long_name": turns.attrs["long_name"]})
    clock = interpolate.make_interp_spline(phase, turns[TIME].to_numpy().astype(float), DEGREE)
    coords[TIME] = xr.Variable(TURN, clock(grid), {"units": "s"})
    about = {"per_turn": count, "highest_order": min(limit, PASS_BAND * count), "sense": sense}
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
    """Raise InputError if the speed passes zero, and for a sampling that is too coarse."""
    time = turns[TIME].to_numpy()
    if not steps.any():
        raise InputError(SOURCE, _of(turns), "does not rotate", "name a member that rotates")
    if not (steps > 0).all():
        first = steps[np.flatnonzero(steps)[0]]
        at = float(time[int(np.argmax(steps * np.sign(first) <= 0))])
        remedy = "use a part of the run with one sense of rotation"
        raise InputError(SOURCE, f"speed of {_of(turns)}", f"passes zero at {at:.4g} s", remedy)
    limit = highest_order(turns)
    if highest is not None and not 0.0 < highest <= limit * (1 + 1e-9):
        problem, remedy = "is not positive", f"at most {limit:.4g}"
        if highest > 0:
            problem = f"has fewer than {MIN_SAMPLES:g} samples a period"
            remedy += ", or sample more often (solver.output_interval_ms)"
        raise InputError("--highest", f"order {highest:g} of {_of(turns)}", problem, remedy)


def _decimated(fine: Array, times: int) -> Array:
    """Every ``times``-th sample after a low-pass filter keeping ``PASS_BAND`` of the new rate."""
    if times == 1:
        return fine
    taps = scipy.signal.firwin(
        2 * HALF_LENGTH * times + 1, CUT_OFF / times, window=("kaiser", KAISER_BETA)
    )
    return np.asarray(scipy.signal.resample_poly(fine, 1, times, window=taps, padtype="line"))


def _window(name: str, count: int) -> Array:
    try:
        window = np.asarray(scipy.signal.get_window(name, count))
        if not np.isfinite(window).all():
            raise ValueError(name)
        return window
    except ValueError:
        remedy = "use hann, flattop, boxcar or another of scipy.signal.windows"
        raise InputError("--window", echo(name), "is unknown", remedy) from None


def side_lobes(window: str) -> Array:
    """Side lobes of a window: largest amplitude in the spectrum of a line of amplitude one at a
    distance of at least k / ``PADDING`` lines, by k."""
    count = 2**12
    lobes = np.abs(fft.rfft(_window(window, count), PADDING * count))
    return np.asarray(np.maximum.accumulate(lobes[::-1])[: 2 * PADDING : -1] / lobes[0])


def order_spectrum(history: xr.DataArray, window: str = "hann") -> xr.DataArray:
    """Amplitudes (order, …) of a history (turn, …) without its mean, in the unit of the history."""
    return _spectra(history, [0], history.sizes[TURN], window, PADDING).isel(block=0)


def order_map(
    history: xr.DataArray, block_turns: float | None = None, window: str = "hann"
) -> xr.DataArray:
    """Amplitudes (block, order, …) of blocks of a history (turn, …) at steps of a quarter block.

    block_turns: length of a block, by default a thirtieth of the history, at least two turns.
    Coordinates: mean speed (block,) rad/s; time of the middle (block,) s.
    """
    per_turn, total = int(history.attrs["per_turn"]), history.sizes[TURN]
    turns = max(2.0, total / per_turn / 30) if block_turns is None else block_turns
    size = round(turns * per_turn) if math.isfinite(turns) else 0
    if not 16 <= size <= total:
        problem = f"do not fit {total / per_turn:.4g} turns"
        remedy = "use shorter blocks, or simulate longer"
        raise InputError("--map", f"blocks of {turns:g} turns", problem, remedy)
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
    amplitudes = np.empty((2, len(starts), *x.shape[:-1], len(orders)))
    polynomials = np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, size), TREND_DEGREE)
    for k, *at in np.ndindex(amplitudes.shape[1:-1]):
        block = x[*at, starts[k] : starts[k] + size]
        for out, p in zip(amplitudes, (polynomials[:, :1], polynomials), strict=True):
            rest = block - p @ np.linalg.solve((p.T * w) @ p, p.T @ (w * block))
            spectrum = fft.rfft(rest * w, count)[: len(orders)]
            out[k, *at] = 2.0 / w.sum() * np.abs(spectrum)
    dims = ("block", *values.dims[:-1], ORDER)
    labelled = _labelled(history, amplitudes[0], dims, orders, window, size / per_turn)
    about = {"units": labelled.attrs["units"], "long_name": "amplitude without a slow trend"}
    without_trend = (dims, amplitudes[1], about)
    return labelled.assign_coords(without_trend=without_trend).transpose("block", ORDER, ...)


def amplitudes_at(
    history: xr.DataArray, orders: Sequence[float], window: str = "hann"
) -> xr.DataArray:
    """Amplitudes (order, …) of a history (turn, …) at given orders."""
    values, turn = history.transpose(..., TURN), history[TURN].to_numpy()
    w, x = _window(window, len(turn)), values.to_numpy()
    x = x - (x @ w / w.sum())[..., None]
    waves = (np.exp(-2j * np.pi * order * turn) * w for order in orders)
    amplitude = np.stack([2.0 / w.sum() * np.abs(x @ wave) for wave in waves], axis=-1)
    at, turns = np.asarray(orders, dtype=float), len(turn) / history.attrs["per_turn"]
    dims = (*values.dims[:-1], ORDER)
    return _labelled(history, amplitude, dims, at, window, turns).transpose(ORDER, ...)


def _labelled(
    history: xr.DataArray,
    values: Array,
    dims: Sequence[Hashable],
    orders: Array,
    window: str,
    turns: float,
) -> xr.DataArray:
    """Labelled amplitudes of a history; attrs["rounding"]: largest amplitude due to rounding."""
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
    """Coordinates of a history that do not depend on the axis ``dim``."""
    return {name: values for name, values in history.coords.items() if dim not in values.dims}


def envelope(history: xr.DataArray, band: tuple[float, float]) -> xr.DataArray:
    """Envelope |x_b + j H x_b| of a history over time or turns.

    x_b is the history filtered to a band of frequencies, Hz, or orders (Butterworth, 4th order,
    forward and backward), H the Hilbert transform. Raises InputError for a band above the sampling.
    """
    axis = TURN if TURN in history.dims else TIME
    rate = (history.sizes[axis] - 1) / float(history[axis][-1] - history[axis][0])
    low, high = band
    if not 0 < low < high < 0.5 * rate:
        unit = "" if axis == TURN else " Hz"
        problem = "is not within what the samples resolve"
        remedy = f"low before high, above 0 and below {0.5 * rate:.4g}{unit}"
        raise InputError("--envelope-hz", f"band {low:g} to {high:g}{unit}", problem, remedy)
    steps = np.diff(history[axis].to_numpy())
    if np.ptp(steps) > 1e-3 * steps.mean():
        problem = "needs samples at equal steps of time"
        raise InputError(SOURCE, "envelope", problem, "use a part of the run without torque steps")
    values = history.transpose(..., axis)
    sections = scipy.signal.butter(4, band, "bandpass", fs=rate, output="sos")
    banded = scipy.signal.sosfiltfilt(sections, values.to_numpy().astype(float), axis=-1)
    return values.copy(data=np.abs(scipy.signal.hilbert(banded, axis=-1))).transpose(*history.dims)
