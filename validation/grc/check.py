"""Load sharing of the GRC gearbox: rows and picture of the page."""

from __future__ import annotations

from ledger import Ledger
from rows import failures


def test_statements_hold(ledger: Ledger) -> None:
    entry = ledger.entry("grc")
    assert not entry.trouble, entry.trouble
    assert not failures(entry.rows), failures(entry.rows)
