"""Turning points and changes of stability of curves of steady states; targets of jumps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from flexgear.arrays import Array

NARROW = 2e-3  # of λ: two turning points, or changes, nearer to each other are a kink of contact
BESIDE = 5  # states on either side of a turning point among which one is stable


def turning_points(parameter: Array, branches: Array, arrays: Mapping[str, Any]) -> dict[str, Any]:
    """Variables of the turning points and changes of stability of curves.

    parameter (s,): λ along the curves; branches (s,): their numbers; arrays: variables of the
    states, with "stable" and "response_gear_mesh_force".
    """
    force = arrays["response_gear_mesh_force"][:, :, 0].max(axis=1)
    stable = arrays["stable"] == 1
    folds = [
        fold
        for fold in _folds(parameter, branches, force)
        if stable[max(fold[0] - BESIDE, 0) : fold[0] + BESIDE + 1].any()
    ]
    targets = [_targets(parameter, branches, stable, force, k, at) for k, at, _, _ in folds]
    most = max(map(len, targets), default=0)
    changes = list(_changes(parameter, branches, stable, arrays))
    return {
        "turning_point_parameter": np.array([at for _, at, _, _ in folds]),
        "turning_point_force": np.array([top for _, _, top, _ in folds]),
        "turning_point_sense": np.array([sense for *_, sense in folds], dtype=int),
        "turning_point_target_force": np.array(
            [[*forces, *[np.nan] * (most - len(forces))] for forces in targets]
        ).reshape(len(folds), most),
        "stability_change_parameter": np.array([x[0] for x in changes]),
        "stability_change_kind": np.array([x[1] for x in changes], dtype=int),
    }


def _folds(parameter: Array, branches: Array, force: Array) -> list[tuple[int, float, float, int]]:
    """Index of the state next to a turning point, λ and force there, and 1 where λ has its largest
    value (a sweep up jumps), −1 the smallest."""
    out: list[tuple[int, float, float, int]] = []
    for k in range(1, len(parameter) - 1):
        before, after = parameter[k] - parameter[k - 1], parameter[k + 1] - parameter[k]
        if branches[k - 1] != branches[k + 1] or before * after >= 0.0:
            continue
        sense = 1 if before > 0.0 else -1
        value, top = _vertex(parameter[k - 1 : k + 2], force[k - 1 : k + 2])
        last = out[-1] if out else None
        if last and branches[last[0]] == branches[k] and abs(value / last[1] - 1.0) < NARROW:
            out.pop()
        else:
            out.append((k, value, top, sense))
    return out


def _vertex(parameter: Array, force: Array) -> tuple[float, float]:
    """λ and force at the vertex of the parabola λ(force) through three states; the middle one where
    there is no parabola."""
    middle, spread = force[1], np.ptp(force)
    if spread == 0.0 or (force[1] - force[0]) * (force[2] - force[1]) <= 0.0:
        return float(parameter[1]), float(middle)
    a, b, c = np.polyfit((force - middle) / spread, parameter, 2)
    x = -b / (2 * a) if a else 0.0
    return float(c + b * x + a * x * x), float(middle + spread * x)


def _targets(
    parameter: Array, branches: Array, stable: Array, force: Array, fold: int, value: float
) -> list[float]:
    """Forces of all other stable states at λ, rising; the way of a sweep decides among them."""
    low, high, same = parameter[:-1], parameter[1:], branches[:-1] == branches[1:]
    adjacent = (branches[:-1] == branches[fold]) & (np.abs(np.arange(len(low)) + 0.5 - fold) < 2)
    crosses = same & ((low <= value) != (high <= value)) & ~adjacent
    k = np.flatnonzero(crosses & (stable[:-1] == 1) & (stable[1:] == 1))
    w = (value - low[k]) / (high[k] - low[k])
    return sorted(map(float, (1 - w) * force[k] + w * force[k + 1]))


TURNING, DOUBLED, SECOND_FREQUENCY = range(3)  # kinds of a loss of stability
KINDS = ("turning point", "doubled period", "second frequency")
REAL = 1e-6  # imaginary part of a multiplier that is real
LEAST = 1e-12  # modulus of a multiplier


def _changes(
    parameter: Array, branches: Array, stable: Array, arrays: Mapping[str, Any]
) -> list[tuple[float, int]]:
    """λ, where the modulus of the largest multiplier is one between two states, and kind of
    changes of stability."""
    real, imag = arrays["multiplier_real"], arrays["multiplier_imag"]
    over = np.log(np.maximum(np.hypot(real, imag), LEAST))
    out = list[tuple[float, int]]()
    for k in range(len(parameter) - 1):
        if branches[k] != branches[k + 1] or stable[k] == stable[k + 1]:
            continue
        loose = k if not stable[k] else k + 1
        kind = SECOND_FREQUENCY
        if abs(imag[loose]) <= REAL:
            kind = TURNING if real[loose] > 0.0 else DOUBLED
        w = float(np.clip(over[k] / (over[k] - over[k + 1]), 0.0, 1.0))
        value = float((1.0 - w) * parameter[k] + w * parameter[k + 1])
        if out and abs(value / out[-1][0] - 1.0) < NARROW:
            out.pop()
        else:
            out.append((value, kind))
    return out
