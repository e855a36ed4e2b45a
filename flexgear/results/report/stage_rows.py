"""Tables of the stages of a case, from what ``flexgear check`` derives (``gears.report``)."""

from __future__ import annotations

from collections.abc import Iterator

from flexgear.gears.report import case_report
from flexgear.model.case import Case
from flexgear.results.report.key_words import rows_of
from flexgear.results.report.parts import Table
from flexgear.results.report.wording import words

GEOMETRY, MESH = "geometry", "meshes"
_TITLES = {
    "not_modelled": "not modelled, with its size",
    "missing_on_flanks": "missing on modified flanks, least and most",
}


def stage_tables(case: Case) -> Iterator[Table]:
    """Tables of assembly, gears, gear meshes, modified flanks and what is not modelled."""
    for name, rows in case_report(case).items():
        section = MESH if name.endswith("gear_mesh") else GEOMETRY
        before, _, last = name.rpartition(" ")
        title = f"{words(before)} {_TITLES.get(last, words(last))}".strip()
        yield Table(section, title, rows_of(rows))
