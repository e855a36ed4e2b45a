"""Time-synchronous averages over turns of a member, which retain its periodic components.

Averages of single planets are computed from one sensor that the planets pass (McFadden 1991,
J. Sound Vib. 144:163). The signal of planet i is strongest while it is near the sensor. With the
distance d of the planet from the sensor in turns of the carrier and the weight
W(d) = cos²(πd/width) for |d| < width/2, the average is

    x̄_i(ψ) = Σ W(d_i) x / Σ W(d_i)   over all samples in which the planet has the phase ψ ,

ψ = z_r/z_p times the turns of the carrier against the ring. There is an integer number of samples
per gear-mesh cycle, so that each sample belongs to one ψ. Each planet tooth meets each ring tooth
at the sensor within lcm(z_p, z_r)/z_r turns.
"""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.model.errors import InputError
from flexgear.results.orders import (
    PASS_BAND,
    SOURCE,
    TURN,
    coords_beside,
    highest_order,
    synchronous,
)
from flexgear.results.run_orders import case_of, member_turns, over_time

MIN_SAMPLES = 4  # of a gear-mesh cycle
MIN_WEIGHT = 1e-6  # over the largest sum of weights, below which a phase was not at the sensor


def synchronous_average(history: xr.DataArray) -> xr.DataArray:
    """Mean (phase, …) of a history (turn, …) over its complete turns, phase from 0 to 1.
    attrs["turns"] is their number. InputError for less than one turn."""
    per_turn = int(history.attrs["per_turn"])
    first = -round(float(history[TURN][0]) * per_turn) % per_turn
    values = history.transpose(TURN, ...).to_numpy()[first:]
    turns = len(values) // per_turn
    if not turns:
        problem = "makes less than one whole turn"
        raise InputError(SOURCE, str(history.attrs["of"]), problem, "simulate longer")
    mean = values[: turns * per_turn].reshape(turns, per_turn, *values.shape[1:]).mean(axis=0)
    return _over_phase(history, mean, ("phase", *history.dims[1:]), turns)


def _over_phase(
    history: xr.DataArray, values: Array, dims: Sequence[object], turns: int
) -> xr.DataArray:
    count = values.shape[list(dims).index("phase")]
    about = {"units": "1", "long_name": f"share of a turn of {history.attrs['of']}"}
    phase = xr.Variable("phase", np.arange(count) / count, about)
    coords = {**coords_beside(history, TURN), "phase": phase}
    attrs = {**history.attrs, "turns": turns, "per_turn": count}
    return xr.DataArray(values, coords, dims, history.name, attrs)


def planet_averages(
    data: xr.Dataset,
    name: str,
    stage: str,
    *,
    sensor_angle: float = 0.0,
    width: float | None = None,
    on_ring: bool = False,
) -> xr.DataArray:
    """Means (planet, phase, …) of a variable of a transient over the rotation of each planet of a
    stage against the carrier.

    sensor_angle: angle of the sensor about the axis from that of planet 1 at carrier angle 0, rad;
    width: turns of the carrier in which the weight of a pass is not zero, by default half of the
    mean planet spacing; on_ring: whether the sensor rotates with the ring. Raises InputError for a
    stage without planets, and for a run in which some teeth do not pass the sensor.
    """
    of = next((s for s in case_of(data).stages if s.name == stage), None)
    if of is None or of.ring is None or of.planet is None:
        raise InputError(SOURCE, stage, "is no planetary stage", "name one of the case")
    part = over_time(data, name)
    turns = member_turns(part, f"{stage}.carrier", f"{stage}.ring")
    passing = turns if on_ring else member_turns(part, f"{stage}.carrier")
    teeth = of.ring.teeth
    cycle = max(MIN_SAMPLES, math.ceil(highest_order(turns) / PASS_BAND / teeth))
    x = synchronous(part[name], turns, per_turn=teeth * cycle)
    number = np.rint(x[TURN].to_numpy() * teeth * cycle).astype(np.int64)
    phase = np.mod(number, of.planet.teeth * cycle)
    carrier = np.interp(x["time"].to_numpy(), turns["time"].to_numpy(), passing.to_numpy())
    width = 0.5 / of.planets if width is None else width
    values = x.to_numpy().reshape(len(phase), -1)
    count = of.planet.teeth * cycle
    offsets = (np.array(of.planet_angles) - sensor_angle) / (2 * np.pi)
    weights = (_weights(carrier + offset, width) for offset in offsets)
    means = np.stack([_weighted(values, phase, of_planet, count) for of_planet in weights])
    if np.isnan(means).any():
        needed = math.lcm(teeth, of.planet.teeth) // teeth
        problem = "do not bring every tooth past the sensor"
        remedy = f"simulate {needed} turns of the carrier against the ring, or use a larger width"
        raise InputError(SOURCE, f"planets of {stage}", problem, remedy)
    dims, total = ("planet", "phase", *x.dims[1:]), int(number[-1] - number[0]) // (teeth * cycle)
    averages = _over_phase(x, means.reshape(of.planets, count, *x.shape[1:]), dims, total)
    averages["phase"].attrs["long_name"] = "share of a planet's turn against the carrier"
    return averages.assign_coords(planet=np.arange(1, of.planets + 1))


def _weights(turns_from_sensor: Array, width: float) -> Array:
    """Weights W (t,) of a planet at distances (t,) from the sensor, in turns."""
    d = np.mod(turns_from_sensor + 0.5, 1.0) - 0.5
    return np.where(np.abs(d) < 0.5 * width, np.cos(np.pi * d / width) ** 2, 0.0)


def _weighted(values: Array, phase: Array, weights: Array, count: int) -> Array:
    """Weighted means (count, n) of values (t, n) by phase (t,); NaN for phases without weight."""
    total = np.bincount(phase, weights, count)
    sums = np.stack([np.bincount(phase, weights * x, count) for x in values.T], axis=1)
    without_weight = total <= MIN_WEIGHT * total.max(initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(without_weight[:, None], np.nan, sums / total[:, None])
