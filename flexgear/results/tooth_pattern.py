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
from numpy.typing import NDArray
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
    flanks = [_at_gear(data.sel(flank=name)) for name in loaded_flanks(data)[group]]
    return _pattern(group, "pair_tooth", flanks)


def planet_pattern(data: xr.Dataset, group: GroupName) -> ToothPattern:
    """Pattern of planet 1, or the gear of a parallel stage, on flanks towards ring, sun or
    pinion."""
    flank = data.sel(flank=loaded_flanks(data)[group][0])
    places = _places(flank, _path(flank), float(flank["planet_base_diameter"]))
    title = f"{group.stage} planet 1, flanks towards {group.part}"
    return _pattern(title, "pair_planet_tooth", [places])


class _Places(NamedTuple):
    """Slices (n,): roll length, base radius and position along the face, m; line load, N/m; teeth
    of gear and planet from 1."""

    roll: Array
    base: float
    face: Array
    load: Array
    teeth: dict[str, NDArray[np.int64]]


def _at_gear(flank: xr.Dataset) -> _Places:
    sign = 1.0 if str(flank["flank_kind"].item()) == "ring" else -1.0
    roll = float(flank["gear_roll_offset"]) + sign * _path(flank)
    return _places(flank, roll, float(flank["gear_base_diameter"]))


def _path(flank: xr.Dataset) -> Array:
    """Path coordinates of slices, m, limited to the ends of the path for tip contact."""
    start, end = float(flank["path_start"]), float(flank["path_end"])
    return np.clip(flank["slice_path"].to_numpy(), start, end)


def _places(flank: xr.Dataset, roll: Array, base: float) -> _Places:
    load, path = flank["line_load"].to_numpy(), flank["slice_path"].to_numpy()
    on_path = (path >= float(flank["path_start"])) & (path <= float(flank["path_end"]))
    at = np.isfinite(load) & (on_path | (load > 0))  # without tips that are not in contact
    teeth = {
        name: np.broadcast_to(flank[name].to_numpy()[..., None], load.shape)[at].astype(np.int64)
        for name in ("pair_tooth", "pair_planet_tooth")
    }
    return _Places(roll[at], 0.5 * base, flank["slice_position"].to_numpy()[at], load[at], teeth)


def _pattern(title: str, which: str, flanks: list[_Places]) -> ToothPattern:
    roll, face, load = (
        np.concatenate([getattr(flank, name) for flank in flanks])
        for name in ("roll", "face", "load")
    )
    teeth = np.concatenate([flank.teeth[which] for flank in flanks])
    cells = (teeth, 2.0 * np.hypot(flanks[0].base, roll), face)
    edges = [np.arange(0.5, teeth.max() + 1.0)]
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
