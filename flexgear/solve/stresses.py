"""Stress in tooth roots and in rims of rings, and stresses in a load bin by planet and cycle.

During a gear-mesh cycle of one planet contact lines pass over the whole flank once, and the teeth
in contact together have all loads that one tooth has from its first to its last contact. Flanks are
divided into places along the path of contact and along the face, fillets along the face.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.line_loads import LineLoads, line_loads, teeth_of_pairs
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
from flexgear.structures.reduced import ReducedBody, elastic_modes
from flexgear.structures.surface_strain import Ray, Surface
from flexgear.structures.tooth_influence.roots import (
    PairRoots,
    body_root_rows,
    pair_roots,
    root_of_case,
)

MEMBERS = ("planet", "gear")  # of a tooth pair
FILLETS = ("-theta", "+theta")


class RootTables:
    """Matrices of root stress: per force of slices by stage, kind and side of gear meshes, and per
    coordinate of FE rings and planets. They are computed on first use."""

    def __init__(self, case: Case, flow: PowerFlow, bodies: Bodies) -> None:
        self.views = [case.view(stage.name) for stage in case.stages]
        self.with_roots = [view.gear_mesh.root_stress == "fe" for view in self.views]
        self.fe_rings = [k for k, v in enumerate(self.views) if v.name in case.fe_ring_stages]
        self._flow, self._bodies = flow, bodies
        self.paths = cache(self._paths)
        self._roots = cache(self._pair_roots)
        self.ring_rows = cache(self._ring_rows)
        self.planet_rows = cache(self._planet_rows)

    def of(self, label: GearMeshLabel) -> list[PairRoots]:
        """Root tables of the planet and then of the gear of a flank."""
        return self._roots(label.stage, (label.kind, label.side))

    def path(self, label: GearMeshLabel) -> GearMeshPath:
        """Path of contact of a flank."""
        return self.paths(label.stage)[label.kind, label.side]

    def _paths(self, stage: int) -> dict[PathKey, GearMeshPath]:
        return stage_paths(self.views[stage], self._flow.stages[stage].gear_mesh_forces)

    def _pair_roots(self, stage: int, key: PathKey) -> list[PairRoots]:
        path = self.paths(stage)[key]
        assert path.slices is not None
        return pair_roots(self.views[stage], path, path.slices)

    def _ring_rows(self, stage: int) -> NDArray[np.float32]:
        """Root stress (z, 2, rows, q, d) of an FE ring per coordinate, Pa: ``body_root_rows``."""
        view = self.views[stage]
        body = self._bodies[BodyName.of(view.name, "ring")]
        return body_root_rows(root_of_case(view, "ring"), body, view.ring_gear.teeth)

    def _planet_rows(self, stage: int) -> NDArray[np.float32] | None:
        """Root stress (z, 2, rows, q, n) of an FE planet per elastic coordinate, Pa; None for a
        lumped planet and for one without an FE mesh."""
        view = self.views[stage]
        body = self._bodies.get(BodyName.of(view.name, "planet"))
        if body is None or not len(body.points):
            return None
        rows = body_root_rows(root_of_case(view, "planet"), body, stage_geometry(view).planet.teeth)
        return rows @ elastic_modes(body)[1].astype(np.float32)


class Roots(NamedTuple):
    """Root stress (t, slots, rows, q) of the teeth of one gear in one gear mesh, Pa: tension in the
    fillet under the loaded flank, compression in the other; NaN without load."""

    tension: Array
    compression: Array


def tooth_roots(roots: PairRoots, s: Array, force: Array, base_pitch: float) -> Roots:
    """Root stress of pairs, including that by loads on adjacent teeth. s (t, slots): path
    coordinates, m; force (t, slots, K): of their slices, N, NaN without a pair; base_pitch: m."""
    loaded = _loaded(force)
    by_pair = np.zeros((*loaded.shape, *roots.stress.shape[2:]))
    by_pair[loaded] = roots.of(s[loaded], force[loaded])
    stress = by_pair[:, :, 1].copy()
    for a, b in np.ndindex(loaded.shape[1], loaded.shape[1]):
        pitches = np.round((s[:, b] - s[:, a]) / base_pitch)
        for side in (1, -1):  # the pair in slot b is on the next tooth in +θ (1) or −θ (−1)
            adjacent = loaded[:, a] & loaded[:, b] & (pitches == side * roots.step)
            stress[adjacent, a] += by_pair[adjacent, b, 1 + side]
    stress[~loaded] = np.nan
    return Roots(stress[:, :, 0], stress[:, :, 1])


def ring_roots(tables: RootTables, recovery: Recovery, lines: LineLoads, stage: int) -> Array:
    """Stress (t, z, 2, rows, q) in both fillets of all teeth of the FE ring of a stage (number from
    0), Pa: by the deformation of the ring, and by the loads on each tooth and adjacent teeth."""
    result = recovery.result
    system = result.modal.system
    flanks = [m for m, x in enumerate(system.gear_meshes) if x.stage == stage and x.kind.internal]
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
            sample, tooth = np.nonzero(loaded)[0], result.pair_tooth[:, m][loaded].astype(np.int64)
            for offset in (1, 0, -1):  # the next tooth, the loaded one, the previous one
                fillets = stress[:, 1 - offset, :: roots.sense].astype(np.float32)
                np.add.at(out, (sample, (tooth + offset) % teeth), fillets)
    return out


def planet_rim_roots(tables: RootTables, recovery: Recovery, m: int) -> Array | None:
    """Stress (t, slots, 2, rows, q) in the −θ and +θ fillets of the planet's teeth in gear mesh m
    by the deformation of an FE planet, Pa; None for a planet that does not bend."""
    result, system = recovery.result, recovery.modal.system
    pairs, label = system.pairs, system.gear_meshes[m]
    if pairs.planet_turns[m] < 0 or (rows := tables.planet_rows(label.stage)) is None:
        return None
    name = BodyName.of(tables.views[label.stage].name, "planet", label.planet)
    elastic = recovery.coordinates(name)[:, 6:].astype(np.float32)
    field = (elastic @ rows.reshape(-1, rows.shape[-1]).T).reshape(-1, *rows.shape[:-1])
    theta = result.theta[:, pairs.angle[m], None]
    _, tooth = teeth_of_pairs(pairs, m, result.pair_position[:, m], theta)
    return np.asarray(field[np.arange(len(field))[:, None], tooth])


def root_arrays(
    tables: RootTables, recovery: Recovery, lines: LineLoads, places: Array
) -> dict[str, Any]:
    """Variables of root stress; places: along the face, −1/2 … 1/2 of its width, for stress along
    the face if there are any. Empty where no stage requires root stress."""
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
                stress = _pair_stress(rings[label.stage], teeth, _loaded(force), roots.sense)
            else:
                stress = tooth_roots(roots, result.pair_position[:, m], force, path.base_pitch)
            rim = planet_rim_roots(tables, recovery, m) if roots.name == "planet" else None
            if rim is not None:
                fillets = np.moveaxis(rim[:, :, :: roots.sense], 2, 0)
                stress = Roots(*(s + more for s, more in zip(stress, fillets, strict=True)))
            tension = np.fmax.reduce(stress.tension, axis=(1, 2))
            compression = np.fmin.reduce(stress.compression, axis=(1, 2))
            largest[:, m, k] = tension.max(axis=1)
            for i, curve in enumerate((tension, compression)):
                z = 2.0 * path.half_face * places
                along[i, :, m, k] = [np.interp(z, roots.z, values) for values in curve]
    arrays = {"root_stress": largest, "root_side": side}
    if len(places):
        arrays |= {"face_root_stress": along[0], "face_root_compression": along[1]}
    static = isinstance(result, Equilibrium)
    return arrays | _by_tooth(tables, rings, len(result.theta), ranges=static)


def _loaded(force: Array) -> NDArray[np.bool_]:
    """Whether each slot (t, slots) has a loaded tooth pair; force (t, slots, K): of slices, N."""
    return np.asarray(np.isfinite(force).all(axis=2) & (np.nansum(force, axis=2) > 0.0))


def _pair_stress(
    ring: Array, tooth: NDArray[np.int16], loaded: NDArray[np.bool_], sense: int
) -> Roots:
    """Root stress of the ring's tooth in every tooth pair of a gear mesh, Pa; NaN without load.

    ring: stress of all z teeth of the ring, (t, z, 2, rows, q); tooth: that of each pair, (t,
    slots), −1 for none; loaded (t, slots); sense: −1 if the fillet under tension is the second."""
    stress = ring[np.arange(len(ring))[:, None], np.maximum(tooth, 0)].astype(float)[:, :, ::sense]
    stress[~loaded] = np.nan
    return Roots(stress[:, :, 0], stress[:, :, 1])


def _by_tooth(
    tables: RootTables, rings: dict[int, Array], count: int, ranges: bool
) -> dict[str, Any]:
    """Variables by tooth of all FE rings: largest stress (count, teeth, 2) in every fillet, and
    with ``ranges`` the largest range of stress at a point over the samples, (teeth, 2), and the
    least stress at the point with the largest. NaN in stages without root stress."""
    if not rings:
        return {}
    largest, stresses, least = [], [], []
    for k in tables.fe_rings:
        none = np.full((count, tables.views[k].ring_gear.teeth, len(FILLETS)), np.nan)
        ring = rings.get(k, none[..., None, None])
        largest.append(ring.max(axis=(3, 4)).astype(float))
        if ranges:
            high, low = (f(axis=0).reshape(*ring.shape[1:3], -1) for f in (ring.max, ring.min))
            stresses.append((high - low).max(axis=2).astype(float))
            point = np.nan_to_num(high).argmax(axis=2)[..., None]
            least.append(np.take_along_axis(low, point, axis=2)[..., 0].astype(float))
    arrays = {"tooth_root_stress": np.concatenate(largest, axis=1)}
    if not ranges:
        return arrays
    by_tooth = {"tooth_root_range": stresses, "tooth_root_least": least}
    return arrays | {name: np.concatenate(values) for name, values in by_tooth.items()}


def rim_stress_rows(case: Case, system: System, bodies: Bodies) -> Array:
    """Rows (z, d) of the circumferential stress on the outer surface of FE rings over every tooth
    at mid-face, Pa, in the order of the tooth nodes; NaN for rings without FE mesh."""
    stress = [np.zeros((0, system.size))]
    for stage, view in case.fe_ring_stages.items():
        name = BodyName.of(stage, "ring")
        body, ring = system.body(name), bodies.get(name)
        teeth = sum(node.kind == "tooth" for node in body.nodes)
        stress.append(np.zeros((teeth, system.size)))
        if ring is not None and not body.rigid:
            rows = _ring_rim_rows(view.material, ring, view.ring_gear.teeth)
            stress[-1][:, system.slice_of(name)] = rows
    return np.vstack(stress)


def _ring_rim_rows(material: Material, ring: ReducedBody, teeth: int) -> Array:
    """Rows (z, d_b) of ``rim_stress_rows`` for one ring, on its coordinates."""
    nodes = [k for k, node in enumerate(ring.nodes) if node.kind == "tooth"]
    if not len(ring.cells):
        return np.full((len(nodes), len(ring.mass)), np.nan)
    angles = 2 * np.pi * np.array([ring.nodes[k].number - 1 for k in nodes]) / teeth
    middle = ring.positions[nodes, 2]
    rays = [Ray(float(angle), float(z)) for angle, z in zip(angles, middle, strict=True)]
    strain = Surface(ring).strain(rays)
    return strain.hoop_stress(material.young_modulus, material.poisson_ratio)


OF_FLANKS = ("contact_pressure", "slice_path", "slice_position")
OF_ROOTS = (
    "face_root_stress", "face_root_compression", "root_side", "tooth_root_least",
)  # fmt: skip


@dataclass(frozen=True)
class GroupStresses:
    """Stresses of a group of gear meshes with N planets in C gear-mesh cycles.

    azimuth (N, C): angle of the planet relative to the ring, rad; path (P,): middles of the places
    on the path, from the planet's base tangent point, m; pressure (N, C, P, F): largest Hertz
    pressure, Pa; tension, compression (N, C, 2, F'): in planet and gear, largest stress in the
    fillet under the loaded flank and least stress in the other, Pa, empty without FE roots; lowest
    (z,): for FE rings least stress in the fillet under the loaded flank of every tooth, at the
    point of its largest stress, Pa, else empty.
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
    """Stresses of a group from equilibria over whole gear-mesh cycles of ``per_cycle`` positions;
    data: dataset of the carrying flanks of the group, one for each planet."""
    carrier, ring = (
        data[name].sel(turning_stage=view.name).to_numpy().reshape(-1, per_cycle).mean(axis=1)
        for name in ("carrier_angle", "ring_angle")
    )
    path, pressure = _pressures(data, view, group, per_cycle)
    tension = compression = np.zeros((*pressure.shape[:2], 2, 0))
    lowest = np.zeros(0)
    if view.gear_mesh.root_stress == "fe":
        tension = _cycle_extremes(data["face_root_stress"], per_cycle, np.fmax)
        compression = _cycle_extremes(data["face_root_compression"], per_cycle, np.fmin)
        if group.kind == "ring" and "tooth_root_least" in data:
            # in the fillet under the loaded flank, at the point of the largest stress
            fillet = 0 if float(data["root_side"].isel(flank=0, pair_member=1)) < 0.0 else 1
            teeth = (data["tooth_stage"] == group.stage) & (data["tooth_side"] == group.side)
            least = data["tooth_root_least"].isel(fillet=fillet).to_numpy()
            lowest = np.asarray(least[teeth.to_numpy()])
    planets = np.array(view.stage.planet_angles)[:, None]
    azimuth = np.mod(carrier - ring + planets, 2.0 * math.pi)
    return GroupStresses(azimuth, path, pressure, tension, compression, lowest)


def _pressures(
    data: xr.Dataset, view: StageView, group: GroupName, per_cycle: int
) -> tuple[Array, Array]:
    """Middles (P,) of places on the path, m, and largest pressure (N, C, P, F), Pa. Places are at
    least as wide as the distance of contact lines in successive positions, base pitch over
    ``per_cycle``. Pressure before or after the path is assigned to its ends."""
    pressure, path, z = (
        data[name].transpose("position", "flank", ...).to_numpy() for name in OF_FLANKS
    )
    gear_mesh = stage_geometry(view).gear_meshes[group.role]
    start, end, slices = gear_mesh.s_lo, gear_mesh.s_hi, pressure.shape[-1]
    count = max(int((end - start) / gear_mesh.base_pitch * per_cycle), 1)
    position, flank, *_ = loaded = np.nonzero(pressure > 0.0)
    along_path = (path[loaded] - start) / (end - start) * count
    along_face = (0.5 + z[loaded] / view.stage.face_width) * slices
    places = ((along_path, count), (along_face, slices))
    place = (np.clip(x.astype(int), 0, n - 1) for x, n in places)
    largest = np.zeros((pressure.shape[1], len(pressure) // per_cycle, count, slices))
    np.maximum.at(largest, (flank, position // per_cycle, *place), pressure[loaded])
    return start + (np.arange(count) + 0.5) * (end - start) / count, largest


def _cycle_extremes(values: xr.DataArray, per_cycle: int, extreme: np.ufunc) -> Array:
    """Largest or least values (N, C, …) over the positions of each cycle, 0 without load."""
    array = values.transpose("position", "flank", ...).to_numpy()
    array = array.reshape(-1, per_cycle, *array.shape[1:])
    return np.nan_to_num(np.moveaxis(extreme.reduce(array, axis=1), 1, 0))


@dataclass(frozen=True)
class HeldRoots:
    """Root stress of one gear in one gear mesh over a cycle, with a fixed body below the teeth.
    held: largest stress, Pa; even: stress of the same pair with its load uniform along the contact
    line, Pa; pair_load: this load, N."""

    held: float
    even: float
    pair_load: float


def held_roots(tables: RootTables, result: Equilibrium, flank: int, member: int) -> HeldRoots:
    """Root stress with a fixed body from equilibria over a gear-mesh cycle; flank: index in the
    system; member: 0 the planet, 1 the gear that it meshes with."""
    system = result.modal.system
    label = system.gear_meshes[flank]
    loads = line_loads(result)
    assert loads is not None  # root stress requires slices
    force = loads.force[:, flank, :, : int(system.pairs.slices[flank])]
    even_force = np.broadcast_to(force.mean(axis=2, keepdims=True), force.shape)
    roots, pitch = tables.of(label)[member], tables.path(label).base_pitch
    held, even = (
        tooth_roots(roots, result.pair_position[:, flank], f, pitch).tension.max(axis=(2, 3))
        for f in (force, even_force)
    )
    worst = np.unravel_index(int(np.nanargmax(held)), held.shape)
    load = result.pair_load[:, flank]
    return HeldRoots(float(held[worst]), float(even[worst]), float(load[worst]))
