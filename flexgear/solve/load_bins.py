"""Load bins of a case: of its load cases and of its series."""

from __future__ import annotations

from flexgear.gears.load_bins import LoadBin, bins_of_load_cases
from flexgear.model.case import Case
from flexgear.model.errors import InputError


def load_bins(case: Case) -> tuple[LoadBin, ...]:
    """All load bins of a case, those with a duration first. Raises InputError where there is none,
    and for whatever is wrong in one of them."""
    bins = bins_of_load_cases(case)
    if not bins:
        raise InputError(
            case.source, "load_cases", "is missing",
            'add [[load_cases]] with name, hours, torque_knm, or [spectrum] with file = "bins.csv"',
        )  # fmt: skip
    return tuple(sorted(bins, key=lambda load_bin: load_bin.extreme))
