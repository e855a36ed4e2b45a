"""Reading, overriding, changing and hashing cases."""

import math
import tomllib

import numpy as np
import pytest
from pydantic import ValidationError

from flexgear.model.bearings import Bearing
from flexgear.model.errors import InputError
from flexgear.model.load import bundled_cases, bundled_text, case_of_toml, load_case


@pytest.fixture(scope="module")
def case():
    return load_case("wind-5mw").view()


def test_bundled_case_is_that_of_the_paper(case):
    assert "wind-5mw" in bundled_cases()
    assert (case.stage.sun.teeth, case.stage.planet.teeth, case.stage.ring.teeth) == (27, 33, 93)
    assert case.stage.face_width == 0.43
    assert case.stage.normal_module == 0.018
    assert case.stage.planet_angles == pytest.approx([2 * math.pi * i / 5 for i in range(5)])
    assert case.case.inputs[0].speed == pytest.approx(11.27 * math.pi / 30)
    assert case.ring.bolts.number == 25
    assert len(case.ring.fits) == 2
    assert case.ring.fits[0].band == pytest.approx((-0.215, -0.155))
    assert case.case.drive.steps.torques == (2e6, 4e5, 2e5)
    assert not case.stage.sun.support.matrix.any()
    assert case.case.name == case.case.source == "wind-5mw"


def test_every_value_is_labelled():
    text = bundled_text("wind-5mw")
    assert text.count("paper") > 8
    assert text.count("chosen") > 30
    assert text.count("# calibrated") == 3


def test_a_copied_file_is_the_same_case(case, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("# a comment of mine\n" + bundled_text("wind-5mw"), encoding="utf-8")
    mine = load_case(path)
    assert mine.name == "mine"
    assert mine.content_hash() == case.case.content_hash()
    assert mine.stages == case.case.stages


def test_the_unit_of_a_key_does_not_matter(case):
    over = {"stage.face_width_m": "0.43", "drive.torque_knm": "4000", "stage.helix_angle_rad":
            str(math.radians(7.5))}  # fmt: skip
    assert load_case("wind-5mw", over).content_hash() == case.case.content_hash()


def test_hash_follows_the_content(case):
    case = case.case
    wider = case.with_(**{"stage.face_width": 0.44})
    assert wider.content_hash() != case.content_hash()
    assert wider.content_hash("solver", "material") == case.content_hash("solver", "material")
    assert wider.content_hash("stages") != case.content_hash("stages")
    renamed = case.with_(name="other", title="x")
    assert renamed.content_hash() == case.content_hash()
    assert len(case.content_hash()) == 64


@pytest.mark.parametrize("body", ["ring", "carrier", "planet"])
def test_files_of_bodies_lie_beside_the_case_and_count_by_what_is_in_them(body, tmp_path):
    path, fe_mesh = tmp_path / "mine.toml", tmp_path / "body.inp"
    path.write_text(bundled_text("wind-5mw"), encoding="utf-8")
    fe_mesh.write_text("a")
    keys = {"fe_mesh": "file", "fe_mesh_file": fe_mesh.name}
    one = load_case(path, {f"stage.{body}.fe.{key}": word for key, word in keys.items()})
    assert getattr(one.stages[0], body).fe.fe_mesh_file == str(fe_mesh)
    first = one.content_hash()
    fe_mesh.write_text("b")
    assert one.content_hash() != first


def test_overrides_of_scalars_words_lists_and_elements():
    over = {
        "stage.planets": "3",
        "stage.ring.fe.tie": "flank",
        "stage.sun.shaft.sections.1.length_mm": "500",
        "stage.errors.pin_tangential_um": "[30, 0, 0]",
        "stage.ring.fe.flexible": "false",
        "stage.sun.support.radial_n_per_m": "1e8",
        "stage.ring.fe.fits": "[]",
    }
    case = load_case("wind-5mw", over).view()
    assert case.stage.planets == 3
    assert len(case.stage.planet_angles) == 3
    assert case.ring.tie == "flank"
    assert case.shaft.sections[1].length == 0.5
    assert case.shaft.sections[1].outer_diameter == 0.32
    assert case.stage.errors.pin_tangential == (30e-6, 0.0, 0.0)
    assert case.ring.flexible is False
    assert case.stage.sun.support.matrix[0, 0] == 1e8
    assert case.ring.fits == ()


def test_with_changes_a_copy_and_checks_it(case):
    other = case.with_(stage__planets=4, stage__gear_mesh__contact_law="linear")
    assert (other.stage.planets, case.stage.planets) == (4, 5)
    assert other.gear_mesh.contact_law == "linear"
    brief = case.with_(planets=4, gear_mesh__contact_law="linear")
    assert brief.stage == other.stage
    long = case.with_(**{"stages.stage.ring.fe.tie": "flank"})
    assert long.ring == case.with_(**{"stage.ring.fe.tie": "flank"}).ring
    with pytest.raises(InputError, match=r"with_: stage\.ring\.fe\.tie"):
        case.with_(stage__ring__fe__tie="glue")
    with pytest.raises(ValidationError):
        case.stage.planets = 3


def test_with_takes_lists_and_arrays(case):
    errors = case.with_(stage__errors__pin_tangential=np.array([1e-5, 0, 0, 0, 0])).stage.errors
    assert errors.pin_tangential == (1e-5, 0.0, 0.0, 0.0, 0.0)
    force = {"member": "stage.sun", "force": [0.0, 0.0, 1e3]}
    loaded = case.with_(loads=[force], stage__planets=np.int64(5)).case
    assert loaded.loads[0].force == (0.0, 0.0, 1e3)


def test_springs_by_direction_and_as_matrix(case):
    springs = case.stage.planet_bearing.model_copy(update={"z": 0.0})
    assert np.allclose(np.diag(springs.matrix), [4e9, 4e9, 1e9, 1.6e8, 1.6e8, 0])
    assert case.stage.planet_bearing.stiffness[2] == 1e9
    rows = np.diag([1e9, 2e9, 3e9, 1e6, 1e6, 0.0])
    rows[0, 4] = rows[4, 0] = 1e7
    text = "{full_si = " + str(rows.tolist()) + "}"
    full = load_case("wind-5mw", {"output.bearing": text}).output.bearing
    assert np.array_equal(full.matrix, rows)
    assert full.stiffness[1] == 2e9
    rows[0, 4] = 0
    with pytest.raises(InputError, match=r"output.bearing.full_si: is not symmetric"):
        load_case("wind-5mw", {"output.bearing.full_si": str(rows.tolist())}).view()


def test_unequal_rows_are_a_bearing_with_its_springs_at_z():
    """Two rows k₁ at z₁ and k₂ at z₂: k = k₁ + k₂ at z = Σ k_i z_i / k, tilt Σ k_i (z_i − z)²."""
    k, at = np.array([2.3e9, 1.7e9]), np.array([-0.2, 0.2])
    rows = np.zeros((6, 6))
    for stiffness, z in zip(k, at, strict=True):
        for moved in ([1, 0, 0, 0, z, 0], [0, 1, 0, -z, 0, 0]):
            rows += stiffness * np.outer(moved, moved)
    z = k @ at / k.sum()
    bearing = Bearing(radial=k.sum(), tilt=k @ (at - z) ** 2, z=z)
    assert np.allclose(bearing.matrix, rows, rtol=1e-12, atol=1e-3)
    assert np.allclose(Bearing(full=tuple(map(tuple, rows)), z=0.0).matrix, rows)


@pytest.mark.parametrize(
    ("degrees", "period"),
    [
        ((10.0, 130.0, 250.0), 120.0),
        ((250.0, 370.0, 130.0), 120.0),
        ((0.0, 120.0, 243.0), 360.0),
        ((0.0, 87.0, 180.0, 267.0), 180.0),
        ((0.0, 50.0, 120.0, 170.0, 240.0, 290.0), 120.0),
        ((77.0,), 360.0),
    ],
)
def test_planets_stand_alike_after_their_period(degrees, period):
    angles = tuple(math.radians(d) for d in degrees)
    stage = load_case("wind-5mw").view().stage
    assert stage.planet_period == pytest.approx(2 * math.pi / 5)
    freely = stage.model_copy(update={"planets": len(degrees), "planet_positions": angles})
    assert freely.planet_period == pytest.approx(math.radians(period))


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("wind-5mw", "solver.time_step_s"),  # a key
        ("wind-5mw", "stage.errors"),  # a section
        ("wind-5mw", "stage.ring.fe.fits.1"),  # an element of a list of sections
        ("lin-parker", "stage.planet.mass_kg"),
        ("nrel-5mw", "joints.0.axial_n_per_m"),
    ],
)
def test_an_override_without_a_value_takes_a_key_out(name, key):
    """The case is then that of the file without it."""
    data = tomllib.loads(bundled_text(name))
    place = data
    *way, last = [int(part) if part.isdigit() else part for part in key.split(".")]
    for part in way:
        place = place[part]
    del place[last]
    less = case_of_toml(data, name, name)
    assert load_case(name, {key: ""}).content_hash() == less.content_hash()
    assert load_case(name).content_hash() != less.content_hash()


def test_an_absent_part_may_be_left_out_and_a_needed_one_may_not():
    case = load_case("lin-parker", {"stage.ring.fe.bolts": "", "stage.errors": ""})
    assert case.content_hash() == load_case("lin-parker").content_hash()
    with pytest.raises(InputError, match="planets: is missing"):
        load_case("lin-parker", {"stage.planets": ""})
    with pytest.raises(InputError, match="inputs has 1 elements"):
        load_case("lin-parker", {"inputs.3": ""})


@pytest.mark.parametrize("name", ["pin_tangential", "planet_thickness", "planet_eccentricity"])
def test_a_number_in_place_of_a_list_of_planets_is_for_all(name):
    case = load_case("lin-parker", {f"stage.errors.{name}_um": "20"})
    assert case.stages[0].errors.of_planets(name, 4) == pytest.approx([2e-5] * 4)
    again = load_case("lin-parker").with_(**{f"stage.errors.{name}": 2e-5})
    assert again.content_hash() == case.content_hash()
    none = load_case("lin-parker", {f"stage.errors.{name}_um": "0"})
    assert none.stages[0].errors.of_planets(name, 4) == (0.0,) * 4


@pytest.mark.parametrize("name", ["pin_tangential", "planet_thickness"])
def test_one_element_of_a_list_of_planets(name):
    """The others keep what the file has, a number for all of them, or nothing: zero."""
    key, plain = f"stage.errors.{name}_um", load_case("lin-parker")
    case = load_case("lin-parker", {f"{key}.0": "20"})
    assert getattr(case.stages[0].errors, name) == pytest.approx([2e-5, 0, 0, 0])
    assert plain.with_(**{f"stage.errors.{name}.0": 2e-5}).content_hash() == case.content_hash()
    case = load_case("lin-parker", {key: 5, f"{key}.1": 7})
    assert getattr(case.stages[0].errors, name) == pytest.approx([5e-6, 7e-6, 5e-6, 5e-6])
    for place, says in (("4", "4 elements"), ("0.1", "no keys below"), ("x", "no keys below")):
        with pytest.raises(InputError, match=says):
            load_case("lin-parker", {f"{key}.{place}": "20"})
    with pytest.raises(InputError, match="face_width_mm is not a list"):
        load_case("lin-parker", {"stage.face_width_mm.0": "20"})
    with pytest.raises(InputError, match="'x' is not a number"):
        load_case("lin-parker", {f"{key}.0": "x"})
