"""The page of all variables says what the code says."""

from pathlib import Path

import pytest

from flexgear.results.quantities import QUANTITIES
from flexgear.results.result_quantities import RESULT_QUANTITIES

PAGE = (Path(__file__).parents[2] / "docs" / "results.md").read_text(encoding="utf-8")
WHOLE, PART = PAGE.split("## One flexible stage")


@pytest.mark.parametrize(("text", "known"), [(WHOLE, RESULT_QUANTITIES), (PART, QUANTITIES)])
def test_every_variable_stands_there_with_axes_and_unit(text, known):
    rows = {line.split("`")[1]: line for line in text.splitlines() if line.startswith("| `")}
    assert list(rows) == list(known)
    for name, quantity in known.items():
        axes = ", ".join(quantity.dims) or "–"
        assert rows[name].startswith(f"| `{name}` | {axes} | {quantity.units or '–'} | ")
        assert quantity.meaning in rows[name]
