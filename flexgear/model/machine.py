"""Machines at inputs and output, and histories of torque, speed and loads over time."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import scipy  # loads its submodules on first use
from numpy.typing import ArrayLike
from pydantic import Field

from flexgear.arrays import Array
from flexgear.model.errors import InputError
from flexgear.model.input_file import read_table
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import RotationalDamping, RotationalStiffness, Speed, Time, Torque

if TYPE_CHECKING:
    from flexgear.model.case import Case


Followed = Literal["torque", "speed"]
Points = tuple[float, ...]
LOAD_COLUMNS = {f"force_{axis}": "force" for axis in "xyz"} | {
    f"moment_{axis}": "torque" for axis in "xyz"
}


def read_time_series(path: Path, what: Followed) -> tuple[Points, Points]:
    """Times (s) and torques (N m) or speeds (rad/s) of a CSV file with the columns time_s and
    torque_nm, or time_s and speed_rpm; other columns are ignored."""
    times, series = _series(path, f"{what} series", {what: what}, {})
    return times, series[what]


def read_load_series(path: Path) -> tuple[Points, tuple[Points, ...], tuple[Points, ...]]:
    """Times (s), forces (N) and moments (N m) along x, y, z of a CSV file with the column time_s
    and any of ``LOAD_COLUMNS``; components without a column are zero."""
    times, series = _series(path, "load series", {}, LOAD_COLUMNS)
    if not series:
        remedy = (
            "head a column force_x_n, force_y_n, force_z_n, moment_x_nm, moment_y_nm or moment_z_nm"
        )
        raise InputError(str(path), "load series", "has no column of a force or moment", remedy)
    none = (0.0,) * len(times)
    six = [series.get(name, none) for name in LOAD_COLUMNS]
    return times, tuple(zip(*six[:3], strict=True)), tuple(zip(*six[3:], strict=True))


def _series(
    path: Path, series: str, needed: dict[str, str], optional: dict[str, str]
) -> tuple[Points, dict[str, Points]]:
    """Increasing times, and values by column, of a CSV file. needed, optional: dimensions by
    column."""
    where = str(path)
    times: list[float] = []
    columns = [{"time": "time"}, *({name: d} for name, d in needed.items())]
    titles, rows = read_table(path, series, columns, optional)
    histories: dict[str, list[float]] = {name: [] for name in titles if name != "time"}
    for number, values in rows:
        if times and values["time"] <= times[-1]:
            remedy = "put the rows in order of time, each time once"
            raise InputError(where, f"line {number}, {titles['time']}", "does not increase", remedy)
        times.append(values["time"])
        for name, column in histories.items():
            column.append(values[name])
    if len(times) < 2:
        raise InputError(where, series, f"has {len(times)} rows", "give at least two")
    return tuple(times), {name: tuple(column) for name, column in histories.items()}


_TIME_TOLERANCE = 1e-12  # relative; a step at 1 s acts from the first instant after 1 s
_MAX: dict[Followed, tuple[float, str]] = {"torque": (1e9, "1e9 N m"), "speed": (1e4, "1e4 rad/s")}


class TimeHistory(Section):
    """A torque or a speed over time; the rated one if left out.

    constant  ``torque`` or ``speed`` at all times
    steps     ``torques[k]`` or ``speeds[k]`` for times[k] < t <= times[k+1], before that the first
    ramp      straight lines between the points, constant outside
    soft      half cosines between the points, constant outside: without jumps and kinks
    csv       as ramp, the points read from ``file``, columns time_s and torque_nm or speed_rpm;
              between points of a speed a smooth curve without overshoot (Fritsch, Butland 1984),
              since a kink of a prescribed speed is a jump of its torque

    kind: form of the history. torque, speed: value of a constant history. times: times of the
    points, increasing. torques, speeds: values at these times. file: CSV of the points.
    """

    kind: Literal["constant", "steps", "ramp", "soft", "csv"] = "constant"
    torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    speed: Speed | None = Field(default=None, ge=-1e4, le=1e4)
    times: tuple[Time, ...] = ()
    torques: tuple[Torque, ...] = ()
    speeds: tuple[Speed, ...] = ()
    file: str | None = None

    @property
    def followed(self) -> Followed:
        """Quantity of the history, "torque" or "speed"."""
        return "torque"

    def _check(self) -> None:
        what = self.followed
        other = "speed" if what == "torque" else "torque"
        problem = f"is given where a {what} is followed"
        self._refuse_set((other, f"{other}s"), problem, f"give {what} instead")
        if self.kind == "constant":
            return
        if self.kind == "csv" and self.file is None and not self.times:
            columns = "time_s and torque_nm" if what == "torque" else "time_s and speed_rpm"
            raise Missing("file", "is missing", f"name a CSV file with {columns}")
        if len(self.times) != len(self.values) or not self.times:
            problem = f"{len(self.times)} times and {len(self.values)} {what}s"
            remedy = f"a history of kind {self.kind!r} needs as many times as {what}s"
            raise Refusal("times", problem, remedy)
        if np.any(np.diff(self.times) <= 0):
            raise Refusal("times", "do not increase", "put them in order, each once")
        limit, limit_text = _MAX[what]
        if max(abs(x) for x in self.values) > limit:
            raise Refusal(f"{what}s", f"are beyond {limit_text}", "check the unit")

    @property
    def changes(self) -> bool:
        """Whether the values of the history differ."""
        return self.kind != "constant" and len({*self.values}) > 1

    @property
    def is_series(self) -> bool:
        """Whether the history changes continuously: a ramp, or the points of a file."""
        return self.kind in ("ramp", "soft", "csv") and self.changes

    @property
    def is_steep(self) -> bool:
        """Whether the history may change fast: a ramp, or the points of a file."""
        return self.is_series and self.kind != "soft"

    @property
    def values(self) -> tuple[float, ...]:
        """Torques or speeds at ``times``."""
        return self.torques if self.followed == "torque" else self.speeds

    def steady(self, rated: float) -> float:
        """Torque or speed of a constant history, the rated value if none is given."""
        value = self.torque if self.followed == "torque" else self.speed
        return rated if value is None else value

    def at(self, time: ArrayLike, rated: float) -> Array:
        """Torque, N m, or speed, rad/s, at times (any shape), s; same shape."""
        t = np.asarray(time, dtype=float)
        if self.kind == "constant":
            return np.full(t.shape, self.steady(rated))
        times, values = np.asarray(self.times), np.asarray(self.values)
        if self.kind == "steps":
            at = np.searchsorted(times + _TIME_TOLERANCE * np.abs(times), t, side="left") - 1
            return values[np.clip(at, 0, len(values) - 1)]
        return self._curve(t)[0]

    def rate_at(self, time: ArrayLike) -> Array:
        """Rate of change, N m/s or rad/s², at times (any shape) without jumps and kinks."""
        t = np.asarray(time, dtype=float)
        return self._curve(t)[1] if self.is_series else np.zeros(t.shape)

    def _curve(self, t: Array) -> tuple[Array, Array]:
        """Values and rates of change of a ramp, soft or csv history at times t (…), s, none of
        which is a kink."""
        times, values = np.asarray(self.times), np.asarray(self.values)
        within = (t > times[0]) & (t < times[-1])
        if self._smooth:
            curve = scipy.interpolate.PchipInterpolator(times, values)
            inside = np.clip(t, times[0], times[-1])
            return np.asarray(curve(inside)), np.where(within, curve(inside, 1), 0.0)
        piece = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1)
        length = np.diff(times, append=np.inf)[piece]
        rise = np.diff(values, append=values[-1])[piece]
        share = np.clip((t - times[piece]) / length, 0.0, 1.0)
        slope = np.ones_like(share)
        if self.kind == "soft":
            slope = 0.5 * np.pi * np.sin(np.pi * share)
            share = 0.5 * (1.0 - np.cos(np.pi * share))
        return values[piece] + rise * share, np.where(within, rise / length * slope, 0.0)

    @property
    def _smooth(self) -> bool:
        return self.kind == "csv" and self.followed == "speed" and len(self.times) > 1

    def change_times(self) -> tuple[float, ...]:
        """Times at which the history jumps, s."""
        return self.times[1:] if self.kind == "steps" and self.changes else ()

    def kinks(self) -> tuple[float, ...]:
        """Times at which the rate of the history jumps, s."""
        if not self.is_steep:
            return ()
        return (self.times[0], self.times[-1]) if self._smooth else self.times


_KEYS_OF_LAW = {
    "controller": ("kp", "ki", "least_torque", "most_torque"),
    "brake": ("brake_torque", "brake_exponent"),
}


class Machine(TimeHistory):
    """Machine at a port; torques act on the member, torques and speeds are positive about +z.

    torque      the torque of the history at any speed
    speed       the speed of the history; the torque is a result
    controller  T = kp (ω_s − ω) + ki ∫ (ω_s − ω) dt with the set speed ω_s of the history, limited
                to least_torque and most_torque, where the integral is held; the initial integral
                gives the torque of the initial equilibrium
    brake       T = −brake_torque sign(ω) |ω/ω_rated|^brake_exponent; brake_torque that of statics
                if left out

    law: law of the machine. kp, ki: gains of a controller on speed and on angle. least_torque,
    most_torque: limits of a controller. brake_torque: at rated speed. brake_exponent: exponent of
    the speed in a brake's torque.
    """

    law: Literal["torque", "speed", "controller", "brake"] = "torque"
    kp: RotationalDamping | None = Field(default=None, ge=0.0, le=1e15)
    ki: RotationalStiffness = Field(default=0.0, ge=0.0, le=1e15)
    least_torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    most_torque: Torque | None = Field(default=None, ge=-1e9, le=1e9)
    brake_torque: Torque | None = Field(default=None, gt=0.0, le=1e9)
    brake_exponent: float = Field(default=1.0, ge=0.0, le=5.0)

    @property
    def followed(self) -> Followed:
        """Quantity of the history: "speed" for the laws speed and controller, else "torque"."""
        return "speed" if self.follows_speed else "torque"

    @property
    def follows_speed(self) -> bool:
        """Whether the machine prescribes or controls a speed."""
        return self.law in ("speed", "controller")

    @classmethod
    def required(cls, data: Mapping[str, Any]) -> list[Missing]:
        """``kp`` for a controller."""
        missing = data.get("law") == "controller" and data.get("kp") is None
        return [Missing("kp", "is missing for a controller")] if missing else []

    def _check(self) -> None:
        for law, keys in _KEYS_OF_LAW.items():
            if self.law != law:
                self._refuse_set(keys, f"is given, but law is {self.law!r}", f'set law = "{law}"')
        if self.law == "speed" and self.kind == "steps":
            problem = "a speed cannot jump: no torque is large enough"
            raise Refusal("kind", problem, 'use kind = "soft"')
        least, most = self.least_torque, self.most_torque
        if least is not None and most is not None and not least < most:
            raise Refusal("least_torque", "is not below most_torque", "lower it")
        refuse_infinite_slope(self.brake_exponent)


def refuse_infinite_slope(brake_exponent: float) -> None:
    """Raise Refusal for a brake torque T ~ |ω|^exponent with infinite slope at zero speed, which
    cannot be integrated."""
    if 0.0 < brake_exponent < 1.0:
        problem = "between 0 and 1 the slope of the torque is infinite at zero speed"
        raise Refusal("brake_exponent", problem, "0 or ≥ 1")


def machine_of(drive: TimeHistory) -> Machine:
    """The machine that follows a torque history."""
    return Machine(**{name: getattr(drive, name) for name in TimeHistory.model_fields})


def machines_of(case: Case) -> tuple[Machine | None, ...]:
    """Machines at the ports of a case.

    The machine of the first input is ``drive`` if it has none; that of the output is a brake if it
    has none. None stands for an input whose torque is in rated proportion to that of the first
    input, or its rated torque if the first input follows no torque.
    """
    machines = [port.machine for port in case.inputs]
    if machines and machines[0] is None:
        machines[0] = machine_of(case.drive)
    if case.output is None:
        return tuple(machines)
    brake = Machine(
        law="brake",
        brake_torque=case.output.brake_torque,
        brake_exponent=case.output.brake_exponent,
    )
    return (*machines, case.output.machine or brake)


def series_of(case: Case) -> tuple[str, ...]:
    """Members whose machine or load has a history that may change fast."""
    ports = zip(case.ports, machines_of(case), strict=True)
    members = [port.member for port, machine in ports if machine is not None and machine.is_steep]
    members += [load.member for load in case.loads if load.changes]
    return tuple(dict.fromkeys(members))


def check_machines(case: Case) -> None:
    """Check that the first input has one machine, and that a port does not follow a speed."""
    if not case.inputs:
        return
    first = case.inputs[0].machine
    drive = case.drive
    keys = [key for key, field in TimeHistory.model_fields.items()
            if getattr(drive, key) != field.default
            and not (key == "torque" and drive.torque == case.inputs[0].given_torque)]  # fmt: skip
    if first is not None and keys:
        raise Refusal(f"drive.{keys[0]}", "is given beside inputs.0.machine", "keep one of them")
    if first is not None and first.law != "torque" and case.drive.steps.torques:
        problem = f"are drops of a torque, but the first input follows the law {first.law!r}"
        raise Refusal("drive.steps.torques", problem, 'take them out, or set its law = "torque"')
    if case.output is None:
        return
    machines = machines_of(case)
    if all(machine is not None and machine.follows_speed for machine in machines):
        problem = "all ports follow a speed, so the torque of the train is undetermined"
        remedy = 'let one of them follow law = "torque" or "brake"'
        raise Refusal("output.machine.law", problem, remedy)


class TorqueDrops(Section):
    """Torque drops, each of which ``flexgear run`` computes as a separate transient: from ``start``
    for ``duration``, then rated torque for ``after``. Times that are left out follow from the case.

    torques: torque of each drop. start: of the drop. duration: of the drop. after: time after the
    drop.
    """

    torques: tuple[Torque, ...] = ()
    start: Time | None = Field(default=None, ge=0.0, le=1e5)
    duration: Time | None = Field(default=None, gt=0.0, le=1e5)
    after: Time | None = Field(default=None, gt=0.0, le=1e5)

    @property
    def times(self) -> tuple[float, float, float]:
        """start, duration, after, s, of drops with all times (``coupling.pace.timed_drops``)."""
        assert self.start is not None and self.duration is not None and self.after is not None
        return self.start, self.duration, self.after


class TorqueHistory(TimeHistory):
    """Torque history of the first input; torques of inputs without a machine are in rated
    proportion to it.

    steps (the section): torque drops that ``flexgear run`` computes in addition to steady running.
    """

    steps: TorqueDrops = TorqueDrops()

    def drop(self, torque: float, start: float, duration: float, rated: float) -> TorqueHistory:
        """The history of one torque drop: ``torque`` for ``duration`` s from ``start`` s."""
        before = self.steady(rated)
        return self.model_copy(
            update={
                "kind": "steps",
                "times": (min(0.0, start - duration), start, start + duration),
                "torques": (before, torque, before),
            }
        )
