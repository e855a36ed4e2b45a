"""Draws Figures 7-25 with the paper's statements beside ours, and the page over all of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tan2023.on_page import drawn
from tan2023.page import write_page
from tan2023.pictures import PICTURES, Picture
from tan2023.statements import Findings


@pytest.mark.parametrize("one", [pytest.param(p, id=f"figure_{p.number}") for p in PICTURES])
def test_figure_is_drawn(one: Picture, fidelity: str, results: Path) -> None:
    assert drawn(one.number, fidelity, results / "tan2023").stat().st_size > 20_000


def test_page_is_written(findings: Findings, results: Path) -> None:
    page = write_page(results / "tan2023", findings)
    text = page.read_text("utf-8")
    assert all(f"figure-{number}" in text for number in range(7, 26))
