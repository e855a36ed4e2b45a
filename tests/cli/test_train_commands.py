"""Commands on trains: what they print, what programs read, what is refused in one line."""

import json
import math
import re
from pathlib import Path

import pytest
from report_pages import OF_RUNS, require_sound
from train_contexts import MIXED
from trains import STAGE, write

from flexgear.results.dataset_file import load
from flexgear.results.run_folder import read_folder

PAIR = Path(__file__).parents[2] / "docs" / "examples" / "pair.toml"
QUICK = ["--set", "solver.settle_s=0.01", "--set", "solver.duration_s=0.04"]


@pytest.mark.usefixtures("no_pixels")
def test_a_pair_of_gears_that_only_turns_is_checked_and_run(flexgear, tmp_path):
    """One gear mesh, whose coast flanks are no second one; no verdict on deflections."""
    assert flexgear.json("check", PAIR)["system"]["gear_meshes"] == 1
    out = tmp_path / "run"
    flexgear("run", PAIR, "--out", out, "--no-pictures", *QUICK)
    headlines = json.loads((out / "summary.json").read_text("utf-8"))["headlines"]
    names = {one["name"] for one in headlines}
    assert "deflections" not in names and "largest_gear_mesh_force" in names
    flexgear("render", out)
    drawn = {p.stem for p in (out / "pictures").iterdir()}
    assert "transient_forces_stage_1" in drawn and "transient_displacements" not in drawn


def test_modes_prints_the_lowest_unless_a_limit_is_asked_for(flexgear):
    lowest = flexgear.out("modes", "nrel-5mw")
    every = flexgear.out("modes", "nrel-5mw", "--limit-hz", "1e9")
    *_, last, more = lowest.splitlines()
    shown = int(last.split()[0].rpartition("-")[2])
    assert shown in (40, 41)  # with the mode of the same frequency
    assert re.fullmatch(rf"{60 - shown} more up to \d+ Hz: --limit-hz \d+ prints all", more)
    limit = lowest.split()[-3]
    assert (
        flexgear.out("modes", "nrel-5mw", "--limit-hz", limit).splitlines()[2:]
        == (every.splitlines()[2:])
    )


def test_check_of_the_pitch_drive(flexgear):
    """Printed torques and degrees of freedom of the paper."""
    sections = flexgear.json("check", "pitch-drive")
    torques = sections["torques_on_the_stages_nm"]
    assert abs(torques["stage_1.sun"]) == pytest.approx(38.2, rel=5e-4)
    assert abs(torques["stage_2.sun"]) == pytest.approx(276.9, rel=5e-4)
    assert abs(torques["stage_3.sun"]) == pytest.approx(1430.8, rel=5e-4)
    assert sections["system"]["degrees_of_freedom"] == 43


@pytest.mark.parametrize("name", ["pitch-drive", "nrel-5mw", "double-rotor-5mw"])
def test_check_and_static_agree_on_planet_bearings(flexgear, name):
    """The sun drives one of them: other flanks carry, and pins are pushed the other way."""
    sections = flexgear.json("check", name)
    clean = ["--set", "stages.stage_2.errors.planet_eccentricity_um=[0]"]
    static = flexgear.json("static", name, *clean)["0 deg"]["planet_bearing"]
    running = sections["stage_2 running"]
    load = static["stage_2.planet_bearing_1"]
    assert load["force_n"] == pytest.approx(running["planet_bearing_force_n"], rel=1e-6)
    direction = running["planet_bearing_force_direction_deg"]
    assert load["direction_deg"] == pytest.approx(direction, abs=1e-3)


def test_helical_teeth_push_the_sun_and_tilt_planets(flexgear, tmp_path):
    """Closed forms on reference circles, as there are no profile shifts: the sun carries
    T tan β/r_s along its axis, and each planet is tilted by a quarter of that times 2 r_p."""
    springs = "axial_n_per_m = 1e8, tilt_nm_per_rad = 1e5"
    text = STAGE.format(planets=4, sun=f"1e7, {springs}", helix=20)
    text = text.replace("r_m = 1e9", f"r_m = 1e9, {springs}")
    text = text.replace("m = 5e8", f"m = 5e8\n{springs.replace(', ', chr(10))}")
    case = write(tmp_path, 'kinematics = "spatial"\n' + text)
    running = flexgear.json("check", case)["running"]
    radius = {n: 4e-3 * z / 2 / math.cos(math.radians(20)) for n, z in (("s", 26), ("p", 34))}
    axial = 3000 * 26 / (26 + 94) * math.tan(math.radians(20)) / radius["s"]
    # right-handed planets, a left-handed sun that the brake turns backwards
    assert running["sun_axial_force_n"] == pytest.approx(axial)
    moment = axial / 4 * 2 * radius["p"]
    assert running["planet_tilting_moment_nm"] == pytest.approx(moment)
    static = flexgear.json("static", case)["0 deg"]
    assert static["bearing"]["stage.sun_support"]["axial_n"] == pytest.approx(axial, rel=1e-6)
    loads = static["planet_bearing"]["stage.planet_bearing_1"]
    assert loads["tilting_moment_nm"] == pytest.approx(moment, rel=1e-6)
    spur = write(tmp_path, STAGE.format(planets=4, sun="1e7", helix=0), name="spur.toml")
    assert "sun_axial_force_n" not in flexgear.json("check", spur)["running"]
    assert "tilting" not in flexgear.out("static", spur)


def test_modes_list_what_ratios_of_damping_are_of(flexgear):
    """Ring alone on its bearing: ω = √(k/m), in two directions."""
    ratios = ("--set", "damping.ratios=[0.03, 0.03, 0.04, 0.04]")
    damped = flexgear.json("modes", "lin-parker", *ratios)["damping_ratios"]
    assert damped["ratio"] == [0.03, 0.03, 0.04, 0.04]
    ring = (1e8 / 2.35) ** 0.5 / (2 * math.pi)
    assert damped["frequency_hz"][2:] == pytest.approx([ring, ring], rel=1e-9)
    assert damped["frequency_hz"][:2] < [ring, ring]
    assert "without gear meshes" in flexgear.out("modes", "lin-parker", *ratios)
    assert "damping_ratios" not in flexgear.json("modes", "lin-parker")


def test_modes_with_another_number_of_planets(flexgear):
    summary = flexgear.json("modes", "lin-parker", "--set", "stage.planets=6")
    kinds = [m["type"] for m in summary["modes"]]
    assert len(kinds) == 27
    assert kinds.count("planet") == 9
    assert all(m["multiplicity"] == 3 for m in summary["modes"] if m["type"] == "planet")
    assert sum(summary["modes"][1]["kinetic_energy"].values()) == pytest.approx(1)
    out = flexgear.out("modes", "lin-parker", "--limit-hz", "2000")
    assert "translational x2" in out
    assert "planet bearing" in out and "stage." not in out


def test_campbell_diagram_and_its_file(flexgear, tmp_path):
    out = tmp_path / "campbell.nc"
    summary = flexgear.json("modes", "herringbone", "--campbell", "--out", out)
    assert summary["gyroscopic"] is True
    assert len(summary["frequency_hz"][0]) == len(summary["speed_factor"])
    assert summary["crossings"][0]["excitation"].startswith("stage x")
    assert load(out)["campbell_frequency"].attrs["units"] == "Hz"
    text = flexgear.out("modes", "lin-parker", "--campbell")
    assert "do not depend on speed" in text
    assert "force if met" not in text  # stiffness is constant, so that no row has a force
    assert "gear mesh of stage 3: orders" in flexgear.out("modes", "nrel-5mw", "--campbell")


def test_static_prints_what_sensors_read(flexgear):
    """Along x and y a pinion's probes read its distance from the axis, and a torque meter at its
    port the torque there."""
    probe = (
        '{{ name = "{0}", on = "stage_3.pinion", measures = "displacement", direction = "{0}" }}'
    )
    torque = '{ name = "t", on = "stage_3.pinion", measures = "torque" }'
    sensors = f"sensors=[{probe.format('x')}, {probe.format('y')}, {torque}]"
    figures = flexgear.json("static", "nrel-5mw", "--set", sensors)["0 deg"]
    readings = {name: one["value"] for name, one in figures["sensors"].items()}
    distance = figures["distance_from_axis_um"]["stage_3.pinion"]
    assert 1e6 * math.hypot(readings["x"], readings["y"]) == pytest.approx(distance, rel=1e-9)
    ports = figures["port_torque_nm"]
    assert readings["t"] == pytest.approx(ports["stage_3.pinion"], rel=1e-9)
    text = flexgear.out("static", "nrel-5mw", "--set", sensors)
    assert re.search(
        rf"x +{1e6 * readings['x']:.2f} µm\n +y +−?[0-9.]+ µm\n +t +−?[0-9.]+ kN m", text
    )


def test_static_at_two_angles(flexgear, tmp_path):
    out = tmp_path / "static.nc"
    summary = flexgear.json(
        "static", "nrel-5mw", "--angle-deg", "0", "--angle-deg", "40", "--out", out
    )
    assert set(summary) == {"0 deg", "40 deg", "closure", "neglected"}
    assert any("lives are those" in note for note in summary["neglected"])
    forces = summary["40 deg"]["gear_mesh_force_n"]
    assert len(forces["stage_1 ring"]) == 3
    assert summary["0 deg"]["planet_bearing"]["stage_1.planet_bearing_1"]["life_h"] > 1e5
    assert load(out).sizes["position"] == 2
    half = flexgear.json("static", "nrel-5mw", "--torque-nm", "1972995.16")
    assert half["0 deg"]["gear_mesh_force_n"]["stage_1 ring"][0] == pytest.approx(
        forces["stage_1 ring"][0] / 2, rel=1e-6
    )
    text = flexgear.out(
        "static", "pitch-drive", "--quiet", "--set", 'stage_1.gear_mesh.model="face_load"',
        "--set", 'stage_1.gear_mesh.contact_law="one-sided"',
    )  # fmt: skip
    assert 'stages.stage_1.sun.kinematics is not "spatial", so K_Hβ counts no tilt' in text
    assert "lives are those" not in text
    assert "stage 1 sun turned by" in text
    assert "load of each planet over the mean" in text and "All forces are in balance." in text


def test_simulate(flexgear, tmp_path):
    out = tmp_path / "run.nc"
    summary = flexgear.json("simulate", "herringbone", *QUICK, "--energy", "--out", out)[
        "transient"
    ]
    assert summary["time_s"] == pytest.approx(0.04)
    assert summary["energy_residual"] < 0.05
    assert summary["gear_mesh_force"]["stage sun left"]["mean_n"] == pytest.approx(70104, rel=0.02)
    assert load(out)["gear_mesh_force"].dims == ("time", "gear_mesh")
    more = flexgear.json("simulate", "herringbone", *QUICK, "--torque-share", "1.5")["transient"]
    assert more["port_torque_nm"]["stage.sun"] == pytest.approx(150e3)
    out = flexgear.out("simulate", "lin-parker", *QUICK, "--quiet")  # constant stiffness, no errors
    assert "load sharing" in out and "10⁻" not in out


def test_compare_load_sharing(flexgear):
    summary = flexgear.json("compare", "herringbone", *QUICK, "--cycles", "50")
    assert set(summary) == {
        "lumped: quasi-static", "lumped: transient", "lumped, without errors: quasi-static",
    }  # fmt: skip
    text = flexgear.out("compare", "nrel-5mw", *QUICK, "--quiet")
    assert "IEC 61400-4 assumes 1.1" in text
    assert "rolls in one equilibrium" in text


def test_compare_two_trains(flexgear):
    comparison = flexgear.json("compare", "double-rotor-5mw", "--against", "nrel-5mw")
    ratio = comparison["bearing_life_ratio"]["stage_1_planet_bearing_ball"]
    assert ratio == pytest.approx(3.4193, rel=1e-3)
    other = flexgear.json("compare", "nrel-5mw", "--against", "wind-5mw")
    assert set(other) == {"nrel-5mw", "wind-5mw", "bearing_life_ratio"}
    text = flexgear.out("compare", "nrel-5mw", "--against", "wind-5mw")
    assert "bearing life of the first case" not in text  # they have no bearing of one name
    text = flexgear.out("compare", "double-rotor-5mw", "--against", "nrel-5mw")
    assert "bearing life of the first case over that of the second" in text
    assert "stage 1 planet bearing, of rollers" in text
    assert "stage 3 gear mesh force" in text and "stage 3 sun" not in text
    assert other["wind-5mw"]["stage_ring_gear_mesh_force_n"] == pytest.approx(788.28e3, rel=1e-4)


@pytest.mark.slow
@pytest.mark.usefixtures("no_pixels")
def test_run_and_compare(flexgear, tmp_path):
    """Everything in one folder, and on one page with another run."""
    out = tmp_path / "mine"
    code, text, err = flexgear("run", "herringbone", *QUICK, "--out", out, "--quiet")
    assert code == 0
    assert err.count("\n") == 1 and "planets do not assemble" in err  # 23 + 57 teeth, 3 planets
    assert "Load sharing" in text and "in equilibria" in text
    files = {p.name for p in out.iterdir()}
    assert files >= {
        "summary.json", "case.json", "report.html", "pictures", "modes.nc", "campbell.nc",
        "equilibrium.nc", "sharing_stage.nc", "transient.nc",
    }  # fmt: skip
    summary = json.loads((out / "summary.json").read_text())
    assert {p.stem for p in (out / "pictures").iterdir()} >= {
        "power_flow", "modes", "campbell", "sharing_stage", "transient_forces_stage",
        "transient_sharing_stage", "transient_displacements",
    }  # fmt: skip
    content = read_folder(out)
    assert content.case.content_hash() == summary["content_hash"]
    require_sound(out / "report.html", *OF_RUNS)
    page = (out / "report.html").read_text().replace("\u00a0", " ")
    assert "normal module 22 mm, double-helical" in page
    assert "sun 100 r/min, 100 kN m, carrier 28.75 r/min, −347.8 kN m" in page  # about +z
    both = tmp_path / "both.html"
    code, text, _ = flexgear("compare", out, out, "--out", both, "--quiet", "--no-interactive")
    assert (code, "(A) with" in text) == (0, True)
    page = both.read_text()
    assert "<title>herringbone: mine against mine</title>" in page
    assert page.count("B − A") == page.count("<caption>") > 5
    require_sound(both, *OF_RUNS)


def test_a_flexible_stage_in_a_train(flexgear, tmp_path):
    """--rigid reaches it; without one there is nothing to make rigid."""
    path = write(tmp_path, MIXED, 'kinematics = "spatial"\n')
    summary = flexgear.json("modes", path, "--limit-hz", "50")
    assert summary["variant"] == "flexible"
    assert "first.ring" in summary["modes"][0]["strain_energy"]
    assert flexgear.json("modes", path, "--rigid", "all")["variant"] == "rigid"
    assert flexgear.json("check", path)["system"]["flexible_stages"] == ["first"]
    err = flexgear.refused("modes", "lin-parker", "--rigid", "ring")
    assert err == (
        "flexgear: --rigid: lin-parker: has only lumped members, so nothing is flexible -- take it "
        "out, or give the ring, carrier or sun an FE body or a shaft\n"
    )


@pytest.mark.parametrize(
    "settings",
    [
        ["--set", "stages.second.gear.support.tilt_nm_per_rad=0"],
        ["--set", "stages.first.carrier.fe.plate_diameter_mm=900"],
    ],
)
def test_cases_that_cannot_work_are_refused_before_any_work(
    flexgear, tmp_path, monkeypatch, settings
):
    """By every command in the words of check; no body is meshed for it."""

    def work(*_):
        raise AssertionError("bodies were asked for")

    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", work)
    settings = [*settings, "--set", "stages.second.pinion.support.tilt_nm_per_rad=0"]
    path = write(tmp_path, MIXED, 'kinematics = "spatial"\n')
    messages = set()
    for command in ("check", "static", "modes", "simulate", "run", "compare", "tolerance"):
        err = flexgear.refused(command, path, *settings)
        messages.add(err)
    _, _, err = flexgear("sweep", path, "damping.ratio=0.01,0.02", *settings)
    assert len(messages | {err}) == 1
    assert " -- " in err


def test_json_holds_null_for_what_is_missing(flexgear):
    """JSON knows no NaN: a parser that takes none reads what a train without torque prints."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    for command in (("static",), ("modes",), ("simulate", "--duration-s", "0.02")):
        text = flexgear.out(
            command[0], "herringbone", *command[1:], "--json", "-q",
            "--set", "inputs.0.torque_knm=0", "--set", "solver.settle_s=0",
        )  # fmt: skip
        summary = json.loads(text, parse_constant=refuse)
        if command[0] == "simulate":
            assert summary["transient"]["load_sharing"]["stage ring left"]["instantaneous"] is None


def test_forces_of_rounding_neither_pull_nor_grow(flexgear):
    """Of a train without torque, errors and varying stiffness."""
    idle = ("simulate", "lin-parker", "--set", "inputs.0.torque_nm=0", "--duration-s", 0.02, "-q")
    text = flexgear.quiet(*idle)
    assert "in both senses" not in text and "times their mean" not in text


def test_teeth_that_pull_are_said_where_load_sharing_is_printed(flexgear, tmp_path):
    """Linear contact under errors larger than the deflection: ΣF of N planets is that of the
    torque, so that the others pull where one carries more than it."""
    says = "Gear-mesh forces of stage 1 act in both senses: teeth pull"
    text = flexgear.quiet("static", "pitch-drive", "-q")
    assert text.count("teeth pull") == 1 and says in text
    assert says in flexgear.quiet("simulate", "pitch-drive", "--duration-s", 0.01, "-q")
    one_sided = ("--set", "stages.0.gear_mesh.contact_law=one-sided")
    assert "pull" not in flexgear.quiet("static", "pitch-drive", "-q", *one_sided)
    command = ("tolerance", "pitch-drive", "--samples", 2, "--out", tmp_path / "t", "-q")
    code, _, warning = flexgear(*command, "--no-pictures")
    assert code == 0 and says in warning
    assert "teeth pull" in (tmp_path / "t" / "report.html").read_text(encoding="utf-8")
    short = ("--set", "solver.settle_s=0.002", "--set", "solver.duration_s=0.005")
    code, _, warning = flexgear("compare", "pitch-drive", "--cycles", 1, "-q", *short)
    assert code == 0 and says in warning
    command = ("sweep", "pitch-drive", "inputs.0.inertia_kg_m2=1,2", "--measure", "load_sharing")
    code, _, warning = flexgear(*command, "-q", "--no-pictures", "--out", tmp_path / "s")
    assert code == 0 and warning.count(says) == 2
