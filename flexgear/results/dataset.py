"""Labelled datasets, saved with the parameters that made them.

`save` and `load` go through netCDF (HDF5), whose library may be called by one thread at a time: what
writes or opens a file holds `FILES`. Angles and times are kept in double precision; arrays
with more than one axis are stored in single precision (1e-7 of the value) and compressed.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import sys
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import netCDF4
import numpy as np
import xarray as xr

from flexgear.files.atomic import PathLike, atomic_file
from flexgear.model.errors import FlexgearError
from flexgear.results.version import version

FILES = threading.RLock()


def provenance(
    *, case: str, variant: str, content_hash: str, parameters: Mapping[str, Any], **more: Any
) -> dict[str, Any]:
    """Attributes every result carries: case, variant, version, content hash, all parameters."""
    return {
        "title": f"flexgear {case}, {variant}",
        "case": case,
        "variant": variant,
        "version": version(),
        "content_hash": content_hash,
        "parameters": _utf8(json.dumps(parameters, sort_keys=True, ensure_ascii=False)),
        **more,
    }


def _utf8(text: str) -> str:
    """JSON with names of files that are no UTF-8 as it escapes them."""
    return text.encode(errors="backslashreplace").decode()


def save(data: xr.Dataset, path: PathLike) -> Path:
    """Write netCDF; the file appears whole or not at all."""
    return write_netcdf(data, path, encoding_of(data))


def write_netcdf(
    data: xr.Dataset, path: PathLike, encoding: dict[str, dict[str, Any]] | None = None
) -> Path:
    """Write netCDF as ``save`` does, stored as said."""
    with atomic_file(path) as draft, FILES, system_errors():
        file = opened(draft, "w")
        try:
            data.dump_to_store(xr.backends.NetCDF4DataStore(file), encoding=encoding)
        finally:
            file.close()
    return Path(path)


def encoding_of(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """How variables are stored: compressed, with more than one axis in single precision."""
    return {
        str(name): {"zlib": True, "complevel": 1, "shuffle": True}
        | ({"dtype": "float32"} if v.ndim > 1 and v.dtype == np.float64 else {})
        for name, v in data.data_vars.items()
        if v.ndim > 0
    }


def load(path: PathLike) -> xr.Dataset:
    """Read a dataset into memory; one clear line where that is not possible."""
    with readable(path), FILES, opened(path) as file:
        return xr.open_dataset(xr.backends.NetCDF4DataStore(file)).load()


def opened(path: PathLike, mode: Literal["r", "w"] = "r") -> netCDF4.Dataset:
    """The file as the library has it, which knows no names that are no text."""
    name = os.fspath(path)
    if name.isprintable() or sys.platform != "linux":
        return netCDF4.Dataset(name, mode)
    handle = os.open(path, os.O_RDONLY if mode == "r" else os.O_RDWR | os.O_CREAT, 0o666)
    try:
        return netCDF4.Dataset(f"/proc/self/fd/{handle}", mode)
    finally:
        os.close(handle)


@contextlib.contextmanager
def system_errors() -> Iterator[None]:
    """OSError where the library cannot write, of which it says no reason."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(errno.EIO, f"the disk refused to be written ({error})") from error


@contextlib.contextmanager
def readable(path: PathLike) -> Iterator[None]:
    """One clear line where the block cannot read a dataset."""
    if not Path(path).is_file():
        raise FlexgearError(f"cannot read {path}: there is no such file")
    try:
        yield
    except (OSError, ValueError, RuntimeError) as error:
        line = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FlexgearError(
            f"cannot read {path}: not a netCDF file of flexgear ({line})"
        ) from error
