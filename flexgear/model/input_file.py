"""Files that a user names: their text, and tables of numbers under titles with units."""

from __future__ import annotations

import csv
import errno
import lzma
import math
import os
import stat
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

from flexgear.model.errors import InputError, echo
from flexgear.model.units import Quantity

MEGABYTE = 1 << 20
MOST_CASE = 4 * MEGABYTE  # of TOML or JSON
MOST_SERIES = 64 * MEGABYTE  # of a CSV file, millions of rows
MOST_FE_MESH = 4096 * MEGABYTE
MOST_REXS = 256 * MEGABYTE  # unpacked; gearboxes with load distributions take some 32
MOST_MATRICES = 2048 * MEGABYTE


def require_regular(path: Path, what: str, most: int) -> None:
    """InputError if ``path`` is no regular file, or has more than ``most`` bytes.

    Pipes and devices would keep a reader waiting, or feed it for ever.
    """
    try:
        status = os.stat(path)
    except FileNotFoundError:
        raise InputError(str(path), what, "there is no such file", "check the path") from None
    except OSError as fault:
        raise InputError(str(path), what, fault.strerror or "unreadable", "check it") from None
    except ValueError as fault:  # a zero byte in the name
        raise InputError(str(path), what, str(fault), "check the path") from None
    if stat.S_ISDIR(status.st_mode):
        raise InputError(str(path), what, "is a folder", "name a file in it")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(str(path), what, "is a device or pipe", "name a file")
    if status.st_size > most:
        _too_large(path, what, most)


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """A regular file opened for reading; OSError for a pipe or device, without waiting for it."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "is a device or pipe", os.fspath(path))
        return open(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def read_kept(path: str | os.PathLike[str]) -> bytes:
    """The content of a file of a cache; OSError also for a pipe or device in its place."""
    with open_regular(path) as file:
        return file.read()


def read_bytes(path: Path, what: str, most: int) -> bytes:
    """The content of a regular file of at most ``most`` bytes; InputError where there is none."""
    require_regular(path, what, most)
    try:
        with open_regular(path) as file:
            content = file.read(most + 1)  # it may grow meanwhile
    except OSError as fault:
        raise InputError(str(path), what, fault.strerror or "unreadable", "check it") from None
    if len(content) > most:
        _too_large(path, what, most)
    return content


def read_text(path: Path, what: str = "case file", most: int = MOST_CASE) -> str:
    """The text of a regular file; InputError also if it is no UTF-8. Without a byte order mark."""
    try:
        return read_bytes(path, what, most).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(str(path), what, "is not UTF-8 text", "save it as plain text") from None


def _too_large(path: Path, what: str, most: int) -> None:
    raise InputError(
        str(path), what, f"is larger than {most // MEGABYTE} MB", "check that it is the right file"
    )


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
    header, rows, separator = read_cells(path, what)
    if not header:
        usual = ", ".join(_usual(next(iter(any_of.items()))) for any_of in columns)
        raise InputError(where, what, "is empty", f"give columns {usual}")
    header = [title.lower() for title in header]
    columns_of_table = [_column(header, any_of, where) for any_of in columns]
    columns_of_table += _optional(header, optional or {}, where)
    titles = {name: header[at] for name, _, at, _ in columns_of_table}
    return titles, _values(rows, header, columns_of_table, separator, where)


def read_cells(path: Path, what: str) -> tuple[list[str], Iterator[Row], str]:
    """Titles, rows of cells, and what separates them, of a CSV file."""
    text = read_text(path, what, MOST_SERIES)
    separator = _separator(text)
    rows = _rows(text, separator, str(path))
    return [h.strip() for h in next(rows, (0, []))[1]], rows, separator


def require_titles(row: list[str], header: list[str], where: str, number: int) -> None:
    """InputError for a row with cells beyond the titles."""
    if any(cell.strip() for cell in row[len(header) :]):
        raise InputError(
            where, f"line {number}", f"has {len(row)} cells under {len(header)} titles",
            "write numbers with a decimal point, or semicolons between the columns",
        )  # fmt: skip


def number_in(cell: str, separator: str, where: str, place: str) -> float:
    """The number in a cell; InputError names its place where it holds none."""
    value = _number(cell, separator)
    if not math.isfinite(value):
        raise InputError(
            where, place, f"{echo(cell)} is not a number" if cell else "is empty",
            "give a number with a decimal point and nothing between thousands",
        )  # fmt: skip
    return value


def _values(
    rows: Iterator[Row], header: list[str], columns: list[Column], separator: str, where: str
) -> Iterator[Values]:
    for number, row in rows:
        require_titles(row, header, where, number)
        values = {}
        for name, dimension, at, suffix in columns:
            cell = row[at].strip() if at < len(row) else ""
            value = number_in(cell, separator, where, f"line {number}, {header[at]}")
            values[name] = Quantity(dimension).to_si(value, suffix)
        yield number, values


def _separator(text: str) -> str:
    """Column separator of the first line that is no comment."""
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
    """The optional columns that the file has."""
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
        if named := quantity_in(title, any_of):
            return named[0], any_of[named[0]], at, named[1]
    return None


def quantity_in(title: str, dimensions: Mapping[str, str]) -> tuple[str, str] | None:
    """Which quantity of ``dimensions`` a title names, and in which unit; None for another title."""
    for name, dimension in dimensions.items():
        suffix = title.removeprefix(f"{name}_")
        if suffix != title and suffix in Quantity(dimension).suffixes:
            return name, suffix
    return None


DAMAGED = (  # what reading a damaged zip, or an array in one, may raise; bz2 raises OSError
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, OSError, EOFError, ValueError, RuntimeError,
    NotImplementedError, OverflowError,
)  # fmt: skip
