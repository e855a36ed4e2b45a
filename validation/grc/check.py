"""Load sharing of the GRC gearbox: the table of its page is what is stored."""

from grc.by_cause import PAGE, TABLE, stored, table
from grc.causes import every_cause


def test_table_of_the_page_is_what_is_stored() -> None:
    """Both are written by grc.by_cause, for the causes that it lists."""
    assert list(stored()) == [cause.name for cause in every_cause()]
    written = TABLE.search(PAGE.read_text("utf-8"))
    assert written is not None and written[0] == table()
