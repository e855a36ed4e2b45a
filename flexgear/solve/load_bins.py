"""Load bins of a case: of its load cases and of its series."""

from __future__ import annotations

from flexgear.gears.load_bins import LoadBin, bins_of_load_cases
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.solve.load_series import Report, SeriesBins, bins_of_series


def load_bins(case: Case, report: Report | None = None) -> tuple[LoadBin, ...]:
    """All load bins of a case, those with a duration first. Raises InputError where there is none,
    and for whatever is wrong in one of them."""
    return bins_with_series(case, bins_of_series(case, report))


def bins_with_series(case: Case, series: SeriesBins | None) -> tuple[LoadBin, ...]:
    """Those of the case's load cases and of series that were sorted before."""
    bins = bins_of_load_cases(case, series.load_cases if series else ())
    if not bins:
        raise InputError(
            case.source, "load_cases", "is missing",
            'add [[load_cases]] with name, hours, torque_knm, or [spectrum] with file = "bins.csv"',
        )  # fmt: skip
    return tuple(sorted(bins, key=lambda load_bin: load_bin.extreme))
