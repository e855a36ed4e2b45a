"""Clearance of lumped members on a lumped housing that moves."""

import numpy as np
import pytest
from trains import stage_train

from flexgear.analysis.equilibrium import revolution
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system

HOUSING = {
    "housing.kind": '"lumped"',
    "housing.mass_kg": "50",
    "housing.inertia_kg_m2": "[2, 2, 3]",
    "housing.mount.radial_n_per_m": "3e8",
    "housing.mount.axial_n_per_m": "2e8",
    "housing.mount.tilt_nm_per_rad": "4e6",
    "housing.mount.torsion_nm_per_rad": "5e6",
}
SPATIAL = {
    "kinematics": '"spatial"',
    "stage.sun.support.axial_n_per_m": "1e8",
    "stage.sun.support.tilt_nm_per_rad": "1e5",
    "stage.ring.support.axial_n_per_m": "1e9",
    "stage.ring.support.tilt_nm_per_rad": "1e7",
    "stage.carrier.support.axial_n_per_m": "1e9",
    "stage.carrier.support.tilt_nm_per_rad": "1e7",
    "stage.planet_bearing.axial_n_per_m": "1e8",
    "stage.planet_bearing.tilt_nm_per_rad": "1e5",
}
ANGLES = np.array([0.0, 0.4, 2.0])
PLACES = ("carrier.support", "sun.support", "planet_bearing")


def solved(folder, **settings):
    weight = {"gravity_m_per_s2": "[0, -9.81, 0]"}
    case = stage_train(folder, sun="1e8", helix=10, **SPATIAL, **HOUSING, **weight, **settings)
    system = build_system(case)
    return revolution(modal_system(system), ANGLES, system.rated_torque)


@pytest.mark.parametrize("z", ["0", "15"])
def test_without_a_gap_it_is_the_linear_bearing(tmp_path, z):
    """The limit c → 0 of bearings to a housing that gives way, and of planets on their pins."""
    places = {f"stage.{place}.z_mm": z for place in PLACES}
    gaps = {f"stage.{place}.clearance_um": "1e-7" for place in PLACES}
    linear, tight = solved(tmp_path, **places), solved(tmp_path, **places, **gaps)
    assert len(tight.modal.system.bearings) == 6
    scale = np.abs(linear.pair_load).max()
    assert np.abs(tight.pair_load - linear.pair_load).max() < 1e-8 * scale


def test_a_gap_that_stays_open_leaves_the_carrier_to_the_teeth(tmp_path):
    """What the limit is told from: within 50 µm the gear meshes alone hold it up."""
    linear = solved(tmp_path)
    loose = solved(tmp_path, **{"stage.carrier.support.clearance_um": "50"})
    rows = linear.modal.system.node_rows("stage.carrier", "stage.carrier")[:2]
    low, high = (np.hypot(*(rows @ e.modal.modes @ e.eta.T)).max() for e in (loose, linear))
    assert 1.2 * high < low < 50e-6
