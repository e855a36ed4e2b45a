"""``summary.json``: the figures of a run, for programs.

`steady_summary` and `torque_step_summary` take figures out of datasets; `build_summary` puts the
pieces together and refuses a summary that is incomplete or holds anything but finite numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexgear.model.errors import FlexgearError
from flexgear.results.contact_share import contact_share
from flexgear.results.flanks import carrying_pairs, flank_histories, GEARS, tooth_loads
from flexgear.results.harmonics import radial_harmonics

ORDERS = 21  # radial harmonics 0 … 20
RPM = 60 / (2 * math.pi)
MICRO = 1e6

_REDUCTION = (
    "interface_dofs",
    "fixed_interface_modes",
    "static_error",
    "frequency_error",
    "frequency_limit_hz",
)
_STEP = (
    "carrier_speed_rpm_min",
    "tooth_load_n_min",
    "load_sharing_max",
    "planet_force_spread_max",
)
REQUIRED: dict[str, Any] = {
    "case": None,
    "version": None,
    "content_hash": None,
    "fe": {"ring": ("dofs",), "carrier": ("dofs",)},
    "reduction": {"ring": _REDUCTION, "carrier": _REDUCTION},
    "second_reduction": {"*": ("kept_modes", "modes_limit_hz", "modes_estimate")},
    "kinematics": (
        "carrier_speed_rpm",
        "sun_speed_rpm",
        "gear_mesh_frequency_hz",
        "contact_ratio_ring",
        "contact_ratio_sun",
        "expected_ring_mesh_force_n",
    ),
    "steady": {
        "carrier_speed_rpm_mean": None,
        "ring_mesh_force_n_mean": None,
        "ring_pairs_in_contact": None,
        "tooth_displacement_peak_um": ("x", "y", "z"),
        "radial_harmonics_um": None,
        "load_sharing": {"*": ("mean", "max")},
    },
    "torque_steps": {"*": {"*": _STEP}},
    "energy_residual": None,
    "warnings": None,
    "timing_s": None,
    "realtime_factor": None,
}


def steady_summary(
    flexible: xr.Dataset,
    rated_equilibrium: xr.Dataset,
    load_sharing: Mapping[str, xr.Dataset],
) -> dict[str, Any]:
    """Figures of steady running.

    flexible: the run over one revolution; rated_equilibrium: equilibria at rated torque whose
    first position gives the radial harmonics; load_sharing: steady runs by variant.
    """
    # the force is averaged over whole tooth passages by averaging over the revolution
    force = flexible["ring_gear_mesh_force"].to_numpy()
    tooth = carrying_pairs(flexible, "ring")["tooth"].to_numpy()
    node = np.abs(flexible["tooth_displacement"].isel(tooth=0).to_numpy()).max(axis=0)
    harmonics = np.abs(radial_harmonics(rated_equilibrium["tooth_displacement"].to_numpy()[0]))
    return {
        "carrier_speed_rpm_mean": float(flexible["carrier_speed"].mean()) * RPM,
        "ring_mesh_force_n_mean": float(force.mean(dtype=float)),
        "ring_pairs_in_contact": {str(n): s for n, s in contact_share(tooth > 0).items()},
        "tooth_displacement_peak_um": {
            a: float(v) * MICRO for a, v in zip("xyz", node, strict=True)
        },
        "radial_harmonics_um": [float(v) * MICRO for v in harmonics[:ORDERS]],
        "load_sharing": {name: sharing_summary(data) for name, data in load_sharing.items()},
    }


def stage_histories(data: xr.Dataset) -> xr.Dataset:
    """What of a transient the command line gives the range of."""
    names = ["carrier_speed", "ring_gear_mesh_force", "load_sharing", "planet_force_spread"]
    found = data[names]
    for gear in GEARS:
        flanks = flank_histories(data, gear)
        found = found.assign({f"{gear}_{name}": flanks[name] for name in map(str, flanks)})
    return found


def sharing_summary(data: xr.Dataset) -> dict[str, float | None]:
    """Mean and largest load sharing factor of a run where it is defined, None where nowhere."""
    k = data["load_sharing"].to_numpy()
    if not np.isfinite(k).any():
        return {"mean": None, "max": None}
    return {"mean": float(np.nanmean(k)), "max": float(np.nanmax(k))}


def torque_step_summary(data: xr.Dataset) -> dict[str, float | None]:
    """Figures of one torque drop: slowest speed, lowest tooth load, load sharing, spread.

    The lowest tooth load is that of all pairs at work on the flank that carries (negative with
    linear contact only); slots without a pair do not count.
    """
    lowest = [float(f.min()) for gear in GEARS if (f := tooth_loads(data, gear)).size]
    if not lowest:
        raise FlexgearError("no tooth pair was in contact during the torque step")
    return {
        "carrier_speed_rpm_min": float(data["carrier_speed"].min()) * RPM,
        "tooth_load_n_min": min(lowest),
        "load_sharing_max": sharing_summary(data)["max"],
        "planet_force_spread_max": float(data["planet_force_spread"].max()),
    }


def build_summary(**pieces: Any) -> dict[str, Any]:
    """The summary from its pieces (keywords are the keys of ``REQUIRED``), in plain types.

    Further keys are kept. Raises FlexgearError naming every missing key and every value that is
    not finite.
    """
    summary = plain(pieces)
    faults = [f"{key} is missing" for key in missing(summary, REQUIRED)]
    harmonics = summary.get("steady", {}).get("radial_harmonics_um")
    if isinstance(harmonics, Sequence) and len(harmonics) != ORDERS:
        faults.append(f"steady.radial_harmonics_um has {len(harmonics)} orders, not {ORDERS}")
    faults += [f"{key} is not a finite number" for key in not_finite(summary)]
    if faults:
        raise FlexgearError("the summary is incomplete: " + "; ".join(faults))
    return summary


def finite(figures: Mapping[str, float]) -> dict[str, float | None]:
    """Figures with None where one is infinite, which a summary cannot hold."""
    return {name: value if math.isfinite(value) else None for name, value in figures.items()}


def plain(value: Any) -> Any:
    """Mappings, lists, text and Python numbers only, from numpy and xarray values."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, xr.DataArray):
        value = value.to_numpy()
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (list, tuple)):
        return [plain(v) for v in value]
    if value is None or isinstance(value, (str, bool, int, float)):
        return value
    raise FlexgearError(f"a summary cannot hold a {type(value).__name__}")


def missing(found: Any, wanted: Any, at: str = "") -> Iterator[str]:
    """Dotted names in ``wanted`` that ``found`` lacks; "*" stands for any names."""
    if wanted is None:
        return
    if not isinstance(found, Mapping):
        yield at
        return
    names = wanted if isinstance(wanted, Mapping) else dict.fromkeys(wanted)
    for name, inner in names.items():
        if name == "*":
            for key, value in found.items():
                yield from missing(value, inner, f"{at}.{key}")
        elif name not in found:
            yield f"{at}.{name}".lstrip(".")
        else:
            yield from missing(found[name], inner, f"{at}.{name}".lstrip("."))


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
