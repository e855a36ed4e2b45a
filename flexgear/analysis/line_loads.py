"""Load along the face: forces of slices, edge loads, first contact, stiffness, misalignment.

**Line load.** The mean line load of a gear mesh at an instant is its force over the length along
the face of its contact lines on the path of contact, with or without contact: the line load of an
even distribution. Off the path the tip edge of one gear touches the flank of the other. The load at
an end of the face is that of the last slice of a contact line on the path that ends there.

**First contact.** Rigid bodies without tilt that approach along N touch at w = min (g_j − e_j) over
the slices j of all pairs and the ends of the face, g_j the gap of both flanks, e_j the errors of
the pair: the unloaded transmission error, the envelope of those of single pairs.

**Stiffness.** Where all rows of a gear mesh are closed by x, their forces are F = f(x − B F), with
the tangents T of the pairs (block diagonal) and the flexibility B between neighbouring pairs. The
stiffness of the gear mesh with fixed bodies is

    dΣF/dx = 1ᵀ (I + T B)⁻¹ T 1 .

**Misalignment.** The approach of two flanks along N is Nᵀ(u_gear − u_planet) at
C = T_p − (s + t z) n + z e_z. Along a contact line only rotations change it, by ω · (dC/dz × N):

    dC/dz × N = (e_z − t n) × (cosβ_b n + sinβ_b e_z) = (e_z × n)/cosβ_b,    t = tanβ_b,

so that the misalignment per width is the component of θ_gear − θ_planet along this vector. The
planet's rotation is that of its pin plus the tilt of its bearing, θ_planet = θ_pin + (θ_planet −
θ_pin). Helix slope deviations of ``errors`` are added. For modified flanks the misalignment is the
slope along z of the least-squares plane through their gap g(path, z) over the path of contact:
the slope of a helix modification, zero for crowning and relief.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.equilibrium import Equilibrium
from flexgear.analysis.recovery import Recovery
from flexgear.analysis.transient import Transient
from flexgear.arrays import Array, Ints
from flexgear.coupling.kernels.elements import packed, pair_rows
from flexgear.coupling.kernels.pairs import NEIGHBOURS, fill_rows
from flexgear.coupling.laws.coupled_slices import forces_of
from flexgear.coupling.pair_data import FOLLOWING, KINDS, LINE_COLUMNS, PairData, narrowing_columns
from flexgear.coupling.system import System
from flexgear.gears.slices import Line, line_ends
from flexgear.structures.bodies import rotation as turn_about_z

LEAST_WIDTH = 1e-6  # length of a contact line over half a face below which it has no line load


@dataclass(frozen=True)
class LineLoads:
    """Slices of tooth pairs over samples, (t, M, slots, K), NaN without a pair in slices.

    force: elastic force, N; z: middle of the slice along the face, m; path: path coordinate at z,
    m; line_load: N/m along z, NaN where a contact line has no length; gap: between the unloaded
    flanks, m; width: along z, m; narrowing: half width of contact of the modified flanks over that
    of involutes, at the mean line load of the gear mesh.
    ends (t, M, slots, 2): ends of the contact line along z, m; approach, tilt (t, M, slots):
    approach of the bodies along N at z = 0, m, and its slope along z, m/m, without errors; tangent
    (t, M, slots, 2, 2): of the two rows of a pair under its load, N/m.
    """

    force: Array
    z: Array
    path: Array
    line_load: Array
    gap: Array
    width: Array
    narrowing: Array
    ends: Array
    approach: Array
    tilt: Array
    tangent: Array


def line_loads(result: Equilibrium | Transient) -> LineLoads | None:
    """Line loads of all tooth pairs of a result; None where no gear mesh has slices."""
    pairs: PairData = result.modal.system.pairs
    slices = int(pairs.slices.max(initial=0))
    if slices == 0:
        return None
    shape = result.pair_load.shape

    def empty(*more: int) -> Array:
        return np.full((*shape, *more), np.nan)

    force, z, path, line_load, gap, width, narrowing = (empty(slices) for _ in range(7))
    by_pair = empty(2), empty(), empty(), empty(2, 2)
    out = LineLoads(force, z, path, line_load, gap, width, narrowing, *by_pair)
    for m, count in enumerate(pairs.slices):
        if count:
            _fill_gear_mesh(result, pairs, m, int(count), out)
    return out


def _fill_gear_mesh(
    result: Equilibrium | Transient, pairs: PairData, m: int, count: int, out: LineLoads
) -> None:
    """Enter the slices of gear mesh m, ``count`` per pair, in ``out``."""
    at = np.nonzero(result.pair_tooth[:, m] >= 0)  # samples and slots
    s, approaches = result.pair_position[:, m][at], result.pair_approach[:, m][at]
    teeth = teeth_of_pairs(pairs, m, s, result.theta[at[0], pairs.angle[m]])
    tables = pairs.table[m] + pairs.gear_table[m, teeth[0]] + pairs.planet_table[m, teeth[1]]
    values = interpolated(pairs, m, pairs.slice_table, s, tables)
    radius = values[:, 0]
    z, stiffness, gap = np.split(values[:, LINE_COLUMNS : LINE_COLUMNS + 3 * count], 3, axis=1)
    centre = interpolated(pairs, m, pairs.z_table, s, tables)  # of the lines
    with np.errstate(divide="ignore", invalid="ignore"):
        lever = np.where(radius > 0, 0.5 / radius, 0.0)
    tilt = lever * (approaches[:, 1] - approaches[:, 0])
    turned = lever * (approaches[:, 3] - approaches[:, 2])
    middle, approach = approaches[:, :2].mean(axis=1), approaches[:, 2:].mean(axis=1)
    x = middle[:, None] + tilt[:, None] * (z - centre[:, None]) - gap
    second_share = 0.5 + lever[:, None] * (z - centre[:, None])  # of the second row in each slice
    if pairs.coupled[m]:
        force, tangent = forces_of(x, second_share, values[:, LINE_COLUMNS + 3 * count :])
    else:
        force = stiffness * np.maximum(x, 0.0)
        shares = np.stack([1.0 - second_share, second_share], axis=1)
        tangent = np.einsum("nik,njk,nk->nij", shares, shares, stiffness * (x > 0.0))
    span = (float(pairs.s_lo[m]), float(pairs.s_hi[m]))
    low, high = line_ends(s, Line(span, span, float(pairs.slope[m]), float(pairs.half_face[m])))
    width = (high - low) / count
    width = np.where(width > LEAST_WIDTH * pairs.half_face[m] / count, width, np.nan)
    place = (at[0], np.full_like(at[0], m), at[1])
    slices = (*place, slice(count))
    out.force[slices], out.z[slices], out.gap[slices] = force, z, gap
    out.path[slices], out.width[slices] = s[:, None] + pairs.slope[m] * z, width[:, None]
    out.line_load[slices] = force / width[:, None]
    narrowing = values[:, narrowing_columns(pairs, m)]
    out.narrowing[slices] = narrowing if narrowing.any() else 1.0
    out.ends[place], out.tangent[place] = np.column_stack([low, high]), tangent
    out.approach[place], out.tilt[place] = approach - turned * centre, turned


def teeth_of_pairs(pairs: PairData, m: int, s: Array, theta: Array) -> tuple[Ints, Ints]:
    """Numbers of the teeth of gear and planet, from 0, in pairs of gear mesh m at path coordinates
    s, m, and the angle theta of the stage, rad."""
    k = np.rint((s - pairs.s0[m] - pairs.rate[m] * theta) / pairs.pitch[m]).astype(np.int64)
    tooth = (pairs.gear_tooth0[m] + pairs.gear_step[m] * k) % pairs.gear_teeth[m]
    return tooth, (pairs.planet_tooth0[m] + pairs.planet_step[m] * k) % pairs.planet_teeth[m]


def interpolated(
    pairs: PairData, m: int, values: Array, s: Array, tables: Ints | None = None
) -> Array:
    """Entries (n, …) of tables ``values`` of gear mesh m at path coordinates s (n,), m: of slices,
    or centres z of contact lines, symmetrical to which a pair has its two rows. tables (n,):
    numbers of the tables by the pairs' teeth; those of teeth without faults if left out."""
    first, last = pairs.table[m], values.shape[1] - 1
    y = np.clip((s - pairs.table_start[first]) / pairs.table_step[first], 0.0, float(last))
    j, k = np.minimum(y.astype(int), last - 1), first if tables is None else tables
    w = (y - j).reshape(-1, *[1] * (values.ndim - 2))
    return np.asarray((1.0 - w) * values[k, j] + w * values[k, j + 1])


AT_END = 1e-6  # distance over half a face within which a contact line ends at the face's end


class EdgeLoads(NamedTuple):
    """Edge loads of gear meshes, (t, M).

    mean: mean line load, N/m, NaN without load; tip_share: share of the load off the path, NaN
    without load; tip: largest line load off the path, N/m; end: largest line load in the last
    slices at the ends of the face, N/m."""

    mean: Array
    tip_share: Array
    tip: Array
    end: Array


def edge_loads(pairs: PairData, lines: LineLoads) -> EdgeLoads:
    """Edge loads of all gear meshes; 0 for those whose pairs have no slices."""
    low, high = (a[:, None, None] for a in (pairs.path_lo, pairs.path_hi))
    on_path = (lines.path >= low) & (lines.path <= high)
    force, load = np.nan_to_num(lines.force), np.nan_to_num(lines.line_load)
    total, length = force.sum(axis=(2, 3)), _lengths(pairs, lines)
    some = total > 0
    off = np.where(on_path, 0.0, force).sum(axis=(2, 3))
    at_end = np.zeros(load.shape, dtype=bool)
    half = pairs.half_face[:, None] * (1.0 - AT_END)
    at_end[..., 0] = lines.ends[..., 0] <= -half
    last = np.broadcast_to(np.maximum(pairs.slices - 1, 0)[:, None], load.shape[1:3])
    m, slot = np.indices(last.shape)
    at_end[:, m, slot, last] |= lines.ends[..., 1] >= half
    return EdgeLoads(
        mean=np.divide(total, length, out=np.full_like(total, np.nan), where=some & (length > 0)),
        tip_share=np.divide(off, total, out=np.full_like(total, np.nan), where=some),
        tip=np.where(on_path, 0.0, load).max(axis=(2, 3)),
        end=np.where(on_path & at_end, load, 0.0).max(axis=(2, 3)),
    )


def _lengths(pairs: PairData, lines: LineLoads) -> Array:
    """Length (t, M) along z of the contact lines on the path of contact, m."""
    length = np.zeros(lines.approach.shape[:2])
    for m in np.flatnonzero(pairs.slices):
        path, slope = (float(pairs.path_lo[m]), float(pairs.path_hi[m])), float(pairs.slope[m])
        s = lines.path[:, m, :, 0] - slope * lines.z[:, m, :, 0]
        start, stop = line_ends(s.ravel(), Line(path, path, slope, float(pairs.half_face[m])))
        length[:, m] = np.nan_to_num(stop - start).reshape(s.shape).sum(axis=1)
    return length


class PairsAt(NamedTuple):
    """Tooth pairs of a result, (t, M, slots). error: at z = 0, minus backlash, m, NaN without a
    pair; planet_tooth: number from 0, −1 without a pair."""

    error: Array
    planet_tooth: NDArray[np.int16]


def pairs_at(result: Equilibrium | Transient) -> PairsAt:
    """Errors and planet teeth of all pairs of a result."""
    pairs: PairData = result.modal.system.pairs
    elements, rows = packed(pairs), pair_rows(pairs)
    error = np.full(result.pair_load.shape, np.nan)
    tooth = np.full(result.pair_load.shape, -1, dtype=np.int16)
    for t, theta in enumerate(np.ascontiguousarray(result.theta)):
        _, _, count = fill_rows(elements, theta, result.active_flanks[t], rows)
        records = rows.pair[:count]
        m, at = records["gear_mesh"], (t, records["gear_mesh"], records["slot"])
        error[at] = records["error"] - pairs.error_slope[m] * records["z"] - pairs.gap[m]
        tooth[at] = records["planet_tooth"]
    return PairsAt(error, tooth)


def first_touch(pairs: PairData, lines: LineLoads, error: Array) -> Array:
    """Approach of the flanks (t, M) until the first pair touches, m: the smallest gap in the middle
    of any slice, or at an end of the face; NaN without a pair. There the gap of the flanks is that
    of the parabola through the three slices beside it, but a positive one not below zero, as where
    relief ends. error (t, M, slots): as in ``PairsAt``, m."""
    slope = pairs.error_slope[:, None, None]
    gap = np.where(np.isfinite(lines.line_load), lines.gap - slope * lines.z, np.nan)
    least = np.fmin.reduce(gap, axis=3, initial=np.inf)
    for m in map(int, np.flatnonzero(pairs.slices > 2)):
        count, of_flanks = int(pairs.slices[m]), lines.gap[:, m]
        first, second, third = (of_flanks[..., [k, count - 1 - k]] for k in range(3))
        ends = (15.0 * first - 10.0 * second + 3.0 * third) / 8.0
        ends = np.maximum(ends, np.where(first > 0.0, 0.0, -np.inf))
        at_end = np.abs(lines.ends[:, m]) >= pairs.half_face[m] * (1.0 - AT_END)
        at_end &= np.isfinite(lines.line_load[:, m, :, :1])
        ends = np.where(at_end, ends - pairs.error_slope[m] * lines.ends[:, m], np.inf)
        least[:, m] = np.fmin(least[:, m], ends.min(axis=2))
    least = np.fmin.reduce(least - error, axis=2, initial=np.inf)
    return np.where(np.isfinite(least), least, np.nan)


def gear_mesh_stiffness(result: Equilibrium | Transient, lines: LineLoads) -> Array:
    """Stiffness dΣF/dx (t, M) of gear meshes under their load, N/m; 0 without contact."""
    pairs: PairData = result.modal.system.pairs
    stiffness = np.nan_to_num(lines.tangent).sum(axis=(2, 3, 4))
    for m in map(int, np.flatnonzero(pairs.coupled)):
        for t in range(len(stiffness)):
            slots = np.flatnonzero(result.pair_tooth[t, m] >= 0)
            if len(slots) > 1:
                slots = slots[np.argsort(result.pair_position[t, m, slots])]
                stiffness[t, m] = _coupled_stiffness(
                    pairs, m, result.pair_position[t, m, slots], lines.tangent[t, m, slots]
                )
    return stiffness


def _coupled_stiffness(pairs: PairData, m: int, s: Array, tangent: Array) -> float:
    """Stiffness of n pairs of gear mesh m that are coupled by flexibility, N/m; s (n,): their path
    coordinates, m, rising; tangent (n, 2, 2): of the two rows of each pair, N/m."""
    n = len(s)
    neighbours = interpolated(pairs, m, pairs.slice_table, s)[:, NEIGHBOURS:LINE_COLUMNS]
    neighbours = neighbours.reshape(n, 2, FOLLOWING)
    tangents, flexibility = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    for k in range(n):
        rows, after = slice(2 * k, 2 * k + 2), slice(2 * k + 2, 2 * k + 2 + FOLLOWING)
        tangents[rows, rows] = tangent[k]
        flexibility[rows, after] = neighbours[k][:, : 2 * (n - k - 1)]
        flexibility[after, rows] = flexibility[rows, after].T
    ones = np.ones(2 * n)
    return float(ones @ np.linalg.solve(np.eye(2 * n) + tangents @ flexibility, tangents @ ones))


CAUSES = (
    "ring", "carrier", "planet bearing", "planet", "sun", "gear", "errors", "modifications",
)  # fmt: skip


def tilt_by_cause(recovery: Recovery) -> Array:
    """Misalignment (t, M, slots, causes) by each of ``CAUSES``, m/m: approach of the flanks per
    width towards +z; NaN without a pair, 0 for causes that a gear mesh does not have.

    "carrier": tilt of the pin, elastic and by the carrier's bearings; "planet": tilt of the tooth
    of an FE planet against the planet's mean axes; "sun": tilt of sun or pinion by its shaft and
    bearings; "gear": tilt of the gear of a parallel stage.
    """
    result, pairs = recovery.result, recovery.modal.system.pairs
    rotations, pins = _rotations(recovery), _rotations_to_pins(recovery)
    by_cause = np.zeros((*result.pair_tooth.shape, len(CAUSES)))
    for m in range(len(pairs.s0)):
        for cause, tilt in _tilt_of_bodies(recovery, rotations, pins, m).items():
            by_cause[:, m, :, CAUSES.index(cause)] = tilt
        by_cause[:, m, :, CAUSES.index("errors")] = pairs.error_slope[m]
        by_cause[:, m, :, CAUSES.index("modifications")] = -ground_slope(pairs, m)
    by_cause[result.pair_tooth < 0] = np.nan
    return by_cause


def _tilt_of_bodies(
    recovery: Recovery, rotations: Array, pins: Mapping[str, Array], m: int
) -> dict[str, Array]:
    """Misalignment of gear mesh m by bodies, (t, slots) or (t, 1), m/m; rotations (t, blocks, 2):
    see ``_rotations``; pins: see ``_rotations_to_pins``."""
    result, pairs = recovery.result, recovery.modal.system.pairs
    axis = np.array([-pairs.normal[m, 1], pairs.normal[m, 0]]) / pairs.cos_b[m]
    rotation = rotations[:, pairs.gear_block[m], None]
    if pairs.per_tooth[m]:
        tooth = pairs.gear_block[m] + np.maximum(result.pair_tooth[:, m], 0)
        rotation = np.take_along_axis(rotations, tooth[:, :, None], axis=1)
    angle = result.theta[:, pairs.turns[m]] if pairs.turns[m] >= 0 else np.zeros(len(rotations))
    gear_axis = turn_about_z(pairs.phi[m] + angle)[:, :2, :2] @ axis
    gear = KINDS[pairs.kind[m]].gear
    tilt = {gear: np.einsum("tsi,ti->ts", rotation, gear_axis)}
    if pairs.planet_turns[m] >= 0:
        theta = result.theta[:, pairs.angle[m], None]
        _, tooth = teeth_of_pairs(pairs, m, result.pair_position[:, m], theta)
        blocks = (pairs.planet_tooth_block[m] + tooth)[:, :, None]
        turned = turn_about_z(-result.theta[:, pairs.planet_turns[m]])[:, :2, :2] @ axis
        rotation = np.take_along_axis(rotations, blocks, axis=1)
        tilt["planet"] = -np.einsum("tsi,ti->ts", rotation, turned)
    planet = -(rotations[:, pairs.planet_block[m]] @ axis)[:, None]
    pin = pins.get(_planet_bearing(recovery.modal.system, m))
    if pin is None:
        return {**tilt, "gear": planet}
    bearing = (pin @ axis)[:, None]
    return {**tilt, "planet bearing": bearing, "carrier": planet - bearing}


def ground_slope(pairs: PairData, m: int) -> float:
    """Slope along z of the gap of modified flanks of gear mesh m over the path of contact, m/m."""
    table, count = pairs.slice_table[pairs.table[m]], int(pairs.slices[m])
    if count == 0:
        return 0.0
    s = pairs.table_start[pairs.table[m]] + pairs.table_step[pairs.table[m]] * np.arange(len(table))
    z, stiffness, gap = np.split(table[:, LINE_COLUMNS : LINE_COLUMNS + 3 * count], 3, axis=1)
    path = s[:, None] + pairs.slope[m] * z
    on = (stiffness > 0) & (path >= pairs.path_lo[m]) & (path <= pairs.path_hi[m])
    if not np.any(gap[on]):
        return 0.0
    # least squares weighted by the length of the contact line, which is divided into equal slices
    length = np.abs(np.ptp(z, axis=1)) * (count / max(count - 1, 1))
    weight = np.sqrt(np.broadcast_to(length[:, None], z.shape)[on])
    terms = np.column_stack([np.ones(on.sum()), z[on], path[on]]) * weight[:, None]
    return float(np.linalg.lstsq(terms, gap[on] * weight, rcond=None)[0][1])


def _rotations(recovery: Recovery) -> Array:
    """Elastic rotations (t, blocks, 2) of the contact blocks about x and y of their frames, rad."""
    blocks = recovery.modal.system.blocks
    rows = blocks.reshape(-1, 6, blocks.shape[1])[:, 3:5].reshape(-1, blocks.shape[1])
    return recovery.motion(rows).reshape(-1, len(blocks) // 6, 2)


def _planet_bearing(system: System, m: int) -> str:
    """Name of the planet bearing of gear mesh m, whether there is one or not."""
    label = system.gear_meshes[m]
    return f"{list(system.frames)[label.stage]}.planet_bearing_{label.planet + 1}"


def _rotations_to_pins(recovery: Recovery) -> dict[str, Array]:
    """Rotations (t, 2) of pins minus those of their planets about x and y of planet axes, rad, by
    name of the planet bearing."""
    system = recovery.modal.system
    names = {_planet_bearing(system, m) for m in range(len(system.gear_meshes))}
    rows = {link.name: link.rows[3:5] for link in system.links if link.name in names}
    rows |= {x.name: x.rows[3:5] for x in system.rotating_frame_supports if x.name in names}
    if not rows:
        return {}
    motion = recovery.motion(np.vstack(list(rows.values())))
    return {name: motion[:, 2 * k : 2 * k + 2] for k, name in enumerate(rows)}
