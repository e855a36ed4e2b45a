"""A train is one system: limits between kinds of bodies, joints, clearance, weight, mixing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from coupled import make_bodies, stage_system
from trains import STEEL, planetary, stage_train, write

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import modes, springs_at
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.model.load import load_case


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


def flanks(gear):
    """What a gear's teeth are, as keys."""
    names = ("profile_shift", "addendum", "dedendum", "root_fillet")
    return "\n".join(f"{name} = {getattr(gear, name)}" for name in names)


def lumped_twin(tmp_path, case, bodies, errors=()):
    """The flexible stage's rigid variant written as a lumped train with the same masses."""
    from flexgear.coupling.members import stage_members

    model = case.gear_mesh.model
    lines = "\n".join(f"{key} = {value}" for key, value in dict(errors).items())
    members = stage_members(case.case, case.stage, bodies, case.flexible_bodies)
    parts = {m.body.name.removeprefix("stage."): m.body for m in members}
    planet = next(m for m in members if m.part == "planet")
    s = case.stage
    on_seats = sum(bearing.matrix[0, 0] for bearing in case.stage.seat_bearings.values())
    carrier = [on_seats, parts["carrier"]]
    text = (
        STEEL
        + f"""
[stage]
planets = {s.planets}
normal_module_mm = {1e3 * s.normal_module!r}
pressure_angle_deg = 20
face_width_mm = {1e3 * s.face_width!r}
[stage.sun]
teeth = {s.sun.teeth}
{flanks(s.sun)}
mass_kg = {parts["shaft"].mass[0, 0]}
inertia_kg_m2 = {parts["shaft"].mass[5, 5] + case.case.output.inertia}
[stage.planet]
teeth = {s.planet.teeth}
{flanks(s.planet)}
mass_kg = {planet.mass}
inertia_kg_m2 = {planet.inertia}
[stage.ring]
teeth = {s.ring.teeth}
{flanks(s.ring)}
kinematics = "fixed"
[stage.carrier]
mass_kg = {carrier[1].mass[0, 0]}
inertia_kg_m2 = {carrier[1].mass[5, 5] + case.case.inputs[0].inertia}
support = {{ radial_n_per_m = {carrier[0]} }}
[stage.planet_bearing]
radial_n_per_m = {s.planet_bearing.matrix[0, 0]}
[stage.gear_mesh]
model = "{model}"
contact_law = "linear"
[stage.errors]
pin_tangential_um = {[round(1e6 * x, 6) for x in case.stage.errors.pin_tangential]}
{lines}
[[inputs]]
member = "stage.carrier"
speed_rpm = 11.27
torque_nm = 4e6
[output]
member = "stage.sun"
"""
    )
    return load_case(write(tmp_path, text))


@pytest.mark.parametrize("model", ["per_pair", "constant", "rectangular", "fourier"])
def test_stiffened_flexible_stage_is_the_lumped_train(tmp_path, model):
    """Ring, carrier and shaft rigid, everything else stiff in tilt: planar lumped bodies."""
    from coupled import make_case

    from flexgear.coupling.build import build_system

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
    own = {f"stage.errors.{key}": value for key, value in BODY_ERRORS.items()}
    case = make_case(**RIGID_STAGE, **stiff, **bolts, **own, **{"stage.gear_mesh.model": model})
    bodies = make_bodies(case)
    twin = lumped_twin(tmp_path, case, bodies, BODY_ERRORS)
    system = stage_system(case, bodies, ("ring", "carrier", "shaft"))
    angles = np.linspace(0, 0.06, 5)
    rigid = revolution(modal_system(system), angles, 4e6)
    lumped = solved(twin, angles)
    a, b = loads(rigid), loads(lumped)
    assert np.abs(a - b).max() < 1e-3 * a.max()
    # the sums of the flexible stage's sets: ring then sun, planets in order
    assert [g.kind for g in system.gear_meshes] == [g.kind for g in build_system(twin).gear_meshes]


def test_two_flexible_stages_follow_each_other(tmp_path):
    """Ring and carrier of both bend; the joint between sun and carrier is a spring in space."""
    text = (
        STEEL
        + """
[[stages]]
name = "first"
case = "wind-5mw"
[[stages]]
name = "second"
case = "wind-5mw"
[[joints]]
first = "first.sun"
second = "second.carrier"
torsion_nm_per_rad = 1e9
axial_n_per_m = 1e8
radial_n_per_m = 1e8
tilt_nm_per_rad = 1e7
[[inputs]]
member = "first.carrier"
speed_rpm = 5
torque_knm = 4000
inertia_kg_m2 = 1e6
[output]
member = "second.sun"
"""
    )
    weight = {"gravity_m_per_s2": "[0, -9.81, 0]"}
    train = load_case(write(tmp_path, text, 'kinematics = "spatial"\n'), weight)
    bodies = make_bodies(train.view("first")) | make_bodies(train.view("second"))
    system = build_system(train, bodies)
    found = revolution(modal_system(system), np.array([0.0, 0.3]), 4e6)
    assert found.closure.max() < 1e-8
    assert np.allclose(-found.torques[:, -1], 4e6 * (27 / 120) ** 2, rtol=1e-9)
    for name in ("first", "second"):
        bend = {b.name for b in system.bodies if b.name.startswith(name) and not b.rigid}
        assert bend == {f"{name}.{part}" for part in ("ring", "carrier", "shaft")}


def test_a_wave_is_handed_over_from_tooth_to_tooth_without_a_jump():
    """Over a pitch of the ring at most two teeth of an FE ring share the row of a wave; what each
    takes changes by no more than the angle does, and together they balance the torque."""
    from coupled import make_case

    from flexgear.gears.power_flow import power_flow

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


def test_weight_is_carried_in_space(tmp_path):
    """Supports of a still train carry the weight of all bodies, whatever the carrier's angle."""
    train = stage_train(tmp_path, planets=3, sun="1e9", head="gravity_m_per_s2 = [0, -9.81, 0]\n")
    system = build_system(train)
    angles = np.array([0.0, 0.7, 2.5])
    result = revolution(modal_system(system), angles, 3000)
    recovery = Recovery(result)
    total = np.zeros((len(angles), 2))
    for name in ("sun", "ring", "carrier"):
        force = recovery.link_force(f"stage.{name}_support")[:, :2]
        c, s = np.cos(angles), np.sin(angles)
        total += np.column_stack(
            [c * force[:, 0] - s * force[:, 1], s * force[:, 0] + c * force[:, 1]]
        )
    weight = 9.81 * (3 + 3 * 4 + 30 + 25)
    assert np.allclose(total, [0.0, -weight], atol=1e-8 * weight)


def test_bearing_with_clearance(tmp_path):
    """A planet moves by gap + F/k against its pin, along the force: Newton on k (|u| − gap)."""
    gap = 2e-4
    train = stage_train(
        tmp_path, planets=3, **{"stage.planet_bearing.clearance_um": str(1e6 * gap)}
    )
    free = stage_train(tmp_path, planets=3)
    a, b = solved(free, (0.0,)), solved(train, (0.0,))
    assert np.allclose(loads(a), loads(b), rtol=1e-4)  # determinate but for the centering spring
    slots = b.support_load[0].reshape(3, 2)
    force = 2 * loads(b)[0, 0] * np.cos(np.radians(20))
    assert np.allclose(slots[:, 0], 0.0, atol=1e-6 * force)
    assert np.allclose(np.abs(slots[:, 1]), force, rtol=2e-3)
    recovery, radius = Recovery(b), 0.5e-3 * 4 * (26 + 34)
    for i in range(3):
        pin = recovery.node("stage.carrier", "stage.carrier")[0]
        planet = recovery.node(f"stage.planet_{i + 1}", f"stage.planet_{i + 1}")[0]
        assert planet[1] - radius * pin[5] == pytest.approx(
            np.sign(slots[i, 1]) * (force / 5e8 + gap), rel=2e-3
        )


def test_no_rotation_makes_force(two_stages):
    """Springs and gear meshes do not see the rolling of the train."""
    system = build_system(two_stages)
    assert np.abs(system.stiffness @ system.rolling).max() < 1e-7 * np.abs(system.stiffness).max()
    for angle in (0.0, 0.4):
        k = springs_at(system, angle).stiffness
        assert np.abs(k @ system.rolling).max() < 1e-9 * np.abs(k).max()
