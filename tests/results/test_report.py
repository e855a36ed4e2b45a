"""Tables of a report: numbers, names and units as a person reads them."""

import pytest
from summary_samples import SUMMARY

from flexgear.gears.power_flow import power_flow
from flexgear.model.load import load_case
from flexgear.results.report.parts import SECTIONS, row_of, rows_of
from flexgear.results.report.tables import (
    case_tables,
    deflection_tables,
    face_tables,
    stage_tables,
)
from flexgear.results.report.wording import split_unit, with_unit, words


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (788275.0, "N", "788.3 kN"),
        (4e6, "N m", "4 MN m"),
        (21.3e-6, "m", "21.3 µm"),
        (0.43, "m", "430 mm"),
        (1.18, "rad/s", "11.268 r/min"),
        (1688.44, "mm", "1\u202f688.44 mm"),
        (1.0002, "factor", "1.0002"),
        (1.5634, "factor", "1.563"),
        (0.0211, "share", "2.11 %"),
        (0.349066, "angle", "20 °"),
        (1234567.0, "", "1\u202f234\u202f567"),
        (3.2e-9, "", "3.20 · 10⁻⁹"),
        (-0.0, "N", "0 N"),
        (-788275.0, "N", "−788.3 kN"),
        (-3.2e-9, "", "−3.20 · 10⁻⁹"),
        (-0.25, "factor", "−0.250"),
        (-3, "", "−3"),
        (6.14e-15, "m", "0 µm"),
        (None, "N", "–"),
        (float("nan"), "", "–"),
        (True, "", "yes"),
    ],
)
def test_numbers_have_units_a_person_uses(value, unit, text):
    assert with_unit(value, unit) == text


def test_figures_of_the_load_along_the_face_have_words():
    assert rows_of({"k_h_beta": 1.2})[0].label == "face load factor K_Hβ (ISO 6336-1)"
    (row,) = rows_of({"misalignment_by_cause_um, planet_bearing": 3.0})
    assert (row.label, row.unit) == ("misalignment by the planet bearing", "µm")
    (row,) = rows_of({"tip_load_share_max": 0.15})
    assert row.label == "largest share of the load off the path of contact"
    assert with_unit(row.value, row.unit) == "15 %"


def test_orders_of_a_ring_that_are_rounding_are_not_listed():
    steady = {**SUMMARY["steady"]["stage"], "radial_harmonics_um": [4.15, 1e-10, 0.0, 21.1, 0.0]}
    shape = list(deflection_tables({**SUMMARY, "steady": {"stage": steady}}))[-1]
    assert [row.label for row in shape.rows] == ["order 0", "order 3"]


def test_names_become_words():
    assert words("stage_1.ring") == "stage 1 ring"
    assert words("stage.sun") == "sun"
    assert split_unit("base_pitch_mm") == ("base pitch", "mm")
    assert split_unit("iso_single_stiffness_n_per_mm_um") == ("ISO single stiffness", "N/(mm µm)")


@pytest.mark.parametrize("name", ["wind-5mw", "pitch-drive", "double-rotor-5mw"])
def test_every_case_is_told_in_words_with_units(name):
    case = load_case(name)
    assert power_flow(case).input_power >= 0
    tables = case_tables(case)
    assert {t.section for t in tables} <= set(SECTIONS)
    rows = [(t.title, r.label, r.value) for t in tables for r in t.rows]
    assert all("_" not in label and "None" not in str(value) for _, label, value in rows)
    width = [value for _, label, value in rows if label == "face width"]
    assert width[0] == with_unit(case.stages[0].face_width, "m")
    angle = next(value for _, label, value in rows if label == "pressure angle")
    assert str(angle).endswith("°")


@pytest.mark.parametrize("name", ["wind-5mw", "grc-750kw"])
def test_stages_are_told_in_sentences(name):
    """No keys, no two rows of one name; sizes of what is left out in units a person uses."""
    tables = list(stage_tables(load_case(name)))
    for table in tables:
        labels = [row.label for row in table.rows]
        assert len({*labels}) == len(labels)
        assert not any("_" in text or "{" in text for text in (table.title, *labels))
    left_out = [t for t in tables if "not modelled" in t.title]
    assert len(left_out) == len(load_case(name).stages)
    rows = {row.label: with_unit(row.value, row.unit) for row in left_out[0].rows}
    assert rows["power lost in friction, share of that through the sun gear mesh"].endswith(" %")
    assert rows["bending of a pin inside its planet"].endswith(" µm")
    assert rows["friction force, across the line of action, ring gear mesh"].endswith(" kN")
    assert rows["oval planet rim, largest deflection at the ring gear mesh"].endswith(" µm")


FIGURES = {
    "k_h_beta": 1.5,
    "largest_line_load_n_per_mm": 1700.0,
    "largest_contact_pressure_mpa": 800.0,
    "misalignment_um": -90.0,
    "transmission_error_peak_to_peak_um": 4.0,
    "tip_contact_positions": 0.25,
    "misalignment_by_cause_um": {"ring": 17.0, "carrier": -107.0},
    "gear_mesh_stiffness_n_per_um": {"min": 1e4, "mean": 1.1e4, "max": 1.2e4},
    "transmission_error_orders_um": [1.6, 0.6, 0.2, 0.1],
}


def rows(one):
    less = {**one, "misalignment_um": 20.0, "k_h_beta": 1.1}
    flanks = {"stage ring 1 drive": less, "stage ring 2 drive": one}
    summary = {"face_load": {"flexible": flanks}}
    return {row.label: row for table in face_tables(summary) for row in table.rows}


def test_figures_come_in_si_units_or_as_they_are_said():
    by_label = rows(FIGURES)
    for label, value, unit in (
        ("ring, face load factor K_Hβ (ISO 6336-1)", 1.5, ""),
        ("ring, misalignment over the face", -90e-6, "m"),
        ("ring, largest Hertz pressure", 8e8, "Pa"),
        ("ring, edge contact of tips, of the positions", 0.25, "share"),
        ("ring, carrier", -107e-6, "m"),
        ("ring, stiffness of the gear mesh, mean", 1.1e10, "N/m"),
        ("ring, transmission error, order 3", 0.2e-6, "m"),
    ):
        assert abs(by_label[label].value / value - 1) < 1e-12
        assert by_label[label].unit == unit
    assert "ring, transmission error, order 4" not in by_label


def test_a_label_that_ends_in_a_number_is_set_off_from_its_value():
    """Thousands are separated by spaces: "order 1 2 708.3 Hz" would be read as another number."""
    row = row_of("gear_mesh", {"order 1": 2708.33, "order 2": 5416.67}, "Hz")
    assert row.value.startswith("order 1: 2") and "order 2: 5" in row.value
