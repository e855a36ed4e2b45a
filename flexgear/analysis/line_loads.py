"""Load along the face: forces of slices, loads of edges, first touch, stiffness, misalignment.

The mean line load of a gear mesh at an instant is its force over the length along the face that
its contact lines have on the path of contact, touching or not: what even sharing would put
everywhere. Off the path the tip edge of one gear presses on its mate. At an end of the face it is
the slice of a line there, as far as that is on the path.

Rigid bodies without tilt that close along N touch at w = min (g_j − e_j) over the slices j of all
pairs, g_j being the gap of both flanks and e_j the errors of the pair: the unloaded transmission
error, the envelope of what single pairs would do.

Where all rows of a gear mesh are closed by x, their forces are F = f(x − B F) with the tangents T
of the pairs (block by block) and what neighbouring pairs yield to each other, B. Its stiffness is

    dΣF/dx = 1ᵀ (I + T B)⁻¹ T 1 ,

of the teeth alone, bodies being held.

The approach of two flanks along N is Nᵀ(u_gear − u_planet) at C = T_p − (s + t z) n + z e_z. From
one end of a contact line to the other only rotations change it, by ω · (dC/dz × N):

    dC/dz × N = (e_z − t n) × (cosβ_b n + sinβ_b e_z) = (e_z × n)/cosβ_b,    t = tanβ_b,

so the misalignment per width is the part of θ_gear − θ_planet along that vector. The planet's
rotation is that of its pin and what its bearing gives way, θ_planet = θ_pin + (θ_planet − θ_pin);
what is θ_gear, the body says. Helix slope deviations of ``errors`` add to it as they are. Of
modified flanks it is the slope along z of the plane that lies best in their gap g(path, z) over the
path of contact, by least squares: the slope of a ground helix, none of crowning or relief.
"""

from __future__ import annotations

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
from flexgear.coupling.kernels.pairs import BESIDE, fill_rows
from flexgear.coupling.laws.coupled_slices import forces_of
from flexgear.coupling.pair_data import FOLLOWING, KINDS, OF_LINE, PairData, narrowing_columns
from flexgear.coupling.system import System
from flexgear.gears.slices import Line, line_ends

LEAST_WIDTH = 1e-6  # of half a face: shorter contact lines have no line load, but rounding over it


@dataclass(frozen=True)
class LineLoads:
    """Slices of gear meshes over samples, (t, M, slots, K), NaN where no pair has slices.

    force N, elastic; z m, middle of a slice along the face; path m, path coordinate there;
    line_load N/m of the face (per length along z, NaN where a contact line has no length); gap m
    between the unloaded flanks there; width m along z; narrowing: half width of the contact of
    modified flanks over that of involutes', at the mean line load of the gear mesh.
    ends: (t, M, slots, 2) m of the contact line along z. approach, tilt: (t, M, slots) m and m/m,
    how far the bodies have closed along N at z = 0 and its slope along z, errors not counted.
    tangent: (t, M, slots, 2, 2) N/m of the pair's two rows under its load.
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
    most = int(pairs.slices.max(initial=0))
    if most == 0:
        return None
    shape = result.pair_load.shape

    def empty(*more: int) -> Array:
        return np.full((*shape, *more), np.nan)

    force, z, path, line_load, gap, width, narrowing = (empty(most) for _ in range(7))
    of_pairs = empty(2), empty(), empty(), empty(2, 2)
    out = LineLoads(force, z, path, line_load, gap, width, narrowing, *of_pairs)
    for m, count in enumerate(pairs.slices):
        if count:
            _of_gear_mesh(result, pairs, m, int(count), out)
    return out


def _of_gear_mesh(
    result: Equilibrium | Transient, pairs: PairData, m: int, count: int, out: LineLoads
) -> None:
    at = np.nonzero(result.pair_tooth[:, m] >= 0)  # samples and slots
    s, approaches = result.pair_position[:, m][at], result.pair_approach[:, m][at]
    teeth = teeth_of_pairs(pairs, m, s, result.theta[at[0], pairs.angle[m]])
    tables = pairs.table[m] + pairs.gear_table[m, teeth[0]] + pairs.planet_table[m, teeth[1]]
    values = interpolated(pairs, m, s, tables)
    radius = values[:, 0]
    z, stiffness, gap = np.split(values[:, OF_LINE : OF_LINE + 3 * count], 3, axis=1)
    centre = line_centres(pairs, m, s, tables)
    with np.errstate(divide="ignore", invalid="ignore"):
        lever = np.where(radius > 0, 0.5 / radius, 0.0)
    tilt = lever * (approaches[:, 1] - approaches[:, 0])
    turned = lever * (approaches[:, 3] - approaches[:, 2])
    middle, approach = approaches[:, :2].mean(axis=1), approaches[:, 2:].mean(axis=1)
    x = middle[:, None] + tilt[:, None] * (z - centre[:, None]) - gap
    second_share = 0.5 + lever[:, None] * (
        z - centre[:, None]
    )  # share of the second row in each slice
    if pairs.bent[m]:
        force, tangent = forces_of(x, second_share, values[:, OF_LINE + 3 * count :])
    else:
        force, shares = (
            stiffness * np.maximum(x, 0.0),
            np.stack([1.0 - second_share, second_share], axis=1),
        )
        tangent = np.einsum("nik,njk,nk->nij", shares, shares, stiffness * (x > 0.0))
    low, high = _line_ends_of(pairs, m, s)
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
    """Teeth of the gear and of the planet, from 0, of pairs of gear mesh m at path coordinates s,
    m, when the stage's angle is theta, rad."""
    k = np.rint((s - pairs.s0[m] - pairs.rate[m] * theta) / pairs.pitch[m]).astype(np.int64)
    tooth = (pairs.gear_tooth0[m] + pairs.gear_step[m] * k) % pairs.gear_teeth[m]
    return tooth, (pairs.planet_tooth0[m] + pairs.planet_step[m] * k) % pairs.planet_teeth[m]


def line_centres(pairs: PairData, m: int, s: Array, tables: Ints | None = None) -> Array:
    """Places (n,) m along the face of the centres of contact lines of gear mesh m at s (n,), m:
    the rows of a pair stand beside it; tables (n,): by the pairs' teeth, of sound ones if left out.
    """
    return _at(pairs, m, pairs.z_table, s, tables)


def interpolated(pairs: PairData, m: int, s: Array, tables: Ints | None = None) -> Array:
    """Rows (n, …) of the tables of slices of gear mesh m at path coordinates s (n,), m; tables: as
    for ``line_centres``."""
    return _at(pairs, m, pairs.slice_table, s, tables)


def _at(pairs: PairData, m: int, values: Array, s: Array, tables: Ints | None) -> Array:
    first, last = pairs.table[m], values.shape[1] - 1
    y = np.clip((s - pairs.table_start[first]) / pairs.table_step[first], 0.0, float(last))
    j, k = np.minimum(y.astype(int), last - 1), first if tables is None else tables
    w = (y - j).reshape(-1, *[1] * (values.ndim - 2))
    return np.asarray((1.0 - w) * values[k, j] + w * values[k, j + 1])


def _line_ends_of(pairs: PairData, m: int, s: Array) -> tuple[Array, Array]:
    """Ends of contact lines along z (n,), m."""
    span = (float(pairs.s_lo[m]), float(pairs.s_hi[m]))
    return line_ends(s, Line(span, span, float(pairs.slope[m]), float(pairs.half_face[m])))


AT_END = 1e-6  # of half a face: contact lines that end so near its end, end there


class EdgeLoads(NamedTuple):
    """(t, M): mean line load N/m, NaN without load; share of the load off the path, NaN without
    load; largest line load N/m off the path, and in the last slices at the ends of the face."""

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
    """Length (t, M) m along z that contact lines have on the path of contact."""
    length = np.zeros(lines.approach.shape[:2])
    for m in np.flatnonzero(pairs.slices):
        path, slope = (float(pairs.path_lo[m]), float(pairs.path_hi[m])), float(pairs.slope[m])
        s = lines.path[:, m, :, 0] - slope * lines.z[:, m, :, 0]
        start, stop = line_ends(s.ravel(), Line(path, path, slope, float(pairs.half_face[m])))
        length[:, m] = np.nan_to_num(stop - start).reshape(s.shape).sum(axis=1)
    return length


class PairsAt(NamedTuple):
    """Pairs of a result, (t, M, slots): error m at z = 0, less backlash, NaN without a pair;
    planet_tooth from 0, −1 without a pair."""

    error: Array
    planet_tooth: NDArray[np.int16]


def pairs_at(result: Equilibrium | Transient) -> PairsAt:
    """Errors and planets' teeth of all pairs of a result, position by position."""
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
    """By how much flanks have to approach (t, M), m, until a first slice of theirs touches: the
    smallest gap of all slices; NaN where there is no pair.

    error (t, M, slots): as of ``PairsAt``.
    """
    along = pairs.error_slope[:, None, None] * lines.z
    left = np.where(np.isfinite(lines.line_load), lines.gap - error[..., None] - along, np.inf)
    least = left.min(axis=(2, 3))
    return np.where(np.isfinite(least), least, np.nan)


def gear_mesh_stiffness(result: Equilibrium | Transient, lines: LineLoads) -> Array:
    """dΣF/dx (t, M) N/m of gear meshes under their load; 0 where no pair touches."""
    pairs: PairData = result.modal.system.pairs
    stiffness = np.nan_to_num(lines.tangent).sum(axis=(2, 3, 4))
    for m in map(int, np.flatnonzero(pairs.bent)):
        for t in range(len(stiffness)):
            slots = np.flatnonzero(result.pair_tooth[t, m] >= 0)
            if len(slots) > 1:
                slots = slots[np.argsort(result.pair_position[t, m, slots])]
                stiffness[t, m] = _together(
                    pairs, m, result.pair_position[t, m, slots], lines.tangent[t, m, slots]
                )
    return stiffness


def _together(pairs: PairData, m: int, s: Array, tangent: Array) -> float:
    """Stiffness, N/m, of pairs of gear mesh m that carry together and yield to one another, at the
    rising path coordinates s (n,), m; tangent: of each pair alone (n, 2, 2), N/m."""
    n = len(s)
    between = interpolated(pairs, m, s)[:, BESIDE:OF_LINE].reshape(n, 2, FOLLOWING)
    whole, yields = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, 2 * n))
    for k in range(n):
        pair_rows, after = slice(2 * k, 2 * k + 2), slice(2 * k + 2, 2 * k + 2 + FOLLOWING)
        whole[pair_rows, pair_rows] = tangent[k]
        yields[pair_rows, after] = between[k][:, : 2 * (n - k - 1)]
        yields[after, pair_rows] = yields[pair_rows, after].T
    ones = np.ones(2 * n)
    return float(ones @ np.linalg.solve(np.eye(2 * n) + whole @ yields, whole @ ones))


CAUSES = ("ring", "carrier", "planet bearing", "sun", "gear", "errors", "modifications")


def tilt_by_cause(recovery: Recovery) -> Array:
    """(t, M, slots, causes) m/m of ``CAUSES``, how much closer by each the flanks come per width
    towards +z; NaN where there is no pair, 0 for what a gear mesh does not have.

    "carrier" is the pin's tilt, elastic and by the carrier's bearings; "sun" that of sun or pinion
    with its shaft and bearings; "gear" that of the gear of a parallel stage.
    """
    result, pairs = recovery.result, recovery.modal.system.pairs
    turned, pins = _rotations(recovery), _against_pins(recovery)
    by_cause = np.zeros((*result.pair_tooth.shape, len(CAUSES)))
    for m in range(len(pairs.s0)):
        for cause, tilt in _of_bodies(recovery, turned, pins, m).items():
            by_cause[:, m, :, CAUSES.index(cause)] = tilt
        by_cause[:, m, :, CAUSES.index("errors")] = pairs.error_slope[m]
        by_cause[:, m, :, CAUSES.index("modifications")] = -ground_slope(pairs, m)
    by_cause[result.pair_tooth < 0] = np.nan
    return by_cause


def _of_bodies(
    recovery: Recovery, turned: Array, pins: Mapping[str, Array], m: int
) -> dict[str, Array]:
    """Tilts of gear mesh m by bodies, (t, slots) or (t, 1); turned (t, blocks, 2): rotations; pins:
    see ``_against_pins``."""
    result, pairs = recovery.result, recovery.modal.system.pairs
    axis = np.array([-pairs.normal[m, 1], pairs.normal[m, 0]]) / pairs.cos_b[m]
    rotation = turned[:, pairs.gear_block[m], None]
    if pairs.per_tooth[m]:
        tooth = pairs.gear_block[m] + np.maximum(result.pair_tooth[:, m], 0)
        rotation = np.take_along_axis(turned, tooth[:, :, None], axis=1)
    lag = result.theta[:, pairs.turns[m]] if pairs.turns[m] >= 0 else np.zeros(len(turned))
    cos, sin = np.cos(pairs.phi[m] + lag), np.sin(pairs.phi[m] + lag)
    across = np.stack([cos * axis[0] - sin * axis[1], sin * axis[0] + cos * axis[1]], axis=-1)
    gear = KINDS[pairs.kind[m]].gear
    tilt = {gear: np.einsum("tsi,ti->ts", rotation, across)}
    planet = -(turned[:, pairs.planet_block[m]] @ axis)[:, None]
    pin = pins.get(_bearing_of(recovery.modal.system, m))
    if pin is None:
        return {**tilt, "gear": planet}
    bearing = (pin @ axis)[:, None]
    return {**tilt, "planet bearing": bearing, "carrier": planet - bearing}


def ground_slope(pairs: PairData, m: int) -> float:
    """Slope m/m along z of the gap of modified flanks of gear mesh m, over the path of contact."""
    table, count = pairs.slice_table[pairs.table[m]], int(pairs.slices[m])
    if count == 0:
        return 0.0
    s = pairs.table_start[pairs.table[m]] + pairs.table_step[pairs.table[m]] * np.arange(len(table))
    z, stiffness, gap = np.split(table[:, OF_LINE : OF_LINE + 3 * count], 3, axis=1)
    path = s[:, None] + pairs.slope[m] * z
    on = (stiffness > 0) & (path >= pairs.path_lo[m]) & (path <= pairs.path_hi[m])
    if not np.any(gap[on]):
        return 0.0
    # a place of the flank counts by the line's length that a slice stands for
    reach = np.abs(np.ptp(z, axis=1)) * (count / max(count - 1, 1))
    weight = np.sqrt(np.broadcast_to(reach[:, None], z.shape)[on])
    terms = np.column_stack([np.ones(on.sum()), z[on], path[on]]) * weight[:, None]
    return float(np.linalg.lstsq(terms, gap[on] * weight, rcond=None)[0][1])


def _rotations(recovery: Recovery) -> Array:
    """Elastic rotations (t, blocks, 2) of the contact blocks about x and y of their frames."""
    blocks = recovery.modal.system.blocks
    rows = blocks.reshape(-1, 6, blocks.shape[1])[:, 3:5].reshape(-1, blocks.shape[1])
    return recovery.motion(rows).reshape(-1, len(blocks) // 6, 2)


def _bearing_of(system: System, m: int) -> str:
    """Name that the bearing of the planet of gear mesh m would have."""
    label = system.gear_meshes[m]
    return f"{list(system.frames)[label.stage]}.planet_bearing_{label.planet + 1}"


def _against_pins(recovery: Recovery) -> dict[str, Array]:
    """Rotations (t, 2) of pins less those of their planets, in the planets' axes, by bearing."""
    system = recovery.modal.system
    names = {_bearing_of(system, m) for m in range(len(system.gear_meshes))}
    links = [link for link in system.links if link.name in names]
    if not links:
        return {}
    motion = recovery.motion(np.vstack([link.rows[3:5] for link in links]))
    return {link.name: motion[:, 2 * k : 2 * k + 2] for k, link in enumerate(links)}
