"""The page of all variables says what the code says."""

import pytest
from results_page import SECTIONS, rows_of, undocumented

from flexgear.results.quantities import QUANTITIES
from flexgear.results.result_quantities import RESULT_COORDINATES, RESULT_QUANTITIES
from flexgear.solve.headlines import HEADLINES

WHOLE, PART = SECTIONS["# What results hold"], SECTIONS["One flexible stage"]


def test_every_coordinate_stands_there_with_its_unit():
    rows = rows_of(SECTIONS["Coordinates"])
    assert list(rows) == list(RESULT_COORDINATES)
    for name, (units, meaning) in RESULT_COORDINATES.items():
        assert rows[name] == f"| `{name}` | {units or '–'} | {meaning} |"


@pytest.mark.parametrize(("text", "known"), [(WHOLE, RESULT_QUANTITIES), (PART, QUANTITIES)])
def test_every_variable_stands_there_with_axes_and_unit(text, known):
    rows = rows_of(text)
    assert list(rows) == list(known)
    for name, quantity in known.items():
        axes = ", ".join(quantity.dims) or "–"
        assert rows[name].startswith(f"| `{name}` | {axes} | {quantity.units or '–'} | ")
        assert quantity.meaning in rows[name]


def test_every_headline_stands_there():
    rows = rows_of(SECTIONS["`summary.json`"])
    for h in HEADLINES:
        row = f"| `{h.name}` | {h.unit or '–'} | {h.meaning} | {h.allowable or '–'} |"
        assert rows[h.name] == row


def test_a_key_that_no_row_names_is_found():
    known = {"case": "x", "stages": {"first": {"kind": "planetary"}}, "torque_steps": {}}
    flat = {"kinematics": {"sun_speed_rpm": 1.0}, "reduction": {"ring": {"tie": "root"}}}
    deep = {"kinematics": {"first": {"sun_speed_rpm": 1.0}}, "modes": {"lowest": [{"type": 1}]}}
    for summary in (known, flat, deep):
        assert undocumented(summary) == []
    odd = {"stages": {"first": {"mass": 1.0}}, "mood": 3}
    assert undocumented(odd) == ["stages.first.mass", "mood"]
