"""One flexible stage out of a dataset, in the words of a single stage.

What pictures and figures of a ring with tooth nodes read: pairs by gear and flank (``ring_pair_load``
(sample, planet, slot)), motion of teeth, pins, planets and sun, forces of bolts and bearings. They
are views of variables of the dataset: what lies in a file stays there until it is read.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexgear.model.names import MemberName, NodeName
from flexgear.results.flanks import PARTS
from flexgear.results.load_sharing import planet_force_spread
from flexgear.results.result_quantities import RESULT_COORDINATES, RESULT_QUANTITIES

KINDS = ("ring", "sun")
FLANKS = (("drive", "pair"), ("coast", "coast_pair"))
OTHER = {"left": "right", "right": "left"}
AS_THEY_ARE = ("closure", "output_speed")


def stage_part(data: xr.Dataset, stage: str, half: str = "left") -> xr.Dataset:
    """The part of ``data`` that belongs to a stage whose ring is a finite-element body; of a
    double-helical one that of a half, "left" or "right".

    Variables have the units and meanings of those that they are of; what ``data`` does not hold is
    left out. Attribute
    rated_mean_force_n: of a planet at the ring.
    """
    variables = {
        name: part.variable.copy(deep=False) for name, part in _variables(data, stage, half) if part.size
    }
    dim = "time" if "time" in data.dims else "position"
    coords: dict[str, Any] = {dim: data[dim].variable}
    sizes = {str(d): n for v in variables.values() for d, n in v.sizes.items()}
    labels = _labels(data, stage)
    for d, size in sizes.items():
        if d != dim:
            ticks = labels.get(d, np.arange(1, size + 1))
            units, meaning = RESULT_COORDINATES[d]
            coords[d] = xr.Variable((d,), ticks, {"units": units, "long_name": meaning})
    if "tooth" in sizes:
        teeth = _teeth(data, stage, half)
        coords["tooth_angle"] = ("tooth", data["tooth_angle"].to_numpy()[teeth])
    attrs = dict(data.attrs)
    if "rated_gear_mesh_force" in data:
        rated = data["rated_gear_mesh_force"].to_numpy()[_gear_meshes(data, stage, "ring", half)]
        attrs["rated_mean_force_n"] = float(rated.mean())
    return xr.Dataset(variables, coords, attrs)


def with_spread(part: xr.Dataset) -> xr.Dataset:
    """The same with the spread of the planets' forces, (max F − min F) / rated mean F, which is
    worked out from them."""
    force, dim = part["ring_gear_mesh_force"], str(part["ring_gear_mesh_force"].dims[0])
    spread = planet_force_spread(force.to_numpy(), part.attrs["rated_mean_force_n"])
    attrs = RESULT_QUANTITIES["planet_force_spread"].attrs
    return part.assign(planet_force_spread=xr.Variable((dim,), spread, attrs))


def halves(data: xr.Dataset, stage: str) -> list[str]:
    """Halves of a stage that ``stage_part`` gives; "left" alone of one that is not double-helical."""
    sides = data["side"].to_numpy()[data["stage"].to_numpy() == stage]
    return ["left", "right"] if "right" in sides else ["left"]


def _gear_meshes(data: xr.Dataset, stage: str, kind: str, half: str) -> np.ndarray[Any, Any]:
    in_half = (data["stage"] == stage) & (data["kind"] == kind) & (data["side"] != OTHER[half])
    return np.flatnonzero(in_half.to_numpy())


def ring_forces(data: xr.Dataset, stage: str) -> xr.DataArray:
    """Forces of all ring gear meshes of a stage, of both halves of a double-helical one, N."""
    of_ring = (data["stage"] == stage) & (data["kind"] == "ring")
    return _named(data["gear_mesh_force"].isel(gear_mesh=np.flatnonzero(of_ring.to_numpy())))


def _teeth(data: xr.Dataset, stage: str, half: str) -> np.ndarray[Any, Any]:
    of_stage = data["tooth_stage"] == stage
    if "tooth_side" in data.coords:  # earlier files have none, and no ring in halves
        of_stage &= data["tooth_side"] != OTHER[half]
    return np.flatnonzero(of_stage.to_numpy())


def ring_groups(data: xr.Dataset, stage: str) -> list[str]:
    """Names of a ring's gear meshes in load sharing, of both halves of a double-helical stage."""
    of_ring = (data["group_stage"] == stage) & (data["group_kind"] == "ring")
    return [str(g) for g in data["group"].to_numpy()[of_ring.to_numpy()]]


def _variables(data: xr.Dataset, stage: str, half: str) -> Iterator[tuple[str, xr.DataArray]]:
    """Names and views."""
    for name in map(str, data.data_vars):
        if name in AS_THEY_ARE or name.startswith("energy_"):
            yield name, data[name]
    turning = {"stage_angle": "carrier_angle", "stage_speed": "carrier_speed"}
    for source, name in turning.items():
        if source in data:
            yield name, data[source].sel(turning_stage=stage)
    if "port_torque" in data:
        yield "input_torque", data["port_torque"].isel(port=0)
    if "load_sharing" in data:
        for group in ring_groups(data, stage):
            if data["group_side"].sel(group=group) != OTHER[half]:
                yield "load_sharing", data["load_sharing"].sel(group=group)
    if "gear_mesh_force" in data:
        for kind in KINDS:
            force = data["gear_mesh_force"].isel(gear_mesh=_gear_meshes(data, stage, kind, half))
            yield f"{kind}_gear_mesh_force", _named(force, gear_mesh="planet")
    yield from _pairs(data, stage, half)
    yield from _motions(data, stage, half)
    for name, dim, other in (
        ("bolt_force", "bolt", "bolt"),
        ("bearing_force", "support", "bearing"),
    ):
        if name in data:
            yield name, _named(data[name].isel({dim: _own(data[dim], stage)}), **{dim: other})


def _named(part: xr.DataArray, **dims: str) -> xr.DataArray:
    """Without coordinates, its axes renamed."""
    bare = part.drop_vars(list(part.coords))
    return bare.rename({a: b for a, b in dims.items() if a != b})


def _own(labels: xr.DataArray, stage: str, kind: str = "") -> list[int]:
    """Places of labels "stage.name", of a kind alone if it is given; those of no stage belong to
    all."""
    names = [MemberName.parse(str(n)) for n in labels.to_numpy()]
    of_stage = [k for k, name in enumerate(names) if name.stage == stage or not name.part]
    return [k for k in of_stage if kind in ("", NodeName.parse(names[k].part).kind)]


def _pairs(data: xr.Dataset, stage: str, half: str) -> Iterator[tuple[str, xr.DataArray]]:
    if "flank" not in data.dims:
        return
    for kind in KINDS:
        for sense, words in FLANKS:
            numbers = np.flatnonzero(
                (
                    (data["flank_stage"] == stage)
                    & (data["flank_kind"] == kind)
                    & (data["flank_sense"] == sense)
                    & (data["flank_side"] != OTHER[half])
                ).to_numpy()
            )
            for part in PARTS:
                if f"pair_{part}" in data and len(numbers):
                    pairs = data[f"pair_{part}"].isel(flank=numbers)
                    yield f"{kind}_{words}_{part}", _named(pairs, flank="planet")


def _motions(data: xr.Dataset, stage: str, half: str) -> Iterator[tuple[str, xr.DataArray]]:
    if "tooth_displacement" in data:
        yield "tooth_displacement", data["tooth_displacement"].isel(tooth=_teeth(data, stage, half))
    if "body_displacement" in data:
        motion = data["body_displacement"]
        planets = motion.isel(body=_own(data["body"], stage, "planet"))
        yield "planet_displacement", _named(planets, body="planet")
        yield "sun_displacement", motion.sel(body=f"{stage}.sun")
    if "carrier_displacement" in data:
        motion = data["carrier_displacement"]
        yield "carrier_displacement", motion.isel(carrier_node=_own(data["carrier_node"], stage))
        pins = motion.isel(carrier_node=_own(data["carrier_node"], stage, "pin"))
        yield "pin_displacement", _named(pins, carrier_node="planet")


def _labels(data: xr.Dataset, stage: str) -> dict[str, Sequence[str]]:
    """Labels of axes without the stage's name, and those that are the same everywhere."""
    labels: dict[str, Sequence[str]] = {
        d: [str(n) for n in data[d].to_numpy()] for d in ("dof", "axis") if d in data.coords
    }
    for dim, other in (("carrier_node", "carrier_node"), ("support", "bearing")):
        if dim in data.coords:
            names = [str(data[dim].to_numpy()[k]) for k in _own(data[dim], stage)]
            labels[other] = [MemberName.parse(n).part or n for n in names]
    return labels
