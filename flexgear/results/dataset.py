"""Labelled datasets, saved with the parameters that made them.

`save` and `load` go through netCDF (HDF5). Angles and times are kept in double precision; arrays
with more than one axis are stored in single precision (1e-7 of the value) and compressed.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import xarray as xr

from flexgear.files.atomic import PathLike, atomic_file
from flexgear.model.errors import FlexgearError
from flexgear.results.netcdf import Encoding, NewFile, read
from flexgear.results.version import version


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


def write_netcdf(data: xr.Dataset, path: PathLike, encoding: Encoding | None = None) -> Path:
    """Write a dataset to a netCDF file, which appears whole or not at all. encoding: how each
    variable is stored, uncompressed in its own precision if left out."""
    with atomic_file(path) as draft:
        NewFile(draft, data, encoding or {}, {}).close()
    return Path(path)


def encoding_of(data: xr.Dataset) -> Encoding:
    """How variables are stored: compressed, with more than one axis in single precision."""
    return {
        str(name): {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        | ({"dtype": "f4"} if v.ndim > 1 and v.dtype == np.float64 else {})
        for name, v in data.data_vars.items()
        if v.ndim > 0
    }


# what h5py and xarray raise of files whose bytes are not what was written
DAMAGED = (
    OSError, ValueError, TypeError, LookupError, RuntimeError, AttributeError, MemoryError,
    ArithmeticError,
)  # fmt: skip


def load(path: PathLike) -> xr.Dataset:
    """Read a dataset into memory; one clear line where that is not possible."""
    with readable(path), h5py.File(path) as file:
        return read(file, whole=True)


@contextlib.contextmanager
def readable(path: PathLike) -> Iterator[None]:
    """One clear line where the block cannot read a dataset."""
    if not Path(path).is_file():
        raise FlexgearError(f"cannot read {path}: there is no such file")
    try:
        yield
    except DAMAGED as error:
        line = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FlexgearError(
            f"cannot read {path}: not a netCDF file of flexgear ({line})"
        ) from error
