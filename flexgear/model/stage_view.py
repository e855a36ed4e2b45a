"""A stage as gear theory sees it: alone or one of several, of lumped or of flexible members."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from flexgear.model.errors import InputError
from flexgear.model.material import Material

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.train_errors import TrainErrors
    from flexgear.model.train_gear_mesh import TrainGearMesh
    from flexgear.model.train_stage import TrainStage

_PARALLEL_WORDS = {"sun": "pinion", "planet": "gear"}
_OWN_BODY = r"\bstage\.(?=(carrier|ring|shaft|output|sun|planet_\d+)\b(?!\.))"


@dataclass(frozen=True)
class StageView:
    """What gear functions read of a stage.

    source: file or case that messages name; gears_key, options_key: keys of its gears and of what
    its gear_mesh and errors stand in, as --set takes them; fe_tie: how the contact nodes of an FE
    ring are tied to it, None where no FE mesh holds the ring.
    """

    source: str
    material: Material
    stage: TrainStage
    gears_key: str = "stage"
    options_key: str = "stage"
    fe_tie: Literal["root", "flank"] | None = None

    @property
    def gear_mesh(self) -> TrainGearMesh:
        """How its gear meshes are modelled."""
        return self.stage.gear_mesh

    @property
    def errors(self) -> TrainErrors:
        """Manufacturing errors of its gears, pins and bodies.

        Those of bodies that a train adds to a flexible stage stand in place of the stage's own.
        """
        added, flexible = self.stage.errors, self.stage.flexible
        if flexible is None:
            return added
        given = {name: getattr(added, name) for name in type(added).model_fields}
        return flexible.errors.model_copy(update={k: v for k, v in given.items() if v})

    def key(self, name: str = "") -> str:
        """A key of the stage as messages write it: "stages.stage_2.planets"; itself for ""."""
        at = self.options_key if name.startswith("gear_mesh.") else self.gears_key
        return f"{at}.{name}".strip(".")

    def part(self, slot: str) -> str:
        """ "sun", "planet" and "ring" as the stage calls them: pinion and gear if parallel."""
        return _PARALLEL_WORDS.get(slot, slot) if self.stage.kind == "parallel" else slot

    def refuse(self, name: str, problem: str, remedy: str) -> InputError:
        """The error that says what is wrong with a key of the stage."""
        return InputError(self.source, self.key(name), problem, remedy)


def stage_key(stage: TrainStage, key: str) -> str:
    """A key of a stage as --set takes it: "stages.stage_2.planets"; the stage alone for ""."""
    alone = stage.name in ("", "stage")  # written [stage]
    return f"{'stage' if alone else f'stages.{stage.name}'}.{key}".rstrip(".")


def case_view(case: Case, stage: TrainStage) -> StageView:
    """A stage of a case."""
    at = stage_key(stage, "")
    if stage.flexible is None:
        return StageView(case.source, case.material, stage, at, at)
    own, inner = stage.flexible, f"{at}.flexible"
    if case.alone is not None:
        return own.view()
    return StageView(case.source, own.material, stage, f"{inner}.stage", inner, own.ring.tie)


@contextmanager
def inside(case: Case, stage: TrainStage) -> Iterator[None]:
    """Within it, an InputError about a flexible stage's own case tells which stage it is."""
    if case.alone is not None:
        yield
        return
    try:
        yield
    except InputError as fault:
        key = f"{stage_key(stage, 'flexible')}.{fault.key}"
        raise InputError(case.source, key, fault.problem, fault.remedy) from None


@contextmanager
def spoken(case: Case) -> Iterator[None]:
    """Within it, an InputError about a case in the short form names keys and bodies as its text
    does."""
    try:
        yield
    except InputError as fault:
        if case.alone is None:
            raise
        key = re.sub(r"^stages?\.(stage\.)?flexible\.", "", fault.key)
        texts = [
            re.sub(_OWN_BODY, "", text.replace("stage.flexible.", ""))
            for text in (fault.problem.replace("planets of stage", "planets"), fault.remedy)
        ]
        raise InputError(fault.where, key, *texts) from None
