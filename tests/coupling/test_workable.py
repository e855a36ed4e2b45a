"""What cannot work is said at once, with the right stage, key and remedy."""

import re

import pytest
from coupled import make_bodies, stage_system
from train_contexts import MIXED
from trains import stage_train, write

from flexgear.coupling.build import build_system, require_workable
from flexgear.model.errors import InputError
from flexgear.model.load import load_case

SPATIAL = 'kinematics = "spatial"\n'
FIRST = "stages.first."
TILT = "support.tilt_nm_per_rad"
NO_TILT = {f"stages.second.{gear}.{TILT}": "0" for gear in ("gear", "pinion")}
NO_CARRIER_BEARINGS = {
    f"stage.carrier.bearing_{side}.{key}": "0"
    for side in ("drive", "far")
    for key in ("radial_n_per_m", "axial_n_per_m", "tilt_nm_per_rad")
}


def refusal(case):
    """Key, and problem with remedy, of a case that cannot work."""
    with pytest.raises(InputError) as caught:
        require_workable(case)
    assert "\n" not in str(caught.value)
    return caught.value.key, f"{caught.value.problem} -- {caught.value.remedy}"


@pytest.mark.parametrize(
    ("settings", "key", "message"),
    [
        (NO_TILT, f"stages.second.pinion.{TILT}",
         f"nothing holds second.pinion against tilting and second.gear against tilting -- give a "
         f"stiffness there and at stages.second.gear.{TILT}"),
        ({key.replace("stage.", FIRST): value for key, value in NO_CARRIER_BEARINGS.items()},
         f"{FIRST}carrier.bearing_drive.radial_n_per_m",
         "nothing holds first.carrier sideways and along the axis"),
        ({"joints.0.axial_n_per_m": "0"}, "joints.axial_n_per_m",
         "nothing holds first.shaft along the axis"),
        ({FIRST + "carrier.bearing_far.torsion_nm_per_rad": "1e6"},
         f"{FIRST}carrier.bearing_far", "holds the rotation about the axis"),
        ({FIRST + "planet_bearing.torsion_nm_per_rad": "1e6"},
         f"{FIRST}planet_bearing", "holds the planet's rotation"),
        ({FIRST + "carrier.fe.plate_diameter_mm": "900"}, f"{FIRST}carrier.fe.plate_diameter",
         "does not enclose the pins"),
        ({FIRST + "planets": "7"}, f"{FIRST}planets", "planets"),
    ],
)  # fmt: skip
def test_unworkable_trains_with_a_flexible_stage_are_refused_by_key(
    tmp_path, settings, key, message
):
    wrong_key, words = refusal(load_case(write(tmp_path, MIXED, SPATIAL), settings))
    assert wrong_key == key
    assert re.search(message, words), words


def test_a_ring_that_turns_has_a_hub_and_a_held_carrier_takes_torque(tmp_path):
    text = MIXED.replace('member = "first.carrier"', 'member = "first.ring"')
    path = write(tmp_path, text, SPATIAL + 'held = ["first.carrier"]\n')
    with pytest.raises(
        InputError, match=r"stages\[0\].ring.hub: is missing, and the FE ring rotates"
    ):
        load_case(path)
    hub = {FIRST + "ring.hub.kinematics": "torsional", FIRST + "ring.hub.inertia_kg_m2": "2000"}
    key, words = refusal(load_case(path, hub))
    assert key == "stages.first.carrier.bearing_drive.torsion_nm_per_rad"
    assert "nothing takes the torque of the held first.carrier" in words
    assert (
        require_workable(
            load_case(path, {**hub, FIRST + "carrier.bearing_far.torsion_nm_per_rad": "1e9"})
        )
        is None
    )


def test_a_pin_goes_into_the_bore_of_its_planet():
    sizes = {"stage.carrier.fe.pin_diameter_mm": "180", "stage.planet.bore_diameter_mm": "100"}
    with pytest.raises(
        InputError, match=r"stage.carrier.fe.pin_diameter_mm: a pin of 180 mm does not fit"
    ):
        load_case("wind-5mw", sizes).view()
    load_case("wind-5mw", {**sizes, "stage.planet.bore_diameter_mm": "181"}).view()


SUPPORTS = [
    ({}, None),
    ({"output.bearing.axial_n_per_m": "0"}, "bearing.axial_n_per_m of the port at stage.sun"),
    ({"stage.sun.shaft.spline.axial_n_per_m": "0"}, "stage.sun.shaft.spline.axial_n_per_m"),
    (
        {
            "stage.sun.shaft.spline.radial_n_per_m": "0",
            "stage.sun.shaft.spline.tilt_nm_per_rad": "0",
        },
        None,
    ),
    ({"output.bearing.radial_n_per_m": "0", "output.bearing.tilt_nm_per_rad": "0"}, None),
    (NO_CARRIER_BEARINGS, "stage.carrier.bearing_drive.axial_n_per_m"),
    (
        {"stage.ring.fe.bolts.stiffness_axial_n_per_m": "0"},
        "stage.ring.fe.bolts.stiffness_axial_n_per_m",
    ),
]


@pytest.mark.parametrize(("settings", "key"), SUPPORTS)
def test_supports_of_a_stage(settings, key):
    """Rigid stand-ins and bodies that bend are held, or not, alike."""
    case = load_case("wind-5mw", settings).view()
    if key is None:
        require_workable(case.case)
        stage_system(case, make_bodies(case))
        return
    assert refusal(case.case)[0] == key
    with pytest.raises(InputError, match="nothing holds"):
        stage_system(case, make_bodies(case))


def test_bolts_at_uneven_angles_are_circles_of_one_bolt_each():
    """Neighbours are those of a circle; a single bolt has none that it could overlap."""
    bolts = load_case("wind-5mw").model_dump()["stages"][0]["ring"]["fe"]["bolts"]
    uneven = [bolts | {"number": 1, "first_angle": angle} for angle in (0.0, 0.5, 1.7, 3.0, 4.0)]
    require_workable(load_case("wind-5mw").with_(**{"stage.ring.fe.bolts": uneven}))


def test_spur_planets_on_self_aligning_bearings_are_held_by_load_along_the_face():
    spur = {"stage.helix_angle_deg": "0", "stage.planet_hand": "",
            "stage.planet_bearing.tilt_nm_per_rad": "0"}  # fmt: skip
    key, words = refusal(load_case("ev-reducer", spur))
    assert key == "stage.planet_bearing.tilt_nm_per_rad"
    assert 'or gear_mesh.model = "face_load"' in words and "joint" not in words
    require_workable(load_case("ev-reducer", spur | {"stage.gear_mesh.model": "face_load"}))


def test_a_stage_whose_sun_floats_has_its_rigid_motions(tmp_path):
    """Beside rotations those of a sun without spline or bearing: all it has but turning."""
    loose = {f"stage.sun.shaft.spline.{k}": "0" for k in ("radial_n_per_m", "tilt_nm_per_rad")}
    held = load_case("wind-5mw").view()
    floating = load_case("wind-5mw", loose).view()
    bodies = make_bodies(held)
    size = [stage_system(case, bodies).rigid.shape[1] for case in (held, floating)]
    assert size == [7, 7 + 4]  # orbit, planets and sun turn; then sideways and tilting, twice each


@pytest.mark.parametrize(
    ("kinematics", "ways"), [("axial", "along the axis"), ("spatial", "against tilting and along")]
)
def test_every_free_direction_of_a_lumped_stage_is_named(tmp_path, kinematics, ways):
    train = stage_train(tmp_path, head=f'kinematics = "{kinematics}"\n')
    key, words = refusal(train)
    assert key.startswith("stage.sun.support.")
    for member in ("stage.sun", "stage.ring", "stage.carrier", "planets of stage"):
        assert f"{member} {ways}" in words
    assert "sideways" not in words  # radial stiffness is there
    assert 'give each of these members kinematics = "planar"' in words
    with pytest.raises(InputError, match="nothing holds"):
        build_system(train)
    members = ("sun", "ring", "carrier", "planet")
    planar = {f"stage.{member}.kinematics": "planar" for member in members}
    require_workable(load_case(train.source, planar))


def test_bolt_holes_have_room_in_the_fe_mesh():
    settings = {
        "stage.ring.fe.bolts.number": "50",
        "stage.ring.fe.bolts.holes": "true",
        "solver.fidelity": "quick",
    }
    key, words = refusal(load_case("wind-5mw", settings))
    assert key == "stage.ring.fe.bolts.number"
    assert "too close to each other" in words


def test_files_are_there(tmp_path):
    settings = {"stage.ring.fe.fe_mesh": "file", "stage.ring.fe.fe_mesh_file": str(tmp_path)}
    key, words = refusal(load_case("wind-5mw", settings))
    assert key == "stage.ring.fe.fe_mesh_file"
    assert "is a folder" in words


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [
        ("nrel-5mw", "solver.time_step_s", "0.1"),
        ("wind-5mw", "solver.time_step_s", "0.02"),
        ("wind-5mw", "solver.step_time_step_s", "0.02"),
    ],
)
def test_steps_too_long_for_the_gear_mesh_are_refused(name, key, value):
    with pytest.raises(InputError, match=r"too long for a gear-mesh period of .* at most 0\.") as e:
        require_workable(load_case(name, {key: value}))
    assert e.value.key == key


def test_the_longest_step_of_a_tolerance_counts_instead():
    long = {"solver.time_step_s": "0.1", "solver.step_tolerance": "1e-3"}
    require_workable(load_case("nrel-5mw", long))
    with pytest.raises(InputError, match=r"solver\.longest_time_step_s: a step of 0\.005 s"):
        require_workable(
            load_case("nrel-5mw", {**long, "solver.longest_time_step_s": "0.005",
                                   "solver.shortest_time_step_s": "1e-4"})
        )  # fmt: skip
