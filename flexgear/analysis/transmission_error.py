"""Dynamic transmission error: approach of bodies along the line of action of a gear mesh.

    δ = Nᵀ (u_gear(C) − u_planet(C)),   N = cosβ_b n + sinβ_b e_z ,

u the elastic displacement including the wind-up of the train, C the pitch point in the middle of
the face; positive for closing flanks. It is the motion of the bodies alone, for all models of tooth
pairs, with or without contact; errors and gaps are not added. Where every tooth is a node of an FE
body, δ is the mean over the teeth in mesh, weighted by their loads, or with equal weights while
none is loaded.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.line_loads import teeth_of_pairs
from flexgear.analysis.recovery import Recovery
from flexgear.arrays import Array, Ints
from flexgear.coupling.pair_data import PairData, action_lines, covered
from flexgear.coupling.system import System
from flexgear.structures.bodies import rotation


def dynamic_transmission_error(recovery: Recovery, flanks: Ints) -> Array:
    """δ (t, n) of flanks (n,), numbers of gear meshes, m; NaN where FE teeth are nodes and none is
    in mesh."""
    system = recovery.modal.system
    pairs = system.pairs
    error = recovery.named("pitch_points", lambda: _pitch_point_rows(system))[:, flanks]
    by_gear, by_teeth = covered(pairs) == 1, pairs.planet_turns >= 0
    for i, m in enumerate(map(int, flanks)):
        if by_gear[m]:
            error[:, i] += _gear_motion(recovery, m)
        if by_teeth[m]:
            error[:, i] -= _planet_teeth_motion(recovery, m)
    return error


def _pitch_point_rows(system: System) -> Array:
    """Rows (M, d) of δ by planets, and by gears whose frames do not turn against the planets'."""
    pairs, count = system.pairs, len(system.pairs.s0)
    lines = action_lines(pairs, len(system.blocks) // 6)
    along = (pairs.sin_b * pairs.s_pitch)[:, None]
    rows = lines[0 : 2 * count : 2] + along * lines[1 : 2 * count : 2]
    return np.asarray(rows @ system.blocks)


def _pitch_point(pairs: PairData, m: int) -> tuple[Array, Array]:
    """N (3,), and C (3,) m from the planet's axis, both in planet axes."""
    n, s = pairs.normal[m], pairs.s_pitch[m]
    normal = np.array([*(pairs.cos_b[m] * n), pairs.sin_b[m]])
    return normal, np.array([*(pairs.tangent_point[m] - s * n), pairs.z_offset[m]])


def _gear_motion(recovery: Recovery, m: int) -> Array:
    """Nᵀ u_gear (t,), m, of gear mesh m, if its gear turns in planet axes or has tooth nodes."""
    pairs, theta = recovery.modal.system.pairs, recovery.result.theta
    normal, place = _pitch_point(pairs, m)
    place[0] += pairs.center_distance[m]
    angle = theta[:, pairs.turns[m]] if pairs.turns[m] >= 0 else np.zeros(len(theta))
    n, c = (rotation(pairs.phi[m] + angle) @ v for v in (normal, place))
    block = int(pairs.gear_block[m])
    if pairs.per_tooth[m]:
        return _teeth_motion(recovery, m, block + recovery.result.pair_tooth[:, m], n, c)
    moment = np.cross(c, n)
    moment[:, 2] = pairs.gear_arm[m]  # the same all along the line of action
    motion = recovery.of_blocks(np.full((len(theta), 1), block))[:, 0]
    return np.einsum("ti,ti->t", np.concatenate([n, moment], axis=1), motion)


def _planet_teeth_motion(recovery: Recovery, m: int) -> Array:
    """Nᵀ u (t,) by the elastic displacement of an FE planet's teeth in gear mesh m, m."""
    pairs, result = recovery.modal.system.pairs, recovery.result
    normal, place = _pitch_point(pairs, m)
    n, c = (rotation(-result.theta[:, pairs.planet_turns[m]]) @ v for v in (normal, place))
    theta = result.theta[:, pairs.angle[m], None]
    _, tooth = teeth_of_pairs(pairs, m, result.pair_position[:, m], theta)
    return _teeth_motion(recovery, m, pairs.planet_tooth_block[m] + tooth, n, c)


def _teeth_motion(
    recovery: Recovery, m: int, blocks: NDArray[Any], normal: Array, place: Array
) -> Array:
    """Mean (t,) of Nᵀ u over the teeth in mesh, m; blocks (t, slots): of the teeth; normal, place
    (t, 3): N and C in their frame."""
    pairs, result = recovery.modal.system.pairs, recovery.result
    in_contact = result.pair_tooth[:, m] >= 0
    teeth = np.where(in_contact, blocks, blocks.max(initial=0))
    arm = place[:, None] - pairs.tooth_position[teeth]
    n = np.broadcast_to(normal[:, None], arm.shape)
    motion = recovery.of_blocks(teeth)
    along = np.einsum("tsi,tsi->ts", np.concatenate([n, np.cross(arm, n)], axis=2), motion)
    load = np.where(in_contact, np.maximum(result.pair_load[:, m], 0.0), 0.0)
    carries = load.sum(axis=1, keepdims=True) > 0
    weight = np.where(carries, load, in_contact)
    total = weight.sum(axis=1)
    missing = np.full(len(total), np.nan)
    return np.divide((weight * along).sum(axis=1), total, out=missing, where=total > 0)
