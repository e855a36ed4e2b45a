"""Single analyses through the command line, on cheap bodies; transients of any length."""

import json
import math
import re
import time

import numba
import numpy as np
import pytest
from dead_zone import case_text
from stage_samples import cheap_stage, doubtful_stage, sources_of_bodies
from trains import STAGE, free_stage, spur_pair, write
from two_gears import gears_text

import flexgear as fg
from flexgear.cli import display, exchange_commands, vibration_commands
from flexgear.model.names import GearMeshName
from flexgear.results.dataset_file import load
from flexgear.results.stage_part import pairs_of, stage_part
from flexgear.solve import long_run


def test_static_closes_and_balances(flexgear, tmp_path):
    out = tmp_path / "still.nc"
    command = ("static", "wind-5mw", "--angle-deg", 0, "--angle-deg", 72, "--json", "--quiet")
    summary = json.loads(flexgear.quiet(*command, "--out", out))
    assert list(summary) == ["0 deg", "72 deg", "closure", "neglected"]
    assert any("ovalising planet rims (up to 126 µm)" in x for x in summary.pop("neglected"))
    assert summary.pop("closure") < 1e-8
    for position in summary.values():
        torques = {"stage.carrier": 4e6, "stage.sun": -4e6 * 27 / 120}
        assert position["port_torque_nm"] == pytest.approx(torques, rel=1e-6)
        assert np.mean(position["gear_mesh_force_n"]["stage ring"]) == pytest.approx(
            788280, rel=1e-3
        )
    assert load(out).sizes["position"] == 2


@pytest.mark.slow
def test_response_says_where_motion_of_twice_the_period_begins(flexgear, tmp_path):
    """Where the pair grows by itself at half of the gear-mesh frequency, by the linear command."""
    path = write(tmp_path, case_text(damping=0.02, error=0.0))
    command = (path, "--speed-range", 1.9, 2.4)
    response = ("response", *command, "--harmonics", 6, "--quiet")
    text = flexgear.quiet(*response, "--doublings", 0)
    begins = re.findall("twice the gear-mesh period branches off at ([0-9.]+); not followed", text)
    (band,) = flexgear.json("stability", *command)["bands"]
    edges = [band["lower_factor"], band["upper_factor"]]
    assert sorted(map(float, begins)) == pytest.approx(edges, rel=2e-3)
    text = flexgear.quiet(*response)
    followed = dict(re.findall("branches off at ([0-9.]+): curve ([0-9]+)", text))
    assert [*followed] == begins
    assert f"{len({*followed.values()})} of them with a period of several gear meshes" in text
    for curve in followed.values():
        assert f"curve {curve}, period of two gear meshes: " in text


def test_response_says_that_the_period_doubles_outside_its_range(flexgear, tmp_path):
    """Where no state of one gear mesh is stable, over speed and over torque."""
    path = write(tmp_path, case_text(damping=0.02, error=0.0))
    for options, says in (
        (("--speed-range", 2.05, 2.1), "doubled at 2.05 and 2.1 already: a wider range of speeds"),
        (("--torque-range", 0.9, 1, "--speed", 2.1), "doubled at 0.9 and 1 already: a range of"),
    ):
        text = flexgear.quiet("response", path, *options, "--harmonics", 6, "--quiet")
        assert says in text and "lose contact: nowhere on stable branches" in text
        assert "narrower unstable ranges may be missed" in text
        assert ("missed, see flexgear stability" in text) == (options[0] == "--speed-range")
    # half of a gear-mesh period of 1/600 s has 5.3 periods of the pair's 3183 Hz
    text = flexgear.quiet("stability", path, "--speed-range", 0.2, 0.3, "--count", 3, "-q")
    assert "orders 9 to 10 act here, too" in text and "tenth low" not in text


def test_response_names_a_sensor_whose_signal_does_not_change(flexgear, tmp_path):
    """The gear mesh shakes a gear about its axis, not along it, and its torque is given."""
    sensor = '\n[[sensors]]\nname = "{0}"\non = "stage_1.gear"\nmeasures = "velocity"\n'
    sensor += 'place_mm = [20, 0, 0]\ndirection = "{0}"\n'
    text = gears_text(model="per_pair", law="linear") + sensor.format("y") + sensor.format("z")
    text += '[[sensors]]\nname = "of_machine"\non = "stage_1.gear"\nmeasures = "torque"\n'
    options = ("--speed-range", 0.9, 1.0, "--harmonics", 2, "--doublings", 0, "-q")
    _, text, _ = flexgear("response", write(tmp_path, text), *options)
    assert "sensor z: constant\n" in text and "sensor of_machine: constant\n" in text
    assert re.search(r"sensor y: up to .* rms on stable branches", text)


def test_response_states_no_rounding_as_an_effect_of_more_harmonics(flexgear, tmp_path):
    path = write(tmp_path, gears_text(model="constant", law="linear"))
    options = ("--speed-range", 0.9, 1.0, "--harmonics", 1, "--doublings", 0)
    text = flexgear.quiet("response", path, *options, "--quiet")
    assert "harmonics           1; twice as many change the motion by less than 0.001 %" in text


def test_response_of_linear_contact_says_that_teeth_pull(flexgear, tmp_path):
    path = write(tmp_path, gears_text(model="per_pair", law="linear"))
    command = ("response", path, "--speed-range", 0.9, 1.1, "--harmonics", 4, "--quiet")
    code, text, warning = flexgear(*command, "--out", tmp_path / "states.nc")
    states = load(tmp_path / "states.nc")
    force = states["response_gear_mesh_force"].sel(measure="maximum").max("gear_mesh")
    at = states["response_speed_share"][int(np.argmax(force.to_numpy()))].item()
    says = (
        f"largest gear-mesh force of stable states: {force.max().item() / 1e3:.4g} kN at {at:.4g}\n"
    )
    assert says in text and "peak at" not in text
    assert "rpm" not in text and "response of stage\n" not in text
    assert "teeth pull, as contact is linear: nowhere" in text and "lose contact" not in text
    # four harmonics of 10 Hz do not reach the resonance of the pair
    assert code == 0 and "too few harmonics" in warning and "(they end at 36 Hz" in warning


def test_linear_response_has_a_line_for_all_planets_and_warns_of_lost_contact(flexgear, tmp_path):
    wave = STAGE.replace('"constant"', '"rectangular"\ndamping_ratio = 0.001')
    path = write(tmp_path, wave.format(planets=4, helix=0, sun=1e8))
    code, text, warning = flexgear("response", path, "--linear", "--speed-range", 3, 9, "--quiet")
    assert code == 0 and "  sun 1, 2, 3, 4, order " in text and "sun 2, order" not in text
    assert "largest amplitude" not in text  # it is that of the first peak
    force = 3000 / 4 / (94 + 26) * 26 / (0.052 * np.cos(np.radians(20)))
    peaks = flexgear.json("response", path, "--linear", "--speed-range", 3, 9)["peaks"]
    assert [peak["mean_force_n"] for peak in peaks] == pytest.approx([force] * len(peaks), rel=1e-3)
    assert max(peak["force_n"] for peak in peaks) > force
    assert "exceeds the mean force of 3.326 kN: teeth pull there, as gear_mesh.cont" in warning
    law = ("--set", "stage.gear_mesh.contact_law=one-sided")
    _, _, warning = flexgear("response", path, "--linear", "--speed-range", 3, 9, "-q", *law)
    assert "exceeds the mean force of 3.326 kN: teeth lose contact" in warning


def test_linear_response_names_the_largest_amplitude_at_an_end_of_the_range(flexgear, tmp_path):
    """On the slope of a resonance, beside peaks of other orders that are lower."""
    path = write(tmp_path, gears_text(model="per_pair"))
    command = ("response", path, "--linear", "--speed-range", 20, 80)
    text = flexgear.out(*command, "--quiet", "--out", tmp_path / "linear.nc")
    force = load(tmp_path / "linear.nc")["linear_force_amplitude"]
    order = int(force["gear_mesh_order"][int(force.max(["speed_factor", "gear_mesh"]).argmax())])
    largest = float(force.max())
    figures = flexgear.json(*command)
    assert figures["largest"]["force_n"] == pytest.approx(largest)
    assert figures["peaks"][0]["force_n"] < 0.5 * largest
    assert f"largest amplitude in this range: {largest:.4g} N, " in text
    assert f", order {order}, at 80 of rated speed" in text


def test_rigid_ring_does_not_bend(flexgear):
    text = flexgear.json("static", "wind-5mw", "--rigid", "ring")
    # a rigid ring may shift and turn on its bolts, but takes no five-pointed shape
    assert text["0 deg"]["stage"]["radial_harmonic_5_um"] < 1e-6


@pytest.mark.slow
def test_reversed_torque_is_shown_on_the_flanks_that_carry(flexgear):
    """Coast flanks bear what drive flanks do: not zero, as the drive flanks' own loads are."""
    few = ("--duration-s", 0.02, "--json", "-q", "--rigid", "all")
    stages = {}
    for torque in ("4e6", "-4e6"):
        text = flexgear.out("simulate", "wind-5mw", "--set", f"drive.torque_nm={torque}", *few)
        stages[torque] = json.loads(text)["transient"]["stage"]
    ahead, back = stages.values()
    assert ahead["carrying_flank"] == {"ring": "drive", "sun": "drive"}
    assert back["carrying_flank"] == {"ring": "coast", "sun": "coast"}
    for name in ("ring_tooth_load_n", "sun_tooth_load_n"):
        assert back[name]["max"] == pytest.approx(ahead[name]["max"], rel=0.1)
    mean = "ring_mesh_force_n_mean"
    assert back[mean] == pytest.approx(-ahead[mean], rel=1e-2)
    assert back["load_sharing_max"] == pytest.approx(ahead["load_sharing_max"], rel=0.05)


@pytest.mark.slow
def test_compare_has_eight_variants(flexgear):
    variants = flexgear.json("compare", "wind-5mw", "--positions", 3)
    assert len(variants) == 8
    assert {"flexible", "rigid", "ring+carrier", "shaft"} <= set(variants)
    for row in variants.values():
        assert 1.0 <= row["load_sharing"]["mean"] < 1.2
    # without any flexible ring the tooth nodes move less
    assert (
        variants["rigid"]["tooth_displacement_um_max"]
        < variants["flexible"]["tooth_displacement_um_max"]
    )


@pytest.mark.parametrize(
    "command",
    [["reduce"], ["static"]],
)
def test_a_static_error_above_the_promise_is_one_line_with_what_to_do(
    flexgear, monkeypatch, command
):
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda s, *_: doubtful_stage(s))
    monkeypatch.setattr(exchange_commands, "fe_sources", sources_of_bodies(doubtful_stage))
    name, *more = command
    code, text, err = flexgear(name, "wind-5mw", *more, "--json", "-q")
    assert code == 0
    json.loads(text)
    assert err.count("\n") == 1
    assert err.startswith(
        "flexgear: stage.ring: static error 3.4 % (load: tip end -z), above 2 %; try "
    )
    if name != "reduce":
        assert flexgear(name, "wind-5mw", *more, "--json", "-q", "--rigid", "ring")[2] == ""


def test_the_command_writes_keys_and_a_picture(flexgear, tmp_path):
    picture = tmp_path / "flanks.png"
    few = ["--set", "stage.gear_mesh.slices=5", "--set", "stage.gear_mesh.model=face_load"]
    out = flexgear.out(
        "modify", "wind-5mw", "--rigid", "all", *few, "--set", "solver.fidelity=quick",
        "--picture", picture, "--quiet", "--trials", 3,
    )  # fmt: skip
    assert "[stage.planet.modifications.ring]" in out
    assert picture.stat().st_size > 1e4
    assert "is unknown" in flexgear("modify", "wind-5mw", "--for", "quiet")[2]
    assert (
        "has no suffix of a picture"
        in flexgear("modify", "wind-5mw", "--picture", tmp_path / "x.foo")[2]
    )
    assert "--force" in flexgear("modify", "wind-5mw", "--picture", picture)[2]
    assert np.isfinite(float(out.rsplit("helix_slope_um = ")[1].split()[0]))


def test_modify_says_where_no_change_helps(flexgear, tmp_path):
    gear = 'kinematics = "torsional", teeth'
    aligned = spur_pair(f"{gear} = 30", f"{gear} = 60", 'model = "face_load"')
    out = flexgear.out("modify", write(tmp_path, aligned), "--trials", 5, "-q")
    assert "1.000 → 1.000" in out and "no change gains 1 %" in out


@pytest.mark.parametrize("ports", ["", '[[inputs]]\nmember = "stage.sun"\nspeed_rpm = 1000\n'])
def test_every_command_but_modes_says_why_not(flexgear, tmp_path, ports):
    path = str(free_stage(tmp_path, ports).source)
    for command in ("static", "simulate", "run", "compare", "tolerance"):
        err = flexgear.refused(command, path)
        assert "output: is missing, so that this is a case of free vibration -- " in err
    assert len(flexgear.json("modes", path)["modes"]) == 3 * (3 + 4)
    assert flexgear("check", path)[0] == 0
    out = tmp_path / "swept.nc"
    flexgear.out(
        "sweep", path, "stage.planets=3,4", "--measure", "frequencies", "--out", out, "--quiet",
        "--workers", "1",
    )  # fmt: skip
    code, _, err = flexgear("modes", path, "--angle-deg", "5", "--quiet")
    assert (code == 0) == bool(ports), err


SHORT = ("--duration-s", 0.01)
PAIR = """
material = { young_modulus_gpa = 206, poisson_ratio = 0.3, density_kg_per_m3 = 7850 }
inputs = [{ member = "stage.pinion", speed_rpm = 1500, torque_nm = 30 }]
output = { member = "stage.gear" }
[stage]
kind = "parallel"
normal_module_mm = 2
pressure_angle_deg = 20
face_width_mm = 20
pinion = { teeth = 20, kinematics = "torsional" }
gear = { teeth = 41, kinematics = "torsional" }
"""
BASE_RADIUS = 0.02 * math.cos(math.radians(20))
ABSURD = ("--duration-s", 1e7, "--set", "solver.time_step_s=1e-8")


@pytest.fixture
def no_work(monkeypatch):
    """Work that nobody should have begun."""

    def work(*_):
        raise AssertionError("it was refused too late")

    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", work)
    monkeypatch.setattr(long_run, "transient", work)


def test_the_size_of_a_run_is_printed_before_it(flexgear, tmp_path):
    out = tmp_path / "run.nc"
    code, _, err = flexgear("simulate", "lin-parker", "--duration-s", 0.1, "--out", out)
    assert code == 0
    first, *progress = (line for line in err.splitlines() if "compiled, once" not in line)
    assert first.startswith("transient: 1000 samples, ")
    assert first.endswith(f" kB in {out} before compression")
    assert progress[0] == "transient"
    assert load(out).sizes["time"] == 1000
    code, _, err = flexgear("simulate", "lin-parker", *SHORT)
    assert (code, err.splitlines()[0]) == (0, "transient: 100 samples")
    assert flexgear("simulate", "lin-parker", *SHORT, "-q")[::2] == (0, "")


def test_compilation_is_said_once(capsys):
    """numba's own compiler, on a function that it has not seen."""
    double = numba.njit(lambda x: 2 * x)
    triple = numba.njit(lambda x: 3 * x)
    with display.progress():
        assert double(1) + triple(1) == 5
    assert capsys.readouterr().err.count("are compiled, once") == 1
    with display.progress():
        assert double(1) + triple(1) == 5
    assert capsys.readouterr().err == ""


def test_progress_prints_how_long_the_rest_takes(capsys, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(display.time, "monotonic", lambda: now[0])
    report = display.PlainProgress()
    for now[0], share in ((0.0, 0.0), (1.0, 0.02), (6.0, 0.05), (60.0, 1.0)):
        report("transient", share)
    lines = ["transient", "transient: 5 %, about 114 s left", "transient: done in 60.0 s"]
    assert capsys.readouterr().err.splitlines() == lines
    for now[0], share in ((70.0, 0.0), (76.0, 0.004), (82.0, 0.006)):  # at 0 % it is not known
        report("response", share)
    lines = ["response", "response: 0 %", "response: 1 %, about 33 min left"]
    assert capsys.readouterr().err.splitlines() == lines
    for now[0] in (100.0, 106.0, 112.0):  # without a share there is nothing new to print
        report("FE mesh", 0.0)
    assert capsys.readouterr().err == "FE mesh\n"
    for now[0], share in ((200.0, 0.0), (201.0, 1.0), (201.0, 1.0), (202.0, 0.0), (208.0, 0.5),
                          (214.0, 1.0), (214.0, 1.0), (215.0, 0.0), (216.0, 1.0)):  # fmt: skip
        report("modes", share)  # again with more modes, and a third time, which takes a second
    lines = [
        "modes",
        "modes: done in 1.0 s",
        "modes: 50 %, about 6 s left",
        "modes: done in 12.0 s",
    ]
    assert capsys.readouterr().err.splitlines() == lines


def test_a_stage_of_the_work_without_reports_prints_how_long_it_lasts(capsys, monkeypatch):
    monkeypatch.setattr(display, "PLAIN_INTERVAL", 0.05)
    with display.progress() as report:
        report("load bins", 0.0)
        time.sleep(0.2)
        report("load bins", 1.0)
        time.sleep(0.2)
    first, *waiting, last = capsys.readouterr().err.splitlines()
    assert first == "load bins" and last.startswith("load bins: done in ")
    assert waiting and set(waiting) == {"load bins: 1 s so far"}


def test_only_chosen_variables_are_saved(flexgear, tmp_path):
    command = ("simulate", "lin-parker", *SHORT, "-q", "--json")
    whole, part = tmp_path / "whole.nc", tmp_path / "part.nc"
    figures = flexgear.out(*command, "--out", whole)
    names = ("--save", "gear_mesh_force", "--save", "input_speed,load_sharing")
    same = flexgear.out(*command, "--out", part, *names)
    figures, same = (json.loads(text)["transient"] for text in (figures, same))
    assert figures["steps"] == same["steps"] == 500
    assert figures["gear_mesh_force"] == same["gear_mesh_force"]
    data = load(part)
    assert {n for n in data if "time" in data[n].dims} == {
        "gear_mesh_force", "input_speed", "load_sharing",
    }  # fmt: skip
    assert data.identical(load(whole)[list(data)])


@pytest.mark.parametrize("case", ["lin-parker", "wind-5mw"])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--save", "nonsense", "--out", "run.nc"), "--save: nonsense: is not a variable"),
        (("--save", "load_sharing"), "--save: load_sharing: has no file to go to"),
        (ABSURD, "1e+15 steps, more than a month on any machine"),
        ((*ABSURD, "--out", "run.nc"), "1e+15 steps, more than a month on any machine"),
    ],
)
def test_refused_before_the_work(flexgear, tmp_path, monkeypatch, no_work, case, options, message):
    monkeypatch.chdir(tmp_path)
    err = flexgear.refused("simulate", case, *options)
    assert message in err and err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_variables_that_this_run_does_not_have(flexgear, tmp_path):
    """Known ones, but of another kind of case, or without ``--energy``."""
    for name in ("bolt_force", "energy_kinetic"):
        err = flexgear.refused(
            "simulate", "lin-parker", *SHORT, "-q", "--out", tmp_path / "run.nc", "--save", name
        )
        assert f"{name}: is not saved by this run" in err and "gear_mesh_force" in err
    assert list(tmp_path.iterdir()) == []


def test_a_flexible_stage_is_streamed_into_a_file(flexgear, tmp_path, monkeypatch):
    """Streams of a flexible stage by the command line; figures come from all of its samples."""
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda stage, *_: cheap_stage(stage))
    out = tmp_path / "run.nc"
    code, text, err = flexgear(
        "simulate", "wind-5mw", "--rigid", "all", *SHORT, "--out", out, "--json",
        "--save", "pair_load,pair_tooth",
    )  # fmt: skip
    assert code == 0
    assert err.startswith("transient: ")
    figures, data = json.loads(text)["transient"]["stage"], load(out)
    assert {n for n in data if "time" in data[n].dims} == {"pair_load", "pair_tooth"}
    pairs = pairs_of(stage_part(data, "stage"), "ring", "drive")
    loads = pairs["load"].where(pairs["tooth"] > 0)
    assert figures["ring_tooth_load_n"]["max"] == pytest.approx(float(loads.max()), rel=1e-6)
    assert figures["ring_tooth_load_n"]["min"] == pytest.approx(float(loads.min()), rel=1e-6)


def test_the_speed_of_a_star_is_that_against_its_ring(flexgear):
    """Its carrier is held; with the sun at 3000 r/min the ring turns at 3000 z_s/z_r."""
    text = flexgear.out("simulate", "star-ring", "--rigid", "all", *SHORT, "-q")
    (line,) = (line.split() for line in text.splitlines() if "carrier speed" in line)
    assert line[:4] == ["carrier", "speed", "against", "ring"]
    assert float(line[line.index("min") + 1]) == pytest.approx(3000 * 21 / 75, rel=1e-3)


def test_a_train_without_planets_is_written(flexgear, tmp_path):
    """No group of gear meshes shares a load there, so that variables of groups are empty."""
    case, out = tmp_path / "pair.toml", tmp_path / "pair.nc"
    case.write_text(PAIR)
    flexgear.out("simulate", case, *SHORT, "-q", "--out", out)
    data = load(out)
    assert data["load_sharing"].sizes["group"] == 0
    assert float(data["gear_mesh_force"][-1, 0]) == pytest.approx(30 / BASE_RADIUS, rel=1e-6)


def test_each_half_of_a_double_helical_stage_has_its_figures(flexgear, tmp_path):
    """An axial force on the ring loads one half more; a rigid ring has no shape, so no crest."""
    case = tmp_path / "star.toml"
    flexgear(
        "new", case, "--ratio", 3, "--arrangement", "star", "--planets", 3, "--torque-nm", 3000,
        "--speed-rpm", 500, "--double-helical",
    )  # fmt: skip
    push = 'member = "stage.ring"\ntimes_s = [0, 1]\nforces_n = [[0, 0, 2e4], [0, 0, 2e4]]\n'
    case.write_text(f"{case.read_text()}\n[[loads]]\n{push}")
    assert "Ring shape" not in flexgear("static", case, "--rigid", "all")[1]
    position = flexgear.json("static", case, "--rigid", "all")["0 deg"]
    forces = {s: position["gear_mesh_force_n"][f"stage ring {s}"] for s in ("left", "right")}
    total = sum(map(sum, forces.values()))
    assert abs(sum(forces["left"]) - sum(forces["right"])) > 1e-4 * total  # halves may slide
    for side, of_half in forces.items():
        figures = position[f"stage {side} half"]
        assert figures["half_load"] == pytest.approx(2 * sum(of_half) / total)
        assert figures["load_sharing"] == pytest.approx(3 * max(of_half) / sum(of_half))
        assert figures["radial_harmonic_3_um"] == 0 and "star_angle_3_deg" not in figures


def test_one_position_has_no_figures_over_positions(flexgear, tmp_path):
    stage = STAGE.format(planets=3, sun="1e8", helix=0)
    stage = stage.replace('model = "constant"', 'model = "face_load"\ncontact_law = "one-sided"')
    position = flexgear.json("static", write(tmp_path, stage))["0 deg"]
    for figures in position["face_load"].values():
        assert figures["k_h_beta"] > 0.9
        assert not [n for n in figures if n.endswith(("_peak_to_peak_um", "_positions"))]


def test_a_peak_of_a_gear_mesh_without_mean_force_is_a_warning(capsys):
    """As of a branch of a train that idles."""
    model = fg.load_case("lin-parker").assemble()
    peak = {"gear_mesh": GearMeshName.parse("stage sun 1"), "order": 1, "speed_share": 0.5,
            "force_n": 2.0, "mean_force_n": 0.0, "modes": {}}  # fmt: skip
    vibration_commands._show_linear(model, [], peak)
    assert "amplitude 2 N at 0.5 of rated speed exceeds the mean force of 0 N" in (
        capsys.readouterr().err
    )
