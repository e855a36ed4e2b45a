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

from flexgear.analysis.near_products import near_values
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
    at: NDArray[np.int64]  # (R, B) near channels of those rows' blocks
    damping_load: Array  # (R,) F − k⟨δ⟩ of the last step
    fresh: Array  # (R,) the same of this step
    row_now: Array  # (R,) Vᵀ u⁺
    row_old: Array  # (R,) Vᵀ u


@njit(**INNER)
def _row_energy(rows, n, change):
    """Σ ½ k ⟨δ⟩² over rows, change (R,) their Vᵀ u."""
    total = 0.0
    for i in range(n):
        delta = rows.offset[i] + change[i]
        if rows.sided[i] == 1 and delta < 0.0:
            continue
        total += 0.5 * rows.stiffness[i] * delta * delta
    return total


@njit(**INNER)
def _damping_loads(rows, n, x, change, out):
    """F − k⟨δ⟩ of every row."""
    for i in range(n):
        delta = rows.offset[i] + change[i]
        if rows.sided[i] == 1 and delta < 0.0:
            delta = 0.0
        out[i] = x[i] - rows.stiffness[i] * delta


@njit(**INNER)
def _damping_work(n, load, now, old):
    """Σ load · Vᵀ (u⁺ − u)."""
    total = 0.0
    for i in range(n):
        total += load[i] * (now[i] - old[i])
    return total


@njit(**INNER)
def _copy_rows(source, source_at, n, target, target_at):
    for i in range(n):
        target.sided[i] = source.sided[i]
        target.stiffness[i] = source.stiffness[i]
        target.offset[i] = source.offset[i]
        target.line[i] = source.line[i]
        target.along[i] = source.along[i]
        target.beyond[i] = source.beyond[i]
        target.width[i] = source.width[i]
        for a in range(source.beyond[i], source.width[i]):
            target_at[i, a] = source_at[i, a]
            for p in range(6):
                target.coef[i, a, p] = source.coef[i, a, p]


@njit(**INNER, fastmath=FAST)
def _modal(omega2, damping, eta, velocity, old_eta, old_velocity):
    """Kinetic and elastic energy of modes, and what modal damping took."""
    kinetic = 0.0
    elastic = 0.0
    dissipated = 0.0
    for j in range(omega2.shape[0]):  # eta and velocity may be longer, in whole cache lines
        v = velocity[j]
        kinetic += 0.5 * v * v
        elastic += 0.5 * omega2[j] * eta[j] * eta[j]
        dissipated += damping[j] * 0.5 * (v + old_velocity[j]) * (eta[j] - old_eta[j])
    return kinetic, elastic, dissipated


@njit(**INNER)
def settle(
    omega2, damping, ports, rows, n, x, old_eta, old_velocity, eta, velocity, old_torques, torques,
    near, energy, ledger,
):  # fmt: skip
    """Book one step from the old to the new modal state and torques (P,).

    near: ``motion`` of the last step, which gets that of this one from ``line_2``; ``line``
    holds R f of the new ``forces``. Slots of the last step still stand.
    """
    before = ledger.booked[0]
    now, old, at, top = near.line_2, near.motion, near.at, near.counts[2]
    kinetic, elastic, dissipated = _modal(omega2, damping, eta, velocity, old_eta, old_velocity)
    for c in range(top):
        elastic += 0.5 * near.forces[c] * near.line[c]  # ½ fᵀ R f
    near_values(
        rows.line, rows.along, at, rows.coef, rows.width, rows.beyond, ports, n, now, old,
        ledger.row_now, ledger.row_old,
    )  # fmt: skip
    _damping_loads(rows, n, x, ledger.row_now, ledger.fresh)
    energy_now = _row_energy(rows, n, ledger.row_now)
    if before >= 0:
        for t in range(ports):
            account = 3 if t < ports - 1 else 4
            energy[account] += 0.5 * (torques[t] + old_torques[t]) * (now[t] - old[t])
        energy[5] += dissipated
        energy[6] += 0.5 * _damping_work(n, ledger.fresh, ledger.row_now, ledger.row_old)
        energy[7] += 0.5 * (energy_now + _row_energy(rows, n, ledger.row_old))
        last = ledger.rows
        near_values(
            last.line, last.along, ledger.at, last.coef, last.width, last.beyond, ports, before,
            now, old, ledger.row_now, ledger.row_old,
        )  # fmt: skip
        energy[6] += 0.5 * _damping_work(
            before, ledger.damping_load, ledger.row_now, ledger.row_old
        )
        energy[7] -= 0.5 * _row_energy(last, before, ledger.row_now)
        energy[7] -= 0.5 * _row_energy(last, before, ledger.row_old)
    energy[0] = kinetic
    energy[1] = elastic
    energy[2] = energy_now
    for i in range(n):
        ledger.damping_load[i] = ledger.fresh[i]
    _copy_rows(rows, at, n, ledger.rows, ledger.at)
    ledger.booked[0] = n
    for c in range(top):
        near.motion[c] = now[c]
