r"""Receptances of the channels of an orbit at every harmonic of the gear-mesh frequency.

The train in kept modes, η̈ + (D + s G) η̇ + (Ω² − s² C) η = Pᵀ f at a share s of rated speed, moves
under forces f on the channels at harmonic l, ω_l = 2π l f_z, by

    u_l = H_l f_l,   H_l = P A_l⁻¹ Pᵀ + R,   u̇_l = iω_l P A_l⁻¹ Pᵀ f_l,
    A_l = Ω² − s² C − ω_l² + iω_l (D + s G).

R is the residual flexibility, which does not contribute to velocities, as in time steps. Linear
rows L with forces −Y_l u_L (supports in turning frames, dampers, mean springs of other stages,
machines whose torque depends on the motion of their port) are eliminated,
H = H_qq − H_qL (1 + Y H_LL)⁻¹ Y H_Lq. Ports of given speed do not move.

At l = 0 the rigid rotation of the train is free, and no row of a force element depends on it: the
mean angle is zero, and the torques of the ports balance. The other rigid motions are unknowns with
their own equations of equilibrium:

    u_0 = S f_0 + Z a + e,   Zᵀ f_0 − Y a + g = 0,

S the static flexibility of the channels, Z (q, r) their rigid motions with the amplitudes a, e the
motion by constant forces, Y the stiffness of the linear rows against the rigid motions, g the
constant forces on them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.analysis.orbit import OrbitElements
from flexgear.arrays import Array, Complex, Ints
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem

UNDAMPED = 1e-8  # least damping ratio of a mode, which a harmonic may meet exactly


@dataclass(frozen=True)
class OperatingPoint:
    """Speed and load (torques of all ports) of a steady state, each over the rated value."""

    speed: float
    load: float


@dataclass(frozen=True)
class Range:
    """Range of λ from low to high, λ being speed or load; ``fixed``: value of the other one."""

    over: Literal["speed", "load"]
    low: float
    high: float
    fixed: float = 1.0

    def point(self, value: float) -> OperatingPoint:
        """The operating point at a value of λ."""
        if self.over == "speed":
            return OperatingPoint(value, self.fixed)
        return OperatingPoint(self.fixed, value)

    def value(self, point: OperatingPoint) -> float:
        """Value of λ at an operating point."""
        return point.speed if self.over == "speed" else point.load

    def holds(self, point: OperatingPoint) -> bool:
        """Whether λ is in the range, ends included."""
        return self.low <= self.value(point) <= self.high


@dataclass(frozen=True)
class Receptance:
    """Receptance of the q channels at an operating point, for H harmonics and r rigid motions
    beside the rigid rotation of the train.

    omega: 2π f_z, rad/s; dynamic, rate (H, q, q): H_l, and u̇_l under unit forces; static (q, q): S;
    rigid (q, r): Z; rigid_stiffness (r, r): Y; rigid_force (r,): g; static_motion (q,): e.
    """

    omega: float
    dynamic: Complex
    rate: Complex
    static: Array
    rigid: Array
    rigid_stiffness: Array
    rigid_force: Array
    static_motion: Array

    def restricted(self, at: Ints) -> Self:
        """Receptance of the channels ``at`` alone, without the constant parts g and e."""
        return replace(
            self,
            dynamic=self.dynamic[:, at[:, None], at],
            rate=self.rate[:, at[:, None], at],
            static=self.static[np.ix_(at, at)],
            rigid=self.rigid[at],
            rigid_force=0.0 * self.rigid_force,
            static_motion=0.0 * self.static_motion[at],
        )


@dataclass(frozen=True)
class CondensedTrain:
    """The linear part of a train with its channels, for receptances at any operating point.

    linear (s, n_c): linear rows, first those of the elements' springs, then of machines; stiffness,
    damping (s,): of these rows; brake_damping (s,): damping of brakes at rated speed and torque;
    static_stiffness (s,): stiffness at l = 0, zero for machines; fixed (s,): whether a row is a
    port of given speed; rigid_basis (r, k): amplitudes of the r rigid modes without rotation of the
    train.
    """

    elements: OrbitElements
    harmonics: int
    linear: Array
    stiffness: Array
    damping: Array
    brake_damping: Array
    static_stiffness: Array
    fixed: NDArray[np.bool_]
    rigid_basis: Array

    @property
    def modal(self) -> ModalSystem:
        """The train in its modes."""
        return self.elements.modal

    @cached_property
    def rows(self) -> Array:
        """Channels of the elements, then linear rows: (q + s, n_c)."""
        return np.vstack([self.elements.channels, self.linear])

    @cached_property
    def modes(self) -> Array:
        """``rows`` in modes (q + s, n)."""
        return self.rows @ self.modal.channel_modes

    @cached_property
    def residual(self) -> Array:
        """Residual flexibility of ``rows``, (q + s, q + s) m/N."""
        return np.asarray(self.rows @ self.modal.residual @ self.rows.T)

    def constant_forces(self, point: OperatingPoint) -> Array:
        """Constant forces on the channels (n_c,): loads, and balanced torques of the ports."""
        system, (constant, growing) = self.modal.system, self.elements.load
        forces: Array = constant + point.speed**2 * growing
        ports = len(system.ports)
        torques = point.load * system.rated_port_torques
        turned = system.port_rows @ system.rolling
        torques[system.reactions] = 0.0
        work = self.modal.rolling.T @ (self.modal.channel_modes.T @ forces) + torques @ turned
        torques[system.reactions] = np.linalg.solve(turned[system.reactions].T, -work)
        forces = forces.copy()
        forces[-ports:] = torques
        return forces

    def operator(self, omega: Array, speed: float) -> Complex:
        """A (H, n, n) at ω (H,) rad/s, or its diagonals (H, n) where modes do not couple."""
        m, w = self.modal, omega[:, None]
        damping = np.maximum(m.damping, 2.0 * UNDAMPED * m.omega)
        diagonals: Complex = m.omega**2 - w**2 + 1j * w * damping
        if not m.gyroscopic.size:
            return diagonals
        coupled = 1j * w[:, :, None] * speed * m.gyroscopic - speed**2 * m.centripetal
        return np.asarray(np.eye(len(m.omega)) * diagonals[:, :, None] + coupled)

    def modal_response(self, omega: Array, speed: float) -> Complex:
        """Modal coordinates (H, n, q + s) at ω (H,) rad/s under unit forces on ``rows``."""
        a = self.operator(omega, speed)
        forces = self.modes.T
        return np.asarray(forces / a[:, :, None] if a.ndim == 2 else np.linalg.solve(a, forces))

    def at(self, point: OperatingPoint) -> Receptance:
        """Receptance of the channels at an operating point."""
        omega, q = 2 * np.pi * self.elements.frequency * point.speed, len(self.elements.channels)
        w = omega * np.arange(1.0, self.harmonics + 1)
        response = self.modal_response(w, point.speed)
        h: Complex = self.modes @ response.real + 1j * (self.modes @ response.imag)
        all_rows = h + self.residual
        forces = self.linear_row_forces(all_rows, w, point)
        dynamic = all_rows[:, :q, :q] + all_rows[:, :q, q:] @ forces
        rate = 1j * w[:, None, None] * (h[:, :q, :q] + h[:, :q, q:] @ forces)
        return Receptance(omega, dynamic, rate, *self._static_part(point))

    def linear_row_forces(
        self, receptance: Complex, omega: Array, point: OperatingPoint
    ) -> Complex:
        """Forces (H, s, q) on the linear rows by unit forces on the channels at ω (H,) rad/s;
        receptance (H, q + s, q + s): of all rows."""
        q = len(self.elements.channels)
        y = self.stiffness + 1j * omega[:, None] * self.damping_at(point)
        y = np.where(self.fixed, 1.0, y)[:, :, None]  # fixed rows do not move, H_LL f = −H_Lq
        free = np.diag(np.where(self.fixed, 0.0, 1.0))
        h_ll, h_lq = receptance[:, q:, q:], receptance[:, q:, :q]
        return np.asarray(-np.linalg.solve(free + y * h_ll, y * h_lq))

    def damping_at(self, point: OperatingPoint) -> Array:
        """Damping (s,) of the linear rows; that of brakes is proportional to torque over speed."""
        return self.damping + self.brake_damping * (point.load / point.speed)

    def _static_part(self, point: OperatingPoint) -> tuple[Array, Array, Array, Array, Array]:
        """S, Z, Y, g and e of ``Receptance``."""
        q, forces = len(self.elements.channels), self.constant_forces(point)
        flexibility, under_load = self.static_motions(point, forces)
        rigid = slice(self.modal.rigid_count)
        z = self.modes[:, rigid] @ self.rigid_basis
        force = self.rigid_basis.T @ (self.modal.channel_modes[:, rigid].T @ forces)
        k = self.static_stiffness
        stiffness = np.linalg.solve(np.eye(len(k)) + k[:, None] * flexibility[q:, q:], np.diag(k))
        by_linear_rows = flexibility[:q, q:] @ stiffness
        return (
            flexibility[:q, :q] - by_linear_rows @ flexibility[q:, :q],
            z[:q] - by_linear_rows @ z[q:],
            z[q:].T @ stiffness @ z[q:],
            force - z[q:].T @ stiffness @ under_load[q:],
            under_load[:q] - by_linear_rows @ under_load[q:],
        )

    def static_motions(self, point: OperatingPoint, forces: Array) -> tuple[Array, Array]:
        """Flexibility (q + s, q + s) of ``rows`` without rigid motions, and their motion (q + s,)
        under constant forces (n_c,) on all channels."""
        m = self.modal
        r = m.rigid_count
        a = self.operator(np.zeros(1), point.speed)[0].real
        elastic, p = a[r:] if a.ndim == 1 else a[r:, r:], self.modes[:, r:]
        columns = np.column_stack([p.T, m.channel_modes[:, r:].T @ forces])
        answer = columns / elastic[:, None] if a.ndim == 1 else np.linalg.solve(elastic, columns)
        motion = p @ answer
        residual = self.rows @ (m.residual @ forces)
        return motion[:, :-1] + self.residual, motion[:, -1] + residual


def condensed_train(elements: OrbitElements, harmonics: int) -> CondensedTrain:
    """The linear part of a train, for the force elements of one stage and a number of harmonics."""
    modal, springs = elements.modal, elements.springs
    none, machines, r = np.zeros(len(springs.rows)), list(_machines(modal)), modal.rigid_count
    stiffness, damping, brake_damping, fixed = np.reshape([x[1:] for x in machines], (-1, 4)).T
    return CondensedTrain(
        elements=elements,
        harmonics=harmonics,
        linear=np.vstack([springs.rows, *(row for row, *_ in machines)]),
        stiffness=np.r_[springs.stiffness, stiffness],
        damping=np.r_[springs.damping, damping],
        brake_damping=np.r_[none, brake_damping],
        static_stiffness=np.r_[springs.stiffness, 0.0 * stiffness],
        fixed=np.r_[none, fixed] > 0.0,
        rigid_basis=linalg.null_space(modal.rolling[:r].T),
    )


def _machines(modal: ModalSystem) -> Iterator[tuple[Array, float, float, float, bool]]:
    """Ports whose torque depends on their motion or whose speed is given: row (n_c,), stiffness
    N·m/rad, damping N·m·s/rad, damping of a brake at rated speed, and whether speed is given."""
    system = modal.system
    for p, machine in enumerate(system.machines):
        row = np.zeros(len(modal.channels))
        row[len(row) - len(system.ports) + p] = 1.0
        if isinstance(machine, GivenSpeed):
            yield row, 0.0, 0.0, 0.0, True
        elif isinstance(machine, Controller):
            yield row, machine.integral, machine.proportional, 0.0, False
        elif isinstance(machine, Brake) and machine.rated_speed > 0.0:
            slope = machine.exponent * machine.rated_torque / machine.rated_speed
            yield row, 0.0, 0.0, slope, False
