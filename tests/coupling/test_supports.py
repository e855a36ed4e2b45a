"""Supports that turn, a movable housing, and the single-point gear mesh."""

import numpy as np
import pytest
from coupled import TORQUE, make_bodies, make_case, make_system, shaped
from stepped import energy_error, stepped

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import modes, springs_at
from flexgear.analysis.recovery import Recovery, channel_forces
from flexgear.analysis.transient import Drive
from flexgear.coupling.modal import modal_system
from flexgear.coupling.springs import invariant_part, rotating_rows
from flexgear.model.errors import InputError
from flexgear.structures.kinematics import turn

ODD = {  # a carrier bearing softer in one fixed direction
    "stage.carrier.bearing_far.radial_x_n_per_m": "1e9",
    "stage.carrier.bearing_far.radial_y_n_per_m": "6e9",
}


def test_invariant_part_does_not_feel_rotation_and_the_rest_has_no_mean():
    rng = np.random.default_rng(3)
    a = rng.normal(size=(6, 6))
    k = a @ a.T
    mean = invariant_part(k)
    for angle in (0.3, 1.7):
        assert np.allclose(turn(angle).T @ mean @ turn(angle), mean)
    assert np.allclose(invariant_part(k - mean), 0.0, atol=1e-12)
    values, vectors = rotating_rows(k - mean)
    assert np.allclose((vectors.T * values) @ vectors, k - mean)


@pytest.fixture(scope="module")
def odd():
    return make_system(**ODD)


def test_anisotropic_bearing_enters_as_a_rotated_spring(odd):
    """Equilibrium against dense algebra with the bearing's matrix turned into the carrier frame."""
    case = make_case(**ODD)
    modal = modal_system(odd)
    matrix = case.seat_bearings["far"].matrix
    for theta in (0.0, 0.6, 2.0):
        e = revolution(modal, theta, TORQUE)
        q = modal.modes @ e.eta[0] + modal.residual_motion @ channel_forces(e)[0]
        rows = odd.node_rows("stage.carrier", "bearing_far")
        extra = rows.T @ (turn(theta).T @ matrix @ turn(theta) - invariant_part(matrix)) @ rows
        load = odd.ports[0].row * TORQUE - odd.ports[-1].row * -e.torques[0, -1]
        gear_meshes = sum(one.stiffness for one in springs_at(odd, theta).gear_meshes)
        loaded = shaped(e, "pair_load")[0][shaped(e, "pair_stiffness")[0] > 0]
        assert loaded.min() > 0  # every pair in mesh is loaded, so the spring form holds
        residual = (odd.stiffness + extra + gear_meshes) @ q - load
        assert np.abs(residual).max() < 1e-8 * TORQUE


def test_a_run_on_an_anisotropic_bearing_stays_balanced(odd):
    theta = np.arange(24) / 24 * 2 * np.pi
    e = revolution(modal_system(odd), theta, TORQUE)
    assert e.closure.max() < 1e-8
    assert np.allclose(-e.torques[:, -1], TORQUE * 27 / 120)
    carried = Recovery(e).link_force("stage.carrier_far")  # carrier axes, from the matrix as given
    u = Recovery(e).node("stage.carrier", "bearing_far")
    matrix = make_case(**ODD).seat_bearings["far"].matrix
    for t, angle in enumerate(theta):
        r = turn(angle)
        assert np.allclose(carried[t], r.T @ matrix @ r @ u[t], atol=1e-6 * TORQUE)


def test_stiff_mount_of_a_lumped_housing_equals_ground():
    stiff = {
        "housing.kind": '"lumped"',
        "housing.mass_kg": "2e4",
        "housing.inertia_kg_m2": "[2e4, 2e4, 2e4]",
        "housing.mount.radial_n_per_m": "1e14",
        "housing.mount.axial_n_per_m": "1e14",
        "housing.mount.tilt_nm_per_rad": "1e14",
        "housing.mount.torsion_nm_per_rad": "1e14",
    }
    a, b = modal_system(make_system()), modal_system(make_system(**stiff))
    ea, eb = revolution(a, 0.8, TORQUE), revolution(b, 0.8, TORQUE)
    assert np.allclose(
        shaped(ea, "pair_load"), shaped(eb, "pair_load"), atol=1e-3 * shaped(ea, "pair_load").max()
    )


def test_soft_mount_turns_by_the_ring_torque():
    mount = 2e8
    soft: dict = {
        "housing.kind": '"lumped"',
        "housing.mass_kg": "2e4",
        "housing.inertia_kg_m2": "[2e4, 2e4, 2e4]",
        "housing.mount.radial_n_per_m": "1e9",
        "housing.mount.axial_n_per_m": "1e9",
        "housing.mount.tilt_nm_per_rad": "1e9",
        "housing.mount.torsion_nm_per_rad": str(mount),
    }
    e = revolution(modal_system(make_system(**soft)), 0.8, TORQUE)
    turned = Recovery(e).node("housing", "housing")[0, 5]
    assert turned == pytest.approx(TORQUE * 93 / 120 / mount, rel=1e-6)
    assert -e.torques[0, -1] == pytest.approx(TORQUE * 27 / 120, rel=1e-9)


def test_bearing_that_holds_the_rotation_is_refused():
    with pytest.raises(InputError, match="rotation"):
        make_system(**{"stage.carrier.bearing_drive.torsion_nm_per_rad": "1e6"})


def test_single_point_gear_mesh_shares_load_by_stiffness():
    theta = np.linspace(0, 0.06, 5)
    lumped = revolution(
        modal_system(make_system(**{"stage.gear_mesh.model": '"lumped"'})), theta, TORQUE
    )
    pairs = revolution(modal_system(make_system()), theta, TORQUE)
    total, k = shaped(lumped, "pair_load").sum(-1, keepdims=True), shaped(lumped, "pair_stiffness")
    share = k / np.maximum(k.sum(-1, keepdims=True), 1.0)
    assert np.allclose(shaped(lumped, "pair_load"), total * share, atol=1e-6 * total.max())
    assert np.allclose(
        shaped(lumped, "pair_load").sum(-1)[:, :2].mean(-1),
        shaped(pairs, "pair_load").sum(-1)[:, :2].mean(-1),
        rtol=1e-6,
    )


def test_lumped_and_anisotropic_runs_keep_their_energy():
    for options in (ODD, {"stage.gear_mesh.model": '"lumped"'}):
        modal = modal_system(make_system(**options), 2000.0)
        drive = Drive(lambda t: np.full_like(t, TORQUE))
        assert energy_error(stepped(modal, drive, 0.05, 5e-5, 1e-3, track_energy=True)) < 1e-3


def test_natural_modes_hold_one_rigid_rotation_and_energy_shares_add_up():
    system = make_system(**{"stage.gear_mesh.contact_law": '"linear"'})
    result = modes(system, springs_at(system, 0.1).stiffness, limit_hz=500.0)
    assert result.frequencies[0] == 0.0 and result.frequencies[1] > 1.0
    total = sum(result.energy.values())
    assert np.allclose(total, 1.0, atol=1e-9)


def test_bodies_are_those_of_the_case():
    ring, carrier = make_bodies(make_case()).values()
    assert len([n for n in ring.node_names if n.startswith("tooth")]) == 93
    assert carrier.node_names[3:] == tuple(f"pin_{i}" for i in range(1, 6))
