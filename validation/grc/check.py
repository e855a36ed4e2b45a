"""Load sharing of the GRC gearbox: rows and picture of the page; its table is what is stored."""

from __future__ import annotations

from ledger import Ledger
from rows import failures

from grc.by_cause import PAGE, TABLE, stored, table
from grc.causes import every_cause


def test_statements_hold(ledger: Ledger) -> None:
    entry = ledger.entry("grc")
    assert not entry.trouble, entry.trouble
    assert not failures(entry.rows), failures(entry.rows)


def test_table_of_the_page_is_what_is_stored() -> None:
    """Both are written by grc.by_cause, for the causes that it lists."""
    assert list(stored()) == [cause.name for cause in every_cause()]
    written = TABLE.search(PAGE.read_text("utf-8"))
    assert written is not None and written[0] == table()
