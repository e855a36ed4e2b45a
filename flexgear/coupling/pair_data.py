"""Constant data of all force elements, column by column as studies read and change it.

A *gear mesh* m is one planet against ring or sun (one flank, one half of a double-helical stage).
Blocks are 6-dof nodes. Besides gear meshes there are supports that turn against a frame, bearings
with a law of their own (``laws``), and forces given from outside. Compiled loops read the same data
as records (``kernels.elements``); how rows follow from them: ``kernels.pairs``.

Lines of action: contact vectors that do not change while the contact moves along the flank.

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

from typing import NamedTuple

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.coupling.laws import LAWS
from flexgear.gears.contact import GearMeshKind
from flexgear.structures.bodies import rotation

FEWEST_SLOTS = 4  # so that datasets of usual gears have one form
KINDS = tuple(GearMeshKind)
PER_PAIR, SUMMED, WAVE, FACE_LOAD = range(4)  # models of a gear mesh
FOLLOWING = 4  # rows of the next two pairs, which yield to those of a pair
OF_LINE = 2 + 2 * FOLLOWING  # columns of a table of slices that are of the whole line
SUPPORT, BEARING, LOAD = -1, -2, -3  # kinds of rows that are not gear meshes


class PairData(NamedTuple):
    """Constant data; first index m is the gear mesh. Angles θ come as a vector (A,)."""

    one_sided: bool  # any gear mesh is
    slots: int  # most tooth pairs of one gear mesh that are in contact at once, or more
    sided: Ints  # (M,) 1 where pairs can only push
    model: Ints  # (M,) PER_PAIR, SUMMED, WAVE or FACE_LOAD
    kind: Ints  # (M,) index into KINDS
    carries: Ints  # (M,) 1 for the flank that carries the rated torque
    opposite: Ints  # (M,) gear mesh of the opposite flank, −1 none
    angle: Ints  # (M,) which angle is the stage's θ
    turns: Ints  # (M,) angle by which the gear's frame lags the planet's, −1: same frame
    phi: Array  # (M,) planet angle in the stage's frame, rad
    radial: Array  # (M, 2) its cosine and sine
    center_distance: Array  # (M,) m
    planet_block: Ints  # (M,)
    gear_block: Ints  # (M,) block of the gear, or of its tooth 0
    per_tooth: Ints  # (M,) 1 where every tooth of the gear is a block
    planet_tooth_block: Ints  # (M,) block of the planet's tooth 0 where every tooth of it is
    # one, which then holds its elastic displacement; −1: none is
    planet_turns: Ints  # (M,) angle by which the teeth's frame has turned in the planet's axes
    tooth_position: Array  # (B, 3) by block, used where teeth are blocks, m
    s0: Array  # (M,) m
    rate: Array  # (M,) m/rad
    pitch: Array  # (M,) transverse base pitch, m
    s_lo: Array  # (M,) path coordinates between which a point of a contact line may touch, m
    s_hi: Array  # (M,)
    path_lo: Array  # (M,) ends of the path of contact, m
    path_hi: Array  # (M,)
    slope: Array  # (M,) t = ds/dz
    half_face: Array  # (M,)
    z_offset: Array  # (M,) mid-plane of the gear mesh, m
    normal: Array  # (M, 2)
    tangent_point: Array  # (M, 2) m
    planet_arm: Array  # (M,) moment of N about the planet's axis, m
    gear_arm: Array  # (M,) moment of N about the gear's axis, m
    cos_b: Array  # (M,)
    sin_b: Array  # (M,)
    s_pitch: Array  # (M,) path coordinate of the pitch point, m
    gap: Array  # (M,) m
    table: Ints  # (M,) which table
    gear_table: Ints  # (M, z) what a tooth adds to it: 0, or where a faulty tooth has its own
    planet_table: Ints  # (M, z_p) likewise; both add up where two faulty teeth meet
    table_start: Array  # (K,)
    table_step: Array  # (K,)
    k_table: Array  # (K, T) N/m over the path, or over one base pitch from s_lo on (WAVE)
    z_table: Array  # (K, T) m
    gap_table: Array  # (K, T) gap of modified flanks along the 3D normal, m
    slice_table: Array  # (K, T, OF_LINE + 3 n) of contact lines in slices: radius of gyration m,
    # whole stiffness N/m, B of both rows and those of the next two lines (8) m/N, then z m of all,
    # stiffness N/m and gap m, and where they bend each other what ``laws.coupled_slices`` takes
    # besides; of modified flanks then ``narrowing_columns``; n: of the set; 0 wide where no pair
    # has slices
    gear_tooth0: Ints  # (M,)
    gear_step: Ints  # (M,)
    gear_teeth: Ints  # (M,)
    planet_tooth0: Ints  # (M,)
    planet_step: Ints  # (M,)
    planet_teeth: Ints  # (M,)
    slices: Ints  # (M,) of a contact line; 0 where a pair is one spring
    bent: Ints  # (M,) 1 where slices bend each other
    error_amplitude: Array  # (M,) m
    error_phase: Array  # (M,) rad
    error_offset: Array  # (M,) m
    error_slope: Array  # (M,) m/m, along the face from its middle
    error_gear: Array  # (M, z) m
    error_planet: Array  # (M, z_p) m
    runout_amplitude: Array  # (M, H) m: Σ A sin(rate · θ_angle + phase)
    runout_rate: Array  # (M, H)
    runout_phase: Array  # (M, H) rad
    runout_angle: Ints  # (M, H)
    largest_error: Array  # (M,) m, largest sum of errors of a pair
    damping: Array  # (M,) 2 ζ √m_eq, so that c = damping √k; 0 where the damper is constant
    constant_damping: Array  # (M,) N s/m of all pairs of a gear mesh at once, whether they touch or
    # not; 0 where damping acts in contact only, and of flanks that do not carry
    support_block: Ints  # (n_s, 2) blocks of the row of a rotating-frame support, −1 none
    support_vector: Array  # (n_s, 2, 6) fixed-frame vectors
    support_stiffness: Array  # (n_s,) N/m, of either sign
    support_angle: Ints  # (n_s, 2) angle by which the block's frame has turned, −1: fixed
    bearing_law: Ints  # (n_b,) index into ``laws.LAWS``
    bearing_block: Ints  # (n_b, 2) inner and outer block of a bearing, −1: housing
    bearing_angle: Ints  # (n_b, 2) angle by which the block's frame has turned, −1: none
    bearing_parameters: Array  # (n_b,) arrays, each as long as its law has values
    bearing_turned: Ints  # (n_b,) angle that is one of these, −1 none
    load_block: Ints  # (n_l,)
    load_vector: Array  # (n_l, 6) N, N·m
    load_angle: Ints  # (n_l,) frame that turns against the load's, −1: same frame
    load_grows: Ints  # (n_l,) 1: with the square of speed, and given at rated speed
    load_size: Array  # (n_l,) by which the vector is multiplied; at t = 0 of a load history
    load_history: Ints  # (n_l,) place among the load histories, −1: constant


def largest_errors(data: PairData) -> Array:
    """Largest sum (M,) of errors of a pair, m."""
    largest = data.error_offset + np.abs(data.error_amplitude)
    largest = largest + np.abs(data.error_slope) * data.half_face
    largest += np.abs(data.runout_amplitude).sum(axis=1)
    return largest + np.abs(data.error_gear).max(axis=1) + np.abs(data.error_planet).max(axis=1)


def rows_of_pair(data: PairData) -> int:
    """Most rows that a tooth pair has: two where its contact line is cut into slices."""
    return 2 if np.any(data.model == FACE_LOAD) else 1


def two_rows(data: PairData, count: int) -> tuple[int, int, int]:
    """Shape (count, M, slots) of what pairs with two rows store, without length where none has."""
    return count, len(data.s0) if rows_of_pair(data) == 2 else 0, data.slots


def gap_columns(count: int) -> slice:
    """Columns of a table of slices that are their gaps; count: of a line."""
    return slice(OF_LINE + 2 * count, OF_LINE + 3 * count)


def slice_gaps(data: PairData) -> Array:
    """Gap of each slice, m: (tables K, path positions T, slices n); 0 beyond the slices that a
    table has."""
    gaps = np.zeros((*data.slice_table.shape[:2], int(data.slices.max(initial=0))))
    for table, count in set(zip(data.table.tolist(), data.slices.tolist(), strict=True)):
        gaps[table, :, :count] = data.slice_table[table, :, gap_columns(count)]
    return gaps


def deepest_gap(data: PairData) -> Array:
    """Largest gap (M,) of a slice, m; 0 where pairs have none."""
    return slice_gaps(data)[data.table].max(axis=(1, 2), initial=0.0)


def narrowing_columns(data: PairData, m: int) -> slice:
    """Columns of a table of slices that are half widths of contacts over those of Hertz's at the
    mean line load, of gear mesh m; zeros, or none, where its flanks are involutes."""
    count = int(data.slices[m])
    first = OF_LINE + 3 * count + int(data.bent[m]) * (2 * count + count * (count + 1) // 2)
    return slice(first, first + count)


def extra_rows(data: PairData) -> int:
    """Rows that are not gear meshes: turning supports, bearings, loads."""
    bearings = sum(len(LAWS[law].components) for law in data.bearing_law)
    return len(data.support_stiffness) + bearings + len(data.load_block)


def first_sizes(data: PairData) -> Array:
    """Values of the load histories (L,) at t = 0."""
    out = np.zeros(int(data.load_history.max(initial=-1)) + 1)
    varies = data.load_history >= 0
    out[data.load_history[varies]] = data.load_size[varies]
    return out


def carrying_flanks(data: PairData) -> Ints:
    """(M,) 1 where a gear mesh is to be looked at when the rated torque acts."""
    return data.carries.copy()


def covered(pairs: PairData) -> Ints:
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
