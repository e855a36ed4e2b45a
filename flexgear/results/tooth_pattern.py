"""Contact pattern of every tooth of a gear: largest line load over face and diameter.

A slice of a contact line at the path coordinate s is at the roll length s of the planet and
|offset ± s| of ring or sun, and at the diameter d = 2 √((d_b/2)² + roll²) of each. Tip contact off
the path of contact is placed at the end of the path. Cells that no contact line crosses are
interpolated between their neighbours.
"""

from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr
from scipy.interpolate import griddata

from flexgear.arrays import Array
from flexgear.model.names import FlankName, GroupName

CELLS = (10, 16)  # numbers of cells of a flank over diameter and face


class ToothPattern(NamedTuple):
    """Contact pattern of a gear.

    title: gear and flank; diameter (D + 1,), face (F + 1,): edges of cells, m; line_load (teeth, D,
    F): largest line load over all positions, N/m, NaN for cells without contact.
    """

    title: str
    diameter: Array
    face: Array
    line_load: Array


def loaded_flanks(data: xr.Dataset) -> dict[GroupName, list[FlankName]]:
    """Names of loaded flanks by group of gear meshes."""
    groups: dict[GroupName, list[FlankName]] = {}
    for name in map(FlankName.parse, data["flank"].to_numpy().tolist()):
        if float(data["face_line_load"].sel(flank=name).max()) > 0:
            groups.setdefault(name.group, []).append(name)
    return groups


def gear_pattern(data: xr.Dataset, group: GroupName) -> ToothPattern:
    """Pattern on all teeth of ring, sun or pinion from all planets."""
    slices = []
    for flank in (data.sel(flank=name) for name in loaded_flanks(data)[group]):
        sign = 1.0 if str(flank["flank_kind"].item()) == "ring" else -1.0
        roll = float(flank["gear_roll_offset"]) + sign * _path(flank)
        slices.append(_slices(flank, "pair_tooth", roll, float(flank["gear_base_diameter"])))
    return _pattern(group, slices)


def planet_pattern(data: xr.Dataset, group: GroupName) -> ToothPattern:
    """Pattern of planet 1, or the gear of a parallel stage, on flanks towards ring, sun or
    pinion."""
    flank = data.sel(flank=loaded_flanks(data)[group][0])
    base = float(flank["planet_base_diameter"])
    title = f"{group.stage} planet 1, flanks towards {group.part}"
    return _pattern(title, [_slices(flank, "pair_planet_tooth", _path(flank), base)])


def _path(flank: xr.Dataset) -> Array:
    """Path coordinates of slices, m, limited to the ends of the path for tip contact."""
    start, end = float(flank["path_start"]), float(flank["path_end"])
    return np.clip(flank["slice_path"].to_numpy(), start, end)


def _slices(flank: xr.Dataset, teeth: str, roll: Array, base: float) -> Array:
    """Tooth from 1, diameter and position along the face, m, and line load, N/m, of slices (4, n).

    teeth: variable with the numbers of the teeth; roll: roll lengths of the slices, base: base
    diameter, m.
    """
    load, path = flank["line_load"].to_numpy(), flank["slice_path"].to_numpy()
    on_path = (path >= float(flank["path_start"])) & (path <= float(flank["path_end"]))
    at = np.isfinite(load) & (on_path | (load > 0))  # without tips that are not in contact
    number = np.broadcast_to(flank[teeth].to_numpy()[..., None], load.shape)
    columns = (number, 2.0 * np.hypot(0.5 * base, roll), flank["slice_position"].to_numpy(), load)
    return np.array([column[at] for column in columns], dtype=float)


def _pattern(title: str, slices: list[Array]) -> ToothPattern:
    """The pattern of ``_slices`` of one flank or several."""
    *cells, load = np.concatenate(slices, axis=1)
    edges = [np.arange(0.5, cells[0].max() + 1.0)]
    edges += [np.linspace(x.min(), x.max(), n + 1) for x, n in zip(cells[1:], CELLS, strict=True)]
    pattern = scipy.stats.binned_statistic_dd(np.column_stack(cells), load, "max", edges).statistic
    return ToothPattern(title, edges[1], edges[2], np.array(list(map(filled, pattern))))


def filled(cells: Array) -> Array:
    """Values (m, n) with NaN interpolated between finite ones where these surround it."""
    finite = np.isfinite(cells)
    at = np.argwhere(finite)
    if len(at) < 4 or not np.ptp(at, axis=0).all():
        return cells
    whole = griddata(at, cells[finite], np.indices(cells.shape).reshape(2, -1).T)
    return np.where(finite, cells, whole.reshape(cells.shape))
