"""Tan et al. 2023: what the paper says of every figure is among the statements."""

from tan2023.pictures import PICTURES
from tan2023.statements import STATEMENTS


def test_every_figure_is_drawn_and_has_a_statement() -> None:
    assert {f for s in STATEMENTS for f in s.figures} == set(range(7, 26))
    assert len({s.name for s in STATEMENTS}) == len(STATEMENTS)
    assert {p.number for p in PICTURES} == set(range(7, 26))
