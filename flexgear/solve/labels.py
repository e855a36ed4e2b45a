"""Gear meshes of a train's system as results name them: both flanks of a planet as one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.gear_meshes import GearMeshLabel
from flexgear.coupling.system import System
from flexgear.gears.power_flow import PowerFlow
from flexgear.model.case import Case
from flexgear.model.names import GearMeshName
from flexgear.results.group_sharing import without_rounding

Array = NDArray[np.float64]


@dataclass(frozen=True)
class GearMeshes:
    """names: (G,) gear meshes; sign (M, G): +1 of the flank that carries rated torque, −1 of the
    other; carrying: (G,) number m of the carrying flank in the system."""

    names: tuple[GearMeshName, ...]
    sign: Array
    carrying: NDArray[np.int64]

    def forces(self, pair_load: Array) -> Array:
        """Gear-mesh forces (t, G) in N of pair loads (t, M, slots): drive less coast flank."""
        largest = float(np.abs(pair_load).max(initial=0.0))
        return without_rounding(pair_load.sum(axis=-1) @ self.sign, largest)

    def of_stage(self, stage: str) -> list[int]:
        """Places of a stage's gear meshes."""
        return [k for k, name in enumerate(self.names) if name.stage == stage]


def flank_name(case: Case, label: GearMeshLabel) -> GearMeshName:
    """The gear mesh that a flank belongs to."""
    stage, kind = case.stages[label.stage].name, label.kind.gear
    return GearMeshName.of(stage, kind, label.side, label.planet + 1)


def gear_meshes_of(case: Case, system: System) -> GearMeshes:
    """Labels and signs, in the order of the system: stage by stage, kind, side, planet."""
    carries = np.asarray(system.pairs.carries)
    names: dict[GearMeshName, int] = {}
    column, sign, carrying = [], [], {}
    for m, label in enumerate(system.gear_meshes):
        name = flank_name(case, label)
        g = names.setdefault(name, len(names))
        column.append(g)
        sign.append(1.0 if carries[m] else -1.0)
        if carries[m]:
            carrying[g] = m
    matrix = np.zeros((len(column), len(names)))
    matrix[np.arange(len(column)), column] = sign
    order = np.array([carrying[g] for g in range(len(names))], dtype=np.int64)
    return GearMeshes(tuple(names), matrix, order)


def rated_forces(flow: PowerFlow, names: tuple[GearMeshName, ...]) -> Array:
    """Mean gear-mesh forces (G,) at rated torque, N, positive on the flank that carries."""
    return np.array([abs(getattr(flow.stage(n.stage), f"{n.kind}_gear_mesh_force")) for n in names])
