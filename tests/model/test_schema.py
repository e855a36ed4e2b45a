"""The JSON schema of cases: made from the model, so it takes what the model takes."""

import copy
import tomllib
from functools import cache

import jsonschema
import pytest

from flexgear.model.load import bundled_cases, bundled_text, case_of_toml
from flexgear.model.schema import json_schema, keys, prose, sections, words


@cache
def validator():
    """Made by the process that comes to such a test, not by all that read this module."""
    return jsonschema.Draft7Validator(json_schema())


def bundled(name: str) -> dict:
    return tomllib.loads(bundled_text(name))


def complaints(data: dict) -> list[str]:
    return [fault.message for fault in validator().iter_errors(data)]


def test_the_schema_of_cases_is_a_valid_json_schema():
    jsonschema.Draft7Validator.check_schema(validator().schema)


@pytest.mark.parametrize("name", bundled_cases())
def test_bundled_case_is_valid(name):
    assert complaints(bundled(name)) == []


def changed(name: str, *path, value=None, drop=False) -> dict:
    data = copy.deepcopy(bundled(name))
    place = data
    for part in path[:-1]:
        place = place[part]
    if drop:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return data


WRONG = {
    "unknown key": changed("wind-5mw", "stage", "plants", value=5),
    "unknown section": changed("wind-5mw", "rim", value={}),
    "no unit": changed("wind-5mw", "stage", "face_width", value=0.4),
    "wrong unit": changed("wind-5mw", "stage", "face_width_rpm", value=400),
    "out of range": changed("wind-5mw", "stage", "pressure_angle_deg", value=50),
    "wrong word": changed("wind-5mw", "stage", "gear_mesh", "model", value="pairs"),
    "not a number": changed("wind-5mw", "stage", "ring", "fe", "rim_thickness_mm", value="thick"),
    "needed key": changed("wind-5mw", "stage", "carrier", "fe", "hub_bore_mm", drop=True),
    "needed in a stage": changed("lin-parker", "stage", "normal_module_mm", drop=True),
    "section of an earlier form": changed("nrel-5mw", "ring", value={"rim_thickness_mm": 50}),
    "key of an earlier form": changed("nrel-5mw", "drive", value={"rated_speed_rpm": 12}),
    "no stage": changed("lin-parker", "stage", drop=True),
}


@pytest.mark.parametrize("name", WRONG)
def test_the_schema_refuses_what_the_reader_refuses(name):
    assert complaints(WRONG[name])
    with pytest.raises(Exception, match="--"):
        case_of_toml(WRONG[name], "case.toml", "case")


TAKEN = {
    "another unit": changed("lin-parker", "stage", "face_width_m", value=0.03),
    "several bolt circles": changed(
        "wind-5mw",
        "stage",
        "ring",
        "fe",
        "bolts",
        value=[bundled("wind-5mw")["stage"]["ring"]["fe"]["bolts"]],
    ),
    "one shift": changed("wind-5mw", "stage", "ring", "fe", "fe_mesh_shift_mm", value=2.0),
    "a stage of another case": {
        "material": bundled("wind-5mw")["material"],
        "stages": [{"name": "first", "case": "wind-5mw", "ring": {"fe": {"rim_thickness_mm": 90}}}],
        "inputs": [{"member": "first.carrier", "speed_rpm": 10, "torque_knm": 4000}],
        "output": {"member": "first.sun"},
    },
}


@pytest.mark.parametrize("name", TAKEN)
def test_the_schema_takes_what_the_reader_takes(name):
    TAKEN[name].get("stage", {}).pop("face_width_mm", None) if "unit" in name else None
    assert complaints(TAKEN[name]) == []
    case_of_toml(TAKEN[name], "case.toml", "case")


def test_every_key_has_a_meaning():
    """Stated in the docstring of its section."""
    for section in sections():
        lacking = [key.name for key in keys(section) if not key.meaning]
        assert prose(section) and not lacking, (section.__name__, lacking)


def test_limits_and_defaults_are_in_the_units_of_the_keys():
    shift = validator().schema["definitions"]["Stage"]["properties"]
    assert shift["pressure_angle_deg"]["minimum"] == 10
    assert shift["face_width_mm"]["maximum"] == 2000
    assert shift["face_width_m"]["maximum"] == 2
    assert "mm" in shift["face_width_mm"]["description"]


def test_words_are_explained():
    from flexgear.model.machine import Machine

    assert set(words(Machine, "law")) == {"torque", "speed", "controller", "brake"}
    assert set(words(Machine, "kind")) == {"constant", "steps", "ramp", "soft", "csv"}
    assert words(Machine, "kp") == {}
