"""Every paper has rows and pictures, demanded rows hold, and all of it is on the one page."""

from dataclasses import replace
from pathlib import Path

import pytest
from ledger import PAPERS, Entry, Ledger, Paper
from page import write_page
from rows import AGAINST, Picture, Row, failures

LONGEST = ("face_load", "tan2023", "grc", "solid_contact")
BY_LENGTH = sorted(PAPERS, key=lambda p: (*LONGEST, p.name).index(p.name))  # none ends alone


@pytest.mark.parametrize("paper", BY_LENGTH, ids=lambda p: p.name)
def test_paper_is_computed_and_its_demanded_rows_hold(paper: Paper, ledger: Ledger) -> None:
    entry = ledger.entry(paper.name)
    assert not entry.trouble, entry.trouble
    assert entry.rows and entry.pictures
    assert all(
        (ledger.folder / paper.name / p.file).stat().st_size > 10_000 for p in entry.pictures
    )
    missed = failures(entry.rows)
    assert not missed, missed


def test_page_shows_every_row_and_picture_and_what_rows_are_compared_with(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path, "quick", "now")
    row = Row("hu2023", "Table 1", "speed", "1 rpm", "1.01 rpm", "2 %", True)
    rows = tuple(replace(row, quantity=f"speed {k}", against=k) for k in AGAINST)
    drawn = (Picture("a.png", "A"), Picture("b.png", "B"))
    ledger.save(Entry("hu2023", "Hu et al.", rows, drawn, "2026-01-01", "now"))
    ledger.save(Entry("grc", "GRC", rows[:1], drawn[:1], "2026-01-01", "before"))
    text = write_page(ledger).read_text("utf-8")
    for name, pictures in (("hu2023", 2), ("grc", 1), ("ren2021", 0)):
        assert f'<h2 id="{name}">' in text
        assert text.count(f'<img src="{name}/') == pictures
    assert text.count("an earlier run") == 1 and text.count("failed or missing") == len(PAPERS) - 2
    for against, meaning in AGAINST.items():
        met = 2 if against == row.against else 1
        assert f'<tr><td>{against}</td><td class="met">{met}</td>' in text and meaning in text
        assert f"<td>1.01 rpm</td><td>{against}</td><td>2 %</td>" in text


def test_a_demanded_row_says_what_it_is_compared_with() -> None:
    for against in ("", "somebody"):
        with pytest.raises(ValueError, match="compared with"):
            Row("hu2023", "Table 1", "speed", "1 rpm", "1 rpm", "exact", True, against=against)
