"""Labelled dataset and figures of a tolerance study, and statistics of its samples.

Quantiles, means and their confidence intervals assume no distribution of the samples.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray
from scipy.special import bdtr, betaincinv, stdtrit

from flexgear.arrays import Array
from flexgear.model.names import GearMeshName
from flexgear.results.labelled_dataset import GEAR_MESH, GROUP, fields_of, groups_of
from flexgear.results.load_sharing import MESH_LOAD_FACTOR
from flexgear.results.quantities import Quantity, number, quantity
from flexgear.results.result_quantities import RESULT_QUANTITIES

QUANTILES = (0.5, 0.9, 0.95, 0.99)
PARTS = (("", "value"), ("_low", "low"), ("_high", "high"))  # of an estimate


class Spread(NamedTuple):
    """A figure whose scatter is evaluated.

    variable, unit: variable of its samples and its unit; key: key in summaries; label, digits: of
    its axis and of its quantiles in a picture; file: of the picture; printed, factor: unit in
    summaries ("" for none) and the factor to it.
    """

    variable: str
    unit: str
    key: str
    meaning: str
    label: str
    digits: int
    file: str
    printed: str = ""
    factor: float = 1.0


SPREADS = {  # by prefix of the names of their statistics
    "load_sharing": Spread("load_sharing_max", "1", "load_sharing",
        "largest load sharing factor K over one turn of the carrier against the ring",
        "largest $K_γ$ over one turn", 4, "tolerance"),
    "k_h_beta": Spread("k_h_beta", "1", "k_h_beta", "largest face load factor K_Hβ",
        "face load factor $K_{Hβ}$ over one turn", 3, "face_load_factor"),
    "largest_line_load": Spread("largest_line_load", "N/m", "largest_line_load_n_per_mm",
        "largest line load", "largest line load (N/mm)", 0, "largest_line_load", "N/mm", 1e-3),
}  # fmt: skip
NO_VALUE = "for a sample without equilibrium, or whose planets at times carry no common load"
TOO_FEW = "with too few samples"


def _statistics(name: str, spread: Spread) -> dict[str, Quantity]:
    """Declarations of the figure with the errors of the case, and of statistics over samples."""
    of, unit = spread.variable, spread.unit
    return {
        f"{name}_as_stated": quantity("group", unit, f"{of} with the errors of the case", NO_VALUE),
        f"{name}_deviation": quantity("group", unit, f"standard deviation of {of}", TOO_FEW),
        f"{name}_average": quantity("group", unit, f"mean of {of} over the samples", TOO_FEW),
        f"{name}_quantile": quantity("group quantile", unit, f"quantile of {of}", TOO_FEW),
    }


_ABOUT = {
    "error_size": quantity("sample size", "m", "size of a drawn error"),
    "error_phase": quantity("sample phase", "rad", "phase of a drawn error"),
    "load_sharing_max": quantity("sample group", "1",
        "largest N max F / ΣF over one turn", NO_VALUE),
    "load_sharing_mean": quantity("sample group", "1",
        "mean of N max F / ΣF over one turn", NO_VALUE),
    "planet_load_factor_max": quantity("sample gear_mesh", "1",
        "largest N F / ΣF over one turn", NO_VALUE),
    "planet_load_factor_mean": quantity("sample gear_mesh", "1",
        "mean N F / ΣF over one turn", NO_VALUE),
    "k_h_beta": quantity("sample group", "1",
        "largest face load factor of the group's gear meshes", NO_VALUE),
    "largest_line_load": quantity("sample group", "N/m",
        "largest line load of the group's gear meshes", NO_VALUE),
    "mesh_load_factor": RESULT_QUANTITIES["mesh_load_factor"],
    **{n: q for name, s in SPREADS.items() for n, q in _statistics(name, s).items()},
    "share_above": quantity("group", "1",
        "share of samples above mesh_load_factor", f"{TOO_FEW}, or without that factor"),
}  # fmt: skip
_ENDS = {"": "", "_low": ", lower end of its interval", "_high": ", upper end of its interval"}
_VARIABLES = {
    f"{name}{end}": about._replace(meaning=about.meaning + which)
    for name, about in _ABOUT.items()
    for end, which in _ENDS.items()
}


def tolerance_dataset(
    arrays: Mapping[str, Array],
    *,
    sizes: Sequence[str],
    phases: Sequence[str],
    gear_meshes: Sequence[GearMeshName],
    confidence: float,
    attrs: Mapping[str, Any],
) -> xr.Dataset:
    """Dataset of samples by name as in ``_VARIABLES``, with statistics.

    sizes, phases: labels of drawn errors; gear_meshes: gear meshes that share a load, group by
    group. Samples that are NaN are left out of the statistics.
    """
    groups = list(groups_of(gear_meshes))
    assumed = [MESH_LOAD_FACTOR.get(len(at), math.nan) for at in groups_of(gear_meshes).values()]
    figures = {
        **arrays,
        "mesh_load_factor": np.array(assumed),
        **_share_above(np.asarray(arrays["load_sharing_max"]), assumed, confidence),
    }
    for name, spread in SPREADS.items():
        samples = np.asarray(arrays.get(spread.variable, ()))
        if samples.size:
            figures |= _spread(name, samples, confidence)
    coords: dict[str, Any] = {
        "sample": np.arange(len(arrays["load_sharing_max"])),
        "quantile": list(QUANTILES),
        "group": groups,
        "gear_mesh": list(gear_meshes),
    }
    fields = {
        "group": fields_of(groups, GROUP, "group_"),
        "gear_mesh": fields_of(gear_meshes, GEAR_MESH),
    }
    coords |= {name: (dim, v) for dim, columns in fields.items() for name, v in columns.items()}
    drawn = {"size": sizes, "phase": phases}
    coords |= {name: list(labels) for name, labels in drawn.items() if labels}
    return xr.Dataset(
        {
            name: xr.Variable(_VARIABLES[name].dims, values, _VARIABLES[name].attrs)
            for name, values in figures.items()
            if values.size
        },
        coords,
        {**attrs, "confidence": confidence},
    )


def _ends(name: str, estimates: Sequence[Any]) -> dict[str, Array]:
    """Values of estimates (…, 3) and ends of their intervals, by name of the variable."""
    values = np.array(estimates, dtype=float)
    return {f"{name}{end}": values[..., k] for k, (end, _) in enumerate(PARTS)}


def _share_above(values: Array, assumed: Sequence[float], confidence: float) -> dict[str, Array]:
    """Share of samples whose largest K (J, groups) is above the assumed value of the group."""
    columns = [column[np.isfinite(column)] for column in values.T]
    above = [
        share_above_limit(x, limit, confidence) if math.isfinite(limit) else NO_ESTIMATE
        for x, limit in zip(columns, assumed, strict=True)
    ]
    return _ends("share_above", above)


def _spread(name: str, values: Array, confidence: float) -> dict[str, Array]:
    """Standard deviation, mean and quantiles of a variable (J, groups) over its samples."""
    columns = [column[np.isfinite(column)] for column in values.T]
    deviations = [x.std(ddof=1) if len(x) > 1 else math.nan for x in columns]
    return {
        f"{name}_deviation": np.array(deviations),
        **_ends(f"{name}_average", [mean_of(x, confidence) for x in columns]),
        **_ends(
            f"{name}_quantile",
            [[quantile_of(x, p, confidence) for p in QUANTILES] for x in columns],
        ),
    }


def tolerance_summary(data: xr.Dataset) -> dict[str, Any]:
    """Figures of a tolerance study for JSON; None for values that are not finite."""
    groups = {str(g): data.sel(group=g) for g in data["group"].to_numpy()}
    return {
        "case": data.attrs["case"],
        "result": "tolerance",
        "version": data.attrs["version"],
        "content_hash": data.attrs["content_hash"],
        "variant": data.attrs["variant"],
        "seed": int(data.attrs["seed"]),
        "samples": data.sizes["sample"],
        "failed": failed(data),
        "confidence": float(data.attrs["confidence"]),
        "positions": json.loads(data.attrs["positions"]),
        "drawn": [str(x) for d in ("size", "phase") if d in data.dims for x in data[d].to_numpy()],
        **{
            spread.key: {g: _figures(of_group, name, spread) for g, of_group in groups.items()}
            for name, spread in SPREADS.items()
            if spread.variable in data  # figures of the face need slices
        },
    }


def failed(data: xr.Dataset) -> int:
    """Number of samples without an equilibrium at some position."""
    return int((~np.isfinite(data["load_sharing_max"].to_numpy())).any(axis=1).sum())


def _figures(of_group: xr.Dataset, name: str, spread: Spread) -> dict[str, Any]:
    by = spread.factor
    quantiles = {
        f"{100 * p:g}": _interval(of_group.sel(quantile=p), f"{name}_quantile", by)
        for p in of_group["quantile"].to_numpy().tolist()
    }
    assumed = {} if name != "load_sharing" else {
        "iec_61400_4": number(of_group["mesh_load_factor"]),
        "share_above_iec_61400_4": _interval(of_group, "share_above"),
    }  # fmt: skip
    return {
        "as_stated": number(by * of_group[f"{name}_as_stated"]),
        "mean": _interval(of_group, f"{name}_average", by),
        "standard_deviation": number(by * of_group[f"{name}_deviation"]),
        "quantiles": quantiles,
        **assumed,
    }


def _interval(
    of_group: xr.Dataset, name: str, factor: float = 1.0
) -> dict[str, float | None] | None:
    interval = {part: number(factor * of_group[f"{name}{end}"]) for end, part in PARTS}
    return None if interval["value"] is None else interval


class Estimate(NamedTuple):
    """A value and the ends of its confidence interval, NaN for too few samples."""

    value: float
    low: float
    high: float


NO_ESTIMATE = Estimate(math.nan, math.nan, math.nan)


def quantile_ranks(count: int, share: float, confidence: float) -> tuple[int, int]:
    """Ranks l < u, from 1, with P(X_(l) ≤ Q ≤ X_(u)) ≥ confidence for the quantile Q of ``share``.

    The number of samples below Q is binomial for any distribution (David & Nagaraja 2003, Order
    Statistics, §7.1). Each side has half of the risk; l = 0 and u = count + 1 mean that there are
    too few samples for an end.
    """
    risk = 0.5 * (1 - confidence)
    below = bdtr(np.arange(count, dtype=float), count, share)  # P(at most k samples below Q)
    low = int(np.searchsorted(below, risk, side="right"))
    high = int(np.searchsorted(below, 1 - risk, side="left")) + 1
    return low, high


def quantile_of(samples: ArrayLike, share: float, confidence: float = 0.95) -> Estimate:
    """Median-unbiased quantile of samples (n,), with the interval from order statistics."""
    x = np.sort(np.asarray(samples, dtype=float))
    if not len(x):
        return NO_ESTIMATE
    low, high = quantile_ranks(len(x), share, confidence)
    return Estimate(
        float(np.quantile(x, share, method="median_unbiased")),
        float(x[low - 1]) if low >= 1 else math.nan,
        float(x[high - 1]) if high <= len(x) else math.nan,
    )


def mean_of(samples: ArrayLike, confidence: float = 0.95) -> Estimate:
    """Mean of samples (n,) with Student's interval x̄ ± t s/√n."""
    x = np.asarray(samples, dtype=float)
    if len(x) < 2:
        return Estimate(float(x.mean()) if len(x) else math.nan, math.nan, math.nan)
    half = stdtrit(len(x) - 1, 0.5 * (1 + confidence)) * x.std(ddof=1) / math.sqrt(len(x))
    return Estimate(float(x.mean()), float(x.mean() - half), float(x.mean() + half))


def share_above_limit(samples: ArrayLike, limit: float, confidence: float = 0.95) -> Estimate:
    """Share of the population above a limit, with the interval of Clopper & Pearson (1934)."""
    x = np.asarray(samples, dtype=float)
    low, high = share_interval(np.array([np.sum(x > limit)]), len(x), confidence)
    return Estimate(
        float(np.mean(x > limit)) if len(x) else math.nan, float(low[0]), float(high[0])
    )


def distribution_band(count: int, confidence: float = 0.95) -> tuple[Array, Array]:
    """Ends (n,) of the pointwise confidence interval of the distribution of n sorted samples."""
    return share_interval(np.arange(1, count + 1), count, confidence)


def share_interval(successes: Array | NDArray[np.int64], count: int, confidence: float
                   ) -> tuple[Array, Array]:  # fmt: skip
    """Confidence interval of a share, from the number of successes in ``count`` samples."""
    risk, k = 0.5 * (1 - confidence), np.asarray(successes, dtype=float)
    low = np.where(k > 0, betaincinv(np.maximum(k, 1), count - k + 1, risk), 0.0)
    high = np.where(k < count, betaincinv(k + 1, np.maximum(count - k, 1), 1 - risk), 1.0)
    return np.asarray(low), np.asarray(high)
