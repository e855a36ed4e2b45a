"""Orders of a run: its histories over the turn of a member, and the lines expected there."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from scipy import fft, signal

from flexgear.arrays import Array
from flexgear.gears.expected_lines import ExpectedLine, expected_lines
from flexgear.gears.power_flow import power_flow, speed_ratios
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearWarning, InputError
from flexgear.results.labelled_dataset import groups_in
from flexgear.results.orders import (
    DEGREE,
    SINGLE,
    SOURCE,
    TIME,
    envelope,
    highest_order,
    order_spectrum,
    synchronous,
)
from flexgear.results.run_folder import tuples_of

# of a rated torque, and m or rad: rounding of forces and motions without a mean
OF_TORQUE, OF_MOTION = 1e-9, 1e-15
CLOCKS = {TIME: "input_angle", "sensor_time": "sensor_input_angle"}  # and the angles they sample
UPPER, FOLDS = 0.75, 0.05  # of half the sampling rate; share of a history above: then it aliases
LAST, HIGHEST = 2**17, 10.5  # samples, and orders, of a run's spectrum of forces
Value = TypeVar("Value", Array, float)


def case_of(data: xr.Dataset) -> Case:
    """The case whose result a dataset is. InputError where it is no result of flexgear."""
    try:
        return Case.model_validate(tuples_of(json.loads(data.attrs["parameters"])))
    except (KeyError, TypeError, ValueError, RecursionError):
        problem = "is none of flexgear, or lost the case among its attributes"
        raise InputError(SOURCE, "dataset", problem, "name a transient of flexgear") from None


def member_turns(data: xr.Dataset, member: str, against: str = "") -> xr.DataArray:
    """Turns (time,) of a member of a transient, in space or against another one, from the rigid
    rotations of the train: elastic twist of the member is not in it.

    member, against: "<stage>.<part>", the part alone where there is one stage; part "planet", too.
    InputError for an unknown one.
    """
    ratios = speed_ratios(case_of(data))
    factors = _of_member(ratios, member) - (_of_member(ratios, against) if against else 0.0)
    angle = data["input_angle"].transpose(TIME, "input_coordinate").to_numpy().astype(float)
    about = f"{member} against {against}" if against else member
    attrs = {"units": "1", "long_name": f"turns of {about}"}
    return xr.DataArray(angle @ factors / (2 * np.pi), {TIME: data[TIME]}, TIME, attrs=attrs)


def _of_member(values: Mapping[str, Value], member: str) -> Value:
    """The value of a member from values by member; where there is one stage, its name may be left
    out."""
    stages = {name.partition(".")[0] for name in values}
    alone = f"{next(iter(stages))}.{member}" if len(stages) == 1 else member
    name = member if member in values else alone
    if name not in values:
        raise InputError(SOURCE, member, "is no member", f"name one of {', '.join(values)}")
    return values[name]


def expected_orders(
    case: Case, member: str, against: str = "", **options: Any
) -> tuple[tuple[ExpectedLine, float], ...]:
    """Expected lines of a spectrum over the rotation of a member, with their orders; those of gear
    meshes that planets cancel on the housing are included. options: of ``expected_lines``. Several
    independent speeds have their rated ratio. InputError for a member without rotation."""
    flow = power_flow(case)
    speed = flow.speed | {f"{s.name}.planet": s.planet_speed for s in flow.stages}
    turns = _of_member(speed, member) - (_of_member(speed, against) if against else 0.0)
    if turns == 0.0:
        raise InputError(SOURCE, member, "does not rotate", "name a member that turns")
    lines = expected_lines(case, flow, **options)
    return tuple((x, x.order(turns)) for x in lines)


def gear_mesh_orders(data: xr.Dataset, stage: str) -> xr.DataArray:
    """Amplitudes (order, gear_mesh) N of the gear-mesh forces of a stage's first planet at the end
    of a transient, over gear-mesh cycles; gear_mesh by kind and side; order ``HIGHEST`` at most."""
    last = data.isel(time=slice(-LAST, None))
    of = next(s for s in case_of(data).stages if s.name == stage)
    if of.pinion is not None:
        turns, teeth = member_turns(last, f"{stage}.pinion"), of.pinion.teeth
    else:
        assert of.ring is not None
        turns, teeth = member_turns(last, f"{stage}.carrier", f"{stage}.ring"), of.ring.teeth
    cycles = (turns * teeth).assign_attrs(long_name="turns of the gear mesh")
    first_planet = np.flatnonzero((last["stage"] == stage) & (last["planet"] == 1))
    forces = last["gear_mesh_force"].isel(gear_mesh=first_planet)
    highest = min(HIGHEST, highest_order(cycles))
    spectrum = order_spectrum(synchronous(forces, cycles, highest))
    pair = of.pinion is not None
    return spectrum.assign_coords(gear_mesh=[g.side if pair else g.part for g in groups_in(forces)])


def over_time(data: xr.Dataset, name: str) -> xr.Dataset:
    """A history of a transient and ``input_angle``, both over time; signals of sensors over their
    own time. InputError for a name that is no history."""
    clocks = [c for c in CLOCKS if name in data and c in data[name].dims]
    if not clocks:
        names = ", ".join(str(n) for n, v in data.data_vars.items() if {*CLOCKS} & {*v.dims})
        raise InputError(SOURCE, name, "is no history of this file", f"name one of {names or '–'}")
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
    """The variable of a transient at equal steps of the turn of a member, the first input if none
    is named: (turn, …); with a band its envelope (``envelope``)."""
    part = over_time(data, name)
    history = part[name] if band_hz is None else envelope(part[name], band_hz)
    turns = member_turns(part, member or first_input(data), against)
    least = _least_rounding(case_of(data), str(history.attrs.get("units", "")))
    return synchronous(history, turns, highest).assign_attrs(rounding=least)


def warn_of_aliases(data: xr.Dataset, history: xr.DataArray) -> None:
    """FlexgearWarning where more than ``FOLDS`` of what varies in a history (time, …) of a
    transient, or in columns of it, by its root mean square, lies in the upper quarter of what its
    samples resolve: more lies beyond, then, and appears at lower frequencies. Histories of sensors,
    which are filtered before they are sampled, and of unequal steps are not looked at."""
    if TIME not in data[history.name].dims:
        return
    values, steps = history.transpose(TIME, ...), np.diff(history[TIME].to_numpy())
    if len(steps) < 2 * DEGREE or np.ptp(steps) > 1e-3 * steps.mean():
        return
    x = values.to_numpy().reshape(len(values), -1).astype(float)
    least = _least_rounding(case_of(data), str(history.attrs.get("units", "")))
    if np.ptp(x, axis=0).max() <= max(SINGLE * np.abs(x).max(), least):
        return
    window = signal.get_window("hann", len(x))[:, None]
    power = np.abs(fft.rfft((x - x.mean(axis=0)) * window, axis=0)) ** 2
    share = math.sqrt(power[int(UPPER * len(power)) :].sum() / power.sum())
    if share > FOLDS:
        rate = 0.5 / steps.mean()
        warnings.warn(
            f"{history.name} has no filter before it is sampled every {1e6 * steps.mean():.3g} µs, "
            f"and {100 * share:.2g} % of what varies lies close to the highest frequency that "
            f"this resolves: lines above {rate:.4g} Hz appear at lower orders. Sample more often "
            "(solver.output_interval_ms) and compare, or take a sensor, which filters them",
            FlexgearWarning,
            stacklevel=3,
        )


def _least_rounding(case: Case, unit: str) -> float:
    """Amplitude up to which histories in a unit are rounding, whatever their mean."""
    if unit.startswith("N"):
        return OF_TORQUE * max(map(abs, power_flow(case).torque.values()), default=0.0)
    return OF_MOTION if unit in ("m", "rad", "m, rad") else 0.0


def first_input(data: xr.Dataset) -> str:
    """Member of the first input of a result's case."""
    return str(case_of(data).inputs[0].member)
