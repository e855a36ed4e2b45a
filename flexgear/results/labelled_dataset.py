"""Labelled datasets of trains.

A *gear mesh* is that of one planet with ring or sun, with both flanks. A *group* consists of the
gear meshes of all planets of a stage with the same kind and side, which share a load.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.model.errors import FlexgearError
from flexgear.model.names import GearMeshName, GroupName
from flexgear.results.quantities import AXES, DOFS, RESULT_COORDINATES, S
from flexgear.results.result_quantities import RESULT_QUANTITIES

Labels = Mapping[str, Sequence[Any]]
DIRECTIONS = ("radial", "tangential", "axial")
GROUP = ("stage", "kind", "side")  # fields of names that are coordinates of an axis
GEAR_MESH = (*GROUP, "planet")
_COORDINATES = {  # further coordinates of an axis
    "flank": ("flank_stage", "flank_kind", "flank_side", "flank_planet", "flank_sense"),
    "tooth": ("tooth_stage", "tooth_side", "tooth_number", "tooth_angle"),
    "sensor": ("sensor_quantity", "sensor_unit"),
    "static_sensor": ("static_sensor_unit",),
}


def groups_of(
    gear_meshes: Sequence[GearMeshName], least: int = 2
) -> dict[GroupName, NDArray[np.int64]]:
    """Indices of the gear meshes of each group with at least ``least`` planets."""
    groups: dict[GroupName, list[int]] = {}
    for k, name in enumerate(gear_meshes):
        groups.setdefault(name.group, []).append(k)
    return {g: np.array(at, dtype=np.int64) for g, at in groups.items() if len(at) >= least}


def groups_in(data: xr.Dataset | xr.DataArray) -> dict[GroupName, NDArray[np.int64]]:
    """Indices of the gear meshes of each group of a dataset, including groups of one planet."""
    columns = [data[n].to_numpy().tolist() for n in GEAR_MESH]
    return groups_of([GearMeshName.of(*fields) for fields in zip(*columns, strict=True)], 1)


def fields_of(
    names: Sequence[GearMeshName | GroupName], fields: Sequence[str], before: str = ""
) -> dict[str, list[Any]]:
    """Coordinates with the fields of the names of gear meshes or groups."""
    return {f"{before}{field}": [getattr(name, field) for name in names] for field in fields}


def labelled_dataset(
    sample_dim: str,
    samples: ArrayLike,
    arrays: Mapping[str, Any],
    attrs: Mapping[str, Any],
    labels: Labels,
    gear_meshes: Sequence[GearMeshName] = (),
) -> xr.Dataset:
    """Dataset from arrays by name; names, axes and units are those of ``result_quantities``.

    labels: of axes other than numbered ones, gear meshes and groups, whose labels follow from
    ``gear_meshes``. Raises FlexgearError for unknown variables and wrong axes.
    """
    fixed: dict[str, Sequence[Any]] = {"dof": DOFS, "axis": AXES, "direction": DIRECTIONS}
    groups = list(groups_of(gear_meshes))
    named = {"gear_mesh": gear_meshes, "group": groups} if gear_meshes else {}
    every = {**named, **fixed, **labels}
    variables = {name: variable(name, value, sample_dim) for name, value in arrays.items()}
    sizes = {str(d): n for v in variables.values() for d, n in v.sizes.items() if d != sample_dim}
    coords = {sample_dim: coordinate(sample_dim, sample_dim, samples)}
    coords |= {d: coordinate(d, d, _labels(d, n, every)) for d, n in sizes.items()}
    beside: dict[str, Mapping[str, Sequence[Any]]] = {
        "gear_mesh": fields_of(gear_meshes, GEAR_MESH),
        "group": fields_of(groups, GROUP, "group_"),
        **{
            dim: {n: labels[n] for n in names if n in labels} for dim, names in _COORDINATES.items()
        },
    }
    for dim, columns in beside.items():
        if dim in sizes:
            coords |= {n: coordinate(n, dim, v) for n, v in columns.items()}
    return xr.Dataset(variables, coords, dict(attrs))


def variable(name: str, value: ArrayLike, sample_dim: str = "") -> xr.Variable:
    """A variable of ``result_quantities`` with its unit; FlexgearError for wrong axes."""
    if name not in RESULT_QUANTITIES:
        raise FlexgearError(f"'{name}' is not a variable of trains; see results/result_quantities")
    quantity, array = RESULT_QUANTITIES[name], np.asarray(value)
    dims = tuple(sample_dim if d == S else d for d in quantity.dims)
    if array.ndim != len(dims):
        raise FlexgearError(
            f"'{name}' has {array.ndim} axes {array.shape}, it needs {len(dims)}: {', '.join(dims)}"
        )
    return xr.Variable(dims, array, quantity.attrs)


def coordinate(name: str, dim: str, values: ArrayLike) -> xr.Variable:
    """A coordinate of ``RESULT_COORDINATES`` with its unit."""
    declared = RESULT_COORDINATES[name]
    attrs = {"units": declared.units, "long_name": declared.meaning}
    return xr.Variable((dim,), np.asarray(values), attrs)


def _labels(dim: str, size: int, labels: Labels) -> ArrayLike:
    """Labels of an axis, by default numbers from 1."""
    if dim not in labels:
        if RESULT_COORDINATES[dim].units != "1":
            raise FlexgearError(f"the labels of axis '{dim}' are missing")
        return np.arange(1, size + 1)
    if len(labels[dim]) != size:
        raise FlexgearError(f"axis '{dim}' has {size} entries but {len(labels[dim])} labels")
    return list(labels[dim])
