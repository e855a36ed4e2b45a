"""How many elastic modes the second reduction keeps for a wanted accuracy.

A dropped mode answers statically, p pᵀ/ω_j² instead of p pᵀ/(ω_j² − w² + iwd_j), p its motion in
the contact rows V and d_j = 2ζω_j. Under excitation up to w the flexibility of the contact is then
wrong by at most

    E = Σ_dropped p pᵀ e_j,   e_j = |1/(ω_j² − w² + iwd_j) − 1/ω_j²|,

which rises with w up to ω_j, so that the top of the band is the worst. It is compared with

    C = |k|⁻¹ + Σ_{2ω_j² ≥ w²} p pᵀ/ω_j²,

the flexibility of the tooth pairs and of all modes that resist at w by their stiffness. Softer
modes resist by their mass there; to count their static flexibility would hide errors behind a soft
mount. The estimate ‖C^{−1/2} E C^{−1/2}‖ bounds the error under every pattern of row forces and, as
FᵀCF ≤ λ holds for the forces F of a coupled mode with eigenvalue λ ≤ w² (φᵀMφ = 1), to first order
the relative change of λ. Dropped modes lose their mass and keep their stiffness: natural
frequencies only rise (Rayleigh). Gyroscopic terms are not judged.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import Rows, pair_rows, row_motions
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

EQUAL = 1e-6  # relative gap below which frequencies are equal
POSITIONS = 4  # of the train; rows of other positions differ by about one per cent
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
CHUNK = 64  # cuts judged at a time


@dataclass(frozen=True)
class ModeChoice:
    """Which elastic modes are kept, and what that costs.

    count: their number; limit_hz: the highest kept frequency, 0 without any; band_hz: excitation up
    to which ``estimates`` hold; accuracy: asked for, or None where a limit was given; estimates:
    (m + 1,) relative error of the contact's flexibility with 0 … m modes kept, falling, infinite
    where a dropped mode lies in the band.
    """

    count: int
    limit_hz: float
    band_hz: float
    accuracy: float | None
    estimates: Array

    @property
    def estimate(self) -> float:
        """Relative error of the contact's flexibility up to the band."""
        return float(self.estimates[self.count])


def cuts(omega: Array) -> NDArray[np.int64]:
    """Numbers of modes that may be kept of ω (m,), rising: none splits equal frequencies."""
    gaps = np.flatnonzero(np.diff(omega) > EQUAL * omega[1:]) + 1
    return np.unique(np.concatenate([[0], gaps, [len(omega)]])).astype(np.int64)


def choose_modes(
    omega: Array,
    estimates: Array,
    band_hz: float,
    *,
    accuracy: float | None = None,
    limit_hz: float | None = None,
) -> ModeChoice:
    """The fewest modes whose estimate is at most ``accuracy``; without it all up to ``limit_hz``.

    omega: (m,) rad/s, rising; estimates: (m + 1,). Given both, ``limit_hz`` is an upper bound:
    FlexgearError where the accuracy needs more.
    """
    hz = omega / (2 * np.pi)
    number = len(omega) if limit_hz is None else int(np.sum(hz <= limit_hz))
    if accuracy is not None:
        allowed = cuts(omega)
        needed = int(allowed[np.argmax(estimates[allowed] <= accuracy)])
        if needed > number:
            raise FlexgearError(
                f"an accuracy of {accuracy:g} up to {band_hz:g} Hz needs modes to "
                f"{hz[needed - 1]:.0f} Hz, but modes_to is {limit_hz:g} Hz (estimate there "
                f"{estimates[number]:.3g}): raise modes_to_hz or leave it out"
            )
        number = needed
    return ModeChoice(
        number, float(hz[number - 1]) if number else 0.0, band_hz, accuracy, estimates
    )


def mode_estimates(system: System, omega: Array, phi: Array, band_hz: float) -> Array:
    """Relative error (m + 1,) of the contact's flexibility with the first 0 … m modes kept.

    omega: (m,) rad/s rising, phi: (d, m) all elastic modes of the constant part. The largest over
    positions of the train and over both flanks. Torques at the ports count like row forces, by the
    strain of the row forces that they cause when nothing but inertia holds the train.
    """
    w = 2 * np.pi * band_hz
    m = len(omega)
    out = np.zeros(m + 1)
    first = int(np.sum(omega <= w))
    out[:first] = np.inf
    if first == m:
        return out
    loss = _loss(omega[first:], system.damping.rate(omega[first:]), w)
    blocks = system.blocks @ np.hstack([system.rigid, phi])
    for rows, n in _positions(system):
        stiffness = rows.row["stiffness"][:n]
        at = np.flatnonzero(stiffness != 0.0)
        motion = row_motions(rows, n, blocks)[at] * np.sqrt(np.abs(stiffness[at]))[:, None]
        scaled = _scaled(system, omega, phi, motion, np.sign(stiffness[at]), w)
        np.maximum(out[first:-1], _norms(scaled[:, first:], loss), out=out[first:-1])
    # exact sums fall with every mode; rounding may not
    out[first:] = np.maximum.accumulate(out[first:][::-1])[::-1]
    return out


def _loss(omega: Array, damping: Array, w: float) -> Array:
    """e_j of modes above the excitation w, s²."""
    turn = 1j * w * damping
    return np.asarray(np.abs((w**2 - turn) / (omega**2 * (omega**2 - w**2 + turn))))


def _positions(system: System) -> Iterator[tuple[Rows, int]]:
    """Rows of each flank at rotations spread evenly over a turn, without a common period."""
    pairs, f = system.pairs, len(system.input_rows)
    carrying = carrying_flanks(pairs)
    flanks = [carrying]
    if pairs.one_sided and np.any(carrying == 0):
        flanks.append(np.where(pairs.sided == 1, 1 - carrying, carrying))
    rows = pair_rows(pairs)
    for i in range(POSITIONS):
        input_angles = 2 * np.pi * np.modf(i * GOLDEN ** np.arange(1.0, f + 1))[0]
        theta = system.theta(input_angles)
        for carrying in flanks:
            n, _ = build_rows(system.pairs, rows, theta, carrying)
            yield rows, int(n)


def _scaled(
    system: System, omega: Array, phi: Array, motion: Array, sign: Array, w: float
) -> Array:
    """Motion of rows and ports (r, m) in modes, in units in which C is the identity.

    motion: (n, rigid + m) of the rows times √|k|.
    """
    rigid, elastic = np.split(motion, [system.rigid.shape[1]], axis=1)
    stiff = 2 * omega**2 >= w**2
    held = elastic[:, stiff] / omega[stiff]
    c = np.eye(len(motion)) + held @ held.T
    rows = linalg.solve_triangular(np.linalg.cholesky(c), elastic, lower=True)
    ports = system.port_rows @ phi
    forces = _row_forces(system, omega, ports, rigid, elastic, sign)
    strain = np.einsum("rp,rs,sp->p", forces, c, forces)
    loaded = strain > 0
    return np.vstack([rows, ports[loaded] / np.sqrt(strain[loaded])[:, None]])


def _row_forces(
    system: System, omega: Array, ports: Array, rigid: Array, elastic: Array, sign: Array
) -> Array:
    """Row forces over √|k| (n, P) when a unit torque at a port is held by the train's inertia.

    Rows close on the torque's elastic motion; rolling takes the acceleration that its inertia
    allows, so that the rigid motions are in balance.
    """
    rolling = system.rolling
    inertia = system.mass @ rolling
    torque = system.port_rows.T
    load = torque - inertia @ np.linalg.solve(rolling.T @ inertia, rolling.T @ torque)
    n, r = rigid.shape
    left = np.zeros((n + r, n + r))
    left[:n, :n] = np.diag(sign) + (elastic / omega**2) @ elastic.T
    left[:n, n:], left[n:, :n] = -rigid, rigid.T
    right = np.vstack([(elastic / omega**2) @ ports.T, system.rigid.T @ load])
    # rolling moves no row: the system is singular and consistent
    return np.asarray(np.linalg.lstsq(left, right, rcond=1e-10)[0][:n])


def _norms(scaled: Array, loss: Array) -> Array:
    """Largest eigenvalue of Σ_{j ≥ n} e_j p_j p_jᵀ for n = 0 … m − 1 of scaled (r, m)."""
    r, m = scaled.shape
    out = np.zeros(m)
    total = np.zeros((r, r))
    for stop in range(m, 0, -CHUNK):
        part = (
            scaled[:, max(0, stop - CHUNK) : stop] * np.sqrt(loss[max(0, stop - CHUNK) : stop])
        ).T
        sums = total + np.cumsum((part[:, :, None] * part[:, None, :])[::-1], axis=0)
        total = sums[-1]
        out[max(0, stop - CHUNK) : stop] = np.linalg.eigvalsh(sums)[::-1, -1]
    return out
