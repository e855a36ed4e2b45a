"""Every paper has rows and pictures, demanded rows hold, and all of it is on the one page."""

from __future__ import annotations

import pytest
from ledger import PAPERS, Ledger, Paper
from page import write_page
from rows import failures

EACH = pytest.mark.parametrize("paper", PAPERS, ids=lambda p: p.name)


@EACH
def test_paper_is_computed(paper: Paper, ledger: Ledger) -> None:
    entry = ledger.entry(paper.name)
    assert not entry.trouble, entry.trouble
    assert entry.rows and entry.pictures
    assert all(
        (ledger.folder / paper.name / p.file).stat().st_size > 10_000 for p in entry.pictures
    )


@EACH
def test_demanded_rows_hold(paper: Paper, ledger: Ledger) -> None:
    missed = failures(ledger.entry(paper.name).rows)
    assert not missed, missed


def test_page_shows_every_row_and_picture(ledger: Ledger) -> None:
    text = write_page(ledger).read_text("utf-8")
    for entry in ledger.entries():
        assert f'<h2 id="{entry.name}">' in text
        assert text.count(f'<img src="{entry.name}/') == len(entry.pictures)
    assert text.count("<td><span class=") >= sum(len(e.rows) for e in ledger.entries())
