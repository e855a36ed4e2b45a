"""Trains: stages in series, bundled ones, what is refused."""

import math

import numpy as np
import pytest
from small_train import ALONE, FLEXIBLE, SMALL, refused

from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import bundled_text, load_case


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
    assert view.case.source == train.source
    assert view.key("planets") == "stages.stage_1.planets"
    assert view.stage.planet_angles == train.stages[0].planet_angles
    assert (view.stage.sun.teeth, view.stage.ring.teeth) == (20, 60)
    alone = load_case(write(ALONE))
    assert alone.view("stage").key("planets") == "stage.planets"


def test_a_flexible_stage_has_the_gears_of_its_case(write):
    train = load_case(write(FLEXIBLE))
    case, stage = load_case("wind-5mw").view(), train.stages[0]
    assert stage.dump_geometry() == case.stage.dump_geometry()
    assert stage.gear_mesh.model == "per_pair"
    assert stage.planet_bearing.stiffness == case.stage.planet_bearing.stiffness
    assert stage.errors.ring_tooth == case.stage.errors.ring_tooth
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

    (tmp_path / "low.toml").write_text(bundled_text("wind-5mw"), encoding="utf-8")
    by_file = load_case(write(FLEXIBLE.replace('"wind-5mw"', '"low.toml"')))
    assert by_file.content_hash() == load_case(write(FLEXIBLE)).content_hash()


def test_lists_of_planets_hold_one_for_all_or_one_each():
    errors = GearErrors(planet_eccentricity=(1e-5,), planet_thickness=(1e-6, -1e-6, 0.0))
    assert errors.of_planets("planet_eccentricity", 3) == (1e-5, 1e-5, 1e-5)
    assert errors.of_planets("planet_thickness", 3) == (1e-6, -1e-6, 0.0)
    assert errors.of_planets("planet_eccentricity_phase", 2) == (0.0, 0.0)


COUPLED = np.diag([1e8, 1e8, 1e8, 1e6, 1e6, 0]).tolist()
COUPLED[0][4] = COUPLED[4][0] = 1e6


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        # names
        ('first = "stage_1.sun"', 'first = "stage_1.sum"',
         r"joints\[0\].first: 'stage_1.sum' is not a member -- did you mean stage_1.sun"),
        ('first = "stage_1.sun"', 'first = "stage_2.gear"',
         r"joints\[0\].second: joins stage_2.gear with itself"),
        ('member = "stage_1.carrier"', 'member = "stage_3.carrier"',
         r"inputs\[0\].member: 'stage_3.carrier' is not a member"),
        ('member = "stage_1.carrier"', 'member = "stage_1.planet"',
         r"'stage_1.planet' is not a member -- .*stepped planets \(Wolfrom\) .* not modelled"),
        ('member = "stage_2.pinion"', 'member = "pinion"', "output.member: 'pinion' is not"),
        ('[material]', 'held = ["stage_1.rim"]\n[material]',
         r"held\[0\]: 'stage_1.rim' is not a member -- did you mean stage_1.ring"),
        ("[output]", '[[loads]]\nmember = "hub"\nforce_kn = [1, 0, 0]\n[output]',
         r"loads\[0\].member: 'hub' is not a member"),
        ("planets = 3", 'planets = 3\nname = "stage_2"',
         r"stages\[1\].name: 'stage_2' is also the name of stage 1"),
        ("planets = 3", 'planets = 3\nname = "low speed"', r"stages\[0\].name"),
        # ports
        ("speed_rpm = 10\n", "", r"inputs\[0\].power_kw: needs a speed"),
        ("speed_rpm = 10\n", "speed_rpm = 0\n", r"inputs\[0\].power_kw: has speed zero"),
        ("speed_rpm = 10\n", "speed_rpm = 10\ntorque_nm = 5\n", "power_kw: is given beside torque"),
        ('member = "stage_2.pinion"', 'member = "stage_1.carrier"',
         r"output.member: stage_1.carrier is a port already \(inputs.0.member\)"),
        ('[material]', 'held = ["stage_1.carrier"]\n[material]',
         r"held\[0\]: stage_1.carrier is also inputs.0.member -- a held member is no port"),
        ('member = "stage_2.pinion"', 'member = "stage_2.pinion"\nbrake_exponent = 0.5',
         "output.brake_exponent: between 0 and 1"),
        ('member = "stage_2.pinion"', "", "output.member: is missing"),
        # parts
        ("sun = { teeth = 20, mass_kg = 1, inertia_kg_m2 = 1e-3 }", "",
         r"stages\[0\].sun: is missing in a planetary stage -- add a section for the sun"),
        ("carrier = { support = { radial_n_per_m = 1e8 } }", "",
         r"stages\[0\].carrier: is missing"),
        ("gear = { teeth = 40, support = { radial_n_per_m = 1e8 } }", "",
         r"stages\[1\].gear: is missing in a parallel stage"),
        ('kind = "parallel"', "", r'stages\[1\].kind: is planetary .* -- add kind = "parallel"'),
        ('kind = "parallel"', "kind = nan", r"stages\[1\].kind: nan is unknown -- use one of pl"),
        ("gear = { teeth = 40, support = { radial_n_per_m = 1e8 } }",
         "gear = { teeth = 40, support = [3] }",
         r"write it as \[\[stages.gear.support\]\] number 1 below \[\[stages\]\] number 2 with"),
        ("position_deg = 30", "ring = { teeth = 60 }",
         r"stages\[1\].ring: is no part of a parallel stage -- take it out"),
        ("position_deg = 30", "planets = 3",
         r"stages\[1\].planets: a parallel stage has no planets"),
        ("ring = { teeth = 60", "ring = { teeth = 20", r"stages\[0\].ring.teeth: .*cannot hold"),
        ("planets = 3", "planets = 3\nplanet_positions_deg = [0, 90]", "2 angles for 3 planets"),
        ("planets = 3", "planets = 3\ndouble_helical = true",
         "helix_angle_deg: is zero in a double"),
        # masses and supports
        ("inertia_kg_m2 = 1e-3", "inertia_kg_m2 = 1e-3, equivalent_mass_kg = 2",
         r"stages\[0\].sun.equivalent_mass_kg: is given beside inertia"),
        (", tangential_n_per_m = 1e9", "",
         r"stages\[0\].ring.support.tangential_n_per_m: .*nothing supports the torque of the held"),
        ("carrier = { support = {", "carrier = { support = { tangential_n_per_m = 1e3,",
         r"carrier.support.tangential_n_per_m: prevents the rotation of stage_1.carrier"),
        ("pinion = { teeth = 20", 'pinion = { teeth = 20, kinematics = "fixed"',
         "output.member: stage_2.pinion is fixed"),
        ("gear = { teeth = 40", 'gear = { teeth = 40, kinematics = "fixed"',
         r"joints\[0\].second: stage_2.gear is fixed"),
        ("planet = { teeth = 20 }", 'planet = { teeth = 20, kinematics = "torsional" }',
         "planet.kinematics: 'torsional' planets cannot follow the carrier"),
        ("planet = { teeth = 20 }", "planet = { teeth = 20, support = { radial_n_per_m = 1 } }",
         "planet.support: planets are not supported by the housing -- use planet_bearing"),
        ("planet_bearing = { radial_n_per_m = 1e8 }", "",
         "planet_bearing.radial_n_per_m: is zero, so the planet is not held"),
        # clearances
        ("planet_bearing = {", "planet_bearing = { clearance_mm = 2.5,",
         "clearance_mm: 2.5 mm is as much as the module of 2.5 mm: the teeth would lose contact"),
        ("carrier = { support = {", "carrier = { support = { clearance_mm = 3,",
         r"stages\[0\].carrier.support.clearance_mm: 3 mm is as much as the module"),
        ("sun = { teeth = 20", "sun = { support = { clearance_um = 10 }, teeth = 20",
         "sun.support.clearance_um: is the gap of a support without radial stiffness"),
        ("planet_bearing = { radial_n_per_m = 1e8 }",
         f"planet_bearing = {{ clearance_um = 10, full_si = {COUPLED} }}",
         "planet_bearing.clearance_um: is a radial gap, but full couples radial motion"),
        # errors
        ("planet_eccentricity_um = [10]", "planet_eccentricity_um = [1, 2, 3, 4]",
         r"errors.planet_eccentricity_um: 4 values for 3 planets: planet 4 does not exist -- give"),
        ("planet_eccentricity_um = [10]", "planet_eccentricity_phase_deg = [0, 1]",
         "2 values for 3 planets: some planets have none"),
        ("planet_eccentricity_um = [10]", "pin_tangential_um = [5]", "pin_tangential_um: 1 values"),
        ("position_deg = 30", "errors = { ring_offset_um = 5 }",
         r"stages\[1\].errors.ring_offset_um: is an error of a part that a parallel stage"),
        ("position_deg = 30", "errors = { pin_radial_um = [5] }", "a parallel stage does not have"),
        # joints
        ("torsion_nm_per_rad = 1e6", "", r"joints\[0\].torsion_nm_per_rad: is zero, so the joint"),
        ("torsion_nm_per_rad = 1e6", "length_mm = 100",
         r"joints\[0\].outer_diameter_mm: is missing -- a shaft needs"),
        ("torsion_nm_per_rad = 1e6",
         "torsion_nm_per_rad = 1e6\nlength_mm = 100\nouter_diameter_mm = 20",
         r"joints\[0\].length_mm: is given beside springs"),
        ("torsion_nm_per_rad = 1e6",
         "length_mm = 100\nouter_diameter_mm = 20\ninner_diameter_mm = 20",
         r"joints\[0\].inner_diameter_mm: is not below outer_diameter"),
        # the form
        ("[material]", "[stage]\nplanets = 3\n[material]",
         r"stage: is given beside \[\[stages\]\] -- keep one"),
    ],
)  # fmt: skip
def test_bad_trains_are_one_clear_line(tmp_path, old, new, words):
    refused(tmp_path / "my.toml", SMALL, old, new, words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("planets = 3", "planets = 0", r"my.toml: stage.planets: 0 is outside"),
        (
            "planets = 3",
            "planets = 3\nnormal_modul_mm = 3",
            "stage.normal_modul_mm: is not a known",
        ),
        ("carrier = {}", "", "stage.carrier: is missing in a planetary stage"),
        ("[stage]", "[stage.x]", "stage.x: is not a known key"),
        ("[stage]", 'fidelity = "quick"\n[stage]', "fidelity: .* write solver.fidelity"),
        ("planets = 3", "teeth = 3", "stage.teeth: .* write stage.sun.teeth, stage.planet.teeth"),
        ("[stage]", "planets = 3\n[stage]", "planets: .* write stage.planets$"),
        ('member = "stage.sun"', 'member = "stage_1.sun"', "did you mean stage.sun"),
        # gearboxes that are not modelled
        ("planet = { teeth = 20 }", "planet = { teeth = [20, 15] }",
         "stage.planet.teeth: has 2 numbers -- give one; .* stepped planets .* not modelled"),
        ("planets = 3", "planets = 3\nplanet_2 = { teeth = 15 }",
         "stage.planet_2: is not available -- a stage has one sun and one ring, and .* stepped"),
        ("planets = 3", 'planets = 3\nkind = "ravigneaux"',
         "stage.kind: 'ravigneaux' is unknown -- use one of .*(Ravigneaux).* not modelled"),
        ("sun = { teeth = 20 }", "sun = { teeth = 20, material = { young_modulus_gpa = 3 } }",
         "stage.sun.material: is not available: all gears of a stage are of one material -- give"),
        ("sun = { teeth = 20 }", 'sun = { teeth = 20, hand = "left" }',
         "stage.sun.hand: .* -- give stage.planet_hand, .* the sun or pinion has the other one"),
    ],
)  # fmt: skip
def test_the_only_stage_is_named_as_it_is_written(tmp_path, old, new, words):
    refused(tmp_path / "my.toml", ALONE, old, new, words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('case = "wind-5mw"', 'case = "wind-5mw"\nsun = { teeth = 4 }',
         r"stages\[0\].sun.teeth: 4 is outside"),
        ('case = "wind-5mw"', 'case = "wind-5mw"\nkind = "parallel"',
         r"stages\[0\].pinion, stages\[0\].gear: are missing"),
        ('case = "wind-5mw"', 'case = "wind-5mw"\ndouble_helical = true',
         "both halves and their gap"),
        ("flexible = false", "flexible = false\n[stages.carrier]\nmass_kg = 3",
         r"stages\[0\].carrier.mass_kg: is for a lumped body, but fe is given"),
        ('case = "wind-5mw"', "case = 5", r"stages\[0\].case: 5 is not text"),
        ("carrier_eccentricity_um = 30", "planet_eccentricity_um = [1, 2]",
         "2 values for 5 planets"),
        ("[stages.ring.fe]\nflexible = false", "[stages.carrier.fe]\nplate_gap_mm = 9",
         "carrier.fe.plate_gap_mm: 9 mm leaves no room"),
    ],
)  # fmt: skip
def test_flexible_stages(tmp_path, old, new, words):
    refused(tmp_path / "my.toml", FLEXIBLE, old, new, words)


def test_a_case_that_is_named_has_one_stage_and_exists(tmp_path):
    for name, words in (
        ("nrel-5mw", "case: nrel-5mw has 3 stages -- name a case with one"),
        ("wind-4mw", "wind-4mw: case: is neither a file nor a bundled case.*wind-5mw"),
        ("no.toml", "no such file"),
    ):
        path = tmp_path / "my.toml"
        path.write_text(FLEXIBLE.replace("wind-5mw", name), encoding="utf-8")
        with pytest.raises(InputError, match=words):
            load_case(path)
