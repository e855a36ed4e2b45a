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

from flexgear.analysis.lines import put
from flexgear.analysis.near import spread
from flexgear.coupling.compiled import FAST, INNER
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
    """Rows and damping forces of the last step, and work space; ``booked`` empty: no account."""

    rows: PairRows
    booked: NDArray[np.int64]  # (1,) rows of the last step, −1 before the first
    old: Array  # (n_c,) motion
    damping_load: Array  # (R,) F − k⟨δ⟩ of the last step
    fresh: Array  # (R,) the same of this step


@njit(**INNER)
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


@njit(**INNER)
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


@njit(**INNER)
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


@njit(**INNER)
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


@njit(**INNER, fastmath=FAST)
def _modal(omega2, damping, eta, velocity, old_eta, old_velocity):
    """Kinetic and elastic energy of modes, and what modal damping took."""
    kinetic = 0.0
    elastic = 0.0
    dissipated = 0.0
    for j in range(eta.shape[0]):
        v = velocity[j]
        kinetic += 0.5 * v * v
        elastic += 0.5 * omega2[j] * eta[j] * eta[j]
        dissipated += damping[j] * 0.5 * (v + old_velocity[j]) * (eta[j] - old_eta[j])
    return kinetic, elastic, dissipated


@njit(**INNER)
def settle(
    omega2, damping, ports, rows, n, x, old_eta, old_velocity, eta, velocity, old_torques, torques,
    near, now, energy, ledger,
):  # fmt: skip
    """Book one step from the old to the new modal state and torques (P,).

    near: ``motion`` of the last step, which gets that of this one from ``line_2``; ``line``
    holds R f of the new ``forces``. now: (n_c,) gets the new motion of channels at hand.
    """
    first_port = now.shape[0] - ports
    before = ledger.booked[0]
    old = ledger.old
    spread(near, near.motion, ports, old)
    spread(near, near.line_2, ports, now)
    put(near.motion, near.line_2)
    kinetic, elastic, dissipated = _modal(omega2, damping, eta, velocity, old_eta, old_velocity)
    for c in range(near.line.shape[0]):
        elastic += 0.5 * near.forces[c] * near.line[c]  # ½ fᵀ R f
    _damping_loads(rows, n, x, now, ledger.fresh)
    energy_now = row_energy(rows, n, now)
    if before >= 0:
        for t in range(ports):
            moved = now[first_port + t] - old[first_port + t]
            account = 3 if t < ports - 1 else 4
            energy[account] += 0.5 * (torques[t] + old_torques[t]) * moved
        energy[5] += dissipated
        energy[6] += 0.5 * (
            _damping_work(rows, n, ledger.fresh, now, old)
            + _damping_work(ledger.rows, before, ledger.damping_load, now, old)
        )
        energy[7] += 0.5 * (
            energy_now
            + row_energy(rows, n, old)
            - row_energy(ledger.rows, before, now)
            - row_energy(ledger.rows, before, old)
        )
    energy[0] = kinetic
    energy[1] = elastic
    energy[2] = energy_now
    for i in range(n):
        ledger.damping_load[i] = ledger.fresh[i]
    _copy_rows(rows, n, ledger.rows)
    ledger.booked[0] = n
