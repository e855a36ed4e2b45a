"""Labelled datasets in netCDF files, with the parameters of their computation.

Angles and times are stored in double precision, other arrays with more than one axis in single
precision (1e-7 of the value) and compressed. A `DatasetFile` is written sample by sample: it is
created with all labels, units, encodings and its final size, and its content is that of `save` for
the whole dataset.
"""

from __future__ import annotations

import contextlib
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from flexgear.files.atomic import PathLike, atomic_file
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.input_file import MAX_DATASET_BYTES, require_regular
from flexgear.model.units import size_text
from flexgear.results.netcdf import Encoding, NewFile, read
from flexgear.results.sinks import (
    CLOCKS,
    SENSOR_TIME,
    DatasetSink,
    MemorySink,
    RunSize,
    as_stored,
    histories,
    is_single,
    sample_size,
)
from flexgear.results.version import version


def provenance(case: Case, variant: str, **more: Any) -> dict[str, Any]:
    """Attributes of a result: case, variant, version, content hash, all parameters, ``more``."""
    text = json.dumps(case.to_dict(), sort_keys=True, ensure_ascii=False)
    return {
        "title": f"flexgear {case.name}, {variant}",
        "case": case.name,
        "variant": variant,
        "version": version(),
        "content_hash": case.content_hash(),
        # names of files may hold bytes that are no UTF-8
        "parameters": text.encode(errors="backslashreplace").decode(),
        **more,
    }


def save(data: xr.Dataset, path: PathLike) -> Path:
    """Write a dataset to a netCDF file, compressed; the file appears complete or not at all."""
    return write_netcdf(data, path, encoding_of(data))


def write_netcdf(data: xr.Dataset, path: PathLike, encoding: Encoding | None = None) -> Path:
    """Write a dataset to a netCDF file, which appears complete or not at all. encoding: storage of
    each variable, by default uncompressed in the variable's precision."""
    with atomic_file(path) as draft:
        NewFile(draft, data, encoding or {}, {}).close()
    return Path(path)


def encoding_of(data: xr.Dataset) -> Encoding:
    """Encoding of variables: compressed, single precision where ``is_single``."""
    return {
        str(name): {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        | ({"dtype": "f4"} if is_single(v) else {})
        for name, v in ((n, data.variables[n]) for n in data.data_vars)
        if v.ndim > 0
    }


# exceptions of h5py and xarray for damaged files
DAMAGED = (
    OSError, ValueError, TypeError, LookupError, RuntimeError, AttributeError, MemoryError,
    ArithmeticError,
)  # fmt: skip


def load(path: PathLike) -> xr.Dataset:
    """Read a dataset into memory; InputError if it cannot be read."""
    with readable(path), h5py.File(path) as file:
        return read(file, whole=True)


@contextlib.contextmanager
def readable(path: PathLike) -> Iterator[None]:
    """Context in which a dataset that cannot be read raises InputError."""
    require_regular(Path(path), "dataset", MAX_DATASET_BYTES)
    try:
        yield
    except DAMAGED as error:
        line = str(error).splitlines()[0] if str(error) else type(error).__name__
        problem = f"is not a netCDF file of flexgear ({line})"
        raise InputError(str(path), "dataset", problem, "name a result of flexgear") from error


_CHUNK_BYTES = 2**18  # that are compressed together
_PAIR_AXIS = "slot"  # axis of tooth pairs, mostly empty, so that compression is effective
MAX_IN_MEMORY = 2**25  # bytes of a file that is read into memory


@contextlib.contextmanager
def dataset_file(
    path: PathLike, names: Sequence[str] = (), *, in_memory: int = 0
) -> Iterator[DatasetFile]:
    """A sink that writes ``path``, which appears when the block ends without error.

    names: variables over time that are written, all if empty. in_memory: bytes up to which samples
    are also kept in memory, for ``DatasetFile.dataset``.
    """
    with atomic_file(path) as draft:
        file = DatasetFile(draft, names, in_memory)
        try:
            yield file
        finally:
            file.close()


def reopened(path: PathLike) -> xr.Dataset:
    """A dataset read into memory, or lazily if the file is large."""
    with readable(path):
        is_large = Path(path).stat().st_size > MAX_IN_MEMORY
    return open_lazily(path) if is_large else load(path)


def open_lazily(path: PathLike) -> xr.Dataset:
    """A dataset whose labels and times are in memory; other variables are read when accessed."""
    with readable(path):
        return read(h5py.File(path), whole=False)


class DatasetFile(DatasetSink):
    """A sink that writes samples to netCDF as they are computed."""

    def __init__(self, path: Path, names: Sequence[str] = (), in_memory: int = 0) -> None:
        self._path, self._names, self._in_memory = path, tuple(names), in_memory
        self._file: NewFile | None = None
        self._memory: MemorySink | None = None  # a copy of small datasets
        self._samples = dict.fromkeys(CLOCKS, 0)

    def dataset(self, path: PathLike) -> xr.Dataset:
        """The written dataset, from memory if it is small, else from the file, now at ``path``."""
        return open_lazily(path) if self._memory is None else self._memory.data

    def begin(self, run_size: RunSize) -> None:
        """Create the file without samples; InputError for unknown names or a full disk."""
        pattern = chosen(run_size.pattern, self._names)
        run_size = replace(run_size, pattern=pattern)
        self._refuse_too_much(run_size)
        counts = {clock: n for clock, n in run_size.counts.items() if clock in pattern.dims}
        encoding = dict(encoding_of(pattern))
        for clock, count in counts.items():
            for name, variable in histories(pattern, clock).items():
                if sample_size(variable, clock):  # 0 without planets or supports
                    stored = encoding.get(name, {})
                    encoding[name] = _in_chunks(variable, clock, count, stored)
        self._file = NewFile(self._path, pattern, encoding, counts)
        if run_size.size <= self._in_memory:
            self._memory = MemorySink(as_stored)
            self._memory.begin(run_size)

    def append(self, data: xr.Dataset) -> None:
        """Write the next samples."""
        assert self._file is not None
        data = as_stored(chosen(data, self._names))
        for clock, before in self._samples.items():
            self._samples[clock] = stop = before + data.sizes.get(clock, 0)
            for name, variable in histories(data, clock).items() if stop > before else ():
                self._file.put(name, variable.to_numpy(), slice(before, stop))
        if self._memory is not None:
            self._memory.append(data)

    def finish(self, last: xr.Dataset) -> None:
        """Write variables and attributes that are known only after the last sample."""
        assert self._file is not None
        for name, variable in last.data_vars.items():
            self._file.put(str(name), variable.to_numpy())
        self._file.set_attributes(last.attrs)
        if self._memory is not None:
            self._memory.finish(last)
        self.close()

    def close(self) -> None:
        """Close the file if it is open."""
        if self._file is not None:
            file, self._file = self._file, None
            file.close()

    def _refuse_too_much(self, run_size: RunSize) -> None:
        free = shutil.disk_usage(self._path.parent).free
        if run_size.size > free:
            raise InputError(
                "--out", f"{run_size.samples} samples",
                f"take {size_text(run_size.size)}, and {size_text(free)} are free",
                "save less often (solver.output_interval_ms), fewer signals (--save), or shorter",
            )  # fmt: skip


def _in_chunks(
    variable: xr.Variable, clock: str, count: int, stored: Mapping[str, Any]
) -> dict[str, Any]:
    """Encoding of a variable of ``count`` samples, with chunks along ``clock``."""
    rows = max(1, min(count, _CHUNK_BYTES // sample_size(variable, clock)))
    shape = tuple(rows if d == clock else n for d, n in variable.sizes.items())
    if variable.dtype == np.float64 and _PAIR_AXIS not in variable.dims:
        # compression saves a quarter of motions and forces, but triples the time of writing
        stored = {"dtype": stored["dtype"]} if "dtype" in stored else {}
    return {**stored, "chunks": shape}


def chosen(data: xr.Dataset, names: Sequence[str]) -> xr.Dataset:
    """The dataset with only these variables over time (all if empty); InputError for others."""
    every = {**histories(data), **histories(data, SENSOR_TIME)}
    over_time = [n for n in every if n in data.data_vars]
    for name in names:
        if name not in over_time:
            remedy = f"choose from {', '.join(over_time)}"
            raise InputError("--save", name, "is not saved by this run", remedy)
    dropped = [n for n in over_time if names and n not in names]
    return data[[n for n in data.data_vars if n not in dropped]]
