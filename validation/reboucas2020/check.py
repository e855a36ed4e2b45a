"""Every figure of three protocols of KISSsoft and two saved calculations is met."""

from rows import failures

from reboucas2020.statements import rows


def test_every_printed_figure_is_met() -> None:
    table = rows()
    assert len(table) > 180
    assert all(row.holds for row in table), failures(table)
