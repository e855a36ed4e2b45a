"""Excitation of modes by the varying gear-mesh stiffness: resonances, parametric instability.

Which orders of gear meshes drive a mode, and the force that they raise where they meet it.

A stage of N equal planets at equal places repeats after 2π/N. In a mode what one planet does is
what the one before does times e^{2πik/N}: k = 0, all alike (rotational and axial modes of Lin &
Parker); k = 1, N − 1 (translational, tilting); or another (planet modes, in which the central
members are at rest). On a ring, waves of n nodal diameters belong to k = n mod N. Real modes hold k
and N − k alike and are given the smaller.

Order l of the gear-mesh frequency meets planet i with the phase l z_s φ_i, so that it pushes with

    k = l z_s mod N

and does no work on any other mode, as long as planets and what is between them are equal.

Source: Lin & Parker 1999, J. Vib. Acoust. 121:316; Parker 2000, J. Sound Vib. 236:561.

Gear-mesh force that an order of the gear-mesh frequency raises in modes that it meets exactly.

The stiffness of gear mesh m varies about its mean as Re Σ_l k_l e^{ilψ}. Under its mean force F̄ it
is closed by x̄ = F̄/k̄, so that order l pushes the bodies with g_l x̄ (g_l: force of the rows on all
coordinates per metre, ``FlankCycle``). Modes j of one frequency answer at it with

    η_j = Σ_m φ_jᵀ g_{m,l} x̄_m / (ω_j γ_j),   γ_j = 2 ζ_j ω_j,

which raises the force k̄_m |Σ_j v_mᵀ φ_j η_j| in gear mesh m, v_m being its mean row. γ_j is the
decay of the mode: φ_jᵀ C φ_j of the structure's damping, and that of tooth pairs.
First order in the variation, one group of modes, teeth that stay in contact.

Growth of free vibration under gear-mesh stiffness that varies with the gear-mesh frequency.

In modes of the mean stiffness, about a steady state without loss of contact,

    q̈ + (C(ψ) + s G) q̇ + (K(ψ) − s² K_c) q = 0,   ψ = ω_z t,

G and K_c gyroscopic and centripetal at rated speed, s speed over it. K and C are constant over each
of P equal parts of the gear-mesh period T = 2π/ω_z, so that the monodromy matrix is exact,

    y(T) = Π_p exp(A_p T/P) y(0),   y = (Ω q, q̇),   A_p = [[0, Ω], [−K_p/Ω, −C_p]],

with any frequency Ω that balances the two. Its eigenvalues μ are the Floquet multipliers; vibration
grows by ln|μ|/T where one of them is outside the unit circle (Floquet 1883; Nayfeh & Mook 1979,
chapter 5). To first order in the variation K_l of K at order l, symmetric, this happens about

    l ω_z = ω_i + ω_j  within  ± 2σ_ij  without damping,   σ_ij = |K_l,ij|/(4 √(ω_i ω_j)),

with the growth σ_ij in the middle; damping that lets modes decay by γ/2 prevents it where
σ² < γ_i γ_j/4 (Lin & Parker 2002, J. Sound Vib. 249:129, for gears).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg

from flexgear.analysis.modes import FlankCycle, Modes
from flexgear.arrays import Array, Complex, Ints
from flexgear.coupling.system import System
from flexgear.structures.bodies import Body

MIXED, ABSENT, UNEVEN = -1, -2, -3  # in place of an index
PURE = 0.9  # share of the stage's energy that one k and N − k have
LEAST = 1e-6  # share of the train's energy in a stage without which it is at rest
EVEN = 1e-9  # rad, by which places of planets may miss equal ones
ON_AXIS = 1e-9  # of the body's size


def excited_index(order: float, sun_teeth: int, planets: int) -> int:
    """Nodal index k = l z_s mod N that order l of a gear mesh excites; N equal, evenly spaced
    planets (Parker 2000, J. Sound Vib. 236:561)."""
    return round(order * sun_teeth) % planets


def folded(index: int, planets: int) -> int:
    """The smaller of k and N − k."""
    return min(index % planets, -index % planets)


def evenly_placed(angles: ArrayLike) -> bool:
    """Whether planets (N,) rad stand at equal distances."""
    turns = np.sort(np.mod(np.asarray(angles, dtype=float), 2 * np.pi))
    gaps = np.diff([*turns, turns[0] + 2 * np.pi])
    return bool(np.abs(gaps - 2 * np.pi / len(turns)).max() <= EVEN)


def nodal_indices(system: System, shapes: Array, stage: str, angles: Sequence[float]) -> Ints:
    """min(k, N − k) of modes (d, m) in a stage with planets at ``angles`` (N,) rad.

    MIXED where no k has nine tenths of the stage's kinetic energy, ABSENT in modes that leave it at
    rest, UNEVEN where planets do not stand at equal distances.
    """
    if not evenly_placed(angles):
        return np.full(shapes.shape[1], UNEVEN, dtype=np.int64)
    count = len(angles)
    energy = np.zeros((count // 2 + 1, shapes.shape[1]))
    bodies = {b.name: b for b in system.bodies if b.name.stage == stage}
    planets = [name for name in bodies if name.planet >= 0]
    for name, body in bodies.items():
        if body.size and (name not in planets or count == 1):
            dofs = system.slice_of(name)
            energy += _central(body, system.mass[dofs, dofs], shapes[dofs], count)
    if count > 1:
        order = np.argsort(np.mod(angles, 2 * np.pi))
        energy += _of_planets(system, [planets[i] for i in order], shapes)
    whole = energy.sum(axis=0)
    indices = np.argmax(energy, axis=0).astype(np.int64)
    indices[energy.max(axis=0) < PURE * whole] = MIXED
    indices[whole < LEAST * np.einsum("dm,dm->m", shapes, system.mass @ shapes)] = ABSENT
    return indices


def _of_planets(system: System, names: list[str], shapes: Array) -> Array:
    """Energy (N // 2 + 1, m) of planets, in their axes, by wave from planet to planet; of FE
    planets, each of which has turned by another angle, that of their mean axes."""
    starts = [system.slice_of(name).start for name in names]
    count = min(system.body(names[0]).size, 6)
    dofs = [slice(start, start + count) for start in starts]
    motion = np.stack([shapes[at] for at in dofs])
    mass = system.mass[dofs[0], dofs[0]]
    waves = np.fft.fft(motion, axis=0) / np.sqrt(len(names))
    energy = np.einsum("kim,ij,kjm->km", waves.conj(), mass, waves).real
    return _fold(energy, len(names))


def _central(body: Body, mass: Array, shapes: Array, planets: int) -> Array:
    """Energy of a central body: by the waves of its nodes round the axis, or where all of them are
    on the axis or it is rigid, by the motions across the axis (k = 1) and along and about it."""
    energy = np.einsum("im,ij,jm->m", shapes, mass, shapes)
    nodes = _largest_circle(body)
    if body.rigid or nodes is None:
        across = _across(body)
        part = across @ shapes
        sideways = np.einsum("im,ij,jm->m", part, mass, part)
        out = np.zeros((planets // 2 + 1, shapes.shape[1]))
        out[0] += energy - sideways
        out[1 % planets if planets > 1 else 0] += sideways
        return out
    angle = np.arctan2(body.positions[nodes, 1], body.positions[nodes, 0])
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    rows = body.node_map.reshape(-1, 6, body.node_map.shape[1])[nodes, :3]
    x, y, z = np.moveaxis(rows @ shapes, 1, 0)
    local = np.stack([c * x + s * y, c * y - s * x, z])
    waves = np.sum(np.abs(np.fft.fft(local, axis=1)) ** 2, axis=0)  # (nodes, m)
    by_wave = _by_remainder(waves, planets)
    total = by_wave.sum(axis=0)
    share = np.divide(by_wave, total, out=np.zeros_like(by_wave), where=total > 0)
    return _fold(share * energy, planets)


def _by_remainder(waves: Array, planets: int) -> Array:
    """Sums (N, m) over the waves n = −z/2 … z/2 of z places by n mod N."""
    z = len(waves)
    number = np.round(np.fft.fftfreq(z) * z).astype(int)
    out = np.zeros((planets, waves.shape[1]))
    np.add.at(out, number % planets, waves)
    return out


def _fold(energy: Array, planets: int) -> Array:
    """Energies (N, m) of k and N − k together, (N // 2 + 1, m)."""
    out = np.zeros((planets // 2 + 1, energy.shape[1]))
    for k in range(planets):
        out[folded(k, planets)] += energy[k]
    return out


def _largest_circle(body: Body) -> Ints | None:
    """Nodes of the largest set of one kind of name that stand evenly on a circle round the axis, in
    the order of their angles; None where there are none."""
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


def _across(body: Body) -> Array:
    """Projector (d_b, d_b) of the coordinates of a body on its axis to motion across it."""
    if body.rigid:
        motions = body.rigid_motions
        return np.asarray(motions @ np.diag([1.0, 1.0, 0.0, 1.0, 1.0, 0.0]) @ motions.T)
    picked = body.node_map.copy()
    picked[2::6] = picked[5::6] = 0.0
    return np.asarray(np.linalg.lstsq(body.node_map, picked, rcond=None)[0])


@dataclass(frozen=True)
class Loaded:
    """A gear mesh of a stage: its cycle, its mean force N, its planet."""

    cycle: FlankCycle
    force: float
    planet: int


def decay(structural: Array, modes: Modes, cycles: Mapping[int, FlankCycle]) -> Array:
    """γ = 2ζω of modes (m,), 1/s; structural: (m,) what springs between bodies and masses give."""
    total = structural
    for cycle in cycles.values():
        closing = _mean_row(cycle) @ modes.shapes
        total = total + cycle.damping.mean() * closing**2
    return np.asarray(total)


def resonant_force(
    modes: Modes,
    rates: Array,
    gear_meshes: Sequence[Loaded],
    orders: Sequence[int],
    groups: Sequence[Ints],
    alone: int | None = None,
) -> Array:
    """Amplitude of gear-mesh force at resonance over the mean force, the largest of all gear meshes
    (orders, groups); infinite without damping.

    rates: γ of the modes (m,); groups: indices of modes of one frequency; alone: the only planet
    whose gear meshes push.
    """
    omega = 2 * np.pi * modes.frequencies
    closing = np.stack([_mean_row(gear_mesh.cycle) @ modes.shapes for gear_mesh in gear_meshes])
    stiffness = np.array([gear_mesh.cycle.stiffness.mean() for gear_mesh in gear_meshes])
    mean = np.array([gear_mesh.force for gear_mesh in gear_meshes])
    out = np.zeros((len(orders), len(groups)))
    for row, order in zip(out, orders, strict=True):
        pushed = sum(
            gear_mesh.force / k * gear_mesh.cycle.harmonic_force(order)
            for gear_mesh, k in zip(gear_meshes, stiffness, strict=True)
            if alone in (None, gear_mesh.planet)
        )
        work = modes.shapes.T @ pushed
        for g, group in enumerate(groups):
            with np.errstate(divide="ignore", invalid="ignore"):
                answer = closing[:, group] @ (work[group] / (omega[group] * rates[group]))
            row[g] = np.nan_to_num(stiffness * np.abs(answer) / mean, nan=np.inf).max()
    return out


def _mean_row(cycle: FlankCycle) -> Array:
    """v (d,), closing of a gear mesh by all coordinates, weighted by its stiffness."""
    return np.asarray((cycle.force.mean(axis=0) @ cycle.blocks) / cycle.stiffness.mean())


ALIKE = 1e-3  # relative, of frequencies of modes that act as one
PRESENT = 0.1  # of the largest energy of a mode, of those that may have a part in an instability
ROUNDING = 1e-7  # of |μ| − 1: modes that collide on the unit circle are that far off it
NEGLIGIBLE = 1e-6  # of the frequency of what grows: a growth below it is none


@dataclass(frozen=True)
class PeriodicTrain:
    """Matrices of a train in n elastic modes; see above.

    omega: (n,) rad/s rising, of the mean stiffness; stiffness, damping: (P, n, n); gyroscopic,
    centripetal: (n, n) at rated speed; rate: gear-mesh frequency at rated speed, rad/s.
    """

    omega: Array
    stiffness: Array
    damping: Array
    gyroscopic: Array
    centripetal: Array
    rate: float

    def monodromy(self, factor: float) -> Array:
        """(2n, 2n) of (Ω q, q̇) over a gear-mesh period, at ``factor`` times rated speed."""
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
        """Growth in 1/s of what grows fastest, 0 where nothing does; its multiplier, and the
        energies of the modes (n,) in it."""
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
        """First parts of runs of parts alike, and how many each has."""
        matrices = np.concatenate([self.stiffness, self.damping], axis=1)
        change = np.abs(np.diff(matrices, axis=0)).max(axis=(1, 2)) > 1e-12 * np.abs(matrices).max()
        first = np.concatenate([[0], 1 + np.flatnonzero(change)]).astype(np.int64)
        return first, np.diff([*first, len(self.stiffness)]).astype(np.int64)

    def variation(self, order: int) -> Complex:
        """Fourier coefficient K_l (n, n) of the stiffness K(ψ) = Re Σ_l K_l e^{ilψ}, l ≥ 1."""
        turn = np.exp(-2j * np.pi * order * np.arange(len(self.stiffness)) / len(self.stiffness))
        return np.asarray(2 * np.tensordot(turn, self.stiffness, 1) / len(self.stiffness))

    def expected(self, orders: int) -> tuple[Array, Array]:
        """Speed factors (e,) in the middle of bands to first order, and half their widths over
        order, those without damping; of orders 1 … and all pairs of modes."""
        root = np.sqrt(np.outer(self.omega, self.omega))
        sums = self.omega[:, None] + self.omega
        decay = np.clip(np.diag(self.damping.mean(axis=0)), 0.0, None)
        centres, widths = [], []
        for order in range(1, orders + 1):
            growth = np.abs(self.variation(order)) / (4 * root)
            growing = growth > np.maximum(0.5 * np.sqrt(np.outer(decay, decay)), 1e-6 * root)
            at = np.nonzero(np.triu(growing))
            centres.append(sums[at] / (order * self.rate))
            widths.append(2 * growth[at] / (order * self.rate))
        return np.concatenate(centres), np.concatenate(widths)


def acting_modes(omega: Array, energy: Array, rate: float) -> tuple[int, int, int]:
    """Modes i ≤ j and order l of an instability l ω_z ≈ ω_i + ω_j at ω_z = ``rate``, rad/s.

    i has most of the energy, modes of one frequency taken together, and j is the one of those with
    a part in it whose sum with i meets an order most closely.
    """
    together = np.array([energy[np.abs(omega - w) <= ALIKE * w].sum() for w in omega])
    i = int(np.argmax(together))
    others = np.flatnonzero(together >= PRESENT * together[i])
    orders = np.maximum(np.round((omega[i] + omega[others]) / rate), 1.0)
    best = int(np.argmin(np.abs(omega[i] + omega[others] - orders * rate)))
    j = int(others[best])
    if abs(omega[j] - omega[i]) <= ALIKE * omega[i]:
        j = i
    return min(i, j), max(i, j), int(orders[best])
