"""``summary.json``: the figures of a run, for programs.

`build_summary` puts the pieces together and refuses a summary that is incomplete or holds anything
but finite numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import xarray as xr

from flexgear.files.plain import plain
from flexgear.model.errors import FlexgearError
from flexgear.results.group_sharing import sharing_figures
from flexgear.results.summary_keys import VERSION, lacking
from flexgear.results.time_figures import ORDERS

LOWEST = 12  # modes that a summary lists


def build_summary(**pieces: Any) -> dict[str, Any]:
    """The summary from its pieces (keywords are keys of ``summary_keys``), in plain types.

    Further keys are kept; what has no number is None. Raises FlexgearError naming every missing key
    and every value that is not finite.
    """
    summary = plain({"schema_version": VERSION, **pieces})
    faults = [f"{key} is missing" for key in lacking(summary)]
    for stage, figures in summary.get("steady", {}).items():
        harmonics = figures.get("radial_harmonics_um", [])
        if len(harmonics) != ORDERS:
            key = f"steady.{stage}.radial_harmonics_um"
            faults.append(f"{key} has {len(harmonics)} orders, not {ORDERS}")
    faults += [f"{key} is not a finite number" for key in not_finite(summary)]
    if faults:
        raise FlexgearError("the summary is incomplete: " + "; ".join(faults))
    return summary


def finite(figures: Mapping[str, float]) -> dict[str, float | None]:
    """Figures with None where one is infinite, which a summary cannot hold."""
    return {name: value if math.isfinite(value) else None for name, value in figures.items()}


def not_finite(value: Any, at: str = "") -> Iterator[str]:
    """Dotted names of numbers that are infinite or not a number."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            yield from not_finite(inner, f"{at}.{key}".lstrip("."))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from not_finite(inner, f"{at}[{i}]")
    elif isinstance(value, float) and not math.isfinite(value):
        yield at


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
