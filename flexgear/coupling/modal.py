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

Parts of a train that only gear meshes tie to one another may have bands of their own; w is then the
top of the band of each mode's part. All modes with ω_j² < 2w², where stiffness does not dominate,
are kept; of the others those with the largest |p|² e_j at any position, as many as the accuracy
needs.
"""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse import csr_array
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
        """Modes (m,) to keep for an error of at most ``accuracy``, equal ones together: those with
        ω² < 2w², and others by their share in the error."""
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
    """Modes (m,) to keep: few with an error of at most ``accuracy``, or all up to ``limit_hz``.
    With both options ``limit_hz`` is an upper bound; raises FlexgearError if the accuracy needs
    higher modes."""
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
    blocks = _sparse_product(system.blocks, np.hstack([system.rigid, phi]))
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
        modes_limit_hz the highest frequency, modes_estimate of the error up to modes_band_hz,
        lowest_modes_band_hz of the parts with the lowest band."""
        highest = float(self.omega.max(initial=0.0)) / (2 * np.pi)
        values = {"kept_modes": len(self.omega), "modes_limit_hz": highest}
        if self.choice is not None:
            values |= {"modes_band_hz": self.choice.band_hz, "modes_estimate": self.choice.estimate}
            if self.choice.lowest_band_hz < self.choice.band_hz:
                values["lowest_modes_band_hz"] = self.choice.lowest_band_hz
        elif not self.dropped:
            values["modes_estimate"] = 0.0
        return values

    def static_receptance(self) -> Array:
        """Elastic flexibility of the channels under self-balanced loads, (n_c, n_c) m/N."""
        e = slice(self.rigid_count, None)
        p = self.channel_modes[:, e]
        return _sparse_product(p / self.omega[e] ** 2, p.T) + self.residual


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
    band_hz: float | Array | None = None,
) -> ModalSystem:
    """Second reduction, with rigid motions and elastic modes up to ``limit_hz`` (None: all).

    accuracy: largest estimated error of the contact's flexibility under excitation up to
    ``band_hz``, for which the fewest modes are kept; ``limit_hz`` is then an upper bound. band_hz:
    of all coordinates, or (d,) of each without ``limit_hz``; with it errors are estimated without
    an accuracy, too. Raises FlexgearError if a body has no support or the limit does not allow the
    accuracy.
    """
    if accuracy is not None and band_hz is None:
        raise FlexgearError("an accuracy of the second reduction needs band_hz, e.g. 500")
    omega, phi = elastic_modes(system)
    parts, choice = independent_parts(system), None
    part = _part_of_modes(parts, phi)
    chosen = np.full(len(omega), True) if limit_hz is None else omega <= 2 * np.pi * limit_hz
    if band_hz is not None:
        bands = np.broadcast_to(band_hz, system.size)
        band = 2 * np.pi * np.array([bands[coordinates].max() for coordinates in parts])[part]
        errors = mode_estimates(system, omega, band, phi)
        chosen = choose_modes(errors, accuracy=accuracy, limit_hz=limit_hz)
        highest, lowest = float(bands.max()), float(bands.min())
        choice = ModeChoice(int(chosen.sum()), highest, lowest, errors.of(chosen))
    channels = np.vstack([system.blocks, system.port_rows])
    by_part = np.argsort(part[chosen], kind="stable")  # rising within each part
    order = np.flatnonzero(chosen)[by_part]
    modes = np.hstack([system.rigid, phi[:, order]])
    motion = _static_motion(parts, part, omega, np.where(chosen, 0.0, phi), channels)
    kept_omega = np.concatenate([np.zeros(system.rigid.shape[1]), omega[order]])
    return _reduced(system, modes, kept_omega, motion, channels, choice)


def _reduced(
    system: System, modes: Array, omega: Array, motion: Array, channels: Array,
    choice: ModeChoice | None = None,
) -> ModalSystem:  # fmt: skip
    """System in modes (d, n) with ω (n,), and the static motion (d, n_c) of the dropped modes."""
    residual = _sparse_product(channels, motion)
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


def _static_motion(
    parts: Sequence[NDArray[np.int64]], part: NDArray[np.int64], omega: Array, phi: Array,
    channels: Array,
) -> Array:  # fmt: skip
    """Motion Φ ω⁻² (B Φ)ᵀ (d, n_c) of modes Φ (d, m) with ω (m,) under unit forces on the channels
    B (n_c, d). parts: their coordinates, part: (m,) number of each mode's part."""
    out, of_modes = np.zeros((channels.shape[1], len(channels))), _sparse_product(channels, phi)
    by_part = np.split(
        np.argsort(part, kind="stable"), np.cumsum(np.bincount(part, minlength=len(parts)))[:-1]
    )
    for coordinates, modes in zip(parts, by_part, strict=True):
        loaded = np.flatnonzero(of_modes[:, modes].any(axis=1))
        shapes = phi[np.ix_(coordinates, modes)] / omega[modes] ** 2
        out[np.ix_(coordinates, loaded)] = shapes @ of_modes[np.ix_(loaded, modes)].T
    return out


def _sparse_product(a: Array, b: Array) -> Array:
    """a b of two matrices with many zeros."""
    return np.asarray((csr_array(a) @ csr_array(b)).toarray())


def _part_of_modes(parts: Sequence[NDArray[np.int64]], phi: Array) -> NDArray[np.int64]:
    """Number (m,) of the part in which each mode Φ (d, m) moves; parts: their coordinates."""
    part = np.zeros(phi.shape[1], dtype=np.int64)
    for number, coordinates in enumerate(parts):
        part[phi[coordinates].any(axis=0)] = number
    return part


def chosen_modal(system: System, pace: Pace) -> ModalSystem:
    """Second reduction by the options of a case. Without limit and accuracy in the case, systems of
    rigid bodies keep all modes; with flexible bodies the accuracy is 0.01, as thousands of modes
    would make every step slow."""
    if "modes_accuracy" in pace.reasons and all(body.rigid for body in system.bodies):
        return modal_system(system)
    bands = [np.full(body.size, pace.band_of(body.name)) for body in system.bodies]
    band_hz = np.concatenate(bands)
    return modal_system(system, pace.modes_to, accuracy=pace.modes_accuracy, band_hz=band_hz)
