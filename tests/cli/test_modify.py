"""``flexgear modify``: keys to copy, a picture, and what it refuses."""

import numpy as np


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
