"""Load along the face: forces of the slices of tooth pairs, from the approach of their two rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.transient import Transient
from flexgear.coupling.laws.coupled_slices import forces_of
from flexgear.coupling.pair_data import OF_LINE, PairData, narrowing_columns
from flexgear.gears.slices import Line, line_ends

Array = NDArray[np.float64]
LEAST_WIDTH = 1e-6  # of half a face: shorter contact lines have no line load, but rounding over it


@dataclass(frozen=True)
class LineLoads:
    """Slices of gear meshes over samples, (t, M, slots, K), NaN where no pair has slices.

    force N, elastic; z m, middle of a slice along the face; path m, path coordinate there;
    line_load N/m of the face (per length along z, NaN where a contact line has no length); gap m
    between the unloaded flanks there; width m along z; narrowing: half width of the contact of
    modified flanks over that of involutes', at the mean line load of the gear mesh.
    ends: (t, M, slots, 2) m of the contact line along z. approach, tilt: (t, M, slots) m and m/m,
    how far the bodies have closed along N at z = 0 and its slope along z, errors not counted.
    tangent: (t, M, slots, 2, 2) N/m of the pair's two rows under its load.
    """

    force: Array
    z: Array
    path: Array
    line_load: Array
    gap: Array
    width: Array
    narrowing: Array
    ends: Array
    approach: Array
    tilt: Array
    tangent: Array


def line_loads(result: Equilibrium | Transient) -> LineLoads | None:
    """Of all tooth pairs of a result; None where no gear mesh has slices."""
    pairs: PairData = result.modal.system.pairs
    most = int(pairs.slices.max(initial=0))
    if most == 0:
        return None
    shape = result.pair_load.shape

    def empty(*more: int) -> Array:
        return np.full((*shape, *more), np.nan)

    force, z, path, line_load, gap, width, narrowing = (empty(most) for _ in range(7))
    of_pairs = empty(2), empty(), empty(), empty(2, 2)
    out = LineLoads(force, z, path, line_load, gap, width, narrowing, *of_pairs)
    for m, count in enumerate(pairs.slices):
        if count:
            _of_gear_mesh(result, pairs, m, int(count), out)
    return out


def _of_gear_mesh(
    result: Equilibrium | Transient, pairs: PairData, m: int, count: int, out: LineLoads
) -> None:
    at = np.nonzero(result.pair_tooth[:, m] >= 0)  # samples and slots
    s, approaches = result.pair_position[:, m][at], result.pair_approach[:, m][at]
    values = interpolated(pairs, m, s)
    radius = values[:, 0]
    z, stiffness, gap = np.split(values[:, OF_LINE : OF_LINE + 3 * count], 3, axis=1)
    centre = line_centres(pairs, m, s)
    with np.errstate(divide="ignore", invalid="ignore"):
        lever = np.where(radius > 0, 0.5 / radius, 0.0)
    tilt, turned = (
        lever * (approaches[:, 1] - approaches[:, 0]),
        lever * (approaches[:, 3] - approaches[:, 2]),
    )
    middle, approach = approaches[:, :2].mean(axis=1), approaches[:, 2:].mean(axis=1)
    x = middle[:, None] + tilt[:, None] * (z - centre[:, None]) - gap
    far = 0.5 + lever[:, None] * (z - centre[:, None])  # share of the second row in each slice
    if pairs.bent[m]:
        force, tangent = forces_of(x, far, values[:, OF_LINE + 3 * count :])
    else:
        force, shares = stiffness * np.maximum(x, 0.0), np.stack([1.0 - far, far], axis=1)
        tangent = np.einsum("nik,njk,nk->nij", shares, shares, stiffness * (x > 0.0))
    low, high = _ends(pairs, m, s)
    width = (high - low) / count
    width = np.where(width > LEAST_WIDTH * pairs.half_face[m] / count, width, np.nan)
    place = (at[0], np.full_like(at[0], m), at[1])
    slices = (*place, slice(count))
    out.force[slices], out.z[slices], out.gap[slices] = force, z, gap
    out.path[slices], out.width[slices] = s[:, None] + pairs.slope[m] * z, width[:, None]
    out.line_load[slices] = force / width[:, None]
    narrowing = values[:, narrowing_columns(pairs, m)]
    out.narrowing[slices] = narrowing if narrowing.any() else 1.0
    out.ends[place], out.tangent[place] = np.column_stack([low, high]), tangent
    out.approach[place], out.tilt[place] = approach - turned * centre, turned


def line_centres(pairs: PairData, m: int, s: Array) -> Array:
    """Places (n,) m along the face of the centres of contact lines of gear mesh m at s (n,), m:
    the rows of a pair stand beside it."""
    return _at(pairs, m, pairs.z_table[pairs.table[m]], s)


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
