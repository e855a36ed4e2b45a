r"""Receptances of the channels of an orbit at every harmonic of the gear-mesh frequency.

The train in kept modes, η̈ + (D + s G) η̇ + (Ω² − s² C) η = Pᵀ f at a share s of rated speed, answers
to forces f on the channels at harmonic l, ω_l = 2π l f_z, with

    u_l = H_l f_l,   H_l = P A_l⁻¹ Pᵀ + R,   u̇_l = iω_l P A_l⁻¹ Pᵀ f_l,
    A_l = Ω² − s² C − ω_l² + iω_l (D + s G),

R being the residual flexibility, which never enters a velocity, as in time steps. Linear rows
(supports that turn, mean springs of other stages, machines at ports whose torque follows their
motion, −Y_l u_L) are eliminated, H = H_qq − H_qL (1 + Y H_LL)⁻¹ Y H_Lq; ports of given speed do not
move.

At l = 0 rolling is free, and no row of a force element sees it: the mean angle is zero, and the
torques of the ports balance. The other rigid motions are unknown, and in balance:

    u_0 = S f_0 + Z a + e,   Zᵀ f_0 − Y a + g = 0,

Y being what linear rows hold of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

from flexgear.analysis.orbit import OrbitElements
from flexgear.arrays import Array, Complex, Ints
from flexgear.coupling.machines import Brake, Controller, GivenSpeed
from flexgear.coupling.modal import ModalSystem


@dataclass(frozen=True)
class Point:
    """Where a steady state is wanted: speed and load (torques of all ports), each over rated."""

    speed: float
    load: float


@dataclass(frozen=True)
class Receptance:
    """At a point; q channels, H harmonics, r rigid motions beside rolling.

    omega: 2π f_z rad/s; moving, rate (H, q, q): H_l and u̇_l of unit forces; still (q, q): S;
    rigid (q, r): Z; yielding (r, r): Y; balance (r,): g; static (q,): e.
    """

    omega: float
    moving: Complex
    rate: Complex
    still: Array
    rigid: Array
    yielding: Array
    balance: Array
    static: Array

    def between(self, at: Ints) -> Receptance:
        """Receptance between some of the channels, without the constant parts."""
        index = np.ix_(at, at)
        return replace(
            self,
            moving=self.moving[:, at[:, None], at],
            rate=self.rate[:, at[:, None], at],
            still=self.still[index],
            rigid=self.rigid[at],
            balance=0.0 * self.balance,
            static=0.0 * self.static[at],
        )


@dataclass(frozen=True)
class CondensedTrain:
    """What receptances at any point are made of: the linear part of a train with its channels.

    linear (s, n_c): linear rows, those of the elements' springs, then of machines; stiffness,
    damping (s,) of them; braking (s,): damping of brakes at rated speed and torque; steady (s,):
    stiffness at a steady speed, at which machines do nothing; held (s,): ports of given speed;
    free (r, k): amplitudes of the rigid modes but rolling.
    """

    elements: OrbitElements
    harmonics: int
    linear: Array
    stiffness: Array
    damping: Array
    braking: Array
    steady: Array
    held: NDArray[np.bool_]
    free: Array

    @property
    def modal(self) -> ModalSystem:
        """The train in its modes, as the force elements have it."""
        return self.elements.modal

    @cached_property
    def rows(self) -> Array:
        """Channels of the elements, then linear rows, (q + s, n_c)."""
        return np.vstack([self.elements.channels, self.linear])

    @cached_property
    def modes(self) -> Array:
        """``rows`` in modes (q + s, n)."""
        return self.rows @ self.modal.channel_modes

    @cached_property
    def residual(self) -> Array:
        """Between ``rows``, (q + s, q + s) m/N."""
        return np.asarray(self.rows @ self.modal.residual @ self.rows.T)

    def given_forces(self, point: Point) -> Array:
        """Constant forces on the channels (n_c,): loads, and torques of ports in balance."""
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
        """A (H, n, n) at ω (H,), or its diagonals (H, n) where modes do not couple."""
        m, w = self.modal, omega[:, None]
        diagonals: Complex = m.omega**2 - w**2 + 1j * w * m.damping
        if not m.gyroscopic.size:
            return diagonals
        coupled = 1j * w[:, :, None] * speed * m.gyroscopic - speed**2 * m.centripetal
        return np.asarray(np.eye(len(m.omega)) * diagonals[:, :, None] + coupled)

    def answers(self, omega: Array, speed: float) -> Complex:
        """Modal coordinates (H, n, q + s) at ω (H,) under unit forces on ``rows``."""
        a = self.operator(omega, speed)
        forces = self.modes.T
        return np.asarray(forces / a[:, :, None] if a.ndim == 2 else np.linalg.solve(a, forces))

    def at(self, point: Point) -> Receptance:
        """Receptances at a point."""
        omega, q = 2 * np.pi * self.elements.frequency * point.speed, len(self.elements.channels)
        w = omega * np.arange(1.0, self.harmonics + 1)
        h = self.modes @ self.answers(w, point.speed)
        whole = h + self.residual
        follow = self.follow(whole, w, point)
        moving = whole[:, :q, :q] + whole[:, :q, q:] @ follow
        rate = 1j * w[:, None, None] * (h[:, :q, :q] + h[:, :q, q:] @ follow)
        return Receptance(omega, moving, rate, *self._still(point))

    def follow(self, whole: Complex, omega: Array, point: Point) -> Complex:
        """Forces (H, s, q) on the linear rows by unit forces on the channels, at ω (H,), from the
        receptances (H, q + s, q + s) of all rows."""
        q = len(self.elements.channels)
        y = self.stiffness + 1j * omega[:, None] * self.damping_at(point)
        y = np.where(self.held, 1.0, y)[:, :, None]  # held rows do not move, H_LL f = −H_Lq
        loose = np.diag(np.where(self.held, 0.0, 1.0))
        return np.asarray(-np.linalg.solve(loose + y * whole[:, q:, q:], y * whole[:, q:, :q]))

    def damping_at(self, point: Point) -> Array:
        """Damping (s,) of the linear rows; slopes of brakes go with their torque over speed."""
        return self.damping + self.braking * (point.load / point.speed)

    def _still(self, point: Point) -> tuple[Array, Array, Array, Array, Array]:
        """S, Z, Y, g and e of ``Receptance``."""
        q, forces = len(self.elements.channels), self.given_forces(point)
        flexibility, under_load = self.still_motions(point, forces)
        z = self.modes[:, : self.modal.rigid_count] @ self.free
        push = self.free.T @ (self.modal.channel_modes[:, : self.modal.rigid_count].T @ forces)
        k = self.steady
        held = np.linalg.solve(np.eye(len(k)) + k[:, None] * flexibility[q:, q:], np.diag(k))
        across = flexibility[:q, q:] @ held
        return (
            flexibility[:q, :q] - across @ flexibility[q:, :q],
            z[:q] - across @ z[q:],
            z[q:].T @ held @ z[q:],
            push - z[q:].T @ held @ under_load[q:],
            under_load[:q] - across @ under_load[q:],
        )

    def still_motions(self, point: Point, forces: Array) -> tuple[Array, Array]:
        """Flexibility (q + s, q + s) of the rows without rigid motions, and their motion (q + s,)
        under forces (n_c,) on all channels."""
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
    """The linear part of a train for the force elements of one of its stages."""
    modal, springs = elements.modal, elements.springs
    none, machines, r = np.zeros(len(springs.rows)), list(_machines(modal)), modal.rigid_count
    stiffness, damping, braking, held = np.reshape([x[1:] for x in machines], (-1, 4)).T
    return CondensedTrain(
        elements=elements,
        harmonics=harmonics,
        linear=np.vstack([springs.rows, *(row for row, *_ in machines)]),
        stiffness=np.r_[springs.stiffness, stiffness],
        damping=np.r_[springs.damping, damping],
        braking=np.r_[none, braking],
        steady=np.r_[springs.stiffness, 0.0 * stiffness],
        held=np.r_[none, held] > 0.0,
        free=linalg.null_space(modal.rolling[:r].T),
    )


def _machines(modal: ModalSystem) -> Iterator[tuple[Array, float, float, float, bool]]:
    """Rows (n_c,) of ports whose torque follows their motion, with stiffness N·m/rad, damping
    N·m·s/rad, that of brakes at rated speed, and whether their speed is given."""
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
