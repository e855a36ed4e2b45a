"""Names of bodies and units of keys."""

import json
import math
import pickle
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import flexgear
from flexgear.model.names import BodyName, FlankName, GearMeshName, GroupName, MemberName, NodeName
from flexgear.model.units import SUFFIXES, Quantity, unit_name

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
def test_a_name_that_is_read_back_has_the_same_fields(name):
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
    pattern = re.compile(r"\.(r?partition|rsplit|removeprefix|removesuffix)\(")
    assert [f.name for f in files if pattern.search(f.read_text(encoding="utf-8"))] == []


@given(dimension=st.sampled_from(sorted(SUFFIXES)), value=st.floats(-1e12, 1e12))
def test_a_value_survives_a_change_of_unit_and_back(dimension, value):
    q = Quantity(dimension)
    for suffix in q.suffixes:
        assert q.from_si(q.to_si(value, suffix), suffix) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("dimension", "suffix", "value", "si"),
    [
        ("length", "mm", 430, 0.43),
        ("length", "um", 36.8, 36.8e-6),
        ("angle", "deg", 180, math.pi),
        ("speed", "rpm", 60, 2 * math.pi),
        ("torque", "knm", 4000, 4e6),
        ("stiffness", "n_per_um", 1, 1e6),
        ("stiffness", "kn_per_mm", 1, 1e6),
        ("stiffness per face width", "n_per_mm_um", 14, 14e9),
        ("modulus", "gpa", 210, 210e9),
        ("density", "g_per_cm3", 7.85, 7850),
        ("inertia", "t_m2", 2, 2000),
        ("force", "kn", 2, 2000),
        ("power", "mw", 5, 5e6),
        ("power", "kw", 6.4, 6400),
        ("acceleration", "m_per_s2", 9.81, 9.81),
        ("kinematic viscosity", "mm2_per_s", 320, 320e-6),
        ("temperature", "c", 65, 338.15),
    ],
)
def test_factors_by_hand(dimension, suffix, value, si):
    assert Quantity(dimension).to_si(value, suffix) == pytest.approx(si, rel=1e-15)


def test_every_suffix_has_a_printed_name():
    for units in SUFFIXES.values():
        for suffix in units:
            assert "_" not in unit_name(suffix)
