"""ISO 6336-6, annex C: cycles to failure of every bin, and the sum of damage."""

from rows import failures

from iso_6336_6.statements import rows


def test_every_printed_figure_is_met() -> None:
    table = rows()
    assert len(table) == 44
    assert all(row.holds for row in table), failures(table)
