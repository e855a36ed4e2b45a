"""Bodies that do not bend are neither meshed nor reduced."""

import pytest
from stage_samples import cheap_stage

from flexgear.model.load import load_case
from flexgear.solve import bodies
from flexgear.structures.sources.carrier import CarrierSource
from flexgear.structures.sources.fe_body import FeBody
from flexgear.structures.sources.ring import RingSource

STAGE_BODIES = bodies.stage_bodies


def refused(*_, **__):
    raise AssertionError("nothing of a rigid body is meshed or reduced")


@pytest.mark.parametrize(
    "arguments",
    [
        ("static", "--rigid", "all"),
        ("static", "--rigid", "ring"),
        ("static", "--set", "stage.ring.fe.flexible=false", "--rigid", "carrier"),
        ("modes", "--rigid", "all"),
        ("simulate", "--rigid", "all", "--duration-s", "0.002"),
    ],
)
def test_commands_mesh_and_reduce_only_what_bends(flexgear, monkeypatch, arguments):
    carrier = cheap_stage(load_case("wind-5mw").view())["stage.carrier"]
    monkeypatch.setattr(FeBody, "fe_mesh", refused)
    monkeypatch.setattr(bodies, "stage_bodies", STAGE_BODIES)
    monkeypatch.setattr(RingSource, "reduced", refused)
    carrier_bends = arguments[1:] == ("--rigid", "ring")
    monkeypatch.setattr(
        CarrierSource, "reduced", (lambda *_: carrier) if carrier_bends else refused
    )
    text = flexgear.json(arguments[0], "wind-5mw", *arguments[1:])
    if arguments[0] == "static":
        assert 1.0 < text["0 deg"]["stage"]["load_sharing"] < 1.2
