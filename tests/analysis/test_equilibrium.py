"""Equilibria: invariance, limits, the five-pointed ring."""

import numpy as np
import pytest
from coupled import TORQUE, make_bodies, make_case, make_system, shaped

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.modal import modal_system


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
