"""check and cases."""

import json
import math

import numpy as np
import pytest
from trains import write
from two_gears import gears_text

from flexgear.cli.case_commands import derived
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.model.load import bundled_text, load_case
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.files import write_fe_mesh
from flexgear.structures.sources.ring import source as ring_source


def test_check_prints_what_follows_from_the_case(flexgear):
    out = flexgear.quiet("check", "wind-5mw")
    for words in (
        "number of planets                             5\n",
        "gap between the tips of neighbouring planets  5.1602 mm\n",
        "speeds (r/min)\n  sun      50.089\n  ring     0\n  carrier  11.27\n",
        "torques from outside (MN m)\n  carrier  4\n  sun      −0.9\n  ring     −3.1\n",
        "largest misfit of a sun tooth                 0 pitches\n",
    ):
        assert words in out
    assert out.endswith("\n\nnext: flexgear run wind-5mw\n")


def test_rayleigh_damping_says_what_it_leaves_to_the_teeth(tmp_path):
    """Pinion and gear turn, and roll on each other in one of these two motions. No rotation of
    them, rolling or not, meets a damping force; their bearings do."""
    path = write(tmp_path, gears_text(law="linear", backlash=0))
    assert "rayleigh_damping" not in derived(load_case(path))
    case = load_case(path, {"damping.kind": '"rayleigh"', "damping.beta_s": "1e-4"})
    rows = derived(case)["rayleigh_damping"]
    left = rows["rayleigh_leaves_undamped"]
    assert left.startswith("1 motion ") and "stage_1.pinion, stage_1.gear" in left
    assert "stage_1.gear_mesh.damping_ratio = 0.1" in rows["damping_there"]
    modal = modal_system(build_system(case))
    system, phi = modal.system, modal.modes
    matrix = system.mass @ (phi * system.damping.rate(modal.omega)) @ phi.T @ system.mass
    turns = [system.node_rows(name, name)[5] for name in ("stage_1.pinion", "stage_1.gear")]
    assert np.abs(matrix @ np.transpose(turns)).max() < 1e-12 * np.abs(matrix).max()
    assert np.abs(matrix).max() > 0


def test_torques_of_a_star_stand_beside_the_members_that_they_act_on(flexgear):
    """Sun in, ring out, carrier held: T_r = T_s z_r/z_s and T_c = −(T_s + T_r), by hand."""
    summary = flexgear.json("check", "star-ring")
    sun, ring = 250.0, 250.0 * 75 / 21
    expected = {"stage.sun": sun, "stage.ring": ring, "stage.carrier": -(sun + ring)}
    assert summary["torques_from_outside_nm"] == pytest.approx(expected)
    powers = {"stage.sun": sun * 100 * math.pi, "stage.ring": -sun * 100 * math.pi}
    assert summary["powers_into_the_stages_w"] == pytest.approx({**powers, "stage.carrier": 0.0})

    def named(sections, key):
        for name, value in sections.items():
            yield from named(value, key) if isinstance(value, dict) else [value] * (name == key)

    assert list(named(summary, "input_torque_nm")) in ([], [sun])


def test_check_as_json_follows_willis(flexgear):
    summary = flexgear.json("check", "wind-5mw", "--set", "inputs.0.speed_rpm=10")
    assert summary["speeds_rpm"]["stage.sun"] == pytest.approx(10 * (1 + 93 / 27))
    assert summary["running"]["gear_mesh_frequency_hz"] == pytest.approx(93 / 6)
    assert summary["assembly"]["(z_sun + z_ring)/N"] == 24
    assert summary["ring"]["reference_diameter_mm"] == pytest.approx(1688.44, abs=0.01)
    # planet 2 is 93/5 ring teeth on: the fraction is its phase, falling along the path
    assert summary["ring_gear_mesh"]["phase_of_planets_in_pitches"][1] == pytest.approx(0.4)


FLANKS = ("--set", "stage.planet.modifications.ring.lead_crowning_um=20",
          "--set", "stage.sun.modifications.coast.helix_slope_um=12")  # fmt: skip


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
def test_check_says_and_draws_what_flanks_lack(flexgear, tmp_path):
    """Pictures of an earlier check go with the modifications; another case's stay."""
    folder = tmp_path / "checked"
    out = json.loads(flexgear.quiet("check", "wind-5mw", "--json", "--out", folder, *FLANKS))
    expected = {"planet_ring_um": [0.0, 20.0], "sun_coast_um": [-6.0, 6.0]}
    missing = out["missing_on_flanks"]
    assert missing.keys() == expected.keys()
    assert all(missing[name] == pytest.approx(expected[name]) for name in expected)
    written = json.loads((folder / "summary.json").read_text())
    assert written["figures"]["missing_on_flanks"] == missing
    files = ["flank_stage_planet_ring.png", "flank_stage_sun_coast.png", "summary.json"]
    assert sorted(f.name for f in folder.iterdir()) == files
    assert all((folder / name).read_bytes().startswith(b"\x89PNG") for name in files[:2])
    assert "missing on flanks" in flexgear.out("check", "wind-5mw", "--out", folder, *FLANKS[:2])
    assert sorted(f.name for f in folder.iterdir()) == [files[0], files[2]]
    crowned = ("--set", "stage.sun.modifications.lead_crowning_um=20")  # both flanks alike
    flexgear.out("check", "wind-5mw", "--out", folder, *crowned, *FLANKS[:2])
    both = "flank_stage_sun_drive_and_coast.png"
    assert sorted(f.name for f in folder.iterdir()) == [files[0], both, files[2]]
    flexgear.out("check", "wind-5mw", "--out", folder, *crowned, *FLANKS)
    both, one = "flank_stage_sun_coast.png", "flank_stage_sun_drive.png"
    assert sorted(f.name for f in folder.iterdir()) == [files[0], both, one, files[2]]
    refusal = flexgear.refused("check", "lin-parker", "--out", folder)
    assert "holds a check of wind-5mw" in refusal
    assert "missing on flanks" not in flexgear.out("check", "wind-5mw")


def test_check_warns_of_an_implausible_gravity(flexgear, tmp_path):
    """On stderr, as JSON and in the folder's summary; the case is valid all the same."""
    gravity = ("--set", "gravity_m_per_s2=[0, -9810, 0]")
    code, out, err = flexgear("check", "lin-parker", *gravity)
    assert out.endswith("\nnext: flexgear run lin-parker --set 'gravity_m_per_s2=[0, -9810, 0]'\n")
    warning = "gravity is 9810 m/s², and that of the Earth 9.81: check its unit"
    assert (code, err) == (0, f"flexgear: {warning}\n")
    code, out, err = flexgear("check", "lin-parker", *gravity, "--json", "--out", tmp_path / "c")
    assert json.loads(out)["warnings"] == [warning] and warning in err
    assert json.loads((tmp_path / "c" / "summary.json").read_text())["warnings"] == [warning]
    assert json.loads(flexgear("check", "lin-parker", "--json")[1])["warnings"] == []


def test_a_mesh_file_in_the_wrong_place_is_refused_by_check_and_mesh(flexgear, tmp_path):
    """As CAD has it, with one end of the face at z = 0; the key that is offered mends it."""
    quick = ("--set", "solver.fidelity=quick")
    case, file = load_case("wind-5mw", {"solver.fidelity": "quick"}).view(), tmp_path / "ring.msh"
    m = ring_source(case).fe_mesh()
    write_fe_mesh(FeMesh(1e3 * (m.points + [0, 0, 0.215]), m.cells, m.kind, m.facets), file)
    options = (
        *quick,
        "--set",
        "stage.ring.fe.fe_mesh=file",
        "--set",
        f"stage.ring.fe.fe_mesh_file={file}",
    )
    for command in (("check",), ("mesh", "-q", "-c", "ring")):
        err = flexgear.refused(*command, "wind-5mw", *options)
        for word in (
            "ring.msh: tooth_root_",
            "z 215 mm",
            "set stage.ring.fe.fe_mesh_shift_mm = -215",
        ):
            assert word in err
        flexgear.out(*command, "wind-5mw", *options, "--set", "stage.ring.fe.fe_mesh_shift_mm=-215")


def test_named_groups_are_listed_with_their_places(flexgear):
    out = flexgear.out("mesh", "wind-5mw", "--groups")
    for words in ("tooth_root_001 … tooth_root_093", "end_minus", "pin_1 … pin_5", "needed"):
        assert words in out
    pins = flexgear.json("mesh", "wind-5mw", "--groups", "-c", "carrier")["carrier"]
    assert pins["pin_2"]["needed"] is True
    assert pins["pin_2"]["centre_m"] == pytest.approx([0.168309, 0.518002, 0.0], abs=1e-6)
    assert pins["drive"] == {**pins["drive"], "centre_m": [0.0, 0.0, None], "side": "-z"}
    err = flexgear.refused("mesh", "wind-5mw", "--groups", "-c", "ring", "--export", "a.vtu")
    assert "--export" in err


def test_cases_lists_prints_and_copies(flexgear, tmp_path):
    assert "wind-5mw" in flexgear("cases")[1]
    assert flexgear("cases", "wind-5mw")[1] == bundled_text("wind-5mw")
    copy = tmp_path / "mine.toml"
    assert flexgear("cases", "wind-5mw", "--copy", copy)[0] == 0
    assert copy.read_text() == bundled_text("wind-5mw")
    (tmp_path / "beside").mkdir()
    flexgear("schema", "--out", tmp_path / "beside" / "flexgear.schema.json")
    file = tmp_path / "beside" / "mine.toml"
    assert flexgear("cases", "wind-5mw", "--copy", file)[0] == 0
    header, _, rest = file.read_text().partition("\n")
    assert (header, rest) == ("#:schema ./flexgear.schema.json", bundled_text("wind-5mw"))
    assert "is there already" in flexgear.refused("cases", "wind-5mw", "--copy", copy)
    assert flexgear("check", copy)[0] == 0


@pytest.mark.slow
def test_schema_is_printed_or_written_once(flexgear, tmp_path):
    out = tmp_path / "flexgear.schema.json"
    assert "#:schema ./flexgear.schema.json" in flexgear("schema", "--out", out)[1]
    assert flexgear("schema", "--out", out)[0] == 0  # its own file is replaced
    assert flexgear("schema")[1] == out.read_text()
    assert "face_width_mm" in json.loads(out.read_text())["definitions"]["Stage"]["properties"]
    other = tmp_path / "mine.json"
    other.write_text("{}")
    assert "no schema of cases" in flexgear("schema", "--out", other)[2]
    summaries = tmp_path / "summary.schema.json"
    assert flexgear("schema", "--summary", "--out", summaries)[0] == 0
    assert "headlines" in json.loads(summaries.read_text())["properties"]
    assert other.read_text() == "{}"


def test_completion_knows_the_commands(flexgear, monkeypatch, capsys):
    monkeypatch.setenv("_FLEXGEAR_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "flexgear sim")
    monkeypatch.setenv("COMP_CWORD", "1")
    with pytest.raises(SystemExit):
        flexgear()
    assert capsys.readouterr().out.split() == ["simulate"]


def test_version(flexgear):
    assert flexgear.out("--version").startswith("flexgear ")
