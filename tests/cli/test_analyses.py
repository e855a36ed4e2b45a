"""Single analyses through the command line, on cheap bodies."""

import json

import numpy as np
import pytest
from stage_samples import doubtful_stage, made_of
from trains import free_stage

from flexgear.cli import exchange_commands
from flexgear.results.dataset_file import load


def test_static_closes_and_balances(flexgear, tmp_path):
    out = tmp_path / "still.nc"
    command = ("static", "wind-5mw", "--angle-deg", 0, "--angle-deg", 72, "--json", "--quiet")
    found = json.loads(flexgear.quiet(*command, "--out", out))
    assert list(found) == ["0 deg", "72 deg", "closure", "neglected"]
    assert any("ovalising planet rims (up to 126 µm)" in x for x in found.pop("neglected"))
    assert found.pop("closure") < 1e-8
    for position in found.values():
        torques = {"stage.carrier": 4e6, "stage.sun": -4e6 * 27 / 120}
        assert position["port_torque_nm"] == pytest.approx(torques, rel=1e-6)
        assert np.mean(position["gear_mesh_force_n"]["stage ring"]) == pytest.approx(
            788280, rel=1e-3
        )
    assert load(out).sizes["position"] == 2


def test_rigid_ring_does_not_bend(flexgear):
    text = flexgear.json("static", "wind-5mw", "--rigid", "ring")
    # a rigid ring may shift and turn on its bolts, but takes no five-pointed shape
    assert text["0 deg"]["stage"]["radial_harmonic_5_um"] < 1e-6


@pytest.mark.slow
def test_reversed_torque_is_shown_on_the_flanks_that_carry(flexgear):
    """Coast flanks bear what drive flanks do: not zero, as the drive flanks' own loads are."""
    few = ("--duration-s", 0.02, "--json", "-q", "--rigid", "all")
    found = {}
    for torque in ("4e6", "-4e6"):
        text = flexgear.out("simulate", "wind-5mw", "--set", f"drive.torque_nm={torque}", *few)
        found[torque] = json.loads(text)["transient"]["stage"]
    ahead, back = found.values()
    assert ahead["carrying_flank"] == {"ring": "drive", "sun": "drive"}
    assert back["carrying_flank"] == {"ring": "coast", "sun": "coast"}
    for name in ("ring_tooth_load_n", "sun_tooth_load_n"):
        assert back[name]["max"] == pytest.approx(ahead[name]["max"], rel=0.1)
    mean = "ring_mesh_force_n_mean"
    assert back[mean] == pytest.approx(-ahead[mean], rel=1e-2)
    assert back["load_sharing_max"] == pytest.approx(ahead["load_sharing_max"], rel=0.05)


@pytest.mark.slow
def test_compare_has_eight_variants(flexgear):
    found = flexgear.json("compare", "wind-5mw", "--positions", 3)
    assert len(found) == 8
    assert {"flexible", "rigid", "ring+carrier", "shaft"} <= set(found)
    for row in found.values():
        assert 1.0 <= row["load_sharing"]["mean"] < 1.2
    # without any flexible ring the tooth nodes move less
    assert (
        found["rigid"]["tooth_displacement_um_max"] < found["flexible"]["tooth_displacement_um_max"]
    )


@pytest.mark.parametrize(
    "command",
    [["reduce"], ["static"]],
)
def test_a_static_error_above_the_promise_is_one_line_with_what_to_do(
    flexgear, monkeypatch, command
):
    monkeypatch.setattr("flexgear.solve.bodies.stage_bodies", lambda s, *_: doubtful_stage(s))
    monkeypatch.setattr(exchange_commands, "fe_sources", made_of(doubtful_stage))
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
    assert "is no aim" in flexgear("modify", "wind-5mw", "--for", "quiet")[2]
    assert "is no picture" in flexgear("modify", "wind-5mw", "--picture", tmp_path / "x.foo")[2]
    assert "--force" in flexgear("modify", "wind-5mw", "--picture", picture)[2]
    assert np.isfinite(float(out.rsplit("helix_slope_um = ")[1].split()[0]))


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
