"""Tables of the pairs of gear meshes over their paths of contact: stiffness, gap, slices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.pair_data import WAVE
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.slices import Slices
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]


def stiffness_tables(
    paths: Sequence[GearMeshPath], models: Sequence[int]
) -> tuple[Array, Array, Array, Array, Array]:
    """Tables of equal length on uniform grids: start, step, stiffness, centroid, gap."""
    waves = [model == WAVE for model in models]
    size = max((len(p.s_grid) for p, wave in zip(paths, waves, strict=True) if not wave), default=2)
    size = max([size, *(len(p.slices.s) for p in paths if p.slices is not None)])
    size = max([size, *(len(p.wave) for p in paths if p.wave is not None)])
    start, step, k, z, gap = [], [], [], [], []
    for p, wave in zip(paths, waves, strict=True):
        if wave:
            if p.wave is None:
                raise FlexgearError(f"the {p.kind} gear mesh has no stiffness wave")
            period = np.arange(len(p.wave) + 1) / len(p.wave)
            share = np.arange(size) / size
            start.append(0.0)
            step.append(1.0)
            k.append(np.interp(share, period, [*p.wave, p.wave[0]]))
            z.append(np.zeros(size))
            gap.append(np.zeros(size))
            continue
        path_grid = p.s_grid if p.slices is None else p.slices.s
        grid = np.linspace(path_grid[0], path_grid[-1], size)
        start.append(grid[0])
        step.append(grid[1] - grid[0])
        if p.slices is not None:
            k.append(np.interp(grid, path_grid, p.slices.on_path))
            z.append(np.interp(grid, path_grid, p.slices.centre))
            gap.append(np.zeros(size))
            continue
        k.append(np.interp(grid, p.s_grid, p.k_grid))
        z.append(np.interp(grid, p.s_grid, p.zc_grid))
        gap.append(np.interp(grid, p.s_grid, p.gap_grid))
    return np.array(start), np.array(step), np.array(k), np.array(z), np.array(gap)


def slice_tables(paths: Sequence[GearMeshPath], size: int) -> Array:
    """Tables of slices beside those of ``stiffness_tables``, 0 where a path has none (K, T, …)."""
    columns = [_of_slices(p.slices) for p in paths if p.slices is not None]
    if not columns:
        return np.zeros((len(paths), 0, 0))
    out = np.zeros((len(paths), size, max(c.shape[1] for c in columns)))
    for table, p in zip(out, paths, strict=True):
        if p.slices is None:
            continue
        path_grid = p.slices.s
        grid = np.linspace(path_grid[0], path_grid[-1], size)
        for j, column in enumerate(_of_slices(p.slices).T):
            table[:, j] = np.interp(grid, path_grid, column)
    return out


def _of_slices(slices: Slices) -> Array:
    """The columns that ``PairData.slice_table`` lists, at the S path positions of the slices."""
    bending, count = slices.bending, len(slices.s)
    beside = np.zeros((count, 8)) if bending is None else bending.beside.reshape(count, 8)
    whole = np.column_stack([slices.radius, slices.stiffness.sum(axis=1), beside])
    columns = [whole, slices.z, slices.stiffness, slices.gap]
    if bending is not None:
        columns += [bending.scale, bending.limit, bending.lower]
    if slices.narrowing is not None:
        columns.append(slices.narrowing)
    return np.hstack(columns)
