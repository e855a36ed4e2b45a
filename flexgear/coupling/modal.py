"""Modes of the supported system and residual flexibility: the second reduction.

With K φ = ω² M φ of the constant part (no gear meshes), coordinates are rigid motions and elastic
modes up to a limit, with their inertia, and all other modes by their static residual flexibility to
the loaded channels,

    q = Φ η + R f,   R = Σ_{dropped} φ φᵀ B / ω²,

f being the forces on the contact blocks and the torques at the ports (B selects them). The residual
does not enter velocities, where it would add spurious damping.

Which modes are kept: ``mode_choice``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse.csgraph import connected_components

from flexgear.arrays import Array, Ints
from flexgear.coupling.mode_choice import ModeChoice, choose_modes, mode_estimates, sparse_product
from flexgear.coupling.pace import Pace
from flexgear.coupling.system import System
from flexgear.model.errors import FlexgearError

UNSUPPORTED = (
    "the coupled system has an unsupported motion ({}): a body has no support; check bearing, bolt "
    "and spline stiffnesses"
)


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

    @property
    def structural_damping(self) -> Array:
        """Damping matrix (d, d), N s/m, N m s/rad: modal damping, dampers, and brakes linearised at
        rated speed; without gear meshes."""
        momentum = self.system.mass @ self.modes
        return np.asarray((momentum * self.damping) @ momentum.T + self.system.dampers)

    def static_receptance(self) -> Array:
        """Elastic flexibility of the channels under self-balanced loads, (n_c, n_c) m/N."""
        e = slice(self.rigid_count, None)
        p = self.channel_modes[:, e]
        return sparse_product(p / self.omega[e] ** 2, p.T) + self.residual


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


@dataclass(frozen=True)
class ElasticModes:
    """All elastic modes of the constant part. omega: (m,) rad/s, rising; shapes: Φ (d, m), ΦᵀMΦ =
    I; parts: coordinates of the ``independent_parts``; part: (m,) number of the one in which each
    mode moves; it is exactly zero in the others."""

    omega: Array
    shapes: Array
    parts: Sequence[Ints]
    part: Ints


def elastic_modes(system: System) -> ElasticModes:
    """All elastic modes of the constant part. Raises FlexgearError if a body has no support."""
    parts = independent_parts(system)
    omegas, shapes = zip(*(_modes_of_part(system, part) for part in parts), strict=True)
    omega = np.concatenate(omegas)
    phi = np.zeros((system.size, len(omega)))
    phi[np.concatenate(parts)] = linalg.block_diag(*shapes)
    order = np.argsort(omega, kind="stable")
    part = np.repeat(np.arange(len(parts)), [len(of_part) for of_part in omegas])
    return ElasticModes(omega[order], phi[:, order], parts, part[order])


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
    modes, choice = elastic_modes(system), None
    omega, phi = modes.omega, modes.shapes
    chosen = np.full(len(omega), True) if limit_hz is None else omega <= 2 * np.pi * limit_hz
    if band_hz is not None:
        bands = np.broadcast_to(band_hz, system.size)
        of_parts = 2 * np.pi * np.array([bands[part].max() for part in modes.parts])
        errors = mode_estimates(system, omega, of_parts[modes.part], phi)
        chosen = choose_modes(errors, accuracy=accuracy, limit_hz=limit_hz)
        highest, lowest = float(bands.max()), float(bands.min())
        choice = ModeChoice(int(chosen.sum()), highest, lowest, errors.of(chosen))
    channels = np.vstack([system.blocks, system.port_rows])
    by_part = np.argsort(modes.part[chosen], kind="stable")  # rising within each part
    order = np.flatnonzero(chosen)[by_part]
    motion = _static_motion(modes, ~chosen, channels)
    kept_omega = np.concatenate([np.zeros(system.rigid.shape[1]), omega[order]])
    shapes = np.hstack([system.rigid, phi[:, order]])
    return _reduced(system, shapes, kept_omega, motion, channels, choice)


def _reduced(
    system: System, modes: Array, omega: Array, motion: Array, channels: Array,
    choice: ModeChoice | None = None,
) -> ModalSystem:  # fmt: skip
    """System in modes (d, n) with ω (n,), and the static motion (d, n_c) of the dropped modes."""
    residual = sparse_product(channels, motion)
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


def _static_motion(modes: ElasticModes, dropped: NDArray[np.bool_], channels: Array) -> Array:
    """Motion Φ ω⁻² (B Φ)ᵀ (d, n_c) of the modes ``dropped`` (m,) under unit forces on the channels
    B (n_c, d)."""
    out, phi = np.zeros((channels.shape[1], len(channels))), modes.shapes
    of_modes = sparse_product(channels, np.where(dropped, phi, 0.0))
    for number, coordinates in enumerate(modes.parts):
        at = np.flatnonzero(dropped & (modes.part == number))
        loaded = np.flatnonzero(of_modes[:, at].any(axis=1))
        shapes = phi[np.ix_(coordinates, at)] / modes.omega[at] ** 2
        out[np.ix_(coordinates, loaded)] = shapes @ of_modes[np.ix_(loaded, at)].T
    return out


def chosen_modal(system: System, pace: Pace) -> ModalSystem:
    """Second reduction by the options of a case. Without limit and accuracy in the case, systems of
    rigid bodies keep all modes; with flexible bodies the accuracy is 0.01, as thousands of modes
    would make every step slow."""
    if "modes_accuracy" in pace.reasons and all(body.rigid for body in system.bodies):
        return modal_system(system)
    bands = [np.full(body.size, pace.band_of(body.name)) for body in system.bodies]
    band_hz = np.concatenate(bands)
    return modal_system(system, pace.modes_to, accuracy=pace.modes_accuracy, band_hz=band_hz)
