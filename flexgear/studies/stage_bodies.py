"""Bodies and coupled systems of a stage, made once and shared by all runs over a case."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from flexgear.coupling.build import build_system
from flexgear.coupling.modal import ModalSystem, chosen_modal
from flexgear.coupling.pace import stage_pace
from flexgear.coupling.system import Variant
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.model.gear_errors import GearErrors
from flexgear.structures.build import carrier_body, ring_body
from flexgear.structures.reduced import ReducedBody

Progress = Callable[[str, float], None]


def silent(stage: str, fraction: float) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True)
class StageBodies:
    """The two reduced bodies of a stage."""

    ring: ReducedBody
    carrier: ReducedBody

    @property
    def both(self) -> tuple[ReducedBody, ReducedBody]:
        """Ring, then carrier."""
        return self.ring, self.carrier


def stage_bodies(case: FlexibleStage, progress: Progress = silent) -> StageBodies:
    """FE mesh, assembly and reduction of ring and carrier, or both from the cache."""
    limit = stage_pace(case).reduction_limit
    return StageBodies(
        ring_body(case, named("ring", progress), limit),
        carrier_body(case, named("carrier", progress), limit),
    )


def named(body: str, progress: Progress) -> Progress:
    """Progress whose stages start with the body's name."""

    def report(stage: str, share: float) -> None:
        progress(stage if stage.startswith(body) else f"{body}: {stage}", share)

    return report


def variant_of(case: FlexibleStage, rigid: tuple[str, ...] = ()) -> Variant:
    """The case's own choice of flexible components, less those named rigid."""
    return Variant(
        **{n: getattr(case, n).flexible and n not in rigid for n in ("ring", "carrier", "shaft")}
    )


def stage_modal(case: FlexibleStage, bodies: StageBodies, variant: Variant) -> ModalSystem:
    """Coupled system of a variant in the modes that ``solver`` asks for."""
    system = build_system(case, bodies.ring, bodies.carrier, variant)
    return chosen_modal(system, stage_pace(case))


def without_errors(case: FlexibleStage, bodies: StageBodies, modal: ModalSystem) -> ModalSystem:
    """The same modal system with perfect gears and pins (errors do not enter its matrices)."""
    perfect = case.with_(errors=GearErrors())
    system = build_system(perfect, bodies.ring, bodies.carrier, modal.system.variant)
    return replace(modal, system=system)
