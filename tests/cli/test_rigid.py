"""What does not bend is neither meshed nor reduced; a ring that a spline alone holds."""

import json

import numpy as np
import pytest
from small_train import SMALL_STAGE
from stage_samples import cheap_stage

from flexgear.cli.entry import run
from flexgear.model.load import load_case
from flexgear.results.dataset_file import load
from flexgear.solve import bodies
from flexgear.structures.sources.carrier import CarrierSource
from flexgear.structures.sources.fe_body import FeBody
from flexgear.structures.sources.ring import RingSource

STAGE_BODIES = bodies.stage_bodies


def refused(*_, **__):
    raise AssertionError("nothing of a rigid body is meshed or reduced")


@pytest.mark.parametrize(
    "arguments",
    [
        ("static", "--rigid", "all"),
        ("static", "--rigid", "ring"),
        ("static", "--set", "stage.ring.fe.flexible=false", "--rigid", "carrier"),
        ("modes", "--rigid", "all"),
        ("simulate", "--rigid", "all", "--duration-s", "0.002"),
    ],
)
def test_commands_mesh_and_reduce_only_what_bends(flexgear, monkeypatch, arguments):
    carrier = cheap_stage(load_case("wind-5mw").view())["stage.carrier"]
    monkeypatch.setattr(FeBody, "fe_mesh", refused)
    monkeypatch.setattr(bodies, "stage_bodies", STAGE_BODIES)
    monkeypatch.setattr(RingSource, "reduced", refused)
    made = arguments[1:] == ("--rigid", "ring")
    monkeypatch.setattr(CarrierSource, "reduced", (lambda *_: carrier) if made else refused)
    text = flexgear.json(arguments[0], "wind-5mw", *arguments[1:])
    if arguments[0] == "static":
        assert 1.0 < text["0 deg"]["stage"]["load_sharing"] < 1.2


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
