"""Equilibria: balance, invariance, limits, the five-pointed ring."""

import numpy as np
import pytest
from coupled import TORQUE, make_bodies, make_case, make_system, named, shaped

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.modes import springs_at
from flexgear.analysis.recovery import Recovery, channel_forces
from flexgear.coupling.modal import modal_system
from flexgear.gears.geometry import stage_geometry


def test_output_torque_and_gear_mesh_force_follow_statics(one_sided_modal, angles):
    e = revolution(one_sided_modal, angles, TORQUE)
    assert np.allclose(-e.torques[:, -1], TORQUE * 27 / 120, rtol=1e-10)
    geometry = stage_geometry(make_case())
    paths = one_sided_modal.system.pairs
    cos_b = paths.cos_b[0]
    expected = TORQUE * 93 / 120 / (5 * geometry.ring.base_radius * cos_b)
    force = shaped(e, "pair_load").sum(-1)
    assert force[:, 0].mean() == pytest.approx(expected, rel=1e-3)
    assert force[:, 1].mean() == pytest.approx(expected, rel=1e-3)
    assert e.closure.max() < 1e-8


def test_equilibrium_closes_in_physical_coordinates(linear, linear_modal):
    """K q + Σ k V Vᵀ q = external load, with nothing of the solver's own algebra."""
    e = revolution(linear_modal, 0.7, TORQUE)
    q = linear_modal.modes @ e.eta[0] + linear_modal.residual_motion @ channel_forces(e)[0]
    load = linear.ports[0].row * TORQUE - linear.ports[-1].row * -e.torques[0, -1]
    residual = linear.stiffness @ q + springs_at(linear, 0.7).stiffness @ q - load
    # forces at light coordinates cancel between stiff neighbours: compare with the load
    assert np.abs(residual).max() < 1e-8 * TORQUE


def test_links_carry_the_whole_load(one_sided_modal):
    """Bolts take the ring's torque; bearings and bolts together no net force."""
    e = revolution(one_sided_modal, 0.3, TORQUE)
    r = Recovery(e)
    system = one_sided_modal.system
    ring = system.body("stage.ring")
    torque, force = 0.0, np.zeros(3)
    for name in ring.node_names:
        if not name.startswith("bolt"):
            continue
        local = r.link_force(f"stage.{name}")[0]
        x = ring.position(name)
        a = np.arctan2(x[1], x[0])
        c, s = np.cos(a), np.sin(a)
        f = np.array([c * local[0] - s * local[1], s * local[0] + c * local[1], local[2]])
        torque += x[0] * f[1] - x[1] * f[0] + local[5]
        force += f
    assert torque == pytest.approx(TORQUE * 93 / 120, rel=1e-8)


def test_five_pointed_ring_turns_with_the_carrier(one_sided_modal):
    teeth = [n for n in one_sided_modal.system.body("stage.ring").node_names if n[0] == "t"]
    positions = one_sided_modal.system.body("stage.ring").positions[:93]
    phi = np.arctan2(positions[:, 1], positions[:, 0])
    carrier = 2 * np.pi / 93 * np.arange(0, 19, 6)  # whole ring teeth: same phase of gear mesh
    r = Recovery(revolution(one_sided_modal, carrier, TORQUE))
    u = np.stack([r.node("stage.ring", name) for name in teeth], axis=1)
    radial = u[..., 0] * np.cos(phi) + u[..., 1] * np.sin(phi)
    c = np.array([radial @ np.exp(-1j * n * phi) / 93 for n in range(21)]).T
    size = np.abs(c)
    others = [n for n in range(1, 21) if n % 5]
    assert size[:, others].max() < 0.1 * size[:, 5].min()
    phase = np.unwrap(-np.angle(c[:, 5])) / 5
    assert np.allclose(np.diff(phase), np.diff(carrier), atol=np.deg2rad(0.5))


def test_turning_everything_changes_nothing():
    """Ring, bolts and carrier turned by three teeth: the same loads at the turned angle."""
    case = make_case()
    ring, carrier = make_bodies(case).values()
    steps, alpha = 3, 3 * 2 * np.pi / 93
    turned = _turned(ring, alpha, steps)
    a = modal_system(make_system(bodies=named(case, ring=ring, carrier=carrier)))
    angle = {"stage.ring.fe.bolts.first_angle_deg": str(np.degrees(alpha))}
    b = modal_system(make_system(bodies=named(case, ring=turned, carrier=carrier), **angle))
    for theta in (0.0, 0.013):
        ea, eb = revolution(a, theta, TORQUE), revolution(b, theta + alpha, TORQUE)
        loads_a, loads_b = _by_tooth(ea, 93), _by_tooth(eb, 93)
        assert np.allclose(np.roll(loads_a, steps, axis=1), loads_b, atol=1e-8 * loads_a.max())


def _by_tooth(e, teeth):
    """Ring load (N, z_r) by tooth number."""
    out = np.zeros((shaped(e, "pair_load").shape[2], teeth))
    for i in range(out.shape[0]):
        for s in range(shaped(e, "pair_load").shape[3]):
            if shaped(e, "pair_tooth")[0, 0, i, s] >= 0:
                out[i, shaped(e, "pair_tooth")[0, 0, i, s]] += shaped(e, "pair_load")[0, 0, i, s]
    return out


def _turned(ring, alpha, steps):
    from dataclasses import replace

    from flexgear.structures.bodies import turn

    r = turn(alpha)
    n = len(ring.node_names)
    big = np.kron(np.eye(n), r)
    order = np.arange(n)
    order[:93] = (np.arange(93) - steps) % 93  # new tooth j is the old tooth j − steps
    dofs = (6 * order[:, None] + np.arange(6)).ravel()
    k = big @ ring.stiffness @ big.T
    m = big @ ring.mass @ big.T
    x = ring.positions @ r[:3, :3].T
    return replace(
        ring, positions=x[order], stiffness=k[np.ix_(dofs, dofs)], mass=m[np.ix_(dofs, dofs)]
    )


def test_renumbering_planets_changes_nothing(one_sided_modal):
    """A fifth of a turn brings planet 2 where planet 1 was; bolts repeat five times a turn.

    93 teeth do not, so only the loads by path position are the same, not the tooth numbers.
    """
    system = one_sided_modal.system
    stiff = modal_system(make_system(["ring"]))
    e0 = revolution(stiff, 0.2, TORQUE)
    e1 = revolution(stiff, 0.2 + 2 * np.pi / 5, TORQUE)
    assert len({label.planet for label in system.gear_meshes}) == 5
    for kind in (0, 1):
        a = np.sort(shaped(e0, "pair_load")[0, kind], axis=-1)
        b = np.sort(shaped(e1, "pair_load")[0, kind], axis=-1)
        assert np.allclose(np.roll(b, 1, axis=0), a, atol=1e-8 * a.max())


def test_mirror_in_the_plane_of_rotation_changes_only_signs():
    """Helix hand, sides of bolts, drive, shaft, stiffer rows: u_z, θ_x, θ_y change sign."""
    case = make_case()
    bodies = make_bodies(case)
    mirrored = make_bodies(case, drive_z=0.6, bolt_z=-0.215)
    other = "right" if case.stage.planet_hand == "left" else "left"
    side = "+z" if case.shaft.direction == "-z" else "-z"
    a = modal_system(make_system(bodies=bodies))
    assert case.stage.planet_bearing.z == -0.03
    changes = {
        "stage.planet_hand": other,
        "stage.sun.shaft.direction": side,
        "stage.planet_bearing.z_mm": "30",
    }
    b = modal_system(make_system(bodies=mirrored, **changes))
    sign = np.array([1, 1, -1, -1, -1, 1.0])
    for theta in (0.0, 0.9):
        ea, eb = revolution(a, theta, TORQUE), revolution(b, theta, TORQUE)
        assert np.allclose(
            shaped(ea, "pair_load"),
            shaped(eb, "pair_load"),
            atol=1e-8 * shaped(ea, "pair_load").max(),
        )
        ra, rb = Recovery(ea), Recovery(eb)
        for body, node in (
            ("stage.ring", "tooth_001"),
            ("stage.planet_2", "stage.planet_2"),
            ("stage.shaft", "sun"),
        ):
            ua, ub = ra.node(body, node)[0], rb.node(body, node)[0]
            assert np.allclose(ua * sign, ub, atol=1e-8 * np.abs(ua).max())


@pytest.mark.parametrize("name", ["ring", "carrier", "shaft"])
def test_stiffened_component_equals_the_rigid_one(name):
    system = make_system()
    stiffness, at = system.stiffness.copy(), system.slice_of(f"stage.{name}")
    stiffness[at, at] += (1e4 - 1) * system.body(f"stage.{name}").stiffness
    a = modal_system(system.with_(stiffness=stiffness))
    b = modal_system(make_system([name]))
    ea, eb = revolution(a, 0.4, TORQUE), revolution(b, 0.4, TORQUE)
    assert np.allclose(
        shaped(ea, "pair_load"), shaped(eb, "pair_load"), atol=1e-3 * shaped(eb, "pair_load").max()
    )
    ra, rb = Recovery(ea), Recovery(eb)
    for body, node in (
        ("stage.planet_1", "stage.planet_1"),
        ("stage.shaft", "sun"),
        ("stage.ring", "tooth_003"),
    ):
        ua, ub = ra.node(body, node)[0, :3], rb.node(body, node)[0, :3]
        assert np.allclose(ua, ub, atol=1e-3 * np.abs(ub).max())


def test_no_torque_leaves_the_teeth_touching_without_load(one_sided_modal):
    e = revolution(one_sided_modal, 0.0, 0.0)
    assert np.abs(shaped(e, "pair_load")).max() < 1e-6
    assert abs(e.torques[0, -1]) < 1e-6
