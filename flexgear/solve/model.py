"""The model of a case: its coupled system, and data that its analyses share."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.analysis.error_sets import no_errors
from flexgear.analysis.excitation import with_one_index
from flexgear.analysis.gear_mesh_cycle import (
    StageCycle,
    mean_springs,
    springs_under_load,
    stage_cycle,
)
from flexgear.analysis.modes import ContactSprings, Modes, modes, springs_at
from flexgear.analysis.recovery import Output
from flexgear.arrays import Array
from flexgear.coupling.build import build_system, require_workable
from flexgear.coupling.gear_meshes import GearMeshLabel
from flexgear.coupling.modal import ModalSystem, chosen_modal, elastic_modes, static_system
from flexgear.coupling.mode_choice import SAME_FREQUENCY
from flexgear.coupling.pace import Pace, case_pace
from flexgear.coupling.system import System
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.names import BodyName, GearMeshName
from flexgear.results.load_sharing import without_rounding
from flexgear.solve.bodies import Bodies, Progress, reduced_bodies, rigid_bodies, silent
from flexgear.solve.sensors import Sensors, sensors_of
from flexgear.solve.stresses import RootTables, rim_stress_rows

MAX_ANGLE = 1e9  # rad; larger angles have sines with less than six digits


@dataclass(frozen=True, repr=False)
class Model:
    """The coupled bodies of a case.

    bodies: reduced FE bodies by name; gear_meshes: their names in results; rated (G,): their mean
    forces, N; ideal: whether it is without errors; shared_modal: the train in modes that another
    model has selected already."""

    case: Case
    flow: PowerFlow
    system: System
    bodies: Bodies
    gear_meshes: GearMeshes
    rated: Array
    ideal: bool = False
    shared_modal: ModalSystem | None = None
    with_errors: Model | None = None  # model with errors, whose sensors, rims and roots are shared

    @property
    def facts(self) -> dict[str, str]:
        """Properties by name, for one line or a table."""
        return {
            "case": self.case.name,
            "variant": self.variant,
            "stages": ", ".join(stage.name for stage in self.case.stages),
            "bodies": str(len(self.system.bodies)),
            "coordinates": str(self.system.size),
            "gear meshes": str(len(self.gear_meshes.names)),
        }

    def __repr__(self) -> str:
        return f"<flexgear model, {', '.join(f'{k}: {v}' for k, v in self.facts.items())}>"

    @property
    def variant(self) -> str:
        """Flexible bodies, and whether the model is without errors, in words."""
        return f"{self.system.variant}, without errors" if self.ideal else self.system.variant

    @cached_property
    def pace(self) -> Pace:
        """Step sizes, sample intervals and mode limits that follow from the case."""
        return case_pace(self.case)

    @cached_property
    def modal(self) -> ModalSystem:
        """The system in the modes selected by ``solver``. InputError for a case without load."""
        self.case.require_load()
        chosen = self.shared_modal or chosen_modal(self.system, self.pace)
        _require_equal_ratios(self.case, chosen)
        return chosen

    @property
    def damping_ratios(self) -> dict[str, list[float]]:
        """``damping.ratios`` and the frequencies, Hz, of their modes, those of the train without
        gear meshes; empty without ratios or load."""
        ratios = list(self.case.damping.ratios)
        if not ratios or self.case.output is None:
            return {}
        omega = np.sort(self.modal.omega[self.modal.omega > 0.0])[: len(ratios)]
        return {"frequency_hz": (omega / (2 * np.pi)).tolist(), "ratio": ratios[: len(omega)]}

    @cached_property
    def mean_forces(self) -> Array:
        """Mean forces (G,) of the carrying flanks under rated torques with mean stiffness, N; equal
        to ``rated`` for equal, evenly spaced planets."""
        system, cycles = self.system, self.mean_springs.cycles
        rolling, momenta = system.rolling, system.mass @ system.rolling
        balance = momenta @ np.linalg.inv(rolling.T @ momenta)
        zero = np.zeros(len(system.mass))
        load = sum((port.row * port.rated_torque for port in system.ports), zero)
        stiffness = system.stiffness + self.mean_springs.stiffness
        size = np.trace(stiffness) / np.trace(system.mass)
        stiffness = stiffness + size * balance @ momenta.T
        free = load - balance @ (rolling.T @ load)
        motion = linalg.solve(stiffness, free, assume_a="sym")
        out = np.zeros(len(self.gear_meshes.names))
        for g, m in enumerate(self.gear_meshes.carrying):
            if int(m) in cycles:
                cycle = cycles[int(m)]
                out[g] = cycle.force.mean(axis=0) @ (cycle.blocks @ motion)
        return out

    def structural_decay(self, shapes: Array) -> Array:
        """Decay rates φᵀCφ (n,), 1/s, of motions φ (d, n) with φᵀMφ = 1 by damping without gear
        meshes: C of structural damping, dampers and brakes."""
        modal = self.shared_modal or self.__dict__.get("modal")
        if modal is None:
            modes = elastic_modes(self.system)
            motions, rates = modes.shapes, self.system.damping.rate(modes.omega)
        else:
            motions, rates = modal.modes, modal.damping
        by_dampers = np.einsum("dn,dn->n", shapes, self.system.dampers @ shapes)
        return np.asarray(rates @ (motions.T @ self.system.mass @ shapes) ** 2 + by_dampers)

    @cached_property
    def mean_springs(self) -> ContactSprings:
        """Mean springs of the gear meshes over their cycles (``analysis.gear_mesh_cycle``), with
        the pairs that touch under rated torques without errors and other loads."""
        if self.with_errors is not None:
            return self.with_errors.mean_springs
        return mean_springs(self._torques_alone, self._statics)

    def contact_springs(self, angle: float | None = None) -> ContactSprings:
        """Springs of the gear meshes: mean, or at a rotation of the reference member, rad."""
        if angle is None:
            return self.mean_springs
        rotations = rated_rotations(self.system, np.array([angle]))[0]
        if self._statics is None:
            return springs_at(self._torques_alone, rotations)
        return springs_under_load(self._statics, rotations)

    def stage_cycle(self, stage: int, shapes: Array) -> StageCycle:
        """Stiffness and damping of the gear meshes of a stage (number from 0) over its cycle in
        modes (d, n), with the pairs of ``mean_springs``."""
        return stage_cycle(self._torques_alone, self._statics, stage, shapes)

    def natural_modes(self, limit_hz: float | None = None, angle: float | None = None) -> Modes:
        """Modes up to a limit (None: all); those with mean springs are cached. angle: rad."""
        by_limit = self._cached_modes if angle is None else {}
        if limit_hz not in by_limit:
            natural = modes(self.system, self.contact_springs(angle).stiffness, limit_hz)
            planets = {stage.name: stage.planet_angles for stage in self.case.stages}
            by_limit[limit_hz] = with_one_index(self.system, natural, planets)
        return by_limit[limit_hz]

    @cached_property
    def _cached_modes(self) -> dict[float | None, Modes]:
        return {} if self.with_errors is None else self.with_errors._cached_modes

    @cached_property
    def _statics(self) -> ModalSystem | None:
        """The train for equilibria under torques alone, in the modes of ``modal`` if these are
        computed already, else in static form; None without torque."""
        if not self.system.rated_port_torques.any():
            return None
        modal_system = self.shared_modal or self.__dict__.get("modal")
        if modal_system is None:
            return static_system(self._torques_alone)
        return replace(modal_system, system=self._torques_alone)

    @property
    def _torques_alone(self) -> System:
        """The system without errors and given forces, so that equal planets have equal loads."""
        ideal = self._ideal_system
        pairs = ideal.pairs._replace(load_size=np.zeros_like(ideal.pairs.load_size))
        return ideal.with_(pairs=pairs)

    @cached_property
    def sensors(self) -> Sensors | None:
        """Sensors of the case, None without any; InputError for a position off the body."""
        if self.with_errors is not None:
            return self.with_errors.sensors
        return sensors_of(self.case, self.system, self.bodies, self.pace)

    @cached_property
    def rim_stress(self) -> Array:
        """Rows (z, d) of the stress in the rims of FE rings over their teeth, Pa."""
        if self.with_errors is not None:
            return self.with_errors.rim_stress
        return rim_stress_rows(self.case, self.system, self.bodies)

    @cached_property
    def root_tables(self) -> RootTables:
        """Matrices of the stress in tooth roots."""
        if self.with_errors is not None:
            return self.with_errors.root_tables
        return RootTables(self.case, self.flow, self.bodies)

    @cached_property
    def outputs(self) -> dict[str, Output]:
        """Cache of the outputs of results at samples, by name: see ``Recovery``."""
        return {} if self.with_errors is None else self.with_errors.outputs

    @property
    def has_errors(self) -> bool:
        """Whether gears, pins or carriers have errors."""
        pairs = self.system.pairs
        return any(a.any() for a in (pairs.largest_error, pairs.gear_table, pairs.planet_table))

    def without_errors(self) -> Self:
        """The model with perfect gears and pins and without faults. Matrices and modes are shared,
        as errors enter only the gear meshes."""
        clean = self._ideal_system
        modal = replace(self.modal, system=clean)
        return replace(self, system=clean, ideal=True, shared_modal=modal, with_errors=self)

    @cached_property
    def _ideal_system(self) -> System:
        if not self.has_errors:
            return self.system
        pairs = self.system.pairs
        return self.system.with_(pairs=no_errors(pairs).pairs(pairs, 0).sound)


def assemble(
    case: Case,
    rigid: Sequence[str] = (),
    *,
    progress: Progress = silent,
    bodies: Bodies | None = None,
    variant: Collection[BodyName] | None = None,
) -> Model:
    """The model of a case, with all bodies coupled.

    bodies: reduced bodies, which are made or read from the cache if left out; variant: names of all
    rigid bodies, in the place of ``rigid`` and the ``flexible`` keys of the case; other arguments
    and errors: see ``face.case.Case.assemble``."""
    variant = rigid_bodies(case, rigid) if variant is None else variant
    if bodies is None:
        require_workable(case)
        bodies = reduced_bodies(case, progress, variant)
    return model_of(case, build_system(case, bodies, variant), bodies)


def model_of(case: Case, coupled: ModalSystem | System, bodies: Bodies | None = None) -> Model:
    """The model of a case from its coupled system or the train in modes, and reduced bodies."""
    modal = coupled if isinstance(coupled, ModalSystem) else None
    system = coupled if isinstance(coupled, System) else coupled.system
    flow, gear_meshes = power_flow(case), gear_meshes_of(case, system)
    rated = rated_forces(flow, gear_meshes.names)
    return Model(case, flow, system, bodies or {}, gear_meshes, rated, shared_modal=modal)


def rated_rotations(system: System, lead: Array) -> Array:
    """Independent rotations (p, F), rad, in the proportion of rated speeds.

    lead (p,): rotation of the reference member, rad, positive in its rated sense; without rated
    speed that of the first independent rotation. InputError if not finite or too large."""
    largest = np.abs(lead).max(initial=0.0)
    if not largest < MAX_ANGLE:
        raise InputError("--angle-deg", f"{largest:g} rad", "is no angle", "give a number, e.g. 30")
    speeds = system.rated_input_speeds
    first = next((abs(w) for w in speeds if w != 0), 0.0)
    rates = speeds / first if first else np.eye(1, len(speeds))[0]
    return np.multiply.outer(np.asarray(lead, dtype=float), rates)


def first_torque(system: System, torque: float | None) -> float:
    """Torque on the first port, N·m, the rated one if left out; InputError if it is not finite."""
    if torque is None:
        return float(system.rated_torque)
    if not math.isfinite(torque):
        raise InputError("--torque-nm", f"{torque:g}", "is no torque", "give a number, e.g. 1e3")
    return float(torque)


@dataclass(frozen=True)
class GearMeshes:
    """The gear meshes of a system. names (G,); sign (M, G): +1 for the flank of rated torque, −1
    for the opposite flank, 0 for other flanks; carrying (G,): index of the flank of rated torque.
    """

    names: tuple[GearMeshName, ...]
    sign: Array
    carrying: NDArray[np.int64]

    def forces(self, pair_load: Array) -> Array:
        """Gear-mesh forces (t, G), N, from pair loads (t, M, slots), N: drive minus coast flank."""
        largest = float(np.abs(pair_load).max(initial=0.0))
        return without_rounding(pair_load.sum(axis=-1) @ self.sign, largest)

    def of_stage(self, stage: str) -> list[int]:
        """Indices of a stage's gear meshes."""
        return [k for k, name in enumerate(self.names) if name.stage == stage]


def flank_name(case: Case, label: GearMeshLabel) -> GearMeshName:
    """Name of the gear mesh of a flank."""
    stage = case.stages[label.stage].name
    kind = case.view(stage).part(label.kind.gear)
    return GearMeshName.of(stage, kind, label.side, label.planet + 1)


def gear_meshes_of(case: Case, system: System) -> GearMeshes:
    """The gear meshes of a system, in the order of its flanks: by stage, kind, side, planet."""
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
    """Magnitudes (G,) of the mean gear-mesh forces at rated torque, N."""
    return np.array(
        [abs(getattr(flow.stage(n.stage), f"{n.group.role}_gear_mesh_force")) for n in names]
    )


def _require_equal_ratios(case: Case, modal: ModalSystem) -> None:
    """Raise InputError where modes of one frequency have different damping ratios: any combination
    of them is a mode, so that such damping is not defined."""
    damping = modal.system.damping
    omega = np.sort(modal.omega[modal.omega > 0.0])
    ratios = damping.rate(omega) / (2.0 * omega)
    for i in range(min(len(damping.ratios), len(omega) - 1)):
        equal = omega[i + 1] - omega[i] <= SAME_FREQUENCY * omega[i + 1]
        if equal and not np.isclose(ratios[i], ratios[i + 1]):
            raise InputError(
                case.source, "damping.ratios",
                f"damps two modes of {omega[i] / (2 * np.pi):.5g} Hz, numbers {i + 1} and {i + 2} "
                f"without gear meshes, by {ratios[i]:.3g} and {ratios[i + 1]:.3g}",
                "give modes of one frequency one ratio",
            )  # fmt: skip
