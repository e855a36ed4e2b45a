"""Energy account of a time step.

Kinetic and elastic energy of modes, ½ fᵀ R f of the residual flexibility and ½ k ⟨δ⟩² of the pairs
change by the work of the drive, the brake, modal and pair damping, and by *parametric work*: pair
stiffness and contact vectors change with the carrier angle, which the small-motion model imposes.
With E(rows, u) the pair energy of a set of rows at motion u, the parametric work of a step is

    ½ [E(new, u⁺) + E(new, u) − E(old, u⁺) − E(old, u)] ,

second order in the step and free of bookkeeping about which pair entered or left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from flexgear.coupling.pairs import PairRows

Array = NDArray[np.float64]
ENERGIES = (
    "kinetic",
    "elastic",
    "pair_elastic",
    "input_work",
    "brake_work",
    "damping_work",
    "pair_damping_work",
    "parametric_work",
)


class Ledger(NamedTuple):
    """Last step's rows, motion, damping forces and modal velocity; empty arrays: no account."""

    rows: PairRows
    count: NDArray[np.int64]  # (1,) rows of the last step, −1 before the first
    now: Array  # (n_c,) motion
    old: Array  # (n_c,)
    forces: Array  # (n_c,)
    damping_load: Array  # (R,) F − k⟨δ⟩ of the last step
    eta: Array  # (n,)
    velocity: Array  # (n,)


@njit(cache=True)
def row_energy(rows, n, motion, one_sided):
    """Σ ½ k ⟨δ⟩² over rows at a channel motion."""
    total = 0.0
    for i in range(n):
        delta = rows.offset[i]
        for a in range(rows.count[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                delta += rows.coef[i, a, p] * motion[base + p]
        if one_sided and rows.kind[i] >= 0 and delta < 0.0:
            continue
        total += 0.5 * rows.stiffness[i] * delta * delta
    return total


@njit(cache=True)
def _damping_loads(rows, n, x, motion, one_sided, out):
    """F − k⟨δ⟩ of every row."""
    for i in range(n):
        delta = rows.offset[i]
        for a in range(rows.count[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                delta += rows.coef[i, a, p] * motion[base + p]
        if one_sided and rows.kind[i] >= 0 and delta < 0.0:
            delta = 0.0
        out[i] = x[i] - rows.stiffness[i] * delta


@njit(cache=True)
def _damping_work(rows, n, load, now, old):
    """Σ load · Vᵀ (u⁺ − u)."""
    total = 0.0
    for i in range(n):
        if load[i] == 0.0:
            continue
        change = 0.0
        for a in range(rows.count[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                change += rows.coef[i, a, p] * (now[base + p] - old[base + p])
        total += load[i] * change
    return total


@njit(cache=True)
def _copy_rows(source, n, target):
    for i in range(n):
        target.kind[i] = source.kind[i]
        target.planet[i] = source.planet[i]
        target.stiffness[i] = source.stiffness[i]
        target.offset[i] = source.offset[i]
        target.count[i] = source.count[i]
        for a in range(source.count[i]):
            target.blocks[i, a] = source.blocks[i, a]
            for p in range(6):
                target.coef[i, a, p] = source.coef[i, a, p]


@njit(cache=True)
def settle(data, pairs, rows, n, x, state, drive, brake, ledger):
    """Book one step; ``state`` holds the new time, ``state.torques`` still the old one."""
    nc = ledger.now.shape[0]
    one_sided = pairs.one_sided
    ledger.forces[:] = 0.0
    for i in range(n):
        for a in range(rows.count[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                ledger.forces[base + p] -= x[i] * rows.coef[i, a, p]
    ledger.forces[nc - 2] = drive
    ledger.forces[nc - 1] = -brake
    ledger.old[:] = ledger.now
    bent = data.residual @ ledger.forces
    ledger.now[:] = data.channel_modes @ state.eta + bent
    e = state.energy
    kinetic = 0.0
    elastic = 0.5 * np.dot(ledger.forces, bent)
    dissipated = 0.0
    for j in range(state.eta.shape[0]):
        v = state.velocity[j]
        kinetic += 0.5 * v * v
        elastic += 0.5 * data.omega2[j] * state.eta[j] ** 2
        mean = 0.5 * (v + ledger.velocity[j])
        dissipated += data.damping[j] * mean * (state.eta[j] - ledger.eta[j])
    fresh = np.empty(n)
    _damping_loads(rows, n, x, ledger.now, one_sided, fresh)
    energy_now = row_energy(rows, n, ledger.now, one_sided)
    before = ledger.count[0]
    if before >= 0:
        moved = ledger.now[nc - 2] - ledger.old[nc - 2]
        turned = ledger.now[nc - 1] - ledger.old[nc - 1]
        e[3] += 0.5 * (drive + state.torques[0]) * moved
        e[4] += 0.5 * (brake + state.torques[1]) * turned
        e[5] += dissipated
        e[6] += 0.5 * (
            _damping_work(rows, n, fresh, ledger.now, ledger.old)
            + _damping_work(ledger.rows, before, ledger.damping_load, ledger.now, ledger.old)
        )
        e[7] += 0.5 * (
            energy_now
            + row_energy(rows, n, ledger.old, one_sided)
            - row_energy(ledger.rows, before, ledger.now, one_sided)
            - row_energy(ledger.rows, before, ledger.old, one_sided)
        )
    e[0] = kinetic
    e[1] = elastic
    e[2] = energy_now
    for i in range(n):
        ledger.damping_load[i] = fresh[i]
    _copy_rows(rows, n, ledger.rows)
    ledger.count[0] = n
    ledger.eta[:] = state.eta
    ledger.velocity[:] = state.velocity
