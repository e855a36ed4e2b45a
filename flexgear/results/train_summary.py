"""``summary.json`` of a train: its figures for programs, in plain types and finite numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.results.summary import MICRO, missing, not_finite, plain
from flexgear.results.train_sharing import sharing_figures

LOWEST = 12  # modes that a summary lists
TRAIN_REQUIRED: dict[str, Any] = {
    "case": None,
    "kind": None,
    "version": None,
    "content_hash": None,
    "variant": None,
    "system": ("bodies", "coordinates", "kept_modes", "modes_limit_hz", "modes_estimate"),
    "power_flow": {"mobility": None, "input_power_w": None, "members": None},
    "stages": {"*": ("gear_mesh_frequency_hz", "sun_gear_mesh_force_n")},
    "modes": ("lowest", "types"),
    "load_sharing": {"quasi_static": None, "transient": None},
    "transient": ("duration_s", "steps", "displacement_um_max"),
    "warnings": None,
    "timing_s": None,
    "realtime_factor": None,
}
UNMOVED = 1e-9  # of the largest distance of any body, rounding
CENTRAL = ("sun", "carrier", "ring", "pinion", "gear")


def train_summary(**pieces: Any) -> dict[str, Any]:
    """The summary from its pieces (keywords are the keys of ``TRAIN_REQUIRED``), in plain types.

    Further keys are kept; what has no number is None. Raises FlexgearError naming every missing
    key and every value that is not finite.
    """
    summary = plain(pieces)
    faults = [f"{key} is missing" for key in missing(summary, TRAIN_REQUIRED)]
    faults += [f"{key} is not a finite number" for key in not_finite(summary)]
    if faults:
        raise FlexgearError("the summary is incomplete: " + "; ".join(faults))
    return dict(summary)


def modes_summary(data: xr.Dataset) -> dict[str, Any]:
    """Lowest modes, repeated ones once, and how many of each type there are."""
    lowest: list[dict[str, Any]] = []
    for k in range(data.sizes["mode"]):
        f, kind = float(data["frequency"][k]), str(data["type"][k].item())
        same = bool(lowest) and lowest[-1]["type"] == kind
        if same and abs(f - lowest[-1]["frequency_hz"]) <= 1e-6 * f:
            continue
        times = int(data["multiplicity"][k])
        lowest.append({"frequency_hz": f, "type": kind, "multiplicity": times})
        if len(lowest) == LOWEST:
            break
    kinds = [str(k) for k in data["type"].to_numpy()]
    return {"lowest": lowest, "types": {k: kinds.count(k) for k in dict.fromkeys(kinds)}}


def sharing_summary_of(data: xr.Dataset) -> dict[str, dict[str, Any]]:
    """Coefficients of every group of gear meshes that shares a load, by group and definition."""
    if "group" not in data.dims:
        return {}
    return {str(g): sharing_figures(data, str(g)) for g in data["group"].to_numpy()}


def displacement_summary(data: xr.Dataset) -> dict[str, float]:
    """Largest distance from the axis of every central member over the samples, µm."""
    far = axis_distance(data)
    return distance_summary(far.max([d for d in far.dims if d != "body"]))


def axis_distance(data: xr.Dataset) -> xr.DataArray:
    """Distance of all bodies from the axis, m."""
    motion = data["body_displacement"]
    ux, uy = (motion.sel(dof=dof, drop=True) for dof in ("ux", "uy"))
    return cast(xr.DataArray, np.hypot(ux, uy))


def distance_summary(largest: xr.DataArray) -> dict[str, float]:
    """Largest distances from the axis of central members, µm, of those (body,) of all bodies, m."""
    far = central_distance(largest, largest)
    sizes = zip(far["body"].to_numpy(), far.to_numpy(), strict=True)
    return {str(n): float(v) * MICRO for n, v in sizes}


def central_distance(far: xr.DataArray, largest: xr.DataArray) -> xr.DataArray:
    """Of distances from the axis (…, body) those of central members, none where the largest (body,)
    is rounding beside that of other bodies."""
    names = [str(n) for n in far["body"].to_numpy()]
    central = [n for n in names if n.rpartition(".")[2].split("_")[0] in CENTRAL]
    return far.where(largest > UNMOVED * largest.max(), 0.0).sel(body=central)


def force_ranges(
    least: xr.DataArray, mean: xr.DataArray, largest: xr.DataArray
) -> dict[str, Mapping[str, float]]:
    """Least, mean and largest force of every group, of those (gear_mesh,) of gear meshes, N."""
    groups = [str(g).rpartition(" ")[0] for g in least["gear_mesh"].to_numpy()]
    out: dict[str, Mapping[str, float]] = {}
    for group in dict.fromkeys(groups):
        own = [g == group for g in groups]
        out[group] = {
            "min_n": float(least.to_numpy()[own].min()),
            "mean_n": float(mean.to_numpy()[own].mean()),
            "max_n": float(largest.to_numpy()[own].max()),
        }
    return out
