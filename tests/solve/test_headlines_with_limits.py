"""Headlines beside stated limits: stresses, lives, films."""

import copy
from typing import Any

import pytest
from summary_samples import DROPS, SUMMARY

from flexgear.gears.power_flow import power_flow
from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.solve.headlines import headlines

ROOT, FLANK = "allowable_root_stress_mpa", "allowable_flank_pressure_mpa"
BEARING = {
    "stage.planet_bearing.dynamic_rating_kn": "9000",
    "stage.planet_bearing.rolling": "roller",
}


def answer(name: str, settings: dict[str, str], **changes: Any) -> dict[str, Any]:
    """One headline of ``wind-5mw`` with settings, of the summary with parts replaced."""
    case = load_case("wind-5mw", settings)
    summary = {**copy.deepcopy(SUMMARY), **changes}
    rows = headlines(case, power_flow(case), summary)
    return next(row for row in rows if row["name"] == name)


def fe_stress(**gears: float) -> dict[str, Any]:
    """Figures of the stage with computed root stresses, MPa."""
    stage = {
        **SUMMARY["stages"]["stage"],
        "root_stress_mpa": {g: {"max": s} for g, s in gears.items()},
    }
    return {"stages": {"stage": stage}}


@pytest.mark.parametrize(
    ("limit", "level"),
    [(240, "bad"), (360, "watch"), (380, "note")],  # 243 MPa at rest, 1.523 × as much in the drop
)
def test_a_nominal_stress_is_held_with_the_largest_force_and_never_called_within_limits(
    limit, level
):
    row = answer("root_stress", {f"stage.sun.{ROOT}": str(limit)}, **DROPS)
    assert (row["level"], row["value"], row["allowable"]) == (level, 243.0, limit)
    assert row["figure"] == f"243 of {limit} MPa"
    assert "370.1 MPa" in row["sentence"]
    assert "1.523 × nominal" in row["sentence"]
    assert "No allowable stress given: ring." in row["sentence"]
    assert ("No verdict" in row["sentence"]) == (level == "note")


def test_the_gear_that_uses_most_of_its_allowable_comes_first():
    settings = {f"stage.sun.{ROOT}": "600", f"stage.ring.{ROOT}": "300"}
    row = answer("root_stress", settings)
    assert row["figure"] == "206 of 300 MPa"
    assert row["sentence"].startswith("Ring")


def test_a_stress_by_finite_elements_is_within_limits_below_its_allowable():
    settings = {f"stage.{gear}.{ROOT}": "400" for gear in ("sun", "planet", "ring")}
    row = answer("root_stress", settings, **fe_stress(sun=250.0, planet=260.0, ring=210.0))
    assert (row["level"], row["figure"]) == ("good", "260 of 400 MPa")
    assert row["sentence"].startswith("Planet, by finite elements")


def test_a_gear_without_an_allowable_leaves_no_stage_within_limits():
    row = answer("root_stress", {f"stage.ring.{ROOT}": "400"}, **fe_stress(sun=900.0, ring=210.0))
    assert (row["level"], row["figure"]) == ("note", "210 of 400 MPa")
    assert "sun 900 MPa" in row["sentence"]
    assert "No allowable stress given: sun." in row["sentence"]


def test_a_bearing_without_a_required_life_leaves_no_stage_within_limits():
    settings = {**BEARING, "stage.planet_bearing.required_life_h": "175000"}
    lives = {"planet_bearing_1": 180e3, "carrier_bearing_drive": 9e6}
    stage = {**SUMMARY["stages"]["stage"], "bearing_life_h": lives}
    row = answer("bearing_life", settings, stages={"stage": stage})
    assert (row["level"], row["value"]) == ("note", 180e3)
    assert "No required life given: carrier bearing drive." in row["sentence"]


def test_bearings_without_a_rating_are_named_unless_their_load_is_rounding():
    seats = {"carrier_bearing_force_n": {"drive": 6e-4, "far": 2.5e4}}
    row = answer("bearing_life", {}, stages={"stage": SUMMARY["stages"]["stage"] | seats})
    assert "planet bearing (1.469 MN), carrier bearing, far side (25 kN)." in row["sentence"]
    assert "drive" not in row["sentence"]
    seats["axial_bearing_force_n"] = {"carrier_bearing_far": 2e3, "ring_hub_bearing": 4e3}
    row = answer("bearing_life", {}, stages={"stage": SUMMARY["stages"]["stage"] | seats})
    assert "carrier bearing, far side (25 kN, axial 2 kN)" in row["sentence"]
    assert "ring hub bearing (axial 4 kN)." in row["sentence"]


def test_a_bearing_with_a_rating_under_thrust_alone_is_not_asked_for_it():
    """Without ``thrust`` its life is not known, of a helical sun, say."""
    alone = {"axial_bearing_force_n": {"sun_support": 2e3}}
    alone["not_in_bearing_life"] = {"sun_support": 20.0}
    row = answer("bearing_life", {}, stages={"stage": SUMMARY["stages"]["stage"] | alone})
    assert "sun support, on which thrust or moment is over 1 000 % of it; `thrust` counts" in (
        row["sentence"].replace("\u202f", " ")
    )
    assert row["level"] == "open" and "given: planet bearing (1.469 MN)." in row["sentence"]


@pytest.mark.parametrize(
    ("film", "level", "figure"),
    [(16.2, "open", "oil film 16.2 µm"), (2.9, "bad", "surfaces touch")],
)
def test_plain_planet_bearings_are_held_to_their_least_film(film, level, figure):
    """They have no rating life, so none is asked for."""
    keys = {"diameter_mm": 300, "length_mm": 150, "clearance_um": 150, "viscosity_mpa_s": 40}
    journal = {f"stage.planet_bearing.journal.{k}": str(v) for k, v in keys.items()}
    journal |= {"stage.planet_bearing.journal.least_film_um": "3"}
    stage = SUMMARY["stages"]["stage"] | {"least_film_um": film}
    row = answer("bearing_life", journal, stages={"stage": stage})
    assert (row["level"], row["figure"]) == (level, figure)
    assert f"least oil film {film} µm, surfaces touch at 3 µm." in row["sentence"]
    assert "No dynamic rating given: planet bearing" not in row["sentence"]


def test_no_verdict_on_roots_names_what_is_not_computed():
    limits = {f"stage.{gear}.{ROOT}": "900" for gear in ("sun", "planet", "ring")}
    for model, lacks in (("per_pair", "load"), ("face_load", "root stress")):
        row = answer("root_stress", {**limits, "stage.gear_mesh.model": model})
        assert f"No verdict: the {lacks} along the face is not computed." in row["sentence"]


def test_a_flank_pressure_is_held_to_the_softer_gear_and_grows_with_the_root_of_the_force():
    limits = {f"stage.sun.{FLANK}": "1500", f"stage.planet.{FLANK}": "1400"}
    row = answer("flank_pressure", limits, **DROPS)
    assert row["allowable"] == 1400.0
    grown = row["value"] * 1.523**0.5
    assert f"{100 * grown / 1400:.3g} %" in row["sentence"]


@pytest.mark.parametrize(("life", "level"), [(180e3, "good"), (170e3, "bad")])
def test_a_life_is_held_to_the_required_one(life, level):
    settings = {**BEARING, "stage.planet_bearing.required_life_h": "175000"}
    stage = {**SUMMARY["stages"]["stage"], "bearing_life_h": {"planet_bearing_1": life}}
    row = answer("bearing_life", settings, stages={"stage": stage})
    assert (row["level"], row["value"], row["allowable"]) == (level, life, 175e3)
    assert row["figure"].endswith(" of 175\u202f000 h (20 years) required")
    assert "No required life" not in row["sentence"]
    thrust = {"not_in_bearing_life": {"planet_bearing_1": 0.61}}
    row = answer("bearing_life", settings, stages={"stage": stage | thrust})
    assert row["level"] == {"good": "note", "bad": "bad"}[level]
    assert (
        "without verdict: planet bearing 1, on which thrust or moment is 61 % of it"
        in (row["sentence"])
    )
    moment = {"not_in_bearing_life": {"carrier_support": 105.0}}  # which has no radial load
    row = answer("bearing_life", settings, stages={"stage": stage | moment})
    assert row["level"] != "good" and "carrier support, on which thrust or" in row["sentence"]
    row = answer("bearing_life", BEARING, stages={"stage": stage})
    assert "No required life given." in row["sentence"]


def test_a_required_life_needs_a_rating():
    with pytest.raises(InputError, match=r"dynamic_rating.*is missing beside required_life"):
        load_case("wind-5mw", {"stage.planet_bearing.required_life_h": "175000"})
