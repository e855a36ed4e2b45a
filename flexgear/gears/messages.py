"""Messages about one stage of a train: the stage's own name, and pinion and gear where it has them.

The geometry of a gear pair speaks of a sun and a planet; in a parallel stage these are the pinion
and the gear.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.train_stage import TrainStage

_PARALLEL_WORDS = {"sun": "pinion", "planet": "gear"}


def stage_key(stage: TrainStage, key: str) -> str:
    """A key of a stage as --set takes it: "stages.stage_2.planets"; the stage alone for ""."""
    alone = stage.name in ("", "stage")  # written [stage]
    return f"{'stage' if alone else f'stages.{stage.name}'}.{key}".rstrip(".")


def gear_mesh_name(stage: TrainStage, slot: str) -> str:
    """ "sun" or "ring"; "pinion" for the gear mesh of a parallel stage."""
    return _PARALLEL_WORDS.get(slot, slot) if stage.kind == "parallel" else slot


@contextmanager
def named(stage: TrainStage) -> Iterator[None]:
    """Within it, an InputError about "stage.…" tells which stage of the train it is."""
    try:
        yield
    except InputError as fault:
        key = stage_key(stage, fault.key.removeprefix("stage").lstrip("."))
        texts = [key, fault.problem, fault.remedy]
        if stage.kind == "parallel":
            texts[0] = re.sub(r"\.(sun|planet)(?=\.|$)", _parallel_word, key)
            texts[1:] = [re.sub(r"\b(sun|planet)\b", _parallel_word, t) for t in texts[1:]]
        raise InputError(fault.where, *texts) from None


@contextmanager
def inside(train: Case, stage: TrainStage) -> Iterator[None]:
    """Within it, an InputError about a flexible stage's own case tells which stage it is."""
    try:
        yield
    except InputError as fault:
        key = f"{stage_key(stage, 'flexible')}.{fault.key}"
        raise InputError(train.source, key, fault.problem, fault.remedy) from None


def _parallel_word(match: re.Match[str]) -> str:
    return match[0].replace(match[1], _PARALLEL_WORDS[match[1]])
