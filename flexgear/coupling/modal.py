"""Modes of the supported system and residual flexibility: the second reduction.

With K φ = ω² M φ of the constant part (no gear meshes), coordinates are rigid motions and elastic
modes up to a limit, with their inertia, and all other modes by their static residual flexibility to
the loaded channels,

    q = Φ η + R f,   R = Σ_{dropped} φ φᵀ B / ω²,

f being the forces on the contact blocks and the torques at the ports (B selects them). The residual
does not enter velocities, where it would add spurious damping.

The limit is given, or follows from an accuracy. A dropped mode has the static response p pᵀ/ω_j² in
place of p pᵀ/(ω_j² − w² + iwd_j), p its motion in the contact rows V and d_j = 2ζω_j. Under
excitation up to w the error of the contact's flexibility is at most

    E = Σ_dropped p pᵀ e_j,   e_j = |1/(ω_j² − w² + iwd_j) − 1/ω_j²|,

which rises with w up to ω_j, so that it is largest at the top of the band. It is compared with

    C = |k|⁻¹ + Σ_{2ω_j² ≥ w²} p pᵀ/ω_j²,

the flexibility of the tooth pairs and of all modes in which stiffness dominates at w. In softer
modes inertia dominates; including their static flexibility would make errors seem small on a soft
mount. The estimate ‖C^{−1/2} E C^{−1/2}‖ bounds the error for every pattern of row forces and, as
FᵀCF ≤ λ holds for the forces F of a coupled mode with eigenvalue λ ≤ w² (φᵀMφ = 1), to first order
the relative change of λ. Dropped modes lose their mass and keep their stiffness: natural
frequencies only rise (Rayleigh). Gyroscopic terms are neglected in the estimate.
"""

from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse.csgraph import connected_components

from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import Rows, pair_rows, row_motions
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.pace import Pace
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

SAME_FREQUENCY = 1e-6  # relative difference of frequencies that count as equal
POSITIONS = 4  # of the train; estimates at other positions differ by about one per cent
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
UNSUPPORTED = (
    "the coupled system has an unsupported motion ({}): a body has no support; check bearing, bolt "
    "and spline stiffnesses"
)


@dataclass(frozen=True)
class ModeErrors:
    """Relative error of the contact's flexibility with the first n of m elastic modes kept, as
    ``errors[n]``, n = 0 … m: falling, infinite if a dropped mode is in the band.

    in_band: number of modes in the band; motions: motion (r, m − in_band) of rows and ports in the
    other modes at each position, in units in which C is the identity, times √e_j.
    """

    in_band: int
    modes: int
    motions: tuple[Array, ...]

    def __len__(self) -> int:
        return self.modes + 1

    def __getitem__(self, n: int) -> float:
        if not 0 <= n <= self.modes:
            raise IndexError(n)
        if n < self.in_band:
            return np.inf
        dropped = (motion[:, n - self.in_band :] for motion in self.motions)
        return max((float(np.linalg.eigvalsh(p @ p.T)[-1]) for p in dropped), default=0.0)


@dataclass(frozen=True)
class ModeChoice:
    """Number of kept elastic modes, and estimated error. count: number; band_hz: largest excitation
    frequency of the estimate; estimate: relative error of the contact's flexibility with the kept
    modes, infinite if a dropped mode is in the band."""

    count: int
    band_hz: float
    estimate: float


def cuts(omega: Array) -> NDArray[np.int64]:
    """Numbers of modes that may be kept of frequencies ω (m,), rising, so that modes of equal
    frequency are kept or dropped together."""
    gaps = np.flatnonzero(np.diff(omega) > SAME_FREQUENCY * omega[1:]) + 1
    return np.unique(np.concatenate([[0], gaps, [len(omega)]])).astype(np.int64)


def choose_modes(
    omega: Array, estimates: ModeErrors, band_hz: float, *,
    accuracy: float | None = None, limit_hz: float | None = None,
) -> ModeChoice:  # fmt: skip
    """Fewest modes with an estimate of at most ``accuracy``, or all modes up to ``limit_hz``.
    omega: (m,) rad/s, rising. With both options ``limit_hz`` is an upper bound; raises
    FlexgearError if the accuracy needs more modes."""
    hz = omega / (2 * np.pi)
    number = len(omega) if limit_hz is None else int(np.sum(hz <= limit_hz))
    if accuracy is not None:
        allowed = cuts(omega)
        needed = int(allowed[bisect_left(allowed, True, key=lambda n: estimates[n] <= accuracy)])
        if needed > number:
            raise FlexgearError(
                f"an accuracy of {accuracy:g} up to {band_hz:g} Hz needs modes to "
                f"{hz[needed - 1]:.0f} Hz, but modes_to is {limit_hz:g} Hz (estimate there "
                f"{estimates[number]:.3g}): raise modes_to_hz or leave it out"
            )
        number = needed
    return ModeChoice(number, band_hz, float(estimates[number]))


def mode_estimates(system: System, omega: Array, phi: Array, band_hz: float) -> ModeErrors:
    """Relative errors of the contact's flexibility by the number of kept modes.

    omega: (m,) rad/s rising, phi: (d, m) all elastic modes of the constant part. The error is the
    largest over positions of the train and both flanks. Torques at ports count by the strain energy
    of the row forces that they cause if only inertia balances them.
    """
    w = 2 * np.pi * band_hz
    first = int(np.sum(omega <= w))
    if first == len(omega):
        return ModeErrors(first, first, ())
    dropped = omega[first:]
    damping = 1j * w * system.damping.rate(omega)[first:]
    errors = np.abs((w**2 - damping) / (dropped**2 * (dropped**2 - w**2 + damping)))  # e_j, s²
    blocks, motions = system.blocks @ np.hstack([system.rigid, phi]), []
    for rows, n in _positions(system):
        stiffness = rows.row["stiffness"][:n]
        stiff = np.flatnonzero(stiffness != 0.0)
        motion = row_motions(rows, n, blocks)[stiff] * np.sqrt(np.abs(stiffness[stiff]))[:, None]
        scaled = _scaled(system, omega, phi, motion, np.sign(stiffness[stiff]), w)
        motions.append(scaled[:, first:] * np.sqrt(errors))
    return ModeErrors(first, len(omega), tuple(motions))


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
    system: System, omega: Array, phi: Array, motion: Array, sign: Array, w: float
) -> Array:
    """Motion of rows and ports (r, m) in modes, in units in which C is the identity. motion: (n,
    rigid + m) of the rows times √|k|; sign: of k (n,); w: rad/s."""
    rigid, elastic = np.split(motion, [system.rigid.shape[1]], axis=1)
    stiff = 2 * omega**2 >= w**2
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


@dataclass(frozen=True)
class ModalSystem:
    """System in kept modes; channels are the dofs of the contact blocks, then the ports.

    modes: (d, n), rigid first, then elastic ones part by part (``independent_parts``), rising
    within a part; omega: (n,) rad/s; damping: (n,) 2ζω; channels: (n_c, d); channel_modes:
    (n_c, n) = channels @ modes; residual: (n_c, n_c) m/N of dropped modes; residual_motion:
    (d, n_c) their motion under unit channel forces; angles: (A, n) and input_rows: (F, n) rows
    of the system in modes; rolling: (n, F) modal coordinates of rolling per radian of each
    independent rotation; gyroscopic, centripetal: (n, n), or (0, 0) if not modelled; dropped:
    number of dropped modes; choice: None if no errors were estimated.
    """

    system: System
    modes: Array
    omega: Array
    damping: Array
    channels: Array
    channel_modes: Array
    residual: Array
    residual_motion: Array
    angles: Array
    input_rows: Array
    rolling: Array
    gyroscopic: Array
    centripetal: Array
    dropped: int
    choice: ModeChoice | None = None

    @property
    def rigid_count(self) -> int:
        """Number of rigid motions, which come first."""
        return int(self.system.rigid.shape[1])

    @property
    def figures(self) -> dict[str, float]:
        """Figures of the second reduction for results: kept_modes including rigid motions,
        modes_limit_hz the highest frequency, modes_estimate of the error up to modes_band_hz."""
        highest = float(self.omega.max(initial=0.0)) / (2 * np.pi)
        values = {"kept_modes": len(self.omega), "modes_limit_hz": highest}
        if self.choice is not None:
            values |= {"modes_band_hz": self.choice.band_hz, "modes_estimate": self.choice.estimate}
        elif not self.dropped:
            values["modes_estimate"] = 0.0
        return values

    def static_receptance(self) -> Array:
        """Elastic flexibility of the channels under self-balanced loads, (n_c, n_c) m/N."""
        e = slice(self.rigid_count, None)
        p = self.channel_modes[:, e]
        return (p / self.omega[e] ** 2) @ p.T + self.residual


def independent_parts(system: System) -> list[NDArray[np.int64]]:
    """Coordinates of the parts of a system that stiffness, mass and rolling do not couple. Without
    gear meshes a ring on a fixed housing and the train inside it are two such parts."""
    coupled = (system.stiffness != 0.0) | (system.mass != 0.0)
    count, label = connected_components(coupled, directed=False)
    parts = [np.flatnonzero(label == c).astype(np.int64) for c in range(count)]
    rigid = system.rigid
    ranks = [np.linalg.matrix_rank(rigid[p]) if rigid.shape[1] else 0 for p in parts]
    if sum(ranks) > rigid.shape[1]:  # a rigid motion moves several parts together
        return [np.arange(len(label), dtype=np.int64)]
    return parts


def elastic_modes(system: System) -> tuple[Array, Array]:
    """All elastic modes of the constant part: ω (m,), rad/s, rising, and Φ (d, m), ΦᵀMΦ = I. Each
    mode moves one of the ``independent_parts`` and is exactly zero in the others."""
    parts = independent_parts(system)
    omegas, shapes = zip(*(_modes_of_part(system, part) for part in parts), strict=True)
    omega = np.concatenate(omegas)
    phi = np.zeros((system.size, len(omega)))
    phi[np.concatenate(parts)] = linalg.block_diag(*shapes)
    order = np.argsort(omega, kind="stable")
    return omega[order], phi[:, order]


def _modes_of_part(system: System, part: NDArray[np.int64]) -> tuple[Array, Array]:
    """Elastic modes ω and Φ on the coordinates of one part."""
    block = np.ix_(part, part)
    k, m, rigid = system.stiffness[block], system.mass[block], system.rigid[part]
    null = None
    if rigid.any():  # M-orthogonal complement of the rigid motions: no zero modes to remove
        null = linalg.null_space((m @ rigid).T)
        k, m = null.T @ k @ null, null.T @ m @ null
    if not len(k):
        return np.zeros(0), np.zeros((len(part), 0))
    values, vectors = linalg.eigh(0.5 * (k + k.T), 0.5 * (m + m.T))
    if values[0] <= 1e-9 * values[-1] * 1e-6:
        raise FlexgearError(
            UNSUPPORTED.format(f"lowest elastic eigenvalue {values[0]:.3g} rad²/s²")
        )
    return np.sqrt(values), vectors if null is None else null @ vectors


def modal_system(
    system: System,
    limit_hz: float | None = None,
    *,
    accuracy: float | None = None,
    band_hz: float | None = None,
) -> ModalSystem:
    """Second reduction, with rigid motions and elastic modes up to ``limit_hz`` (None: all).

    accuracy: largest estimated error of the contact's flexibility under excitation up to
    ``band_hz``, for which the fewest modes are kept; ``limit_hz`` is then an upper bound. With
    ``band_hz`` errors are estimated without an accuracy, too. Raises FlexgearError if a body has no
    support or the limit does not allow the accuracy.
    """
    if accuracy is not None and band_hz is None:
        raise FlexgearError("an accuracy of the second reduction needs band_hz, e.g. 500")
    omega, phi = elastic_modes(system)
    choice = None
    if band_hz is not None:
        estimates = mode_estimates(system, omega, phi, band_hz)
        choice = choose_modes(omega, estimates, band_hz, accuracy=accuracy, limit_hz=limit_hz)
    limit = np.inf if limit_hz is None else 2 * np.pi * limit_hz
    keep = int(np.sum(omega <= limit)) if choice is None else choice.count
    channels = np.vstack([system.blocks, system.port_rows])
    order = _part_order(system, phi[:, :keep])
    modes = np.hstack([system.rigid, phi[:, order]])
    dropped = phi[:, keep:]
    motion = (dropped / omega[keep:] ** 2) @ (channels @ dropped).T
    kept_omega = np.concatenate([np.zeros(system.rigid.shape[1]), omega[order]])
    return _reduced(system, modes, kept_omega, motion, channels, choice)


def _reduced(
    system: System, modes: Array, omega: Array, motion: Array, channels: Array,
    choice: ModeChoice | None = None,
) -> ModalSystem:  # fmt: skip
    """System in modes (d, n) with ω (n,), and the static motion (d, n_c) of the dropped modes."""
    residual = channels @ motion
    gyroscopic, centripetal = np.zeros((0, 0)), np.zeros((0, 0))
    if system.gyroscopic is not None and system.centripetal is not None:
        gyroscopic = np.ascontiguousarray(modes.T @ system.gyroscopic @ modes)
        centripetal = np.ascontiguousarray(modes.T @ system.centripetal @ modes)
    return ModalSystem(
        system=system,
        modes=modes,
        omega=omega,
        damping=system.damping.rate(omega),
        channels=channels,
        channel_modes=np.ascontiguousarray(channels @ modes),
        residual=np.ascontiguousarray(0.5 * (residual + residual.T)),
        residual_motion=motion,
        angles=np.ascontiguousarray(system.angles @ modes),
        input_rows=np.ascontiguousarray(system.input_rows @ modes),
        rolling=modes.T @ (system.mass @ system.rolling),
        gyroscopic=gyroscopic,
        centripetal=centripetal,
        dropped=system.size - modes.shape[1],
        choice=choice,
    )


def static_system(system: System) -> ModalSystem:
    """Second reduction without elastic modes, for equilibria: all flexibility is static.

    The elastic motion X under unit forces Bᵀ on the channels, without rigid motions R, solves
    (K + c M R Rᵀ M) X = Bᵀ − M R Rᵀ Bᵀ for any c > 0, by one factorisation. Raises FlexgearError if
    a body has no support.
    """
    channels = np.vstack([system.blocks, system.port_rows])
    momenta = system.mass @ system.rigid
    scale = float(np.mean(np.diag(system.stiffness) / np.diag(system.mass))) or 1.0
    right = channels.T - momenta @ (system.rigid.T @ channels.T)
    try:
        factor = linalg.cho_factor(system.stiffness + scale * momenta @ momenta.T, lower=True)
    except linalg.LinAlgError:
        raise FlexgearError(UNSUPPORTED.format("K is not positive definite")) from None
    motion = linalg.cho_solve(factor, right)
    motion -= system.rigid @ (momenta.T @ motion)
    return _reduced(system, system.rigid, np.zeros(system.rigid.shape[1]), motion, channels)


def _part_order(system: System, phi: Array) -> NDArray[np.int64]:
    """Order of modes Φ (d, n) part by part, rising within each part."""
    part = np.zeros(phi.shape[1], dtype=np.int64)
    for number, coordinates in enumerate(independent_parts(system)):
        part[phi[coordinates].any(axis=0)] = number
    return np.argsort(part, kind="stable").astype(np.int64)


def chosen_modal(system: System, pace: Pace) -> ModalSystem:
    """Second reduction by the options of a case. Without limit and accuracy in the case, systems of
    rigid bodies keep all modes; with flexible bodies the accuracy is 0.01, as thousands of modes
    would make every step slow."""
    if "modes_accuracy" in pace.reasons and all(body.rigid for body in system.bodies):
        return modal_system(system)
    return modal_system(system, pace.modes_to, accuracy=pace.modes_accuracy, band_hz=pace.band)
