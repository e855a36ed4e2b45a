"""Excitation of modes by the varying gear-mesh stiffness: resonances, parametric instability.

**Nodal index.** A stage of N equal planets with equal spacing is symmetric under rotation by 2π/N.
In a mode the motion of each planet is that of the previous one times e^{2πik/N}: k = 0 (rotational
and axial modes of Lin & Parker); k = 1, N − 1 (translational, tilting); or another k (planet modes,
in which the central members do not move). On a ring, waves of n nodal diameters have k = n mod N.
Real modes contain k and N − k equally and get the smaller index.

At planet i order l of the gear-mesh frequency has the phase l z_s φ_i, so that it excites

    k = l z_s mod N

and does no work on any other mode, as long as planets and their connections are equal.

Source: Lin & Parker 1999, J. Vib. Acoust. 121:316; Parker 2000, J. Sound Vib. 236:561.

**Resonance.** The stiffness of gear mesh m varies about its mean as Re Σ_l k_l e^{ilψ}. At its
mean closing and tilt order l acts on the bodies with the force g_l (``FlankCycle``). At resonance
modes j of one frequency respond with

    η_j = Σ_m φ_jᵀ g_{m,l} / (ω_j γ_j),   γ_j = 2 ζ_j ω_j,

which causes the force k̄_m |Σ_j v_mᵀ φ_j η_j| in gear mesh m, v_m being its mean row. γ_j is the
decay rate of the mode, φ_jᵀ C φ_j by structural damping, dampers, brakes and tooth pairs. This is
first order in the variation, for one group of modes, without loss of contact.

**Parametric instability.** In modes of the mean stiffness, about a steady state without loss of
contact,

    q̈ + (C(ψ) + s G) q̇ + (K(ψ) − s² K_c) q = 0,   ψ = ω_z t,

G and K_c gyroscopic and centripetal matrices at rated speed, s speed over rated speed. K and C are
constant in each of P equal parts of the gear-mesh period T = 2π/ω_z, so that the monodromy matrix
is exact,

    y(T) = Π_p exp(A_p T/P) y(0),   y = (Ω q, q̇),   A_p = [[0, Ω], [−K_p/Ω, −C_p]],

with any frequency Ω as scale. Its eigenvalues μ are the Floquet multipliers; vibration grows at the
rate ln|μ|/T where one of them is outside the unit circle (Floquet 1883; Nayfeh & Mook 1979,
chapter 5). To first order in the symmetric variation K_l of K at order l, this happens about

    l ω_z = ω_i + ω_j  within  ± 2σ_ij  without damping,   σ_ij = |K_l,ij|/(4 √(ω_i ω_j)),

with the growth rate σ_ij in the middle; damping with decay rates γ/2 of the modes prevents it where
σ² < γ_i γ_j/4 (Lin & Parker 2002, J. Sound Vib. 249:129, for gears).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from flexgear.analysis.flank_cycle import FlankCycle
from flexgear.analysis.modes import Modes, body_energies, repeated, split_space
from flexgear.arrays import Array, Complex, Ints
from flexgear.coupling.system import System
from flexgear.structures.bodies import Body

MIXED, ABSENT, UNEVEN = -1, -2, -3  # codes in the place of a nodal index
UNMIXED = 1e-9  # energy common to two modes by one index, up to which their basis is kept
PURE = 0.9  # least share of one index in the stage's energy
LEAST_ENERGY = 1e-6  # share of a stage in the energy of a mode below which it does not move
EVEN = 1e-9  # rad, tolerance of equal spacing
ON_AXIS = 1e-9  # radius over the size of the body


def excited_index(order: float, sun_teeth: int, planets: int) -> int:
    """Nodal index k = l z_s mod N excited by order l of the gear-mesh frequency, for N equal,
    evenly spaced planets (Parker 2000, J. Sound Vib. 236:561)."""
    return round(order * sun_teeth) % planets


def folded(index: int, planets: int) -> int:
    """The smaller of k and N − k."""
    return min(index % planets, -index % planets)


def evenly_placed(angles: ArrayLike) -> bool:
    """Whether planets at angles (N,) rad are evenly spaced."""
    turns = np.sort(np.mod(np.asarray(angles, dtype=float), 2 * np.pi))
    gaps = np.diff([*turns, turns[0] + 2 * np.pi])
    return bool(np.abs(gaps - 2 * np.pi / len(turns)).max() <= EVEN)


def nodal_indices(system: System, shapes: Array, stage: str, angles: Sequence[float]) -> Ints:
    """min(k, N − k) of modes (d, m) in a stage with planets at ``angles`` (N,) rad.

    MIXED where no index has nine tenths of the stage's kinetic energy, ABSENT in modes in which the
    stage does not move, UNEVEN for planets that are not evenly spaced.
    """
    if not evenly_placed(angles):
        return np.full(shapes.shape[1], UNEVEN, dtype=np.int64)
    count = len(angles)
    energy = np.zeros((count // 2 + 1, shapes.shape[1]))
    for body in (b for b in system.bodies if b.name.stage == stage and b.size):
        if body.name.planet < 0 or count == 1:
            dofs = system.slice_of(body.name)
            energy += _central_energy(body, system.mass[dofs, dofs], shapes[dofs], count)
    if count > 1:
        energy += _fold(np.sum(np.abs(_planet_waves(system, shapes, stage, angles)) ** 2, axis=1))
    total = energy.sum(axis=0)
    indices = np.argmax(energy, axis=0).astype(np.int64)
    indices[energy.max(axis=0) < PURE * total] = MIXED
    indices[total < LEAST_ENERGY * np.einsum("dm,dm->m", shapes, system.mass @ shapes)] = ABSENT
    return indices


def with_one_index(system: System, modes: Modes, stages: Mapping[str, Sequence[float]]) -> Modes:
    """The modes, those of one frequency combined so that each has one nodal index in every stage;
    stages: angles (N,) rad of the planets by stage.

    An eigenvalue solver returns an arbitrary basis for a repeated frequency, such as that of planet
    modes, which differ in their index alone. In the space of these modes the energy of the planets
    with each index is a quadratic form; these forms are diagonalised one after the other.
    """
    shapes = modes.shapes.copy()
    even = {k: v for k, v in stages.items() if len(v) > 1 and evenly_placed(v)}
    for group in map(list, repeated(modes.frequencies, int(np.sum(modes.frequencies == 0.0)))):
        for name, angles in even.items() if modes.frequencies[group[0]] > 0.0 else ():
            waves = _planet_waves(system, shapes[:, group], name, angles)
            forms = _fold(np.einsum("kim,kin->kmn", waves.conj(), waves).real)
            spaces = [np.eye(len(group))]
            if np.abs(forms * (1.0 - spaces[0])).max() <= UNMIXED:
                continue
            for form in forms:
                spaces = [part for space in spaces for part in split_space(space, form)]
            shapes[:, group] = shapes[:, group] @ np.hstack(spaces)
    if np.array_equal(shapes, modes.shapes):
        return modes
    energies = body_energies(system.mass, system.bodies, shapes)
    return replace(modes, shapes=shapes, energy=dict(energies.items()))


def _planet_waves(system: System, shapes: Array, stage: str, angles: Sequence[float]) -> Complex:
    """Waves y (N, c, m) of the planets' motions in planet axes in modes (d, m), by k = 0 … N − 1:
    |y|² is their energy. For FE planets, which have turned by different angles, from the motions of
    their mean axes."""
    planets = [b.name for b in system.bodies if b.name.stage == stage and b.name.planet >= 0]
    names = [planets[i] for i in np.argsort(np.mod(angles, 2 * np.pi))]
    starts = [system.slice_of(name).start for name in names]
    count = min(system.body(names[0]).size, 6)
    motion = np.stack([shapes[start : start + count] for start in starts])
    dofs = slice(starts[0], starts[0] + count)
    lower = linalg.cholesky(system.mass[dofs, dofs], lower=True)
    return np.asarray(lower.T @ np.fft.fft(motion, axis=0) / np.sqrt(len(names)))


def _central_energy(body: Body, mass: Array, shapes: Array, planets: int) -> Array:
    """Energy (N // 2 + 1, m) of a central body by nodal index: by the waves of its nodes round the
    axis; for a rigid body, or without such nodes, by transverse (k = 1) and other motions (k = 0).
    """
    energy = np.einsum("im,im->m", shapes, mass @ shapes)
    nodes = _largest_circle(body)
    if body.rigid or nodes is None:
        part = _transverse_projector(body) @ shapes
        transverse = np.einsum("im,im->m", part, mass @ part)
        out = np.zeros((planets // 2 + 1, shapes.shape[1]))
        out[0] += energy - transverse
        out[1 % planets] += transverse
        return out
    angle = np.arctan2(body.positions[nodes, 1], body.positions[nodes, 0])
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    rows = body.node_map.reshape(-1, 6, body.node_map.shape[1])[nodes, :3]
    x, y, z = np.moveaxis(rows @ shapes, 1, 0)
    local = np.stack([c * x + s * y, c * y - s * x, z])
    waves = np.sum(np.abs(np.fft.fft(local, axis=1)) ** 2, axis=0)  # (nodes, m)
    number = np.round(np.fft.fftfreq(len(waves)) * len(waves)).astype(int)  # −z/2 … z/2
    by_wave = np.zeros((planets, waves.shape[1]))
    np.add.at(by_wave, number % planets, waves)
    total = by_wave.sum(axis=0)
    share = np.divide(by_wave, total, out=np.zeros_like(by_wave), where=total > 0)
    return _fold(share * energy)


def _fold(energy: Array) -> Array:
    """Sums (N // 2 + 1, …) of the energies (N, …) of k and N − k."""
    out = np.zeros((len(energy) // 2 + 1, *energy.shape[1:]))
    for k, of_index in enumerate(energy):
        out[folded(k, len(energy))] += of_index
    return out


def _largest_circle(body: Body) -> Ints | None:
    """Indices of the largest set of nodes of one kind that are evenly spaced round the axis, in the
    order of their angles; None without such a set."""
    kinds: dict[tuple[str, str], list[int]] = {}
    for i, node in enumerate(body.nodes):
        kinds.setdefault((node.kind, node.side), []).append(i)
    best: Ints | None = None
    size = float(np.abs(body.positions).max(initial=0.0))
    for nodes in kinds.values():
        place = body.positions[nodes]
        radius = np.hypot(place[:, 0], place[:, 1])
        if len(nodes) < 2 or radius.min() <= ON_AXIS * size:
            continue
        angle = np.mod(np.arctan2(place[:, 1], place[:, 0]), 2 * np.pi)
        order = np.argsort(angle)
        if evenly_placed(angle) and (best is None or len(nodes) > len(best)):
            best = np.asarray(nodes, dtype=np.int64)[order]
    return best


def _transverse_projector(body: Body) -> Array:
    """Projector (d_b, d_b) from the coordinates of a body to its motion x, y, rx, ry."""
    if body.rigid:
        motions = body.rigid_motions
        return np.asarray(motions @ np.diag([1.0, 1.0, 0.0, 1.0, 1.0, 0.0]) @ motions.T)
    transverse = body.node_map.copy()
    transverse[2::6] = transverse[5::6] = 0.0
    return np.asarray(np.linalg.lstsq(body.node_map, transverse, rcond=None)[0])


@dataclass(frozen=True)
class LoadedGearMesh:
    """A gear mesh of a stage: its stiffness over the cycle, its mean force, N, its planet."""

    cycle: FlankCycle
    force: float
    planet: int


def decay(structural: Array, modes: Modes, cycles: Mapping[int, FlankCycle]) -> Array:
    """Decay rates γ = 2ζω of modes (m,), 1/s; structural (m,): their part by structural damping,
    dampers and brakes."""
    total = structural
    for cycle in cycles.values():
        total = total + cycle.damping.mean() * cycle.closing(modes.shapes) ** 2
    return np.asarray(total)


def resonant_force(
    modes: Modes,
    rates: Array,
    gear_meshes: Sequence[LoadedGearMesh],
    orders: Sequence[int],
    groups: Sequence[Ints],
    alone: int | None = None,
) -> Array:
    """Amplitude of gear-mesh force at resonance over the mean force, the largest of all gear meshes
    (orders, groups); infinite without damping.

    rates: γ of the modes (m,), 1/s; groups: indices of modes of one frequency; alone: the planet
    whose gear meshes alone excite the modes, None for all.
    """
    omega = 2 * np.pi * modes.frequencies
    closing = np.stack([gear_mesh.cycle.closing(modes.shapes) for gear_mesh in gear_meshes])
    stiffness = np.array([gear_mesh.cycle.stiffness.mean() for gear_mesh in gear_meshes])
    mean = np.array([gear_mesh.force for gear_mesh in gear_meshes])
    out = np.zeros((len(orders), len(groups)))
    for row, order in zip(out, orders, strict=True):
        force = sum(
            gear_mesh.cycle.harmonic_force(order)
            for gear_mesh in gear_meshes
            if alone in (None, gear_mesh.planet)
        )
        work = modes.shapes.T @ force
        for g, group in enumerate(groups):
            with np.errstate(divide="ignore", invalid="ignore"):
                response = closing[:, group] @ (work[group] / (omega[group] * rates[group]))
            row[g] = np.nan_to_num(stiffness * np.abs(response) / mean, nan=np.inf).max()
    return out


ALIKE = 1e-3  # relative difference of frequencies of modes that are taken together
PRESENT = 0.1  # action over the largest of a mode, above which a mode takes part in an instability
ROUNDING = 1e-7  # |μ| − 1 that double multipliers on the unit circle have by rounding
NEGLIGIBLE = 1e-6  # growth rate over frequency below which there is no growth


@dataclass(frozen=True)
class PeriodicTrain:
    """Matrices of a train in n elastic modes with periodic gear-mesh stiffness.

    omega (n,): frequencies with the mean stiffness, rad/s, rising; stiffness, damping (P, n, n): in
    each part of the cycle; gyroscopic, centripetal (n, n): at rated speed; rate: gear-mesh
    frequency at rated speed, rad/s.
    """

    omega: Array
    stiffness: Array
    damping: Array
    gyroscopic: Array
    centripetal: Array
    rate: float

    def mode(self, number: int) -> PeriodicTrain:
        """The train in one of its modes, by index."""
        one = slice(number, number + 1)
        return PeriodicTrain(
            self.omega[one], self.stiffness[:, one, one], self.damping[:, one, one],
            self.gyroscopic[one, one], self.centripetal[one, one], self.rate,
        )  # fmt: skip

    def with_following(self, count: int) -> PeriodicTrain:
        """The train in its first modes; the others follow without inertia, as far as the stiffness
        of each part of the cycle lets them."""
        keep, follow = slice(None, count), slice(count, None)
        k, n = self.stiffness, len(self.omega)
        motion = np.zeros((len(k), n, count))  # of all modes per kept one
        motion[:, keep] = np.eye(count)
        motion[:, follow] = -np.linalg.solve(k[:, follow, follow], k[:, follow, keep])
        stiffness, damping = (motion.swapaxes(1, 2) @ a @ motion for a in (k, self.damping))
        turning = self.gyroscopic[keep, keep], self.centripetal[keep, keep]
        return PeriodicTrain(self.omega[keep], stiffness, damping, *turning, self.rate)

    def monodromy(self, factor: float) -> Array:
        """Monodromy matrix (2n, 2n) of (Ω q, q̇) at ``factor`` times rated speed."""
        n = len(self.omega)
        scale = float(np.sqrt(np.mean(self.omega**2)))
        first, lengths = self._pieces
        a = np.zeros((len(first), 2 * n, 2 * n))
        a[:, :n, n:] = scale * np.eye(n)
        a[:, n:, :n] = (factor**2 * self.centripetal - self.stiffness[first]) / scale
        a[:, n:, n:] = -self.damping[first] - factor * self.gyroscopic
        part = 2 * np.pi / (self.rate * factor) / len(self.stiffness)
        out = np.eye(2 * n)
        for step in linalg.expm(a * (part * lengths)[:, None, None]):
            out = step @ out
        return out

    def fastest(self, factor: float) -> tuple[float, complex, Array]:
        """Largest growth rate, 1/s, 0 without growth; the multiplier of this motion, and the shares
        of the modes (n,) in its energy."""
        n = len(self.omega)
        multipliers, vectors = linalg.eig(self.monodromy(factor))
        k = int(np.argmax(np.abs(multipliers)))
        over = abs(multipliers[k]) - 1.0
        motion, rate = vectors[:n, k], vectors[n:, k]
        scale = float(np.mean(self.omega**2))
        energy = np.abs(motion) ** 2 * self.omega**2 / scale + np.abs(rate) ** 2
        energy /= energy.sum()
        growth = math.log1p(over) * self.rate * factor / (2 * np.pi) if over > ROUNDING else 0.0
        if growth < NEGLIGIBLE * float(energy @ self.omega):
            growth = 0.0
        return growth, complex(multipliers[k]), energy

    @property
    def _pieces(self) -> tuple[Ints, Ints]:
        """Sequences of equal parts: index of the first part, and number of parts."""
        matrices = np.concatenate([self.stiffness, self.damping], axis=1)
        change = np.abs(np.diff(matrices, axis=0)).max(axis=(1, 2)) > 1e-12 * np.abs(matrices).max()
        first = np.concatenate([[0], 1 + np.flatnonzero(change)]).astype(np.int64)
        return first, np.diff([*first, len(self.stiffness)]).astype(np.int64)

    def variation(self, order: int) -> Complex:
        """Fourier coefficient K_l (n, n) of the stiffness K(ψ) = Re Σ_l K_l e^{ilψ}, l ≥ 1."""
        count = len(self.stiffness)
        phase = np.exp(-2j * np.pi * order * np.arange(count) / count)
        return np.asarray(2 * np.tensordot(phase, self.stiffness, 1) / count)

    @property
    def decay(self) -> Array:
        """Mean decay rates γ = 2ζω of the modes (n,), 1/s."""
        return np.clip(np.diag(self.damping.mean(axis=0)), 0.0, None)

    def expected(self, orders: int) -> tuple[Array, Array]:
        """Instability bands to first order, for orders 1 … ``orders`` and all pairs of modes: speed
        factors (e,) of their middles, and half widths (e,) without damping."""
        root = np.sqrt(np.outer(self.omega, self.omega))
        sums = self.omega[:, None] + self.omega
        decay = self.decay
        centres, widths = [], []
        for order in range(1, orders + 1):
            growth = np.abs(self.variation(order)) / (4 * root)
            growing = growth > np.maximum(0.5 * np.sqrt(np.outer(decay, decay)), 1e-6 * root)
            at = np.nonzero(np.triu(growing))
            centres.append(sums[at] / (order * self.rate))
            widths.append(2 * growth[at] / (order * self.rate))
        return np.concatenate(centres), np.concatenate(widths)


def acting_modes(omega: Array, action: Array, rate: float) -> tuple[int, int, int]:
    """Modes i ≤ j and order l of an instability l ω_z ≈ ω_i + ω_j at ω_z = ``rate``, rad/s.

    One of them is the mode that is fed most, modes of equal frequency taken together; the other is
    the mode with a significant share whose sum of frequencies with it is nearest to an order.
    action (n,): E (γ + 2σ)/ω of the modes with frequencies omega (n,), rad/s, that grow at the rate
    σ; both modes of a combination are fed alike (Manley and Rowe 1956), although one of less
    damping has most of the energy E.
    """
    together = np.array([action[np.abs(omega - w) <= ALIKE * w].sum() for w in omega])
    i = int(np.argmax(together))
    others = np.flatnonzero(together >= PRESENT * together[i])
    orders = np.maximum(np.round((omega[i] + omega[others]) / rate), 1.0)
    best = int(np.argmin(np.abs(omega[i] + omega[others] - orders * rate)))
    j = int(others[best])
    if abs(omega[j] - omega[i]) <= ALIKE * omega[i]:
        j = i
    return min(i, j), max(i, j), int(orders[best])
