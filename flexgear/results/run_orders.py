"""Order analysis of transients: histories over the rotation of a member, expected lines, averages.

Time-synchronous averages over turns of a member retain its periodic components. Averages of single
planets are computed from one sensor that the planets pass (McFadden 1991,
J. Sound Vib. 144:163). The signal of planet i is strongest while it is near the sensor. With the
distance d of the planet from the sensor in turns of the carrier and the weight
W(d) = cos²(πd/width) for |d| < width/2, the average is

    x̄_i(ψ) = Σ W(d_i) x / Σ W(d_i)   over all samples in which the planet has the phase ψ ,

ψ = z_r/z_p times the turns of the carrier against the ring. There is an integer number of samples
per gear-mesh cycle, so that each sample belongs to one ψ. Each planet tooth meets each ring tooth
at the sensor within lcm(z_p, z_r)/z_r turns.
"""

import json
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import scipy
import xarray as xr
from scipy import fft

from flexgear.arrays import Array
from flexgear.gears.expected_lines import ALIAS, GEAR_MESH, ExpectedLine, expected_lines
from flexgear.gears.power_flow import power_flow, speed_ratios
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearWarning, InputError
from flexgear.model.names import BodyName
from flexgear.model.read import tuples_of
from flexgear.model.sensor import Sensor
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.orders import (
    DEGREE,
    PASS_BAND,
    SINGLE,
    SOURCE,
    TIME,
    TURN,
    coords_beside,
    envelope,
    highest_order,
    order_spectrum,
    synchronous,
)
from flexgear.results.report.wording import scale, signal_scale, words

# rounding of histories without a mean: forces over rated torque; motions, m or rad, far below atoms
FORCE_ROUNDING, MOTION_ROUNDING = 1e-9, 1e-14
CLOCKS = {TIME: "input_angle", "sensor_time": "sensor_input_angle"}  # angle by axis of time
# warning of aliases: limit frequency over half the sampling rate, largest share of rms above it
ALIAS_LIMIT, ALIAS_SHARE = 0.75, 0.05
RESOLUTION = 2.0  # lines of the transform between neighbours that a Hann window resolves
LAST_SAMPLES, HIGHEST_ORDER = 2**17, 10.5  # of a run's spectrum of forces
MIN_SAMPLES = 4  # of a gear-mesh cycle
MIN_WEIGHT = 1e-6  # over the largest sum of weights, below which a phase was not at the sensor
Value = TypeVar("Value", Array, float)
Lines = Sequence[tuple[ExpectedLine, float]]  # with their orders


def case_of(data: xr.Dataset) -> Case:
    """The case of a result; InputError if the dataset is no result of flexgear."""
    try:
        return Case.model_validate(
            tuples_of(json.loads(data.attrs["parameters"]), SOURCE, "parameters")
        )
    except (KeyError, TypeError, ValueError, RecursionError):
        problem = "is not a result of flexgear, or its case is not one of this version"
        remedy = "name a transient of flexgear, or run its case again"
        raise InputError(SOURCE, "dataset", problem, remedy) from None


def member_turns(data: xr.Dataset, member: str, against: str = "") -> xr.DataArray:
    """Turns (time,) of a member of a transient, absolute or relative to another member.

    They are those of the rigid-body rotation, without elastic twist. member, against:
    "<stage>.<part>", or the part if there is one stage; parts include "planet". Raises InputError
    for an unknown member.
    """
    ratios = speed_ratios(case_of(data))
    factors = _of_member(ratios, member) - (_of_member(ratios, against) if against else 0.0)
    angle = data["input_angle"].transpose(TIME, "input_coordinate").to_numpy().astype(float)
    about = f"{member} against {against}" if against else member
    attrs = {"units": "1", "long_name": f"turns of {about}"}
    return xr.DataArray(angle @ factors / (2 * np.pi), {TIME: data[TIME]}, TIME, attrs=attrs)


def _of_member(values: Mapping[str, Value], member: str) -> Value:
    """The value of a member in values by member; the name of an only stage may be left out."""
    stages = {name.partition(".")[0] for name in values}
    full_name = f"{next(iter(stages))}.{member}" if len(stages) == 1 else member
    name = member if member in values else full_name
    if name not in values:
        raise InputError(SOURCE, member, "is no member", f"name one of {', '.join(values)}")
    return values[name]


def expected_orders(
    case: Case, member: str, against: str = "", *, sensors: Sequence[str] = (), **options: Any
) -> tuple[tuple[ExpectedLine, float], ...]:
    """Expected lines of a spectrum over the rotation of a member, with their orders.

    Lines of gear meshes that cancel between planets are included. sensors: names of the case's
    sensors in the spectrum; if all turn with members of one speed, lines are those at that speed,
    else those on the housing. options: of ``expected_lines``. Independent speeds are in rated
    proportion. Raises InputError for a member without rotation.
    """
    flow = power_flow(case)
    speed = flow.speed | {f"{s.name}.planet": s.planet_speed for s in flow.stages}
    turning = {_speed_of_axes(x, speed) for x in case.sensors if x.name in sensors}
    if len(turning) == 1:
        options["sensor_speed"] = turning.pop()
    turns = _of_member(speed, member) - (_of_member(speed, against) if against else 0.0)
    if turns == 0.0:
        raise InputError(SOURCE, member, "does not rotate", "name a member that rotates")
    lines = expected_lines(case, flow, **options)
    return tuple((x, x.order(turns)) for x in lines)


def _speed_of_axes(sensor: Sensor, speed: Mapping[str, float]) -> float:
    """Speed at which a sensor turns, rad/s: that of its member or planet; 0 for sensors that are
    fixed in space, and for those of speed or torque. speed: of the members and planets.
    """
    if sensor.frame == "fixed" or sensor.measures in ("speed", "torque"):
        return 0.0
    body = BodyName.parse(sensor.on)
    return speed.get(f"{body.stage}.planet" if body.part == "planet" else sensor.on, 0.0)


def gear_mesh_orders(data: xr.Dataset, stage: str) -> xr.DataArray:
    """Amplitudes (order, gear_mesh), N, of the gear-mesh forces of the first planet of a stage.

    They are those at the end of a transient, by order of the gear mesh up to ``HIGHEST_ORDER`` and
    by kind and side.
    """
    last = data.isel(time=slice(-LAST_SAMPLES, None))
    of = next(s for s in case_of(data).stages if s.name == stage)
    pair = of.pinion is not None
    gear, members = (of.pinion, ["pinion"]) if pair else (of.ring, ["carrier", "ring"])
    assert gear is not None
    turns = member_turns(last, *(f"{stage}.{member}" for member in members))
    cycles = (turns * gear.teeth).assign_attrs(long_name="turns of the gear mesh")
    first_planet = np.flatnonzero((last["stage"] == stage) & (last["planet"] == 1))
    forces = last["gear_mesh_force"].isel(gear_mesh=first_planet)
    highest = min(HIGHEST_ORDER, highest_order(cycles))
    spectrum = order_spectrum(synchronous(forces, cycles, highest))
    return spectrum.assign_coords(gear_mesh=[g.side if pair else g.part for g in groups_in(forces)])


def over_time(data: xr.Dataset, name: str) -> xr.Dataset:
    """A history of a transient and ``input_angle``, both over time, for sensors over their time.
    Raises InputError if ``name`` is no history."""
    clocks = [c for c in CLOCKS if name in data and c in data[name].dims]
    if not clocks:
        names = ", ".join(str(n) for n, v in data.data_vars.items() if {*CLOCKS} & {*v.dims})
        remedy = f"name one of {names}" if names else "it has none: take a transient"
        raise InputError(SOURCE, name, "is no history of this file", remedy)
    clock = clocks[0]
    if CLOCKS[clock] not in data:
        problem, remedy = f"is not in the file beside {name}", "save it, too"
        raise InputError(SOURCE, CLOCKS[clock], problem, remedy)
    named = {"input_angle": data[CLOCKS[clock]], name: data[name]}
    if clock != TIME:
        named = {n: v.drop_vars(TIME, errors="ignore").rename({clock: TIME})
                 for n, v in named.items()}  # fmt: skip
    return xr.Dataset(named, attrs=data.attrs)


def history_over_turns(
    data: xr.Dataset,
    name: str,
    member: str = "",
    against: str = "",
    *,
    highest: float | None = None,
    band_hz: tuple[float, float] | None = None,
) -> xr.DataArray:
    """A variable of a transient, or its ``envelope`` in a band, at equal steps of the rotation of a
    member: (turn, …). The default member is the first input."""
    part = over_time(data, name)
    history = part[name] if band_hz is None else envelope(part[name], band_hz)
    turns = member_turns(part, member or first_input(data), against)
    least = _least_rounding(case_of(data), history, history[TIME].to_numpy())
    return synchronous(history, turns, highest).assign_attrs(rounding=least)


def warn_of_aliases(data: xr.Dataset, history: xr.DataArray) -> None:
    """Issue a FlexgearWarning if the spectrum of a history (time, …) probably contains aliases.

    That is so if more than ``ALIAS_SHARE`` of the rms of its variation is above ``ALIAS_LIMIT`` of
    half the sampling rate. Histories of sensors, which are filtered before sampling, and histories
    with unequal steps are not checked.
    """
    if TIME not in data[history.name].dims:
        return
    values, steps = history.transpose(TIME, ...), np.diff(history[TIME].to_numpy())
    if len(steps) < 2 * DEGREE or np.ptp(steps) > 1e-3 * steps.mean():
        return
    x = values.to_numpy().reshape(len(values), -1).astype(float)
    least = _least_rounding(case_of(data), history, history[TIME].to_numpy())
    if np.ptp(x, axis=0).max() <= max(SINGLE * np.abs(x).max(), least):
        return
    window = scipy.signal.get_window("hann", len(x))[:, None]
    power = np.abs(fft.rfft((x - x.mean(axis=0)) * window, axis=0)) ** 2
    share = math.sqrt(power[int(ALIAS_LIMIT * len(power)) :].sum() / power.sum())
    if share > ALIAS_SHARE:
        rate = 0.5 / steps.mean()
        warnings.warn(
            f"{history.name} is not filtered before sampling every {1e6 * steps.mean():.3g} µs, "
            f"and {100 * share:.2g} % of its variation is close to the highest frequency that "
            f"this resolves: lines above {rate:.4g} Hz appear at lower orders. Sample more often "
            "(solver.output_interval_ms) and compare, or use a sensor, which has a filter",
            FlexgearWarning,
            stacklevel=3,
        )


def aliases(
    data: xr.Dataset, name: str, lines: Lines, *member: str
) -> list[tuple[ExpectedLine, float]]:
    """Aliases, with their orders, of gear-mesh harmonics in the spectrum of a variable over the
    turns of a ``member``, or against another. With S samples a turn the order k G, from S/2 to
    3 S/2, appears at |k G − S|. lines: expected lines with their orders, G of gear meshes. None of
    sensors, which are filtered before, and where S changes by more than the width of a line."""
    steps = data.sizes[TIME] - 1
    if TIME not in data[name].dims or speed_change(data) * steps > RESOLUTION:
        return []
    samples = steps / float(np.ptp(member_turns(data, *member).to_numpy()))
    return [
        (replace(line, kind=ALIAS, label=f"alias of gear mesh {k}"), abs(k * order - samples))
        for line, order in lines
        if line.kind == GEAR_MESH and line.harmonic == 1
        for k in range(math.ceil(0.5 * samples / order), int(1.5 * samples / order) + 1)
    ]


def _least_rounding(case: Case, history: xr.DataArray, time: Array) -> float:
    """Rounding amplitude of a history over time, s, without that of its mean."""
    unit = str(history.attrs.get("units", ""))
    if unit.startswith("N"):
        return FORCE_ROUNDING * max(map(abs, power_flow(case).torque.values()), default=0.0)
    return motion_rounding(unit, time)


def motion_rounding(unit: str, time: Array) -> float:
    """Rounding amplitude of a motion or its rates over time, s; 0 for other units. Rates have that
    of the motion at the highest frequency that the samples resolve."""
    motion, _, per = unit.partition("/")
    rates = {"": 0, "s": 1, "s2": 2}
    if motion not in ("m", "rad", "m, rad") or per not in rates:
        return 0.0
    highest = np.pi * (len(time) - 1) / float(np.ptp(time)) if rates[per] else 1.0  # rad/s
    return float(MOTION_ROUNDING * highest ** rates[per])


def column_words(data: xr.DataArray, label: str) -> str:
    """Words of a column's label; names of sensors as they are in the case."""
    return label if data.name == "sensor_signal" else words(label)


def scale_of(data: xr.DataArray, largest: float) -> tuple[str, float]:
    """Printed unit of a history or its amplitudes up to ``largest``, and the factor to it."""
    scaled = signal_scale if data.name == "sensor_signal" else scale
    return scaled([largest], str(data.attrs.get("units", "")))


def rms_of_states(data: xr.Dataset, sensor: str) -> Array:
    """Root mean square (point,) of a sensor about its mean in steady states, without rounding."""
    signal = data["response_sensor"].sel(sensor=sensor, measure="rms")
    highest = float(data["gear_mesh_frequency"].max() * data["gear_mesh_order"].max())
    history = signal.assign_attrs(units=str(signal["sensor_unit"].item()))
    least = _least_rounding(case_of(data), history, np.array([0.0, 0.5 / highest]))
    return np.where(signal > least, signal, 0.0)


def speed_change(data: xr.Dataset) -> float:
    """Relative change of the first input's speed: the highest over the lowest of its means over ten
    equal parts of a transient, minus one."""
    at = np.linspace(0, data.sizes[TIME] - 1, 11).astype(int)
    angle = data["input_angle"].transpose(TIME, "input_coordinate").to_numpy()[at, 0]
    speeds = np.abs(np.diff(angle) / np.diff(data[TIME].to_numpy()[at]))
    return float(speeds.max() / speeds.min() - 1.0) if speeds.min() > 0.0 else 0.0


def first_input(data: xr.Dataset) -> str:
    """Member of the first input of a result's case."""
    return str(case_of(data).inputs[0].member)


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
    about = {"units": "1", "long_name": f"share of a turn of {words(history.attrs['of'])}"}
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
