"""Force elements for compiled loops: constant records, and work arrays of rows and elements.

The records have the data of ``PairData``: one for each gear mesh, runout and permanent row. A few
contiguous arrays are fast to pass and to compile for; fifty are not.

Forces on tooth pairs also deflect neighbouring pairs of a gear mesh. For coupled slices the
compression of a row is δ = Vᵀu + e − Σ B F', F' being the forces of the two pairs before and the
two after: a linear massless flexibility between rows, B from ``gears.slices``, which rows store in
``yields``.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array, Ints
from flexgear.compiled import INNER, njit
from flexgear.coupling.laws import (
    COUPLED_SLICES_LAW,
    GIVEN_FORCE_LAW,
    LAWS,
    LINEAR_LAW,
    SLICES_LAW,
    functions,
)
from flexgear.coupling.laws.slices import FIRST
from flexgear.coupling.pair_data import (
    BEARING,
    FACE_LOAD,
    FOLLOWING,
    LINE_COLUMNS,
    LOAD,
    SUPPORT,
    PairData,
    extra_rows,
    rows_of_pair,
)

Records = Any  # structured array with fields that numba reads by name

RATE_PARAMETERS = 5  # of the law of machines at ports


def _record(ints: str, reals: str) -> np.dtype[Any]:
    """Data type of records with integer and real fields of these names."""
    return np.dtype([(n, np.int64) for n in ints.split()] + [(n, float) for n in reals.split()])


GEAR_MESH = _record(
    "sided model kind carries opposite angle turns planet_block gear_block per_tooth "
    "planet_tooth_block planet_turns table "
    "gear_tooth0 gear_step gear_teeth planet_tooth0 planet_step planet_teeth slices coupled slots "
    "places",
    "phi center_distance s0 rate pitch s_lo s_hi slope half_face z_offset planet_arm gear_arm "
    "cos_b sin_b s_pitch gap error_offset error_slope largest_error "
    "damping constant_damping radial_x radial_y normal_x normal_y tangent_x tangent_y "
    "table_start table_step",
)
RUNOUT = _record("angle", "amplitude rate phase")
HARMONIC = _record("", "amplitude phase")
FIXED_ROW = _record("kind owner", "stiffness")
FIXED_END = _record("block angle", "")
FIXED_ELEMENT = _record("law first rows grows history angle turned", "")

ROW = _record(
    "kind owner sided width line beyond after following dof since parts",
    "along stiffness damping offset",
)
PAIR = _record(
    "row rows gear_mesh slot tooth planet_tooth place table", "stiffness share s z error"
)
ELEMENT = _record("law first rows place", "")


class GearMeshes(NamedTuple):
    """Gear meshes with tables over their paths; see ``PairData``."""

    gear_mesh: Records  # (M,) GEAR_MESH: columns of PairData, m, rad, N/m
    table: Array  # (K, T, 3) stiffness N/m, centroid z m and gap m over the path
    slices: Array  # (K, T, …) of contact lines in slices: see ``PairData.slice_table``
    gear_error: Array  # (M, z) m
    planet_error: Array  # (M, z_p) m
    gear_table: Ints  # (M, z) added to the index of the table for a tooth
    planet_table: Ints  # (M, z_p)
    runout: Records  # (M, H) RUNOUT: Σ A sin(rate · θ_angle + phase)
    harmonic: Records  # (M, L) HARMONIC: Σ A_l sin(2π l s/p_b + phase), l = 1 … L
    tooth_position: Array  # (B, 3) m, by block


class FixedRows(NamedTuple):
    """Permanent rows and their elements: bearings, given forces, rotating supports."""

    row: Records  # (F,) FIXED_ROW
    end: Records  # (F, 2) FIXED_END: block, −1 none; index of the angle of its frame, −1 none
    vector: Array  # (F, 2, 6) of an end, in axes that do not rotate with its frame
    # (E,) FIXED_ELEMENT; grows: 1 if proportional to speed squared; history: index of the load
    # history, −1 constant; angle: index of the angle that is parameter ``turned``, −1 none
    element: Records
    parameters: Array  # (E, p) of their laws


class Elements(NamedTuple):
    """All force elements."""

    gears: GearMeshes
    fixed: FixedRows


class Rows(NamedTuple):
    """Work arrays of one evaluation: rows, tooth pairs of these rows, and elements."""

    # (R,) ROW: kind: of a gear mesh ≥ 0, SUPPORT, BEARING or LOAD; owner: gear mesh, or index among
    # the other rows; sided: 1 for one-sided contact; width: number of blocks; line: gear mesh on
    # whose line of action the first blocks are, −1 none; beyond: first block that is not on it;
    # along: ζ on this line, m; stiffness: N/m, nominal for a nonlinear bearing; damping: N s/m;
    # offset: error − gap, m; after: first row of the next pair; following: number of rows from
    # there on that are coupled to this one; dof: first active dof of its line, or of the port of a
    # machine, −1 none; since: first active dof behind lines and ports on which this or a later row
    # acts; parts: bits of the parts of the train with its blocks (``analysis.kernels.active_dofs``)
    row: Records
    yields: Array  # (R, FOLLOWING) B of a row and the rows that follow, m/N
    blocks: Ints  # (R, B)
    place: NDArray[np.uint64]  # (R, B) first active dof of a block beyond
    coef: Array  # (R, B, 6)
    pair: Records  # (P,) PAIR: first row, number of rows, share of their load, s and z on its path
    element: Records  # (E,) ELEMENT: law, first row, rows, place of its data stored between steps
    parameters: Array  # (E, p) of the laws


def packed(data: PairData) -> Elements:
    """Records with copies of ``data``."""
    gear_mesh = np.zeros(len(data.s0), dtype=GEAR_MESH)
    for name in set(GEAR_MESH.names or ()) & set(data._fields):
        column = getattr(data, name)
        gear_mesh[name] = column[data.table] if name.startswith("table_") else column
    for i, axis in enumerate("xy"):
        gear_mesh[f"radial_{axis}"] = data.radial[:, i]
        gear_mesh[f"normal_{axis}"] = data.normal[:, i]
        gear_mesh[f"tangent_{axis}"] = data.tangent_point[:, i]
    gear_mesh["slots"], gear_mesh["places"] = data.slots, places_of_gear_mesh(data)
    runout = np.zeros(data.runout_amplitude.shape, dtype=RUNOUT)
    for name in RUNOUT.names or ():
        runout[name] = getattr(data, f"runout_{name}")
    harmonic = np.zeros(data.error_amplitude.shape, dtype=HARMONIC)
    harmonic["amplitude"], harmonic["phase"] = data.error_amplitude, data.error_phase
    gears = GearMeshes(
        gear_mesh=gear_mesh,
        table=np.ascontiguousarray(np.stack([data.k_table, data.z_table, data.gap_table], axis=-1)),
        slices=np.ascontiguousarray(data.slice_table),
        gear_error=np.ascontiguousarray(data.error_gear),
        planet_error=np.ascontiguousarray(data.error_planet),
        gear_table=np.ascontiguousarray(data.gear_table),
        planet_table=np.ascontiguousarray(data.planet_table),
        runout=runout,
        harmonic=harmonic,
        tooth_position=np.ascontiguousarray(data.tooth_position),
    )
    return Elements(gears, _fixed_rows(data))


def _fixed_rows(data: PairData) -> FixedRows:
    """Rows of bearings, given forces and rotating supports, in this order; ``owner``
    counts from the supports on, like stored loads."""
    count, supports = extra_rows(data), len(data.support_stiffness)
    forces, springs = len(data.load_block), slice(count - supports, count)
    loads = slice(springs.start - forces, springs.start)
    row, end = np.zeros(count, dtype=FIXED_ROW), np.full((count, 2), -1, dtype=FIXED_END)
    row["owner"] = np.r_[supports:count, :supports]
    vector, laws, n = np.zeros((count, 2, 6)), [], 0
    for law, block, angles, values in zip(
        data.bearing_law, data.bearing_block, data.bearing_angle, data.bearing_parameters,
        strict=True,
    ):  # fmt: skip
        components = LAWS[law].components
        laws.append((int(law), n, len(components), list(values)))
        for component, stiffness in zip(components, LAWS[law].nominal(values), strict=True):
            row[n]["kind"], row[n]["stiffness"] = BEARING, stiffness
            end[n]["block"], end[n]["angle"] = block, angles
            vector[n, :, component] = 1.0, -1.0
            n += 1
    row["kind"][loads], end["block"][loads, 0] = LOAD, data.load_block
    end["angle"][loads, 0] = data.load_angle
    vector[loads, 0] = -data.load_vector  # a row acts as −V F
    laws += [(GIVEN_FORCE_LAW, n + i, 1, [size]) for i, size in enumerate(data.load_size)]
    row["kind"][springs], row["stiffness"][springs] = SUPPORT, data.support_stiffness
    end["block"][springs], end["angle"][springs] = data.support_block, data.support_angle
    vector[springs] = data.support_vector
    laws += [
        (LINEAR_LAW, springs.start + i, 1, [k, 0.0]) for i, k in enumerate(data.support_stiffness)
    ]
    element = np.zeros(len(laws), dtype=FIXED_ELEMENT)
    parameters = np.zeros((len(laws), max([RATE_PARAMETERS, *(len(x[3]) for x in laws)])))
    for i, (law, first, rows, values) in enumerate(laws):
        element[i] = law, first, rows, 0, -1, -1, LAWS[law].turned
        parameters[i, : len(values)] = values
    element["angle"][: len(data.bearing_turned)] = data.bearing_turned
    last = slice(len(laws) - supports - forces, len(laws) - supports)
    element["grows"][last], element["history"][last] = data.load_grows, data.load_history
    return FixedRows(row, end, vector, element, parameters)


def rolling_rates(fixed: FixedRows, rates: Array) -> Array:
    """Rates (F,) of permanent rows at velocities (6 n_b,) of the blocks in rolling, by their
    components along and about the axis; transverse velocities are those of orbiting bodies."""
    block, axial = fixed.end["block"][:, :, None], np.array([2, 5])
    axial_rates = np.where(block >= 0, rates[6 * np.maximum(block, 0) + axial], 0.0)
    return np.asarray((fixed.vector[:, :, axial] * axial_rates).sum(axis=(1, 2)))


def law_functions(data: PairData) -> tuple[object, ...]:
    """Compiled functions of the laws of elements in ``data`` and of machines at ports. Laws that
    ``pairs`` assigns to tooth pairs must be included here."""
    coupled = data.coupled[data.model == FACE_LOAD]
    slices = np.where(coupled == 1, COUPLED_SLICES_LAW, SLICES_LAW)
    return functions({*slices.tolist(), *data.bearing_law.tolist()})


def pair_rows(data: PairData, machines: int = 0) -> Rows:
    """Work arrays, still without values, with room for all tooth pairs and fixed elements of
    ``data`` and for one row and one element of each of ``machines`` at ports."""
    pairs, fixed = max(1, len(data.s0) * data.slots), _fixed_rows(data)
    blocks = 2 * data.slots + 2  # planet, gear, and teeth of both that are blocks
    rows = rows_of_pair(data) * pairs + extra_rows(data) + machines
    elements = pairs + len(fixed.element) + machines
    parameters = max(fixed.parameters.shape[1], slice_parameters(data))
    return Rows(
        row=np.zeros(rows, dtype=ROW),
        yields=np.zeros((rows, FOLLOWING)),
        blocks=np.zeros((rows, blocks), dtype=np.int64),
        place=np.zeros((rows, blocks), dtype=np.uint64),
        coef=np.zeros((rows, blocks, 6)),
        pair=np.zeros(pairs, dtype=PAIR),
        element=np.zeros(elements, dtype=ELEMENT),
        parameters=np.zeros((elements, parameters)),
    )


def slice_parameters(data: PairData) -> int:
    """Number of parameters of the law of pairs with slices, including what it remembers of the last
    solution; 0 without slices."""
    if not data.slice_table.shape[2]:
        return 0
    remembered = 2 + 3 * int(data.slices.max(initial=0))
    return FIRST + data.slice_table.shape[2] - LINE_COLUMNS + remembered


def places_of_gear_mesh(data: PairData) -> int:
    """Number of places for data that pairs of a gear mesh store between steps: twice its slots, so
    that a new pair does not get the data of one that has left."""
    return 2 * data.slots


def places(data: PairData) -> int:
    """Number of places for data that elements store between steps: pairs, then fixed elements."""
    return places_of_gear_mesh(data) * len(data.s0) + len(_fixed_rows(data).element) + 1


def widest(data: PairData) -> int:
    """Largest number of rows of an element."""
    return max([rows_of_pair(data), *(len(LAWS[law].components) for law in data.bearing_law)])


@njit(**INNER)
def add_to_blocks(rows, r, load, out):
    """Adds V_r load to ``out``; V_r: vector of row r."""
    for a in range(rows.row[r].width):
        b = 6 * rows.blocks[r, a]
        for o in range(6):
            out[b + o] += load * rows.coef[r, a, o]


@njit(**INNER)
def of_blocks(rows, r, vector):
    """Motion V_rᵀ u of row r for a vector u of the channels."""
    total = 0.0
    for a in range(rows.row[r].width):
        b = 6 * rows.blocks[r, a]
        for o in range(6):
            total += rows.coef[r, a, o] * vector[b + o]
    return total


@njit(**INNER)
def add_neighbours(rows, n, matrix):
    """Adds the flexibility B, m/N, between n rows to ``matrix``."""
    for i in range(n):
        first = rows.row[i].after
        for k in range(rows.row[i].following):
            matrix[i, first + k] += rows.yields[i, k]
            matrix[first + k, i] += rows.yields[i, k]


@njit(**INNER)
def yield_to_neighbours(rows, n, force, motion):
    """Subtracts B F from ``motion`` of n rows with forces F (≥ n,)."""
    for i in range(n):
        first = rows.row[i].after
        for k in range(rows.row[i].following):
            motion[i] -= rows.yields[i, k] * force[first + k]
            motion[first + k] -= rows.yields[i, k] * force[i]


@njit(**INNER)
def freeze_neighbours(rows, n, force):
    """Subtracts B F from the offsets of n rows with forces F."""
    for i in range(n):
        row = rows.row[i]
        for k in range(row.following):
            next_row = rows.row[row.after + k]
            row.offset -= rows.yields[i, k] * force[row.after + k]
            next_row.offset -= rows.yields[i, k] * force[i]


@njit(**INNER)
def neighbour_energy(rows, n, force):
    """Energy ½ Fᵀ B F of n rows with forces F, J."""
    energy = 0.0
    for i in range(n):
        first = rows.row[i].after
        for k in range(rows.row[i].following):
            energy += force[i] * rows.yields[i, k] * force[first + k]
    return energy


def between_rows(rows: Rows, n: int) -> Array:
    """Flexibility B (n, n) between the first n rows, m/N."""
    flexibility, row = np.zeros((n, n)), rows.row[:n]
    for i in np.flatnonzero(row["following"]):
        at = slice(row["after"][i], row["after"][i] + row["following"][i])
        flexibility[i, at] = flexibility[at, i] = rows.yields[i, : row["following"][i]]
    return flexibility


def row_stiffness(rows: Rows, n: int) -> Array:
    """Stiffness (I + k B)⁻¹ k (n, n) of the first n rows, N/m, with their nominal k."""
    k = rows.row["stiffness"][:n]
    return np.asarray(np.linalg.solve(np.eye(n) + k[:, None] * between_rows(rows, n), np.diag(k)))


def row_motions(rows: Rows, n: int, blocks: Array) -> Array:
    """Motion (n, c) of the first n rows for motions (6 n_b, c) of the contact blocks."""
    width = rows.coef.shape[1]
    used = np.arange(width) < rows.row["width"][:n, None]
    at = 6 * np.where(used, rows.blocks[:n], 0)[:, :, None] + np.arange(6)
    coef = np.where(used[:, :, None], rows.coef[:n], 0.0)
    return np.asarray(np.einsum("nwo,nwoc->nc", coef, blocks[at]))
