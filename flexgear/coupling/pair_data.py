"""Constant data of all force elements in columns, and constant contact vectors of gear meshes.

A *gear mesh* m is one planet with ring or sun (one flank, one half of a double-helical stage).
Blocks are 6-dof nodes. Other elements are rotating supports, nonlinear bearings (``laws``) and
given forces. Compiled loops use the same data as records (``kernels.elements``); ``kernels.pairs``
builds the rows.

Lines of action: the force of a tooth pair has a constant direction N in planet axes, and moving it
along N changes no moment. The position C = T_p − s n + z e_z, s = path coordinate + slope z, enters
by one number only,

    ζ = sinβ_b s + cosβ_b z,   [N; C × N] = w₀ + ζ w₁,

w₁ being a couple about n; the same holds at a gear whose frame is that of the planet. So a gear
mesh acts along two constant vectors for any number of pairs, and receptances between such vectors
are constant: a time step needs two channels for each gear mesh instead of six for each body. A
third vector, the approach along the line of centres, gives the distance of the coast flank.
"""

from typing import NamedTuple, Self

import numpy as np

from flexgear.arrays import Array, Ints
from flexgear.coupling.laws import LAWS
from flexgear.gears.contact import GearMeshKind
from flexgear.structures.bodies import rotation

LEAST_SLOTS = 4  # so that datasets of usual gears have the same shape
KINDS = tuple(GearMeshKind)
PER_PAIR, SUMMED, WAVE, FACE_LOAD = range(4)  # models of a gear mesh
FOLLOWING = 4  # rows of the next two pairs, coupled to those of a pair
LINE_COLUMNS = 2 + 2 * FOLLOWING  # first columns of a table of slices, of the whole line
SUPPORT, BEARING, LOAD = -1, -2, -3  # kinds of rows that are not gear meshes


class PairData(NamedTuple):
    """Constant data; first index m is the gear mesh. Angles θ come as a vector (A,)."""

    one_sided: bool  # whether contact of any gear mesh is one-sided
    slots: int  # upper bound of the tooth pairs of a gear mesh in contact at once
    sided: Ints  # (M,) 1 for one-sided contact
    model: Ints  # (M,) PER_PAIR, SUMMED, WAVE or FACE_LOAD
    kind: Ints  # (M,) index into KINDS
    carries: Ints  # (M,) 1 for the flank that carries the rated torque
    opposite: Ints  # (M,) gear mesh of the opposite flank, −1 none
    angle: Ints  # (M,) index of the stage angle θ
    turns: Ints  # (M,) index of the angle by which the gear's frame lags the planet's, −1: none
    phi: Array  # (M,) planet angle in the stage's frame, rad
    radial: Array  # (M, 2) its cosine and sine
    center_distance: Array  # (M,) m
    planet_block: Ints  # (M,)
    gear_block: Ints  # (M,) block of the gear, or of its tooth 0
    per_tooth: Ints  # (M,) 1 if every tooth of the gear is a block
    planet_tooth_block: Ints  # (M,) block of the planet's tooth 0 if its teeth are blocks with
    # elastic displacement, else −1
    planet_turns: Ints  # (M,) index of the angle of the planet's teeth in planet axes, −1: none
    tooth_position: Array  # (B, 3) of blocks that are teeth, m
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
    table: Ints  # (M,) index of the table of sound teeth
    gear_table: Ints  # (M, z) added to the index for a tooth of the gear, 0 for sound teeth
    planet_table: Ints  # (M, z_p) added to the index for a tooth of the planet
    table_start: Array  # (K,)
    table_step: Array  # (K,)
    k_table: Array  # (K, T) N/m over the path, or over a base pitch that starts at s_lo (WAVE)
    z_table: Array  # (K, T) m
    gap_table: Array  # (K, T) gap of modified flanks along the 3D normal, m
    slice_table: Array  # (K, T, …) of contact lines: radius of gyration m, stiffness of the line
    # N/m, flexibility B between both rows and those of the next two lines (8) m/N, then of all n
    # slices z m, stiffness N/m and gap m; for coupled slices a m/N, d N and the lower triangle of C
    # m/N (``laws.coupled_slices``); for modified flanks ``narrowing_columns``. (K, T, 0) if no pair
    # has slices
    gear_tooth0: Ints  # (M,)
    gear_step: Ints  # (M,)
    gear_teeth: Ints  # (M,)
    planet_tooth0: Ints  # (M,)
    planet_step: Ints  # (M,)
    planet_teeth: Ints  # (M,)
    slices: Ints  # (M,) number of slices of a contact line; 0 for pairs as one spring
    coupled: Ints  # (M,) 1 for slices coupled by FE influences
    error_amplitude: Array  # (M, L) m: Σ A_l sin(2π l s/p_b + phase), l = 1 … L
    error_phase: Array  # (M, L) rad
    error_offset: Array  # (M,) m
    error_slope: Array  # (M,) m/m, along the face from its middle
    error_gear: Array  # (M, z) m
    error_planet: Array  # (M, z_p) m
    runout_amplitude: Array  # (M, H) m: Σ A sin(rate · θ_angle + phase)
    runout_rate: Array  # (M, H)
    runout_phase: Array  # (M, H) rad
    runout_angle: Ints  # (M, H)
    largest_error: Array  # (M,) m, largest sum of errors of a pair
    damping: Array  # (M,) 2 ζ √m_eq, so that c = damping √k; 0 for a constant damper
    constant_damping: Array  # (M,) N s/m of all pairs of a gear mesh together, also out of contact;
    # 0 if damping acts in contact only, and for flanks that do not carry
    support_block: Ints  # (n_s, 2) blocks of the row of a rotating support, −1 none
    support_vector: Array  # (n_s, 2, 6) in fixed axes
    support_stiffness: Array  # (n_s,) N/m, of either sign
    support_angle: Ints  # (n_s, 2) index of the angle of the block's frame, −1: fixed
    bearing_law: Ints  # (n_b,) index into ``laws.LAWS``
    bearing_block: Ints  # (n_b, 2) blocks of inner and outer ring, −1: housing
    bearing_angle: Ints  # (n_b, 2) index of the angle of the block's frame, −1: none
    bearing_parameters: Array  # (n_b,) array of the parameters of the law
    bearing_turned: Ints  # (n_b,) index of the angle that is a parameter, −1 none
    load_block: Ints  # (n_l,)
    load_vector: Array  # (n_l, 6) N, N·m
    load_angle: Ints  # (n_l,) angle of the block's frame relative to that of the load, −1: none
    load_grows: Ints  # (n_l,) 1: given at rated speed, proportional to speed squared
    load_size: Array  # (n_l,) factor on the vector; of a load history its value at t = 0
    load_history: Ints  # (n_l,) index of the load history, −1: constant

    @property
    def sound(self) -> Self:
        """The data with sound teeth in the place of faulty ones."""
        sound = {
            name: np.zeros_like(getattr(self, name)) for name in ("gear_table", "planet_table")
        }
        return self._replace(**sound)


def largest_errors(data: PairData) -> Array:
    """Upper bound (M,) of the sum of errors of a pair, m."""
    largest = data.error_offset + np.abs(data.error_amplitude).sum(axis=1)
    largest = largest + np.abs(data.error_slope) * data.half_face
    largest += np.abs(data.runout_amplitude).sum(axis=1)
    return largest + np.abs(data.error_gear).max(axis=1) + np.abs(data.error_planet).max(axis=1)


def rows_of_pair(data: PairData) -> int:
    """Largest number of rows of a tooth pair: two for pairs with slices, else one."""
    return 2 if np.any(data.model == FACE_LOAD) else 1


def two_rows(data: PairData, count: int) -> tuple[int, int, int]:
    """Shape (count, M, slots) of arrays for pairs with two rows, with M = 0 if there are none."""
    return count, len(data.s0) if rows_of_pair(data) == 2 else 0, data.slots


def gap_columns(count: int) -> slice:
    """Columns of gaps in a table of slices; count: slices of a line."""
    return slice(LINE_COLUMNS + 2 * count, LINE_COLUMNS + 3 * count)


def slice_gaps(data: PairData) -> Array:
    """Gaps (K, T, n) of slices by table and path coordinate, m; 0 beyond the slices of a table."""
    gaps = np.zeros((*data.slice_table.shape[:2], int(data.slices.max(initial=0))))
    for table, count in set(zip(data.table.tolist(), data.slices.tolist(), strict=True)):
        gaps[table, :, :count] = data.slice_table[table, :, gap_columns(count)]
    return gaps


def deepest_gap(data: PairData) -> Array:
    """Largest gap (M,) of a slice, m; 0 for pairs without slices."""
    return slice_gaps(data)[data.table].max(axis=(1, 2), initial=0.0)


def narrowing_columns(data: PairData, m: int) -> slice:
    """Columns of a table of slices with the half width of contacts over that of Hertz at the mean
    line load, for gear mesh m; zero or empty for involutes."""
    count = int(data.slices[m])
    first = LINE_COLUMNS + 3 * count + int(data.coupled[m]) * (2 * count + count * (count + 1) // 2)
    return slice(first, first + count)


def extra_rows(data: PairData) -> int:
    """Number of rows of rotating supports, bearings and loads."""
    bearings = sum(len(LAWS[law].components) for law in data.bearing_law)
    return len(data.support_stiffness) + bearings + len(data.load_block)


def first_sizes(data: PairData) -> Array:
    """Values of the load histories (L,) at t = 0."""
    out = np.zeros(int(data.load_history.max(initial=-1)) + 1)
    varies = data.load_history >= 0
    out[data.load_history[varies]] = data.load_size[varies]
    return out


def carrying_flanks(data: PairData) -> Ints:
    """Flags (M,): 1 for the flanks that carry the rated torque."""
    return data.carries.copy()


def covered(pairs: PairData) -> Ints:
    """Number (M,) of leading blocks of a row on its line of action: 1 planet, 2 planet and gear."""
    return np.where((pairs.per_tooth == 0) & (pairs.turns < 0), 2, 1).astype(np.int64)


def action_lines(pairs: PairData, blocks: int) -> Array:
    """Contact vectors (3 M, 6 blocks): w₀ and w₁ of gear mesh m in rows 2m and 2m + 1, approach in
    row 2 M + m. Rows of pairs are w₀ + ζ w₁ on the blocks of ``covered``."""
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
