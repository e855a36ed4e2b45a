"""Histories from CSV files: a column time_s and what is followed, row by row."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from flexgear.model.csv_table import read_table
from flexgear.model.errors import InputError

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
