"""Draws Figures 7-25 with the paper's statements beside ours, and the page over all of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from flexgear.views.style import save_figure
from tan2023 import drive_statements, load_statements, motion_statements, ring_statements
from tan2023.caption import DPI, captioned
from tan2023.page import sorted_statements, verdict, write_page
from tan2023.pictures import PICTURES, Picture
from tan2023.runs import Runs
from tan2023.statements import Findings

TOPICS = (ring_statements, load_statements, motion_statements, drive_statements)


@pytest.mark.parametrize("one", [pytest.param(p, id=f"figure_{p.number}") for p in PICTURES])
def test_figure_is_drawn(one: Picture, runs: Runs, findings: Findings, results: Path) -> None:
    rows = []
    for s in sorted_statements():
        if one.number in s.figures:
            found = findings.of(s)
            rows.append((s.published, found.computed, verdict(s, found)))
    figure = captioned(one.draw(runs), f"Figure {one.number}. {one.title}", rows, one.note)
    file = save_figure(figure, results / "tan2023" / one.file, dpi=DPI)
    assert file.stat().st_size > 20_000


def test_page_is_written(findings: Findings, results: Path) -> None:
    page = write_page(results / "tan2023", findings)
    text = page.read_text("utf-8")
    assert all(f"figure-{number}" in text for number in range(7, 26))
