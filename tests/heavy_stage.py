"""A flexible stage under weight and next to no torque, and what its housing carries."""

import math

import numpy as np

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.coupling.build import build_system
from flexgear.coupling.modal import modal_system
from flexgear.structures.bodies import turn

G = 9.81
SMALL = {  # few tooth nodes; teeth and bolts repeat by fives, as the planets do
    "stage.gear_mesh.contact_law": "linear",
    "stage.sun.teeth": "20",
    "stage.planet.teeth": "20",
    "stage.ring.teeth": "60",
    "stage.planet.bore_diameter_mm": "200",
    "stage.carrier.fe.pin_diameter_mm": "180",
}
ON_HOUSING = ("carrier_drive", "carrier_far", "output")


def solved(case, bodies, angles=(0.0,)):
    """The stage at rest under next to no torque, all modes kept."""
    system = build_system(case.case, bodies)
    return revolution(modal_system(system), np.array(angles), case.case.inputs[0].torque)


def reactions(equilibrium, sample=0):
    """Force and moment (6,) of the housing on all that it holds, at the origin, fixed axes."""
    recovery, system = Recovery(equilibrium), equilibrium.modal.system
    total, theta = np.zeros(6), float(equilibrium.theta[sample, 0])
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
    return sum(body_mass(body) for body in system.bodies)


def body_mass(body):
    """Mass of one body, kg."""
    nodes = body.node_map[0] if body.rigid else np.tile([1, 0, 0, 0, 0, 0], len(body.node_names))
    moved = np.zeros(body.size)
    moved[: len(nodes)] = nodes
    return float(moved @ body.mass @ moved)
