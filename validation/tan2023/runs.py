"""The runs that figures and statements share, each made once and only when it is asked for."""

import math
import tomllib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from itertools import compress, product
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import xarray as xr
from face_load.runs import bodies_at

from flexgear.analysis.start import start_state
from flexgear.analysis.step_plan import Stepping
from flexgear.analysis.transient import Drive, run_in_memory
from flexgear.arrays import Array
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.system import System, variant_label
from flexgear.gears.geometry import StageGeometry, stage_geometry
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import load_case
from flexgear.model.names import BodyName
from flexgear.model.stage_view import StageView
from flexgear.results.stage_part import stage_part
from flexgear.solve.bodies import Bodies, stage_bodies
from flexgear.solve.dataset import transient_data
from flexgear.solve.model import Model, assemble
from flexgear.solve.static import static
from flexgear.solve.transient import RATED_DRIVE, simulate, torque_drop
from flexgear.structures.reduced import ReducedBody
from flexgear.views.star import StageOutline

T = TypeVar("T")
Variant = frozenset[BodyName]  # bodies that do not bend
BODIES = tuple(BodyName.of("stage", part) for part in ("ring", "carrier", "shaft"))
EIGHT = tuple(Variant(compress(BODIES, rigid)) for rigid in product((0, 1), repeat=3))
FLEXIBLE, RIGID = EIGHT[0], EIGHT[-1]
DROPS = (2e6, 4e5, 2e5)  # N m, the paper's
MAIN_DROP = 4e5  # N m, Figures 20-25
SHORT_START = 0.05  # s, when the torque drops in short runs
PER_PITCH = 60  # equilibria over a ring tooth pitch


def validation_case(fidelity: str, **changes: str) -> StageView:
    """The bundled case with the overrides of case.toml, the fidelity and further overrides."""
    chosen = tomllib.loads((Path(__file__).parent / "case.toml").read_text("utf-8"))
    overrides = {**chosen["overrides"], "solver.fidelity": fidelity, **changes}
    return load_case(chosen["bundled"], overrides=overrides).view()


def side_by_side(jobs: dict[str, Callable[[], T]]) -> dict[str, T]:
    """Results of independent runs, two at a time (the compiled step frees the interpreter)."""
    with ThreadPoolExecutor(max_workers=2) as pool:
        waiting = {name: pool.submit(job) for name, job in jobs.items()}
        return {name: future.result() for name, future in waiting.items()}


def label(variant: Variant) -> str:
    """What bends: "flexible", "ring+shaft", …, "rigid"."""
    return variant_label(BODIES, variant)


def model_of(stage: StageView, bodies: Bodies, variant: Variant) -> Model:
    """The stage alone, coupled, with what bends."""
    return assemble(stage.case, bodies=bodies, variant=variant)


def of_stage(data: xr.Dataset) -> xr.Dataset:
    """What of results belongs to the stage."""
    return stage_part(data, "stage")


def equilibria(model: Model, angles: Array) -> xr.Dataset:
    """Equilibria at rated torque."""
    return of_stage(static(model, angles))


@dataclass(frozen=True)
class Decay:
    """Start-up from rest: dataset, speed of the whole train (rad/s), J and c of the train."""

    data: xr.Dataset
    train_speed: Array
    inertia: float
    damping: float


class Runs:
    """All runs at one fidelity; properties compute on first use and keep what they found."""

    def __init__(self, fidelity: str) -> None:
        self.fidelity = fidelity
        self.case = validation_case(fidelity)
        self.perfect_case = self.case.with_(stage__errors=GearErrors())
        self._models: dict[Variant, Model] = {}
        self._kept: dict[str, Any] = {}

    def once(self, name: str, make: Callable[[], T]) -> T:
        """What ``make`` returns, computed at the first call with this name."""
        if name not in self._kept:
            self._kept[name] = make()
        value: T = self._kept[name]
        return value

    @cached_property
    def geometry(self) -> StageGeometry:
        return stage_geometry(self.case)

    @cached_property
    def outline(self) -> StageOutline:
        g = self.geometry
        return StageOutline(
            ring_radius=g.ring.reference_radius,
            sun_radius=g.sun.reference_radius,
            planet_radius=g.planet.reference_radius,
            center_distance=g.center_distance,
            planet_angles=tuple(self.case.stage.planet_angles),
        )

    @property
    def pin_radius(self) -> float:
        return 0.5 * self.case.carrier.pin_diameter

    @cached_property
    def bodies(self) -> Bodies:
        return stage_bodies(self.case)

    @property
    def carrier(self) -> ReducedBody:
        return self.bodies[BODIES[1]]

    def model(self, variant: Variant) -> Model:
        """The stage with what bends, errors of the case."""
        if variant not in self._models:
            self._models[variant] = model_of(self.case, self.bodies, variant)
        return self._models[variant]

    def modal(self, variant: Variant) -> ModalSystem:
        """Its modal system."""
        return self.model(variant).modal

    def perfect(self, variant: Variant) -> Model:
        """The same without manufacturing errors."""
        return self.model(variant).without_errors()

    def erroneous(self, case: StageView, variant: Variant) -> Model:
        """The same with the manufacturing errors of another case."""
        system = model_of(case, self.bodies, variant).system
        return replace(
            self.model(variant),
            system=system,
            shared_modal=replace(self.modal(variant), system=system),
        )

    # ------------------------------------------------------------------ equilibria, no errors

    @property
    def pitch(self) -> float:
        """Carrier angle of one ring tooth, rad."""
        return 2 * math.pi / self.case.stage.ring.teeth

    @cached_property
    def star(self) -> xr.Dataset:
        """Equilibria at rated torque at 0, 2π/10 and 2π/5 (Figure 8)."""
        angles = np.array([0.0, 2 * math.pi / 10, 2 * math.pi / 5])
        return equilibria(self.perfect(FLEXIBLE), angles)

    @cached_property
    def star_turn(self) -> xr.Dataset:
        """Equilibria at whole ring teeth, so that all are at the same phase of the gear meshes."""
        angles = self.pitch * np.arange(0, 93, 6)
        return equilibria(self.perfect(FLEXIBLE), angles)

    def passage(
        self,
        variant: Variant,
        change: Callable[[System], System] | None = None,
        case: StageView | None = None,
    ) -> xr.Dataset:
        """Equilibria without errors while several ring teeth pass, finely sampled."""
        angles = np.linspace(0, 5 * self.pitch, 5 * PER_PITCH + 1)
        case = case or self.perfect_case
        if change is None and case is self.perfect_case:
            return equilibria(self.perfect(variant), angles)
        model = model_of(case, self.bodies, variant)
        return equilibria(replace(model, system=change(model.system)) if change else model, angles)

    @cached_property
    def passages(self) -> dict[str, xr.Dataset]:
        """Tooth passages of the flexible and the rigid variant."""
        return {label(v): self.passage(v) for v in (FLEXIBLE, RIGID)}

    # ------------------------------------------------------------------------------ transients

    @cached_property
    def steady(self) -> dict[str, xr.Dataset]:
        """One revolution at rated torque, flexible and rigid."""
        for variant in (FLEXIBLE, RIGID):  # compile before the runs go side by side
            simulate(self.model(variant), duration=5e-3)

        def one(variant: Variant) -> xr.Dataset:
            return of_stage(simulate(self.model(variant), drive=RATED_DRIVE).data)

        return side_by_side({label(v): partial(one, v) for v in (FLEXIBLE, RIGID)})

    @cached_property
    def main_drop(self) -> dict[str, xr.Dataset]:
        """Torque drop 4e6 -> 4e5 -> 4e6 N m, flexible and rigid (Figures 20-25)."""

        def one(variant: Variant) -> xr.Dataset:
            return of_stage(torque_drop(self.model(variant), MAIN_DROP).data)

        for v in (FLEXIBLE, RIGID):
            self.modal(v)
        return side_by_side({label(v): partial(one, v) for v in (FLEXIBLE, RIGID)})

    @cached_property
    def drops(self) -> dict[float, xr.Dataset]:
        """The three torque drops of the flexible stage (Figure 10)."""
        model = self.model(FLEXIBLE)
        _ = model.modal

        def one(torque: float) -> xr.Dataset:
            return of_stage(torque_drop(model, torque).data)

        others = side_by_side({str(t): partial(one, t) for t in DROPS if t != MAIN_DROP})
        by_torque = {float(t): data for t, data in others.items()}
        return {**by_torque, MAIN_DROP: self.main_drop["flexible"]}

    def short_drop(self, model: Model, torque: float) -> xr.Dataset:
        """A torque drop for 0.2 s soon after the start, 20 µs steps."""
        start, rated = SHORT_START, model.system.rated_torque
        jumps = start, start + 0.2
        drive = Drive(lambda t: np.where((t > jumps[0]) & (t <= jumps[1]), torque, rated))
        run = run_in_memory(model.modal, drive, Stepping(0.35, 2e-5, 2e-4, jumps))
        return of_stage(transient_data(model, run))

    @cached_property
    def start_up(self) -> Decay:
        """Rated torque on the loaded stage at rest (Figure 10)."""
        modal = self.modal(FLEXIBLE)
        system, torque = modal.system, self.case.case.inputs[0].torque
        inertia = float(system.rolling[:, 0] @ system.mass @ system.rolling[:, 0])
        ratio = float(system.ports[-1].row @ system.rolling[:, 0])
        damping = system.machines[-1].rated_torque / system.machines[-1].rated_speed * ratio**2
        start = start_state(modal, torque)
        run = run_in_memory(
            modal, Drive(lambda t: np.full_like(t, torque)), Stepping(2.2, 1e-4, 1e-3),
            start._replace(velocity=np.zeros_like(start.velocity)),
        )  # fmt: skip
        speed = np.gradient(run.eta @ modal.rolling[:, 0] / inertia, run.time)
        return Decay(of_stage(transient_data(self.model(FLEXIBLE), run)), speed, inertia, damping)

    @cached_property
    def half_torque(self) -> xr.Dataset:
        """Rated torque halved at the start, until the speed has settled and a second more."""
        rated = self.case.case.inputs[0].torque
        modal = self.modal(FLEXIBLE)
        drive = Drive(lambda t: np.where(t > 0.0, 0.5 * rated, rated))
        tau = self.start_up.inertia / self.start_up.damping
        stepping = Stepping(9 * tau + 1.0, 1e-4, 1e-3, (0.0,))
        run = run_in_memory(modal, drive, stepping, start_state(modal, rated))
        return of_stage(transient_data(self.model(FLEXIBLE), run))

    # ------------------------------------------------------------------------------ sensitivity

    def other_ring(self, **changes: str) -> xr.Dataset:
        """Flexible tooth passages of a fifth of a turn with other ring parameters, quick mesh."""
        keys = bodies_at("wind-5mw", "quick")
        fidelity = keys.pop("solver.fidelity")
        case = validation_case(fidelity, **keys, **changes).with_(stage__errors=GearErrors())
        bodies = stage_bodies(case)
        angles = np.linspace(0, 2 * math.pi / 5, 241)
        return equilibria(model_of(case, bodies, FLEXIBLE), angles)


@cache
def shared_runs(fidelity: str) -> Runs:
    """The runs that rows and pictures of a session share."""
    return Runs(fidelity)
