"""Labelled dataset and figures of a tolerance study."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.results import tolerance_statistics as statistics
from flexgear.files.atomic import PathLike, write_bytes
from flexgear.results.load_sharing import mesh_load_factor
from flexgear.results.quantities import Quantity
from flexgear.results.train_dataset import GearMeshName, groups_of
from flexgear.results.train_quantities import TRAIN_QUANTITIES

Array = NDArray[np.float64]
QUANTILES = (0.5, 0.9, 0.95, 0.99)
ENDS = ("", "_low", "_high")

LOST = "of a sample without an equilibrium, or whose planets at times carry no load together"
FEW = "with too few samples for it"
_ABOUT = {
    "error_size": Quantity(("sample", "size"), "m", "size of a drawn error"),
    "error_phase": Quantity(("sample", "phase"), "rad", "phase of a drawn error"),
    "load_sharing_max": Quantity(
        ("sample", "group"), "1", "largest N max F / ΣF over one turn", LOST
    ),
    "load_sharing_mean": Quantity(
        ("sample", "group"), "1", "mean of N max F / ΣF over one turn", LOST
    ),
    "planet_load_factor_max": Quantity(
        ("sample", "gear_mesh"), "1", "largest N F / ΣF over one turn", LOST
    ),
    "planet_load_factor_mean": Quantity(
        ("sample", "gear_mesh"), "1", "mean N F / ΣF over one turn", LOST
    ),
    "load_sharing_as_stated": Quantity(
        ("group",), "1", "load_sharing_max with the errors of the case", LOST
    ),
    "mesh_load_factor": TRAIN_QUANTITIES["mesh_load_factor"],
    "load_sharing_deviation": Quantity(
        ("group",), "1", "standard deviation of load_sharing_max", FEW
    ),
    "load_sharing_average": Quantity(
        ("group",), "1", "mean of load_sharing_max over the samples", FEW
    ),
    "load_sharing_quantile": Quantity(
        ("group", "quantile"), "1", "quantile of load_sharing_max", FEW
    ),
    "share_above": Quantity(
        ("group",), "1", "share of samples above mesh_load_factor", f"{FEW}, or without that factor"
    ),
}
_SIDES = {"": "", "_low": ", lower end of its interval", "_high": ", upper end of its interval"}


def tolerance_dataset(
    arrays: Mapping[str, Array],
    *,
    sizes: Sequence[str],
    phases: Sequence[str],
    gear_meshes: Sequence[GearMeshName],
    confidence: float,
    attrs: Mapping[str, Any],
) -> xr.Dataset:
    """Samples by name as in ``_ABOUT`` and what follows from them.

    sizes, phases: labels of drawn errors; gear_meshes: those that share a load, group by group;
    samples that are no number are left out of all statistics.
    """
    groups = list(groups_of(gear_meshes))
    assumed = [mesh_load_factor(len(at)) or math.nan for at in groups_of(gear_meshes).values()]
    made = {
        **arrays,
        "mesh_load_factor": np.array(assumed),
        **_statistics(np.asarray(arrays["load_sharing_max"]), assumed, confidence),
    }
    coords: dict[str, Any] = {
        "sample": np.arange(len(arrays["load_sharing_max"])),
        "size": list(sizes),
        "phase": list(phases),
        "quantile": list(QUANTILES),
        "group": [g.label for g in groups],
        "gear_mesh": [g.label for g in gear_meshes],
    }
    for part in ("stage", "kind", "side"):
        coords[f"group_{part}"] = ("group", [getattr(g, part) for g in groups])
    for part in ("stage", "kind", "side", "planet"):
        coords[part] = ("gear_mesh", [getattr(g, part) for g in gear_meshes])
    if not sizes:
        del coords["size"]
    if not phases:
        del coords["phase"]
    return xr.Dataset(
        {name: _variable(name, made[name]) for name in made if made[name].size},
        coords,
        {**attrs, "confidence": confidence},
    )


def _variable(name: str, values: Array) -> xr.Variable:
    end = next((e for e in ("_low", "_high") if name.endswith(e)), "")
    about = _ABOUT[name.removesuffix(end)]
    about = about._replace(meaning=about.meaning + _SIDES[end])
    return xr.Variable(about.dims, values, about.attrs)


def _statistics(found: Array, assumed: Sequence[float], confidence: float) -> dict[str, Array]:
    """Figures of the largest K (J, groups)."""
    columns = [column[np.isfinite(column)] for column in found.T]
    above = [
        statistics.share_above(x, limit, confidence)
        if math.isfinite(limit)
        else statistics.Estimate(math.nan, math.nan, math.nan)
        for x, limit in zip(columns, assumed, strict=True)
    ]
    averages = [statistics.mean(x, confidence) for x in columns]
    quantiles = [[statistics.quantile(x, p, confidence) for p in QUANTILES] for x in columns]
    out = {"load_sharing_deviation": np.array([x.std(ddof=1) if len(x) > 1 else math.nan
                                               for x in columns])}  # fmt: skip
    for end, part in zip(ENDS, ("value", "low", "high"), strict=True):
        out[f"load_sharing_average{end}"] = np.array([getattr(e, part) for e in averages])
        out[f"share_above{end}"] = np.array([getattr(e, part) for e in above])
        out[f"load_sharing_quantile{end}"] = np.array(
            [[getattr(e, part) for e in line] for line in quantiles]
        )
    return out


def tolerance_summary(data: xr.Dataset) -> dict[str, Any]:
    """Figures for programs; None where there is no number."""
    count = data.sizes["sample"]
    return {
        "case": data.attrs["case"],
        "result": "tolerance",
        "version": data.attrs["version"],
        "content_hash": data.attrs["content_hash"],
        "variant": data.attrs["variant"],
        "seed": int(data.attrs["seed"]),
        "samples": count,
        "failed": failed(data),
        "confidence": float(data.attrs["confidence"]),
        "positions": json.loads(data.attrs["positions"]),
        "drawn": [str(x) for d in ("size", "phase") if d in data.dims for x in data[d].to_numpy()],
        "load_sharing": {str(g): _figures(data.sel(group=g)) for g in data["group"].to_numpy()},
    }


def failed(data: xr.Dataset) -> int:
    """Samples without an equilibrium in some position."""
    return int((~np.isfinite(data["load_sharing_max"].to_numpy())).any(axis=1).sum())


def _figures(one: xr.Dataset) -> dict[str, Any]:
    quantiles = {
        f"{100 * p:g}": _interval(one.sel(quantile=p), "load_sharing_quantile")
        for p in one["quantile"].to_numpy().tolist()
    }
    return {
        "as_stated": _number(one["load_sharing_as_stated"]),
        "mean": _interval(one, "load_sharing_average"),
        "standard_deviation": _number(one["load_sharing_deviation"]),
        "quantiles": quantiles,
        "iec_61400_4": _number(one["mesh_load_factor"]),
        "share_above_iec_61400_4": _interval(one, "share_above"),
    }


def _interval(one: xr.Dataset, name: str) -> dict[str, float | None] | None:
    names = ("value", "low", "high")
    found = {n: _number(one[f"{name}{end}"]) for n, end in zip(names, ENDS, strict=True)}
    return None if found["value"] is None else found


def _number(value: xr.DataArray) -> float | None:
    return float(value) if np.isfinite(value) else None


def save_tolerance(data: xr.Dataset, path: PathLike) -> Path:
    """Write netCDF in double precision; the file appears whole or not at all."""
    return write_bytes(path, data.to_netcdf(engine="h5netcdf"))
