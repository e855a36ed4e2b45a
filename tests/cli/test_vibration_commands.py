"""Cases of free vibration on the command line: modes, and why nothing else."""

import pytest
from trains import free_stage


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
