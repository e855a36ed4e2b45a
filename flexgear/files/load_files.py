"""Loads in files: channels over time of OpenFAST, CSV and netCDF; the table of load bins that
``[spectrum]`` reads.

The reader of .outb is our own: for these few lines openfast-io brings pandas, deepdiff and YAML.
"""

from __future__ import annotations

import csv
import io
import re
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.load_bins import LoadBin
from flexgear.model.errors import InputError, echo
from flexgear.model.input_file import (
    MOST_FE_MESH,
    number_in,
    read_bytes,
    read_cells,
    read_text,
    require_titles,
)
from flexgear.model.load_cases import AXES, Channel
from flexgear.model.read import nearest
from flexgear.model.units import ALL_SUFFIXES, Quantity, suffix_of

WHAT = "load series"
CUT_SHORT = "the file is cut short: give it whole"
MOST = MOST_FE_MESH // 2
_TITLE = re.compile(r"\s*(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*")


class Table(NamedTuple):
    """Names and units of all channels of a file, and values (samples, n) of the requested ones."""

    names: list[str]
    units: list[str]
    values: Array


def read_channels(path: Path, channels: dict[str, tuple[Channel, str]]) -> dict[str, Array]:
    """SI values (samples,) of channels, each given with its dimension, by their keys.

    Raises InputError for a file that is cut short, a channel that is missing, a unit that is
    missing or of another dimension, a value that is no number, and times that do not rise.
    """
    form = READERS.get(path.suffix.lower())
    if form is None:
        problem = f"{echo(path.suffix)} is unknown"
        raise InputError(str(path), WHAT, problem, f"give one of {', '.join(READERS)}")
    table = form(path, [channel.name for channel, _ in channels.values()])
    result = {}
    for k, (key, (channel, dimension)) in enumerate(channels.items()):
        at = table.names.index(channel.name)
        suffix = _suffix(path, key, channel, table.units[at], dimension)
        values = channel.sign * table.values[:, k]
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            problem = f"sample {wrong[0] + 1} is {values[wrong[0]]}, and {len(wrong) - 1} more"
            raise InputError(str(path), channel.name, problem, "run the simulation again")
        result[key] = Quantity(dimension).to_si(1.0, suffix) * values
    if len(result["time"]) < 2 or np.any(np.diff(result["time"]) <= 0.0):
        problem = f"has {len(result['time'])} samples, or times that do not rise"
        raise InputError(str(path), channels["time"][0].name, problem, "give a whole series")
    return result


def _suffix(path: Path, key: str, channel: Channel, unit: str, dimension: str) -> str:
    """The unit of a channel: the file's, or that of the case where the file has none."""
    ending = next((s for s in ALL_SUFFIXES if not unit and channel.name.endswith(f"_{s}")), "")
    written = unit.strip("- ") or ending
    if (
        channel.unit
        and written
        and suffix_of(channel.unit, dimension) != suffix_of(written, dimension)
    ):
        problem = f"is in {written} in the file, and in {channel.unit} in the case"
        raise InputError(str(path), channel.name, problem, "take the unit out of the case")
    text = channel.unit or written
    if not text:
        usual = Quantity(dimension).suffixes[0]
        remedy = f'give it in the case: {key} = "{channel.name} [{usual}]"'
        raise InputError(str(path), channel.name, f"has no unit of {dimension}", remedy)
    suffix = suffix_of(text, dimension)
    if suffix is None:
        usual = ", ".join(Quantity(dimension).suffixes)
        problem = f"is in {echo(text)}, which is no unit of {dimension}"
        raise InputError(str(path), channel.name, problem, f"give another channel, in {usual}")
    return suffix


def _columns(path: Path, names: Sequence[str], wanted_names: Sequence[str]) -> list[int]:
    """Indices of the requested channels among those of a file."""
    for name in wanted_names:
        if name not in names:
            raise InputError(str(path), name, "is not in the file", nearest(name, list(names)))
    return [list(names).index(name) for name in wanted_names]


def _printable(name: str) -> str:
    """A name without padding blanks and NUL bytes; unprintable characters as question marks."""
    return "".join(sign if sign.isprintable() else "?" for sign in name.strip(" \0"))


def _text(path: Path, names: Sequence[str]) -> Table:
    """Channels of an OpenFAST text file: lines of description, names from Time on, units, one line
    for each sample."""
    text = read_text(path, WHAT, MOST)
    lines = text.splitlines()
    before, last = (len((line.split() or [""])[-1].lstrip("-")) for line in ["", "", *lines][-2:])
    if not text.endswith("\n") and last < before:  # all numbers of a column are equally long
        raise InputError(str(path), f"line {len(lines)}", "ends within a number", CUT_SHORT)
    head = next((k for k, line in enumerate(lines) if line.lower().split()[:1] == ["time"]), None)
    if head is None or head + 2 > len(lines):
        problem = "has no line of names that begins with Time, with units below"
        raise InputError(str(path), WHAT, problem, "give a whole output file of OpenFAST")
    titles, units = ([_printable(w) for w in line.split()] for line in lines[head : head + 2])
    columns = _columns(path, titles, names)
    body = [(k, line) for k, line in enumerate(lines[head + 2 :], head + 3) if line.strip()]
    try:
        if not body or len(body[-1][1].split()) != len(titles):
            raise ValueError("cut short")
        values = np.loadtxt([line for _, line in body], usecols=columns, ndmin=2, comments=None)
    except ValueError:
        values = _numbers(path, titles, columns, body)
    units += [""] * (len(titles) - len(units))
    return Table(titles, [unit.strip("()") for unit in units], values.reshape(-1, len(columns)))


def _numbers(
    path: Path, titles: list[str], columns: list[int], body: list[tuple[int, str]]
) -> Array:
    """Values (samples, n) of lines of text; InputError names the line that is wrong."""
    values = []
    for k, line in body:
        words = line.split()
        if len(words) != len(titles):
            problem = f"has {len(words)} numbers under {len(titles)} names"
            raise InputError(str(path), f"line {k}", problem, CUT_SHORT)
        places = [(words[c], f"line {k}, {titles[c]}") for c in columns]
        values.append([number_in(word, ".", str(path), place) for word, place in places])
    return np.array(values).reshape(-1, len(columns))


class _Bytes:
    """A binary file read sequentially; InputError where it ends too early."""

    def __init__(self, path: Path) -> None:
        self.path, self.content, self.at = path, read_bytes(path, WHAT, MOST), 0

    def take(self, form: str, count: int = 1) -> Array:
        """``count`` little-endian numbers: h, i, f or d of ``struct``."""
        return np.frombuffer(self.text(count * struct.calcsize(form)), f"<{form}")

    def require(self, size: int) -> None:
        """InputError where fewer bytes are left."""
        if not 0 <= size <= len(self.content) - self.at:
            problem = f"ends after {len(self.content)} bytes, and needs {self.at + size}"
            raise InputError(str(self.path), WHAT, problem, CUT_SHORT)

    def text(self, size: int) -> bytes:
        """``size`` bytes."""
        self.require(size)
        self.at += size
        return self.content[self.at - size : self.at]


def _binary(path: Path, names: Sequence[str]) -> Table:
    """Channels of an OpenFAST binary file (.outb), whose first int16 is its form:

    1 packed times and channels; 2 packed channels at equal steps; 3 the same in float64, not
    packed; 4 as 2 with the length of names. Packed values are value = (int − offset) / slope.
    """
    file = _Bytes(path)
    form = int(file.take("h")[0])
    if form not in (1, 2, 3, 4):
        problem = f"begins with {form}, which is no form of .outb"
        raise InputError(str(path), WHAT, problem, "give an output file of OpenFAST")
    length = int(file.take("h")[0]) if form == 4 else 10
    channels, samples = (int(n) for n in file.take("i", 2))
    first, second = (float(x) for x in file.take("d", 2))
    if channels < 1 or samples < 1 or length < 1:
        problem = f"has {channels} channels of {samples} samples"
        raise InputError(str(path), WHAT, problem, "give a whole output file of OpenFAST")
    packed_type = "d" if form == 3 else "h"
    file.require(samples * channels * struct.calcsize(packed_type))
    slopes, offsets = np.ones(channels), np.zeros(channels)
    if form != 3:
        slopes, offsets = (file.take("f", channels).astype(float) for _ in range(2))
    file.text(int(file.take("i")[0]))  # a description
    texts = [
        [_printable(file.text(length).decode("latin-1")) for _ in range(channels + 1)]
        for _ in range(2)
    ]
    titles, units = texts[0], [unit.strip("()") for unit in texts[1]]
    columns = _columns(path, titles, names)
    times = first + second * np.arange(samples)
    if form == 1:
        with np.errstate(divide="ignore", invalid="ignore"):
            times = (file.take("i", samples) - second) / first
    packed = file.take(packed_type, samples * channels).reshape(samples, channels)
    values = np.empty((samples, len(columns)))
    for k, column in enumerate(columns):
        values[:, k] = times
        if column:
            with np.errstate(divide="ignore", invalid="ignore"):  # infinite values are refused
                values[:, k] = (packed[:, column - 1] - offsets[column - 1]) / slopes[column - 1]
    return Table(titles, units, values)


def _csv(path: Path, names: Sequence[str]) -> Table:
    """CSV file: titles "NAME (unit)", "NAME [unit]" or name_unit, or units in the second row."""
    header, rows, separator = read_cells(path, WHAT)
    split = [match.groups() if (match := _TITLE.fullmatch(t)) else (t, "") for t in header]
    titles, units = ([_printable(pair[k]) for pair in split] for k in range(2))
    columns = _columns(path, titles, names)
    values: list[list[float]] = []
    for number, row in rows:
        require_titles(row, header, str(path), number)
        cells = [row[c].strip() if c < len(row) else "" for c in columns]
        if not values and all(cell[:1] in "([" for cell in cells if cell):
            units = [cell.strip(" ()[]") for cell in row] + [""] * len(header)
            continue
        places = [f"line {number}, {titles[c]}" for c in columns]
        values.append(
            [number_in(x, separator, str(path), p) for x, p in zip(cells, places, strict=True)]
        )
    return Table(titles, units, np.array(values).reshape(-1, len(columns)))


def _netcdf(path: Path, names: Sequence[str]) -> Table:
    """netCDF file: variables over one dimension with units as attributes."""
    import h5py  # both take half a second to load
    import xarray as xr

    content = read_bytes(path, WHAT, MOST)
    try:
        if content.startswith(b"\x89HDF"):
            h5py.File(path).close()  # where it fails, xarray leaves a file behind that complains
        with xr.open_dataset(path, decode_times=False) as data:
            titles = [str(name) for name in data.variables]
            _columns(path, titles, names)
            columns = [data.variables[name] for name in names]
            shapes = {column.shape for column in columns}
            if len(shapes) > 1 or columns[0].ndim != 1:
                problem = f"are of shapes {', '.join(map(str, sorted(shapes)))}"
                raise InputError(str(path), ", ".join(names), problem, "give one value a time")
            units = [str(data.variables[name].attrs.get("units", "")) for name in titles]
            return Table(titles, units, np.column_stack([np.asarray(c, float) for c in columns]))
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RuntimeError) as fault:
        problem = f"is no netCDF file: {str(fault).splitlines()[0] if str(fault) else fault!r}"
        raise InputError(str(path), WHAT, problem, "give it whole") from None


READERS = {".out": _text, ".outb": _binary, ".csv": _csv, ".nc": _netcdf}


RPM = Quantity("speed")
LOADS = (*(f"force_{axis}_n" for axis in AXES), *(f"moment_{axis}_nm" for axis in AXES))


def table_of_bins(bins: Sequence[LoadBin], ports: Sequence[str]) -> str:
    """CSV text with a row for each bin; ports: members of inputs and output. Speed and torque are
    those of the first input, and of the others where there are more than two ports. Constant loads
    have columns under their members; histories stay in the case."""
    others = ports[1:] if len(ports) > 2 else ()
    loads = [
        {load.member: load for load in load_bin.loads if not load.is_history} for load_bin in bins
    ]
    loaded = list(dict.fromkeys(member for by_member in loads for member in by_member))
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    head = ["name", "hours", "extreme", "back_driven", "speed_rpm", "torque_nm"]
    head += [f"{port}.{key}" for port in others for key in ("speed_rpm", "torque_nm")]
    for member in loaded:
        before = "" if member == ports[0] else f"{member}."
        head += [f"{before}{key}" for key in _keys(member, ports)] + [f"{before}frame"]
    rows.writerow(head)
    for load_bin, by_member in zip(bins, loads, strict=True):
        row = [load_bin.name, "" if load_bin.extreme else _number_text(load_bin.hours)]
        row += [str(int(load_bin.extreme)), str(int(load_bin.back_driven))]
        for port in (ports[0], *others):
            row += [
                _number_text(RPM.from_si(load_bin.speed[port], "rpm")),
                _number_text(load_bin.torque[port]),
            ]
        for member in loaded:
            keys = _keys(member, ports)
            load = by_member.get(member)
            row += ["0"] * len(keys) if load is None else [
                _number_text(load.first[LOADS.index(key)]) for key in keys
            ]  # fmt: skip
            row.append("fixed" if load is None else load.frame)
        rows.writerow(row)
    return text.getvalue()


def _keys(member: str, ports: Sequence[str]) -> list[str]:
    """Components of a load on a member; about the axis of a port it is its torque."""
    return [key for key in LOADS if key != "moment_z_nm" or member not in ports]


def _number_text(value: float) -> str:
    return f"{value:.15g}"
