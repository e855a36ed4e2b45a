r"""Misalignment of gear meshes split by what causes it.

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

import numpy as np
from numpy.typing import NDArray

from flexgear.analysis.recovery import Recovery
from flexgear.coupling.pair_data import KINDS, OF_LINE, PairData
from flexgear.coupling.system import System

Array = NDArray[np.float64]
CAUSES = ("ring", "carrier", "planet bearing", "sun", "gear", "errors", "modifications")
OF_BODIES = CAUSES[:5]  # the others are in the flanks


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
