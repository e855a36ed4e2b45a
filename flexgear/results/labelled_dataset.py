"""Labelled datasets of trains: gear meshes, groups that share a load, bodies, modes.

A *gear mesh* here is a planet against ring or sun, both flanks taken together; a *group* is the
gear meshes of all planets of a stage on one kind and side, which share its load.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.model.errors import FlexgearError
from flexgear.results.quantities import AXES, DOFS, S
from flexgear.results.result_quantities import RESULT_COORDINATES, RESULT_QUANTITIES

Labels = Mapping[str, Sequence[Any]]
DIRECTIONS = ("radial", "tangential", "axial")
BESIDE = {  # coordinates that stand beside an axis
    "flank": ("flank_stage", "flank_kind", "flank_side", "flank_planet", "flank_sense"),
    "tooth": ("tooth_stage", "tooth_side", "tooth_number", "tooth_angle"),
}


@dataclass(frozen=True)
class GearMeshName:
    """stage: name; kind: "ring" or "sun"; side: "", "left" or "right"; planet: from 1."""

    stage: str
    kind: str
    side: str
    planet: int

    @property
    def group(self) -> GroupName:
        """Those it shares the load with, and itself."""
        return GroupName(self.stage, self.kind, self.side)

    @property
    def label(self) -> str:
        """ "stage_1 ring 2", "stage sun left 1"."""
        return f"{self.group.label} {self.planet}"


@dataclass(frozen=True)
class GroupName:
    """Gear meshes of all planets of a stage, one kind and side."""

    stage: str
    kind: str
    side: str

    @property
    def label(self) -> str:
        """ "stage_1 ring", "stage sun left"."""
        return " ".join(x for x in (self.stage, self.kind, self.side) if x)


def groups_of(gear_meshes: Sequence[GearMeshName]) -> dict[GroupName, NDArray[np.int64]]:
    """Places of the gear meshes of every group with more than one planet, in their order."""
    found: dict[GroupName, list[int]] = {}
    for k, name in enumerate(gear_meshes):
        found.setdefault(name.group, []).append(k)
    return {g: np.array(at, dtype=np.int64) for g, at in found.items() if len(at) > 1}


def labelled_dataset(
    sample_dim: str,
    samples: ArrayLike,
    arrays: Mapping[str, Any],
    attrs: Mapping[str, Any],
    labels: Labels,
    gear_meshes: Sequence[GearMeshName] = (),
) -> xr.Dataset:
    """Dataset from arrays by name; see ``result_quantities`` for names, axes and units.

    labels: of axes that are neither numbered from 1 nor gear meshes and groups, which follow from
    ``gear_meshes``. FlexgearError for a variable that is not known or has wrong axes.
    """
    fixed: dict[str, Sequence[Any]] = {"dof": DOFS, "axis": AXES, "direction": DIRECTIONS}
    every = {**_gear_mesh_labels(gear_meshes), **fixed, **labels}
    variables = {name: _variable(name, sample_dim, value) for name, value in arrays.items()}
    sizes = {str(d): n for v in variables.values() for d, n in v.sizes.items() if d != sample_dim}
    coords = {sample_dim: coordinate(sample_dim, sample_dim, samples)}
    coords |= {d: coordinate(d, d, _ticks(d, n, every)) for d, n in sizes.items()}
    beside: dict[str, dict[str, Sequence[Any]]] = {
        "gear_mesh": _beside_gear_mesh(gear_meshes),
        "group": _beside_group(gear_meshes),
        **{dim: {n: labels[n] for n in names if n in labels} for dim, names in BESIDE.items()},
    }
    for dim, columns in beside.items():
        if dim in sizes:
            coords |= {n: coordinate(n, dim, v) for n, v in columns.items()}
    return xr.Dataset(variables, coords, dict(attrs))


def _gear_mesh_labels(gear_meshes: Sequence[GearMeshName]) -> dict[str, Sequence[Any]]:
    if not gear_meshes:
        return {}
    return {
        "gear_mesh": [g.label for g in gear_meshes],
        "group": [g.label for g in groups_of(gear_meshes)],
    }


def _beside_gear_mesh(gear_meshes: Sequence[GearMeshName]) -> dict[str, Sequence[Any]]:
    return {n: [getattr(g, n) for g in gear_meshes] for n in ("stage", "kind", "side", "planet")}


def _beside_group(gear_meshes: Sequence[GearMeshName]) -> dict[str, Sequence[Any]]:
    groups = groups_of(gear_meshes)
    return {f"group_{n}": [getattr(g, n) for g in groups] for n in ("stage", "kind", "side")}


def variable(name: str, value: ArrayLike, sample_dim: str = "") -> xr.Variable:
    """One variable of ``result_quantities`` with its unit, e.g. to add to a dataset."""
    return _variable(name, sample_dim, value)


def _variable(name: str, sample_dim: str, value: ArrayLike) -> xr.Variable:
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
    """One coordinate of ``result_quantities`` with its unit."""
    units, meaning = RESULT_COORDINATES[name]
    return xr.Variable((dim,), np.asarray(values), {"units": units, "long_name": meaning})


def _ticks(dim: str, size: int, labels: Labels) -> ArrayLike:
    if dim not in labels:
        if RESULT_COORDINATES[dim][0] != "1":
            raise FlexgearError(f"the labels of axis '{dim}' are missing")
        return np.arange(1, size + 1)
    if len(labels[dim]) != size:
        raise FlexgearError(f"axis '{dim}' has {size} entries but {len(labels[dim])} labels")
    return list(labels[dim])
