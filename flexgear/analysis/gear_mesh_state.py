r"""First touch and stiffness of gear meshes in slices at given positions.

Rigid bodies without tilt that close along N touch at w = min (g_j − e_j) over the slices j of all
pairs, g_j being the gap of both flanks and e_j the errors of the pair: the unloaded transmission
error, the envelope of what single pairs would do.

Where all rows of a gear mesh are closed by x, their forces are F = f(x − B F) with the tangents T
of the pairs (block by block) and what neighbouring pairs yield to each other, B. Its stiffness is

    dΣF/dx = 1ᵀ (I + T B)⁻¹ T 1 ,

of the teeth alone, bodies being held.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.line_loads import LineLoads, interpolated
from flexgear.analysis.transient import Transient
from flexgear.coupling.kernels.elements import packed, pair_rows
from flexgear.coupling.kernels.pairs import BESIDE, fill_rows
from flexgear.coupling.pair_data import FOLLOWING, OF_LINE, PairData

Array = NDArray[np.float64]


class PairsAt(NamedTuple):
    """Pairs of a result, (t, M, slots): error m at z = 0, less backlash, NaN without a pair;
    planet_tooth from 0, −1 without a pair."""

    error: Array
    planet_tooth: NDArray[np.int16]


def pairs_at(result: Equilibrium | Transient) -> PairsAt:
    """Errors and planets' teeth of all pairs of a result, position by position."""
    pairs: PairData = result.modal.system.pairs
    elements, rows = packed(pairs), pair_rows(pairs)
    error = np.full(result.pair_load.shape, np.nan)
    tooth = np.full(result.pair_load.shape, -1, dtype=np.int16)
    for t, theta in enumerate(np.ascontiguousarray(result.theta)):
        _, _, count = fill_rows(elements, theta, result.active_flanks[t], rows)
        records = rows.pair[:count]
        m, at = records["mesh"], (t, records["mesh"], records["slot"])
        error[at] = records["error"] - pairs.error_slope[m] * records["z"] - pairs.gap[m]
        tooth[at] = records["planet_tooth"]
    return PairsAt(error, tooth)


def first_touch(pairs: PairData, lines: LineLoads, error: Array) -> Array:
    """Approach (t, M) m at which the first slice touches; NaN where there is no pair.

    error (t, M, slots): as of ``PairsAt``.
    """
    along = pairs.error_slope[:, None, None] * lines.z
    left = np.where(np.isfinite(lines.line_load), lines.gap - error[..., None] - along, np.inf)
    least = left.min(axis=(2, 3))
    return np.where(np.isfinite(least), least, np.nan)


def gear_mesh_stiffness(result: Equilibrium | Transient, lines: LineLoads) -> Array:
    """dΣF/dx (t, M) N/m of gear meshes under their load; 0 where no pair touches."""
    pairs: PairData = result.modal.system.pairs
    stiffness = np.nan_to_num(lines.tangent).sum(axis=(2, 3, 4))
    for m in map(int, np.flatnonzero(pairs.bent)):
        for t in range(len(stiffness)):
            slots = np.flatnonzero(result.pair_tooth[t, m] >= 0)
            if len(slots) > 1:
                slots = slots[np.argsort(result.pair_position[t, m, slots])]
                stiffness[t, m] = _together(
                    pairs, m, result.pair_position[t, m, slots], lines.tangent[t, m, slots]
                )
    return stiffness


def _together(pairs: PairData, m: int, s: Array, tangent: Array) -> float:
    """Stiffness N/m of neighbouring pairs of gear mesh m at path coordinates s (n,), rising, with
    tangents (n, 2, 2) N/m."""
    n = len(s)
    between = interpolated(pairs, m, s)[:, BESIDE:OF_LINE].reshape(n, 2, FOLLOWING)
    whole, yields = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    for k in range(n):
        pair_rows, after = slice(2 * k, 2 * k + 2), slice(2 * k + 2, 2 * k + 2 + FOLLOWING)
        whole[pair_rows, pair_rows] = tangent[k]
        yields[pair_rows, after] = between[k][:, : 2 * (n - k - 1)]
        yields[after, pair_rows] = yields[pair_rows, after].T
    ones = np.ones(2 * n)
    return float(ones @ np.linalg.solve(np.eye(2 * n) + whole @ yields, whole @ ones))
