"""Weight and loads reach every body of a flexible stage, also those that bend."""

import math

import numpy as np
import pytest
from coupled import make_bodies, make_case

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.structures.kinematics import turn

G = 9.81
SMALL = {  # few tooth nodes; teeth and bolts repeat by fives, as the planets do
    "gear_mesh.contact_law": "linear",
    "stage.sun.teeth": "20",
    "stage.planet.teeth": "20",
    "stage.ring.teeth": "60",
    "stage.planet.bore_diameter_mm": "200",
    "carrier.pin_diameter_mm": "180",
}
ON_HOUSING = ("carrier_drive", "carrier_far", "output")


def solved(case, bodies, angles=(0.0,)):
    """The stage at rest under next to no torque, all modes kept."""
    system = build_system(case.case, {"stage": bodies})
    return revolution(modal_system(system), np.array(angles), case.case.inputs[0].torque)


def reactions(found, sample=0):
    """Force and moment (6,) of the housing on all that it holds, at the origin, fixed axes."""
    recovery, system = Recovery(found), found.modal.system
    total, theta = np.zeros(6), float(found.theta[sample, 0])
    for link in system.links:
        name = link.name.removeprefix("stage.")
        part = "ring" if name.startswith(("bolt", "fit")) else ""
        if name in ON_HOUSING:
            part = "output" if name == "output" else "carrier"
        if not part:
            continue
        node = name.replace("carrier_", "bearing_") if part == "carrier" else name
        node = f"stage.{part}" if part == "output" else node
        x = system.body(f"stage.{part}").position(node)
        angle = math.atan2(x[1], x[0]) if name.startswith("bolt") else 0.0
        if part != "ring":
            angle = theta  # the carrier's axes
            x = turn(theta)[:3, :3] @ x
        force = -turn(angle) @ recovery.link_force(link.name)[sample]
        total += np.r_[force[:3], force[3:] + np.cross(x, force[:3])]
    return total


def mass_of(system):
    """Mass of all bodies, kg."""
    return sum(_mass(body) for body in system.bodies)


def _mass(body):
    nodes = body.node_map[0] if body.rigid else np.tile([1, 0, 0, 0, 0, 0], len(body.node_names))
    moved = np.zeros(body.size)
    moved[: len(nodes)] = nodes
    return float(moved @ body.mass @ moved)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.0])
def test_the_housing_carries_the_weight_of_all_bodies(angle):
    """Reactions with weight less those without are m g, whatever the carrier's angle."""
    plain = make_case(**SMALL)
    heavy = plain.with_(gravity=(0.0, -G, 0.0))
    bodies = make_bodies(plain)
    with_weight, without = (solved(case, bodies, [angle]) for case in (heavy, plain))
    weight = mass_of(with_weight.modal.system) * G
    more = reactions(with_weight) - reactions(without)
    assert more[:3] == pytest.approx([0.0, weight, 0.0], abs=1e-8 * weight)


def test_axial_gravity_loads_the_axial_bearings():
    plain = make_case(**SMALL)
    bodies = make_bodies(plain)
    heavy = plain.with_(gravity=(0.0, 0.0, G))
    more = reactions(solved(heavy, bodies)) - reactions(solved(plain, bodies))
    weight = mass_of(solved(heavy, bodies).modal.system) * G
    assert more[:3] == pytest.approx([0.0, 0.0, -weight], abs=1e-8 * weight)


def test_load_sharing_under_weight_turns_once_a_revolution():
    """Weight pulls planet after planet; what one feels, the next feels a fifth of a turn later."""
    case = make_case(**SMALL)
    bodies = make_bodies(case)
    heavy = case.with_(gravity=(0.0, -G, 0.0))
    turnings = 2 * math.pi * np.arange(5) / 5
    found = solved(heavy, bodies, turnings)
    force = found.pair_load.sum(axis=-1)[:, :5]  # ring, planets in order
    assert np.ptp(force[0]) > 1e-4 * force.mean()
    for k in range(5):
        assert force[k] == pytest.approx(np.roll(force[0], -k), rel=1e-6)


def test_a_rotor_moment_is_held_by_the_bearings():
    """Six components at the carrier's drive end, in fixed axes."""
    moment, force = np.array([3e5, -2e5, 0.0]), np.array([1e4, 2e4, -3e4])
    plain = make_case(**SMALL)
    load = {"member": "carrier", "force": tuple(force), "moment": tuple(moment)}
    loaded = plain.with_(loads=(load,))
    bodies = make_bodies(plain)
    for angle in (0.0, 1.0):
        more = reactions(solved(loaded, bodies, [angle])) - reactions(
            solved(plain, bodies, [angle])
        )
        at = np.array([0.0, 0.0, bodies[1].positions[0][2]])
        wanted = -np.r_[force, moment + np.cross(at, force)]
        assert more == pytest.approx(wanted, abs=1e-8 * np.abs(wanted).max())
