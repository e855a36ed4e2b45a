"""What the common page shows of this paper: its statements as rows, its captioned figures."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from rows import Picture, Row

from flexgear.views.style import save_figure
from tan2023 import drive_statements, load_statements, motion_statements, ring_statements
from tan2023.caption import DPI, captioned
from tan2023.page import sorted_statements, verdict, write_page
from tan2023.pictures import PICTURES
from tan2023.runs import Runs
from tan2023.statements import Finding, Findings, Statement

TOPICS = (ring_statements, load_statements, motion_statements, drive_statements)


@cache
def findings(fidelity: str) -> Findings:
    """One set of runs and findings a session."""
    return Findings(Runs(fidelity))


def rows(fidelity: str) -> list[Row]:
    """Every statement; one that the paper makes and nothing demands is reported."""
    found = findings(fidelity)
    return [_row(one, found.of(one)) for one in sorted_statements()]


def _row(one: Statement, found: Finding) -> Row:
    disagrees = "Disagrees with the paper." if verdict(one, found) == "disagrees" else ""
    return Row(
        paper="tan2023",
        where="Figure " + ", ".join(str(f) for f in one.figures),
        quantity=one.name.replace("_", " "),
        published=one.published,
        computed=found.computed,
        tolerance=one.tolerance,
        holds=found.holds if one.demanded else None,
        why=" ".join(t for t in (disagrees, found.why) if t),
    )


@cache
def drawn(number: int, fidelity: str, folder: Path) -> Path:
    """The paper's figure with what it states and what we find below, drawn once."""
    found = findings(fidelity)
    one = next(p for p in PICTURES if p.number == number)
    lines = []
    for s in sorted_statements():
        if one.number in s.figures:
            lines.append((s.published, found.of(s).computed, verdict(s, found.of(s))))
    title = f"Figure {one.number}. {one.title}"
    figure = captioned(one.draw(found.runs), title, lines, one.note)
    return save_figure(figure, folder / one.file, dpi=DPI)


def draw(folder: Path, fidelity: str) -> list[Picture]:
    """All figures and the paper's own page."""
    write_page(folder, findings(fidelity))
    return [
        Picture(drawn(p.number, fidelity, folder).name, f"Figure {p.number}. {p.title}", p.note)
        for p in PICTURES
    ]
