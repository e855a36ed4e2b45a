"""Names are text to the user and have their parts as fields."""

import json
import pickle
import re
from pathlib import Path

import pytest

import flexgear
from flexgear.model.names import BodyName, FlankName, GearMeshName, GroupName, MemberName, NodeName

MESH = GearMeshName.of("stage_1", "ring", "left", 2)
NAMES = [
    MemberName.of("stage_1", "sun"),
    BodyName.of("stage_1", "planet", 2),
    BodyName.of("stage_1", "ring", side="right"),
    BodyName.of("", "housing"),
    GroupName.of("stage_1", "sun"),
    GroupName.of("stage_1", "sun", "right"),
    NodeName.of("tooth", 7, digits=3),
]


@pytest.mark.parametrize("name", NAMES)
def test_what_is_read_back_has_the_same_fields(name):
    """From a JSON key, as summaries have them, and sent to another process."""
    (text,) = json.loads(json.dumps({name: 1}))
    assert type(text) is str and text == name
    for again in (type(name).parse(text), pickle.loads(pickle.dumps(name))):
        assert type(again) is type(name)
        assert vars(again) == vars(name)


def test_a_gear_mesh_belongs_to_the_group_that_shares_its_load():
    assert MESH == "stage_1 ring left 2"
    assert MESH.group == "stage_1 ring left" and MESH.group.part == "ring left"
    assert vars(FlankName.parse(f"{MESH} drive")) == {"group": MESH.group, "sense": "drive"}


@pytest.mark.parametrize("layer", ["gears", "coupling", "analysis", "solve"])
def test_layers_between_input_and_output_take_no_name_apart(layer):
    files = sorted((Path(flexgear.__file__).parent / layer).rglob("*.py"))
    assert files
    apart = re.compile(r"\.(r?partition|rsplit|removeprefix|removesuffix)\(")
    assert [f.name for f in files if apart.search(f.read_text(encoding="utf-8"))] == []
