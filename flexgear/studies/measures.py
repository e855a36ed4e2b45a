"""All measures of a parameter study by name."""

from __future__ import annotations

from collections.abc import Sequence

from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.read import nearest
from flexgear.studies.case_measures import MEASURES, Point, usual_measures
from flexgear.studies.measure import Measure, MeasuredValues, array

WARNING = "warning"
FE_ONLY = ("tooth_load", "tooth_displacement")


def measures_of(case: Case) -> dict[str, Measure]:
    """Measures that a case has, by name."""
    return {m.name: m for m in MEASURES if case.fe_ring_stages or m.name not in FE_ONLY}


def chosen_measures(case: Case, names: Sequence[str]) -> tuple[str, ...]:
    """The named measures, or the usual ones; InputError for one that is not known."""
    if not names:
        return usual_measures(case)
    measures_by_name = measures_of(case)
    for name in names:
        if name in FE_ONLY and name not in measures_by_name:
            raise InputError(
                "--measure", name, "needs a ring that bends", nearest(name, list(measures_by_name))
            )
        if name not in measures_by_name:
            raise InputError(
                "--measure", name, "is no measure", nearest(name, list(measures_by_name))
            )
    return tuple(dict.fromkeys(names))


def measured(case: Case, reference: Case, names: Sequence[str], modes: int) -> MeasuredValues:
    """Arrays of the named measures at one point, and ``WARNING`` where there is one.

    reference: the case without the sweep's changes; modes: how many natural modes are listed.
    """
    point, measures_by_name, figures = (
        Point(case, reference, modes),
        measures_of(case),
        MeasuredValues(),
    )
    for name in names:
        figures |= measures_by_name[name].of(point)
    if lines := point.warnings:
        figures[WARNING] = array("; ".join(lines), "", "what to mind at the point")
    return figures
