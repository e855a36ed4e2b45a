"""Wrong input of one stage: one line that names file, key, fault and remedy."""

import os
import re
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_train import refused

from flexgear.model import input_file
from flexgear.model.content import file_digest
from flexgear.model.errors import FlexgearError, InputError
from flexgear.model.load import bundled_text, load_case
from flexgear.structures.fe_mesh.files import read_fe_mesh


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("planets = 5", "planets 5", r"TOML.*line \d+"),
        ("planets = 5", "planet = 5", r"TOML: a key or section is there already .at line \d+"),
        ("[stage.ring]", "[stage.sun]", r"TOML: a key or section is there already .at line \d+"),
        ("planets = 5", "planets = 5.5", "stage.planets: 5.5 is not a whole number"),
        ("planets = 5", "planets = '5'", "stage.planets: '5' is not a whole number"),
        ("planets = 5", "planets = true", "stage.planets: True is not a whole number"),
        ("planets = 5", "", "stage.planets: is missing.* -- add planets"),
        ("normal_module_mm = 18", "", "stage.normal_module_mm: is missing"),
        ("normal_module_mm = 18", "normal_module_m = 18",
         r"normal_module_m: 18 m is outside 0.0002 … 0.1 m.*normal_module_mm = 18\?"),
        ("normal_module_mm = 18", "normal_module = 18", "has no unit .length. -- write normal_mod"),
        ("normal_module_mm = 18", "normal_module_nm = 18", "_nm is not a unit of length"),
        ("normal_module_mm = 18", "normal_modul_mm = 18", "did you mean normal_module_mm"),
        ("normal_module_mm = 18", "normal_module_mm = '18'", "'18' is not a number"),
        ("torque_nm = 4e6", "torque_nm = 2026-11-30", "2026-11-30 is not a .*number in N m"),
        ("normal_module_mm = 18", "normal_module_mm = [18]", "is a list -- give one number"),
        ("normal_module_mm = 18", "normal_module_mm = nan", "normal_module_mm"),
        ("face_width_mm = 430", "face_width_mm = 430\nface_width_m = 0.43", "given twice"),
        ("pressure_angle_deg = 20", "pressure_angle_rad = 20", r"pressure_angle_deg = 20\?"),
        ("young_modulus_gpa = 210", "young_modulus_mpa = 210", r"young_modulus_gpa = 210\?"),
        ("density_kg_per_m3 = 7850", "density_g_per_cm3 = 7850", "density_kg_per_m3 = 7850"),
        ("[stage.sun.shaft.spline]", "[stage.sun.shaft.splin]",
         "shaft.splin: is not a known key.*spline"),
        ("[material]", "[materials]", "materials: is not a known key.*material"),
        ('tie = "root"', 'tie = "roots"',
         "stage.ring.fe.tie: 'roots' is unknown.*did you mean root"),
        ('fidelity = "standard"', 'fidelity = "rough"', "solver.fidelity.*quick, standard, fine"),
        ("flexible = true", "flexible = 1", "stage.ring.fe.flexible: 1 is not true or false"),
        ("teeth = 93", "teeth = 30", "stage.ring.teeth.*cannot hold planets"),
        ("z_mm = -185", "z_mm = -200", r"stage.ring.fe.fits\[0\].z_mm: the band.*extends beyond"),
        ("z_mm = 185", "z_mm = 18500", r"stage.ring.fe.fits\[1\].z_mm"),
        ("[[stage.ring.fe.fits]]", "[stage.ring.fe.fits]", "TOML"),
        ("plate_gap_mm = 480", "plate_gap_mm = 400", "stage.carrier.fe.plate_gap_mm.*no room"),
        ("torsion_nm_per_rad = 5e8", "",
         "stage.sun.shaft.spline.torsion_nm_per_rad.*no torque reaches"),
        ('pair_stiffness = "iso6336"', 'pair_stiffness = "table"',
         "stage.gear_mesh.table: is missing"),
        ("inner_diameter_mm = 120", "inner_diameter_mm = 350",
         r"stage.sun.shaft.sections\[0\].inner_diameter_mm: is not below"),
        ('fe_mesh = "generate"              #', 'fe_mesh = "file" #', "fe_mesh_file: is missing"),
        ('fe_mesh = "generate"              #', 'fe_mesh_file = "ring.inp" #',
         "fe_mesh_file: is not read with fe_mesh = 'generate'.*set fe_mesh = \"file\""),
        ("# planet_positions_deg = [0, 72, 144, 216, 288]", "planet_positions_deg = [0, 72]",
         "2 angles for 5 planets"),
        ("# [stage.sun.support]", "[stage.sun.suport]", "sun.suport: is not a known key.*support"),
        ('kind = "rigid"', 'kind = "lumped"', "housing.mass_kg.*lumped housing needs"),
        ("[material]", "[[sensors]]\nname = 'a'\nmember = 'stage.ring'\n[material]",
         r"sensors\[0\].member: is not a known key, and on is missing -- did you mean on\?"),
    ],
)  # fmt: skip
def test_bad_input_is_one_clear_line(tmp_path, old, new, words):
    refused(tmp_path / "my.toml", bundled_text("wind-5mw"), old, new, words)


def test_missing_file_folder_binary_and_unknown_name(tmp_path):
    for source, words in (
        (tmp_path / "no.toml", "no such file"),
        (tmp_path, "is a folder"),
        ("wind-5m", "neither a file nor a bundled case.*wind-5mw"),
    ):
        with pytest.raises(InputError, match=words):
            load_case(source)
    binary = tmp_path / "b.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="UTF-8"):
        load_case(binary)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("stage.normal_module_m", "18", r"--set: stage.normal_module_m: 18 m is outside"),
        ("stage.modul_mm", "18", "is not a known key"),
        ("stage", "3", "is a section, not a key"),
        ("stage.planets.x", "3", "has no keys below"),
        ("stage.sun.shaft.sections.7.length_mm", "3", "sections has 2 elements"),
        ("stage.sun.shaft.sections.0", "3", "ends in the number"),
        ("", "3", "is not a known key"),
        ("stage.ring.fe.bolts.number", "'a'", "'a' is not a whole number"),
        ("stage.planet_bearing.radial_n_per_m", "0", "the planet is not held"),
        ("stage.errors.pin_tangential_um", "[1e5, 0, 0]", "100 mm is outside -2 … 2 mm"),
        (
            "stage.planet_bearing.dynamic_rating_kn",
            "0",
            "outside 0 … 1e.06 kN without this",
        ),
        ("stage.planet_positions_deg", "[0, 1e300, 1, 2, 3]", "are more than two turns"),
        (
            "loads",
            '[{ member = "stage.sun", force_kn = [1e300, 0, 0] }]',
            r"loads\[0\]\.force_n\[0\]: 1e\+303 is outside -1e\+09 … 1e\+09",
        ),
    ],
)
def test_overrides_are_checked_like_the_file(key, value, words):
    with pytest.raises(InputError, match=words):
        load_case("wind-5mw", {key: value})


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("stage.planet.bore_diameter_mm", "0", "planet.bore_diameter_mm: is missing beside fe"),
        ("stage.planet.mass_kg", "400", "planet.mass_kg: is for a lumped body, but fe"),
        ("stage.planet.fe.tie", "roots", "planet.fe.tie: 'roots' is unknown"),
        ("stage.double_helical", "true", "planet.fe: is not available for planets with two halves"),
    ],
)
def test_fe_planets_are_checked(key, value, words):
    with pytest.raises(InputError, match=words):
        load_case("wind-5mw", {"stage.planet.fe.flexible": "true", key: value})


@settings(max_examples=260, deadline=None)
@given(
    case=st.sampled_from(["wind-5mw", "lin-parker"]),
    key=st.one_of(
        st.text(st.sampled_from("abegilnprst_.m0123"), max_size=25),
        st.text(st.sampled_from("abegilnprst_.m0123"), max_size=25).map("stage.{}".format),
        st.sampled_from(["stage.sun.teeth", "stage.face_width_mm", "drive.kind", "drive.times_s"]),
    ),
    value=st.recursive(
        st.one_of(st.integers(-(10**320), 10**320), st.floats(), st.text(max_size=200)),
        lambda inner: st.lists(inner, max_size=3),
        max_leaves=8,
    ).map(str),
)
def test_any_override_is_taken_or_refused_in_one_short_line(case, key, value):
    try:
        load_case(case, {key: value})
    except FlexgearError as fault:
        assert "\n" not in str(fault).replace(value, "") and len(str(fault)) < 400  # noqa: PT017


KEYS = {
    "wind-5mw": """
        stage.planets stage.face_width_mm stage.ring.fe.fits drive.torques_nm drive.kind
        stage.ring.fe.flexible stage.planet_bearing.full_si stage.ring.fe.fe_mesh_file
        stage.errors.pin_radial_um housing.inertia_kg_m2 stage.gear_mesh.table
        stage.sun.shaft.sections stage.planet_positions_deg
    """,
    "lin-parker": """
        stage stages stage.planets stage.sun stage.ring.support stage.planet_bearing.full_si
        stage.errors.planet_eccentricity_um stage.errors stage.case stage.ring.fe stage.name
        stage.planet_positions_deg joints held inputs inputs.0.power_kw output output.member loads
        gravity_m_per_s2 kind kinematics solver.duration_s
    """,
}
VALUES = ["1", "-1", "1e400", "nan", "true", "''", "'x'", "[]", "[1]", "[[1]]", "{}", "[{}]"]
VALUES += ["{a=1}", "1979-05-27", "x y", "\n", "[1, 'a']", "['a']", "[1, 2, 3]"]


@pytest.mark.parametrize(("case", "key"), [(c, k) for c, ks in KEYS.items() for k in ks.split()])
def test_wrong_kinds_of_values_give_no_traceback(case, key):
    for value in VALUES:
        try:
            load_case(case, {key: value})
        except InputError as fault:
            assert "\n" not in str(fault)  # noqa: PT017


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("stage.face_width_mm", "1" + "0" * 400, r"face_width_mm: 10+… is too large"),
        ("stage.face_width_mm", "0x" + "f" * 9000, "a whole number of thousands of digits"),
        ("stage.face_width_mm", "9" * 5000, "thousands of digits"),
        ("stage.sun.teeth", "1" + "0" * 400, r"teeth: 10+… is too large"),
        ("stage.sun.teeth", "0b1" + "0" * 63, r"teeth: 9223372036854775808 is too large"),
        ("stage.sun.teeth", "9" * 5000, "thousands of digits"),
        ("stage.sun.teeth", "[" * 5000 + "]" * 5000, "nested more than 32 deep"),
        ("stage.sun.teeth", "[" * 100 + "]" * 100, "nested more than 32 deep"),
        ("stage.sun.teeth", "'" + "x" * 9000 + "'", r"'x+… is not a whole number"),
        ("drive.kind", "x" * 9000, r"'x+… is unknown"),
        ("stage." + "x" * 9000, "1", r"stage\.x+…x+: is not a known key"),
        ("stage." + "x." * 9000, "1", "no keys below|not a known key"),
        ("stage.sun.shaft.sections.²", "1", "not a known key|is not"),
        ("stage.sun.shaft.sections." + "9" * 5000 + ".length_mm", "1", "is not"),
    ],
)
def test_absurd_values_are_one_short_line(tmp_path, key, value, words):
    with pytest.raises(InputError, match=words) as caught:
        load_case("wind-5mw", {key: value})
    assert len(str(caught.value)) < 400
    path = tmp_path / "mine.toml"
    quoted = f"'{value}'" if value.startswith("xx") else value
    section, _, last = key.rpartition(".")
    path.write_text(f'[{section.replace("²", "")}]\n"{last}" = {quoted}\n')
    with pytest.raises(InputError) as caught:
        load_case(path)
    assert len(str(caught.value)) < 700 + len(str(path))


def without(folder, name, *keys):
    """A bundled case as a file in which the first line of each of these keys is left out."""
    text = bundled_text(name)
    for key in keys:
        text, count = re.subn(rf"(?m)^{key} = .*\n", "", text, count=1)
        assert count == 1, key
    path = folder / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "key", "pattern"),
    [
        ("lin-parker", "planets", "stage.planets"),
        ("wind-5mw", "planets", "stage.planets"),
        ("wind-5mw", "planet_hand", "stage.planet_hand"),
        ("wind-5mw", "drive_side", "stage.carrier.fe.drive_side"),
        ("wind-5mw", "web_clearance_mm", "stage.carrier.fe.web_clearance_mm"),
        ("wind-5mw", "direction", "stage.sun.shaft.direction"),
        ("wind-5mw", "end", "stage.ring.fe.end"),
        ("nrel-5mw", "planet_hand", r"stages\[2\].planet_hand"),
        ("nrel-5mw", "rolling", r"stages\[0\].planet_bearing.rolling"),
    ],
)
def test_the_machine_is_not_guessed(tmp_path, name, key, pattern):
    path = without(tmp_path, name, key)
    with pytest.raises(InputError, match=rf"mine.toml: {pattern}: is missing.* -- add "):
        load_case(path)


def test_spur_gears_need_no_hand(tmp_path):
    path = without(tmp_path, "wind-5mw", "planet_hand", "helix_angle_deg")
    assert load_case(path).stages[0].helix_angle == 0.0
    with pytest.raises(InputError, match=r"stage.planet_hand: is missing with a helix angle"):
        load_case(path, {"stage.helix_angle_deg": "7.5"})


def test_a_parallel_stage_says_whose_hand_is_missing(tmp_path):
    path = without(tmp_path, "nrel-5mw", "planet_hand")
    with pytest.raises(InputError, match=r'"left", the hand of the gear; the pinion'):
        load_case(path)


def test_all_missing_keys_are_named_at_once(tmp_path):
    keys = {
        "young_modulus_gpa": "material", "planets": "stage", "planet_hand": "stage",
        "end": "stage.ring.fe", "pin_diameter_mm": "stage.carrier.fe",
    }  # fmt: skip
    path = without(tmp_path, "wind-5mw", *keys)
    with pytest.raises(InputError) as caught:
        load_case(path)
    assert set(caught.value.key.split(", ")) == {f"{at}.{key}" for key, at in keys.items()}
    assert "\n" not in str(caught.value)


def test_missing_parts_and_sections_are_named_with_the_keys(tmp_path):
    path = tmp_path / "bare.toml"
    path.write_text('[[stages]]\n[[stages]]\nkind = "parallel"\n')
    with pytest.raises(InputError) as caught:
        load_case(path)
    named = set(caught.value.key.split(", "))
    assert {"material", "stages[0].planets", "stages[0].sun", "stages[0].carrier"} <= named
    assert {"stages[1].pinion", "stages[1].gear", "stages[1].face_width_mm"} <= named
    assert "stages[1].planets" not in named


POSIX = pytest.mark.skipif(sys.platform == "win32", reason="pipes and devices are of POSIX")
CSV = {"drive.kind": "csv"}


@POSIX
@pytest.mark.parametrize("device", [None, "/dev/zero", "/dev/null"])
def test_pipes_and_devices_are_refused(tmp_path, device):
    path = tmp_path / "endless.inp"
    if device is None:
        os.mkfifo(path)
    else:
        path.symlink_to(device)
    for read in (
        lambda: load_case(path),
        lambda: load_case("wind-5mw", {**CSV, "drive.file": str(path)}).view(),
        lambda: read_fe_mesh(path),
    ):
        with pytest.raises(InputError, match="is a device or pipe"):
            read()
    ring = {"stage.ring.fe.fe_mesh": "file", "stage.ring.fe.fe_mesh_file": str(path)}
    case = load_case("wind-5mw", ring).view()
    assert case.case.content_hash() and file_digest(str(path)).startswith("missing:")


@POSIX
def test_huge_files_are_refused_unread(tmp_path):
    for name, read in (
        ("a.toml", load_case),
        ("a.csv", lambda path: load_case("wind-5mw", {**CSV, "drive.file": str(path)}).view()),
        ("a.inp", read_fe_mesh),
    ):
        with open(tmp_path / name, "wb") as file:
            file.truncate(1 << 40)  # a file with a hole
        with pytest.raises(InputError, match=r"is larger than \d+ MB"):
            read(tmp_path / name)


@POSIX
def test_a_file_that_grows_is_read_no_further_than_allowed(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    path.write_bytes(b"x" * 100)
    monkeypatch.setattr(input_file, "require_regular", lambda *_: None)
    with pytest.raises(InputError, match="is larger"):
        input_file.read_bytes(path, "case file", 99)
    assert input_file.read_bytes(path, "case file", 100) == b"x" * 100


@POSIX
def test_a_folder_does_not_hide_a_bundled_case(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lin-parker").mkdir()
    assert load_case("lin-parker").source == "lin-parker"
    (tmp_path / "mine").mkdir()
    with pytest.raises(InputError, match="mine: case file: is a folder"):
        load_case("mine")
    (tmp_path / "wind-5mw").write_text(bundled_text("wind-5mw").replace("[stage]", "[stagge]", 1))
    with pytest.raises(InputError, match="stagge"):
        load_case("wind-5mw").view()


@pytest.mark.parametrize("word", ["a\0b", "~nobody-of-that-name/a", "", "x" * 5000, "loop"])
def test_odd_names_of_files_are_one_line(tmp_path, monkeypatch, word):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("loop")
    for read in (
        lambda: load_case(word),
        lambda: load_case(f"{word}.toml"),
        lambda: load_case("wind-5mw", {**CSV, "drive.file": word or '""'}).view(),
        lambda: load_case("nrel-5mw", {"stages.0.case": word or '""'}),
    ):
        with pytest.raises(InputError) as caught:
            read()
        assert len(str(caught.value)) < 600
