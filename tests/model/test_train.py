"""Reading, overriding, changing and hashing trains."""

import math

import pytest
from small_train import ALONE, FLEXIBLE, SMALL

from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import load_case


@pytest.fixture
def write(tmp_path):
    def write(text, name="mine.toml"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_only_a_case_of_one_stage_has_the_stage(write):
    assert load_case(write(ALONE)).view().name == "stage"
    with pytest.raises(InputError, match="stages: are stage_1, stage_2 -- name one"):
        load_case(write(SMALL)).view()


def test_members_and_what_is_held(write):
    train = load_case(write(SMALL))
    assert train.name == "mine"
    assert [s.name for s in train.stages] == ["stage_1", "stage_2"]
    assert train.member_names() == (
        "stage_1.sun", "stage_1.ring", "stage_1.carrier", "stage_2.pinion", "stage_2.gear",
    )  # fmt: skip
    assert train.held_members() == ("stage_1.ring",)
    assert train.stage_index("stage_2.gear") == 1
    assert train.member("stage_1.planet").teeth == 20
    assert train.kinematics_of("stage_1.planet") == "planar"
    assert train.stage("stage_2").planet_angles == pytest.approx((math.radians(30),))
    assert train.inputs[0].given_torque == pytest.approx(1000 / (math.pi / 3))


def test_a_star_stage_holds_its_carrier_and_not_its_ring(write):
    over = {
        "stage.carrier.kinematics": "fixed",
        "stage.ring.kinematics": "planar",
        "inputs.0.member": "stage.sun",
        "output.member": "stage.ring",
    }
    train = load_case(write(ALONE), over)
    assert train.held_members() == ("stage.carrier",)
    # no ring that nobody named is added where something else is held already
    idle = load_case(write(ALONE), {**over, "output.member": "stage.sun",
                                    "inputs.0.member": "stage.ring"})  # fmt: skip
    assert idle.held_members() == ("stage.carrier",)


def test_one_stage_under_its_short_name(write):
    alone = write(ALONE)
    listed = write(ALONE.replace("[stage]", '[[stages]]\nname = "stage"'), "listed.toml")
    train = load_case(alone)
    assert train.stages[0].name == "stage"
    assert train.content_hash() == load_case(listed).content_hash()
    for key in ("stage.planets", "stages.0.planets", "stages.stage.planets"):
        assert load_case(alone, {key: "4"}).stages[0].planets == 4
    assert train.with_(**{"stage.planets": 4}).stages[0].planets == 4
    with pytest.raises(InputError, match=r"--set: stage\.planets: 0 is outside"):
        load_case(alone, {"stage.planets": "0"})
    with pytest.raises(InputError, match=r"mine\.toml: stage\.sun\.teth: is not a known key"):
        load_case(write(ALONE.replace("sun = { teeth", "sun = { teth")))


def test_stages_are_named_by_number_or_name(write):
    path = write(SMALL)
    for key in ("stages.1.pinion.teeth", "stages.stage_2.pinion.teeth"):
        assert load_case(path, {key: "21"}).stages[1].pinion.teeth == 21
    with pytest.raises(InputError, match=r"stage\.planets: there are 2 stages"):
        load_case(path, {"stage.planets": "4"})
    with pytest.raises(InputError, match="no stage is named 'stage_3' -- did you mean stage_"):
        load_case(path, {"stages.stage_3.planets": "4"})


def test_hash_follows_the_content(write):
    train = load_case(write(SMALL))
    assert len(train.content_hash()) == 64
    assert train.with_(name="other", title="x").content_hash() == train.content_hash()
    wider = train.with_(**{"stages.stage_1.face_width": 0.03})
    assert wider.content_hash() != train.content_hash()
    assert wider.content_hash("joints", "output") == train.content_hash("joints", "output")
    in_metres = load_case(write(SMALL.replace("face_width_mm = 20", "face_width_m = 0.02")))
    assert in_metres.content_hash() == train.content_hash()


@pytest.mark.parametrize("text", [SMALL, ALONE, FLEXIBLE], ids=["small", "alone", "flexible"])
def test_trains_round_trip_through_plain_data(write, text):
    train = load_case(write(text))
    assert Case.model_validate_json(train.model_dump_json(), strict=False) == train
    assert train.with_() == train
    assert train.to_dict()["stages"][0]["planets"] == train.stages[0].planets


def test_changes_are_checked(write):
    train = load_case(write(SMALL))
    assert train.with_(**{"stages.0.sun.mass": 2.0}).stages[0].sun.mass == 2.0
    support = train.stages[0].carrier.support
    assert train.with_(**{"stages.0.sun.support": support}).member("stage_1.sun").support == support
    with pytest.raises(InputError, match=r"with_: joints\[0\]\.first: 'a' is not a member"):
        train.with_(**{"joints.0.first": "a"})


def test_a_stage_is_seen_as_gear_functions_see_a_case(write):
    train = load_case(write(SMALL))
    view = train.view("stage_1")
    assert view.source == train.source
    assert view.key("planets") == "stages.stage_1.planets"
    assert view.stage.planet_angles == train.stages[0].planet_angles
    assert (view.stage.sun.teeth, view.stage.ring.teeth) == (20, 60)
    assert view.errors is train.stages[0].errors
    alone = load_case(write(ALONE))
    assert alone.view("stage").key("planets") == "stage.planets"


def test_a_flexible_stage_has_the_gears_of_its_case(write):
    train = load_case(write(FLEXIBLE))
    case, stage = load_case("wind-5mw").view(), train.stages[0]
    assert stage.dump_geometry() == case.stage.dump_geometry()
    assert stage.gear_mesh.model == "per_pair"
    assert stage.planet_bearing.stiffness == case.stage.planet_bearing.stiffness
    assert stage.errors.ring_tooth == case.errors.ring_tooth
    assert stage.errors.carrier_eccentricity == 30e-6
    assert stage.ring.fe == case.with_(stage__ring__fe__flexible=False).ring
    assert train.kinematics_of("stage_1.ring") == "spatial"
    assert train.held_members() == ("stage_1.ring",)
    assert train.view("stage_1").material == case.material


def test_a_stage_of_another_case_is_changed_as_any_other(write):
    path = write(FLEXIBLE)
    over = {"stage.planets": "3", "stage.sun.shaft.sections.0.length_mm": "500"}
    train = load_case(path, over)
    assert (train.stages[0].planets, train.view().shaft.sections[0].length) == (3, 0.5)
    assert train.with_(**{"stage.planets": 4}).stages[0].planets == 4
    assert train.content_hash() != load_case(path).content_hash()


def test_a_flexible_stage_by_file_beside_the_train(write, tmp_path):
    from flexgear.model.load import bundled_text

    (tmp_path / "low.toml").write_text(bundled_text("wind-5mw"), encoding="utf-8")
    by_file = load_case(write(FLEXIBLE.replace('"wind-5mw"', '"low.toml"')))
    assert by_file.content_hash() == load_case(write(FLEXIBLE)).content_hash()


def test_lists_of_planets_hold_one_for_all_or_one_each():
    errors = GearErrors(planet_eccentricity=(1e-5,), planet_thickness=(1e-6, -1e-6, 0.0))
    assert errors.of_planets("planet_eccentricity", 3) == (1e-5, 1e-5, 1e-5)
    assert errors.of_planets("planet_thickness", 3) == (1e-6, -1e-6, 0.0)
    assert errors.of_planets("planet_eccentricity_phase", 2) == (0.0, 0.0)
