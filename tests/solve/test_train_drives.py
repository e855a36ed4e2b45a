"""Lumped trains have drive histories, torque drops and a housing on its mount."""

import numpy as np
import pytest
from trains import stage_train

HOUSING = {
    "housing.kind": "lumped",
    "housing.mass_kg": "4000",
    "housing.inertia_kg_m2": "[900, 900, 1500]",
    "housing.mount.radial_n_per_m": "2e8",
    "housing.mount.axial_n_per_m": "2e8",
    "housing.mount.tilt_nm_per_rad": "1e8",
    "housing.mount.torsion_nm_per_rad": "1e8",
}
SHORT = {"solver.duration_s": "0.02", "solver.settle_s": "0"}


def test_the_torque_follows_the_drive_and_energy_is_accounted_for(tmp_path):
    steps = {"drive.kind": "steps", "drive.times_s": "[0, 0.01]", "drive.torques_nm": "[800, 400]"}
    found = stage_train(tmp_path, **SHORT, **steps).assemble().transient(energy=True)
    torque, time = found["port_torque"].to_numpy()[:, 0], found["time"].to_numpy()
    assert torque[time <= 0.01] == pytest.approx(800)
    assert torque[time > 0.0101] == pytest.approx(400)
    work = found["energy_input_work"].to_numpy()
    speed = found["input_speed"].to_numpy()[:, 0]
    assert work[-1] == pytest.approx(np.trapezoid(torque * speed, time), rel=0.02)


def test_a_run_studies_torque_drops(tmp_path):
    drops = {"drive.steps.torques_nm": "[200]", "drive.steps.start_s": "0.004",
             "drive.steps.duration_s": "0.004", "drive.steps.after_s": "0.004"}  # fmt: skip
    found = stage_train(tmp_path, **SHORT, **drops).run()
    (figures,) = found.summary["torque_steps"]["200"].values()
    data = found.datasets["torque_step_200"]
    least = float(data["gear_mesh_force"].sel(gear_mesh="stage sun 1").min())
    assert figures["gear_mesh_force"]["stage sun"]["min_n"] <= least
    assert found.summary["energy_residual"] < 1e-3


def test_a_housing_on_a_stiff_mount_is_ground(tmp_path):
    """What stands on the housing feels it: forces on the mount are those of the supports."""
    plain = stage_train(tmp_path, **{"stage.sun.support.radial_n_per_m": "1e8"})
    stiff = {k: "1e13" if k.startswith("housing.mount") else v for k, v in HOUSING.items()}
    soft = stage_train(tmp_path, **{"stage.sun.support.radial_n_per_m": "1e8"}, **HOUSING)
    held = stage_train(tmp_path, **{"stage.sun.support.radial_n_per_m": "1e8"}, **stiff)
    a, b, c = (case.assemble().static([0.0, 6.0]) for case in (plain, held, soft))
    force = a["gear_mesh_force"].to_numpy()
    assert b["gear_mesh_force"].to_numpy() == pytest.approx(force, rel=1e-4)
    assert c["gear_mesh_force"].to_numpy().sum() == pytest.approx(force.sum(), rel=1e-4)
