"""Every demanded statement is a test."""

from __future__ import annotations

import pytest

from tan2023 import drive_statements, load_statements, motion_statements, ring_statements
from tan2023.statements import STATEMENTS, Findings, Statement

TOPICS = (ring_statements, load_statements, motion_statements, drive_statements)


@pytest.mark.parametrize("one", STATEMENTS, ids=lambda one: one.name)
def test_statement(one: Statement, findings: Findings) -> None:
    found = findings.of(one)
    print(found.computed)
    if one.demanded:
        assert found.holds is not False, f"{found.computed} ({one.tolerance})"


def test_every_figure_has_a_statement() -> None:
    assert {f for s in STATEMENTS for f in s.figures} == set(range(7, 26))
    assert len({s.name for s in STATEMENTS}) == len(STATEMENTS)
