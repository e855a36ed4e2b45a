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

import numpy as np
import xarray as xr

from flexgear.files.atomic import PathLike, write_bytes
from flexgear.model.errors import FlexgearError
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


def write_netcdf(
    data: xr.Dataset, path: PathLike, encoding: dict[str, dict[str, Any]] | None = None
) -> Path:
    """Write netCDF as ``save`` does, stored as said."""
    content = data.to_netcdf(engine="h5netcdf", encoding=encoding)
    # given up before a failed write is told: its traceback would keep the view, and Python 3.12 may
    # crash over a buffer that is collected before its views
    with memoryview(content) if isinstance(content, bytes) else content as held:
        return write_bytes(path, held)


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
    with readable(path):
        return xr.load_dataset(path, engine="h5netcdf")


@contextlib.contextmanager
def readable(path: PathLike) -> Iterator[None]:
    """One clear line where the block cannot read a dataset."""
    if not Path(path).is_file():
        raise FlexgearError(f"cannot read {path}: there is no such file")
    try:
        yield
    except (OSError, ValueError) as error:
        line = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FlexgearError(
            f"cannot read {path}: not a netCDF file of flexgear ({line})"
        ) from error
