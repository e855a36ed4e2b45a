"""The part of a dataset that belongs to one stage.

Variables and axes keep names, units and meanings; what lies in a file stays there until it is read.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.model.names import BodyName, MemberName
from flexgear.results.load_sharing import planet_force_spread
from flexgear.results.quantities import RESULT_COORDINATES

OTHER = {"left": "right", "right": "left"}


def stage_part(data: xr.Dataset, stage: str, half: str = "left") -> xr.Dataset:
    """The part of ``data`` that belongs to a stage, of a double-helical one that of a half, "left"
    or "right", or of both, "".

    Of every axis whose entries are of stages (``RESULT_COORDINATES`` says so), it has those of the
    stage and those of none, as joints are; ``turning_stage`` is no axis any more.
    """
    part = data.sel(turning_stage=stage) if "turning_stage" in data.dims else data
    there = {
        dim: _of_stage(data[dim], stage)
        for dim, declared in RESULT_COORDINATES.items()
        if declared.stage == "name" and dim in data.dims
    }
    for dim, name in _beside(data, "stage").items():
        there[dim] = data[name].to_numpy() == stage
    for dim, name in _beside(data, "side").items():
        there[dim] &= data[name].to_numpy() != OTHER.get(half)
    return part.isel({dim: np.flatnonzero(entries) for dim, entries in there.items()})


def of_kind(data: xr.Dataset, kind: str) -> xr.Dataset:
    """Of gear meshes, flanks and groups those of a kind, "ring" or "sun"."""
    kinds = {dim: data[name].to_numpy() == kind for dim, name in _beside(data, "kind").items()}
    return data.isel({dim: np.flatnonzero(there) for dim, there in kinds.items()})


def displacement_of(part: xr.Dataset, body: str) -> xr.DataArray:
    """Motion of the planets, (sample, body, dof), or of the sun or another body of which a stage
    has one, (sample, dof), of the part of a stage."""
    names = [BodyName.parse(n) for n in part["body"].to_numpy()]
    bodies = part["body_displacement"].isel(body=[n.part == body for n in names])
    return bodies if body == "planet" else bodies.squeeze("body", drop=True)


def ring_sharing(part: xr.Dataset) -> xr.DataArray:
    """Load sharing factor (sample,) of the ring's gear meshes, of the part of a stage and half."""
    return of_kind(part, "ring")["load_sharing"].squeeze("group", drop=True)


def ring_force_spread(part: xr.Dataset) -> xr.DataArray:
    """(max F − min F) / rated mean F (sample,) of the ring's gear meshes, of the part of a
    stage."""
    ring = of_kind(part, "ring")
    force = ring["gear_mesh_force"]
    spread = planet_force_spread(force.to_numpy(), float(ring["rated_gear_mesh_force"].mean()))
    return force.isel(gear_mesh=0, drop=True).copy(deep=False, data=spread)


def halves(data: xr.Dataset, stage: str) -> list[str]:
    """Halves of a stage; "left" alone of one that is not double-helical."""
    sides = data["side"].to_numpy()[data["stage"].to_numpy() == stage]
    return ["left", "right"] if "right" in sides else ["left"]


def _beside(data: xr.Dataset, field: str) -> dict[str, str]:
    """By axis the coordinate that says a field of its entries: "stage", "kind" or "side"."""
    names = {
        dim: declared.stage.replace("stage", field)
        for dim, declared in RESULT_COORDINATES.items()
        if declared.stage not in ("", "name") and dim in data.dims
    }
    return {dim: name for dim, name in names.items() if name in data.coords}


def _of_stage(labels: xr.DataArray, stage: str) -> NDArray[np.bool_]:
    """Which labels, names of members, are of a stage or of none."""
    names = [MemberName.parse(str(label)) for label in labels.to_numpy()]
    return np.array([name.stage == stage or not name.part for name in names], dtype=bool)
