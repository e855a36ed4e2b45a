"""Which elastic modes of a system are kept for a wanted accuracy of the contact's flexibility.

A dropped mode has the static response p pᵀ/ω_j² in place of p pᵀ/(ω_j² − w² + iwd_j), p its motion
in the contact rows V and d_j = 2ζω_j. Under excitation up to w the error of the contact's
flexibility is at most

    E = Σ_dropped p pᵀ e_j,   e_j = |1/(ω_j² − w² + iwd_j) − 1/ω_j²|,

which rises with w up to ω_j, so that it is largest at the top of the band. It is compared with

    C = |k|⁻¹ + Σ_{2ω_j² ≥ w²} p pᵀ/ω_j²,

the flexibility of the tooth pairs and of all modes in which stiffness dominates at w. In softer
modes inertia dominates; including their static flexibility would make errors seem small on a soft
mount. The estimate ‖C^{−1/2} E C^{−1/2}‖ bounds the error for every pattern of row forces and, as
FᵀCF ≤ λ holds for the forces F of a coupled mode with eigenvalue λ ≤ w² (φᵀMφ = 1), to first order
the relative change of λ. Dropped modes lose their mass and keep their stiffness: natural
frequencies only rise (Rayleigh). Gyroscopic terms are neglected in the estimate.

Parts of a train that only gear meshes tie to one another may have bands of their own; w is then the
top of the band of each mode's part. All modes with ω_j² < 2w², where stiffness does not dominate,
are kept; of the others those with the largest |p|² e_j at any position, as many as the accuracy
needs.
"""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import csr_array

from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import Rows, pair_rows, row_motions
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

SAME_FREQUENCY = 1e-6  # relative difference of frequencies that count as equal
POSITIONS = 4  # of the train; estimates at other positions differ by about one per cent
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)


@dataclass(frozen=True)
class ModeErrors:
    """Relative error of the contact's flexibility by the modes that are kept of m elastic modes.

    omega: (m,) rad/s; band: (m,) w of each mode, rad/s; motions: motion (r, m) of rows and ports in
    the modes at each position, in units in which C is the identity, times √e_j; 0 in the band.
    """

    omega: Array
    band: Array
    motions: tuple[Array, ...]

    def of(self, chosen: NDArray[np.bool_]) -> float:
        """Largest error at any position with the modes ``chosen`` (m,), infinite if a dropped mode
        is in its band."""
        if np.any(~chosen & (self.omega <= self.band)):
            return np.inf
        dropped = (motion[:, ~chosen] for motion in self.motions)
        return max((float(np.linalg.eigvalsh(p @ p.T)[-1]) for p in dropped), default=0.0)

    def fewest(self, accuracy: float) -> NDArray[np.bool_]:
        """Mask (m,) of the modes to keep: all with ω² < 2w², w being the band, and of the others
        those with the largest share in the error, until it is at most ``accuracy``. Modes of equal
        frequency are kept or dropped together."""
        ratio = self.omega / self.band
        rising = np.argsort(ratio, kind="stable")
        new = np.diff(ratio[rising], prepend=-np.inf) > SAME_FREQUENCY * ratio[rising]
        group = np.cumsum(new) - 1
        shares = [np.zeros_like(ratio), *(np.sum(p**2, axis=0) for p in self.motions)]
        mean = np.bincount(group, np.max(shares, axis=0)[rising]) / np.bincount(group)
        mean[group[ratio[rising] ** 2 < 2]] = np.inf
        falling = np.argsort(-mean[group], kind="stable")
        ends = np.flatnonzero(np.diff(group[falling])) + 1
        whole = np.unique([0, *ends, len(ratio)])  # numbers of modes in whole groups

        def first(n: int) -> NDArray[np.bool_]:
            chosen = np.zeros(len(ratio), dtype=bool)
            chosen[rising[falling[:n]]] = True
            return chosen

        accurate = bisect_left(whole, True, key=lambda n: self.of(first(n)) <= accuracy)
        return first(whole[accurate])


@dataclass(frozen=True)
class ModeChoice:
    """Number of kept elastic modes, and estimated error. count: number; band_hz: largest excitation
    frequency of the estimate; lowest_band_hz: that of parts that only slower gear meshes excite;
    estimate: relative error of the contact's flexibility with the kept modes, infinite if a dropped
    mode is in the band."""

    count: int
    band_hz: float
    lowest_band_hz: float
    estimate: float


def choose_modes(
    errors: ModeErrors, *, accuracy: float | None = None, limit_hz: float | None = None
) -> NDArray[np.bool_]:
    """Mask (m,) of the modes to keep: the fewest with an estimated error of at most ``accuracy``;
    without an accuracy all up to ``limit_hz``. With both, FlexgearError if the accuracy needs modes
    above the limit."""
    hz, limit = errors.omega / (2 * np.pi), np.inf if limit_hz is None else limit_hz
    if accuracy is None:
        return np.asarray(hz <= limit)
    chosen = errors.fewest(accuracy)
    if np.any(hz[chosen] > limit):
        raise FlexgearError(
            f"an accuracy of {accuracy:g} up to {errors.band.max() / (2 * np.pi):g} Hz needs modes "
            f"to {hz[chosen].max():.0f} Hz, but modes_to is {limit:g} Hz (estimate there "
            f"{errors.of(hz <= limit):.3g}): raise modes_to_hz or leave it out"
        )
    return chosen


def mode_estimates(system: System, omega: Array, band: Array, phi: Array) -> ModeErrors:
    """Relative errors of the contact's flexibility by the kept modes.

    omega: (m,) rad/s, phi: (d, m) all elastic modes of the constant part; band: (m,) w of each
    mode, rad/s. The error is the largest over positions of the train and both flanks. Torques at
    ports count by the strain energy of the row forces that they cause if only inertia balances
    them.
    """
    outside, errors = omega > band, np.zeros_like(omega)
    if not outside.any():
        return ModeErrors(omega, band, ())
    dropped, w = omega[outside], band[outside]
    damping = 1j * w * system.damping.rate(omega)[outside]
    errors[outside] = np.abs((w**2 - damping) / (dropped**2 * (dropped**2 - w**2 + damping)))  # s²
    blocks = sparse_product(system.blocks, np.hstack([system.rigid, phi]))
    motions = []
    for rows, n in _positions(system):
        stiffness = rows.row["stiffness"][:n]
        stiff = np.flatnonzero(stiffness != 0.0)
        motion = row_motions(rows, n, blocks)[stiff] * np.sqrt(np.abs(stiffness[stiff]))[:, None]
        scaled = _scaled(system, omega, band, phi, motion, np.sign(stiffness[stiff]))
        motions.append(scaled * np.sqrt(errors))
    return ModeErrors(omega, band, tuple(motions))


def _positions(system: System) -> Iterator[tuple[Rows, int]]:
    """Rows of each flank at some rotations without common period; each with the number of rows."""
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
    system: System, omega: Array, band: Array, phi: Array, motion: Array, sign: Array
) -> Array:
    """Motion of rows and ports (r, m) in modes, in units in which C is the identity. motion: (n,
    rigid + m) of the rows times √|k|; sign: of k (n,); band: w (m,), rad/s."""
    rigid, elastic = np.split(motion, [system.rigid.shape[1]], axis=1)
    stiff = 2 * omega**2 >= band**2
    static = elastic[:, stiff] / omega[stiff]
    c = np.eye(len(motion)) + static @ static.T
    rows = linalg.solve_triangular(np.linalg.cholesky(c), elastic, lower=True)
    ports = system.port_rows @ phi
    forces = _row_forces(system, omega, ports, rigid, elastic, sign)
    strain = np.einsum("rp,rs,sp->p", forces, c, forces)
    loaded = strain > 0
    return np.vstack([rows, ports[loaded] / np.sqrt(strain[loaded])[:, None]])


def _row_forces(
    system: System, omega: Array, ports: Array, rigid: Array, elastic: Array, sign: Array
) -> Array:
    """Row forces over √|k| (n, P) under a unit torque at each port, balanced by inertia of rolling.
    Rows follow the elastic motion under the torque; the rigid motions are in balance with the
    inertia forces of the rolling acceleration."""
    rolling = system.rolling
    inertia = system.mass @ rolling
    torque = system.port_rows.T
    load = torque - inertia @ np.linalg.solve(rolling.T @ inertia, rolling.T @ torque)
    n, r = rigid.shape
    left = np.zeros((n + r, n + r))
    left[:n, :n] = np.diag(sign) + (elastic / omega**2) @ elastic.T
    left[:n, n:], left[n:, :n] = -rigid, rigid.T
    right = np.vstack([(elastic / omega**2) @ ports.T, system.rigid.T @ load])
    # rolling compresses no row: the equations are singular and consistent
    return np.asarray(np.linalg.lstsq(left, right, rcond=1e-10)[0][:n])


def sparse_product(a: Array, b: Array) -> Array:
    """Product a b of two dense matrices with many zeros, which are skipped."""
    return np.asarray((csr_array(a) @ csr_array(b)).toarray())
