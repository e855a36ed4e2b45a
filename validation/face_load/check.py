"""Load along the face: rows and pictures of the page."""

from __future__ import annotations

from ledger import Ledger
from rows import failures


def test_statements_hold(ledger: Ledger) -> None:
    entry = ledger.entry("face_load")
    assert not entry.trouble, entry.trouble
    assert not failures(entry.rows), failures(entry.rows)
