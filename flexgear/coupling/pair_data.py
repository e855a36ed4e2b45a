"""Arrays of the gear-mesh elements: constant data of all gear meshes, and the work space of rows.

A *gear mesh* m is one planet against ring or sun (one flank, one half of a double-helical stage).
Blocks are 6-dof nodes. Besides gear meshes, rows are supports that turn against a frame, bearings
with clearance, and forces given from outside. How rows follow from the data: ``pairs``.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLOTS = 4  # most pairs of one gear mesh that are in contact at once; checked when data are built
KINDS = ("ring", "sun", "ring_back", "sun_back")
PER_PAIR, SUMMED, WAVE = 0, 1, 2  # models of a gear mesh
SUPPORT, CLEARANCE, LOAD = -1, -2, -3  # kinds of rows that are not gear meshes


class PairData(NamedTuple):
    """Constant data; first index m is the gear mesh. Angles θ come as a vector (A,)."""

    one_sided: bool  # any gear mesh is
    sided: IntArray  # (M,) 1 where pairs can only push
    model: IntArray  # (M,) PER_PAIR, SUMMED or WAVE
    kind: IntArray  # (M,) index into KINDS
    front: IntArray  # (M,) 1 for the flank that carries the rated torque
    back: IntArray  # (M,) gear mesh of the opposite flank, −1 none
    angle: IntArray  # (M,) which angle is the stage's θ
    turns: IntArray  # (M,) angle by which the gear's frame lags the planet's, −1: same frame
    phi: Array  # (M,) planet angle in the stage's frame, rad
    radial: Array  # (M, 2) its cosine and sine
    center_distance: Array  # (M,) m
    planet_block: IntArray  # (M,)
    gear_block: IntArray  # (M,) block of the gear, or of its tooth 0
    per_tooth: IntArray  # (M,) 1 where every tooth of the gear is a block
    tooth_position: Array  # (B, 3) by block, used where teeth are blocks, m
    s0: Array  # (M,) m
    rate: Array  # (M,) m/rad
    pitch: Array  # (M,) transverse base pitch, m
    s_lo: Array  # (M,)
    s_hi: Array  # (M,)
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
    table: IntArray  # (M,) which table
    table_start: Array  # (K,)
    table_step: Array  # (K,)
    k_table: Array  # (K, T) N/m over the path, or over one base pitch from s_lo on (WAVE)
    z_table: Array  # (K, T) m
    gear_tooth0: IntArray  # (M,)
    gear_step: IntArray  # (M,)
    gear_teeth: IntArray  # (M,)
    planet_tooth0: IntArray  # (M,)
    planet_step: IntArray  # (M,)
    planet_teeth: IntArray  # (M,)
    error_amplitude: Array  # (M,) m
    error_phase: Array  # (M,) rad
    error_offset: Array  # (M,) m
    error_gear: Array  # (M, z) m
    error_planet: Array  # (M, z_p) m
    runout_amplitude: Array  # (M, H) m: Σ A sin(rate · θ_angle + phase)
    runout_rate: Array  # (M, H)
    runout_phase: Array  # (M, H) rad
    runout_angle: IntArray  # (M, H)
    largest_error: Array  # (M,) m, largest sum of errors of a pair
    damping: Array  # (M,) 2 ζ √m_eq, so that c = damping √k
    support_block: IntArray  # (n_s, 2) blocks of a turning support row, −1 none
    support_vector: Array  # (n_s, 2, 6) fixed-frame vectors
    support_stiffness: Array  # (n_s,) N/m, of either sign
    support_angle: IntArray  # (n_s, 2) angle by which the block's frame has turned, −1: fixed
    clearance_block: IntArray  # (n_c, 2) inner and outer block of a bearing, −1: housing
    clearance_turn: Array  # (n_c, 2) constant angle from the row's axes to the block's, rad
    clearance_stiffness: Array  # (n_c,) N/m
    clearance_gap: Array  # (n_c,) radial, m
    load_block: IntArray  # (n_l,)
    load_vector: Array  # (n_l, 6) N, N·m
    load_angle: IntArray  # (n_l,) frame that turns against the load's, −1: same frame


class PairRows(NamedTuple):
    """Work space: rows (contact equations) and pairs (tooth pairs that share a row)."""

    kind: IntArray  # (R,) of gear meshes ≥ 0, or SUPPORT, CLEARANCE, LOAD
    owner: IntArray  # (R,) gear mesh m, or number among supports, then clearances, then loads
    sided: IntArray  # (R,) 1 where a row can only push
    stiffness: Array
    damping: Array
    offset: Array  # e − gap, m; the force itself, N, where kind is LOAD
    blocks: IntArray  # (R, B)
    width: IntArray  # blocks of a row
    line: IntArray  # gear mesh whose line of action holds the first blocks, −1 none
    along: Array  # ζ on this line, m
    beyond: IntArray  # first block that the line does not hold
    reach: IntArray  # local blocks of this row and later ones
    coef: Array  # (R, B, 6)
    pair_row: IntArray  # (P,)
    pair_mesh: IntArray  # (P,) gear mesh m
    pair_slot: IntArray
    pair_tooth: IntArray
    pair_planet_tooth: IntArray
    pair_stiffness: Array
    pair_share: Array
    pair_s: Array
    pair_z: Array
    pair_index: IntArray
    pair_error: Array
    direction: Array  # (n_c, 3) unit vector of a clearance bearing's displacement, 1 − gap/|u|


def extra_rows(data: PairData) -> int:
    """Rows that are not gear meshes: turning supports, clearances, loads."""
    return len(data.support_stiffness) + 2 * len(data.clearance_stiffness) + len(data.load_block)


def pair_rows(data: PairData) -> PairRows:
    """Empty work space for ``data``."""
    pairs = max(1, len(data.s0) * SLOTS)
    rows = pairs + extra_rows(data)
    width = SLOTS + 1

    def ints(*shape: int) -> IntArray:
        return np.zeros(shape, dtype=np.int64)

    def reals(*shape: int) -> Array:
        return np.zeros(shape)

    direction = reals(len(data.clearance_stiffness), 3)
    direction[:, 0], direction[:, 2] = 1.0, 1.0
    return PairRows(
        kind=ints(rows),
        owner=ints(rows),
        sided=ints(rows),
        stiffness=reals(rows),
        damping=reals(rows),
        offset=reals(rows),
        blocks=ints(rows, width),
        width=ints(rows),
        line=ints(rows),
        along=reals(rows),
        beyond=ints(rows),
        reach=ints(rows),
        coef=reals(rows, width, 6),
        pair_row=ints(pairs),
        pair_mesh=ints(pairs),
        pair_slot=ints(pairs),
        pair_tooth=ints(pairs),
        pair_planet_tooth=ints(pairs),
        pair_stiffness=reals(pairs),
        pair_share=reals(pairs),
        pair_s=reals(pairs),
        pair_z=reals(pairs),
        pair_index=ints(pairs),
        pair_error=reals(pairs),
        direction=direction,
    )


def front_meshes(data: PairData) -> IntArray:
    """(M,) 1 where a gear mesh is to be looked at when the rated torque acts."""
    return data.front.copy()


def by_kind(values: NDArray[Any], planets: int, axis: int = 1) -> NDArray[Any]:
    """Split the axis M of gear meshes of a single stage: (…, M, …) -> (…, kinds, planets, …)."""
    shape = values.shape
    return values.reshape(*shape[:axis], shape[axis] // planets, planets, *shape[axis + 1 :])
