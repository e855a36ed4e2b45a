"""Tables in CSV files: numbers under titles that end in their unit.

Columns stand between commas, or between semicolons or tabs; then numbers may have decimal commas,
as spreadsheets write them where the comma is the decimal sign. Lines that begin with # are remarks.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import MOST_SERIES, read_text
from flexgear.model.units import Quantity

Row = tuple[int, list[str]]  # number of its line, cells
Column = tuple[str, str, int, str]  # name, dimension, place, unit
Values = tuple[int, dict[str, float]]  # number of its line, SI values by column


def read_table(
    path: Path,
    what: str,
    columns: Sequence[Mapping[str, str]],
    optional: Mapping[str, str] | None = None,
) -> tuple[dict[str, str], Iterator[Values]]:
    """Titles by column, and rows, of a CSV file; columns that are not asked for are left alone.

    what: the table in messages. columns: each with its dimension, or several of which the file has
    one. optional: columns of which the file may have any; a title that only begins like one of them
    is refused. Raises InputError with the line and column of what is wrong.
    """
    where = str(path)
    text = read_text(path, what, MOST_SERIES)
    separator = _separator(text)
    rows = _rows(text, separator, where)
    header = [h.strip().lower() for h in next(rows, (0, []))[1]]
    if not header:
        usual = ", ".join(_usual(next(iter(any_of.items()))) for any_of in columns)
        raise InputError(where, what, "is empty", f"give columns {usual}")
    columns_of_table = [_column(header, any_of, where) for any_of in columns]
    columns_of_table += _optional(header, optional or {}, where)
    titles = {name: header[at] for name, _, at, _ in columns_of_table}
    return titles, _values(rows, header, columns_of_table, separator, where)


def _values(
    rows: Iterator[Row], header: list[str], columns: list[Column], separator: str, where: str
) -> Iterator[Values]:
    for number, row in rows:
        if any(cell.strip() for cell in row[len(header) :]):
            raise InputError(
                where, f"line {number}", f"has {len(row)} cells under {len(header)} titles",
                "write numbers with a decimal point, or semicolons between the columns",
            )  # fmt: skip
        values = {}
        for name, dimension, at, suffix in columns:
            cell = row[at].strip() if at < len(row) else ""
            values[name] = Quantity(dimension).to_si(_number(cell, separator), suffix)
            if not math.isfinite(values[name]):
                raise InputError(
                    where,
                    f"line {number}, {header[at]}",
                    f"{echo(cell)} is not a number" if cell else "is empty",
                    "give a number with a decimal point and nothing between thousands",
                )
        yield number, values


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


def _usual(column: tuple[str, str]) -> str:
    name, dimension = column
    return f"{name}_{Quantity(dimension).suffixes[0]}"


def _optional(header: list[str], optional: Mapping[str, str], where: str) -> list[Column]:
    """Those of the optional columns that there are."""
    each = (_column_of(header, {name: dimension}) for name, dimension in optional.items())
    columns = [column for column in each if column is not None]
    begins, present = tuple({name.partition("_")[0] for name in optional}), {c[2] for c in columns}
    for at, title in enumerate(header):
        if begins and title.startswith(begins) and at not in present:
            raise InputError(
                where, f"column {echo(title)}", "is not known, or there twice",
                f"head it {', '.join(map(_usual, optional.items()))}",
            )  # fmt: skip
    return columns


def _column(header: list[str], any_of: Mapping[str, str], where: str) -> Column:
    """The first column that is one of ``any_of``; InputError without one."""
    place = _column_of(header, any_of)
    if place is not None:
        return place
    right = " or ".join(f"{n}_{s}" for n, d in any_of.items() for s in Quantity(d).suffixes)
    raise InputError(
        where, f"column {' or '.join(any_of)}", f"is not among {echo(', '.join(header))}",
        f"head a column {right}",
    )  # fmt: skip


def _column_of(header: list[str], any_of: Mapping[str, str]) -> Column | None:
    """The first column that is one of ``any_of``."""
    for at, title in enumerate(header):
        for name, dimension in any_of.items():
            suffix = title.removeprefix(f"{name}_")
            if suffix != title and suffix in Quantity(dimension).suffixes:
                return name, dimension, at, suffix
    return None
