"""Stress in the roots of the teeth that carry and in rims of rings; of a load bin pass by pass.

A *pass* is a gear-mesh cycle of one planet. In it contact lines sweep over the whole flank once,
and all teeth in contact together are loaded as one tooth is from first touch to last. A flank is
cut into places over the path of contact (roll angle) and along the face, a fillet into places along
the face.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.line_loads import LineLoads, line_loads
from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array
from flexgear.coupling.gear_meshes import GearMeshLabel
from flexgear.coupling.system import System
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import PathKey, stage_paths
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.bodies import Material
from flexgear.model.case import Case
from flexgear.model.names import BodyName, GroupName
from flexgear.model.stage_view import StageView
from flexgear.solve.bodies import Bodies
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.surface_strain import Ray, Surface
from flexgear.structures.tooth_influence.roots import (
    PairRoots,
    pair_roots,
    ring_root_rows,
    root_of_case,
)

MEMBERS = ("planet", "gear")  # of a tooth pair
FILLETS = ("-theta", "+theta")


class RootTables:
    """Root stress per force of slices by stage, kind and side of gear meshes, and in FE rings per
    coordinate of their body; made when asked."""

    def __init__(self, case: Case, flow: PowerFlow, bodies: Bodies) -> None:
        self.views = [case.view(stage.name) for stage in case.stages]
        self.with_roots = [view.gear_mesh.root_stress == "fe" for view in self.views]
        # stages with a node at every tooth of their ring
        self.fe_rings = [k for k, v in enumerate(self.views) if v.name in case.fe_ring_stages]
        self._flow, self._bodies = flow, bodies
        self.paths = cache(self._paths)
        self._roots = cache(self._pair_roots)
        self.ring_rows = cache(self._ring_rows)

    def of(self, label: GearMeshLabel) -> list[PairRoots]:
        """Root tables of the planet, then of its mate."""
        return self._roots(label.stage, (label.kind, label.side))

    def path(self, label: GearMeshLabel) -> GearMeshPath:
        """Path of the pairs."""
        return self.paths(label.stage)[label.kind, label.side]

    def _paths(self, stage: int) -> dict[PathKey, GearMeshPath]:
        return stage_paths(self.views[stage], self._flow.stages[stage].gear_mesh_forces)

    def _pair_roots(self, stage: int, key: PathKey) -> list[PairRoots]:
        path = self.paths(stage)[key]
        assert path.slices is not None
        return pair_roots(self.views[stage], path, path.slices)

    def _ring_rows(self, stage: int) -> NDArray[np.float32]:
        """(z, 2, rows, q, d) Pa: see ``ring_root_rows``."""
        view = self.views[stage]
        body = self._bodies[BodyName.of(view.name, "ring")]
        return ring_root_rows(root_of_case(view, "ring"), body, view.ring_gear.teeth)


class Roots(NamedTuple):
    """tension, compression: (t, slots, rows, q) Pa in the roots of the teeth of one gear in one
    gear mesh, in the fillet under the loaded flank and in the other; not a number where a slot has
    no load."""

    tension: Array
    compression: Array


def tooth_roots(roots: PairRoots, s: Array, force: Array, base_pitch: float) -> Roots:
    """Root stress of pairs at s (t, slots) m with forces of their slices (t, slots, K) N, NaN where
    there is no pair; s of neighbouring pairs differ by the base pitch."""
    loaded = _loaded(force)
    of_pairs = np.zeros((*loaded.shape, *roots.stress.shape[2:]))
    of_pairs[loaded] = roots.of(s[loaded], force[loaded])
    stress = of_pairs[:, :, 1].copy()
    for a, b in np.ndindex(loaded.shape[1], loaded.shape[1]):
        pitches = np.round((s[:, b] - s[:, a]) / base_pitch)
        for side in (1, -1):  # the pair in slot b is this many teeth further on in +θ
            adjacent = loaded[:, a] & loaded[:, b] & (pitches == side * roots.step)
            stress[adjacent, a] += of_pairs[adjacent, b, 1 + side]
    stress[~loaded] = np.nan
    return Roots(stress[:, :, 0], stress[:, :, 1])


def ring_roots(tables: RootTables, recovery: Recovery, lines: LineLoads, stage: int) -> Array:
    """Stress (t, z, 2, rows, q) Pa in both fillets of all teeth of an FE ring: of the motion of its
    body, and of all pairs on each tooth and on those beside it."""
    result = recovery.result
    system = result.modal.system
    of_stage = [m for m, x in enumerate(system.gear_meshes) if x.stage == stage]
    flanks = [m for m in of_stage if system.gear_meshes[m].kind.internal]
    body, teeth = f"{tables.views[stage].name}.ring", int(system.pairs.gear_teeth[flanks[0]])
    shape = tables.of(system.gear_meshes[flanks[0]])[1].stress.shape[3:]
    out = np.zeros((len(result.theta), teeth, *shape), dtype=np.float32)
    if not system.body(body).rigid:
        rows = tables.ring_rows(stage)
        motion = recovery.coordinates(body).astype(np.float32)
        out += (motion @ rows.reshape(-1, rows.shape[-1]).T).reshape(out.shape)
    for m in flanks:
        force = lines.force[:, m, :, : int(system.pairs.slices[m])]
        loaded = _loaded(force)
        if loaded.any():
            roots = tables.of(system.gear_meshes[m])[1]
            stress = roots.of(result.pair_position[:, m][loaded], force[loaded])
            at, tooth = np.nonzero(loaded)[0], result.pair_tooth[:, m][loaded].astype(np.int64)
            for offset in (1, 0, -1):  # the tooth after the pair's own, that, the one before
                fillets = stress[:, 1 - offset, :: roots.sense].astype(np.float32)
                np.add.at(out, (at, (tooth + offset) % teeth), fillets)
    return out


def root_arrays(
    tables: RootTables, recovery: Recovery, lines: LineLoads, places: Array
) -> dict[str, Any]:
    """Variables of root stress; along the face at places, −1/2 … 1/2 of its width, if any are
    given. Empty where no stage asks for it."""
    result = recovery.result
    system, with_roots = result.modal.system, tables.with_roots
    if not any(with_roots):
        return {}
    shape = (len(result.theta), len(system.gear_meshes), len(MEMBERS))
    largest, side = np.full(shape, np.nan), np.zeros(shape[1:])
    along = np.full((2, *shape, len(places)), np.nan)
    rings = {k: ring_roots(tables, recovery, lines, k) for k in tables.fe_rings if with_roots[k]}
    for m, label in enumerate(system.gear_meshes):
        if not with_roots[label.stage]:
            continue
        path, force = tables.path(label), lines.force[:, m, :, : int(system.pairs.slices[m])]
        side[m] = path.planet_step, -path.gear_step
        if not _loaded(force).any():
            continue
        for k, roots in enumerate(tables.of(label)):
            if roots.name == "ring" and label.stage in rings:
                teeth = result.pair_tooth[:, m]
                variables = _of_teeth(rings[label.stage], teeth, _loaded(force), roots.sense)
            else:
                variables = tooth_roots(roots, result.pair_position[:, m], force, path.base_pitch)
            tension = np.fmax.reduce(variables.tension, axis=(1, 2))
            compression = np.fmin.reduce(variables.compression, axis=(1, 2))
            largest[:, m, k] = tension.max(axis=1)
            for i, curve in enumerate((tension, compression)):
                along[i, :, m, k] = _at(roots.z, curve, 2.0 * path.half_face * places)
    arrays = {"root_stress": largest, "root_side": side}
    if len(places):
        arrays |= {"face_root_stress": along[0], "face_root_compression": along[1]}
    static = isinstance(result, Equilibrium)
    return arrays | _by_tooth(tables, rings, len(result.theta), ranges=static)


def _loaded(force: Array) -> NDArray[np.bool_]:
    """Whether the tooth pair of each slot (t, slots) carries load."""
    return np.asarray(np.isfinite(force).all(axis=2) & (np.nansum(force, axis=2) > 0.0))


def _of_teeth(
    ring: Array, tooth: NDArray[np.int16], loaded: NDArray[np.bool_], sense: int
) -> Roots:
    """Part of a ring's stress (t, z, 2, rows, q) that belongs to pairs on teeth (t, slots)."""
    stress = ring[np.arange(len(ring))[:, None], np.maximum(tooth, 0)].astype(float)[:, :, ::sense]
    stress[~loaded] = np.nan
    return Roots(stress[:, :, 0], stress[:, :, 1])


def _by_tooth(
    tables: RootTables, rings: dict[int, Array], count: int, ranges: bool
) -> dict[str, Any]:
    """Largest stress (count, teeth of all FE rings, 2) in every fillet; if asked for its range at a
    point over the samples (teeth, 2), and the least at the point with the largest; not a number in
    stages without."""
    if not rings:
        return {}
    largest, stresses, least = [], [], []
    for k in tables.fe_rings:
        none = np.full((count, tables.views[k].ring_gear.teeth, len(FILLETS)), np.nan)
        ring = rings.get(k, none[..., None, None])
        largest.append(ring.max(axis=(3, 4)).astype(float))
        if ranges:
            high, low = (of(axis=0).reshape(*ring.shape[1:3], -1) for of in (ring.max, ring.min))
            stresses.append((high - low).max(axis=2).astype(float))
            at = np.nan_to_num(high).argmax(axis=2)[..., None]
            least.append(np.take_along_axis(low, at, axis=2)[..., 0].astype(float))
    arrays = {"tooth_root_stress": np.concatenate(largest, axis=1)}
    if not ranges:
        return arrays
    by_tooth = {"tooth_root_range": stresses, "tooth_root_least": least}
    return arrays | {name: np.concatenate(values) for name, values in by_tooth.items()}


def _at(z: Array, curves: Array, places: Array) -> Array:
    """Values (t, n) at places (n,) of curves (t, q) over z (q,)."""
    at = np.clip(np.searchsorted(z, places) - 1, 0, len(z) - 2)
    fraction = np.clip((places - z[at]) / np.diff(z)[at], 0.0, 1.0)
    return np.asarray((1.0 - fraction) * curves[:, at] + fraction * curves[:, at + 1])


def rim_stress_rows(case: Case, system: System, bodies: Bodies) -> Array:
    """(z, d) stress along the circumference on the outer surface over every tooth of every FE ring
    at mid-face, Pa, in the order of the tooth nodes; not a number where a ring has no FE mesh."""
    stress = [np.zeros((0, system.size))]
    for stage, view in case.fe_ring_stages.items():
        name = BodyName.of(stage, "ring")
        body, ring = system.body(name), bodies.get(name)
        teeth = sum(node.kind == "tooth" for node in body.nodes)
        stress.append(np.zeros((teeth, system.size)))
        if ring is not None and not body.rigid:
            rim = _rim(view.material, ring, view.ring_gear.teeth)
            stress[-1][:, system.slice_of(name)] = rim
    return np.vstack(stress)


def _rim(material: Material, ring: ReducedBody, teeth: int) -> Array:
    """(z, d) stress along the circumference over the teeth, Pa."""
    at = [k for k, node in enumerate(ring.nodes) if node.kind == "tooth"]
    if not len(ring.cells):
        return np.full((len(at), len(ring.mass)), np.nan)
    angles = 2 * np.pi * np.array([ring.nodes[k].number - 1 for k in at]) / teeth
    middle = ring.positions[at, 2]
    rays = [Ray(float(angle), float(z)) for angle, z in zip(angles, middle, strict=True)]
    strain = Surface(ring).strain(rays)
    return strain.hoop_stress(material.young_modulus, material.poisson_ratio)


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
    """Stresses of a group from equilibria over whole gear-mesh cycles; data: of the carrying flanks
    of the group, one for each planet."""
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
    """Root stress of one gear in one gear mesh over a cycle: largest stress in the roots, Pa, with
    the body below the teeth fixed; that of the same pair with its load uniform along the contact
    line; and this load, N."""

    held: float
    even: float
    pair_load: float


def held_roots(tables: RootTables, result: Equilibrium, flank: int, member: int) -> HeldRoots:
    """flank: of the system; member: 0 its planet, 1 the mate; result: over a gear-mesh cycle."""
    system = result.modal.system
    label = system.gear_meshes[flank]
    loads = line_loads(result)
    assert loads is not None  # the case asks for roots, which want slices
    force = loads.force[:, flank, :, : int(system.pairs.slices[flank])]
    even = np.broadcast_to(force.mean(axis=2, keepdims=True), force.shape)
    roots, pitch = tables.of(label)[member], tables.path(label).base_pitch
    held, of_even = (
        tooth_roots(roots, result.pair_position[:, flank], of, pitch).tension.max(axis=(2, 3))
        for of in (force, even)
    )
    at = np.unravel_index(int(np.nanargmax(held)), held.shape)
    load = result.pair_load[:, flank]
    return HeldRoots(float(held[at]), float(of_even[at]), float(load[at]))
