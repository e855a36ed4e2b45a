"""Turning points and changes of stability of curves of steady states; targets of jumps.

Curves have a state at each turning point (``analysis.curve_follower``), from which λ and force are
taken: the force changes much along a curve that is sharp there, as just behind a loss of contact.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from flexgear.arrays import Array

NARROW = 2e-3  # relative distance in λ below which two turning points or changes cancel (a kink)
ROUNDING = 1e-9  # relative difference of λ between states at constant λ
NEAR = 5  # states on either side of a turning point, of which one must be stable


def turning_points(
    parameter: Array,
    branches: Array,
    arrays: Mapping[str, Any],
    leaving: Mapping[int, int] | None = None,
) -> dict[str, Any]:
    """Variables of the turning points and changes of stability of curves.

    parameter (s,): λ along the curves; branches (s,): number of the curve of each state; arrays:
    variables of the states, with "stable" and "response_gear_mesh_force"; leaving: by the index of
    a state, number of the curve that branches off after it. Where that curve meets the other one
    again, changes of its stability by the error of multipliers are left out.
    """
    force = arrays["response_gear_mesh_force"][:, :, 0].max(axis=1)
    stable = arrays["stable"] == 1
    folds = []
    for k, sense in _folds(parameter, branches):
        near = slice(max(k - NEAR, 0), k + NEAR + 1)
        if (stable[near] & (branches[near] == branches[k])).any():
            folds.append((k, sense))
    at, growth = [k for k, _ in folds], _growth(arrays)
    targets = [_targets(parameter, branches, growth, force, k) for k in at]
    width = max(map(len, targets), default=0)
    of_state, changes = leaving or {}, stability_changes(parameter, branches, arrays)
    meets = [(of_state[x.before], x.value) for x in changes if x.before in of_state]
    changes = [
        x for x in changes if x.kind != BRANCH or x.before in of_state
        or all(n != branches[x.before] or abs(x.value / v - 1) >= NARROW for n, v in meets)
    ]  # fmt: skip
    return {
        "turning_point_parameter": parameter[at],
        "turning_point_force": force[at],
        "turning_point_sense": np.array([sense for _, sense in folds], dtype=int),
        "turning_point_target_force": np.array(
            [[*forces, *[np.nan] * (width - len(forces))] for forces in targets]
        ).reshape(len(folds), width),
        "stability_change_parameter": np.array([x.value for x in changes]),
        "stability_change_kind": np.array([x.kind for x in changes], dtype=int),
        "stability_change_curve": np.array([branches[x.before] for x in changes], dtype=int),
        "stability_change_leaving": np.array(
            [of_state.get(x.before, 0) for x in changes], dtype=int
        ),
    }


def _folds(parameter: Array, branches: Array) -> list[tuple[int, int]]:
    """Index of the state at each turning point of λ, with 1 for a maximum, where a rising sweep
    jumps, or −1 for a minimum; of turning points with kinks between them the one farthest out."""
    out, kink = list[tuple[int, int]](), list[tuple[int, int]]()
    steps = np.diff(parameter)
    steps[np.abs(steps) < ROUNDING * parameter[1:]] = 0.0
    for k in range(1, len(parameter) - 1):
        before, after = steps[k - 1 : k + 1]
        if branches[k - 1] != branches[k + 1] or before * after >= 0.0:
            continue
        near = [
            x for x in (*out[-1:], *kink)
            if branches[x[0]] == branches[k] and abs(parameter[k] / parameter[x[0]] - 1.0) < NARROW
        ]  # fmt: skip
        if out and out[-1] in near:
            kink = [out.pop()]
            continue
        fold = k, 1 if before > 0.0 else -1
        out.append(max((fold, *near), key=lambda x: x[1] * parameter[x[0]]))
        kink = []
    return out


def _targets(
    parameter: Array, branches: Array, growth: Array, force: Array, fold: int
) -> list[float]:
    """Forces of all other stable states at λ of the state ``fold``, a turning point, rising, to one
    of which a sweep jumps."""
    value = parameter[fold]
    low, high, same = parameter[:-1], parameter[1:], branches[:-1] == branches[1:]
    adjacent = (branches[:-1] == branches[fold]) & (np.abs(np.arange(len(low)) + 0.5 - fold) < 2)
    crosses = same & ((low <= value) != (high <= value)) & ~adjacent
    k = np.flatnonzero(crosses)
    w = (value - low[k]) / (high[k] - low[k])
    stable = (1 - w) * growth[k] + w * growth[k + 1] <= 0.0
    k, w = k[stable], w[stable]
    return sorted(map(float, (1 - w) * force[k] + w * force[k + 1]))


TURNING, DOUBLED, SECOND_FREQUENCY, BRANCH = range(4)  # kinds of loss of stability
KINDS = ("turning point", "doubled period", "second frequency", "broken symmetry")
REAL = 1e-6  # imaginary part below which a multiplier is real
LEAST_MODULUS = 1e-12  # of a multiplier, for its logarithm


class Change(NamedTuple):
    """A change of stability between the state ``before`` and the next one: λ at which the largest
    multiplier has modulus 1, and its kind."""

    before: int
    value: float
    kind: int


def stability_changes(parameter: Array, branches: Array, arrays: Mapping[str, Any]) -> list[Change]:
    """Changes of stability along curves; see ``turning_points``."""
    real, imag, stable = (arrays[n] for n in ("multiplier_real", "multiplier_imag", "stable"))
    growth, steps = _growth(arrays), np.diff(parameter)
    turning = 1 + np.flatnonzero((steps[1:] * steps[:-1] < 0) & (branches[2:] == branches[:-2]))
    out = list[Change]()
    for k in range(len(parameter) - 1):
        if branches[k] != branches[k + 1] or stable[k] == stable[k + 1]:
            continue
        unstable = k if not stable[k] else k + 1
        w = float(np.clip(growth[k] / (growth[k] - growth[k + 1]), 0.0, 1.0))
        value = float((1.0 - w) * parameter[k] + w * parameter[k + 1])
        kind = SECOND_FREQUENCY
        if abs(imag[unstable]) <= REAL:
            # by their error multipliers may pass 1 some states beside the turning point
            at = turning[branches[turning] == branches[k]]
            states, distance = np.abs(at - k - 0.5), np.abs(parameter[at] / value - 1.0)
            turns = ((states < 1) | ((states < NEAR) & (distance < NARROW))).any()
            kind = DOUBLED if real[unstable] < 0.0 else TURNING if turns else BRANCH
        last = out[-1] if out else None
        if last and branches[last.before] == branches[k] and abs(value / last.value - 1) < NARROW:
            out.pop()
        else:
            out.append(Change(k, value, kind))
    return out


def _growth(arrays: Mapping[str, Any]) -> Array:
    """Logarithm of the modulus of the largest multiplier of each state; ≤ 0 for stable ones."""
    modulus = np.hypot(arrays["multiplier_real"], arrays["multiplier_imag"])
    growth = np.log(np.maximum(modulus, LEAST_MODULUS))
    return np.asarray(np.where(arrays["stable"] == 1, np.minimum(growth, 0.0), growth))
