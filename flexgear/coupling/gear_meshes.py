"""Gear meshes of a train, and their arrays and tables (``PairData``) from gear theory."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.arrays import Array
from flexgear.coupling.laws import LAW_NUMBERS
from flexgear.coupling.pair_data import (
    FACE_LOAD,
    KINDS,
    LEAST_SLOTS,
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
from flexgear.gears.tooth_faults import FaultGroups
from flexgear.model.errors import FlexgearError
from flexgear.model.gear_mesh import GearMesh

MODELS = {"per_pair": PER_PAIR, "lumped": SUMMED, "face_load": FACE_LOAD}  # all others: WAVE


@dataclass(frozen=True)
class StageFrame:
    """Indices of the angles by which the frames of a stage rotate, −1 for a fixed frame.

    theta: stage angle θ = φ_carrier − φ_ring, or rotation of the gear of a parallel stage; carrier:
    of the carrier, whose frame is that of all lumped members and the sun; ring: of the ring, whose
    frame is that of an FE ring and its hub; planets: rotation of planets relative to the carrier,
    for frames of FE planets and for outer races with defects.
    """

    theta: int
    carrier: int
    ring: int = -1
    planets: int = -1


@dataclass(frozen=True, eq=False)
class GearBlock:
    """Contact blocks of a gear. first: block of the gear, or of its first tooth if every tooth is a
    block; teeth: positions of the teeth (z, 3), m, or None; rigid: block of the rigid motion, if
    blocks of teeth have elastic displacement only."""

    first: int
    teeth: Array | None = None
    rigid: int | None = None


GearBlocks = Mapping[tuple[str, int, str], GearBlock]
"""Contact blocks of a stage's gears by part, planet (−1: none) and side, "" for both sides."""


@dataclass(frozen=True)
class GearMeshSet:
    """One kind of gear mesh of one stage (and half), for all its planets.

    paths: of sound teeth, then of teeth with faults in the order of ``faults``; stage: index; phi:
    (N,) planet angles, rad; gear, planets: contact blocks of the gear and the N planets;
    equivalent_mass: m on the line of action, kg, for pair damping c = 2 ζ √(k m).
    """

    paths: Sequence[GearMeshPath]
    faults: FaultGroups
    errors: PairErrors
    stage: int
    frame: StageFrame
    phi: Array
    gear: GearBlock
    planets: Sequence[GearBlock]
    equivalent_mass: float
    options: GearMesh

    @property
    def path(self) -> GearMeshPath:
        """Path of contact of sound teeth."""
        return self.paths[0]

    @property
    def model(self) -> int:
        """Model of the gear mesh: PER_PAIR, SUMMED, WAVE or FACE_LOAD."""
        return MODELS.get(self.options.model, WAVE)


@dataclass(frozen=True)
class GearMeshLabel:
    """Label of a gear mesh: stage (0-based), kind, side ("", "left" or "right"), planet."""

    stage: int
    kind: GearMeshKind
    side: str
    planet: int


class GivenLoad(NamedTuple):
    """Force and moment (6,) on a block.

    angle: index of the angle of the block's frame relative to that of the force, −1 for none;
    grows: 1 if the vector, given at rated speed, is proportional to speed squared; size: factor on
    the vector, of a history its value at t = 0; history: index of the load history, −1 for none.
    """

    block: int
    vector: Array
    angle: int = -1
    grows: int = 0
    size: float = 1.0
    history: int = -1


class SupportRow(NamedTuple):
    """Row of a spring between nodes in rotating frames. name: of the support or joint; stiffness:
    N/m, of either sign; nodes: contact nodes, −1: none; vectors: (2, 6) in fixed axes."""

    name: str
    stiffness: float
    nodes: tuple[int, int]
    vectors: Array


def labels(sets: Sequence[GearMeshSet]) -> tuple[GearMeshLabel, ...]:
    """Labels of all gear meshes, set by set and planet by planet."""
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
    """Arrays of all gear meshes, rotating supports, nonlinear bearings and loads.

    blocks: number of contact blocks; first: block of the first contact node that is not of gear
    meshes; angles: index of the angle of the frame of each of these nodes, −1: fixed. Raises
    FlexgearError if the tooth nodes of a body are not as many as its teeth.
    """
    paths, rows = list[GearMeshPath](), list[dict[str, Any]]()
    first_gear_mesh = np.cumsum([0, *(len(s.phi) for s in sets)]).tolist()
    coast = {
        _flank_key(s): m for s, m in zip(sets, first_gear_mesh, strict=False) if not s.path.carries
    }
    for s in sets:
        opposite = coast.get(_flank_key(s)) if s.path.carries else None
        for i in range(len(s.phi)):
            rows.append(_gear_mesh(s, len(paths), i, -1 if opposite is None else opposite + i))
        paths += s.paths
    start, step, k_table, z_table, gap_table = stiffness_tables(paths)
    columns = {name: _stacked([row[name] for row in rows]) for name in rows[0]}
    nodes, rings = (
        np.array(ends, np.int64).reshape(-1, 2)
        for ends in ([s.nodes for s in supports], [(b.inner, b.outer) for b in bearings])
    )
    data = PairData(
        one_sided=any(s.options.contact_law != "linear" for s in sets),
        slots=max([LEAST_SLOTS, *(_most_pairs(s) for s in sets)]),
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
        bearing_parameters=_ragged([b.parameters for b in bearings]),
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
    """Positions (B, 3) of blocks that are teeth, m; zero of other blocks."""
    positions = np.zeros((max(blocks, 1), 3))
    for s in sets:
        p = s.path
        teeth = [(s.gear, p.gear_teeth), *((planet, p.planet_teeth) for planet in s.planets)]
        for block, count in teeth:
            if block.teeth is None:
                continue
            if len(block.teeth) != count:
                raise FlexgearError(
                    f"a body of the {p.kind} has {len(block.teeth)} tooth nodes for {count} teeth"
                )
            positions[block.first : block.first + count] = block.teeth
    return positions


_OF_PATH = (  # columns of ``PairData`` with the names of a path's attributes
    "center_distance", "rate", "slope", "half_face", "z_offset", "tangent_point", "planet_arm",
    "gear_arm", "gear_step", "gear_teeth", "planet_step", "planet_teeth",
)  # fmt: skip


def _gear_mesh(s: GearMeshSet, table: int, i: int, opposite: int) -> dict[str, Any]:
    """Columns of ``PairData`` for planet i in one set."""
    p, e, frame, planet = s.path, s.errors, s.frame, s.planets[i]
    cos_b, floats = p.cos_base_helix, planet.rigid is not None
    angles = np.where(np.asarray(e.runout_angle, dtype=int) == 0, frame.theta, frame.carrier)
    rates = np.where(angles < 0, 0.0, e.runout_rate)  # constant if the carrier is held
    damping = 2 * s.options.damping_ratio * math.sqrt(s.equivalent_mass)
    always = s.options.damping_law == "always"
    return {
        "sided": int(s.options.contact_law != "linear"),
        "model": s.model,
        "kind": KINDS.index(p.kind),
        "carries": int(p.carries),
        "opposite": opposite,
        "angle": frame.theta,
        "turns": -1 if s.gear.teeth is None else frame.theta,
        "phi": s.phi[i],
        "radial": (math.cos(s.phi[i]), math.sin(s.phi[i])),
        **{name: getattr(p, name) for name in _OF_PATH},
        "planet_block": planet.rigid if floats else planet.first,
        "gear_block": s.gear.first,
        "per_tooth": int(s.gear.teeth is not None),
        "planet_tooth_block": planet.first if floats else -1,
        "planet_turns": frame.planets if floats else -1,
        "s0": p.s0[i],
        "pitch": p.base_pitch,
        "s_lo": p.touching[0],
        "s_hi": p.touching[1],
        "path_lo": p.s_lo,
        "path_hi": p.s_hi,
        "normal": p.normal_xy,
        "cos_b": cos_b,
        "sin_b": p.slope * cos_b,
        "s_pitch": p.base_radius_planet * math.tan(p.alpha),
        "gap": 0.0 if p.carries else p.backlash,
        "table": table,
        "gear_table": s.faults.gear_table(p.gear_teeth),
        "planet_table": s.faults.planet_table(i, p.planet_teeth),
        "gear_tooth0": p.gear_tooth0[i],
        "planet_tooth0": p.planet_tooth0[i],
        "slices": 0 if p.slices is None else p.slices.count,
        "coupled": int(p.slices is not None and p.slices.bending is not None),
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
        "damping": 0.0 if always else damping,
        "constant_damping": damping * math.sqrt(_mean_stiffness(p)) * p.carries * always,
    }


def _mean_stiffness(p: GearMeshPath) -> float:
    """Mean stiffness of all pairs of a gear mesh over a base pitch, N/m."""
    if p.wave is not None:
        return float(np.mean(p.wave))
    s, stiffness, *_ = _springs(p)
    return float(np.trapezoid(stiffness, s) / p.base_pitch)


def _most_pairs(s: GearMeshSet) -> int:
    """Largest number of tooth pairs in contact, or of pairs that share the force of a wave."""
    if s.model == WAVE:
        return 2
    p = s.path
    reach = p.touching[1] - p.touching[0] + 2 * abs(p.slope) * p.half_face
    return math.floor(reach / p.base_pitch) + 1


def _flank_key(s: GearMeshSet) -> tuple[int, str, str]:
    """Stage, side and gear, which drive and coast flanks of a gear mesh have in common."""
    return s.stage, s.path.side, s.path.kind.gear


def _stacked(values: Sequence[Any]) -> NDArray[Any]:
    """Column (n, …) of numbers, or of arrays of different lengths with zeros at the end."""
    if not isinstance(values[0], np.ndarray):
        return np.array(values)
    out = np.zeros((len(values), max(map(len, values))), values[0].dtype)
    for row, value in zip(out, values, strict=True):
        row[: len(value)] = value
    return out


def _ragged(lines: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Object array (n,) of arrays of different lengths."""
    out = np.empty(len(lines), dtype=object)
    for k, line in enumerate(lines):
        out[k] = np.asarray(line, dtype=float)
    return out


def stiffness_tables(paths: Sequence[GearMeshPath]) -> tuple[Array, ...]:
    """Tables (K, …) of equal length on uniform grids: start, step, stiffness, centroid, gap."""
    size = max([2, *(len(_springs(p)[0] if p.wave is None else p.wave) for p in paths)])
    return tuple(map(np.array, zip(*(_table(p, size) for p in paths), strict=True)))


def _springs(p: GearMeshPath) -> tuple[Array, Array, Array, Array]:
    """Path coordinates, stiffness, centre and gap of pairs; with slices only the stiffness on the
    path of contact, and zero gap, as tables of slices include their gaps."""
    if p.slices is None:
        return p.s_grid, p.k_grid, p.zc_grid, p.gap_grid
    return p.slices.s, p.slices.on_path, p.slices.centre, np.zeros(len(p.slices.s))


def _table(p: GearMeshPath, size: int) -> tuple[float, float, Array, Array, Array]:
    """One row of ``stiffness_tables``."""
    if p.wave is not None:
        period = np.arange(len(p.wave) + 1) / len(p.wave)
        wave = np.interp(np.arange(size) / size, period, [*p.wave, p.wave[0]])
        return 0.0, 1.0, wave, np.zeros(size), np.zeros(size)
    s, *columns = _springs(p)
    grid = np.linspace(s[0], s[-1], size)
    k, z, gap = (np.interp(grid, s, values) for values in columns)
    return grid[0], grid[1] - grid[0], k, z, gap


def slice_tables(paths: Sequence[GearMeshPath], size: int) -> Array:
    """Tables of slices (K, T, …) on the grids of ``stiffness_tables``, 0 for paths without them."""
    slices = {k: p.slices for k, p in enumerate(paths) if p.slices is not None}
    columns = {k: _slice_columns(x).T for k, x in slices.items()}
    if not slices:
        return np.zeros((len(paths), 0, 0))
    out = np.zeros((len(paths), size, max(map(len, columns.values()))))
    for k, values in columns.items():
        s = slices[k].s
        grid = np.linspace(s[0], s[-1], size)
        out[k, :, : len(values)] = np.transpose([np.interp(grid, s, x) for x in values])
    return out


def _slice_columns(slices: Slices) -> Array:
    """Columns of ``PairData.slice_table`` at the S path coordinates of the slices, (S, …)."""
    bending, count = slices.bending, len(slices.s)
    neighbours = np.zeros((count, 8)) if bending is None else bending.neighbours.reshape(count, 8)
    line = np.column_stack([slices.radius, slices.stiffness.sum(axis=1), neighbours])
    columns = [line, slices.z, slices.stiffness, slices.gap]
    if bending is not None:
        columns += [bending.scale, bending.limit, bending.lower]
    if slices.narrowing is not None:
        columns.append(slices.narrowing)
    return np.hstack(columns)
