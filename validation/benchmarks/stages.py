"""Coupled stages for the benchmarks of time stepping: cheap bodies of the tests, real ones."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from coupled import CLEAN, TORQUE, make_bodies, named, stage_system

from flexgear.analysis.start import start_state
from flexgear.analysis.step_plan import Adaptive, Stepping
from flexgear.analysis.transient import Collector, Drive, State, transient
from flexgear.coupling.modal import ModalSystem
from flexgear.coupling.system import System
from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.structures.sources.carrier import source as carrier_source
from flexgear.structures.sources.ring import source as ring_source

STEADY = Drive(lambda t: np.full_like(t, TORQUE))


def cheap_system() -> System:
    """wind-5mw, one-sided contact with backlash, on bodies of springs and point masses."""
    case = load_case("wind-5mw", CLEAN).view()
    return stage_system(case, make_bodies(case), ())


def planet_system(planets: int) -> System:
    """The same with 3 to 8 equally spaced planets, small enough for eight side by side."""
    case = load_case(
        "wind-5mw",
        {
            **CLEAN,
            "stage.planets": str(planets),
            "stage.sun.teeth": "51",
            "stage.planet.teeth": "21",
            "stage.planet.bore_diameter_mm": "200",
            "stage.carrier.fe.pin_diameter_mm": "180",
            "stage.allow_unassemblable": "true",
        },
    ).view()
    return stage_system(case, make_bodies(case), ())


def real_case(size: str) -> StageView:
    """wind-5mw with standard FE bodies in a full run, coarse ones in a quick one."""
    return load_case(
        "wind-5mw", {"solver.fidelity": {"full": "standard", "quick": "quick"}[size]}
    ).view()


@cache
def real_system(size: str) -> System:
    """`real_case` on its FE bodies."""
    case = real_case(size)
    return stage_system(
        case,
        named(case, ring=ring_source(case).reduced(), carrier=carrier_source(case).reduced()),
        (),
    )


def copied(state: State) -> State:
    """A state that a run may change."""
    return State(*(np.array(part) for part in state))


@dataclass(frozen=True)
class Run:
    """A transient at rated torque, outputs every millisecond kept in memory."""

    modal: ModalSystem
    time_step: float
    steps: int
    start: State
    interval: float = 1e-3
    adaptive: Adaptive | None = None  # chooses steps over the same time

    def __call__(self) -> dict[str, np.ndarray]:
        sink = Collector()
        span = self.steps * self.time_step
        stepping = Stepping(span, self.time_step, self.interval, adaptive=self.adaptive)
        transient(self.modal, STEADY, stepping, start=copied(self.start), sink=sink)
        return sink.arrays()


def steady_run(
    modal: ModalSystem,
    time_step: float,
    steps: int,
    interval: float = 1e-3,
    adaptive: Adaptive | None = None,
) -> Run:
    """A run from equilibrium; the loops are compiled by a few steps first."""
    run = Run(modal, time_step, steps, start_state(modal, TORQUE), interval, adaptive)
    Run(modal, time_step, 20, run.start, 10 * time_step)()
    return run
