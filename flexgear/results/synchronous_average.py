"""Means over many turns of a member: what repeats with it is left, tooth by tooth.

Of the planets one by one, from one sensor past which they go (McFadden 1991, J. Sound Vib.
144:163): while planet i is near the sensor, the sensor hears it more than the others. With d the
distance of the planet from the sensor in turns of the carrier and W(d) = cos²(πd/width) there,

    x̄_i(ψ) = Σ W(d_i) x / Σ W(d_i)   over all samples in which the planet has the phase ψ ,

ψ = z_r/z_p times the turns of the carrier against the ring. Samples stand at whole parts of a
gear-mesh cycle, so that each belongs to one ψ. Every tooth is at the sensor with every ring tooth
after lcm(z_p, z_r)/z_r turns.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from flexgear.arrays import Array
from flexgear.model.errors import InputError
from flexgear.results.orders import PASSED, SOURCE, TURN, coords_beside, highest_order, synchronous
from flexgear.results.run_orders import case_of, member_turns, over_time

FEWEST = 4  # samples of a gear-mesh cycle
BARE = 1e-6  # of the largest sum of weights: a phase with less was not at the sensor


def synchronous_average(history: xr.DataArray) -> xr.DataArray:
    """Mean (phase, …) of a history (turn, …) over its whole turns, phase from 0 to 1; how many they
    are is attrs["turns"]. What does not repeat with the turn falls with their number."""
    per_turn = int(history.attrs["per_turn"])
    first = -round(float(history[TURN][0]) * per_turn) % per_turn
    values = history.transpose(TURN, ...).to_numpy()[first:]
    whole = len(values) // per_turn
    if not whole:
        raise InputError(
            SOURCE, str(history.attrs["of"]), "makes less than one whole turn", "simulate longer"
        )
    mean = values[: whole * per_turn].reshape(whole, per_turn, *values.shape[1:]).mean(axis=0)
    return _over_phase(history, mean, ("phase", *history.dims[1:]), whole)


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
    """Means (planet, phase, …) of the variable of a transient over the turn of every planet of a
    stage against its carrier.

    sensor_angle: of the sensor about the axis, rad, from
    where planet 1 is at the angle 0; width: turns of the carrier around a pass that count, half of
    the mean spacing of the planets if left out; on_ring: whether the sensor turns with the ring.
    InputError for a stage that has no planets or a run that does not bring every tooth past.
    """
    of = next((s for s in case_of(data).stages if s.name == stage), None)
    if of is None or of.ring is None or of.planet is None:
        raise InputError(SOURCE, stage, "is no planetary stage", "name one of the case")
    part = over_time(data, name)
    turns = member_turns(part, f"{stage}.carrier", f"{stage}.ring")
    passing = turns if on_ring else member_turns(part, f"{stage}.carrier")
    teeth = of.ring.teeth
    cycle = max(FEWEST, math.ceil(highest_order(turns) / PASSED / teeth))
    x = synchronous(part[name], turns, per_turn=teeth * cycle)
    number = np.rint(x[TURN].to_numpy() * teeth * cycle).astype(np.int64)
    phase = np.mod(number, of.planet.teeth * cycle)
    place = np.interp(x["time"].to_numpy(), turns["time"].to_numpy(), passing.to_numpy())
    reach = 0.5 / of.planets if width is None else width
    values = x.to_numpy().reshape(len(phase), -1)
    count = of.planet.teeth * cycle
    means = np.stack(
        [
            _weighted(
                values, phase, _weights(place + (angle - sensor_angle) / (2 * np.pi), reach), count
            )
            for angle in of.planet_angles
        ]
    )
    if np.isnan(means).any():
        needed = math.lcm(teeth, of.planet.teeth) // teeth
        raise InputError(
            SOURCE, f"planets of {stage}", "do not bring every tooth past the sensor",
            f"simulate {needed} turns of the carrier against the ring, or take a larger width",
        )  # fmt: skip
    dims, whole = ("planet", "phase", *x.dims[1:]), int(number[-1] - number[0]) // (teeth * cycle)
    out = _over_phase(x, means.reshape(of.planets, count, *x.shape[1:]), dims, whole)
    out["phase"].attrs["long_name"] = "share of a planet's turn against the carrier"
    return out.assign_coords(planet=np.arange(1, of.planets + 1))


def _weights(turns_from_sensor: Array, width: float) -> Array:
    """W (t,) of a planet at distances (t,) from the sensor, in turns."""
    d = np.mod(turns_from_sensor + 0.5, 1.0) - 0.5
    return np.where(np.abs(d) < 0.5 * width, np.cos(np.pi * d / width) ** 2, 0.0)


def _weighted(values: Array, phase: Array, weights: Array, count: int) -> Array:
    """Weighted means (count, n) of values (t, n) by phase (t,); NaN where nothing weighs."""
    total = np.bincount(phase, weights, count)
    sums = np.stack([np.bincount(phase, weights * x, count) for x in values.T], axis=1)
    is_bare = total <= BARE * total.max(initial=0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(is_bare[:, None], np.nan, sums / total[:, None])
