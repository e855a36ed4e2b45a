"""Modes of the supported system and residual flexibility: the second reduction.

With K φ = ω² M φ of the constant part (no gear meshes), coordinates split into rigid motions and
elastic modes up to a frequency that is given or follows from a wanted accuracy (``mode_choice``),
which carry inertia, and all other modes, which answer statically through the residual flexibility
of the loaded channels,

    q = Φ η + R f,   R = Σ_{dropped} φ φᵀ B / ω²,

f being the forces on the contact blocks and the torques at the ports (B selects them). The residual
never enters a velocity (PHYSICS: it would add damping that is not there).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse.csgraph import connected_components

from flexgear.arrays import Array
from flexgear.coupling.mode_choice import ModeChoice, choose_modes, mode_estimates
from flexgear.coupling.pace import Pace
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError


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
        """What was kept, as results name it: kept_modes with the rigid ones, modes_limit_hz the
        highest of them, modes_estimate of the error up to modes_band_hz where it was made."""
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
    omegas, modes = [np.zeros(0)], [np.zeros((len(system.mass), 0))]
    for part in independent_parts(system):
        omega, phi = _modes_of_part(system, part)
        whole = np.zeros((len(system.mass), len(omega)))
        whole[part] = phi
        omegas.append(omega)
        modes.append(whole)
    omega = np.concatenate(omegas)
    order = np.argsort(omega, kind="stable")
    return omega[order], np.hstack(modes)[:, order]


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
        raise FlexgearError(_loose(f"lowest elastic eigenvalue {values[0]:.3g} rad²/s²"))
    return np.sqrt(values), null @ vectors


def _loose(why: str) -> str:
    return (
        f"the coupled system can move freely somewhere ({why}): a body has no support; check "
        "bearing, bolt and spline stiffnesses"
    )


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
    modal = _reduced(system, modes, kept_omega, motion, channels)
    return replace(modal, choice=choice)


def _reduced(
    system: System, modes: Array, omega: Array, motion: Array, channels: Array
) -> ModalSystem:
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
        raise FlexgearError(_loose("K is not positive definite")) from None
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
    """Second reduction as a case asks for it.

    Where it states neither limit nor accuracy rigid bodies keep all modes; where bodies bend, their
    thousands of modes would set the cost of every step.
    """
    if pace.modes_by_default and all(body.rigid for body in system.bodies):
        return modal_system(system)  # nothing is dropped, nothing to estimate
    return modal_system(system, pace.modes_to, accuracy=pace.modes_accuracy, band_hz=pace.band)
