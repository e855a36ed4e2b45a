"""Reading of files that a user names: text, bytes, and CSV tables with units in the titles."""

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
MAX_CASE_BYTES = 4 * MEGABYTE  # of TOML or JSON
MAX_CSV_BYTES = 64 * MEGABYTE  # millions of rows
MAX_FE_MESH_BYTES = 4096 * MEGABYTE
MAX_REXS_BYTES = 256 * MEGABYTE  # unpacked; gearboxes with load distributions take some 32
MAX_MATRIX_BYTES = 2048 * MEGABYTE
MAX_DATASET_BYTES = 1 << 40  # of netCDF, which is read in pieces


def require_regular(path: Path, what: str, max_bytes: int) -> None:
    """Raise InputError unless ``path`` is a regular file of at most ``max_bytes`` bytes. Reading a
    pipe or device could block or never end. what: name of the content in messages."""
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
    if status.st_size > max_bytes:
        raise _too_large(path, what, max_bytes)


def open_regular(path: str | os.PathLike[str]) -> BinaryIO:
    """Open a regular file for reading; OSError for a pipe or device, without blocking."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError(errno.EINVAL, "is a device or pipe", os.fspath(path))
        return open(handle, "rb")
    except BaseException:
        os.close(handle)
        raise


def read_kept(path: str | os.PathLike[str]) -> bytes:
    """The content of a cached file; OSError also if it is a pipe or device."""
    with open_regular(path) as file:
        return file.read()


def read_bytes(path: Path, what: str, max_bytes: int) -> bytes:
    """The content of a regular file; InputError for other files, and for larger ones."""
    require_regular(path, what, max_bytes)
    try:
        with open_regular(path) as file:
            content = file.read(max_bytes + 1)  # it may have grown since the check
    except OSError as fault:
        raise InputError(str(path), what, fault.strerror or "unreadable", "check it") from None
    if len(content) > max_bytes:
        raise _too_large(path, what, max_bytes)
    return content


def read_text(path: Path, what: str = "case file", max_bytes: int = MAX_CASE_BYTES) -> str:
    """The UTF-8 text of a regular file without byte order mark; InputError if it is not UTF-8."""
    try:
        return read_bytes(path, what, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(str(path), what, "is not UTF-8 text", "save it as UTF-8") from None


def _too_large(path: Path, what: str, max_bytes: int) -> InputError:
    problem = f"is larger than {max_bytes // MEGABYTE} MB"
    return InputError(str(path), what, problem, "check that it is the right file")


Row = tuple[int, list[str]]  # line number, cells
Column = tuple[str, str, int, str]  # name, dimension, index, unit
Values = tuple[int, dict[str, float]]  # line number, SI values by column


def read_table(
    path: Path,
    what: str,
    columns: Sequence[Mapping[str, str]],
    optional: Mapping[str, str] | None = None,
) -> tuple[dict[str, str], Iterator[Values]]:
    """Titles by column, and rows of values, of a CSV file; other columns are ignored.

    what: name of the table in messages. columns: dimensions by name; the file must have one column
    of each mapping. optional: columns that the file may have; a title that begins like one of them
    but is none of them is refused. Raises InputError with line and column of wrong content.
    """
    where = str(path)
    header, rows, separator = read_cells(path, what)
    if not header:
        usual = ", ".join(_usual(next(iter(any_of.items()))) for any_of in columns)
        raise InputError(where, what, "is empty", f"give columns {usual}")
    header = [title.lower() for title in header]
    columns_of_table = [_column(header, any_of, where) for any_of in columns]
    columns_of_table += _optional(header, optional or {}, where)
    for name, dimension, _, _ in columns_of_table:
        require_one([title for title in header if quantity_in(title, {name: dimension})], where)
    titles = {name: header[at] for name, _, at, _ in columns_of_table}
    return titles, _values(rows, header, columns_of_table, separator, where)


def read_cells(path: Path, what: str) -> tuple[list[str], Iterator[Row], str]:
    """Titles, rows of cells, and separator of a CSV file."""
    text = read_text(path, what, MAX_CSV_BYTES)
    lines = (line for line in text.splitlines() if line.strip() and not _comment(line))
    title = next(lines, "")  # the first line that is not a comment
    separator = next((sign for sign in ";\t" if sign in title), ",")
    rows = _rows(text, separator, str(path))
    return [h.strip() for h in next(rows, (0, []))[1]], rows, separator


def require_one(titles: Sequence[str], where: str) -> None:
    """Raise InputError if several columns, with these titles, hold the same quantity."""
    if len(titles) > 1:
        first, second = titles[:2]
        problem = "occurs twice" if first == second else f"is beside {first}"
        raise InputError(where, f"column {second}", problem, "keep one of them")


def require_titles(row: list[str], header: list[str], where: str, number: int) -> None:
    """Raise InputError for a row with more cells than there are titles."""
    if any(cell.strip() for cell in row[len(header) :]):
        problem = f"has {len(row)} cells under {len(header)} titles"
        remedy = "write numbers with a decimal point, or semicolons between the columns"
        raise InputError(where, f"line {number}", problem, remedy)


def number_in(cell: str, separator: str, where: str, place: str) -> float:
    """The number in a cell; InputError, which names ``place``, if there is none."""
    value = _number(cell, separator)
    if not math.isfinite(value):
        problem = f"{echo(cell)} is not a number" if cell else "is empty"
        remedy = "give a number with a decimal point and nothing between thousands"
        raise InputError(where, place, problem, remedy)
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


def _comment(cell: str) -> bool:
    """Whether a line is a comment, or "sep=;" by which some programs state the separator."""
    return cell.lstrip().lower().startswith(("#", "sep="))


def _rows(text: str, separator: str, where: str) -> Iterator[Row]:
    """Rows that are neither empty nor comments."""
    rows = csv.reader(text.splitlines(), delimiter=separator)
    try:
        for row in rows:
            if any(cell.strip() for cell in row) and not _comment(row[0]):
                yield rows.line_num, row
    except csv.Error as fault:
        remedy = "save the table as CSV again"
        raise InputError(where, f"line {rows.line_num}", f"is no CSV: {fault}", remedy) from None


def _number(cell: str, separator: str) -> float:
    """The number in a cell, NaN if it is not a number."""
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
            problem = "is not known, or occurs twice"
            remedy = f"name it {', '.join(map(_usual, optional.items()))}"
            raise InputError(where, f"column {echo(title)}", problem, remedy)
    return columns


def _column(header: list[str], any_of: Mapping[str, str], where: str) -> Column:
    """The first column that is one of ``any_of``; InputError if there is none."""
    column = _column_of(header, any_of)
    if column is not None:
        return column
    titles = " or ".join(f"{n}_{s}" for n, d in any_of.items() for s in Quantity(d).suffixes)
    problem = f"is not among {echo(', '.join(header))}"
    raise InputError(where, f"column {' or '.join(any_of)}", problem, f"name a column {titles}")


def _column_of(header: list[str], any_of: Mapping[str, str]) -> Column | None:
    """The first column that is one of ``any_of``, None if there is none."""
    for at, title in enumerate(header):
        if named := quantity_in(title, any_of):
            return named[0], any_of[named[0]], at, named[1]
    return None


def quantity_in(title: str, dimensions: Mapping[str, str]) -> tuple[str, str] | None:
    """Name and unit of the quantity in ``dimensions`` that a title names; None for other titles."""
    for name, dimension in dimensions.items():
        suffix = title.removeprefix(f"{name}_")
        if suffix != title and suffix in Quantity(dimension).suffixes:
            return name, suffix
    return None


DAMAGED = (  # exceptions raised by reading a damaged zip, or an array in it
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, OSError, EOFError, ValueError, RuntimeError,
    NotImplementedError, OverflowError,
)  # fmt: skip
