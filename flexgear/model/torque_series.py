"""A torque history from a CSV file with the columns time_s and torque_nm."""

from __future__ import annotations

import csv
import math
from pathlib import Path

from flexgear.model.errors import InputError
from flexgear.model.read import read_text
from flexgear.model.units import Quantity

_COLUMNS = {"time": Quantity("time"), "torque": Quantity("torque")}


def read_torque_series(path: Path) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Times (s) and torques (N m) of a CSV file; other columns are left alone."""
    where = str(path)
    rows = list(csv.reader(read_text(path, "torque series").splitlines()))
    numbered = [(n, r) for n, r in enumerate(rows, 1) if r and not r[0].lstrip().startswith("#")]
    if not numbered:
        raise InputError(where, "torque series", "is empty", "give columns time_s, torque_nm")
    header = [h.strip().lower() for h in numbered[0][1]]
    columns = {name: _column(header, name, where) for name in _COLUMNS}
    times: list[float] = []
    torques: list[float] = []
    for number, row in numbered[1:]:
        if not any(cell.strip() for cell in row):
            continue
        values = {}
        for name, (at, suffix) in columns.items():
            cell = row[at].strip() if at < len(row) else ""
            try:
                values[name] = _COLUMNS[name].to_si(float(cell), suffix)
            except ValueError:
                values[name] = math.nan
            if not math.isfinite(values[name]):
                raise InputError(
                    where,
                    f"line {number}, {header[at]}",
                    f"{cell!r} is not a number" if cell else "is empty",
                    "give a number with a decimal point",
                )
        if times and values["time"] <= times[-1]:
            raise InputError(
                where, f"line {number}, {header[columns['time'][0]]}", "does not rise",
                "put the rows in order of time, each time once",
            )  # fmt: skip
        times.append(values["time"])
        torques.append(values["torque"])
    if len(times) < 2:
        raise InputError(where, "torque series", f"has {len(times)} rows", "give at least two")
    return tuple(times), tuple(torques)


def _column(header: list[str], name: str, where: str) -> tuple[int, str]:
    """Index and unit of a column."""
    for at, title in enumerate(header):
        stem, _, suffix = title.partition("_")
        if stem == name and suffix in _COLUMNS[name].suffixes:
            return at, suffix
    right = " or ".join(f"{name}_{s}" for s in _COLUMNS[name].suffixes)
    raise InputError(
        where, f"column {name}", f"is not among {', '.join(header) or 'nothing'}",
        f"head a column {right}",
    )  # fmt: skip
