"""Dynamic transmission error: approach of bodies along the line of action of a gear mesh.

    δ = Nᵀ (u_gear(C) − u_planet(C)),   N = cosβ_b n + sinβ_b e_z ,

u being elastic displacement with the wind-up of the train, C the pitch point at the middle of the
face, positive where flanks press. It is the motion of the bodies alone, whatever model the pairs
have and whether they touch: errors and gaps, which the bodies follow, are not added to it. Where
every tooth is a node of an FE body it is the mean of the teeth in mesh, weighted by their loads,
or of all alike while none carries.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.line_loads import teeth_of_pairs
from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array
from flexgear.coupling.pair_data import PairData, action_lines, covered
from flexgear.coupling.system import System


def dynamic_transmission_error(recovery: Recovery) -> Array:
    """δ (t, M) m of all gear meshes; NaN where teeth of FE bodies are nodes and none is in mesh."""
    system = recovery.modal.system
    pairs = system.pairs
    error = recovery.named("pitch_points", lambda: _pitch_point_rows(system)).copy()
    for m in map(int, np.flatnonzero(covered(pairs) == 1)):
        error[:, m] += _of_gear(recovery, m)
    for m in map(int, np.flatnonzero(pairs.planet_turns >= 0)):
        error[:, m] -= _of_planet_teeth(recovery, m)
    return error


def _pitch_point_rows(system: System) -> Array:
    """(M, d): what of δ planets do, and gears whose frames are the planets'."""
    pairs, count = system.pairs, len(system.pairs.s0)
    lines = action_lines(pairs, len(system.blocks) // 6)
    along = (pairs.sin_b * pairs.s_pitch)[:, None]
    rows = lines[0 : 2 * count : 2] + along * lines[1 : 2 * count : 2]
    return np.asarray(rows @ system.blocks)


def _pitch_point(pairs: PairData, m: int) -> tuple[Array, Array]:
    """N and C − planet's axis, (3,) in planet axes."""
    n, s = pairs.normal[m], pairs.s_pitch[m]
    normal = np.array([*(pairs.cos_b[m] * n), pairs.sin_b[m]])
    return normal, np.array([*(pairs.tangent_point[m] - s * n), pairs.z_offset[m]])


def _of_gear(recovery: Recovery, m: int) -> Array:
    """Motion Nᵀ u_gear (t,) m of the gear of gear mesh m along the line of action, where the gear
    turns in planet axes or its teeth are nodes."""
    pairs, theta = recovery.modal.system.pairs, recovery.result.theta
    normal, place = _pitch_point(pairs, m)
    place[0] += pairs.center_distance[m]
    turned = theta[:, pairs.turns[m]] if pairs.turns[m] >= 0 else np.zeros(len(theta))
    n, c = (_turned(v, pairs.phi[m] + turned) for v in (normal, place))
    block = int(pairs.gear_block[m])
    if pairs.per_tooth[m]:
        return _of_teeth(recovery, m, block + recovery.result.pair_tooth[:, m], n, c)
    moment = np.cross(c, n)
    moment[:, 2] = pairs.gear_arm[m]  # the same all along the line of action
    motion = recovery.of_blocks(np.full((len(theta), 1), block))[:, 0]
    return np.einsum("ti,ti->t", np.concatenate([n, moment], axis=1), motion)


def _of_planet_teeth(recovery: Recovery, m: int) -> Array:
    """Nᵀ u (t,) of the elastic displacement of an FE planet's teeth in gear mesh m."""
    pairs, result = recovery.modal.system.pairs, recovery.result
    normal, place = _pitch_point(pairs, m)
    n, c = (_turned(v, -result.theta[:, pairs.planet_turns[m]]) for v in (normal, place))
    theta = result.theta[:, pairs.angle[m], None]
    _, tooth = teeth_of_pairs(pairs, m, result.pair_position[:, m], theta)
    return _of_teeth(recovery, m, pairs.planet_tooth_block[m] + tooth, n, c)


def _of_teeth(
    recovery: Recovery, m: int, blocks: NDArray[Any], normal: Array, place: Array
) -> Array:
    """Mean (t,) of Nᵀ u over the teeth in mesh; blocks (t, slots): of the teeth, normal and place
    (t, 3) in their frame."""
    pairs, result = recovery.modal.system.pairs, recovery.result
    in_contact = result.pair_tooth[:, m] >= 0
    at = np.where(in_contact, blocks, blocks.max(initial=0))
    arm = place[:, None] - pairs.tooth_position[at]
    n = np.broadcast_to(normal[:, None], arm.shape)
    motion = recovery.of_blocks(at)
    along = np.einsum("tsi,tsi->ts", np.concatenate([n, np.cross(arm, n)], axis=2), motion)
    load = np.where(in_contact, np.maximum(result.pair_load[:, m], 0.0), 0.0)
    carries = load.sum(axis=1, keepdims=True) > 0
    weight = np.where(carries, load, in_contact)
    total = weight.sum(axis=1)
    missing = np.full(len(total), np.nan)
    return np.divide((weight * along).sum(axis=1), total, out=missing, where=total > 0)


def _turned(vector: Array, angles: Array) -> Array:
    """A vector (3,) turned about z by angles (t,): (t, 3)."""
    cos, sin, (x, y, z) = np.cos(angles), np.sin(angles), vector
    return np.stack([cos * x - sin * y, sin * x + cos * y, np.full_like(cos, z)], axis=1)
