"""Tables of the stages of a case, from what ``flexgear check`` derives (``gears.report``)."""

from __future__ import annotations

from collections.abc import Iterator

from flexgear.gears.report import case_reports
from flexgear.model.case import Case
from flexgear.results.report.key_words import rows_of
from flexgear.results.report.parts import Table
from flexgear.results.report.wording import words

GEOMETRY, MESH = "geometry", "meshes"
GEAR_MESHES = ("gear_mesh", "ring_gear_mesh", "sun_gear_mesh")
_TITLES = {
    "not_modelled": "not modelled, with its size",
    "missing_on_flanks": "missing on modified flanks, least and most",
}


def stage_tables(case: Case) -> Iterator[Table]:
    """Tables of assembly, gears, gear meshes, modified flanks and what is not modelled."""
    for stage, report in case_reports(case).items():
        for name, rows in report.items():
            section = MESH if name in GEAR_MESHES else GEOMETRY
            title = f"{words(stage)} {_TITLES.get(name, words(name))}".strip()
            yield Table(section, title, rows_of(rows))
