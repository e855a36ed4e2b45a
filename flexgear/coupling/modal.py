"""Modes of the supported system and residual flexibility: the second reduction.

With K φ = ω² M φ of the constant part (no gear meshes), coordinates split into rigid motions and
elastic modes up to a chosen frequency, which carry inertia, and all other modes, which answer
statically through the residual flexibility of the loaded channels,

    q = Φ η + R f,   R = Σ_{dropped} φ φᵀ B / ω²,

f being the forces on the contact blocks and the torques at the ports (B selects them). The residual
never enters a velocity (PHYSICS: it would add damping that is not there).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModalSystem:
    """A system in kept modes; channels are the contact-block dofs, then the ports.

    modes: (d, n), rigid first; omega: (n,) rad/s; damping: (n,) 2ζω; channels: (n_c, d);
    channel_modes: (n_c, n) = channels @ modes; residual: (n_c, n_c) m/N of dropped modes;
    residual_motion: (d, n_c) their motion under unit channel forces; angles: (A, n) and masters:
    (F, n) rows of the system in modes; rolling: (n, F) modal coordinates of rolling per radian of
    each independent rotation; gyroscopic,
    centripetal: (n, n), or (0, 0) where there are none.
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
    masters: Array
    rolling: Array
    gyroscopic: Array
    centripetal: Array
    dropped: int

    @property
    def angle(self) -> Array:
        """Row (n,) of the first independent rotation."""
        return np.asarray(self.masters[0])

    @property
    def rigid_count(self) -> int:
        """Number of rigid motions, which come first."""
        return int(self.system.rigid.shape[1])

    def static_receptance(self) -> Array:
        """Elastic flexibility of the channels under self-balanced loads, (n_c, n_c) m/N."""
        e = slice(self.rigid_count, None)
        p = self.channel_modes[:, e]
        return (p / self.omega[e] ** 2) @ p.T + self.residual

    def coordinates(self, eta: Array, forces: Array) -> Array:
        """Physical coordinates q = Φ η + R f; eta (…, n), forces (…, n_c) -> (…, d)."""
        return eta @ self.modes.T + forces @ self.residual_motion.T


def elastic_modes(system: System) -> tuple[Array, Array]:
    """All elastic modes of the constant part: ω (m,) rad/s rising, Φ (d, m), ΦᵀMΦ = I."""
    rigid, mass = system.rigid, system.mass
    # complement of the rigid motions, M-orthogonal: exact zero modes need no search
    null = linalg.null_space((mass @ rigid).T)
    k, m = null.T @ system.stiffness @ null, null.T @ mass @ null
    if not len(k):
        return np.zeros(0), np.zeros((len(mass), 0))
    values, vectors = linalg.eigh(0.5 * (k + k.T), 0.5 * (m + m.T))
    if values[0] <= 1e-9 * values[-1] * 1e-6:
        raise FlexgearError(
            "the coupled system can move freely somewhere (lowest elastic eigenvalue "
            f"{values[0]:.3g} rad²/s²): a body has no support; check bearing, bolt and spline "
            "stiffnesses"
        )
    return np.sqrt(values), null @ vectors


def modal_system(system: System, limit_hz: float | None = None) -> ModalSystem:
    """Second reduction: keep rigid motions and elastic modes up to ``limit_hz`` (None: all)."""
    omega, phi = elastic_modes(system)
    keep = len(omega) if limit_hz is None else int(np.sum(omega <= 2 * np.pi * limit_hz))
    channels = np.vstack([system.blocks, system.port_rows])
    modes = np.hstack([system.rigid, phi[:, :keep]])
    rest = phi[:, keep:]
    motion = (rest / omega[keep:] ** 2) @ (channels @ rest).T
    residual = channels @ motion
    gyroscopic, centripetal = np.zeros((0, 0)), np.zeros((0, 0))
    if system.gyroscopic is not None and system.centripetal is not None:
        gyroscopic = np.ascontiguousarray(modes.T @ system.gyroscopic @ modes)
        centripetal = np.ascontiguousarray(modes.T @ system.centripetal @ modes)
    kept_omega = np.concatenate([np.zeros(system.rigid.shape[1]), omega[:keep]])
    return ModalSystem(
        system=system,
        modes=modes,
        omega=kept_omega,
        damping=system.damping.rate(kept_omega),
        channels=channels,
        channel_modes=np.ascontiguousarray(channels @ modes),
        residual=np.ascontiguousarray(0.5 * (residual + residual.T)),
        residual_motion=motion,
        angles=np.ascontiguousarray(system.angles @ modes),
        masters=np.ascontiguousarray(system.masters @ modes),
        rolling=modes.T @ (system.mass @ system.rolling),
        gyroscopic=gyroscopic,
        centripetal=centripetal,
        dropped=len(omega) - keep,
    )
