"""A history from a CSV file with the columns time_s and torque_nm, or time_s and speed_rpm."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from flexgear.model.csv_table import read_table
from flexgear.model.errors import InputError

Followed = Literal["torque", "speed"]


def read_time_series(path: Path, what: Followed) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times (s) and torques (N m) or speeds (rad/s) of a CSV file; other columns are left alone."""
    where, series = str(path), f"{what} series"
    times: list[float] = []
    found: list[float] = []
    titles, rows = read_table(path, series, [{"time": "time"}, {what: what}])
    for number, values in rows:
        if times and values["time"] <= times[-1]:
            raise InputError(
                where, f"line {number}, {titles['time']}", "does not rise",
                "put the rows in order of time, each time once",
            )  # fmt: skip
        times.append(values["time"])
        found.append(values[what])
    if len(times) < 2:
        raise InputError(where, series, f"has {len(times)} rows", "give at least two")
    return tuple(times), tuple(found)
