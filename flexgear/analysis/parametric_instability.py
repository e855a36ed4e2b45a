r"""Growth of free vibration under gear-mesh stiffness that varies with the gear-mesh frequency.

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
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from flexgear.arrays import Array, Complex, Ints

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
        both = np.concatenate([self.stiffness, self.damping], axis=1)
        change = np.abs(np.diff(both, axis=0)).max(axis=(1, 2)) > 1e-12 * np.abs(both).max()
        first = np.concatenate([[0], 1 + np.flatnonzero(change)]).astype(np.int64)
        return first, np.diff([*first, len(self.stiffness)]).astype(np.int64)

    def variation(self, order: int) -> Complex:
        """K_l (n, n), K(ψ) = Re Σ_l K_l e^{ilψ}, of an order l from 1 on."""
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
