"""Histories over time: written in a case or read from a CSV file."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import scipy  # which loads its parts as they are named
from numpy.typing import ArrayLike
from pydantic import Field, model_validator

from flexgear.arrays import Array, Ints
from flexgear.model.errors import InputError
from flexgear.model.input_file import read_table
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Speed, Time, Torque

Followed = Literal["torque", "speed"]
Points = tuple[float, ...]
LOAD_COLUMNS = {f"force_{axis}": "force" for axis in "xyz"} | {
    f"moment_{axis}": "torque" for axis in "xyz"
}


def read_time_series(path: Path, what: Followed) -> tuple[Points, Points]:
    """Times (s) and torques (N m) or speeds (rad/s) of a CSV file with the columns time_s and
    torque_nm, or time_s and speed_rpm; other columns are left alone."""
    times, series = _series(path, f"{what} series", {what: what}, {})
    return times, series[what]


def read_load_series(path: Path) -> tuple[Points, tuple[Points, ...], tuple[Points, ...]]:
    """Times (s), forces (N) and moments (N m) along x, y, z of a CSV file with the column time_s
    and any of ``LOAD_COLUMNS``; components without a column are zero."""
    times, series = _series(path, "load series", {}, LOAD_COLUMNS)
    if not series:
        raise InputError(
            str(path), "load series", "has no component",
            "head a column force_x_n, force_y_n, force_z_n, moment_x_nm, moment_y_nm or "
            "moment_z_nm",
        )  # fmt: skip
    none = (0.0,) * len(times)
    six = [series.get(name, none) for name in LOAD_COLUMNS]
    return times, tuple(zip(*six[:3], strict=True)), tuple(zip(*six[3:], strict=True))


def _series(
    path: Path, series: str, needed: dict[str, str], optional: dict[str, str]
) -> tuple[Points, dict[str, Points]]:
    """Rising times, and the columns that there are."""
    where = str(path)
    times: list[float] = []
    columns = [{"time": "time"}, *({name: d} for name, d in needed.items())]
    titles, rows = read_table(path, series, columns, optional)
    histories: dict[str, list[float]] = {name: [] for name in titles if name != "time"}
    for number, values in rows:
        if times and values["time"] <= times[-1]:
            raise InputError(
                where, f"line {number}, {titles['time']}", "does not rise",
                "put the rows in order of time, each time once",
            )  # fmt: skip
        times.append(values["time"])
        for name, column in histories.items():
            column.append(values[name])
    if len(times) < 2:
        raise InputError(where, series, f"has {len(times)} rows", "give at least two")
    return tuple(times), {name: tuple(column) for name, column in histories.items()}


_SAME_TIME = 1e-12  # of a time; a step at 1 s counts from the first instant after 1 s
_MOST: dict[Followed, tuple[float, str]] = {"torque": (1e9, "1e9 N m"), "speed": (1e4, "1e4 rad/s")}


class TimeHistory(Section):
    """A torque or a speed over time; what is left out is the rated one.

    constant  ``torque`` or ``speed`` at all times
    steps     ``torques[k]`` or ``speeds[k]`` for times[k] < t <= times[k+1]; the first holds before
    ramp      straight lines between the points of time, constant outside
    soft      half cosines between the points of time, constant outside: without jump and kink
    csv       as ramp, the points read from ``file``, columns time_s and torque_nm or speed_rpm;
              between points of a speed a smooth curve without overshoot (Fritsch, Butland 1984), as
              every kink of a given speed is a jump of its torque

    kind: form of the history. torque, speed: of a constant one. times: of its points, rising.
    torques, speeds: at these times. file: CSV of the points.
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
        """What it is a history of."""
        return "torque"

    @model_validator(mode="after")
    def _complete(self) -> TimeHistory:
        what = self.followed
        other = "speed" if what == "torque" else "torque"
        for key in (other, f"{other}s"):
            if getattr(self, key) not in (None, ()):
                raise Refusal(key, f"is given where a {what} is followed", f"give {what} instead")
        if self.kind == "constant":
            return self
        if self.kind == "csv" and self.file is None and not self.times:
            columns = "time_s and torque_nm" if what == "torque" else "time_s and speed_rpm"
            raise Missing("file", "is missing", f"name a CSV file with {columns}")
        if len(self.times) != len(self.values) or not self.times:
            raise Refusal(
                "times",
                f"{len(self.times)} times and {len(self.values)} {what}s",
                f"a history of kind {self.kind!r} needs as many times as {what}s",
            )
        if np.any(np.diff(self.times) <= 0):
            raise Refusal("times", "do not rise", "put them in order, each once")
        most, limit = _MOST[what]
        if max(abs(x) for x in self.values) > most:
            raise Refusal(f"{what}s", f"are beyond {limit}", "check the unit")
        return self

    @property
    def is_series(self) -> bool:
        """Whether the history changes continuously: a ramp, or the points of a file."""
        return self.kind in ("ramp", "soft", "csv")

    @property
    def is_steep(self) -> bool:
        """Whether it may change fast: a series with kinks, or of a file."""
        return self.is_series and self.kind != "soft"

    @property
    def values(self) -> tuple[float, ...]:
        """Torques or speeds at ``times``."""
        return self.torques if self.followed == "torque" else self.speeds

    def steady(self, rated: float) -> float:
        """Torque or speed of a constant history: as given, or the rated one."""
        level = self.torque if self.followed == "torque" else self.speed
        return rated if level is None else level

    def at(self, time: ArrayLike, rated: float) -> Array:
        """Torque, N m, or speed, rad/s, at the times given, s; same shape."""
        t = np.asarray(time, dtype=float)
        if self.kind == "constant":
            return np.full(t.shape, self.steady(rated))
        times, values = np.asarray(self.times), np.asarray(self.values)
        if self.kind == "steps":
            at = np.searchsorted(times + _SAME_TIME * np.abs(times), t, side="left") - 1
            return values[np.clip(at, 0, len(values) - 1)]
        if self._smooth:
            curve = scipy.interpolate.PchipInterpolator(times, values)
            return np.asarray(curve(np.clip(t, times[0], times[-1])))
        if self.kind == "soft":
            piece, share = self._place(t)
            rise = np.diff(values, append=values[-1])
            return np.asarray(values[piece] + rise[piece] * 0.5 * (1.0 - np.cos(np.pi * share)))
        return np.interp(t, times, values)

    def rate_at(self, time: ArrayLike) -> Array:
        """Its rate of change, in N m/s or rad/s², at times beside jumps and kinks; same shape."""
        t = np.asarray(time, dtype=float)
        if self.kind in ("constant", "steps"):
            return np.zeros(t.shape)
        times, values = np.asarray(self.times), np.asarray(self.values)
        within = (t > times[0]) & (t < times[-1])
        if self._smooth:
            return np.where(within, scipy.interpolate.PchipInterpolator(times, values)(t, 1), 0.0)
        slopes = np.append(np.diff(values) / np.diff(times), 0.0)
        piece, share = self._place(t)
        if self.kind == "soft":
            return np.asarray(slopes[piece] * 0.5 * np.pi * np.sin(np.pi * share))
        return np.where(within, slopes[piece], 0.0)

    def _place(self, t: Array) -> tuple[Ints, Array]:
        """The last point before times (…), and the share of the way from there to the next one."""
        times = np.asarray(self.times)
        piece = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1)
        length = np.diff(times, append=np.inf)[piece]
        return piece, np.clip((t - times[piece]) / length, 0.0, 1.0)

    @property
    def _smooth(self) -> bool:
        return self.kind == "csv" and self.followed == "speed" and len(self.times) > 1

    def change_times(self) -> tuple[float, ...]:
        """Times at which it jumps, s."""
        return self.times[1:] if self.kind == "steps" else ()

    def kinks(self) -> tuple[float, ...]:
        """Times at which its rate jumps, s."""
        if self._smooth:
            return (self.times[0], self.times[-1])
        return self.times if self.kind in ("ramp", "csv") else ()
