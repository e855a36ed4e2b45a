"""Gear-mesh elements: one contact row for every tooth pair in mesh at a carrier angle.

For planet i and pair index k the path coordinate at z = 0 is s = s0_i + k p_bt + (ds/dθ) θ; the
pair exists while its helical contact line lies inside the path of contact. The row of a pair is
the compression along the 3D line of action

    δ = Nᵀ (u_gear(C) − u_planet(C)) + e − gap,    F = k(s) δ + c δ̇ ,

with C = T_p − (s + t z_c) n + z_c e_z in planet axes and N = cosβ_b n + sinβ_b e_z. Coefficients
of large coordinates (tangential displacement and rotation about the axis) do not vary with C.

Compiled with numba: these loops run at every time step. ``PairData`` is constant, ``PairRows`` is
the work space of one evaluation. Blocks are 6-dof nodes: ring teeth 0 … z_r − 1, planets, sun,
then the nodes of rotating supports.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]

SLOTS = 4  # most pairs of one gear mesh that are in contact at once; checked when data are built
KINDS = ("ring", "sun", "ring_back", "sun_back")


class PairData(NamedTuple):
    """Constant data of all gear meshes; first index g is the kind in the order of ``KINDS``."""

    planets: int
    ring_teeth: int
    lumped: bool
    one_sided: bool
    center_distance: float
    phi: Array  # (N,) planet angles in the carrier frame, rad
    tooth_position: Array  # (z_r, 3) ring tooth nodes, m
    is_ring: IntArray  # (G,)
    s0: Array  # (G, N) m
    rate: Array  # (G,) m/rad
    pitch: Array  # (G,) transverse base pitch, m
    s_lo: Array  # (G,)
    s_hi: Array  # (G,)
    slope: Array  # (G,) t = ds/dz
    half_face: float
    normal: Array  # (G, 2)
    tangent_point: Array  # (G, 2) m
    cos_b: Array  # (G,)
    sin_b: Array  # (G,)
    s_pitch: Array  # (G,) path coordinate of the pitch point, m
    gap: Array  # (G,) m
    table_start: Array  # (G,)
    table_step: Array  # (G,)
    k_table: Array  # (G, M) N/m
    z_table: Array  # (G, M) m
    gear_tooth0: IntArray  # (G, N)
    gear_step: IntArray  # (G,)
    gear_teeth: IntArray  # (G,)
    planet_tooth0: IntArray  # (G, N)
    planet_step: IntArray  # (G,)
    planet_teeth: int
    error_amplitude: Array  # (G, N) m
    error_phase: Array  # (G, N) rad
    error_offset: Array  # (G, N) m
    error_gear: Array  # (G, z_max) m
    error_planet: Array  # (G, N, z_p) m
    largest_error: Array  # (G, N) m, largest sum of errors of a pair
    damping: Array  # (G,) 2 ζ √m_eq, so that c = damping √k
    support_block: IntArray  # (n_s, 2) blocks of a rotating support row, −1 none
    support_vector: Array  # (n_s, 2, 6) fixed-frame vectors
    support_stiffness: Array  # (n_s,) N/m, of either sign
    support_turns: IntArray  # (n_s, 2) 1 where the block turns with the carrier


class PairRows(NamedTuple):
    """Work space: rows (contact equations) and pairs (tooth pairs that share a row)."""

    kind: IntArray  # (R,) g, or −1 for a support row
    planet: IntArray
    stiffness: Array
    damping: Array
    offset: Array  # e − gap, m
    blocks: IntArray  # (R, B)
    width: IntArray  # blocks of a row
    reach: IntArray  # local blocks of this row and later ones
    coef: Array  # (R, B, 6)
    pair_row: IntArray  # (P,)
    pair_kind: IntArray
    pair_planet: IntArray
    pair_slot: IntArray
    pair_tooth: IntArray
    pair_planet_tooth: IntArray
    pair_stiffness: Array
    pair_share: Array
    pair_s: Array
    pair_z: Array
    pair_index: IntArray
    pair_error: Array


def pair_rows(data: PairData) -> PairRows:
    """Empty work space for ``data``."""
    pairs = len(KINDS) * data.planets * SLOTS
    rows = pairs + len(data.support_stiffness)
    width = SLOTS + 1

    def ints(*shape: int) -> IntArray:
        return np.zeros(shape, dtype=np.int64)

    def reals(*shape: int) -> Array:
        return np.zeros(shape)

    return PairRows(
        kind=ints(rows),
        planet=ints(rows),
        stiffness=reals(rows),
        damping=reals(rows),
        offset=reals(rows),
        blocks=ints(rows, width),
        width=ints(rows),
        reach=ints(rows),
        coef=reals(rows, width, 6),
        pair_row=ints(pairs),
        pair_kind=ints(pairs),
        pair_planet=ints(pairs),
        pair_slot=ints(pairs),
        pair_tooth=ints(pairs),
        pair_planet_tooth=ints(pairs),
        pair_stiffness=reals(pairs),
        pair_share=reals(pairs),
        pair_s=reals(pairs),
        pair_z=reals(pairs),
        pair_index=ints(pairs),
        pair_error=reals(pairs),
    )


@njit(cache=True)
def _interpolate(table, start, step, x):
    y = (x - start) / step
    n = table.shape[0]
    if y <= 0.0:
        return table[0]
    if y >= n - 1:
        return table[n - 1]
    j = int(y)
    w = y - j
    return (1.0 - w) * table[j] + w * table[j + 1]


@njit(cache=True)
def _planet_row(coef, d, g, cx, cy, cz):
    """−[N; C × N] in planet axes."""
    nx, ny, nz = d.cos_b[g] * d.normal[g, 0], d.cos_b[g] * d.normal[g, 1], d.sin_b[g]
    # in-plane moment arm is that of the tangent point for every point of the line of action
    tx, ty = d.tangent_point[g, 0], d.tangent_point[g, 1]
    coef[0] = -nx
    coef[1] = -ny
    coef[2] = -nz
    coef[3] = -(cy * nz - cz * ny)
    coef[4] = -(cz * nx - cx * nz)
    coef[5] = -(tx * ny - ty * nx)


@njit(cache=True)
def _gear_row(coef, d, g, i, theta, cx, cy, cz, tooth, weight):
    """+[N; (C − X) × N] in the gear's frame: fixed for the ring, carrier frame for the sun."""
    angle = d.phi[i]
    if d.is_ring[g] == 1:
        angle += theta
    ca, sa = math.cos(angle), math.sin(angle)
    bx, by = d.cos_b[g] * d.normal[g, 0], d.cos_b[g] * d.normal[g, 1]
    nx, ny, nz = ca * bx - sa * by, sa * bx + ca * by, d.sin_b[g]
    px, py = d.center_distance + cx, cy
    x, y, z = ca * px - sa * py, sa * px + ca * py, cz
    if d.is_ring[g] == 1:
        x -= d.tooth_position[tooth, 0]
        y -= d.tooth_position[tooth, 1]
        z -= d.tooth_position[tooth, 2]
        mz = x * ny - y * nx
    else:
        tx, ty = d.center_distance + d.tangent_point[g, 0], d.tangent_point[g, 1]
        mz = tx * by - ty * bx
    coef[0] = weight * nx
    coef[1] = weight * ny
    coef[2] = weight * nz
    coef[3] = weight * (y * nz - z * ny)
    coef[4] = weight * (z * nx - x * nz)
    coef[5] = weight * mz


@njit(cache=True)
def _support_rows(d, rows, theta, n):
    ca, sa = math.cos(theta), math.sin(theta)
    for r in range(d.support_stiffness.shape[0]):
        rows.kind[n] = -1
        rows.planet[n] = r
        rows.stiffness[n] = d.support_stiffness[r]
        rows.damping[n] = 0.0
        rows.offset[n] = 0.0
        m = 0
        for b in range(2):
            block = d.support_block[r, b]
            if block < 0:
                continue
            w = d.support_vector[r, b]
            rows.blocks[n, m] = block
            if d.support_turns[r, b] == 1:  # w fixed, node turns with the carrier: Rᵀ w
                for o in (0, 3):
                    rows.coef[n, m, o] = ca * w[o] + sa * w[o + 1]
                    rows.coef[n, m, o + 1] = -sa * w[o] + ca * w[o + 1]
                    rows.coef[n, m, o + 2] = w[o + 2]
            else:
                for o in range(6):
                    rows.coef[n, m, o] = w[o]
            m += 1
        rows.width[n] = m
        n += 1
    return n


@njit(cache=True)
def build_rows(d, rows, theta, wanted):
    """Fill ``rows`` at carrier angle ``theta`` (rad); return (number of rows, number of pairs).

    wanted (G, N): 1 where the gear mesh of that kind and planet is to be looked at.
    """
    n = 0
    p = 0
    planet_block = d.ring_teeth
    sun_block = d.ring_teeth + d.planets
    for g in range(d.s0.shape[0]):
        reach = abs(d.slope[g]) * d.half_face
        for i in range(d.planets):
            if wanted[g, i] == 0:
                continue
            base = d.s0[g, i] + d.rate[g] * theta
            k_lo = math.ceil((d.s_lo[g] - reach - base) / d.pitch[g])
            k_hi = math.floor((d.s_hi[g] + reach - base) / d.pitch[g])
            first = p
            total = 0.0
            for k in range(k_lo, k_hi + 1):
                s = base + k * d.pitch[g]
                stiffness = _interpolate(d.k_table[g], d.table_start[g], d.table_step[g], s)
                if stiffness <= 0.0:
                    continue
                tooth = (d.gear_tooth0[g, i] + d.gear_step[g] * k) % d.gear_teeth[g]
                other = (d.planet_tooth0[g, i] + d.planet_step[g] * k) % d.planet_teeth
                rows.pair_kind[p] = g
                rows.pair_planet[p] = i
                rows.pair_slot[p] = k % SLOTS
                rows.pair_index[p] = k
                rows.pair_tooth[p] = tooth
                rows.pair_planet_tooth[p] = other
                rows.pair_stiffness[p] = stiffness
                rows.pair_s[p] = s
                rows.pair_z[p] = _interpolate(d.z_table[g], d.table_start[g], d.table_step[g], s)
                rows.pair_error[p] = (
                    d.error_offset[g, i]
                    + d.error_amplitude[g, i]
                    * math.sin(2 * math.pi * s / d.pitch[g] + d.error_phase[g, i])
                    + d.error_gear[g, tooth]
                    + d.error_planet[g, i, other]
                )
                total += stiffness
                p += 1
            if p == first:
                continue
            last = p
            if d.lumped:
                s, z = d.s_pitch[g], 0.0
                cx = d.tangent_point[g, 0] - s * d.normal[g, 0]
                cy = d.tangent_point[g, 1] - s * d.normal[g, 1]
                rows.kind[n] = g
                rows.planet[n] = i
                rows.stiffness[n] = total
                rows.damping[n] = d.damping[g] * math.sqrt(total)
                rows.blocks[n, 0] = planet_block + i
                _planet_row(rows.coef[n, 0], d, g, cx, cy, z)
                error = 0.0
                m = 1
                for q in range(first, last):
                    share = rows.pair_stiffness[q] / total
                    rows.pair_row[q] = n
                    rows.pair_share[q] = share
                    error += share * rows.pair_error[q]
                    if d.is_ring[g] == 1:
                        tooth = rows.pair_tooth[q]
                        rows.blocks[n, m] = tooth
                        _gear_row(rows.coef[n, m], d, g, i, theta, cx, cy, z, tooth, share)
                        m += 1
                if d.is_ring[g] == 0:
                    rows.blocks[n, m] = sun_block
                    _gear_row(rows.coef[n, m], d, g, i, theta, cx, cy, z, 0, 1.0)
                    m += 1
                rows.width[n] = m
                rows.offset[n] = error - d.gap[g]
                n += 1
                continue
            for q in range(first, last):
                z = rows.pair_z[q]
                s = rows.pair_s[q] + d.slope[g] * z
                cx = d.tangent_point[g, 0] - s * d.normal[g, 0]
                cy = d.tangent_point[g, 1] - s * d.normal[g, 1]
                tooth = rows.pair_tooth[q]
                rows.kind[n] = g
                rows.planet[n] = i
                rows.stiffness[n] = rows.pair_stiffness[q]
                rows.damping[n] = d.damping[g] * math.sqrt(rows.pair_stiffness[q])
                rows.offset[n] = rows.pair_error[q] - d.gap[g]
                rows.width[n] = 2
                rows.blocks[n, 0] = planet_block + i
                _planet_row(rows.coef[n, 0], d, g, cx, cy, z)
                rows.blocks[n, 1] = tooth if d.is_ring[g] == 1 else sun_block
                _gear_row(rows.coef[n, 1], d, g, i, theta, cx, cy, z, tooth, 1.0)
                rows.pair_row[q] = n
                rows.pair_share[q] = 1.0
                n += 1
    n = _support_rows(d, rows, theta, n)
    return n, p


@njit(cache=True)
def contact_forces(d, rows, theta, wanted, pair_load, support_load, out):
    """Generalised contact forces −Σ V F on the blocks, (6 n_blocks,), from stored pair loads.

    pair_load: (G, N, SLOTS) N; support_load: (n_s,) N. ``out`` is overwritten. Returns rows.
    """
    n, p = build_rows(d, rows, theta, wanted)
    out[:] = 0.0
    for q in range(p):
        r = rows.pair_row[q]
        load = pair_load[rows.pair_kind[q], rows.pair_planet[q], rows.pair_slot[q]]
        if load == 0.0:
            continue
        for m in range(rows.width[r]):  # loads of pairs that share a row add up to its force
            b = rows.blocks[r, m]
            for o in range(6):
                out[6 * b + o] -= load * rows.coef[r, m, o]
    for r in range(n):
        if rows.kind[r] >= 0:
            continue
        load = support_load[rows.planet[r]]
        for m in range(rows.width[r]):
            b = rows.blocks[r, m]
            for o in range(6):
                out[6 * b + o] -= load * rows.coef[r, m, o]
    return n
