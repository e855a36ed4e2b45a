"""A case put together: its coupled system, and what every result over it needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.build import build_system
from flexgear.coupling.modal import ModalSystem, chosen_modal
from flexgear.coupling.pace import Pace, case_pace
from flexgear.coupling.system import System, Variant
from flexgear.coupling.workable import require_workable
from flexgear.gears.power_flow import PowerFlow, power_flow
from flexgear.model.case import Case
from flexgear.solve.bodies import Bodies, Progress, reduced_bodies, silent, variants_of
from flexgear.solve.gauges import GaugeRows, gauge_rows, rim_stress_rows
from flexgear.solve.labels import GearMeshes, gear_meshes_of, rated_forces
from flexgear.solve.root_stress import RootTables

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """A case put together.

    bodies: reduced ring and carrier by flexible stage; gear_meshes, rated: as results name them,
    and their mean forces (G,) N; ideal: gears and pins without errors; made: its modes,
    roots: what gives root stress, where they are known already.
    """

    case: Case
    flow: PowerFlow
    system: System
    bodies: Bodies
    gear_meshes: GearMeshes
    rated: Array
    ideal: bool = False
    made: ModalSystem | None = None
    roots: RootTables | None = None

    @property
    def variant(self) -> str:
        """What bends in it, and whether errors are left out."""
        return f"{self.system.variant}, without errors" if self.ideal else self.system.variant

    @cached_property
    def pace(self) -> Pace:
        """Steps, samples and modes that follow from the case."""
        return case_pace(self.case)

    @cached_property
    def modal(self) -> ModalSystem:
        """The coupled system in the modes that ``solver`` asks for; InputError without load."""
        self.case.require_load()
        return self.made or chosen_modal(self.system, self.pace)

    @cached_property
    def gauges(self) -> GaugeRows:
        """What gives the strain of the rings' gauges; InputError for one beside its ring."""
        return gauge_rows(self.case, self.system, self.bodies)

    @cached_property
    def rim_stress(self) -> Array:
        """Rows (z, d) that give the stress of the rings' rims over their teeth, Pa."""
        return rim_stress_rows(self.case, self.system, self.bodies)

    @cached_property
    def root_tables(self) -> RootTables:
        """What gives the stress in tooth roots."""
        return self.roots or RootTables(self.case, self.flow, self.bodies)

    @property
    def has_errors(self) -> bool:
        """Whether anything is not perfect in the gears, pins and carriers."""
        return bool(self.system.pairs.largest_error.any())

    def without_errors(self) -> Model:
        """The same with perfect gears and pins: errors enter no matrix, only the gear meshes."""
        modal, pairs = self.modal, self.system.pairs
        errors = [name for name in pairs._fields if name.startswith("error_")]
        zero = {n: np.zeros_like(getattr(pairs, n)) for n in errors}
        clean = self.system.with_(
            pairs=pairs._replace(
                **zero,
                runout_amplitude=np.zeros_like(pairs.runout_amplitude),
                largest_error=np.zeros_like(pairs.largest_error),
            )
        )
        made = replace(modal, system=clean)
        return replace(self, system=clean, ideal=True, made=made, roots=self.root_tables)


def assemble(
    case: Case,
    rigid: Sequence[str] = (),
    *,
    progress: Progress = silent,
    bodies: Bodies | None = None,
    variants: Mapping[str, Variant] | None = None,
) -> Model:
    """Couple all bodies of a case.

    rigid: "ring", "carrier", "shaft" of all flexible stages, "stage_1.ring" of one, or "all";
    bodies: of flexible stages, made (or read from the cache) if not given; variants: what bends by
    stage, in the place of ``rigid``. InputError for a case that cannot work: gears that do not
    mesh, bodies that cannot be meshed, members that are loose or held.
    """
    bends = variants_of(case, rigid) if variants is None else variants
    if bodies is None:
        require_workable(case)
        bodies = reduced_bodies(case, progress)
    return model_of(case, build_system(case, bodies, bends), bodies)


def model_of(case: Case, coupled: ModalSystem | System, bodies: Bodies | None = None) -> Model:
    """The model of a case that was coupled already; its modes are only made when asked for."""
    made = coupled if isinstance(coupled, ModalSystem) else None
    system = coupled if isinstance(coupled, System) else coupled.system
    flow, gear_meshes = power_flow(case), gear_meshes_of(case, system)
    rated = rated_forces(flow, gear_meshes.names)
    return Model(case, flow, system, bodies or {}, gear_meshes, rated, made=made)


def rated_rotations(system: System, lead: Array) -> Array:
    """Independent rotations (p, F) of the train rolling at rated speeds, rad.

    lead: (p,) rotation of the first of them that turns, forward in time where it rises; of the
    first one alone where none turns.
    """
    speeds = system.rated_input_speeds
    first = next((abs(w) for w in speeds if w != 0), 0.0)
    rates = speeds / first if first else np.eye(1, len(speeds))[0]
    return np.multiply.outer(np.asarray(lead, dtype=float), rates)
