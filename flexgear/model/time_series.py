"""A history from a CSV file with the columns time_s and torque_nm, or time_s and speed_rpm.

Columns stand between commas, or between semicolons or tabs; then numbers may have decimal commas,
as spreadsheets write them where the comma is the decimal sign.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import MOST_SERIES, read_text
from flexgear.model.units import Quantity

Followed = Literal["torque", "speed"]
Row = tuple[int, list[str]]  # number of its line, cells


def read_time_series(path: Path, what: Followed) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times (s) and torques (N m) or speeds (rad/s) of a CSV file; other columns are left alone."""
    where, series = str(path), f"{what} series"
    text = read_text(path, series, MOST_SERIES)
    separator = _separator(text)
    rows = _rows(text, separator, where)
    header = [h.strip().lower() for h in next(rows, (0, []))[1]]
    if not header:
        usual = f"{what}_{Quantity(what).suffixes[0]}"
        raise InputError(where, series, "is empty", f"give columns time_s, {usual}")
    columns = {name: _column(header, name, where) for name in ("time", what)}
    times: list[float] = []
    found: list[float] = []
    for number, row in rows:
        if any(cell.strip() for cell in row[len(header) :]):
            raise InputError(
                where, f"line {number}", f"has {len(row)} cells under {len(header)} titles",
                "write numbers with a decimal point, or semicolons between the columns",
            )  # fmt: skip
        values = {}
        for name, (at, suffix) in columns.items():
            cell = row[at].strip() if at < len(row) else ""
            values[name] = Quantity(name).to_si(_number(cell, separator), suffix)
            if not math.isfinite(values[name]):
                raise InputError(
                    where,
                    f"line {number}, {header[at]}",
                    f"{echo(cell)} is not a number" if cell else "is empty",
                    "give a number with a decimal point and nothing between thousands",
                )
        if times and values["time"] <= times[-1]:
            raise InputError(
                where, f"line {number}, {header[columns['time'][0]]}", "does not rise",
                "put the rows in order of time, each time once",
            )  # fmt: skip
        times.append(values["time"])
        found.append(values[what])
    if len(times) < 2:
        raise InputError(where, series, f"has {len(times)} rows", "give at least two")
    return tuple(times), tuple(found)


def _separator(text: str) -> str:
    """What stands between the columns of the first line that is no comment."""
    lines = (line for line in text.splitlines() if line.strip() and not _comment(line))
    title = next(lines, "")
    return next((sign for sign in ";\t" if sign in title), ",")


def _comment(cell: str) -> bool:
    return cell.lstrip().startswith("#")


def _rows(text: str, separator: str, where: str) -> Iterator[Row]:
    """Rows that are neither empty nor comments."""
    rows = csv.reader(text.splitlines(), delimiter=separator)
    try:
        for row in rows:
            if any(cell.strip() for cell in row) and not _comment(row[0]):
                yield rows.line_num, row
    except csv.Error as fault:
        raise InputError(
            where, f"line {rows.line_num}", f"is no CSV: {fault}", "save the table as CSV again"
        ) from None


def _number(cell: str, separator: str) -> float:
    """The number in a cell; NaN where it is none."""
    if separator != "," and "." not in cell:
        cell = cell.replace(",", ".")
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _column(header: list[str], name: str, where: str) -> tuple[int, str]:
    """Index and unit of a column."""
    for at, title in enumerate(header):
        stem, _, suffix = title.partition("_")
        if stem == name and suffix in Quantity(name).suffixes:
            return at, suffix
    right = " or ".join(f"{name}_{s}" for s in Quantity(name).suffixes)
    raise InputError(
        where, f"column {name}", f"is not among {echo(', '.join(header))}",
        f"head a column {right}",
    )  # fmt: skip
