"""A train is one system: limits between kinds of bodies, joints, clearance, weight, mixing."""

from pathlib import Path

import numpy as np
import pytest
from coupled import make_bodies, make_case, stage_system
from train_contexts import TWO_FLEXIBLE
from trains import STEEL, planetary, stage_train, write

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import modes, springs_at
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import validated_case
from flexgear.model.load import load_case
from flexgear.model.read import Written


def loads(result):
    """(p, M) force of every gear mesh."""
    return result.pair_load.sum(axis=-1)


def solved(train, angles=(0.0, 0.3), torque=None):
    system = build_system(train)
    return revolution(
        modal_system(system), np.array(angles), system.rated_torque if torque is None else torque
    )


def test_spatial_spur_stage_moves_like_the_planar_one(tmp_path):
    """In-plane frequencies and forces do not know of axial motion that spur gears lack."""
    errors = {"stage.errors.pin_tangential_um": "[30, 0, -10, 5]"}
    flat = stage_train(tmp_path, sun="2e8", **errors)
    held = {
        "kinematics": "spatial",
        **{f"stage.{m}.support.axial_n_per_m": "1e9" for m in ("sun", "ring", "carrier")},
        **{f"stage.{m}.support.tilt_nm_per_rad": "1e8" for m in ("sun", "ring", "carrier")},
        "stage.planet_bearing.axial_n_per_m": "1e9",
        "stage.planet_bearing.tilt_nm_per_rad": "1e8",
    }
    full = stage_train(tmp_path, sun="2e8", **errors, **held)
    systems = build_system(flat), build_system(full)
    a, b = (modes(system, springs_at(system).stiffness) for system in systems)
    distance = np.abs(b.frequencies[None, :] - a.frequencies[1:, None]).min(axis=1)
    assert np.max(distance / a.frequencies[1:]) < 1e-9
    assert np.allclose(loads(solved(flat)), loads(solved(full)), rtol=1e-9)
    axial = stage_train(tmp_path, sun="2e8", **errors, **{**held, "kinematics": "axial"})
    assert np.allclose(loads(solved(flat)), loads(solved(axial)), rtol=1e-9)


RIGID_STAGE = {
    "stage.helix_angle_deg": "0",
    "stage.gear_mesh.contact_law": "linear",
    "stage.errors.pin_tangential_um": "[40, 0, 0, -20, 0]",
}


BODY_ERRORS = {
    "sun_eccentricity_um": "30", "sun_eccentricity_phase_deg": "40", "ring_eccentricity_um": "25",
    "ring_eccentricity_phase_deg": "100", "carrier_eccentricity_um": "20",
    "carrier_eccentricity_phase_deg": "200", "planet_eccentricity_um": "[10, 5, 0, 8, 3]",
    "planet_eccentricity_phase_deg": "[0, 80, 10, 200, 300]", "ring_offset_um": "15",
    "ring_offset_phase_deg": "70", "planet_thickness_um": "[12, 0, -7, 0, 4]",
    "ring_gear_mesh_um": "6", "sun_gear_mesh_um": "-4", "sun_gear_mesh_phase_deg": "30",
}  # fmt: skip


def lumped_twin(case):
    """The same with planar lumped members, the carrier on a spring as stiff as its seats."""
    data = case.case.model_dump(mode="python")
    stage, seats = data["stages"][0], case.stage.seat_bearings.values()
    for member in ("sun", "planet", "carrier"):
        stage[member]["kinematics"] = "planar"
    on_seats = {"radial": sum(bearing.matrix[0, 0] for bearing in seats)}
    stage["carrier"] |= {"fe": None, "bearing_drive": None, "bearing_far": None}
    stage["carrier"]["support"] = on_seats
    stage["ring"] |= {"fe": None, "kinematics": "fixed"}
    stage["sun"]["shaft"] = None
    stage["planet_bearing"] |= {"axial": 0.0, "tilt": 0.0, "z": 0.0}
    data["output"] |= {"mass": None, "tilt_inertia": None, "bearing": None}
    return validated_case(data, "test", Written())


@pytest.mark.parametrize("model", ["per_pair", "constant", "rectangular", "fourier"])
def test_stiffened_flexible_stage_is_the_lumped_train(model):
    """Ring, carrier and shaft rigid, everything else stiff in tilt: planar lumped bodies."""
    stiff = {
        "stage.planet_bearing.tilt_nm_per_rad": "1e13",
        "stage.carrier.bearing_drive.tilt_nm_per_rad": "1e13",
        "stage.carrier.bearing_far.tilt_nm_per_rad": "1e13",
        "output.bearing.radial_n_per_m": "1e4",
        "output.bearing.tilt_nm_per_rad": "1e13",
        "stage.sun.shaft.spline.radial_n_per_m": "1e4",
        "stage.sun.shaft.spline.torsion_nm_per_rad": "1e13",
    }
    bolts = {
        f"stage.ring.fe.bolts.stiffness_{d}_n_per_m": "1e13"
        for d in ("radial", "tangential", "axial")
    }
    errors = {f"stage.errors.{key}": value for key, value in BODY_ERRORS.items()}
    case = make_case(**RIGID_STAGE, **stiff, **bolts, **errors, **{"stage.gear_mesh.model": model})
    bodies = make_bodies(case)
    twin = lumped_twin(case)
    system = stage_system(case, bodies, ("ring", "carrier", "shaft"))
    angles = np.linspace(0, 0.06, 5)
    rigid = revolution(modal_system(system), angles, 4e6)
    a, b = loads(rigid), loads(solved(twin, angles, 4e6))
    assert np.abs(a - b).max() < 1e-3 * a.max()
    # the sums of the flexible stage's sets: ring then sun, planets in order
    assert [g.kind for g in system.gear_meshes] == [g.kind for g in build_system(twin).gear_meshes]


@pytest.mark.slow
def test_two_flexible_stages_follow_each_other(tmp_path):
    """Ring and carrier of both bend; the joint between sun and carrier is a spring in space."""
    weight = {"gravity_m_per_s2": "[0, -9.81, 0]"}
    train = load_case(write(tmp_path, TWO_FLEXIBLE, 'kinematics = "spatial"\n'), weight)
    bodies = make_bodies(train.view("first")) | make_bodies(train.view("second"))
    system = build_system(train, bodies)
    equilibrium = revolution(modal_system(system), np.array([0.0, 0.3]), 4e6)
    assert equilibrium.closure.max() < 1e-8
    assert np.allclose(-equilibrium.torques[:, -1], 4e6 * (27 / 120) ** 2, rtol=1e-9)
    for name in ("first", "second"):
        bend = {b.name for b in system.bodies if b.name.startswith(name) and not b.rigid}
        assert bend == {f"{name}.{part}" for part in ("ring", "carrier", "shaft")}


def test_a_wave_is_handed_over_from_tooth_to_tooth_without_a_jump():
    """Over a pitch of the ring at most two teeth of an FE ring share the row of a wave; what each
    takes changes by no more than the angle does, and together they balance the torque."""
    case = make_case(
        **{"stage.gear_mesh.model": "constant", "stage.errors.pin_tangential_um": "[]"}
    )
    system, steps = stage_system(case, make_bodies(case)), 40
    angles = 2 * np.pi / case.stage.ring.teeth * np.arange(steps + 1) / steps
    load = revolution(modal_system(system), angles, 4e6).pair_load
    ring = load[:, [g.kind == "ring" for g in system.gear_meshes]]
    mean = power_flow(case.case).stages[0].ring_gear_mesh_force
    assert (ring > 0).sum(axis=-1).max() == 2
    assert np.abs(np.diff(ring, axis=0)).max() < 1.2 / steps * mean
    assert ring.max() > 0.95 * mean
    assert ring.sum(axis=(1, 2)) == pytest.approx(case.stage.planets * mean, rel=1e-6)


TWO_STAGES = (
    STEEL
    + planetary(3, 5, 60, 18, 27, 72)
    + planetary(4, 3, 40, 20, 30, 80)
    + """
[[joints]]
first = "stage_1.sun"
second = "stage_2.carrier"
torsion_nm_per_rad = 1e7
radial_n_per_m = 3e8
[[inputs]]
member = "stage_1.carrier"
speed_rpm = 20
torque_nm = 20000
[output]
member = "stage_2.sun"
"""
)


@pytest.fixture
def two_stages(tmp_path):
    return load_case(write(tmp_path, TWO_STAGES))


def test_joint_between_turning_frames_is_a_spring_in_space(two_stages):
    """A force fixed in space on the second carrier: the joint answers the same at any angle.

    Frames of both stages turn at different speeds; what reaches the first sun is k (u − u') in
    fixed axes, so displacements turned back to fixed axes do not depend on the angle.
    """
    head = "[[loads]]\nmember = 'stage_2.carrier'\nforce_kn = [8, 3, 0]\n"
    path = Path(two_stages.source)
    path.write_text(path.read_text("utf-8") + head, "utf-8")
    train = load_case(path)
    system = build_system(train)
    modal = modal_system(system)
    angles = np.linspace(0, 3, 7)
    loaded, plain = (
        revolution(modal_system(s), angles, 20000) for s in (system, build_system(two_stages))
    )
    fixed = []
    for body in ("stage_1.sun", "stage_2.carrier"):
        change = Recovery(loaded).node(body, body) - Recovery(plain).node(body, body)
        number = 0 if body.startswith("stage_1") else 1
        psi = (modal.system.angles[number] @ modal.system.rolling[:, 0]) * angles
        c, s = np.cos(psi), np.sin(psi)
        fixed.append(
            np.column_stack(
                [c * change[:, 0] - s * change[:, 1], s * change[:, 0] + c * change[:, 1]]
            )
        )
    sun, carrier = fixed
    # four planets carry the second carrier alike in all directions; three likewise
    assert np.allclose(carrier, carrier[0], atol=1e-6 * np.abs(carrier).max())
    assert np.allclose(sun, sun[0], atol=1e-6 * np.abs(sun).max())
    assert np.linalg.norm(sun[0]) > 0.01 * np.linalg.norm(carrier[0])


def test_no_rotation_makes_force(two_stages):
    """Springs and gear meshes do not see the rolling of the train."""
    system = build_system(two_stages)
    assert np.abs(system.stiffness @ system.rolling).max() < 1e-7 * np.abs(system.stiffness).max()
    for angle in (0.0, 0.4):
        k = springs_at(system, angle).stiffness
        assert np.abs(k @ system.rolling).max() < 1e-9 * np.abs(k).max()
