"""Keys of summary.json are declared once: what must be there, the JSON schema, the docs."""

import copy

import jsonschema
import pytest

from flexgear.results.summary import KEYS, VERSION, json_schema, lacking
from flexgear.solve.headlines import HEADLINES, rows_schema

SCHEMA = json_schema({"headlines": rows_schema()})
PART = {
    "schema_version": VERSION,
    "stages": {"first": {"kind": "planetary", "gear_mesh_frequency_hz": 5.0}},
    "torque_steps": {"2e6": {"flexible": {"first": {"carrier_speed_rpm_min": 1.0}}}},
    "headlines": [
        {"name": HEADLINES[0].name, "unit": "1", "level": "note", "stage": "first", "value": 1.5,
         "figure": "1.5", "sentence": "Words.", "window": "", "allowable": None},
    ],
}  # fmt: skip


def faults(summary: dict) -> list[str]:
    """What an independent reader of the schema finds but for what is missing."""
    errors = jsonschema.Draft202012Validator(SCHEMA).iter_errors(summary)
    return [e.message for e in errors if e.validator != "required"]


def test_the_schema_is_one_and_takes_what_is_declared():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    assert faults(PART) == []
    assert len({key.path for key in KEYS}) == len(KEYS)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"mood": 3}, "'mood'"),
        ({"stages": {"first": {"mass": 1.0}}}, "'mass'"),
        ({"stages": {"first": {"gear_mesh_frequency_hz": "5"}}}, "'5' is not of type"),
        ({"schema_version": 1}, f"{VERSION} was expected"),
        ({"headlines": [{**PART["headlines"][0], "level": "fine"}]}, "'fine'"),
    ],
)
def test_the_schema_refuses_what_is_not(change, fault):
    (found,) = faults({**copy.deepcopy(PART), **change})
    assert fault in found


def test_what_must_be_there_is_named_where_it_is_missing():
    lost = lacking({**PART, "fe": {"ring": {}}})
    assert "stages.first.sun_gear_mesh_force_n" in lost and "energy_residual" in lost
    assert "torque_steps.2e6.flexible.gear_mesh_force" in lost
    assert "fe.ring.dofs" in lost
    assert not [name for name in lost if name.startswith(("steady", "kinematics", "headlines"))]


def test_figures_of_flexible_stages_stand_below_their_names():
    lost = lacking({"steady": {"first": {}}})
    assert "steady.first.carrier_speed_rpm_mean" in lost
