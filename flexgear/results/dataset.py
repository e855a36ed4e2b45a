"""Labelled datasets from plain arrays, saved with the parameters that made them.

`labelled` checks every array against `quantities` and gives it names, units and coordinates;
`save` and `load` go through netCDF (HDF5). Angles and times are kept in double precision; arrays
with more than one axis are stored in single precision (1e-7 of the value) and compressed.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexgear.model.errors import FlexgearError
from flexgear.files.atomic import PathLike, write_bytes
from flexgear.results.load_sharing import load_sharing, planet_force_spread
from flexgear.results.quantities import AXES, COORDINATES, DOFS, QUANTITIES, S
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


def transient_dataset(
    *,
    time: ArrayLike,
    attrs: Mapping[str, Any],
    rated_mean_force: float | None = None,
    **arrays: Any,
) -> xr.Dataset:
    """A transient: every keyword is a variable of `quantities` with time (nt,) s as first axis."""
    return labelled("time", np.asarray(time, dtype=float), arrays, attrs, rated_mean_force)


def equilibrium_dataset(
    *, attrs: Mapping[str, Any], rated_mean_force: float | None = None, **arrays: Any
) -> xr.Dataset:
    """Equilibria over positions: the same variables with the position as first axis."""
    if "carrier_angle" not in arrays:
        raise FlexgearError("a dataset of equilibria needs carrier_angle")
    count = np.size(arrays["carrier_angle"])
    return labelled("position", np.arange(count), arrays, attrs, rated_mean_force)


def labelled(
    sample_dim: str,
    samples: ArrayLike,
    arrays: Mapping[str, Any],
    attrs: Mapping[str, Any],
    rated_mean_force: float | None = None,
) -> xr.Dataset:
    """Dataset from arrays by name; see `quantities` for names, axes and units.

    carrier_node and bearing: labels (str) in the order of their axis, where those axes occur;
    tooth_angle, planet_angle: coordinates in rad. With rated_mean_force (N per planet) the load
    sharing factor and the force spread of the ring gear meshes are added.
    """
    arrays = dict(arrays)
    labels: dict[str, list[str]] = {
        k: list(arrays.pop(k)) for k in ("carrier_node", "bearing") if k in arrays
    }
    angles: dict[str, Any] = {
        k: np.asarray(arrays.pop(k), dtype=float)
        for k in ("tooth_angle", "planet_angle")
        if k in arrays
    }
    data = xr.Dataset(
        {name: _variable(name, sample_dim, value) for name, value in arrays.items()},
        coords={sample_dim: _coordinate(sample_dim, (sample_dim,), samples)},
        attrs=dict(attrs),
    )
    axes = {str(d): n for d, n in data.sizes.items() if d != sample_dim}
    data = data.assign_coords(
        {d: _coordinate(d, (d,), _ticks(d, n, labels)) for d, n in axes.items()}
    )
    for angle, values in angles.items():
        of = angle.removesuffix("_angle")
        data = data.assign_coords({angle: _coordinate(angle, (of,), values)})
    if rated_mean_force is not None and "ring_gear_mesh_force" in data:
        force = data["ring_gear_mesh_force"].to_numpy()
        for name, value in (
            ("load_sharing", load_sharing(force, rated_mean_force)),
            ("planet_force_spread", planet_force_spread(force, rated_mean_force)),
        ):
            data[name] = _variable(name, sample_dim, value)
        data.attrs["rated_mean_force_n"] = float(rated_mean_force)
    return data


def _variable(name: str, sample_dim: str, value: ArrayLike) -> xr.Variable:
    if name not in QUANTITIES:
        raise FlexgearError(f"'{name}' is not a variable of results; see results/quantities.py")
    quantity, array = QUANTITIES[name], np.asarray(value)
    dims = tuple(sample_dim if d == S else d for d in quantity.dims)
    if array.ndim != len(dims):
        raise FlexgearError(
            f"'{name}' has {array.ndim} axes {array.shape}, it needs {len(dims)}: {', '.join(dims)}"
        )
    return xr.Variable(dims, array, quantity.attrs)


def _coordinate(name: str, dims: tuple[str, ...], values: ArrayLike) -> xr.Variable:
    units, meaning = COORDINATES[name]
    return xr.Variable(dims, np.asarray(values), {"units": units, "long_name": meaning})


def _ticks(dim: str, size: int, labels: Mapping[str, Sequence[str]]) -> ArrayLike:
    names: Sequence[str] | None = {"axis": AXES, "dof": DOFS, **labels}.get(dim)
    if names is None:
        if dim in ("carrier_node", "bearing"):
            raise FlexgearError(f"the labels of axis '{dim}' are missing: pass {dim}=[...]")
        return np.arange(1, size + 1)
    if len(names) != size:
        raise FlexgearError(f"axis '{dim}' has {size} entries but {len(names)} labels")
    return list(names)


def save(data: xr.Dataset, path: PathLike) -> Path:
    """Write netCDF; the file appears whole or not at all."""
    return write_bytes(path, data.to_netcdf(engine="h5netcdf", encoding=encoding_of(data)))


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
