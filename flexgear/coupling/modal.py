"""Modes of the supported system and residual flexibility: the second reduction.

With K φ = ω² M φ of the constant part (no gear meshes), coordinates split into rigid motions and
elastic modes up to a frequency that is given or follows from a wanted accuracy (see below),
which carry inertia, and all other modes, which answer statically through the residual flexibility
of the loaded channels,

    q = Φ η + R f,   R = Σ_{dropped} φ φᵀ B / ω²,

f being the forces on the contact blocks and the torques at the ports (B selects them). The residual
never enters a velocity (PHYSICS: it would add damping that is not there).

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
from scipy.sparse.csgraph import connected_components

from flexgear.arrays import Array
from flexgear.coupling.kernels.elements import Rows, pair_rows, row_motions
from flexgear.coupling.kernels.pairs import build_rows
from flexgear.coupling.pace import Pace
from flexgear.coupling.pair_data import carrying_flanks
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

EQUAL = 1e-6  # relative gap below which frequencies are equal
POSITIONS = 4  # of the train; rows of other positions differ by about one per cent
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
CHUNK = 64  # cuts judged at a time
LOOSE = (
    "the coupled system can move freely somewhere ({}): a body has no support; check bearing, bolt "
    "and spline stiffnesses"
)


@dataclass(frozen=True)
class ModeChoice:
    """Which elastic modes are kept, and what that costs.

    count: their number; band_hz: excitation up to which ``estimates`` hold; estimates: (m + 1,)
    relative error of the contact's flexibility with 0 … m modes kept, falling, infinite where a
    dropped mode lies in the band.
    """

    count: int
    band_hz: float
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
    omega: Array, estimates: Array, band_hz: float, *,
    accuracy: float | None = None, limit_hz: float | None = None,
) -> ModeChoice:  # fmt: skip
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
    return ModeChoice(number, band_hz, estimates)


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
    dropped = omega[first:]
    turn = 1j * w * system.damping.rate(omega)[first:]
    loss = np.abs((w**2 - turn) / (dropped**2 * (dropped**2 - w**2 + turn)))  # e_j, s²
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
        judged = slice(max(0, stop - CHUNK), stop)
        part = (scaled[:, judged] * np.sqrt(loss[judged])).T
        sums = total + np.cumsum((part[:, :, None] * part[:, None, :])[::-1], axis=0)
        total = sums[-1]
        out[judged] = np.linalg.eigvalsh(sums)[::-1, -1]
    return out


@dataclass(frozen=True)
class ModalSystem:
    """A system in kept modes; channels are the contact-block dofs, then the ports.

    modes: (d, n), rigid first, then elastic ones part by part (``independent_parts``), rising
    within a part; omega: (n,) rad/s; damping: (n,) 2ζω; channels: (n_c, d); channel_modes:
    (n_c, n) = channels @ modes; residual: (n_c, n_c) m/N of dropped modes; residual_motion:
    (d, n_c) their motion under unit channel forces; angles: (A, n) and input_rows: (F, n) rows
    of the system in modes; rolling: (n, F) modal coordinates of rolling per radian of each
    independent rotation; gyroscopic, centripetal: (n, n), or (0, 0) where there are none;
    choice: how many modes are kept and what that costs, None where it was not judged.
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
        """Figures of the second reduction in results: kept_modes including the rigid ones,
        modes_limit_hz the highest of them, modes_estimate of the error up to modes_band_hz, if it
        was computed."""
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
    """Coordinates of parts that neither stiffness, mass nor rolling ties to one another.

    Without gear meshes a ring on a fixed housing and the train inside it are two such parts.
    """
    tied = (system.stiffness != 0.0) | (system.mass != 0.0)
    count, label = connected_components(tied, directed=False)
    parts = [np.flatnonzero(label == c).astype(np.int64) for c in range(count)]
    rigid = system.rigid
    ranks = [np.linalg.matrix_rank(rigid[p]) if rigid.shape[1] else 0 for p in parts]
    if sum(ranks) > rigid.shape[1]:  # rolling that moves several together
        return [np.arange(len(label), dtype=np.int64)]
    return parts


def elastic_modes(system: System) -> tuple[Array, Array]:
    """All elastic modes of the constant part: ω (m,) rad/s rising, Φ (d, m), ΦᵀMΦ = I.

    Each belongs to one of the ``independent_parts`` and is exactly zero in the others.
    """
    parts = independent_parts(system)
    omegas, shapes = zip(*(_modes_of_part(system, part) for part in parts), strict=True)
    omega = np.concatenate(omegas)
    phi = np.zeros((system.size, len(omega)))
    phi[np.concatenate(parts)] = linalg.block_diag(*shapes)
    order = np.argsort(omega, kind="stable")
    return omega[order], phi[:, order]


def _modes_of_part(system: System, part: NDArray[np.int64]) -> tuple[Array, Array]:
    block = np.ix_(part, part)
    mass, rigid = system.mass[block], system.rigid[part]
    # complement of the rigid motions, M-orthogonal: exact zero modes need no search
    null = linalg.null_space((mass @ rigid).T) if rigid.any() else np.eye(len(part))
    k, m = null.T @ system.stiffness[block] @ null, null.T @ mass @ null
    if not len(k):
        return np.zeros(0), np.zeros((len(part), 0))
    values, vectors = linalg.eigh(0.5 * (k + k.T), 0.5 * (m + m.T))
    if values[0] <= 1e-9 * values[-1] * 1e-6:
        raise FlexgearError(LOOSE.format(f"lowest elastic eigenvalue {values[0]:.3g} rad²/s²"))
    return np.sqrt(values), null @ vectors


def modal_system(
    system: System,
    limit_hz: float | None = None,
    *,
    accuracy: float | None = None,
    band_hz: float | None = None,
) -> ModalSystem:
    """Second reduction: keep rigid motions and elastic modes up to ``limit_hz`` (None: all).

    accuracy: keep the fewest modes whose estimated error of the contact's flexibility under
    excitation up to ``band_hz`` is at most this fraction; ``limit_hz`` is then an upper bound.
    With ``band_hz`` the estimate is made for a given limit too. Raises FlexgearError where a body
    has no support or the limit does not allow the accuracy.
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
    order = _by_parts(system, phi[:, :keep])
    modes = np.hstack([system.rigid, phi[:, order]])
    rest = phi[:, keep:]
    motion = (rest / omega[keep:] ** 2) @ (channels @ rest).T
    kept_omega = np.concatenate([np.zeros(system.rigid.shape[1]), omega[order]])
    return _reduced(system, modes, kept_omega, motion, channels, choice)


def _reduced(
    system: System, modes: Array, omega: Array, motion: Array, channels: Array,
    choice: ModeChoice | None = None,
) -> ModalSystem:  # fmt: skip
    """The system in modes (d, n) of ω (n,) and the motion (d, n_c) that all others answer with."""
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
    """No elastic mode kept: all of the train that bends answers statically, as in an equilibrium.

    The answer X to the channels Bᵀ beside the rigid motions R solves (K + c M R Rᵀ M) X = Bᵀ −
    M R Rᵀ Bᵀ for any c > 0, by one factorisation. FlexgearError where a body has no support.
    """
    channels = np.vstack([system.blocks, system.port_rows])
    held = system.mass @ system.rigid
    middle = float(np.mean(np.diag(system.stiffness) / np.diag(system.mass))) or 1.0
    right = channels.T - held @ (system.rigid.T @ channels.T)
    try:
        factor = linalg.cho_factor(system.stiffness + middle * held @ held.T, lower=True)
    except linalg.LinAlgError:
        raise FlexgearError(LOOSE.format("K is not positive definite")) from None
    motion = linalg.cho_solve(factor, right)
    motion -= system.rigid @ (held.T @ motion)
    return _reduced(system, system.rigid, np.zeros(system.rigid.shape[1]), motion, channels)


def _by_parts(system: System, phi: Array) -> NDArray[np.int64]:
    """Order in which modes Φ (d, n) of one part follow each other, rising within."""
    part = np.zeros(phi.shape[1], dtype=np.int64)
    for number, coordinates in enumerate(independent_parts(system)):
        part[phi[coordinates].any(axis=0)] = number
    return np.argsort(part, kind="stable").astype(np.int64)


def chosen_modal(system: System, pace: Pace) -> ModalSystem:
    """Second reduction by the options of a case.

    Where these state neither limit nor accuracy, rigid bodies keep all modes; for flexible bodies
    the accuracy is 0.01, as thousands of modes would set the cost of every step.
    """
    if pace.modes_by_default and all(body.rigid for body in system.bodies):
        return modal_system(system)  # nothing is dropped, nothing to estimate
    return modal_system(system, pace.modes_to, accuracy=pace.modes_accuracy, band_hz=pace.band)
