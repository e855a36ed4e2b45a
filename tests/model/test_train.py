"""Trains: stages in series, bundled ones, what is refused."""

import math
import re

import numpy as np
import pytest
from small_train import ALONE, FLEXIBLE, SMALL, refused

from flexgear.gears.geometry import stage_geometry
from flexgear.model.case import Case
from flexgear.model.errors import InputError
from flexgear.model.gear_mesh import GearErrors
from flexgear.model.load import bundled_cases, bundled_text, load_case


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


TRAINS = ["double-rotor-5mw", "herringbone", "lin-parker", "nrel-5mw", "pitch-drive"]
COORDINATES = {"fixed": 0, "torsional": 1, "planar": 3, "axial": 4, "spatial": 6}


def dofs(train):
    """Coordinates of all lumped bodies; ring halves count twice."""
    total = 0
    for stage in train.stages:
        for part in stage.members:
            halves = 2 if part == "ring" and stage.double_helical else 1
            total += halves * COORDINATES[train.kinematics_of(f"{stage.name}.{part}")]
        if stage.kind == "planetary":
            total += stage.planets * COORDINATES[train.kinematics_of(f"{stage.name}.planet")]
    return total


@pytest.mark.parametrize("name", TRAINS)
def test_bundled_trains_are_complete(name):
    train = load_case(name)
    assert name in bundled_cases()
    assert isinstance(train, Case)
    assert train.name == train.source == name
    assert Case.model_validate_json(train.model_dump_json(), strict=False) == train
    for stage in train.stages:
        if stage.kind == "planetary":
            geometry = stage_geometry(train.view(stage.name))
            if not stage.allow_unassemblable:
                assert geometry.assembly == round(geometry.assembly)


@pytest.mark.parametrize("name", [*TRAINS, "ev-reducer", "star-ring", "grc-750kw"])
def test_every_value_is_labelled(name):
    """A label on the line, on its section's line or in the comment above either."""
    covered = False
    unlabelled = []
    for line in bundled_text(name).splitlines():
        value, _, comment = line.partition("#")
        labelled = re.search(r"\b([Pp]aper|[Pp]ublic|[Dd]erived|[Cc]hosen)\b", comment) is not None
        if not value.strip():
            if comment.startswith(" ---"):
                covered = False
            elif labelled:
                covered = True
        elif value.startswith("["):
            covered = covered or labelled if value.startswith("[[inputs") else labelled
        elif value.split("=")[0].strip() not in (
            "kind",
            "title",
            "name",
            "member",
            "first",
            "second",
        ):
            free = value.split("=")[0].strip() in ("model", "contact_law", "output_interval_ms")
            if not (labelled or covered or free):
                unlabelled.append(line)
    assert unlabelled == []


@pytest.mark.parametrize(("planets", "count"), [(3, 18), (4, 21), (6, 27)])
def test_lin_parker(planets, count):
    train = load_case("lin-parker", {"stage.planets": str(planets)})
    assert dofs(train) == count
    stage = train.stages[0]
    masses = {
        "sun": (0.4, 0.39),
        "ring": (2.35, 3.0),
        "carrier": (5.43, 6.29),
        "planet": (0.66, 0.61),
    }
    for name, printed in masses.items():
        member = stage.member(name)
        assert (member.mass, member.equivalent_mass) == printed
    # base circles, distance and working angle belong together at both gear meshes
    base = {n: stage.normal_module * stage.member(n).teeth / 2 * math.cos(stage.pressure_angle)
            for n in ("sun", "planet", "ring")}  # fmt: skip
    reach = stage.center_distance * math.cos(stage.sun_pressure_angle)
    assert base["sun"] + base["planet"] == pytest.approx(reach, rel=1e-12)
    assert base["ring"] - base["planet"] == pytest.approx(reach, rel=1e-12)
    for name, printed in (("sun", 77.42e-3), ("planet", 100.35e-3), ("ring", 275.03e-3)):
        assert stage.normal_module * stage.member(name).teeth == pytest.approx(printed, rel=0.011)
    assert train.held_members() == ("stage.ring",)


def test_pitch_drive():
    train = load_case("pitch-drive")
    assert dofs(train) == 43
    printed = [(12, 30, 75, 2.5, 26.24, 16.04), (18, 28, 75, 2.5, 22.54, 19.32),
               (16, 23, 65, 4.0, 26.07, 14.69)]  # fmt: skip
    for stage, (sun, planet, ring, module, outer, inner) in zip(train.stages, printed, strict=True):
        assert (stage.sun.teeth, stage.planet.teeth, stage.ring.teeth) == (sun, planet, ring)
        assert stage.normal_module == pytest.approx(1e-3 * module)
        geometry = stage_geometry(train.view(stage.name))
        assert math.degrees(geometry.sun_mesh.working_angle) == pytest.approx(outer, abs=0.006)
        assert math.degrees(geometry.ring_mesh.working_angle) == pytest.approx(inner, abs=0.006)
        # shifts fit the distance: hardly any backlash is left
        assert geometry.sun_mesh.backlash < 5e-6
        assert geometry.ring_mesh.backlash < 5e-6
        errors = stage.errors
        assert errors.of_planets("planet_eccentricity", 3) == (21e-6,) * 3
        assert errors.planet_eccentricity_phase == pytest.approx(
            [0, 2 * math.pi / 3, 4 * math.pi / 3]
        )
        assert (errors.sun_gear_mesh, errors.ring_gear_mesh) == (15e-6, 20e-6)
    assert [s.errors.sun_eccentricity for s in train.stages] == [17e-6, 17e-6, 22e-6]
    assert [s.errors.ring_offset for s in train.stages] == [20e-6, 20e-6, 30e-6]
    assert [j.tangential for j in train.joints] == [1.3e9, 1.32e9]
    assert train.inputs[0].given_torque == pytest.approx(38.197, rel=1e-4)
    assert all(not stage.sun.support.matrix.any() for stage in train.stages)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_herringbone(planets):
    train = load_case("herringbone", {"stage.planets": str(planets)})
    assert dofs(train) == 16 + 4 * planets
    stage = train.stages[0]
    assert 2 * stage.face_width + stage.half_gap == pytest.approx(0.36)
    assert (stage.sun.teeth + stage.ring.teeth) % 3
    assert train.gyroscopic
    assert train.held_members() == ("stage.ring",)


def test_the_module_of_the_herringbone_stage_fits_printed_masses():
    """A hollow cylinder of the ring half's mass and J/r² ends at its tips; the sun's solid
    cylinder lies between its reference and tip circles."""
    train = load_case("herringbone")
    stage, density = train.stages[0], train.material.density
    g = stage_geometry(train.view(stage.name))
    gyration = stage.ring.equivalent_mass / stage.ring.mass * g.ring.base_radius**2
    area = stage.ring.mass / (density * math.pi * stage.face_width)
    bore = math.sqrt(gyration - area / 2)
    assert bore == pytest.approx(g.ring.tip_radius, rel=0.005)
    width = 2 * stage.face_width + stage.half_gap
    radius = math.sqrt(stage.sun.mass / (density * math.pi * width))
    assert g.sun.reference_radius < radius < g.sun.tip_radius


@pytest.mark.parametrize("name", ["nrel-5mw", "double-rotor-5mw"])
def test_wind_gearboxes_have_the_printed_gears(name):
    train = load_case(name)
    printed = [
        (0.863, {"sun": (855.0, 978.839), "planet": (765.0, 905.440), "ring": (2520.0, 2475.087)}),
        (0.584, {"sun": (378.0, 432.845), "planet": (756.0, 815.655), "ring": (1953.0, 1906.074)}),
    ]
    for stage, (distance, diameters) in zip(train.stages[:2], printed, strict=True):
        geometry = stage_geometry(train.view(stage.name))
        assert geometry.center_distance == distance
        for gear, (pitch, tip) in diameters.items():
            found = getattr(geometry, gear)
            assert 2e3 * found.reference_radius == pytest.approx(pitch, abs=1e-3)
            assert 2e3 * found.tip_radius == pytest.approx(tip, abs=0.06)
        # the printed shifts and distances belong together: no more play than was chosen
        assert geometry.sun_mesh.backlash == pytest.approx(0.5e-3, abs=6e-6)
        assert geometry.ring_mesh.backlash == pytest.approx(0.5e-3, abs=6e-6)
    last = train.stages[2]
    for gear, (pitch, tip) in {"pinion": (341.183, 380.751), "gear": (1350.517, 1395.372)}.items():
        part = last.member(gear)
        reference = 1e3 * last.normal_module * part.teeth / math.cos(last.helix_angle)
        assert reference == pytest.approx(pitch, abs=1e-3)
        outer = reference + 2e3 * last.normal_module * (part.addendum + part.profile_shift)
        assert outer == pytest.approx(tip, abs=0.06)


def test_double_rotor_has_two_inputs():
    train = load_case("double-rotor-5mw")
    assert train.held_members() == ("stage_2.ring",)
    speeds = {port.member: port.speed * 30 / math.pi for port in train.inputs}
    assert speeds == pytest.approx({"stage_1.carrier": 12.1, "stage_1.ring": -16.21})
    assert sum(port.given_torque is not None for port in train.inputs) == 1
    assert load_case("nrel-5mw").held_members() == ("stage_1.ring", "stage_2.ring")


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
        ('member = "stage_1.carrier"', 'member = "stage_1.planet"', "is not a member"),
        ('member = "stage_2.pinion"', 'member = "pinion"', "output.member: 'pinion' is not"),
        ('[material]', 'held = ["stage_1.rim"]\n[material]',
         r"held\[0\]: 'stage_1.rim' is not a member -- did you mean stage_1.ring"),
        ("[output]", '[[loads]]\nmember = "hub"\nforce_kn = [1, 0, 0]\n[output]',
         r"loads\[0\].member: 'hub' is not a member"),
        ("planets = 3", 'planets = 3\nname = "stage_2"',
         r"stages\[1\].name: 'stage_2' is also the name of stage 1"),
        ("planets = 3", 'planets = 3\nname = "low speed"', r"stages\[0\].name"),
        # ports
        ("speed_rpm = 10\n", "", r"inputs\[0\].power_kw: has no speed to go with it"),
        ("speed_rpm = 10\n", "speed_rpm = 0\n", r"inputs\[0\].power_kw: has speed zero"),
        ("speed_rpm = 10\n", "speed_rpm = 10\ntorque_nm = 5\n", "power_kw: is given beside torque"),
        ('member = "stage_2.pinion"', 'member = "stage_1.carrier"',
         r"output.member: stage_1.carrier is a port already \(inputs.0.member\)"),
        ('[material]', 'held = ["stage_1.carrier"]\n[material]',
         r"held\[0\]: stage_1.carrier is also inputs.0.member -- a held member is no port"),
        ("[[inputs]]", "[inputs]", "inputs: is not a list -- write"),
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
        ('kind = "parallel"', "", r"stages\[1\].sun, stages\[1\].planet, .*: are missing"),
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
        ("mass_kg = 1,", "mass_kg = -1,", r"sun.mass_kg: -1 kg is outside 0 … "),
        (", tangential_n_per_m = 1e9", "",
         r"stages\[0\].ring.support.tangential_n_per_m: .*nothing takes the torque of the held"),
        ("carrier = { support = {", "carrier = { support = { tangential_n_per_m = 1e3,",
         r"carrier.support.tangential_n_per_m: holds the rotation of stage_1.carrier, which turns"),
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
        ("planet = { teeth = 20 }", 'planet = { teeth = 20, kinematics = "plane" }',
         "'plane' is unknown -- did you mean planar"),
        # clearances
        ("planet_bearing = {", "planet_bearing = { clearance_um = -5,",
         r"planet_bearing.clearance_um: -5 µm is outside 0 … 5000 µm"),
        ("planet_bearing = {", "planet_bearing = { clearance_mm = 40,",
         r"clearance_mm: 40 mm is outside 0 … 5 mm -- check the unit: clearance_um = 40\?"),
        ("planet_bearing = {", "planet_bearing = { clearance_mm = 2.5,",
         "clearance_mm: 2.5 mm is as much as the module of 2.5 mm: the teeth would come apart"),
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
        ("planet_eccentricity_um = [10]", "planet_eccentricity_mm = [10]",
         "10 mm is outside 0 … 2 mm"),
        ("planet_eccentricity_um = [10]", "planet_thickness_um = [-5000]",
         "-5 mm is outside -2 … 2 mm"),
        ("planet_eccentricity_um = [10]", "planets_eccentricity_um = [10]",
         "is not a known key -- did you mean planet_eccentricity"),
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
        ("[[joints]]", "[[joint]]", "joint: is not a known key -- did you mean joints"),
    ],
)  # fmt: skip
def test_one_clear_line(tmp_path, old, new, words):
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
        ('member = "stage.sun"', 'member = "stage_1.sun"', "did you mean stage.sun"),
    ],
)
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
        ('case = "wind-5mw"', 'case = "wind-5mw"\nsun = { shaft = { flexible = 1 } }',
         r"sun.shaft.flexible: 1 is not true or false"),
        ("flexible = false", "flexible = false\n[stages.carrier]\nmass_kg = 3",
         r"stages\[0\].carrier.mass_kg: is that of a lumped body, but fe is given"),
        ('case = "wind-5mw"', "case = 5", r"stages\[0\].case: 5 is not text"),
        ("carrier_eccentricity_um = 30", "planet_eccentricity_um = [1, 2]",
         "2 values for 5 planets"),
        ("flexible = false", 'tie = "glue"', r"stages\[0\].ring.fe.tie: 'glue' is unknown"),
        ("flexible = false", "rim_thickness_m = 30",
         r"ring.fe.rim_thickness_m: 30 m is outside"),
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
