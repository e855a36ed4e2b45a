"""The part of a dataset that belongs to one stage, and which flanks of its gear meshes carry.

Variables and axes keep names, units and meanings; what lies in a file stays there until it is read.
Datasets hold the tooth pairs of both flanks. Under the sense of torque that is rated the drive
flanks carry, under the other the coast flanks, and after a torque reversal each in its turn.
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

OTHER = {"left": "right", "right": "left"}


def stage_part(data: xr.Dataset, stage: str, half: str = "left") -> xr.Dataset:
    """The part of ``data`` that belongs to a stage, of a double-helical one that of a half, "left"
    or "right", or of both, "".

    Of every axis whose entries are of stages (``RESULT_COORDINATES`` says so), it has those of the
    stage and those of none, as joints are; ``turning_stage`` is no axis any more. InputError for an
    unknown stage or half.
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
    for dim, name in _beside(data, "stage").items():
        masks[dim] = data[name].to_numpy() == stage
    for dim, name in _beside(data, "side").items():
        masks[dim] &= data[name].to_numpy() != OTHER.get(half)
    return part.isel({dim: np.flatnonzero(entries) for dim, entries in masks.items()})


def of_kind(data: xr.Dataset, kind: str) -> xr.Dataset:
    """Gear meshes, flanks and groups of a kind, "ring" or "sun"."""
    kinds = {dim: data[name].to_numpy() == kind for dim, name in _beside(data, "kind").items()}
    return data.isel({dim: np.flatnonzero(mask) for dim, mask in kinds.items()})


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
    rated = float(ring["rated_gear_mesh_force"].mean())
    spread = np.ptp(force.to_numpy().astype(float), axis=-1) / abs(rated)
    return force.isel(gear_mesh=0, drop=True).copy(deep=False, data=spread)


def halves(data: xr.Dataset, stage: str) -> list[str]:
    """Halves of a stage; "left" alone of one that is not double-helical."""
    sides = data["side"].to_numpy()[data["stage"].to_numpy() == stage]
    return ["left", "right"] if "right" in sides else ["left"]


def _beside(data: xr.Dataset, field: str) -> dict[str, str]:
    """Name of the coordinate of each axis that gives a field of its entries: "stage", "kind" or
    "side"."""
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


GEARS = ("ring", "sun")
PARTS = ("load", "tooth", "stiffness", "position")


def pairs_of(
    data: xr.Dataset, gear: str, sense: str, planet: int = 0, parts: Sequence[str] = PARTS
) -> xr.Dataset:
    """Tooth pairs on the "drive" or "coast" flanks of all planets, or of one from 1: "load" N,
    "tooth" from 1 (0: none), "stiffness" N/m and "position" m, each (sample, planet, slot), those
    that ``data`` holds. None of a planet on coast flanks with the linear contact law."""
    of_flank = (data["flank_kind"] == gear) & (data["flank_sense"] == sense)
    if planet:
        of_flank &= data["flank_planet"] == planet
    at = np.flatnonzero(of_flank.to_numpy())
    pairs = {part: data[f"pair_{part}"] for part in parts if f"pair_{part}" in data}
    if "load" not in pairs or not (len(at) or sense == "coast"):
        raise FlexgearError(f"the dataset holds no tooth pairs of the {gear}")
    bare = xr.Dataset(
        {name: pair.isel(flank=at).reset_coords(drop=True) for name, pair in pairs.items()}
    )
    return bare.drop_vars("flank").rename(flank="planet")


def _carrying(
    data: xr.Dataset, gear: str, planet: int, parts: Sequence[str]
) -> tuple[xr.Dataset, xr.DataArray]:
    """``carrying_pairs``, and True (sample, planet) where the coast flank bears more."""
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
    """Pairs of the flank that carries, planet by planet and sample by sample, as ``pairs_of`` has
    them; the drive flank's where neither carries. parts: "load" is one of them."""
    return _carrying(data, gear, planet, parts)[0]


def tooth_loads(data: xr.Dataset, gear: str) -> xr.DataArray:
    """Loads of the pairs on the flank that carries, N, flat; slots without a pair are left out."""
    pairs = carrying_pairs(data, gear, parts=("load", "tooth"))
    at = pairs["tooth"].to_numpy() > 0
    return xr.DataArray(pairs["load"].to_numpy()[at], dims="pair", attrs={"units": "N"})


def flank_histories(data: xr.Dataset, gear: str, planet: int = 0) -> xr.Dataset:
    """Over the samples: "load" of pairs on the flank that carries, N, not a number in slots without
    a pair; "drive" and "coast" (sample, planet), 1 where that flank bears a load."""
    pairs, coast = _carrying(data, gear, planet, ("load", "tooth"))
    loaded = abs(pairs["load"].sum("slot")) > 0
    carrying = {"drive": (loaded & ~coast) * 1.0, "coast": (loaded & coast) * 1.0}
    return xr.Dataset({"load": pairs["load"].where(pairs["tooth"] > 0), **carrying})


def carrying_flank(data: xr.Dataset, gear: str, planet: int = 0) -> str:
    """Which flank carries over the samples: "drive", "coast", "drive and coast" or "none"."""
    return flank_names(flank_histories(data, gear, planet))


def flank_names(histories: xr.Dataset) -> str:
    """Flanks that carry in ``flank_histories`` or their largest values: "drive", "coast", both or
    "none"."""
    return " and ".join(w for w in ("drive", "coast") if bool(histories[w].any())) or "none"


def pairs_in_contact(at_work: xr.DataArray) -> xr.DataArray:
    """1 (…, pairs) where just so many pairs, 0, 1, 2, …, are at work (…, slot): its mean is the
    share of time."""
    number = xr.DataArray(np.arange(at_work.sizes["slot"] + 1), dims="pairs")
    return (at_work.sum("slot") == number) * 1.0


def stiffness_split(load: ArrayLike, stiffness: ArrayLike) -> NDArray[np.float64]:
    """F_l (..., slots) in N from pair loads and stiffnesses (..., slots); zero where Σk = 0."""
    f, k = np.asarray(load, dtype=float), np.asarray(stiffness, dtype=float)
    total = k.sum(axis=-1, keepdims=True)
    share = np.divide(k, total, out=np.zeros_like(k), where=total > 0)
    return np.asarray(share * f.sum(axis=-1, keepdims=True))
