"""Load along the face: forces of the slices of tooth pairs, from the approach of their two rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.transient import Transient
from flexgear.coupling.pair_data import OF_LINE, PairData
from flexgear.gears.slices import Line, line_ends

Array = NDArray[np.float64]
LEAST_WIDTH = 1e-6  # of half a face: shorter contact lines have no line load, but rounding over it


@dataclass(frozen=True)
class LineLoads:
    """Slices of gear meshes over samples: (t, M, SLOTS, K), NaN where no pair has slices.

    force N, elastic; z m, middle of a slice along the face; width m of a slice along z; line_load
    N/m of the face (per length along z); gap m between the unloaded flanks there.
    """

    force: Array
    z: Array
    width: Array
    gap: Array

    @property
    def line_load(self) -> Array:
        """w (t, M, SLOTS, K), N/m; NaN where a contact line has no length."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.force / self.width)


def line_loads(result: Equilibrium | Transient) -> LineLoads | None:
    """Of all tooth pairs of a result; None where no gear mesh has slices."""
    pairs: PairData = result.modal.system.pairs
    most = int(pairs.slices.max(initial=0))
    if most == 0:
        return None
    shape = (*result.pair_load.shape, most)
    out = LineLoads(*(np.full(shape, np.nan) for _ in range(4)))
    for m, count in enumerate(pairs.slices):
        if count:
            _of_gear_mesh(result, pairs, m, int(count), out)
    return out


def _of_gear_mesh(
    result: Equilibrium | Transient, pairs: PairData, m: int, count: int, out: LineLoads
) -> None:
    at = np.nonzero(result.pair_tooth[:, m] >= 0)  # samples and slots
    s, approach = result.pair_position[:, m][at], result.pair_approach[:, m][at]
    values = interpolated(pairs, m, s)
    radius = values[:, 0]
    z, stiffness, gap = np.split(values[:, OF_LINE : OF_LINE + 3 * count], 3, axis=1)
    centre = _at(pairs, m, pairs.z_table[pairs.table[m]], s)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(
            radius[:, None] > 0, 0.5 * (1.0 + (z - centre[:, None]) / radius[:, None]), 0.5
        )
    x = (1.0 - share) * approach[:, :1] + share * approach[:, 1:] - gap
    force = stiffness * (np.maximum(x, 0.0) if pairs.sided[m] else x)
    low, high = _ends(pairs, m, s)
    width = (high - low) / count
    width = np.where(width > LEAST_WIDTH * pairs.half_face[m] / count, width, np.nan)
    place = (at[0], np.full_like(at[0], m), at[1], slice(count))
    out.force[place], out.z[place], out.gap[place] = force, z, gap
    out.width[place] = width[:, None]


def interpolated(pairs: PairData, m: int, s: Array) -> Array:
    """Rows (n, …) of the table of slices of gear mesh m at path coordinates s (n,), m."""
    return _at(pairs, m, pairs.slice_table[pairs.table[m]], s)


def _at(pairs: PairData, m: int, table: Array, s: Array) -> Array:
    k = pairs.table[m]
    y = np.clip((s - pairs.table_start[k]) / pairs.table_step[k], 0.0, len(table) - 1.0)
    j = np.minimum(y.astype(int), len(table) - 2)
    w = (y - j).reshape(-1, *[1] * (table.ndim - 1))
    return np.asarray((1.0 - w) * table[j] + w * table[j + 1])


def _ends(pairs: PairData, m: int, s: Array) -> tuple[Array, Array]:
    """Ends of contact lines along z (n,), m."""
    span = (float(pairs.s_lo[m]), float(pairs.s_hi[m]))
    return line_ends(s, Line(span, span, float(pairs.slope[m]), float(pairs.half_face[m])))
