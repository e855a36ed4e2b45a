"""``flexgear new``: whatever it proposes assembles, loads, and passes check and statics."""

import math
import os
import sys
import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexgear as fg
from flexgear.cli.check_sections import derived
from flexgear.coupling.workable import stand_ins
from flexgear.files.new_case import new_case_text
from flexgear.gears.sizing import Wanted, propose
from flexgear.model.errors import InputError
from flexgear.model.load import case_of_toml
from flexgear.solve.bodies import StageBodies
from flexgear.structures.fe_mesh import carrier_of_case, ring_of_case

wanted_stages = st.builds(
    Wanted,
    ratio=st.floats(2.6, 11.5),
    planets=st.integers(2, 7),
    torque=st.floats(0.5, 7.0).map(lambda x: 10**x),
    speed=st.floats(-0.5, 3.0).map(lambda x: 10**x),
    helix=st.sampled_from([0.0, 7.5, 12.0, 18.0]).map(math.radians),
) | st.builds(
    Wanted,
    ratio=st.floats(2.6, 11.5),
    planets=st.integers(2, 7),
    torque=st.floats(2.0, 6.5).map(lambda x: 10**x),
    speed=st.floats(0.5, 3.0).map(lambda x: 10**x),
    helix=st.sampled_from([15.0, 25.0, 32.0]).map(math.radians),
    double_helical=st.just(True),
)


def case_of(wanted):
    return case_of_toml(tomllib.loads(new_case_text(propose(wanted))), "new.toml", "new")


def refusal(wanted):
    try:
        case_of(wanted)
    except InputError as refused:
        return refused
    return None


@settings(max_examples=25)
@given(wanted_stages)
def test_any_proposal_passes_check_and_static(wanted):
    refused = refusal(wanted)
    if refused:  # no room for that many planets, or larger than anything that is built: it says so
        assert (refused.where, refused.key) in (("new", "--planets"), ("new", "--torque-nm"))
        # pitch circles of neighbours touch at a ratio of 2/(1 - sin π/N); their tips need room, too
        room = wanted.ratio * (1 - math.sin(math.pi / wanted.planets)) < 1.6
        assert not room or wanted.torque > 5e5
        return
    found, case = propose(wanted), case_of(wanted)
    assert found.ratio == pytest.approx(wanted.ratio, rel=0.05)
    assert (found.sun + found.ring) % wanted.planets == 0
    assert derived(case)
    rigid = StageBodies(*stand_ins(case.view()))  # of the case's size; reductions take minutes
    model = fg.assemble(case, ["all"], bodies={"stage": rigid})
    static = fg.static(model, np.zeros(1))
    out = -static.port_torque.isel(port=-1).item()
    assert abs(out) == pytest.approx(wanted.torque / found.ratio, rel=1e-3)
    assert static.gear_mesh_force.min().item() > 0


@pytest.mark.parametrize(
    "wanted",
    [
        Wanted(4.0, 5, 3e2, 150.0),
        Wanted(6.5, 3, 2e6, 1.5, 0.13),
        Wanted(4.5, 3, 2e5, 20.0, 0.5, None, True),
    ],
)
def test_its_bodies_can_be_meshed(wanted):
    stage = case_of(wanted).with_(**{"solver.fidelity": "quick"}).view()
    assert ring_of_case(stage).points.size
    assert carrier_of_case(stage).points.size


FLAGS = ("--ratio", 5, "--planets", 3, "--torque-nm", 2e4, "--speed-rpm", 60)


def test_it_writes_a_case_once_with_the_schema_beside_it(flexgear, tmp_path):
    case = tmp_path / "mine.toml"
    code, out, _ = flexgear("new", case, *FLAGS)
    assert code == 0
    assert "flexgear check" in out
    assert "#:schema" not in case.read_text()
    assert "is there already" in flexgear("new", case, *FLAGS)[2]
    flexgear("schema", "--out", tmp_path / "flexgear.schema.json")
    assert flexgear("new", case, *FLAGS, "--force", "--helix-deg", 8)[0] == 0
    assert case.read_text().startswith("#:schema ./flexgear.schema.json\n")
    assert flexgear("check", case)[0] == 0


def test_it_asks_on_a_terminal_for_what_is_left_out(flexgear, tmp_path, monkeypatch):
    """Answers through a pseudo terminal: one given, one refused and asked again, others usual."""
    keyboard, terminal = os.openpty()
    os.write(keyboard, b"5\nthree\n3\n\n")
    case = tmp_path / "mine.toml"
    with os.fdopen(terminal, encoding="utf-8") as answers:
        monkeypatch.setattr(sys, "stdin", answers)
        code, out, err = flexgear("new", case, "--speed-rpm", 60)
    os.close(keyboard)
    assert code == 0, err
    assert out.index("speed of the sun") < out.index("number of planets") < out.index("torque")
    assert "rated speed" not in out  # as it was given
    assert case.read_text() == new_case_text(propose(Wanted(5.0, 3, 1e4, 60 * math.pi / 30)))


def test_a_larger_module_carries_the_same_in_a_narrower_face():
    usual = propose(Wanted(5.0, 3, 2e4, 6.0))
    coarse = propose(Wanted(5.0, 3, 2e4, 6.0, module=1.5 * usual.module))
    assert coarse.face_width < usual.face_width


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"--ratio": 20}, "--ratio: 20 is not from 2.5 to 12"),
        ({"--planets": 7, "--ratio": 9}, "use fewer planets"),
        ({"--module-mm": 1}, "--module-mm: 1 mm needs a face"),
        ({"--speed-rpm": -5}, "--speed-rpm: -5 is not above 0"),
        ({"--torque-nm": None}, "--torque-nm: is missing"),
    ],
)
def test_what_cannot_be_is_said_in_one_line(flexgear, tmp_path, change, says):
    given_ = {**dict(zip(FLAGS[::2], FLAGS[1::2], strict=True)), **change}
    flags = [x for key, value in given_.items() if value is not None for x in (key, value)]
    code, _, err = flexgear("new", tmp_path / "mine.toml", *flags)
    assert code == 2
    assert says in err
    assert err.count("\n") == 1
    assert not (tmp_path / "mine.toml").exists()
