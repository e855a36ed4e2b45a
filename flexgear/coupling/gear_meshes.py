"""From gear theory to the arrays and tables of the gear-mesh elements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array, Ints
from flexgear.coupling.laws import LAW_NUMBERS
from flexgear.coupling.pair_data import (
    FACE_LOAD,
    FEWEST_SLOTS,
    KINDS,
    PER_PAIR,
    SUMMED,
    WAVE,
    PairData,
    largest_errors,
)
from flexgear.coupling.springs import LawBearing
from flexgear.gears.contact import GearMeshKind, GearMeshPath
from flexgear.gears.errors import PairErrors
from flexgear.gears.slices import Slices
from flexgear.model.errors import FlexgearError

MODELS = {"per_pair": PER_PAIR, "lumped": SUMMED, "face_load": FACE_LOAD}  # all others: WAVE


@dataclass(frozen=True)
class PairPaths:
    """Paths of the pairs of one kind of gear mesh: of sound teeth, then of those with faults.

    With A groups of faulty teeth of the gear and B of planets' teeth, each group one fault or one
    set of them, the tables of the kind lie side by side from its first one on: of sound teeth, of
    the gear's groups 1 … A, and the same again for every group of planets' teeth. A pair takes the
    table

        first + a + (1 + A) b ,   a, b: groups of its teeth, 0 of sound ones.

    gear: (A,) groups of tooth numbers of the gear; planets: (B,) groups of (planet, tooth number);
    all from 0. paths: (1 + B) (1 + A), in the order of the tables.
    """

    paths: tuple[GearMeshPath, ...]
    gear: tuple[tuple[int, ...], ...] = ()
    planets: tuple[tuple[tuple[int, int], ...], ...] = ()

    def gear_table(self, teeth: int) -> Ints:
        """What each tooth of the gear adds to the number of the table (teeth,)."""
        out = np.zeros(teeth, dtype=np.int64)
        for a, group in enumerate(self.gear, 1):
            out[list(group)] = a
        return out

    def planet_table(self, planet: int, teeth: int) -> Ints:
        """What each tooth of a planet adds to it (teeth,)."""
        out = np.zeros(teeth, dtype=np.int64)
        for b, group in enumerate(self.planets, 1):
            out[[tooth for of, tooth in group if of == planet]] = b * (1 + len(self.gear))
        return out


@dataclass(frozen=True)
class GearMeshSet:
    """One kind of gear mesh of one stage (and half), for all its planets.

    stage: number of the stage; angle: which of the system's angles is the stage's θ;
    carrier_angle: which is the carrier's absolute angle; phi (N,) planet angles, rad;
    planet_blocks (N,), gear_block: blocks; tooth_positions (z, 3): where every tooth of the gear
    is a block, else None; turns: angle by which the gear's frame lags the planets', −1 for the
    same frame; planet_teeth (N,), planet_tooth_positions (N, z_p, 3): block of tooth 0 and places
    of all where every tooth of the planets is a block, planet_turns: angle by which these have
    turned in the planets' axes; one_sided: pairs only push; equivalent_mass: kg on the line of
    action, for pair damping c = 2 ζ √(k m); always_damped: whether it acts without contact, too, k
    being the mean of the gear mesh; model: PER_PAIR, SUMMED, WAVE or FACE_LOAD.
    """

    pair_paths: PairPaths
    errors: PairErrors
    stage: int
    angle: int
    carrier_angle: int
    phi: Array
    planet_blocks: Sequence[int]
    gear_block: int
    tooth_positions: Array | None
    turns: int
    one_sided: bool
    equivalent_mass: float
    damping_ratio: float
    model: int = PER_PAIR
    always_damped: bool = False
    planet_teeth: Sequence[int] = ()
    planet_tooth_positions: Sequence[Array] = ()
    planet_turns: int = -1

    @property
    def path(self) -> GearMeshPath:
        """That of sound teeth."""
        return self.pair_paths.paths[0]


@dataclass(frozen=True)
class GearMeshLabel:
    """What a gear mesh m is: stage (0-based), kind (of KINDS), side ("", left, right), planet."""

    stage: int
    kind: GearMeshKind
    side: str
    planet: int


class GivenLoad(NamedTuple):
    """A force and moment (6,) on a block.

    angle: number of the system's angle by which the block's frame turns against that of the force,
    −1 for none; grows: 1 if the force rises with the square of speed, from its value at rated
    speed; size: factor on the vector, at t = 0 where it has a history; history: number of its load
    history, −1 for a constant force.
    """

    block: int
    vector: Array
    angle: int = -1
    grows: int = 0
    size: float = 1.0
    history: int = -1


class SupportRow(NamedTuple):
    """Row of a spring between nodes whose frames turn: N/m of either sign; contact nodes, −1: none;
    vectors (2, 6) in fixed axes."""

    stiffness: float
    nodes: tuple[int, int]
    vectors: Array


def labels(sets: Sequence[GearMeshSet]) -> tuple[GearMeshLabel, ...]:
    """Labels in the order of the gear meshes: set by set, planet by planet."""
    return tuple(
        GearMeshLabel(s.stage, s.path.kind, s.path.side, i) for s in sets for i in range(len(s.phi))
    )


def pair_data(
    sets: Sequence[GearMeshSet],
    blocks: int,
    first: int,
    angles: Sequence[int],
    supports: Sequence[SupportRow],
    bearings: Sequence[LawBearing],
    loads: Sequence[GivenLoad],
) -> PairData:
    """Arrays of all gear meshes and of other rows; FlexgearError where a body has not as many tooth
    nodes as its gear has teeth.

    blocks: number of contact blocks; first, angles: block of the first contact node that is not of
    gear meshes, and by node which angle its frame has turned by (−1: fixed).
    """
    paths = [path for s in sets for path in s.pair_paths.paths]
    first_table = np.cumsum([0, *(len(s.pair_paths.paths) for s in sets)])
    start, step, k_table, z_table, gap_table = stiffness_tables(paths)
    rows = [
        _gear_mesh(s, int(table), i, _opposite(sets, s, i))
        for table, s in zip(first_table[:-1], sets, strict=True)
        for i in range(len(s.phi))
    ]
    columns = {name: _stacked([row[name] for row in rows]) for name in rows[0]}
    nodes, rings = (
        np.array(ends, np.int64).reshape(-1, 2)
        for ends in ([s.nodes for s in supports], [(b.inner, b.outer) for b in bearings])
    )
    data = PairData(
        one_sided=any(s.one_sided for s in sets),
        slots=max([FEWEST_SLOTS, *(_most_pairs(s) for s in sets)]),
        tooth_position=_tooth_positions(sets, blocks),
        table_start=start,
        table_step=step,
        k_table=k_table,
        z_table=z_table,
        gap_table=gap_table,
        slice_table=slice_tables(paths, k_table.shape[1]),
        largest_error=np.zeros(len(rows)),
        support_block=np.where(nodes >= 0, first + nodes, -1),
        support_vector=np.array([s.vectors for s in supports], float).reshape(-1, 2, 6),
        support_stiffness=np.array([s.stiffness for s in supports], float),
        support_angle=np.array([*angles, -1], np.int64)[nodes],
        bearing_law=np.array([LAW_NUMBERS[b.law] for b in bearings], np.int64),
        bearing_block=np.where(rings >= 0, first + rings, -1),
        bearing_angle=np.array([(b.angle, -1) for b in bearings], np.int64).reshape(-1, 2),
        bearing_parameters=_padded([b.parameters for b in bearings]),
        bearing_turned=np.array([b.turned for b in bearings], np.int64),
        load_block=np.array([x.block for x in loads], np.int64),
        load_vector=np.array([x.vector for x in loads], float).reshape(-1, 6),
        load_angle=np.array([x.angle for x in loads], np.int64),
        load_grows=np.array([x.grows for x in loads], np.int64),
        load_size=np.array([x.size for x in loads], float),
        load_history=np.array([x.history for x in loads], np.int64),
        **columns,
    )
    return data._replace(largest_error=largest_errors(data))


def _tooth_positions(sets: Sequence[GearMeshSet], blocks: int) -> Array:
    """Positions (B, 3) by block of all teeth that are blocks, m; zero of all other blocks."""
    positions = np.zeros((max(blocks, 1), 3))
    for s in sets:
        teeth = [(s.gear_block, s.tooth_positions, s.path.gear_teeth)]
        of_planets = zip(s.planet_teeth, s.planet_tooth_positions, strict=True)
        teeth += [(first, places, s.path.planet_teeth) for first, places in of_planets]
        for first, places, count in teeth:
            if places is None:
                continue
            if len(places) != count:
                raise FlexgearError(
                    f"a body of the {s.path.kind} has {len(places)} tooth nodes for {count} teeth"
                )
            positions[first : first + count] = places
    return positions


def _gear_mesh(s: GearMeshSet, table: int, i: int, opposite: int) -> dict[str, Any]:
    """What ``PairData`` has of planet i in one set, by column."""
    p, e = s.path, s.errors
    cos_b = p.cos_base_helix
    angles = np.where(np.asarray(e.runout_angle, dtype=int) == 0, s.angle, s.carrier_angle)
    rates = np.where(angles < 0, 0.0, e.runout_rate)  # what stands in space before a held carrier
    damping = 2 * s.damping_ratio * math.sqrt(s.equivalent_mass)
    return {
        "sided": int(s.one_sided),
        "model": s.model,
        "kind": KINDS.index(p.kind),
        "carries": int(p.carries),
        "opposite": opposite,
        "angle": s.angle,
        "turns": s.turns,
        "phi": s.phi[i],
        "radial": (math.cos(s.phi[i]), math.sin(s.phi[i])),
        "center_distance": p.center_distance,
        "planet_block": s.planet_blocks[i],
        "gear_block": s.gear_block,
        "per_tooth": int(s.tooth_positions is not None),
        "planet_tooth_block": s.planet_teeth[i] if s.planet_teeth else -1,
        "planet_turns": s.planet_turns,
        "s0": p.s0[i],
        "rate": p.rate,
        "pitch": p.base_pitch,
        "s_lo": p.touching[0],
        "s_hi": p.touching[1],
        "path_lo": p.s_lo,
        "path_hi": p.s_hi,
        "slope": p.slope,
        "half_face": p.half_face,
        "z_offset": p.z_offset,
        "normal": p.normal_xy,
        "tangent_point": p.tangent_point,
        "planet_arm": p.planet_arm,
        "gear_arm": p.gear_arm,
        "cos_b": cos_b,
        "sin_b": p.slope * cos_b,
        "s_pitch": p.base_radius_planet * math.tan(p.alpha),
        "gap": 0.0 if p.carries else p.backlash,
        "table": table,
        "gear_table": s.pair_paths.gear_table(p.gear_teeth),
        "planet_table": s.pair_paths.planet_table(i, p.planet_teeth),
        "gear_tooth0": p.gear_tooth0[i],
        "gear_step": p.gear_step,
        "gear_teeth": p.gear_teeth,
        "planet_tooth0": p.planet_tooth0[i],
        "planet_step": p.planet_step,
        "planet_teeth": p.planet_teeth,
        "slices": 0 if p.slices is None else p.slices.count,
        "bent": int(p.slices is not None and p.slices.bending is not None),
        "error_amplitude": e.harmonic_amplitude[i],
        "error_phase": e.harmonic_phase[i],
        "error_offset": e.offset[i],
        "error_slope": e.slope[i],
        "error_gear": e.gear_tooth,
        "error_planet": e.planet_tooth[i],
        "runout_amplitude": e.runout_amplitude[i],
        "runout_rate": rates,
        "runout_phase": e.runout_phase[i],
        "runout_angle": np.maximum(angles, 0),
        "damping": 0.0 if s.always_damped else damping,
        "constant_damping": damping * math.sqrt(_mean_stiffness(s)) * p.carries * s.always_damped,
    }


def _mean_stiffness(s: GearMeshSet) -> float:
    """Mean stiffness of all pairs of a gear mesh over a base pitch, N/m."""
    p = s.path
    if p.wave is not None:
        return float(np.mean(p.wave))
    grid, stiffness = p.s_grid, p.k_grid
    if p.slices is not None:
        grid, stiffness = p.slices.s, p.slices.on_path
    return float(np.trapezoid(stiffness, grid) / p.base_pitch)


def _most_pairs(s: GearMeshSet) -> int:
    """Most tooth pairs in contact at once; of a wave those that share its force."""
    if s.model == WAVE:
        return 2
    p = s.path
    reach = p.touching[1] - p.touching[0] + 2 * abs(p.slope) * p.half_face
    return math.floor(reach / p.base_pitch) + 1


def _opposite(sets: Sequence[GearMeshSet], s: GearMeshSet, i: int) -> int:
    """Number of the gear mesh on the other flank, or −1."""
    if not s.path.carries:
        return -1
    at = 0
    for other in sets:
        if (
            not other.path.carries
            and other.stage == s.stage
            and other.path.side == s.path.side
            and other.path.kind.gear == s.path.kind.gear
        ):
            return at + i
        at += len(other.phi)
    return -1


def _stacked(values: Sequence[Any]) -> NDArray[Any]:
    """A column of numbers, or of arrays that may be of different lengths."""
    return _padded(values) if isinstance(values[0], np.ndarray) else np.array(values)


def _padded(lines: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Rows of different lengths as one array, zeros at the end."""
    shape = len(lines), max(map(len, lines), default=0)
    out = np.zeros(shape, lines[0].dtype if lines else float)
    for row, line in zip(out, lines, strict=True):
        row[: len(line)] = line
    return out


def stiffness_tables(paths: Sequence[GearMeshPath]) -> tuple[Array, ...]:
    """Tables of equal length on uniform grids: start, step, stiffness, centroid, gap."""
    size = max((len(p.s_grid) for p in paths if p.wave is None), default=2)
    size = max([size, *(len(p.slices.s) for p in paths if p.slices is not None)])
    size = max([size, *(len(p.wave) for p in paths if p.wave is not None)])
    return tuple(map(np.array, zip(*(_table(p, size) for p in paths), strict=True)))


def _table(p: GearMeshPath, size: int) -> tuple[float, float, Array, Array, Array]:
    """One row of ``stiffness_tables``."""
    if p.wave is not None:
        period = np.arange(len(p.wave) + 1) / len(p.wave)
        wave = np.interp(np.arange(size) / size, period, [*p.wave, p.wave[0]])
        return 0.0, 1.0, wave, np.zeros(size), np.zeros(size)
    s, k, z, gap = p.s_grid, p.k_grid, p.zc_grid, p.gap_grid
    if p.slices is not None:
        s, k, z, gap = p.slices.s, p.slices.on_path, p.slices.centre, np.zeros(len(p.slices.s))
    grid = np.linspace(s[0], s[-1], size)
    k, z, gap = (np.interp(grid, s, values) for values in (k, z, gap))
    return grid[0], grid[1] - grid[0], k, z, gap


def slice_tables(paths: Sequence[GearMeshPath], size: int) -> Array:
    """Tables of slices beside those of ``stiffness_tables``, 0 where a path has none (K, T, …)."""
    columns = [_of_slices(p.slices) for p in paths if p.slices is not None]
    if not columns:
        return np.zeros((len(paths), 0, 0))
    out = np.zeros((len(paths), size, max(c.shape[1] for c in columns)))
    for table, p in zip(out, paths, strict=True):
        if p.slices is None:
            continue
        path_grid = p.slices.s
        grid = np.linspace(path_grid[0], path_grid[-1], size)
        for j, column in enumerate(_of_slices(p.slices).T):
            table[:, j] = np.interp(grid, path_grid, column)
    return out


def _of_slices(slices: Slices) -> Array:
    """The columns that ``PairData.slice_table`` lists, at the S path positions of the slices."""
    bending, count = slices.bending, len(slices.s)
    beside = np.zeros((count, 8)) if bending is None else bending.beside.reshape(count, 8)
    whole = np.column_stack([slices.radius, slices.stiffness.sum(axis=1), beside])
    columns = [whole, slices.z, slices.stiffness, slices.gap]
    if bending is not None:
        columns += [bending.scale, bending.limit, bending.lower]
    if slices.narrowing is not None:
        columns.append(slices.narrowing)
    return np.hstack(columns)
