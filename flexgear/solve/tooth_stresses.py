"""Largest stresses at places of flanks and fillets, pass by pass, from equilibria of one load bin.

A *pass* is a gear-mesh cycle of one planet. In it contact lines sweep over the whole flank once,
and all teeth in contact together are loaded as one tooth is from first touch to last. A flank is
cut into places over the path of contact (roll angle) and along the face, a fillet into places along
the face.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.line_loads import line_loads
from flexgear.arrays import Array
from flexgear.gears.geometry import stage_geometry
from flexgear.model.names import GroupName
from flexgear.model.stage_view import StageView
from flexgear.solve.model import Model
from flexgear.solve.stresses import tooth_roots

OF_FLANKS = ("contact_pressure", "slice_path", "slice_position")
OF_ROOTS = (
    "face_root_stress", "face_root_compression", "root_side", "tooth_root_least",
)  # fmt: skip


@dataclass(frozen=True)
class GroupStresses:
    """Of N planets in C gear-mesh cycles.

    azimuth: (N, C) of the planet against the ring, rad; path: (P,) m from the planet's base tangent
    point, middles of places; pressure: (N, C, P, F) Pa, largest Hertz pressure. tension,
    compression: (N, C, 2, F') Pa in planet and mate, largest stress in the fillet under the loaded
    flank and least in the other; of no length without FE roots. lowest: (z,) Pa, least stress in
    that fillet of every tooth of an FE ring at any position, of no length of others.
    """

    azimuth: Array
    path: Array
    pressure: Array
    tension: Array
    compression: Array
    lowest: Array


def group_stresses(
    data: xr.Dataset, view: StageView, group: GroupName, per_cycle: int
) -> GroupStresses:
    """Of equilibria over whole gear-mesh cycles; data: of the flanks of a group that carry, one a
    planet."""
    carrier, ring = (
        data[name].sel(turning_stage=view.name).to_numpy().reshape(-1, per_cycle).mean(axis=1)
        for name in ("carrier_angle", "ring_angle")
    )
    path, pressure = _pressures(data, view, group, per_cycle)
    tension = compression = np.zeros((*pressure.shape[:2], 2, 0))
    lowest = np.zeros(0)
    if view.gear_mesh.root_stress == "fe":
        tension = _of_cycles(data["face_root_stress"], per_cycle, np.fmax)
        compression = _of_cycles(data["face_root_compression"], per_cycle, np.fmin)
        if group.kind == "ring" and "tooth_root_least" in data:
            lowest = _lowest(data, group)
    planets = np.array(view.stage.planet_angles)[:, None]
    azimuth = np.mod(carrier - ring + planets, 2.0 * math.pi)
    return GroupStresses(azimuth, path, pressure, tension, compression, lowest)


def _pressures(
    data: xr.Dataset, view: StageView, group: GroupName, per_cycle: int
) -> tuple[Array, Array]:
    """Middles of places on the path (P,) m, and pressure (N, C, P, F) Pa. Contact lines stand a
    ``per_cycle``-th of a base pitch apart, and no place is narrower. What touches before or after
    the path counts for its ends."""
    pressure, path, z = (
        data[name].transpose("position", "flank", ...).to_numpy() for name in OF_FLANKS
    )
    gear_mesh = stage_geometry(view).gear_meshes[group.kind]
    start, end, slices = gear_mesh.s_lo, gear_mesh.s_hi, pressure.shape[-1]
    count = max(int((end - start) / gear_mesh.base_pitch * per_cycle), 1)
    at, flank, *_ = loaded = np.nonzero(pressure > 0.0)
    across = (path[loaded] - start) / (end - start) * count
    along = (0.5 + z[loaded] / view.stage.face_width) * slices
    place = (np.clip(x.astype(int), 0, n - 1) for x, n in ((across, count), (along, slices)))
    largest = np.zeros((pressure.shape[1], len(pressure) // per_cycle, count, slices))
    np.maximum.at(largest, (flank, at // per_cycle, *place), pressure[loaded])
    return start + (np.arange(count) + 0.5) * (end - start) / count, largest


def _of_cycles(values: xr.DataArray, per_cycle: int, most: np.ufunc) -> Array:
    """Largest or least (N, C, …) over the positions of each cycle, 0 without load."""
    array = values.transpose("position", "flank", ...).to_numpy()
    array = array.reshape(-1, per_cycle, *array.shape[1:])
    return np.nan_to_num(np.moveaxis(most.reduce(array, axis=1), 1, 0))


def _lowest(data: xr.Dataset, group: GroupName) -> Array:
    """(z,) Pa at the point of each tooth's fillet where it is stretched most."""
    fillet = 0 if float(data["root_side"].isel(flank=0, pair_member=1)) < 0.0 else 1
    of_ring = (data["tooth_stage"] == group.stage) & (data["tooth_side"] == group.side)
    least = data["tooth_root_least"].isel(fillet=fillet).to_numpy()
    return np.asarray(least[of_ring.to_numpy()])


@dataclass(frozen=True)
class HeldRoots:
    """Of one gear in one gear mesh over a cycle: largest stress in the roots, Pa, where the body
    below the teeth stands still; that of the same pair then with its load even along the contact
    line; and this load, N."""

    held: float
    even: float
    pair_load: float


def held_roots(model: Model, result: Equilibrium, flank: int, member: int) -> HeldRoots:
    """flank: of the system; member: 0 its planet, 1 the mate; result: over a gear-mesh cycle."""
    label, tables = model.system.gear_meshes[flank], model.root_tables
    loads = line_loads(result)
    assert loads is not None  # the case asks for roots, which want slices
    force = loads.force[:, flank, :, : int(model.system.pairs.slices[flank])]
    even = np.broadcast_to(force.mean(axis=2, keepdims=True), force.shape)
    roots, pitch = tables.of(label)[member], tables.path(label).base_pitch
    held, of_even = (
        tooth_roots(roots, result.pair_position[:, flank], of, pitch).tension.max(axis=(2, 3))
        for of in (force, even)
    )
    at = np.unravel_index(int(np.nanargmax(held)), held.shape)
    load = result.pair_load[:, flank]
    return HeldRoots(float(held[at]), float(of_even[at]), float(load[at]))
