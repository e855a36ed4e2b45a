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

from flexgear.coupling.pair_data import PairRows

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
    booked: NDArray[np.int64]  # (1,) rows of the last step, −1 before the first
    now: Array  # (n_c,) motion
    old: Array  # (n_c,)
    forces: Array  # (n_c,)
    damping_load: Array  # (R,) F − k⟨δ⟩ of the last step
    eta: Array  # (n,)
    velocity: Array  # (n,)
    old_forces: Array  # (n_c,)
    place: NDArray[np.int64]  # (n_blocks,) work space of the joint list of blocks
    blocks: NDArray[np.int64]


@njit(cache=True)
def row_energy(rows, n, motion):
    """Σ ½ k ⟨δ⟩² over rows at a channel motion."""
    total = 0.0
    for i in range(n):
        delta = rows.offset[i]
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                delta += rows.coef[i, a, p] * motion[base + p]
        if rows.sided[i] == 1 and delta < 0.0:
            continue
        total += 0.5 * rows.stiffness[i] * delta * delta
    return total


@njit(cache=True)
def _damping_loads(rows, n, x, motion, out):
    """F − k⟨δ⟩ of every row."""
    for i in range(n):
        delta = rows.offset[i]
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                delta += rows.coef[i, a, p] * motion[base + p]
        if rows.sided[i] == 1 and delta < 0.0:
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
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                change += rows.coef[i, a, p] * (now[base + p] - old[base + p])
        total += load[i] * change
    return total


@njit(cache=True)
def _copy_rows(source, n, target):
    for i in range(n):
        target.kind[i] = source.kind[i]
        target.sided[i] = source.sided[i]
        target.stiffness[i] = source.stiffness[i]
        target.offset[i] = source.offset[i]
        target.width[i] = source.width[i]
        for a in range(source.width[i]):
            target.blocks[i, a] = source.blocks[i, a]
            for p in range(6):
                target.coef[i, a, p] = source.coef[i, a, p]


@njit(cache=True, fastmath={"reassoc", "contract"})
def _motion(data, blocks, m, eta, forces, loaded, n_loaded, out):
    """Φ η + R f at blocks (m,) and all ports; f lives on ``loaded`` and the ports."""
    nc, n = data.channel_modes.shape
    for c in range(m + 1):
        first, count = (6 * blocks[c], 6) if c < m else (nc - data.ports, data.ports)
        for p in range(count):
            row, line = data.channel_modes[first + p], data.residual[first + p]
            total = 0.0
            for t in range(nc - data.ports, nc):
                total += line[t] * forces[t]
            for j in range(n):
                total += row[j] * eta[j]
            for b in range(n_loaded):
                at = 6 * loaded[b]
                for q in range(6):
                    total += line[at + q] * forces[at + q]
            out[first + p] = total


@njit(cache=True)
def _joint_blocks(rows, n, old, n_old, place, blocks):
    """Blocks touched by either set of rows; the old set's come first. Returns (old, all)."""
    m = 0
    first = 0
    for part in range(2):
        source = old if part == 0 else rows
        for i in range(n_old if part == 0 else n):
            for a in range(source.width[i]):
                b = source.blocks[i, a]
                if place[b] < 0:
                    place[b] = m
                    blocks[m] = b
                    m += 1
        if part == 0:
            first = m
    for j in range(m):
        place[blocks[j]] = -1
    return first, m


@njit(cache=True)
def settle(data, pairs, rows, n, x, state, torques, ledger):
    """Book one step; ``state`` holds the new time, ``state.torques`` still the old one."""
    nc = ledger.now.shape[0]
    before = ledger.booked[0]
    n_old, m = _joint_blocks(rows, n, ledger.rows, max(before, 0), ledger.place, ledger.blocks)
    blocks = ledger.blocks
    # forces of both times on the joint blocks; all else is zero and stays unread
    first_port = nc - data.ports
    ledger.old_forces[first_port:] = ledger.forces[first_port:]
    for c in range(m):
        for p in range(6):
            at = 6 * blocks[c] + p
            ledger.old_forces[at] = ledger.forces[at] if c < n_old else 0.0
            ledger.forces[at] = 0.0
    for i in range(n):
        for a in range(rows.width[i]):
            base = 6 * rows.blocks[i, a]
            for p in range(6):
                ledger.forces[base + p] -= x[i] * rows.coef[i, a, p]
    for t in range(data.ports):
        ledger.forces[first_port + t] = torques[t]
    ledger.forces[nc - 1] = -torques[data.ports - 1]
    _motion(data, blocks, m, state.eta, ledger.forces, blocks, m, ledger.now)
    if before >= 0:
        _motion(data, blocks, m, ledger.eta, ledger.old_forces, blocks, n_old, ledger.old)
    e = state.energy
    kinetic = 0.0
    elastic = 0.0
    dissipated = 0.0
    for c in range(m + 1):  # ½ fᵀ R f = ½ fᵀ (u − Φ η)
        first, count = (6 * blocks[c], 6) if c < m else (nc - data.ports, data.ports)
        for p in range(count):
            f = ledger.forces[first + p]
            if f != 0.0:
                bent = ledger.now[first + p] - np.dot(data.channel_modes[first + p], state.eta)
                elastic += 0.5 * f * bent
    for j in range(state.eta.shape[0]):
        v = state.velocity[j]
        kinetic += 0.5 * v * v
        elastic += 0.5 * data.omega2[j] * state.eta[j] ** 2
        mean = 0.5 * (v + ledger.velocity[j])
        dissipated += data.damping[j] * mean * (state.eta[j] - ledger.eta[j])
    fresh = np.empty(n)
    _damping_loads(rows, n, x, ledger.now, fresh)
    energy_now = row_energy(rows, n, ledger.now)
    if before >= 0:
        for t in range(data.ports):
            moved = ledger.now[first_port + t] - ledger.old[first_port + t]
            account = 3 if t < data.ports - 1 else 4
            e[account] += 0.5 * (torques[t] + state.torques[t]) * moved
        e[5] += dissipated
        e[6] += 0.5 * (
            _damping_work(rows, n, fresh, ledger.now, ledger.old)
            + _damping_work(ledger.rows, before, ledger.damping_load, ledger.now, ledger.old)
        )
        e[7] += 0.5 * (
            energy_now
            + row_energy(rows, n, ledger.old)
            - row_energy(ledger.rows, before, ledger.now)
            - row_energy(ledger.rows, before, ledger.old)
        )
    e[0] = kinetic
    e[1] = elastic
    e[2] = energy_now
    for i in range(n):
        ledger.damping_load[i] = fresh[i]
    _copy_rows(rows, n, ledger.rows)
    ledger.booked[0] = n
    ledger.eta[:] = state.eta
    ledger.velocity[:] = state.velocity
