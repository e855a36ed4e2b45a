r"""Lines of action: contact vectors that do not change while the contact moves along the flank.

The force of a tooth pair keeps its direction N in planet axes, and moving it along N changes no
moment. What is left of the position C = T_p − s n + z e_z, s = path coordinate + slope z, is one
number,

    ζ = sinβ_b s + cosβ_b z,   [N; C × N] = w₀ + ζ w₁,

w₁ being a couple about n, and the same holds at a gear whose frame is the planet's. So one gear
mesh moves its bodies along two constant vectors however many pairs are in contact, and
receptances between such vectors are constants: a time step needs two channels a gear mesh instead
of six a body. A third one, the approach along the line of centres, tells how far the coast flank
is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.pair_data import PairData
from flexgear.structures.kinematics import rotation

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


def covered(pairs: PairData) -> IntArray:
    """(M,) how many of the first blocks of a row its line holds: 1 the planet, 2 the gear too."""
    return np.where((pairs.per_tooth == 0) & (pairs.turns < 0), 2, 1).astype(np.int64)


def action_lines(pairs: PairData, blocks: int) -> Array:
    """(3 M, 6 blocks): w₀ and w₁ of gear mesh m at 2m and 2m + 1, its approach at 2 M + m.

    Rows of pairs are then w₀ + ζ w₁ on the blocks that `covered` counts.
    """
    count = len(pairs.s0)
    out = np.zeros((3 * count, 6 * blocks))
    both = covered(pairs) == 2
    for m in range(count):
        n0, n1 = pairs.normal[m]
        cos_b, sin_b = pairs.cos_b[m], pairs.sin_b[m]
        tx, ty = pairs.tangent_point[m]
        z = pairs.z_offset[m]
        force = np.array([cos_b * n0, cos_b * n1, sin_b])
        couple = np.array([-n1, n0])
        planet = slice(6 * pairs.planet_block[m], 6 * pairs.planet_block[m] + 6)
        moment = np.array([sin_b * ty - z * cos_b * n1, z * cos_b * n0 - sin_b * tx])
        out[2 * m, planet] = -np.concatenate([force, moment, [pairs.planet_arm[m]]])
        out[2 * m + 1, planet][3:5] = -couple
        out[2 * count + m, planet.start] = -cos_b * n0
        if not both[m]:
            continue
        gear = slice(6 * pairs.gear_block[m], 6 * pairs.gear_block[m] + 6)
        moment[1] -= sin_b * pairs.center_distance[m]
        turn = rotation(pairs.phi[m])[:2, :2]
        force[:2] = turn @ force[:2]
        out[2 * m, gear] = np.concatenate([force, turn @ moment, [pairs.gear_arm[m]]])
        out[2 * m + 1, gear][3:5] = turn @ couple
        out[2 * count + m, gear][:2] = cos_b * n0 * turn[:, 0]
    return out
