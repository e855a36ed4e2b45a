"""Time series of loads in OpenFAST, CSV and netCDF files; the table of load bins as CSV.

The reader of .outb files does not use openfast-io, which depends on pandas, deepdiff and YAML.
"""

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
    MAX_FE_MESH_BYTES,
    number_in,
    read_bytes,
    read_cells,
    read_text,
    require_one,
    require_titles,
)
from flexgear.model.load_cases import AXES, FACTORS, Channel
from flexgear.model.read import nearest
from flexgear.model.units import ALL_SUFFIXES, Quantity, suffix_of

_CONTENT = "load series"
_TRUNCATED = "the file is cut short: give the complete file"
_MAX_BYTES = MAX_FE_MESH_BYTES // 2
_TITLE = re.compile(r"\s*(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*")


class Table(NamedTuple):
    """Names and units of all channels of a file; values (samples, n) of the n requested ones."""

    names: list[str]
    units: list[str]
    values: Array


def read_channels(path: Path, channels: dict[str, tuple[Channel, str]]) -> dict[str, Array]:
    """SI values (samples,) by key of the requested channels, each given with its dimension.

    Raises InputError for a truncated file, a missing channel, a unit that is missing or of another
    dimension, a value that is not finite, and times that do not increase.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        problem = f"{echo(path.suffix)} is unknown"
        raise InputError(str(path), _CONTENT, problem, f"give one of {', '.join(READERS)}")
    table = reader(path, [channel.name for channel, _ in channels.values()])
    result = {}
    for k, (key, (channel, dimension)) in enumerate(channels.items()):
        unit = table.units[table.names.index(channel.name)]
        suffix = _suffix(path, key, channel, unit, dimension)
        values = channel.sign * table.values[:, k]
        wrong = np.flatnonzero(~np.isfinite(values))
        if len(wrong):
            more = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
            problem = f"sample {wrong[0] + 1} is {values[wrong[0]]}{more}"
            raise InputError(str(path), channel.name, problem, "run the simulation again")
        result[key] = Quantity(dimension).to_si(1.0, suffix) * values
    if len(result["time"]) < 2 or np.any(np.diff(result["time"]) <= 0.0):
        problem = f"has {len(result['time'])} samples, or times that do not increase"
        raise InputError(str(path), channels["time"][0].name, problem, "give a whole series")
    return result


def _suffix(path: Path, key: str, channel: Channel, unit: str, dimension: str) -> str:
    """Suffix of a channel's unit, from the file or, if it states none, from the case. Raises
    InputError if the unit is missing, of another dimension, or differs between the two."""
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
    """Indices of the requested channels in a file; InputError for a channel that is missing."""
    if not names:
        raise InputError(str(path), _CONTENT, "is empty", "give a whole series")
    for name in wanted_names:
        if name not in names:
            raise InputError(str(path), name, "is not in the file", nearest(name, list(names)))
    return [list(names).index(name) for name in wanted_names]


def _printable(name: str) -> str:
    """A name without padding (blanks, NUL bytes); question marks replace unprintable characters."""
    return "".join(sign if sign.isprintable() else "?" for sign in name.strip(" \0"))


def _text(path: Path, names: Sequence[str]) -> Table:
    """Channels of an OpenFAST text file. The file has description lines, a line of names that
    begins with Time, a line of units, and one line for each sample."""
    text = read_text(path, _CONTENT, _MAX_BYTES)
    lines = text.splitlines()
    before, last = (len((line.split() or [""])[-1].lstrip("-")) for line in ["", "", *lines][-2:])
    if not text.endswith("\n") and last < before:  # all numbers of a column have equal width
        raise InputError(str(path), f"line {len(lines)}", "ends within a number", _TRUNCATED)
    head = next((k for k, line in enumerate(lines) if line.lower().split()[:1] == ["time"]), None)
    if head is None or head + 2 > len(lines):
        problem = "has no line of names that begins with Time, with units below"
        raise InputError(str(path), _CONTENT, problem, "give a whole output file of OpenFAST")
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
    """Values (samples, n) of numbered lines of text; InputError names the line that is wrong."""
    values = []
    for k, line in body:
        words = line.split()
        if len(words) != len(titles):
            problem = f"has {len(words)} numbers under {len(titles)} names"
            raise InputError(str(path), f"line {k}", problem, _TRUNCATED)
        places = [(words[c], f"line {k}, {titles[c]}") for c in columns]
        values.append([number_in(word, ".", str(path), place) for word, place in places])
    return np.array(values).reshape(-1, len(columns))


class _Bytes:
    """A binary file that is read sequentially; InputError if it ends too early."""

    def __init__(self, path: Path) -> None:
        self.path, self.content, self.position = path, read_bytes(path, _CONTENT, _MAX_BYTES), 0

    def take(self, form: str, count: int = 1) -> Array:
        """The next ``count`` little-endian numbers of format h, i, f or d of ``struct``."""
        return np.frombuffer(self.text(count * struct.calcsize(form)), f"<{form}")

    def require(self, size: int) -> None:
        """Raise InputError if fewer than ``size`` bytes follow."""
        if not 0 <= size <= len(self.content) - self.position:
            problem = f"ends after {len(self.content)} bytes, and needs {self.position + size}"
            raise InputError(str(self.path), _CONTENT, problem, _TRUNCATED)

    def text(self, size: int) -> bytes:
        """The next ``size`` bytes."""
        self.require(size)
        self.position += size
        return self.content[self.position - size : self.position]


def _binary(path: Path, names: Sequence[str]) -> Table:
    """Channels of an OpenFAST binary file (.outb), whose first int16 is the version of its format:

    1 has packed times and channels, 2 packed channels at equal time steps, 3 float64 channels at
    equal time steps, 4 as 2 with the length of names. Packed values are
    value = (int − offset) / slope.
    """
    file = _Bytes(path)
    form = int(file.take("h")[0])
    if form not in (1, 2, 3, 4):
        problem = f"begins with {form}, which is no form of .outb"
        raise InputError(str(path), _CONTENT, problem, "give an output file of OpenFAST")
    length = int(file.take("h")[0]) if form == 4 else 10
    channels, samples = (int(n) for n in file.take("i", 2))
    first, second = (float(x) for x in file.take("d", 2))
    if channels < 1 or samples < 1 or length < 1:
        problem = f"has {channels} channels of {samples} samples"
        raise InputError(str(path), _CONTENT, problem, "give a whole output file of OpenFAST")
    packed_type = "d" if form == 3 else "h"
    file.require(samples * channels * struct.calcsize(packed_type))
    slopes, offsets = np.ones(channels), np.zeros(channels)
    if form != 3:
        slopes, offsets = (file.take("f", channels).astype(float) for _ in range(2))
    file.text(int(file.take("i")[0]))  # skips the description
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
    """Channels of a CSV file with titles "NAME (unit)", "NAME [unit]" or name_unit, or with units
    in the second row."""
    header, rows, separator = read_cells(path, _CONTENT)
    split = [match.groups() if (match := _TITLE.fullmatch(t)) else (t, "") for t in header]
    titles, units = ([_printable(pair[k]) for pair in split] for k in range(2))
    for name in names:
        require_one([title for title in titles if title == name], str(path))
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
    """Channels of a netCDF file: variables over one dimension with units as attributes."""
    import h5py  # these imports take half a second
    import xarray as xr

    content = read_bytes(path, _CONTENT, _MAX_BYTES)
    try:
        if content.startswith(b"\x89HDF"):
            h5py.File(path).close()  # raises here for a damaged file, which xarray leaves open
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
        raise InputError(str(path), _CONTENT, problem, "give it whole") from None


READERS = {".out": _text, ".outb": _binary, ".csv": _csv, ".nc": _netcdf}


_SPEED = Quantity("speed")
_LOADS = (*(f"force_{axis}_n" for axis in AXES), *(f"moment_{axis}_nm" for axis in AXES))


def table_of_bins(bins: Sequence[LoadBin], ports: Sequence[str]) -> str:
    """CSV text with a row for each load bin.

    ports: members of the inputs and the output. Speed and torque columns are those of the first
    input, and also of the other ports if there are more than two. Constant loads have columns with
    the name of their member, load factors with stage and kind of their gear meshes, empty where a
    bin has none; loads that vary with time are not written.
    """
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
    factors = [_factors(load_bin) for load_bin in bins]
    head += (stated := list(dict.fromkeys(title for of_bin in factors for title in of_bin)))
    rows.writerow(head)
    for load_bin, by_member, of_bin in zip(bins, loads, factors, strict=True):
        row = [load_bin.name, "" if load_bin.extreme else _number_text(load_bin.hours)]
        row += [str(int(load_bin.extreme)), str(int(load_bin.back_driven))]
        for port in (ports[0], *others):
            row += [
                _number_text(_SPEED.from_si(load_bin.speed[port], "rpm")),
                _number_text(load_bin.torque[port]),
            ]
        for member in loaded:
            keys = _keys(member, ports)
            load = by_member.get(member)
            row += ["0"] * len(keys) if load is None else [
                _number_text(load.first[_LOADS.index(key)]) for key in keys
            ]  # fmt: skip
            row.append("fixed" if load is None else load.frame)
        rows.writerow([*row, *(of_bin.get(title, "") for title in stated)])
    return text.getvalue()


def _factors(load_bin: LoadBin) -> dict[str, str]:
    """Load factors of a bin by the titles of their columns, such as "stage_1.ring.k_h_beta"."""
    return {
        ".".join(filter(None, (some.stage, some.kind, key))): _number_text(value)
        for some in load_bin.factors
        for key in FACTORS
        if (value := getattr(some, key)) is not None
    }


def _keys(member: str, ports: Sequence[str]) -> list[str]:
    """Columns of a load on a member; the moment about the axis of a port is the port's torque."""
    return [key for key in _LOADS if key != "moment_z_nm" or member not in ports]


def _number_text(value: float) -> str:
    return f"{value:.15g}"
