"""A stage whose ring a spline alone holds, by every command on its own FE bodies."""

import json

import numpy as np
import pytest
from small_train import SMALL_STAGE

from flexgear.cli.entry import run
from flexgear.results.dataset_file import load

BEFORE, REST = SMALL_STAGE.read_text().split("[stage.ring.fe.bolts]\n")
SPLINE = """fixed_interface_modes = 4
[[stage.ring.fe.splines]]
z_mm = 0
half_width_mm = 6
stiffness_radial_n_per_m = 1e9
stiffness_axial_n_per_m = 1e8
stiffness_tilt_nm_per_rad = 1e5
stiffness_torsion_nm_per_rad = 5e6
[stage.carrier.fe]
fixed_interface_modes = 4
"""
FAST = ["--set", "solver.fidelity=quick", "--set", "solver.gear_mesh_orders=2"]
RING_TORQUE = 300 * 72 / 100


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    file = tmp_path_factory.mktemp("case") / "splined.toml"
    file.write_text(BEFORE.replace('end = "-z"\n', SPLINE) + REST.split("[stage.carrier.fe]\n")[1])
    return str(file)


@pytest.mark.slow
def test_run(case, tmp_path):
    out = tmp_path / "results"
    assert run(["run", case, "--no-pictures", "--out", str(out), "-q", *FAST]) == 0
    summary = json.loads((out / "summary.json").read_text())
    assert summary["reduction"]["stage.ring"]["path"].startswith("cyclic: 72 sectors")
    still = load(out / "equilibrium_without_errors.nc")
    assert "bolt_force" not in still
    force = still["bearing_force"].sel(support="stage.spline_1").to_numpy()
    assert force[:, 5] == pytest.approx(RING_TORQUE, rel=1e-8)
    assert np.abs(force[:, :5]).max() < 1e-6 * RING_TORQUE


def test_static_and_modes(case, capsys):
    assert run(["static", case, "--json", *FAST]) == 0
    capsys.readouterr()
    assert run(["modes", case, "--json", *FAST]) == 0
    assert "ring" in capsys.readouterr().out
