"""All measures of a parameter study by name, for trains and for flexible stages."""

from __future__ import annotations

from collections.abc import Sequence

from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.flexible_stage import FlexibleStage
from flexgear.model.read import nearest
from flexgear.studies.measure import Found, Measure
from flexgear.studies.stage_measures import STAGE_MEASURES, STAGE_USUAL, StagePoint
from flexgear.studies.train_measures import TRAIN_MEASURES, TrainPoint, usual_measures


def measures_of(model: FlexibleStage | Case) -> dict[str, Measure]:
    """Measures that this kind of case has, by name."""
    known = TRAIN_MEASURES if isinstance(model, Case) else STAGE_MEASURES
    return {m.name: m for m in known}


def chosen_measures(model: FlexibleStage | Case, names: Sequence[str]) -> tuple[str, ...]:
    """The named measures, or the usual ones; InputError for one that is not known."""
    if not names:
        return usual_measures(model) if isinstance(model, Case) else STAGE_USUAL
    known = measures_of(model)
    for name in names:
        if name not in known:
            kind = "a train" if isinstance(model, Case) else "a flexible stage"
            raise InputError(
                "--measure", name, f"is no measure of {kind}", nearest(name, list(known))
            )
    return tuple(dict.fromkeys(names))


def measured(
    model: FlexibleStage | Case, reference: FlexibleStage | Case, names: Sequence[str], modes: int
) -> Found:
    """Arrays of the named measures at one point.

    reference: the case without the sweep's changes; modes: how many natural modes are listed.
    """
    if isinstance(model, Case):
        assert isinstance(reference, Case)
        point: TrainPoint | StagePoint = TrainPoint(model, reference, modes)
    else:
        point = StagePoint(model, modes)
    known, found = measures_of(model), Found()
    for name in names:
        found |= known[name].of(point)
    return found
