"""Figures of steady states over speed or torque: peaks, jumps, changes of stability, ranges."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import scipy
import xarray as xr

from flexgear.results.quantities import number
from flexgear.results.run_orders import rms_of_states
from flexgear.solve.turning_points import DOUBLED, KINDS, NARROW, NEAR

MAX_PEAKS = 12  # that are listed, the highest
PROMINENCE = 0.02  # of the largest force, by which a peak exceeds its surroundings at least


def response_figures(data: xr.Dataset) -> dict[str, Any]:
    """Resonances, jumps, changes of stability and ranges without contact of a response."""
    over = data.attrs["over"]
    share = f"{over}_share"
    parameter, branch = (data[f"response_{n}"].to_numpy() for n in (share, "branch"))
    period, stable = data["response_period"].to_numpy(), data["stable"].to_numpy() == 1
    force = data["response_gear_mesh_force"].sel(measure="maximum").max("gear_mesh").to_numpy()
    doubled = ~stable & (data["multiplier_real"] < -1.0) & (data["multiplier_imag"] == 0.0)
    doubled &= DOUBLED not in data["stability_change_kind"]
    edges = np.diff(branch, prepend=0, append=0) != 0
    largest = int(np.argmax(np.where(stable, force, -np.inf)))
    changes = list(_rows(data, "stability_change", "parameter", "curve"))
    places, curves, holds = _with_changes(parameter, branch, stable, changes)
    contact = {
        name: data[f"{name}_share"].max("gear_mesh").to_numpy() > 0.0
        for name in ("lost_contact", "back_contact")
    }
    return {
        "over": over,
        "stage": data.attrs["stage"],
        "harmonics": int(data.attrs["harmonics"]),
        "doubling_change": number(data.attrs["doubling_change"]),
        "without_contact": data.attrs["without_contact"],
        "complete": bool(data.attrs["complete"]),
        "cuts": data.attrs["cut"].splitlines(),
        "states": len(parameter),
        "largest_step": float(np.abs(np.diff(parameter))[~edges[1:-1]].max(initial=0.0)),
        "curves": int(branch.max()),
        "peaks": [
            {share: float(parameter[k]), "force_n": float(force[k]), "period": int(period[k])}
            for k in _peaks(force, branch, stable)
        ],
        "largest": {share: float(parameter[largest]), "force_n": float(force[largest])}
        if stable.any()
        else None,
        "jumps": list(_jumps(data, share)),
        "stability_changes": [
            {**change, "period": int(period[branch == change["curve"]][0])}
            for change in _stability_changes(data, share)
        ],
        "doubled_at_ends": np.unique(parameter[doubled & (edges[1:] | edges[:-1])]).tolist(),
        "longer_periods": [
            {
                "curve": int(curve),
                "period": int(period[at][0]),
                "stable": _stable_ranges(places, curves, holds & (curves == curve), 1),
                "force_n": float(force[stable & at].max()) if stable[at].any() else None,
            }
            for curve in np.unique(branch[period > 1])
            for at in [branch == curve]
        ],
        "sensors": dict(_sensors(data, share, stable)),
        "several_stable": _stable_ranges(places, curves, holds, 2),
        "no_stable": _unstable(parameter, branch, stable),
        **{name: _ranges(parameter, branch, mask & stable) for name, mask in contact.items()},
    }


def _jumps(data: xr.Dataset, share: str) -> Iterator[dict[str, Any]]:
    """Each turning point at which the response jumps, with the forces before and after."""
    names = ("parameter", "sense", "force", "target_force")
    for at, sense, top, targets in _rows(data, "turning_point", *names):
        yield {
            share: at,
            "sense": "up" if sense > 0 else "down",
            "force_n": top,
            "to_forces_n": [to for to in targets if math.isfinite(to)],
        }


def _stability_changes(data: xr.Dataset, share: str) -> Iterator[dict[str, Any]]:
    """Each change of stability, with the curve on which it is and one that leaves there."""
    names = ("parameter", "kind", "curve", "leaving")
    for at, kind, curve, new in _rows(data, "stability_change", *names):
        yield {share: at, "kind": KINDS[kind], "curve": curve, "leaving_curve": new or None}


def _sensors(
    data: xr.Dataset, share: str, stable: np.ndarray
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each sensor's largest rms of the signal about its mean among stable states, with the speed or
    torque of that state."""
    for k, name in enumerate(np.asarray(data.coords.get("sensor", ())).tolist()):
        signal = rms_of_states(data, name)
        at = int(np.argmax(np.where(stable, signal, -1.0)))
        unit = str(data["sensor_unit"][k].item())
        rms = float(signal[at])
        yield name, {"rms": rms, "unit": unit, share: float(data[f"response_{share}"][at])}


def _rows(data: xr.Dataset, dim: str, *names: str) -> Iterator[tuple[Any, ...]]:
    """Values of several variables of each turning point or change of stability."""
    return zip(*(data[f"{dim}_{name}"].to_numpy().tolist() for name in names), strict=True)


def _peaks(force: np.ndarray, branch: np.ndarray, stable: np.ndarray) -> list[int]:
    """Indices of the states in which the force has a peak along its curve, by falling force. Peaks
    of unstable states are left out unless a stable state is near."""
    out: list[int] = []
    for curve in np.unique(branch):
        at = np.flatnonzero(branch == curve)
        tops, _ = scipy.signal.find_peaks(force[at], prominence=PROMINENCE * force[at].max())
        near_stable = np.convolve(stable[at], np.ones(2 * NEAR + 1), "same") > 0
        out += [int(at[k]) for k in tops if near_stable[k]]
    return sorted(out, key=lambda k: -force[k])[:MAX_PEAKS]


def _with_changes(
    parameter: np.ndarray, branch: np.ndarray, stable: np.ndarray, changes: list[tuple[Any, ...]]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """λ, curve and stability of all states, with a further stable one at each change of stability
    (λ, curve) between two states."""
    k = np.flatnonzero((np.diff(branch) == 0) & (np.diff(stable.astype(int)) != 0))
    at = [
        (i + 1, value)
        for i in k
        for value, curve in changes
        if curve == branch[i] and (parameter[i] - value) * (parameter[i + 1] - value) <= 0.0
    ]
    places, values = [i for i, _ in at], [value for _, value in at]
    return (
        np.insert(parameter, places, values),
        np.insert(branch, places, branch[places]),
        np.insert(stable, places, True),
    )


def _stable_ranges(
    parameter: np.ndarray, branch: np.ndarray, stable: np.ndarray, count: int
) -> list[list[float]]:
    """Ranges [low, high] of λ in which at least ``count`` stable steady states exist. Ranges of
    several below a share of ``NARROW`` are left out: there a curve leaves another one."""
    along = (branch[1:] == branch[:-1]) & stable[1:] & stable[:-1]
    pairs = np.sort(np.stack([parameter[1:], parameter[:-1]], axis=1)[along], axis=1)
    at = np.r_[pairs[:, 0], pairs[:, 1]]
    change = np.r_[np.ones(len(pairs), dtype=int), -np.ones(len(pairs), dtype=int)]
    order = np.lexsort((change, at))  # at the same λ one piece ends before the next begins
    steps = np.diff(np.cumsum(change[order]) >= count, prepend=False, append=False)
    edges = at[order][np.flatnonzero(steps)]
    spans = _joined(edges.reshape(-1, 2).tolist())
    return [span for span in spans if count == 1 or span[1] > span[0] * (1.0 + NARROW)]


def _unstable(parameter: np.ndarray, branch: np.ndarray, stable: np.ndarray) -> list[list[float]]:
    """Ranges [low, high] of λ without a stable steady state on any curve. A state beside a stable
    one counts as stable, as stability changes somewhere between them."""
    same = branch[1:] == branch[:-1]
    beside = stable | np.r_[False, same & stable[:-1]] | np.r_[same & stable[1:], False]
    spans = _stable_ranges(parameter, branch, beside, 1)
    ends = [parameter.min(), *(end for span in spans for end in span), parameter.max()]
    gaps = np.reshape(ends, (-1, 2)).tolist()
    return [[low, high] for low, high in gaps if high > low * (1.0 + NARROW)]


def _ranges(parameter: np.ndarray, branch: np.ndarray, where: np.ndarray) -> list[list[float]]:
    """Ranges [low, high] of λ in which ``where`` is true on a curve. Gaps below a share of
    ``NARROW``, as at kinks of a curve, are closed."""
    cuts = np.flatnonzero((np.diff(where.astype(int)) != 0) | (np.diff(branch) != 0)) + 1
    split = (np.split(values, cuts) for values in (parameter, where))
    pieces = [piece for piece, holds in zip(*split, strict=True) if holds[:1].any()]
    return _joined([[float(p.min()), float(p.max())] for p in pieces])


def _joined(spans: list[list[float]]) -> list[list[float]]:
    """Ranges in order, without overlaps and gaps below a share of ``NARROW``."""
    joined = list[list[float]]()
    for low, high in sorted(spans):
        if joined and low <= joined[-1][1] * (1.0 + NARROW):
            joined[-1][1] = max(joined[-1][1], high)
        else:
            joined.append([low, high])
    return joined
