"""Files of earlier versions: one line says how to upgrade them; ``flexgear upgrade``
keeps the model, the comments and the order of a file."""

import json
import re
import tomllib
from pathlib import Path

import pytest
from small_train import SMALL, SMALL_STAGE

from flexgear.model.errors import InputError
from flexgear.model.load import load_case
from flexgear.results.summary import VERSION

PORTS = """\
# [bearings.sun]           # left out: the sun floats
# radial_n_per_m = 1e8

[drive]
rated_torque_nm = 300      # of the motor
rated_speed_rpm = 1500

[inertia]
# rotor and
# coupling
drive_kg_m2 = 0.02
output_kg_m2 = 0.002
output_mass_kg = 1
output_tilt_kg_m2 = 0.001

"""


def earlier():
    """The small spur stage as a file of 0.2.0, with comments."""
    text = SMALL_STAGE.read_text(encoding="utf-8")
    ports, end = text.index("[[inputs]]"), text.index("[output.bearing]")
    text = text[:ports] + PORTS + text[end:]
    for present, old in (
        ("[stage.ring.fe]\n", "# ---- the ring\n[ring]                     # of steel\n"),
        ("[stage.ring.fe.bolts]", "[ring.bolts]               # or [[ring.bolts]] for several"),
        ("[stage.carrier.fe", "[carrier"),
        ("[stage.sun.shaft", "[shaft"),
        ("[stage.planet_bearing]", "[bearings.planet]"),
        ("[stage.carrier.bearing_", "[bearings.carrier_"),
        ("[output.bearing]", "[bearings.output]"),
        ("[stage.errors]", "# ---- as measured\n[errors]"),
    ):
        assert present in text
        text = text.replace(present, old)
    return text


EARLIER = earlier()


def same(file, other):
    """Whether two files say the same model."""
    return load_case(file).content_hash() == load_case(other).content_hash()


@pytest.fixture
def file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "mine.toml"
    path.write_text(EARLIER, encoding="utf-8")
    return path


def test_an_earlier_file_gets_one_line_whose_command_upgrades_it(flexgear, file):
    err = flexgear.refused("check", "mine.toml")
    assert "mine.toml: ring: is of the form that cases had up to flexgear 0.2.0" in err
    command = re.search(r"-- run flexgear (.*)$", err.strip())[1].split()
    code, out, _ = flexgear(*command)
    assert (code, out) == (0, "wrote mine.toml; its earlier content is in mine.toml.orig\n")
    assert Path("mine.toml.orig").read_text(encoding="utf-8") == EARLIER
    assert same(file, SMALL_STAGE)
    assert flexgear("check", "mine.toml")[0] == 0


def test_comments_and_order_stay(flexgear, file):
    flexgear("upgrade", file)
    text = file.read_text(encoding="utf-8")
    for lines in (
        "# ---- the ring\n[stage.ring.fe]            # of steel\n",
        "[stage.ring.fe.bolts]      # or [[stage.ring.fe.bolts]] for several\n",
        "# [stage.sun.support]           # left out: the sun floats\n# radial_n_per_m = 1e8\n",
        "torque_nm = 300      # of the motor\n",
        "# rotor and\n# coupling\ninertia_kg_m2 = 0.02\n",
        "# ---- as measured\n[stage.errors]\n",
    ):
        assert lines in text
    comments = re.findall("#.*", EARLIER)
    assert len(re.findall("#.*", text)) == len(comments)
    places = [text.index(f"[{name}]") for name in (
        "material", "stage.ring.fe", "stage.carrier.fe", "stage.sun.shaft", "stage.planet_bearing",
        "inputs", "output", "output.bearing", "stage.errors",
    )]  # fmt: skip
    assert places == sorted(places)


def test_a_present_file_is_left_alone(flexgear, file):
    flexgear("upgrade", file)
    text = file.read_text(encoding="utf-8")
    code, out, _ = flexgear("upgrade", file)
    assert (code, file.read_text(encoding="utf-8")) == (0, text)
    assert "has the present form already" in out
    assert Path("mine.toml.orig").read_text(encoding="utf-8") == EARLIER


def test_no_file_is_replaced_unasked(flexgear, file, tmp_path):
    other, original = tmp_path / "other.toml", tmp_path / "mine.toml.orig"
    for path, more in ((original, []), (other, ["--out", other])):
        path.write_text("precious")
        assert "is there already" in flexgear.refused("upgrade", file, *more)
        assert (path.read_text(), file.read_text(encoding="utf-8")) == ("precious", EARLIER)
    assert flexgear("upgrade", file, "--out", other, "--force")[0] == 0
    assert same(other, SMALL_STAGE) and file.read_text(encoding="utf-8") == EARLIER
    assert flexgear("upgrade", file, "--force")[0] == 0
    assert same(file, SMALL_STAGE) and original.read_text(encoding="utf-8") == EARLIER


def test_of_several_stages_only_the_kind_of_the_case_goes(flexgear, file):
    """Stages keep theirs."""
    file.write_text(f'# two\nkind = "train"  # in series\n{SMALL}', encoding="utf-8")
    assert "mine.toml: kind: is of the form" in flexgear.refused("check", file)
    assert flexgear("upgrade", file)[0] == 0
    assert file.read_text(encoding="utf-8") == f"# two\n{SMALL}"


def moved(data, key):
    """What stands at a dotted key of parsed TOML."""
    for part in key.split("."):
        data = data[int(part) if part.isdigit() else part]
    return data


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("drive.rated_torque_nm = 3 # a\nring.rim_thickness_mm = 9\n[stage]\nplanets = 3\n",
         {"inputs.0.torque_nm": 3, "stage.ring.fe.rim_thickness_mm": 9, "stage.planets": 3}),
        ('gear_mesh = { model = "constant",\n contact_law = "linear" }\n', None),
        ("errors = { seed = 1 }\n", {"stage.errors.seed": 1}),
        ("[stage]\nplanets = 3\n[bearings]\nplanet = { z_mm = 1 }\n",
         {"stage.planet_bearing.z_mm": 1}),
        ("[brake] # a fan\nexponent = 2\n[output]\nmember = 'stage.sun'\n[output.machine]\nx=1\n",
         {"output.brake_exponent": 2, "output.machine.x": 1}),
        ("[inertia]\ndrive_kg_m2 = 2\n[[inputs]]\nmember = 'stage.sun'\n[inputs.machine]\nx = 1\n",
         {"inputs.0.inertia_kg_m2": 2, "inputs.0.machine.x": 1}),
        ("[shaft]\nsections = [\n [1, 2], # of\n [3],\n]\n",
         {"stage.sun.shaft.sections": [[1, 2], [3]]}),
        ("[drive] # a\n# b\nrated_torque_nm = 3 # c\n# d\n\n# e\n[inertia]\n# f\n[errors]\n",
         {"inputs.0.torque_nm": 3, "stage.errors": {}}),
        ("[errors]\nseed = 1\n[[loads]]\nmember = 'carrier'\n",
         {"loads.0.member": "stage.carrier"}),
        ("[errors]\nseed = 1\n[[loads]]\nmember = 'stage.sun'  # x y\n[[loads]]\nmember = 3\n",
         {"loads.0.member": "stage.sun", "loads.1.member": 3}),
    ],
)  # fmt: skip
def test_keys_in_other_forms_of_toml_are_upgraded(flexgear, file, text, expected):
    """Dotted keys, braces, lists over several lines, ports that are there; or one line, and the
    file as it was."""
    file.write_text(text, encoding="utf-8")
    _, out, err = flexgear("upgrade", file)
    if expected is None:
        assert "TOML" in err
        return
    assert out.startswith("wrote ")
    present = file.read_text(encoding="utf-8")
    data = tomllib.loads(present)
    assert sorted(re.findall("# .*", present)) == sorted(re.findall("# .*", text))
    assert {key: moved(data, key) for key in expected} == expected
    assert data["output"]["member"] == "stage.sun"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[ring]", "[ring"), "TOML"),
        (("[errors]", "[errors]\n[stage.errors]"), None),
        (("output_mass_kg", "rotor_kg"), "inertia.rotor_kg: is not a known key"),
        (("[errors]", "[brakes]\n[errors]\n"), None),
        (("[errors]", "[errors]\nseed=1\n[stage.errors]\nseed=2\n[x]"),
         "stage.errors.seed"),
        (("[inertia]", "[inertia]\n[output]\nmass_kg = 1\n[inert]"), None),
        (("[errors]", "[brake]\nexponent.x = 1\n[errors]"), None),
        (("[stage.sun]", "[stage.sun.x]\n[stage.extra]"), None),
    ],
)  # fmt: skip
def test_what_cannot_be_upgraded_is_one_line(flexgear, file, change, words):
    assert change[0] in EARLIER
    text = EARLIER.replace(*change, 1)
    file.write_text(text, encoding="utf-8")
    code, _, err = flexgear("upgrade", file)
    assert (code, err.count("\n")) == (2, 1), err
    if words:
        assert words in err and file.read_text(encoding="utf-8") == text
        assert not Path("mine.toml.orig").exists()


def test_members_in_braces_are_named(flexgear, file):
    """[stage.ring.fe] cannot stand beside ring = {…}."""
    text = EARLIER.replace("[stage.ring]\nteeth = 72", "").replace(
        "planets = 4", "planets = 4\nring = { teeth = 72 }"
    )
    file.write_text(text, encoding="utf-8")
    err = flexgear.refused("upgrade", file)
    assert "stage.ring.fe: has no place in this file -- write sections under headers" in err


def test_an_earlier_key_of_a_setting_is_told_its_present_name(flexgear):
    err = flexgear.refused("check", "wind-5mw", "--set", "drive.rated_torque_nm=3e6")
    assert "drive.rated_torque_nm: is the name of a key up to 0.2.0" in err
    assert "write inputs.0.torque_nm" in err
    with pytest.raises(InputError, match=r"write stage.ring.fe.tie$"):
        load_case("wind-5mw").with_(**{"ring.tie": "flank"})


@pytest.mark.parametrize("more", [{}, {"schema_version": VERSION - 1}])
def test_results_of_earlier_versions_are_one_line(flexgear, tmp_path, more):
    summary = {"kind": "stage", "version": "0.2.0", **more}
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    (tmp_path / "case.json").write_text('{"kind": "stage"}')
    err = flexgear.refused("render", tmp_path)
    assert "are of flexgear 0.2.0, which this version cannot read" in err
