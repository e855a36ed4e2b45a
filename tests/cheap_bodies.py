"""Ring and carrier of springs and point masses: the coupled system without an FE reduction.

The ring is a closed chain of stiff joints between tooth nodes with bolts hung on it, the carrier
a tree of joints. Both move as rigid bodies without force, as reduced bodies do.
"""

import math

import numpy as np

from flexgear.structures.bodies import rigid_motion
from flexgear.structures.reduced import ReducedBody


def body_of(name, node_names, positions, mass, stiffness):
    """A reduced body without FE mesh and modes."""
    return ReducedBody(
        name=name,
        node_names=node_names,
        positions=positions,
        mass=mass,
        stiffness=stiffness,
        n_modes=0,
        report={},
        points=np.zeros((0, 3)),
        cells=np.zeros((0, 8), dtype=np.int64),
        recovery=np.zeros((0, len(mass)), dtype=np.float32),
    )


class Joints:
    """Joints between points: relative motion at the midpoint, translational and rotational."""

    def __init__(self, positions):
        self.x = np.asarray(positions, dtype=float)
        self.k = np.zeros((6 * len(self.x), 6 * len(self.x)))

    def add(self, i, j, translation, rotation):
        ends, rows = np.array([i, j]), np.tile(np.eye(6), (1, 2))
        for n, arm in enumerate(0.5 * (self.x[i] + self.x[j]) - self.x[ends]):
            rows[:3, 6 * n + 3 : 6 * n + 6] = rigid_motion(arm[None])[0, :, 3:]
        rows[:, 6:] *= -1.0
        dofs = (6 * ends[:, None] + np.arange(6)).ravel()
        springs = np.repeat([translation, rotation], 3)
        self.k[np.ix_(dofs, dofs)] += rows.T @ (springs[:, None] * rows)


def cheap_ring(teeth, radius, bolts=25, bolt_radius=1.0, bolt_z=0.215, stiffness=1.0, fits=()):
    """Tooth nodes at angle 2πj/z, bolts at 2πb/n; every bolt is joined to two nearest teeth.

    fits: z of nodes on the axis, each joined to all teeth.
    """
    a = 2 * np.pi * np.arange(teeth) / teeth
    b = 2 * np.pi * np.arange(bolts) / bolts
    x = np.vstack(
        [
            np.c_[radius * np.cos(a), radius * np.sin(a), 0 * a],
            np.c_[bolt_radius * np.cos(b), bolt_radius * np.sin(b), 0 * b + bolt_z],
            *[[0.0, 0.0, z] for z in fits],
        ]
    )
    joints = Joints(x)
    for i in range(teeth):
        joints.add(i, (i + 1) % teeth, 3e10 * stiffness, 3e8 * stiffness)
    for i in range(bolts):
        place = i * teeth / bolts
        low, share = int(place), place - int(place)
        joints.add(teeth + i, low, (1 - share) * 5e10 * stiffness, 1e9 * (1 - share) * stiffness)
        if share > 0:
            joints.add(
                teeth + i, (low + 1) % teeth, share * 5e10 * stiffness, 1e9 * share * stiffness
            )
    for i in range(len(fits)):
        for tooth in range(teeth):
            joints.add(teeth + bolts + i, tooth, 3e7 * stiffness, 3e6 * stiffness)
    names = (
        *[f"tooth_{i + 1:03d}" for i in range(teeth)],
        *[f"bolt_{i + 1:02d}" for i in range(bolts)],
        *[f"fit_{i + 1}" for i in range(len(fits))],
    )
    mass = np.kron(np.eye(len(x)), np.diag([30.0, 30, 30, 0.3, 0.3, 0.3]))
    return body_of("ring", names, x, mass, joints.k)


def cheap_carrier(planets, radius, drive_z=-0.6, stiffness=1.0):
    """Drive flange, two bearing seats and pins, joined to both seats.

    Under tangential pin forces the pins tilt as much as those of the meshed carrier, 0.13 mrad/MN.
    """
    phi = 2 * math.pi * np.arange(planets) / planets
    side = math.copysign(1.0, drive_z)
    x = np.vstack(
        [
            [0, 0, drive_z],
            [0, 0, side * 0.45],
            [0, 0, -side * 0.45],
            np.c_[radius * np.cos(phi), radius * np.sin(phi), 0 * phi],
        ]
    )
    joints = Joints(x)
    joints.add(0, 1, 5e11 * stiffness, 5e10 * stiffness)
    joints.add(1, 2, 5e10 * stiffness, 5e9 * stiffness)
    for i in range(planets):
        joints.add(3 + i, 1, 5e9 * stiffness, 2.5e8 * stiffness)
        joints.add(3 + i, 2, 2.5e9 * stiffness, 2.5e8 * stiffness)
    names = ("drive", "bearing_drive", "bearing_far", *[f"pin_{i + 1}" for i in range(planets)])
    mass = np.kron(np.eye(len(x)), np.diag([300.0, 300, 300, 30, 30, 30]))
    return body_of("carrier", names, x, mass, joints.k)
