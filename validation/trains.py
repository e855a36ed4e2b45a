"""Runs of a bundled train by the package, as forces of gear meshes in the papers' order."""

from dataclasses import dataclass

import numpy as np

from flexgear.analysis.equilibrium import Equilibrium, revolution
from flexgear.analysis.step_plan import Stepping
from flexgear.analysis.transient import Drive, Transient, run_in_memory
from flexgear.arrays import Array
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import ModalSystem, modal_system
from flexgear.model.case import Case


@dataclass(frozen=True)
class TrainRun:
    """A train put together: its modal system and the numbers of its gear meshes."""

    train: Case
    modal: ModalSystem

    def columns(self, stage: int, kind: str, side: str = "") -> list[int]:
        """Gear meshes of "sun" or "ring" (loaded flanks) of a stage and half, planet by planet."""
        labels = self.modal.system.gear_meshes
        front = np.asarray(self.modal.system.pairs.carries)
        by_planet = {
            label.planet: m
            for m, label in enumerate(labels)
            if label.stage == stage and label.side == side
            and label.kind.gear == kind and front[m]
        }  # fmt: skip
        return [by_planet[i] for i in sorted(by_planet)]

    def at(self, positions: Array, torque: float | None = None) -> Equilibrium:
        """Equilibria at rotations (rad) of the member whose speed is given; rated torque if none
        is given."""
        rated = self.modal.system.rated_torque
        return revolution(self.modal, positions, rated if torque is None else torque)

    def over_time(self, duration: float, time_step: float, every: float) -> Transient:
        """Rated running from equilibrium at time 0."""
        system = self.modal.system
        drive = Drive(lambda t: np.full_like(t, system.rated_torque))
        return run_in_memory(self.modal, drive, Stepping(duration, time_step, every))


def put_together(train: Case) -> TrainRun:
    """The train with all its modes."""
    return TrainRun(train, modal_system(build_system(train)))


def gear_mesh_forces(result: Equilibrium | Transient) -> Array:
    """Forces (positions, M) along the 3D normals, N."""
    return np.asarray(result.pair_load.sum(axis=2))
