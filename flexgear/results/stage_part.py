"""The part of a dataset for one stage, and the tooth pairs of the loaded flanks.

Variables and axes keep names, units and meanings; variables in a file remain there until they are
accessed. Datasets have tooth pairs of both flanks. Torque in the rated sense loads the drive
flanks, torque in the opposite sense the coast flanks.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from flexgear.model.errors import FlexgearError, InputError, echo
from flexgear.model.names import BodyName, MemberName
from flexgear.model.read import nearest
from flexgear.results.quantities import RESULT_COORDINATES

_OTHER_HALF = {"left": "right", "right": "left"}


def stage_part(data: xr.Dataset, stage: str, half: str = "left") -> xr.Dataset:
    """The part of ``data`` for a stage; half of a double-helical stage: "left", "right", "" both.

    Axes whose entries belong to stages (``RESULT_COORDINATES``) are reduced to the entries of this
    stage and those of no stage, such as joints. The axis ``turning_stage`` is removed. Raises
    InputError for an unknown stage or half.
    """
    if half not in ("left", "right", ""):
        raise InputError("--half", echo(half), "is no half", 'use "left", "right" or ""')
    part = data
    if "turning_stage" in data.dims:
        stages = data["turning_stage"].to_numpy().astype(str).tolist()
        if stage not in stages:
            problem = "is no stage of the dataset"
            raise InputError("--stage", echo(stage), problem, nearest(stage, stages))
        part = data.sel(turning_stage=stage)
    masks = {
        dim: _of_stage(data[dim], stage)
        for dim, declared in RESULT_COORDINATES.items()
        if declared.stage == "name" and dim in data.dims
    }
    for dim, name in _coordinates_of(data, "stage").items():
        masks[dim] = data[name].to_numpy() == stage
    for dim, name in _coordinates_of(data, "side").items():
        masks[dim] &= data[name].to_numpy() != _OTHER_HALF.get(half)
    return part.isel({dim: np.flatnonzero(entries) for dim, entries in masks.items()})


def of_kind(data: xr.Dataset, kind: str) -> xr.Dataset:
    """The part of ``data`` for gear meshes, flanks and groups of a kind, "ring" or "sun"."""
    names = _coordinates_of(data, "kind")
    return data.isel({d: np.flatnonzero(data[name] == kind) for d, name in names.items()})


def displacement_of(part: xr.Dataset, body: str) -> xr.DataArray:
    """Displacement of the planets (sample, body, dof), or of another body (sample, dof), in the
    part of a stage."""
    names = [BodyName.parse(n) for n in part["body"].to_numpy()]
    bodies = part["body_displacement"].isel(body=[n.part == body for n in names])
    return bodies if body == "planet" else bodies.squeeze("body", drop=True)


def ring_sharing(part: xr.Dataset) -> xr.DataArray:
    """Load sharing factor (sample,) of the ring's gear meshes in the part of a stage and half."""
    return of_kind(part, "ring")["load_sharing"].squeeze("group", drop=True)


def ring_force_spread(part: xr.Dataset) -> xr.DataArray:
    """(max F − min F) / rated mean F (sample,) of the ring's gear meshes in the part of a stage;
    NaN without rated force."""
    ring = of_kind(part, "ring")
    force = ring["gear_mesh_force"]
    rated = float(ring["rated_gear_mesh_force"].mean())
    spread = np.ptp(force.to_numpy().astype(float), axis=-1) / (abs(rated) or np.nan)
    return force.isel(gear_mesh=0, drop=True).copy(deep=False, data=spread)


def halves(data: xr.Dataset, stage: str) -> list[str]:
    """Halves of a stage: "left" and "right" if it is double-helical, else "left"."""
    sides = data["side"].to_numpy()[data["stage"].to_numpy() == stage]
    return ["left", "right"] if "right" in sides else ["left"]


def _coordinates_of(data: xr.Dataset, field: str) -> dict[str, str]:
    """Name of the coordinate with a field, "stage", "kind" or "side", of the entries, by axis."""
    names = {
        dim: declared.stage.replace("stage", field)
        for dim, declared in RESULT_COORDINATES.items()
        if declared.stage not in ("", "name") and dim in data.dims
    }
    return {dim: name for dim, name in names.items() if name in data.coords}


def _of_stage(labels: xr.DataArray, stage: str) -> NDArray[np.bool_]:
    """Whether each label, the name of a member, belongs to the stage or to none."""
    names = [MemberName.parse(str(label)) for label in labels.to_numpy()]
    return np.array([name.stage == stage or not name.part for name in names], dtype=bool)


GEARS = ("ring", "sun")
PARTS = ("load", "tooth", "stiffness", "position")


def has_pairs(data: xr.Dataset) -> bool:
    """Whether a dataset has tooth pairs: none where waves of stiffness stand for all of them."""
    return "pair_load" in data


def pairs_of(
    data: xr.Dataset, gear: str, sense: str, planet: int = 0, parts: Sequence[str] = PARTS
) -> xr.Dataset:
    """Tooth pairs on the "drive" or "coast" flanks of all planets, or of one planet from 1.

    Variables, as far as ``data`` has them: "load" N, "tooth" from 1 (0: no pair), "stiffness" N/m
    and "position" m, each (sample, planet, slot). Coast flanks have none with linear contact.
    """
    of_flank = (data["flank_kind"] == gear) & (data["flank_sense"] == sense)
    if planet:
        of_flank &= data["flank_planet"] == planet
    at = np.flatnonzero(of_flank.to_numpy())
    pairs = {part: data[f"pair_{part}"] for part in parts if f"pair_{part}" in data}
    if "load" not in pairs or not (len(at) or sense == "coast"):
        raise FlexgearError(f"the dataset holds no tooth pairs of the {gear}")
    selected = {name: pair.isel(flank=at).reset_coords(drop=True) for name, pair in pairs.items()}
    return xr.Dataset(selected).drop_vars("flank").rename(flank="planet")


def _carrying(
    data: xr.Dataset, gear: str, planet: int, parts: Sequence[str]
) -> tuple[xr.Dataset, xr.DataArray]:
    """``carrying_pairs``, and whether (sample, planet) the coast flank has the larger load."""
    senses = ("drive", "coast")
    drive, coast = (pairs_of(data, gear, sense, planet, parts).load() for sense in senses)
    load = abs(drive["load"].sum("slot"))
    if not coast.sizes["planet"]:
        return drive, load < 0.0
    on_coast = load < coast["load"].sum("slot")
    return drive.where(~on_coast, coast), on_coast


def carrying_pairs(
    data: xr.Dataset, gear: str, planet: int = 0, parts: Sequence[str] = PARTS
) -> xr.Dataset:
    """Pairs (``pairs_of``) of the loaded flank of each planet at each sample, without load those of
    the drive flank. parts: must include "load"."""
    return _carrying(data, gear, planet, parts)[0]


def tooth_loads(data: xr.Dataset, gear: str) -> xr.DataArray:
    """Loads (pair,) of all pairs on the loaded flanks, N, without slots that have no pair."""
    pairs = carrying_pairs(data, gear, parts=("load", "tooth"))
    at = pairs["tooth"].to_numpy() > 0
    return xr.DataArray(pairs["load"].to_numpy()[at], dims="pair", attrs={"units": "N"})


def flank_histories(data: xr.Dataset, gear: str, planet: int = 0) -> xr.Dataset:
    """ "load" (sample, planet, slot) of pairs on the loaded flank, N, NaN in slots without a pair;
    "drive" and "coast" (sample, planet), 1 if that flank is loaded, else 0."""
    pairs, coast = _carrying(data, gear, planet, ("load", "tooth"))
    loaded = abs(pairs["load"].sum("slot")) > 0
    carrying = {"drive": (loaded & ~coast) * 1.0, "coast": (loaded & coast) * 1.0}
    return xr.Dataset({"load": pairs["load"].where(pairs["tooth"] > 0), **carrying})


def flank_names(histories: xr.Dataset) -> str:
    """Flanks that are loaded at any sample, by ``flank_histories`` or their largest values:
    "drive", "coast", "drive and coast" or "none"."""
    return " and ".join(w for w in ("drive", "coast") if bool(histories[w].any())) or "none"


def pairs_in_contact(in_contact: xr.DataArray) -> xr.DataArray:
    """Indicators (…, pairs), 1 if 0, 1, 2, … of the pairs (…, slot) are in contact, else 0. Their
    mean over time is the share of time."""
    number = xr.DataArray(np.arange(in_contact.sizes["slot"] + 1), dims="pairs")
    return (in_contact.sum("slot") == number) * 1.0


def stiffness_split(load: ArrayLike, stiffness: ArrayLike) -> NDArray[np.float64]:
    """Total load of pairs divided in proportion to their stiffness, k_l ΣF/Σk (..., slots), N, from
    loads and stiffnesses (..., slots); zero if Σk = 0."""
    f, k = np.asarray(load, dtype=float), np.asarray(stiffness, dtype=float)
    total = k.sum(axis=-1, keepdims=True)
    share = np.divide(k, total, out=np.zeros_like(k), where=total > 0)
    return np.asarray(share * f.sum(axis=-1, keepdims=True))
