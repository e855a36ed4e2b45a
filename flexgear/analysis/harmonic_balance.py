r"""Steady states over a gear-mesh period: harmonic balance, alternating frequency and time.

Unknown are the harmonics f_l (q,), l = 0 … H, of the forces that force elements put on their
channels, and the amplitudes a of the rigid motions. With motion and rate of the channels,

    u_0 = S f_0 + Z a + e,   u_l = H_l f_l,   u̇_l = H'_l f_l,
    u(t) = Re Σ u_l e^{ilωt},

the laws give forces at N samples of the period, whose first harmonics are to be those assumed,

    f_l + (Wᵀ F(W u + e, W u̇))_l = 0,   Zᵀ f_0 − Y a + g = 0.

Laws are taken as they are: one-sided contact is not smoothed, and N ≥ 16 H samples follow it. The
Jacobian is exact: with K̂_m the harmonics of the tangents over the samples, K̂_m = 1/N Σ_j K_j
e^{−2πimj/N}, a change of u_k changes the forces' harmonic l by K̂_{l−k} u_k + K̂_{l+k} ū_k.
After Cameron and Griffin 1989 (alternating frequency/time); condensed to the channels of contact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from flexgear.analysis.orbit import OrbitElements
from flexgear.analysis.orbit_receptance import Point, Receptance
from flexgear.arrays import Array, Complex, Ints

SAMPLES = 16  # of a period, for every harmonic: forces of one-sided contact decay slowly
AGREES = 1e-9  # of the largest force of a channel: what may be left over of its balance
TRIES = 40  # Newton steps
HALVINGS = 4  # of a step that does not lessen what is left over


class Waves(NamedTuple):
    """Channels over the N samples of a period: motion m and rate m/s (N, q)."""

    motion: Array
    rate: Array


@dataclass(frozen=True)
class Orbit:
    """A steady state; unknown (m,): real f_0, then real and imaginary parts of f_1 … f_H, then a.

    force (N, n) N and displacement (N, n) m of the rows; tangents (2, N, q, q): ∂(Wᵀ F)/∂u, ∂u̇;
    residual: largest force that is not balanced over the largest force of a channel.
    """

    point: Point
    unknown: Array
    waves: Waves
    force: Array
    displacement: Array
    tangents: Array
    residual: float


class Balance:
    """Equations of the steady state of force elements at one point."""

    def __init__(self, elements: OrbitElements, receptance: Receptance) -> None:
        self.elements, self.receptance = elements, receptance
        self.q, self.harmonics = receptance.static.size, len(receptance.moving)
        self.forces = self.q * (2 * self.harmonics + 1)
        self.size = self.forces + len(receptance.balance)

    def waves(self, unknown: Array) -> Waves:
        """Motion and rate of the channels."""
        r, (f, a) = self.receptance, self.parts(unknown)
        u = np.einsum("kij,kj->ki", r.moving, f[1:])
        first = r.still @ f[0].real + r.rigid @ a + r.static
        rate = np.einsum("kij,kj->ki", r.rate, f[1:])
        n = self.elements.samples
        return Waves(in_time(np.vstack([first, u]), n), in_time(np.vstack([0 * first, rate]), n))

    def parts(self, unknown: Array) -> tuple[Complex, Array]:
        """Harmonics f (H + 1, q) and rigid amplitudes a."""
        q, h = self.q, self.harmonics
        f = np.zeros((h + 1, q), dtype=complex)
        f[0] = unknown[:q]
        both = unknown[q : self.forces].reshape(h, 2, q)
        f[1:] = both[:, 0] + 1j * both[:, 1]
        return f, unknown[self.forces :]

    def residual(self, unknown: Array) -> tuple[Array, Orbit]:
        """What is left over (m,), and the state it belongs to, without point."""
        waves = self.waves(unknown)
        force, tangent, displacement = self.elements.row_forces(*waves)
        out = self._left(unknown, self.elements.channel_forces(force))
        largest = float(np.abs(unknown[: self.forces]).max(initial=0.0)) or 1.0
        over = float(np.abs(out[: self.forces]).max(initial=0.0)) / largest
        tangents = np.array([self.elements.on_channels(t) for t in tangent])
        return out, Orbit(Point(0.0, 0.0), unknown, waves, force, displacement, tangents, over)

    def _left(self, unknown: Array, on_channels: Array) -> Array:
        r, (f, a) = self.receptance, self.parts(unknown)
        answer = np.fft.rfft(on_channels, axis=0)[: self.harmonics + 1] / len(on_channels)
        answer[1:] *= 2.0
        rest = f + answer
        both = np.stack([rest[1:].real, rest[1:].imag], axis=1)
        balance = r.rigid.T @ f[0].real - r.yielding @ a + r.balance
        return np.concatenate([rest[0].real, both.ravel(), balance])

    def change(self, other: Balance, orbit: Orbit) -> Array:
        """How much more (m,) the equations of another point leave over of a state of these ones, to
        first order of the motion that its forces cause."""
        ahead = other.waves(orbit.unknown)
        motion, rate = ahead.motion - orbit.waves.motion, ahead.rate - orbit.waves.rate
        (k, c), none = orbit.tangents, np.zeros_like(motion)
        forces = np.einsum("jqp,jp->jq", k, motion) + np.einsum("jqp,jp->jq", c, rate)
        return other._left(orbit.unknown, forces) - self._left(orbit.unknown, none)

    def linearised(self, orbit: Orbit) -> tuple[Ints, Array]:
        """Places (k,) of the unknowns of channels that carry and of rigid motions, and the Jacobian
        (k, k) between them; the others, and what is left over of them, are zero."""
        loaded = self.parts(orbit.unknown)[0].any(axis=0)
        at = np.flatnonzero(loaded | orbit.tangents.any(axis=(0, 1, 2)))
        return self._between(at, orbit.tangents)

    def _between(self, at: Ints, tangents: Array) -> tuple[Ints, Array]:
        """``linearised`` for the channels ``at``."""
        places = self.q * np.arange(2 * self.harmonics + 1)[:, None] + at
        free = np.arange(self.forces, self.size)
        part = Balance(self.elements, self.receptance.between(at))
        jacobian = part.jacobian(tangents[:, :, at[:, None], at])
        return np.r_[places.ravel(), free].astype(np.int64), jacobian

    def jacobian(self, tangents: Array) -> Array:
        """∂ residual / ∂ unknown (m, m) from tangents (2, N, q, q)."""
        r, q, h = self.receptance, self.q, self.harmonics
        k, c = (_coefficients(t, 2 * h) for t in tangents)
        out = np.eye(self.size)
        at = np.arange(1, h + 1)
        difference, total = at[:, None] - at + 2 * h, at[:, None] + at + 2 * h
        ahead = k[difference] @ r.moving + c[difference] @ r.rate  # of f_k
        mirrored = k[total] @ r.moving.conj() + c[total] @ r.rate.conj()  # of f_k conjugate
        plus, minus = ahead + mirrored, ahead - mirrored
        blocks: Array = np.array([[plus.real, -minus.imag], [plus.imag, minus.real]])
        moved = blocks.transpose(2, 0, 4, 3, 1, 5).reshape(2 * h * q, 2 * h * q)
        out[q : self.forces, q : self.forces] += moved
        mean = k[2 * h - at] @ r.moving + c[2 * h - at] @ r.rate  # (H, q, q)
        out[:q, q : self.forces] += (
            np.stack([mean.real, -mean.imag], axis=1).transpose(2, 0, 1, 3).reshape(q, 2 * h * q)
        )
        of_mean = np.hstack([r.still, r.rigid])
        by_mean = 2.0 * k[2 * h + at] @ of_mean  # (H, q, q + r)
        onto = np.stack([by_mean.real, by_mean.imag], axis=1).reshape(2 * h * q, -1)
        still: Array = k[2 * h].real @ of_mean
        out[:q, :q] += still[:, :q]
        out[:q, self.forces :] += still[:, q:]
        out[q : self.forces, :q] += onto[:, :q]
        out[q : self.forces, self.forces :] += onto[:, q:]
        out[self.forces :, :q] = r.rigid.T
        out[self.forces :, self.forces :] = -r.yielding
        return out

    def start(self) -> Array:
        """Unknowns to start from: pairs of the carrying flanks on their path touch or pull."""
        e = self.elements
        tangents = e.linear_tangents
        pull = np.einsum("jnq,jn->jq", e.rows, e.nominal[0] * e.offset)
        out = np.zeros(self.size)
        motion = self.waves(out).motion
        left = self._left(out, pull + np.einsum("jqp,jp->jq", tangents[0], motion))
        at, matrix = self._between(np.flatnonzero(tangents.any(axis=(0, 1, 2))), tangents)
        out[at] = -solve_scaled(matrix, left[at])
        return out


def in_time(harmonics: Complex, samples: int) -> Array:
    """Σ Re(x_l e^{ilφ}) at N samples (N, q)."""
    spectrum = np.zeros((samples // 2 + 1, harmonics.shape[1]), dtype=complex)
    spectrum[: len(harmonics)] = harmonics
    spectrum[1:] *= 0.5
    return np.asarray(np.fft.irfft(spectrum * samples, samples, axis=0))


def _coefficients(values: Array, most: int) -> Complex:
    """K̂_m for m = −most … most of samples (N, q, q)."""
    spectrum = np.fft.rfft(values, axis=0)[: most + 1] / len(values)
    return np.concatenate([spectrum[:0:-1].conj(), spectrum])


def solve_scaled(matrix: Array, right: Array) -> Array:
    """Solution with rows and columns scaled by their largest entries."""
    columns = np.abs(matrix).max(axis=0)
    columns = np.where(columns > 0, columns, 1.0)
    scaled = matrix / columns
    rows = np.abs(scaled).max(axis=1)
    rows = np.where(rows > 0, rows, 1.0)
    x = np.linalg.solve(scaled / rows[:, None], (right.T / rows).T)
    return np.asarray((x.T / columns).T)


def converge(balance: Balance, point: Point, unknown: Array) -> Orbit | None:
    """The steady state that Newton's method leads to from some unknowns; None where to none."""
    left, orbit = balance.residual(unknown)
    for _ in range(TRIES):
        if orbit.residual <= AGREES:
            return replace(orbit, point=point)
        at, matrix = balance.linearised(orbit)
        step = left.copy()  # of channels that carry nothing
        try:
            step[at] = solve_scaled(matrix, left[at])
        except np.linalg.LinAlgError:
            return None
        share = 1.0
        for _ in range(HALVINGS + 1):
            trial, state = balance.residual(orbit.unknown - share * step)
            if np.linalg.norm(trial) < np.linalg.norm(left):
                break
            share *= 0.5
        left, orbit = trial, state
    return None
