"""From gear theory to the arrays and tables of the gear-mesh elements."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.laws import law_number
from flexgear.coupling.pair_data import (
    FACE_LOAD,
    FEWEST_SLOTS,
    KINDS,
    PER_PAIR,
    SUMMED,
    WAVE,
    PairData,
)
from flexgear.gears.contact import GearMeshKind, GearMeshPath
from flexgear.gears.errors import PairErrors
from flexgear.gears.slices import Slices
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
SupportRow = tuple[float, Sequence[tuple[int, Array]]]


# all others are waves
MODELS = {"per_pair": PER_PAIR, "lumped": SUMMED, "face_load": FACE_LOAD}


def model_number(name: str) -> int:
    """PER_PAIR, SUMMED, FACE_LOAD or WAVE of a model of gear meshes as a case names it."""
    return MODELS.get(name, WAVE)


@dataclass(frozen=True)
class GearMeshSet:
    """One kind of gear mesh of one stage (and half), for all its planets.

    stage: number of the stage; angle: which of the system's angles is the stage's θ;
    carrier_angle: which is the carrier's absolute angle; phi (N,) planet angles, rad;
    planet_blocks (N,), gear_block: blocks; tooth_positions (z, 3): where every tooth of the gear
    is a block, else None; turns: angle by which the gear's frame lags the planets', −1 for the
    same frame; planet_teeth (N,), planet_tooth_positions (N, z_p, 3): block of tooth 0 and places
    of all where every tooth of the planets is a block, planet_turns: angle by which these have
    turned in the planets' axes; carries: on the flanks that carry the rated torque; one_sided:
    pairs only push; equivalent_mass: kg on the line of action, for pair damping c = 2 ζ √(k m);
    model: PER_PAIR, SUMMED, WAVE or FACE_LOAD.
    """

    path: GearMeshPath
    errors: PairErrors
    stage: int
    angle: int
    carrier_angle: int
    phi: Array
    planet_blocks: Sequence[int]
    gear_block: int
    tooth_positions: Array | None
    turns: int
    carries: bool
    one_sided: bool
    equivalent_mass: float
    damping_ratio: float
    model: int = PER_PAIR
    planet_teeth: Sequence[int] = ()
    planet_tooth_positions: Sequence[Array] = ()
    planet_turns: int = -1


@dataclass(frozen=True)
class GearMeshLabel:
    """What a gear mesh m is: stage (0-based), kind (of KINDS), side ("", left, right), planet."""

    stage: int
    kind: GearMeshKind
    side: str
    planet: int


@dataclass(frozen=True)
class BearingElement:
    """A bearing with a law of its own between two blocks.

    law: name in ``laws``; blocks: of the inner and the outer ring, −1 for the housing; angles:
    of the system's by which the blocks' frames have turned, −1 for the law's own; parameters: of
    the law.
    """

    law: str
    blocks: tuple[int, int]
    angles: tuple[int, int]
    parameters: Array


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


@dataclass(frozen=True)
class ExtraRows:
    """Rows that are not gear meshes.

    supports: stiffness and ends (node, 6-vector) of turning supports; support_angles: by node,
    which angle its frame has turned by (−1: fixed); first_block: block of node 0.
    """

    supports: Sequence[SupportRow] = ()
    support_angles: Sequence[int] = ()
    first_block: int = 0
    bearings: Sequence[BearingElement] = ()
    loads: Sequence[GivenLoad] = ()


@dataclass
class _Columns:
    """Columns of the arrays, gear mesh by gear mesh."""

    values: dict[str, list[object]] = field(default_factory=dict)

    def add(self, **entries: object) -> None:
        for name, value in entries.items():
            self.values.setdefault(name, []).append(value)

    def ints(self, name: str) -> IntArray:
        return np.array(self.values.get(name, []), dtype=np.int64)

    def reals(self, name: str, *shape: int) -> Array:
        values = np.array(self.values.get(name, []), dtype=float)
        return values.reshape(len(values), *shape) if shape else values


def labels(sets: Sequence[GearMeshSet]) -> tuple[GearMeshLabel, ...]:
    """Labels in the order of the gear meshes: set by set, planet by planet."""
    return tuple(
        GearMeshLabel(s.stage, s.path.kind, s.path.side, i) for s in sets for i in range(len(s.phi))
    )


def pair_data(sets: Sequence[GearMeshSet], blocks: int, extra: ExtraRows | None = None) -> PairData:
    """Arrays of all gear meshes; blocks: number of contact blocks. FlexgearError where a body has
    not as many tooth nodes as its gear has teeth."""
    extra = extra or ExtraRows()
    paths = [s.path for s in sets]
    start, step, k_table, z_table, gap_table = stiffness_tables(paths, [s.model for s in sets])
    columns, positions = _Columns(), np.zeros((max(blocks, 1), 3))
    for number, s in enumerate(sets):
        teeth = [(s.gear_block, s.tooth_positions, s.path.gear_teeth)]
        teeth += [
            (first, places, s.path.planet_teeth)
            for first, places in zip(s.planet_teeth, s.planet_tooth_positions, strict=True)
        ]
        for first, places, count in teeth:
            if places is None:
                continue
            if len(places) != count:
                raise FlexgearError(
                    f"a body of the {s.path.kind} has {len(places)} tooth nodes for {count} teeth"
                )
            positions[first : first + count] = places
        for i in range(len(s.phi)):
            _enter(columns, s, number, i, _opposite(sets, s, i))
    c = columns
    gear, planet = _padded(c.values["error_gear"]), _padded(c.values["error_planet"])
    runout = _padded(c.values["runout_amplitude"])
    amplitude, offset = c.reals("error_amplitude"), c.reals("error_offset")
    tilted = np.abs(c.reals("error_slope")) * c.reals("half_face")
    block, vector, stiffness, turning = _supports(extra)
    return PairData(
        one_sided=any(s.one_sided for s in sets),
        slots=max([FEWEST_SLOTS, *(_most_pairs(s) for s in sets)]),
        tooth_position=positions,
        table_start=start,
        table_step=step,
        k_table=k_table,
        z_table=z_table,
        gap_table=gap_table,
        slice_table=slice_tables(paths, k_table.shape[1]),
        radial=c.reals("radial", 2),
        normal=c.reals("normal", 2),
        tangent_point=c.reals("tangent_point", 2),
        error_gear=gear,
        error_planet=planet,
        runout_amplitude=runout,
        runout_rate=_padded(c.values["runout_rate"]),
        runout_phase=_padded(c.values["runout_phase"]),
        runout_angle=_padded(c.values["runout_angle"]).astype(np.int64),
        largest_error=offset
        + tilted
        + np.abs(amplitude)
        + np.abs(runout).sum(axis=1)
        + np.abs(gear).max(axis=1)
        + np.abs(planet).max(axis=1),
        support_block=block,
        support_vector=vector,
        support_stiffness=stiffness,
        support_angle=turning,
        bearing_law=np.array([law_number(x.law) for x in extra.bearings], np.int64),
        bearing_block=np.array([x.blocks for x in extra.bearings], np.int64).reshape(-1, 2),
        bearing_angle=np.array([x.angles for x in extra.bearings], np.int64).reshape(-1, 2),
        bearing_parameters=_padded([x.parameters for x in extra.bearings]),
        load_block=np.array([x.block for x in extra.loads], np.int64),
        load_vector=np.array([x.vector for x in extra.loads], float).reshape(-1, 6),
        load_angle=np.array([x.angle for x in extra.loads], np.int64),
        load_grows=np.array([x.grows for x in extra.loads], np.int64),
        load_size=np.array([x.size for x in extra.loads], float),
        load_history=np.array([x.history for x in extra.loads], np.int64),
        **{n: c.ints(n) for n in _INTS},  # type: ignore[arg-type]
        **{n: c.reals(n) for n in _REALS},  # type: ignore[arg-type]
    )


_INTS = (
    "sided", "model", "kind", "carries", "opposite", "angle", "turns", "planet_block", "gear_block",
    "per_tooth", "planet_tooth_block", "planet_turns", "table", "gear_tooth0", "gear_step",
    "gear_teeth", "planet_tooth0", "planet_step", "planet_teeth", "slices", "bent",
)  # fmt: skip
_REALS = (
    "phi", "center_distance", "s0", "rate", "pitch", "s_lo", "s_hi", "path_lo", "path_hi", "slope",
    "half_face", "z_offset", "planet_arm", "gear_arm", "cos_b", "sin_b", "s_pitch", "gap",
    "error_amplitude", "error_phase", "error_offset", "error_slope", "damping",
)  # fmt: skip


def _enter(c: _Columns, s: GearMeshSet, table: int, i: int, opposite: int) -> None:
    """The columns of planet i in one set."""
    p, e = s.path, s.errors
    cos_b = p.cos_base_helix
    angles = np.where(np.asarray(e.runout_angle, dtype=int) == 0, s.angle, s.carrier_angle)
    rates = np.where(angles < 0, 0.0, e.runout_rate)  # what stands in space before a held carrier
    c.add(
        sided=int(s.one_sided),
        model=s.model,
        kind=KINDS.index(p.kind),
        carries=int(s.carries),
        opposite=opposite,
        angle=s.angle,
        turns=s.turns,
        phi=s.phi[i],
        radial=(math.cos(s.phi[i]), math.sin(s.phi[i])),
        center_distance=p.center_distance,
        planet_block=s.planet_blocks[i],
        gear_block=s.gear_block,
        per_tooth=int(s.tooth_positions is not None),
        planet_tooth_block=s.planet_teeth[i] if s.planet_teeth else -1,
        planet_turns=s.planet_turns,
        s0=p.s0[i],
        rate=p.rate,
        pitch=p.base_pitch,
        s_lo=p.touching[0],
        s_hi=p.touching[1],
        path_lo=p.s_lo,
        path_hi=p.s_hi,
        slope=p.slope,
        half_face=p.half_face,
        z_offset=p.z_offset,
        normal=p.normal_xy,
        tangent_point=p.tangent_point,
        planet_arm=p.planet_arm,
        gear_arm=p.gear_arm,
        cos_b=cos_b,
        sin_b=p.slope * cos_b,
        s_pitch=p.base_radius_planet * math.tan(p.alpha),
        gap=0.0 if s.carries else p.backlash,
        table=table,
        gear_tooth0=p.gear_tooth0[i],
        gear_step=p.gear_step,
        gear_teeth=p.gear_teeth,
        planet_tooth0=p.planet_tooth0[i],
        planet_step=p.planet_step,
        planet_teeth=p.planet_teeth,
        slices=0 if p.slices is None else p.slices.count,
        bent=int(p.slices is not None and p.slices.bending is not None),
        error_amplitude=e.harmonic_amplitude[i],
        error_phase=e.harmonic_phase[i],
        error_offset=e.offset[i],
        error_slope=e.slope[i],
        error_gear=e.gear_tooth,
        error_planet=e.planet_tooth[i],
        runout_amplitude=e.runout_amplitude[i],
        runout_rate=rates,
        runout_phase=e.runout_phase[i],
        runout_angle=np.maximum(angles, 0),
        damping=2 * s.damping_ratio * math.sqrt(s.equivalent_mass),
    )


def _most_pairs(s: GearMeshSet) -> int:
    """Most tooth pairs in contact at once; of a wave those that share its force."""
    if s.model == WAVE:
        return 2
    p = s.path
    reach = p.touching[1] - p.touching[0] + 2 * abs(p.slope) * p.half_face
    return math.floor(reach / p.base_pitch) + 1


def _opposite(sets: Sequence[GearMeshSet], s: GearMeshSet, i: int) -> int:
    """Number of the gear mesh on the other flank, or −1."""
    if not s.carries:
        return -1
    at = 0
    for other in sets:
        if (
            not other.carries
            and other.stage == s.stage
            and other.path.side == s.path.side
            and other.path.kind.gear == s.path.kind.gear
        ):
            return at + i
        at += len(other.phi)
    return -1


def _padded(lines: Sequence[object]) -> Array:
    """Rows of different lengths as one array, zeros at the end."""
    arrays = [np.asarray(x, dtype=float) for x in lines]
    out = np.zeros((len(arrays), max((len(a) for a in arrays), default=0)))
    for row, a in zip(out, arrays, strict=True):
        row[: len(a)] = a
    return out


def _supports(extra: ExtraRows) -> tuple[IntArray, Array, Array, IntArray]:
    count = len(extra.supports)
    block = np.full((count, 2), -1, dtype=np.int64)
    vector = np.zeros((count, 2, 6))
    turning = np.full((count, 2), -1, dtype=np.int64)
    for r, (_, ends) in enumerate(extra.supports):
        for e, (node, w) in enumerate(ends):
            block[r, e], vector[r, e] = extra.first_block + node, w
            turning[r, e] = extra.support_angles[node]
    return block, vector, np.array([r[0] for r in extra.supports], dtype=float), turning


def stiffness_tables(
    paths: Sequence[GearMeshPath], models: Sequence[int]
) -> tuple[Array, Array, Array, Array, Array]:
    """Tables of equal length on uniform grids: start, step, stiffness, centroid, gap."""
    waves = [model == WAVE for model in models]
    size = max((len(p.s_grid) for p, wave in zip(paths, waves, strict=True) if not wave), default=2)
    size = max([size, *(len(p.slices.s) for p in paths if p.slices is not None)])
    size = max([size, *(len(p.wave) for p in paths if p.wave is not None)])
    start, step, k, z, gap = [], [], [], [], []
    for p, wave in zip(paths, waves, strict=True):
        if wave:
            if p.wave is None:
                raise FlexgearError(f"the {p.kind} gear mesh has no stiffness wave")
            period = np.arange(len(p.wave) + 1) / len(p.wave)
            share = np.arange(size) / size
            start.append(0.0)
            step.append(1.0)
            k.append(np.interp(share, period, [*p.wave, p.wave[0]]))
            z.append(np.zeros(size))
            gap.append(np.zeros(size))
            continue
        path_grid = p.s_grid if p.slices is None else p.slices.s
        grid = np.linspace(path_grid[0], path_grid[-1], size)
        start.append(grid[0])
        step.append(grid[1] - grid[0])
        if p.slices is not None:
            k.append(np.interp(grid, path_grid, p.slices.on_path))
            z.append(np.interp(grid, path_grid, p.slices.centre))
            gap.append(np.zeros(size))
            continue
        k.append(np.interp(grid, p.s_grid, p.k_grid))
        z.append(np.interp(grid, p.s_grid, p.zc_grid))
        gap.append(np.interp(grid, p.s_grid, p.gap_grid))
    return np.array(start), np.array(step), np.array(k), np.array(z), np.array(gap)


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
