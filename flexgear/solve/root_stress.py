"""Stress in the roots of the teeth that carry, from the forces of slices."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.line_loads import LineLoads
from flexgear.analysis.recovery import Result
from flexgear.coupling.gear_meshes import GearMeshLabel
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.paths import PathKey, stage_paths
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.structures.tooth_influence import PairRoots, pair_roots

Array = NDArray[np.float64]
MEMBERS = ("planet", "gear")  # of a tooth pair


class RootTables:
    """Root stress per force of slices by stage, kind and side of gear meshes; made when asked."""

    def __init__(self, case: Case, flow: PowerFlow) -> None:
        self._case, self._flow = case, flow
        self.paths = cache(self._paths)
        self._roots = cache(self._made)

    @property
    def asked(self) -> list[bool]:
        """Whether the case wants them, by stage."""
        return [stage.gear_mesh.root_stress == "fe" for stage in self._case.stages]

    def of(self, label: GearMeshLabel) -> list[PairRoots]:
        """Of the planet, then of its mate."""
        return self._roots(label.stage, (label.kind, label.side))

    def path(self, label: GearMeshLabel) -> GearMeshPath:
        """Path of the pairs."""
        return self.paths(label.stage)[label.kind, label.side]

    def _paths(self, stage: int) -> dict[PathKey, GearMeshPath]:
        view = self._case.view(self._case.stages[stage].name)
        return stage_paths(view, self._flow.stages[stage].gear_mesh_forces)

    def _made(self, stage: int, key: PathKey) -> list[PairRoots]:
        path = self.paths(stage)[key]
        assert path.slices is not None
        return pair_roots(self._case.view(self._case.stages[stage].name), path, path.slices)


class Roots(NamedTuple):
    """tension, compression: (t, slots, rows, q) Pa in the roots of the teeth of one gear in one
    gear mesh, in the fillet under the loaded flank and in the other; not a number where a slot has
    no load. z: (q,) m along the face."""

    tension: Array
    compression: Array
    z: Array


def tooth_roots(roots: PairRoots, s: Array, force: Array, base_pitch: float) -> Roots:
    """Of pairs at s (t, slots) m with forces of their slices (t, slots, K) N, not a number where
    there is no pair; s of neighbouring pairs differ by the base pitch."""
    there = np.isfinite(force).all(axis=2) & (np.nansum(force, axis=2) > 0.0)
    shape = (*there.shape, *roots.stress.shape[2:])
    of_pairs = np.zeros(shape)
    of_pairs[there] = roots.of(s[there], force[there])
    found = of_pairs[:, :, 1].copy()
    for a in range(shape[1]):
        for b in range(shape[1]):
            apart = np.round((s[:, b] - s[:, a]) / base_pitch)
            for way in (1, -1):  # the pair in slot b is this many teeth further on in +θ
                beside = there[:, a] & there[:, b] & (apart == way * roots.step)
                found[beside, a] += of_pairs[beside, b, 1 + way]
    found[~there] = np.nan
    return Roots(found[:, :, 0], found[:, :, 1], roots.z)


def root_arrays(
    tables: RootTables, result: Result, lines: LineLoads, places: Array
) -> dict[str, Any]:
    """Variables of root stress; along the face at places, −1/2 … 1/2 of its width, if any are
    given. Empty where no stage asks for it."""
    system = result.modal.system
    if not any(tables.asked):
        return {}
    shape = (len(result.theta), len(system.gear_meshes), len(MEMBERS))
    largest, side = np.full(shape, np.nan), np.zeros(shape[1:])
    along = np.full((2, *shape, len(places)), np.nan)
    for m, label in enumerate(system.gear_meshes):
        count = int(system.pairs.slices[m])
        force = lines.force[:, m, :, :count]
        if not tables.asked[label.stage]:
            continue
        path = tables.path(label)
        side[m] = path.planet_step, -path.gear_step
        if not np.nansum(force) > 0.0:
            continue
        for k, roots in enumerate(tables.of(label)):
            found = tooth_roots(roots, result.pair_position[:, m], force, path.base_pitch)
            tension = np.fmax.reduce(np.fmax.reduce(found.tension, axis=2), axis=1)
            compression = np.fmin.reduce(np.fmin.reduce(found.compression, axis=2), axis=1)
            largest[:, m, k] = tension.max(axis=1)
            for i, curve in enumerate((tension, compression)):
                along[i, :, m, k] = _at(found.z, curve, 2.0 * path.half_face * places)
    arrays = {"root_stress": largest, "root_side": side}
    if len(places):
        arrays |= {"face_root_stress": along[0], "face_root_compression": along[1]}
    return arrays


def _at(z: Array, curves: Array, places: Array) -> Array:
    """Values (t, n) at places (n,) of curves (t, q) over z (q,)."""
    at = np.clip(np.searchsorted(z, places) - 1, 0, len(z) - 2)
    far = np.clip((places - z[at]) / np.diff(z)[at], 0.0, 1.0)
    return np.asarray((1.0 - far) * curves[:, at] + far * curves[:, at + 1])
