r"""Steady states over a gear-mesh period: harmonic balance, alternating frequency and time.

The unknowns are the harmonics f_l (q,), l = 0 … H, of the forces of force elements on their
channels, and the amplitudes a of the rigid motions. Motion u and rate u̇ of the channels are

    u_0 = S f_0 + Z a + e,   u_l = H_l f_l,   u̇_l = H'_l f_l,
    u(t) = Re Σ u_l e^{ilωt}

(S, Z, e, H, H', Y, g: ``orbit_receptance``). The laws give forces at N samples of the period, whose
harmonics must equal the assumed ones,

    f_l + (Wᵀ F(W u + e, W u̇ + ė))_l = 0,   Zᵀ f_0 − Y a + g = 0.

One-sided contact is not smoothed; N ≥ 16 H samples resolve it. The Jacobian is exact: with K̂_m the
harmonics of the tangents over the samples, K̂_m = 1/N Σ_j K_j e^{−2πimj/N}, a change of u_k changes
the forces' harmonic l by K̂_{l−k} u_k + K̂_{l+k} ū_k.
After Cameron and Griffin 1989 (alternating frequency/time); condensed to the channels of contact.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import linalg
from scipy.sparse.linalg import LinearOperator, gmres

from flexgear.analysis.orbit import OrbitElements, gathered, group_products
from flexgear.analysis.orbit_receptance import OperatingPoint, Receptance
from flexgear.arrays import Array, Complex, Ints

SAMPLES = 16  # of a period, for every harmonic: forces of one-sided contact decay slowly
TOLERANCE = 1e-9  # residual of the equations over the largest force of a channel
MAX_ITERATIONS = 40  # Newton steps
PATIENCE = 12  # Newton steps within which the residual must fall to half
MAX_FACTORED = 600  # unknowns up to which every Jacobian is factored
GMRES_PRODUCTS, GMRES_TOLERANCE = 16, 1e-4  # products before factors are renewed; rel. residual
MAX_HALVINGS = 4  # of a step that does not reduce the residual


class Waves(NamedTuple):
    """Motion, m, and rate, m/s, of the channels at the N samples of a period, (N, q) each."""

    motion: Array
    rate: Array


@dataclass(frozen=True)
class Orbit:
    """A steady state.

    unknown (m,): real f_0, then real and imaginary parts of f_1 … f_H, then a; force (N, n) N and
    displacement (N, n) m of the rows; tangents (2, N, G, p, p): ∂(Wᵀ F)/∂u and ∂(Wᵀ F)/∂u̇ by groups
    of channels;
    by_frequency (N, q): ∂(Wᵀ F)/∂ω by the rate of errors; residual: largest unbalanced force over
    the largest force of a channel.
    """

    point: OperatingPoint
    unknown: Array
    waves: Waves
    force: Array
    displacement: Array
    tangents: Array
    by_frequency: Array
    residual: float

    @property
    def without_histories(self) -> Orbit:
        """The state with its waves, but without forces, displacements and tangents over time."""
        none = np.zeros((2, 0, 0, 0, 0))
        return replace(
            self, force=none[0], displacement=none[0], tangents=none, by_frequency=none[0]
        )


class Balance:
    """Equations of the steady state of force elements at one operating point; groups: of the
    channels, those of the elements if left out."""

    def __init__(
        self, elements: OrbitElements, receptance: Receptance, groups: Ints | None = None
    ) -> None:
        self.elements, self.receptance = elements, receptance
        self.groups = elements.groups if groups is None else groups
        self.q, self.harmonics = receptance.static_motion.size, len(receptance.dynamic)
        self.forces = self.q * (2 * self.harmonics + 1)
        self.size = self.forces + len(receptance.rigid_force)

    def waves(self, unknown: Array) -> Waves:
        """Motion and rate of the channels for unknowns (m,)."""
        r, (f, a) = self.receptance, self.parts(unknown)
        u = np.einsum("kij,kj->ki", r.dynamic, f[1:])
        mean = r.static @ f[0].real + r.rigid @ a + r.static_motion
        rate = np.einsum("kij,kj->ki", r.rate, f[1:])
        n = self.elements.samples
        return Waves(in_time(np.vstack([mean, u]), n), in_time(np.vstack([0 * mean, rate]), n))

    def parts(self, unknown: Array) -> tuple[Complex, Array]:
        """Harmonics f (H + 1, q) and rigid amplitudes a of unknowns (m,)."""
        q, h = self.q, self.harmonics
        f = np.zeros((h + 1, q), dtype=complex)
        f[0] = unknown[:q]
        real_imaginary = unknown[q : self.forces].reshape(h, 2, q)
        f[1:] = real_imaginary[:, 0] + 1j * real_imaginary[:, 1]
        return f, unknown[self.forces :]

    def unknowns(self, f: Complex, a: Array) -> Array:
        """Unknowns (m,) from harmonics f (h + 1, q), h ≤ H, and rigid amplitudes a."""
        out = np.zeros(self.size)
        real_imaginary = np.stack([f[1:].real, f[1:].imag], axis=1).ravel()
        out[: self.q], out[self.q : self.q + len(real_imaginary)] = f[0].real, real_imaginary
        out[self.forces :] = a
        return out

    def residual(self, unknown: Array) -> tuple[Array, Orbit]:
        """Residual (m,) of the equations, and the state of the unknowns without operating point."""
        waves, e = self.waves(unknown), self.elements
        force, tangent, displacement = e.row_forces(*waves, self.receptance.omega)
        out = self._imbalance(unknown, e.channel_forces(force))
        largest = float(np.abs(unknown[: self.forces]).max(initial=0.0)) or 1.0
        relative = float(np.abs(out[: self.forces]).max(initial=0.0)) / largest
        tangents = np.array([e.on_channels(t) for t in tangent])
        by_frequency = e.by_rate_of_errors(tangent[1])
        no_point = OperatingPoint(0.0, 0.0)
        return out, Orbit(
            no_point, unknown, waves, force, displacement, tangents, by_frequency, relative
        )

    def _imbalance(self, unknown: Array, forces: Array) -> Array:
        """Residual (m,) of the equations with channel forces (N, q) over the samples, N."""
        r, (f, a) = self.receptance, self.parts(unknown)
        harmonics = np.fft.rfft(forces, axis=0)[: self.harmonics + 1] / len(forces)
        harmonics[1:] *= 2.0
        rigid = r.rigid.T @ f[0].real - r.rigid_stiffness @ a + r.rigid_force
        return self.unknowns(f + harmonics, rigid)

    def change(self, other: Balance, orbit: Orbit) -> Array:
        """Change (m,) of the residual at a state of these equations in those of another operating
        point, to first order in the motion by its forces and in the rates of errors."""
        other_waves = other.waves(orbit.unknown)
        motion, rate = other_waves.motion - orbit.waves.motion, other_waves.rate - orbit.waves.rate
        (k, c), none = orbit.tangents, np.zeros_like(motion)
        d_omega = other.receptance.omega - self.receptance.omega
        forces = group_products(k, motion, self.groups) + group_products(c, rate, self.groups)
        forces += d_omega * orbit.by_frequency
        return other._imbalance(orbit.unknown, forces) - self._imbalance(orbit.unknown, none)

    def loaded(self, tangents: Array, forces: Array) -> Ints:
        """Groups with tangents (2, N, G, p, p), or with forces (q,) other than zero."""
        of_group = gathered(forces[None] != 0.0, self.groups)[0].any(axis=1)
        return np.flatnonzero(of_group | tangents.any(axis=(0, 1, 3, 4)))

    def restricted(self, at: Ints) -> tuple[Ints, Balance]:
        """Indices (k,) of the unknowns of the channels of the groups ``at`` and of rigid motions,
        and the linear part of the equations in these unknowns."""
        channels = np.unique(self.groups[at])
        channels = channels[channels < self.q]
        places = self.q * np.arange(2 * self.harmonics + 1)[:, None] + channels
        rigid = np.arange(self.forces, self.size)
        groups = np.searchsorted(channels, self.groups[at])
        part = Balance(self.elements, self.receptance.restricted(channels), groups)
        return np.r_[places.ravel(), rigid].astype(np.int64), part

    def product(self, tangents: Array, unknown: Array) -> Array:
        """Jacobian times ``unknown`` (m,), for equations without constant part."""
        (motion, rate), (k, c) = self.waves(unknown), tangents
        forces = group_products(k, motion, self.groups) + group_products(c, rate, self.groups)
        return self._imbalance(unknown, forces)

    def jacobian(self, tangents: Array) -> Array:
        """∂ residual / ∂ unknown (m, m) from tangents (2, N, G, p, p)."""
        r, q, h = self.receptance, self.q, self.harmonics
        k, c = (_coefficients(t, 2 * h) for t in tangents)
        out = np.eye(self.size)
        at = np.arange(1, h + 1)
        difference, total = at[:, None] - at + 2 * h, at[:, None] + at + 2 * h
        forward = self._onto(k[difference], r.dynamic) + self._onto(c[difference], r.rate)
        # factor of the conjugate of f_k
        mirrored = self._onto(k[total], r.dynamic.conj()) + self._onto(c[total], r.rate.conj())
        plus, minus = forward + mirrored, forward - mirrored
        blocks: Array = np.array([[plus.real, -minus.imag], [plus.imag, minus.real]])
        varying = blocks.transpose(2, 0, 4, 3, 1, 5).reshape(2 * h * q, 2 * h * q)
        out[q : self.forces, q : self.forces] += varying
        mean = self._onto(k[2 * h - at], r.dynamic) + self._onto(c[2 * h - at], r.rate)  # (H, q, q)
        out[:q, q : self.forces] += (
            np.stack([mean.real, -mean.imag], axis=1).transpose(2, 0, 1, 3).reshape(q, 2 * h * q)
        )
        mean_motion = np.hstack([r.static, r.rigid])  # (q, q + r)
        by_mean = 2.0 * self._onto(k[2 * h + at], mean_motion)  # (H, q, q + r)
        varying_by_mean = np.stack([by_mean.real, by_mean.imag], axis=1).reshape(2 * h * q, -1)
        constant = self._onto(k[2 * h], mean_motion).real
        out[:q, :q] += constant[:, :q]
        out[:q, self.forces :] += constant[:, q:]
        out[q : self.forces, :q] += varying_by_mean[:, :q]
        out[q : self.forces, self.forces :] += varying_by_mean[:, q:]
        out[self.forces :, :q] = r.rigid.T
        out[self.forces :, self.forces :] = -r.rigid_stiffness
        return out

    def _onto(self, tangents: Complex, motion: Array | Complex) -> Complex:
        """Products (…, q, c) of tangents (…, G, p, p) with motions (…, q, c) of the channels."""
        padded = np.concatenate([motion, np.zeros_like(motion[..., :1, :])], axis=-2)
        by_group = tangents @ padded[..., self.groups, :]
        out = np.zeros((*by_group.shape[:-3], self.q + 1, by_group.shape[-1]), dtype=complex)
        out[..., self.groups, :] = by_group
        return out[..., :-1, :]

    def start(self) -> Array:
        """Initial unknowns (m,): the solution with all pairs as linear, two-sided springs."""
        e = self.elements
        tangents = e.linear_tangents
        by_offset = e.channel_forces(e.nominal[0] * e.offset)
        out = np.zeros(self.size)
        motion = self.waves(out).motion
        by_motion = group_products(tangents[0], motion, self.groups)
        imbalance = self._imbalance(out, by_offset + by_motion)
        at = self.loaded(tangents, np.zeros(self.q))
        places, part = self.restricted(at)
        matrix = part.jacobian(tangents[:, :, at])
        out[places] = -Factors(matrix).solve(imbalance[places])
        return out


def in_time(harmonics: Complex, samples: int) -> Array:
    """Σ Re(x_l e^{ilφ}) at N samples (N, q); harmonics: x (H + 1, q)."""
    spectrum = np.zeros((samples // 2 + 1, harmonics.shape[1]), dtype=complex)
    spectrum[: len(harmonics)] = harmonics
    spectrum[1:] *= 0.5
    return np.asarray(np.fft.irfft(spectrum * samples, samples, axis=0))


def _coefficients(values: Array, highest: int) -> Complex:
    """Fourier coefficients K̂_m, m = −highest … highest, of tangents (N, G, p, p) at N samples."""
    spectrum = np.fft.rfft(values, axis=0)[: highest + 1] / len(values)
    return np.concatenate([spectrum[:0:-1].conj(), spectrum])


class Factors:
    """LU of a matrix with rows and columns scaled by their largest entries. Solutions of a singular
    one, as where all teeth are apart, are not finite."""

    def __init__(self, matrix: Array) -> None:
        self.columns, scaled = _scaled(matrix, 0)
        self.rows, scaled = _scaled(scaled, 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", linalg.LinAlgWarning)
            self._lu = linalg.lu_factor(scaled, overwrite_a=True, check_finite=False)

    def solve(self, right: Array, scaled: bool = False) -> Array:
        """Solution x of matrix · x = right; scaled: x times ``columns``."""
        x = linalg.lu_solve(self._lu, right / self.rows, check_finite=False)
        return np.asarray(x if scaled else x / self.columns)


def _scaled(matrix: Array, axis: int) -> tuple[Array, Array]:
    """Largest entries along an axis, 1 where all are zero, and the matrix divided by them."""
    largest = np.abs(matrix).max(axis=axis)
    largest = np.where(largest > 0, largest, 1.0)
    return largest, matrix / np.expand_dims(largest, axis)


class Solver:
    """Solver for bordered Jacobians of neighbouring states. With few unknowns each Jacobian is
    factored; with many the factors of an earlier one precondition GMRES, and are renewed where it
    needs too many products."""

    def __init__(self) -> None:
        self._places: Ints = np.zeros(0, dtype=np.int64)
        self._factors = Factors(np.eye(1))

    def solve(
        self, balance: Balance, orbit: Orbit, right: Array, column: Array, row: Array
    ) -> Array:
        """(x, λ) (m + 1,) with J x + column λ = right and row · (x, λ) = right_m at a state; J is
        the identity for channels without force."""
        at = balance.loaded(orbit.tangents, np.abs(balance.parts(orbit.unknown)[0]).max(axis=0))
        inner, part = balance.restricted(at)
        places, tangents = np.r_[inner, balance.size], orbit.tangents[:, :, at]
        out, column, row = right.copy(), column[inner], row[places]
        if len(places) > MAX_FACTORED and np.array_equal(places, self._places):

            def product(y: Array) -> Array:
                x = y / self._factors.columns
                image = part.product(tangents, x[:-1]) + column * x[-1]
                return self._factors.solve(np.r_[image, row @ x], scaled=True)

            y, not_converged = gmres(
                LinearOperator((len(places), len(places)), product),
                self._factors.solve(right[places], scaled=True),
                rtol=GMRES_TOLERANCE, restart=GMRES_PRODUCTS, maxiter=1,
            )  # fmt: skip
            if not not_converged:
                out[places] = y / self._factors.columns
                return out
        matrix = np.block([[part.jacobian(tangents), column[:, None]], [row[None]]])
        self._places, self._factors = places, Factors(matrix)
        out[places] = self._factors.solve(right[places])
        return out


def converge(balance: Balance, point: OperatingPoint, unknown: Array) -> Orbit | None:
    """The steady state by Newton's method from unknowns (m,); None without convergence."""
    imbalance, orbit = balance.residual(unknown)
    solver, difference = Solver(), np.zeros(balance.size + 1)
    difference[-1], sizes = 1.0, list[float]()
    for _ in range(MAX_ITERATIONS):
        if orbit.residual <= TOLERANCE:
            return replace(orbit, point=point)
        sizes.append(float(np.linalg.norm(imbalance)))
        if len(sizes) > PATIENCE and sizes[-1] > 0.5 * sizes[-1 - PATIENCE]:
            return None
        step = solver.solve(balance, orbit, np.r_[imbalance, 0.0], difference[:-1], difference)[:-1]
        if not np.isfinite(step).all():
            return None
        share = 1.0
        for _ in range(MAX_HALVINGS + 1):
            trial, state = balance.residual(orbit.unknown - share * step)
            if np.linalg.norm(trial) < np.linalg.norm(imbalance):
                break
            share *= 0.5
        imbalance, orbit = trial, state
    return None
